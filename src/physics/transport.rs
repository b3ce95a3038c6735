//! What a layered medium does with light that enters at a point: the transport equation itself, not its
//! diffusion approximation, one spatial frequency at a time.
//!
//! Light that varies along the surface as e^{isx} stays of that frequency as it goes down and up. What is
//! left is an integral equation over depth for the moments of the radiance in real spherical harmonics, up
//! to those of the order of the phase function; its kernel is what a direction's ray attenuates, a complex
//! number, since the phase of the wave turns along it. Cells of depth, a line in each, make it a small
//! dense system. Over frequencies the answers make the Hankel transform of R(r), which a sum of Gaussians
//! is then fitted to. docs/physics.md has the errors of each step.
//!
//! - W. J. Wiscombe, *The delta-M method*, J. Atmos. Sci. 34, 1977: phase functions of a forward peak.
//! - T. Nakajima & M. Tanaka, *Algorithms for radiative intensity calculations in moderately thick
//!   atmospheres using a truncation approximation*, JQSRT 40, 1988: single scattering by the exact one.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::complex::Complex;
use super::kernel::{Kernel, Ray, harmonics};
use super::linear::{nnls, solve_near_one};
use super::quadrature::{Direction, directions, fresnel, gauss, henyey_greenstein};
use super::{Layer, Medium, Response, number};
use crate::Error;

/// How light comes in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Incidence {
    /// Straight down; R is per power that has entered.
    #[default]
    Normal,
    /// From everywhere alike; R is per power that arrives, part of which the surface reflects.
    Cosine,
}

/// The solver and its settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transport {
    /// How light comes in; straight down by default.
    pub incidence: Incidence,
    /// The order of δ-M, 0 to 2: how many moments of the phase function are kept apart from its forward
    /// peak. 0 is isotropic scattering by σs′; 2, the default, is exact for g = 0 and nearly so for skin's.
    pub order: usize,
}

impl Default for Transport {
    fn default() -> Self {
        Self { incidence: Incidence::Normal, order: 2 }
    }
}

/// Cells to a mean free path at an interface: more where the wave is wide and much of the light has been
/// scattered often, which takes few azimuths. docs/physics.md has what each of these numbers costs.
const CELLS: [f64; 2] = [12.0, 4.0];
/// With moments beyond the first, whose end costs R more than cells do.
const MOMENT_CELLS: [f64; 2] = [6.0, 3.0];
/// Directions to either side of the critical angle, and for light that was scattered once, which a sharp
/// wave shows by a narrow cone alone.
const DIRECTIONS: [usize; 2] = [6, 16];
/// Frequencies to a decade, and the highest in mean free paths of the densest layer.
const FREQUENCIES: f64 = 6.0;
const HIGHEST: f64 = 30.0;
/// No medium has needed half of these.
const MOST_AZIMUTHS: f64 = 1000.0;

impl Transport {
    /// What leaves a medium around the point where light entered.
    ///
    /// # Errors
    /// An order above 2; cosine incidence where scattering is anisotropic and the order above 0; a medium
    /// that sends no light back that a float could tell.
    pub fn response(&self, medium: &Medium) -> Result<Response, Error> {
        let solver = Solver::new(self, medium)?;
        let zero = solver.solve(0.0);
        let albedo = zero.sum();
        if albedo.is_nan() || albedo <= 0.0 {
            let needs = "layers that send light back";
            return Err(number("medium: albedo", albedo, needs));
        }
        let (low, high) = solver.frequencies();
        let steps = ((high / low).log10() * FREQUENCIES).ceil() as usize;
        let ratio = (high / low).powf(1.0 / steps as f64);
        let mut samples: Vec<(f64, Split)> =
            (0..=steps).map(|i| low * ratio.powi(i as i32)).map(|s| (s, solver.solve(s))).collect();
        extend(&mut samples);
        let samples: Vec<_> = [(0.0, zero)].into_iter().chain(samples).collect();
        Ok(gaussians(&samples, albedo))
    }

    /// The same of a medium each for red, green and blue light.
    ///
    /// # Errors
    /// As [`response`](Self::response).
    pub fn responses(&self, media: &[Medium; 3]) -> Result<[Response; 3], Error> {
        let [r, g, b] = media.each_ref().map(|medium| self.response(medium));
        Ok([r?, g?, b?])
    }

    /// R̂(s) = 2π∫R(r)·J₀(sr)·r dr at a frequency in rad/mm; the albedo at 0.
    ///
    /// # Errors
    /// As [`response`](Self::response), or a frequency that is negative or not finite.
    pub fn transform(&self, medium: &Medium, s_per_mm: f64) -> Result<f64, Error> {
        if !(0.0..=1e15).contains(&s_per_mm) {
            let needs = "a number of rad/mm, 0 to 1e15";
            return Err(number("transport: s_per_mm", s_per_mm, needs));
        }
        Ok(Solver::new(self, medium)?.solve(s_per_mm).sum())
    }
}

/// R̂(s), of the light scattered once and of that scattered more often.
#[derive(Clone, Copy, Debug)]
struct Split {
    once: f64,
    more: f64,
}

impl Split {
    fn sum(self) -> f64 {
        self.once + self.more
    }
}

/// Higher frequencies by how R̂ ends: single scattering as a/s + b/s², the rest as a power of s.
fn extend(samples: &mut Vec<(f64, Split)>) {
    let [.., (s0, before), (s1, last)] = samples[..] else {
        return;
    };
    let b = (before.once * s0 - last.once * s1) / (1.0 / s0 - 1.0 / s1);
    let a = last.once * s1 - b / s1;
    // At least as fast as single scattering, also where it is lost in rounding.
    let power = ((before.more / last.more).ln() / (s0 / s1).ln()).min(-1.0);
    for octave in 1..=6 {
        let s = s1 * f64::from(1 << octave);
        let once = (a / s + b / (s * s)).max(0.0);
        let more = last.more.max(0.0) * (s / s1).powf(power);
        samples.push((s, Split { once, more }));
    }
}

/// Gaussians whose transforms e^{−vs²/2} sum to the samples.
fn gaussians(samples: &[(f64, Split)], albedo: f64) -> Response {
    const RATIO: f64 = 1.4;
    let (low, high) = (samples[1].0, samples[samples.len() - 1].0);
    let (least, most) = (0.5 / high, 4.0 / low);
    let terms = ((most / least).ln() / RATIO.ln()).ceil() as i32;
    let variances: Vec<f64> = (0..=terms).map(|i| (least * RATIO.powi(i)).powi(2)).collect();
    let rows: Vec<Vec<f64>> =
        samples.iter().map(|(s, _)| variances.iter().map(|v| (-0.5 * v * s * s).exp()).collect()).collect();
    // The total is to be exact.
    let weight = |i: usize| if i == 0 { 1e3 } else { 1.0 };
    let n = variances.len();
    let mut gram = vec![vec![0.0; n]; n];
    let mut rhs = vec![0.0; n];
    for (i, (row, (_, split))) in rows.iter().zip(samples).enumerate() {
        for j in 0..n {
            rhs[j] += weight(i) * row[j] * split.sum() / albedo;
            for k in 0..n {
                gram[j][k] += weight(i) * row[j] * row[k];
            }
        }
    }
    let weights = nnls(&gram, &rhs);
    let sum: f64 = weights.iter().sum();
    let terms = variances.into_iter().zip(weights).filter(|(_, w)| *w > 0.0);
    Response::gaussians(terms.map(|(v, w)| (v, albedo * w / sum)))
}

/// A layer after δ-M: what is scattered straight on counts as not scattered.
struct Slab {
    /// 1/mm, both.
    sigma_t: f64,
    sigma_s: f64,
    /// The moments of what is left of the phase function, by degree.
    moments: [f64; 3],
    thickness_mm: f64,
    /// The unscaled layer.
    layer: Layer,
    /// Optical depth of its top.
    tau: f64,
}

impl Slab {
    fn new(layer: &Layer, order: usize) -> Self {
        let peak = layer.g.powi(order as i32 + 1);
        let sigma_s = layer.sigma_s_per_mm * (1.0 - peak);
        let moment = |l: i32| (layer.g.powi(l) - peak) / (1.0 - peak); // of use up to the order
        Self {
            sigma_t: layer.sigma_a_per_mm + sigma_s,
            sigma_s,
            moments: [moment(0), moment(1), moment(2)],
            thickness_mm: layer.thickness_mm,
            layer: *layer,
            tau: 0.0,
        }
    }

    /// How deep, in mm, light goes that comes back.
    fn depth_mm(&self) -> f64 {
        let free = 1.0 / self.sigma_t;
        let diffuse = 10.0 / self.layer.sigma_tr();
        (14.0 * free).max(diffuse.min(2e4 * free))
    }
}

struct Cell {
    slab: usize,
    thickness_mm: f64,
}

/// A direction in which light comes in: its cosine inside, and its share of what enters.
struct Incoming {
    mu: f64,
    share: f64,
}

struct Solver {
    slabs: Vec<Slab>,
    /// Both meshes of [`CELLS`].
    meshes: [Vec<Cell>; 2],
    /// Both sets of [`DIRECTIONS`].
    directions: [Vec<Direction>; 2],
    incoming: Vec<Incoming>,
    incidence: Incidence,
    order: usize,
}

impl Solver {
    fn new(&Transport { incidence, mut order }: &Transport, medium: &Medium) -> Result<Self, Error> {
        let refuse = |needs| Err(number("transport: order", order as f64, needs));
        if order > 2 {
            return refuse("0, 1 or 2");
        }
        let isotropic = |l: &Layer| l.g == 0.0 || l.sigma_s_per_mm == 0.0;
        if medium.layers().iter().all(isotropic) {
            order = 0;
        } else if incidence == Incidence::Cosine && order > 0 {
            return refuse("0 with cosine incidence, where layers have g");
        }
        let mut slabs: Vec<Slab> = Vec::new();
        let mut tau = 0.0;
        for layer in medium.layers() {
            let mut slab = Slab { tau, ..Slab::new(layer, order) };
            tau += slab.sigma_t * slab.thickness_mm;
            // What lies below sends nothing back.
            let deep = slab.thickness_mm > slab.depth_mm();
            if deep {
                slab.thickness_mm = f64::INFINITY;
            }
            slabs.push(slab);
            if deep {
                break;
            }
        }
        let eta = medium.eta();
        let refracted = |(u, weight): (f64, f64)| {
            let mu = (1.0 - (1.0 - u) / (eta * eta)).sqrt();
            let share = weight * (1.0 - fresnel(mu, u.sqrt(), eta));
            Incoming { mu, share }
        };
        Ok(Self {
            meshes: if order == 0 { CELLS } else { MOMENT_CELLS }.map(|n| mesh(&slabs, n)),
            directions: DIRECTIONS.map(|n| directions(n, eta)),
            slabs,
            incoming: match incidence {
                Incidence::Normal => vec![Incoming { mu: 1.0, share: 1.0 }],
                Incidence::Cosine => gauss(2 * DIRECTIONS[0]).into_iter().map(refracted).collect(),
            },
            incidence,
            order,
        })
    }

    /// The least and the highest frequency that a response needs, in rad/mm.
    fn frequencies(&self) -> (f64, f64) {
        let scattering = self.slabs.iter().filter(|s| s.sigma_s > 0.0);
        let first = scattering.clone().map(|s| s.tau).fold(f64::INFINITY, f64::min);
        // What is deeper than this is not seen.
        let seen = scattering.filter(|s| s.tau < first + 8.0);
        let densest = seen.clone().map(|s| s.sigma_t).fold(0.0, f64::max);
        let fade = |s: &Slab| s.layer.sigma_tr().max(0.3 / s.thickness_mm).min(s.sigma_t);
        let widest = seen.map(fade).fold(f64::INFINITY, f64::min);
        (0.1 * widest, HIGHEST * densest)
    }

    fn solve(&self, s: f64) -> Split {
        match self.order {
            0 => self.solve_basis::<1, 1>(s, [(0, 0)]),
            1 => self.solve_basis::<3, 6>(s, [(0, 0), (1, 0), (1, 1)]),
            _ => self.solve_basis::<6, 21>(s, [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)]),
        }
    }

    /// Cosines of azimuths of a quarter turn: as many as the wave has turns along a ray before it has faded.
    fn azimuths(&self, s: f64) -> Vec<f64> {
        if s == 0.0 && self.order == 0 {
            return vec![0.0]; // of no effect
        }
        let turns = |slab: &Slab| {
            let free = 1.0 / slab.sigma_t;
            // Gaps do not fade, but end.
            let free = if slab.sigma_s > 0.0 { free } else { free.min(4.0 * slab.thickness_mm) };
            (2.0 - 0.5 * slab.tau).max(0.0) * s * free
        };
        let turns = self.slabs.iter().map(turns).fold(0.0, f64::max);
        let n = (6.0 + turns).min(MOST_AZIMUTHS).floor();
        let cos = |l: usize| ((l as f64 + 0.5) * FRAC_PI_2 / n).cos();
        (0..n as usize).map(cos).collect()
    }

    /// One frequency, with the B harmonics (l, m) of `basis`, of which there are P pairs.
    fn solve_basis<const B: usize, const P: usize>(&self, s: f64, basis: [(usize, usize); B]) -> Split {
        let azimuths = self.azimuths(s);
        let coarse = azimuths.len() > 8 && self.incidence == Incidence::Normal;
        let cells = &self.meshes[usize::from(coarse)];
        let mut kernel = Kernel::<B, P>::new(basis, cells.len());
        let mut rays = vec![Ray::default(); cells.len()];
        for d in &self.directions[0] {
            let sin = (1.0 - d.mu * d.mu).sqrt();
            let share = TAU * d.weight / azimuths.len() as f64;
            for cos_phi in &azimuths {
                self.trace(cells, d.mu, s * sin * cos_phi, &mut rays);
                kernel.add(&rays, harmonics(basis, d.mu, sin, *cos_phi), share, d);
            }
        }
        // Light not yet scattered. Isotropic scattering minds its fluence alone, where it comes in aslant.
        let straight = harmonics(basis, 1.0, 0.0, 1.0);
        let mut source = vec![0.0; 2 * B * cells.len()];
        for Incoming { mu, share } in &self.incoming {
            let sin = (1.0 - mu * mu).sqrt();
            // Straight down, none matters.
            let azimuths = &azimuths[..if *mu < 1.0 { azimuths.len() } else { 1 }];
            let share = share / mu / azimuths.len() as f64;
            for cos_phi in azimuths {
                self.trace(cells, *mu, s * sin * cos_phi, &mut rays);
                for (to, ray) in source.chunks_mut(2 * B).zip(&rays) {
                    for (b, y) in straight.iter().enumerate() {
                        to[b] += share * y * ray.top[0].re;
                        to[B + b] += share * y * 3.0 * ray.top[1].re;
                    }
                }
            }
        }
        let scatters = |cell: usize, l: usize| {
            let Cell { slab, thickness_mm } = cells[cell];
            self.slabs[slab].sigma_s * self.slabs[slab].moments[l] * thickness_mm
        };
        // (I − K)x = b.
        let mut matrix = kernel.matrix(scatters);
        let size = source.len();
        matrix.iter_mut().for_each(|k| *k = -*k);
        matrix.iter_mut().step_by(size + 1).for_each(|k| *k += 1.0);
        let mut light = source.clone();
        solve_near_one(&mut matrix, &mut light);
        let emitted = kernel.emitted(scatters);
        let leaves = |x: &[f64]| emitted.iter().zip(x).map(|(e, x)| e * x).sum::<f64>();
        let first = leaves(&source);
        Split {
            once: match self.incidence {
                Incidence::Normal => self.once(s, &azimuths),
                Incidence::Cosine => first,
            },
            more: leaves(&light) - first,
        }
    }

    /// A direction through the cells, of a wave that turns by `wave` a mm of the way.
    fn trace(&self, cells: &[Cell], mu: f64, wave: f64, rays: &mut [Ray]) {
        let mut through = Complex::ONE;
        for (ray, cell) in rays.iter_mut().zip(cells) {
            let sigma_t = self.slabs[cell.slab].sigma_t;
            *ray = Ray::new(Complex::new(sigma_t, wave) * (cell.thickness_mm / mu), through);
            through = through * ray.pass;
        }
    }

    /// What of light that came straight down leaves after one event, with the exact phase function.
    fn once(&self, s: f64, azimuths: &[f64]) -> f64 {
        let mut sum = 0.0;
        for d in self.directions[1].iter().filter(|d| d.fresnel < 1.0) {
            let leaves = TAU * d.weight * (1.0 - d.fresnel) / azimuths.len() as f64;
            let sin = (1.0 - d.mu * d.mu).sqrt();
            for cos_phi in azimuths {
                let mut through = Complex::ONE;
                for slab in &self.slabs {
                    let fade = Complex::new(slab.sigma_t * (1.0 + d.mu), s * sin * cos_phi) * (1.0 / d.mu);
                    let pass = match slab.thickness_mm {
                        f64::INFINITY => Complex::default(),
                        mm => (fade * mm).exp_neg(),
                    };
                    if slab.sigma_s > 0.0 {
                        let scattered = through * (Complex::ONE - pass) * fade.recip();
                        sum += leaves * self.back(slab, d.mu) * scattered.re;
                    }
                    through = through * pass;
                }
            }
        }
        sum
    }

    /// What a layer scatters, per mm and solid angle, from straight down to a cosine `mu` up: by Henyey &
    /// Greenstein's phase function; order 0 knows σs′ alone.
    fn back(&self, slab: &Slab, mu: f64) -> f64 {
        if self.order == 0 {
            return slab.sigma_s / (4.0 * PI);
        }
        slab.layer.sigma_s_per_mm * henyey_greenstein(slab.layer.g, -mu)
    }
}

/// Cells that are a part of the mean free path at each interface and grow away from it.
fn mesh(slabs: &[Slab], n: f64) -> Vec<Cell> {
    let mut cells = Vec::new();
    for (slab, s) in slabs.iter().enumerate() {
        let free = 1.0 / s.sigma_t;
        let size = |d: f64| ((free + 4.0 * d) / n).min((40.0 * free).max(2.0 * d) / n);
        let grow = |depth: f64| {
            let mut sizes = Vec::new();
            let mut d = 0.0;
            while d < depth {
                sizes.push(size(d));
                d += size(d);
            }
            sizes
        };
        let sizes = if s.thickness_mm == f64::INFINITY {
            // What only absorbs sends nothing back.
            grow(if s.sigma_s > 0.0 { s.depth_mm() } else { 0.0 })
        } else if s.sigma_s == 0.0 || s.thickness_mm <= 1.5 * size(0.0) {
            vec![s.thickness_mm]
        } else {
            let mut sizes = grow(0.5 * s.thickness_mm);
            let scale = 0.5 * s.thickness_mm / sizes.iter().sum::<f64>();
            sizes.iter_mut().for_each(|h| *h *= scale);
            let mirrored = sizes.clone();
            sizes.extend(mirrored.iter().rev());
            sizes
        };
        let cell = |thickness_mm| Cell { slab, thickness_mm };
        cells.extend(sizes.into_iter().map(cell));
    }
    cells
}
