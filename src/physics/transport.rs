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
use super::quadrature::{Direction, directions, fresnel, gauss};
use super::{Layer, Medium, Response};
use crate::Error;
use crate::plan::nnls::nnls;

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
        Self {
            incidence: Incidence::Normal,
            order: 2,
        }
    }
}

/// Cells to a mean free path at an interface: more where the wave is wide and much of the light has been
/// scattered often, which takes few azimuths. docs/physics.md has what each of these numbers costs.
const CELLS: [f64; 2] = [12.0, 4.0];
/// With moments beyond the first, whose end costs R more than cells do.
const MOMENT_CELLS: [f64; 2] = [6.0, 4.0];
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
            return Err(Error::new(
                "medium",
                format!("an albedo of {albedo}"),
                needs,
            ));
        }
        let (low, high) = solver.frequencies();
        let steps = ((high / low).log10() * FREQUENCIES).ceil() as usize;
        let ratio = (high / low).powf(1.0 / steps as f64);
        let mut samples: Vec<(f64, Split)> = (0..=steps)
            .map(|i| low * ratio.powi(i as i32))
            .map(|s| (s, solver.solve(s)))
            .collect();
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
            return Err(Error::new(
                "transport: s_per_mm",
                s_per_mm.to_string(),
                needs,
            ));
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
    let ends = last.more > 0.0 && before.more > last.more;
    let power = if ends {
        (before.more / last.more).ln() / (s0 / s1).ln()
    } else {
        0.0
    };
    for octave in 1..=6 {
        let s = s1 * f64::from(1 << octave);
        let once = (a / s + b / (s * s)).max(0.0);
        let more = if ends {
            last.more * (s / s1).powf(power)
        } else {
            0.0
        };
        samples.push((s, Split { once, more }));
    }
}

/// Gaussians whose transforms e^{−vs²/2} sum to the samples.
fn gaussians(samples: &[(f64, Split)], albedo: f64) -> Response {
    const RATIO: f64 = 1.4;
    let (low, high) = (samples[1].0, samples[samples.len() - 1].0);
    let (least, most) = (0.5 / high, 4.0 / low);
    let terms = ((most / least).ln() / RATIO.ln()).ceil() as i32;
    let variances: Vec<f64> = (0..=terms)
        .map(|i| (least * RATIO.powi(i)).powi(2))
        .collect();
    let rows: Vec<Vec<f64>> = samples
        .iter()
        .map(|(s, _)| variances.iter().map(|v| (-0.5 * v * s * s).exp()).collect())
        .collect();
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
        let moment = |l: i32| {
            if l as usize > order {
                0.0
            } else {
                (layer.g.powi(l) - peak) / (1.0 - peak)
            }
        };
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

struct Solver {
    slabs: Vec<Slab>,
    /// Both meshes of [`CELLS`].
    meshes: [Vec<Cell>; 2],
    /// Both sets of [`DIRECTIONS`].
    directions: [Vec<Direction>; 2],
    incidence: Incidence,
    order: usize,
    eta: f64,
}

impl Solver {
    fn new(transport: &Transport, medium: &Medium) -> Result<Self, Error> {
        let Transport {
            incidence,
            mut order,
        } = *transport;
        if order > 2 {
            return Err(Error::new(
                "transport: order",
                order.to_string(),
                "0, 1 or 2",
            ));
        }
        let scattering = medium.layers().iter().filter(|l| l.sigma_s_per_mm > 0.0);
        if scattering.clone().all(|l| l.g == 0.0) {
            order = 0;
        } else if incidence == Incidence::Cosine && order > 0 {
            let needs = "0 with cosine incidence, where layers have g";
            return Err(Error::new("transport: order", order.to_string(), needs));
        }
        let mut slabs: Vec<Slab> = Vec::new();
        let mut tau = 0.0;
        for layer in medium.layers() {
            let mut slab = Slab {
                tau,
                ..Slab::new(layer, order)
            };
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
        Ok(Self {
            meshes: if order == 0 { CELLS } else { MOMENT_CELLS }.map(|n| mesh(&slabs, n)),
            directions: DIRECTIONS.map(|n| directions(n, medium.eta())),
            slabs,
            incidence,
            order,
            eta: medium.eta(),
        })
    }

    /// The least and the highest frequency that a response needs, in rad/mm.
    fn frequencies(&self) -> (f64, f64) {
        let scattering = self.slabs.iter().filter(|s| s.sigma_s > 0.0);
        let first = scattering
            .clone()
            .map(|s| s.tau)
            .fold(f64::INFINITY, f64::min);
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

    /// Azimuths of a quarter turn: as many as the wave has turns along a ray before it has faded.
    fn azimuths(&self, s: f64) -> Vec<f64> {
        if s == 0.0 && self.order == 0 {
            return vec![0.0]; // the cosine, of no effect
        }
        let turns = |slab: &Slab| {
            let gap = if slab.sigma_s == 0.0 {
                4.0 * slab.thickness_mm
            } else {
                f64::INFINITY
            };
            (2.0 - 0.5 * slab.tau).max(0.0) * s * gap.min(1.0 / slab.sigma_t)
        };
        let turns = self.slabs.iter().map(turns).fold(0.0, f64::max);
        let n = (6.0 + turns).min(MOST_AZIMUTHS).floor();
        (0..n as usize)
            .map(|l| ((l as f64 + 0.5) * FRAC_PI_2 / n).cos())
            .collect()
    }

    /// One frequency, with the B harmonics (l, m) of `basis`, of which there are P pairs.
    ///
    /// The unknowns are x = i^−m·L_lm, which makes all coefficients real: azimuths φ and π − φ give a term
    /// and its conjugate, times (−1)^(m + m′).
    fn solve_basis<const B: usize, const P: usize>(
        &self,
        s: f64,
        basis: [(usize, usize); B],
    ) -> Split {
        let azimuths = self.azimuths(s);
        let coarse = azimuths.len() > 8 && self.incidence == Incidence::Normal;
        let cells = &self.meshes[usize::from(coarse)];
        let n = cells.len();
        let mut sums = Sums::<B, P>::new(basis, n);
        let mut source = vec![[0.0; 2]; n];
        if self.incidence == Incidence::Cosine {
            self.cosine_source(s, &azimuths, cells, &mut source);
        } else {
            self.normal_source(cells, &mut source);
        }
        let mut rays: Vec<Ray> = vec![Ray::default(); n];
        for d in &self.directions[0] {
            for cos_phi in &azimuths {
                let sin_theta = (1.0 - d.mu * d.mu).sqrt();
                let slant = 1.0 / d.mu;
                let wave = s * sin_theta * cos_phi * slant;
                let mut through = Complex::ONE;
                for (ray, cell) in rays.iter_mut().zip(cells) {
                    let sigma_t = self.slabs[cell.slab].sigma_t;
                    let x = Complex::new(sigma_t * slant, wave) * cell.thickness_mm;
                    *ray = Ray::new(x, through);
                    through = through * ray.pass;
                }
                let share = TAU * d.weight / azimuths.len() as f64;
                let y = harmonics(basis, d.mu, sin_theta, *cos_phi);
                sums.add(&rays, y, share * slant, d.fresnel);
                // What leaves: upward, where Y_lm is times (−1)^(l+m).
                let leaves = share * (1.0 - d.fresnel);
                for (emitted, ray) in sums.emitted.iter_mut().zip(&rays) {
                    for (q, top) in [ray.top0, ray.top1].into_iter().enumerate() {
                        for (b, (l, m)) in basis.into_iter().enumerate() {
                            emitted[q][b] += leaves * y[b] * sign(l + m) * turned(m, top);
                        }
                    }
                }
            }
        }
        let x = self.scatter(basis, cells, &sums, &source);
        let [first, all] = x.map(|x| {
            let mut sum = 0.0;
            for (c, emitted) in sums.emitted.iter().enumerate() {
                for (q, emitted) in emitted.iter().enumerate() {
                    for (b, emitted) in emitted.iter().enumerate() {
                        sum +=
                            self.scatters(&cells[c], basis[b]) * emitted * x[(c * 2 + q) * B + b];
                    }
                }
            }
            sum
        });
        let once = match self.incidence {
            Incidence::Normal => self.once(s, &azimuths),
            Incidence::Cosine => first,
        };
        Split {
            once,
            more: all - first,
        }
    }

    /// What a cell scatters of a harmonic, per mm² of its face.
    fn scatters(&self, cell: &Cell, (l, _): (usize, usize)) -> f64 {
        let slab = &self.slabs[cell.slab];
        slab.sigma_s * slab.moments[l] * cell.thickness_mm
    }

    /// What of light that came straight down leaves after one event, with the exact phase function.
    fn once(&self, s: f64, azimuths: &[f64]) -> f64 {
        let mut sum = 0.0;
        for d in &self.directions[1] {
            let slant = 1.0 / d.mu;
            let leaves = TAU * d.weight * (1.0 - d.fresnel) / azimuths.len() as f64;
            if leaves == 0.0 {
                continue;
            }
            for cos_phi in azimuths {
                let wave = s * (1.0 - d.mu * d.mu).sqrt() * cos_phi * slant;
                let mut through = Complex::ONE;
                for slab in &self.slabs {
                    let fade = Complex::new(slab.sigma_t * (1.0 + slant), wave);
                    let pass = if slab.thickness_mm == f64::INFINITY {
                        Complex::default()
                    } else {
                        (fade * slab.thickness_mm).exp_neg()
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
        let Layer {
            g, sigma_s_per_mm, ..
        } = slab.layer;
        if self.order == 0 {
            return slab.sigma_s / (4.0 * PI);
        }
        sigma_s_per_mm * (1.0 - g * g) / (4.0 * PI * (1.0 + g * g + 2.0 * g * mu).powf(1.5))
    }

    /// Fluence, as a mean and a slope in each cell, of light straight down.
    fn normal_source(&self, cells: &[Cell], source: &mut [[f64; 2]]) {
        let mut through = Complex::ONE;
        for (b, cell) in source.iter_mut().zip(cells) {
            let x = Complex::new(self.slabs[cell.slab].sigma_t * cell.thickness_mm, 0.0);
            let ray = Ray::new(x, through);
            *b = [ray.top0.re, 3.0 * ray.top1.re];
            through = through * ray.pass;
        }
    }

    /// The same of light from everywhere, refracted.
    fn cosine_source(&self, s: f64, azimuths: &[f64], cells: &[Cell], source: &mut [[f64; 2]]) {
        for (u, weight) in gauss(2 * DIRECTIONS[0]) {
            let outside = u.sqrt();
            let mu = (1.0 - (1.0 - u) / (self.eta * self.eta)).sqrt();
            let sin_theta = (1.0 - mu * mu).sqrt();
            let share =
                weight * (1.0 - fresnel(mu, outside, self.eta)) / mu / azimuths.len() as f64;
            for cos_phi in azimuths {
                let mut through = Complex::ONE;
                for (b, cell) in source.iter_mut().zip(cells) {
                    let sigma_t = self.slabs[cell.slab].sigma_t;
                    let x =
                        Complex::new(sigma_t, s * sin_theta * cos_phi) * (cell.thickness_mm / mu);
                    let ray = Ray::new(x, through);
                    b[0] += share * ray.top0.re;
                    b[1] += share * 3.0 * ray.top1.re;
                    through = through * ray.pass;
                }
            }
        }
    }

    /// The moments of light not yet scattered, b, and of all light, x = b + Kx.
    fn scatter<const B: usize, const P: usize>(
        &self,
        basis: [(usize, usize); B],
        cells: &[Cell],
        sums: &Sums<B, P>,
        source: &[[f64; 2]],
    ) -> [Vec<f64>; 2] {
        let n = cells.len();
        let index = |i: usize, p: usize, b: usize| (i * 2 + p) * B + b;
        let scatters = |i: usize, b: usize| self.scatters(&cells[i], basis[b]);
        let size = 2 * B * n;
        let mut k = vec![0.0; size * size];
        let receive = [1.0, 3.0];
        for i in 0..n {
            for c in 0..=i {
                let at = cell_pair(i, c);
                for (p, q) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    for b in 0..B {
                        for b2 in 0..B {
                            let [(l, _), (l2, m2)] = [basis[b], basis[b2]];
                            let direct = sums.harmonic(&sums.direct[at][p * 2 + q], b, b2);
                            let mirrored = sums.harmonic(&sums.mirrored[at][p * 2 + q], b, b2);
                            // From c, above, to i: straight down, or up and mirrored.
                            let down = receive[p] * (sign(q) * direct + sign(l2 + m2) * mirrored);
                            k[index(i, p, b) * size + index(c, q, b2)] += down * scatters(c, b2);
                            if c < i {
                                // From i to c: straight up, or mirrored.
                                let up = receive[q]
                                    * (sign(q + l + l2) * direct + sign(l + m2) * mirrored);
                                k[index(c, q, b2) * size + index(i, p, b)] += up * scatters(i, b);
                            }
                        }
                    }
                }
            }
        }
        for (c, own) in sums.own.iter().enumerate() {
            for (p, q) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                for b in 0..B {
                    for b2 in 0..B {
                        let [(l, m), (l2, m2)] = [basis[b], basis[b2]];
                        let both = 1.0 + sign(p + q + l + l2 + m + m2);
                        k[index(c, p, b) * size + index(c, q, b2)] +=
                            both * sums.harmonic(&own[p * 2 + q], b, b2) * scatters(c, b2);
                    }
                }
            }
        }
        let straight = harmonics(basis, 1.0, 0.0, 1.0);
        let mut x = vec![0.0; size];
        for (i, source) in source.iter().enumerate() {
            for p in 0..2 {
                for b in 0..B {
                    x[index(i, p, b)] = match self.incidence {
                        Incidence::Normal => source[p] * straight[b],
                        // The fluence alone matters to isotropic scattering.
                        Incidence::Cosine => source[p] * (1.0 / (4.0 * PI)).sqrt(),
                    };
                }
            }
        }
        let unscattered = x.clone();
        for (i, k) in k.iter_mut().enumerate() {
            *k = if i % (size + 1) == 0 { 1.0 - *k } else { -*k };
        }
        solve(&mut k, &mut x);
        [unscattered, x]
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
            if s.sigma_s == 0.0 {
                Vec::new()
            } else {
                grow(s.depth_mm())
            }
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
        cells.extend(
            sizes
                .into_iter()
                .map(|thickness_mm| Cell { slab, thickness_mm }),
        );
    }
    cells
}

/// A direction through a cell. Of light u of the way through, ∫e^−xu du and ∫(2u − 1)e^−xu du are what the
/// cell's mean and its slope receive and emit.
#[derive(Clone, Copy, Default)]
struct Ray {
    /// What passes the whole cell: e^−x.
    pass: Complex,
    mean: Complex,
    slope: Complex,
    /// Mean and slope times what passes all cells above.
    top0: Complex,
    top1: Complex,
    /// Mean to mean, slope to mean and slope to slope within the cell, one way.
    own: [Complex; 3],
}

impl Ray {
    fn new(x: Complex, through: Complex) -> Self {
        let pass = x.exp_neg();
        let (mean, slope, own);
        if x.norm_squared() < 0.04 {
            let mut power = Complex::ONE; // (−x)ⁿ/n!
            let mut sums = [Complex::default(); 5];
            for n in 0..9 {
                let n = f64::from(n);
                for (sum, part) in sums.iter_mut().zip([
                    1.0 / (n + 1.0),
                    n / ((n + 1.0) * (n + 2.0)),
                    1.0 / ((n + 1.0) * (n + 2.0)),
                    // slope/x: the next term of the slope's series, shifted.
                    -1.0 / ((n + 2.0) * (n + 3.0)),
                    1.0 / (n + 1.0) - 3.0 / (n + 2.0) + 2.0 / (n + 4.0),
                ]) {
                    *sum += power * part;
                }
                power = power * x * (-1.0 / (n + 1.0));
            }
            mean = sums[0];
            slope = sums[1];
            own = [sums[2], sums[3], sums[4]];
        } else {
            let inverse = x.recip();
            let one = Complex::ONE;
            mean = (one - pass) * inverse;
            let first = (mean - pass) * inverse; // ∫u e^−xu du
            let second = (first * 2.0 - pass) * inverse;
            let third = (second * 3.0 - pass) * inverse;
            slope = first * 2.0 - mean;
            own = [
                (one - mean) * inverse,
                slope * inverse,
                mean - first * 3.0 + third * 2.0,
            ];
        }
        Self {
            pass,
            mean,
            slope,
            top0: through * mean,
            top1: through * slope,
            own,
        }
    }
}

/// What the directions sum to, but for what does not depend on them. [2p + q] is from the cells' part q
/// (mean, slope) to part p, [k] between the harmonics of pair k.
struct Sums<const B: usize, const P: usize> {
    /// Down from cell c to cell i > c, at [`cell_pair`].
    direct: Vec<[[f64; P]; 4]>,
    /// Up from cell c to the surface and back down to cell i ≥ c.
    mirrored: Vec<[[f64; P]; 4]>,
    /// Down within a cell.
    own: Vec<[[f64; P]; 4]>,
    /// Out of the surface, from a cell's mean and slope.
    emitted: Vec<[[f64; B]; 2]>,
    basis: [(usize, usize); B],
    /// Pairs b ≤ b′: first those with m + m′ even, which take the real part of what a ray carries.
    pairs: [(usize, usize); P],
    real: usize,
}

fn cell_pair(i: usize, c: usize) -> usize {
    i * (i + 1) / 2 + c
}

impl<const B: usize, const P: usize> Sums<B, P> {
    fn new(basis: [(usize, usize); B], cells: usize) -> Self {
        let odd = |&(b, b2): &(usize, usize)| (basis[b].1 + basis[b2].1) % 2 == 1;
        let mut list: Vec<_> = (0..B).flat_map(|b| (b..B).map(move |b2| (b, b2))).collect();
        list.sort_by_key(odd);
        let mut pairs = [(0, 0); P];
        pairs.copy_from_slice(&list);
        Self {
            direct: vec![[[0.0; P]; 4]; cell_pair(cells, 0)],
            mirrored: vec![[[0.0; P]; 4]; cell_pair(cells, 0)],
            own: vec![[[0.0; P]; 4]; cells],
            emitted: vec![[[0.0; B]; 2]; cells],
            basis,
            real: pairs.iter().filter(|pair| !odd(pair)).count(),
            pairs,
        }
    }

    /// Adds a direction of this share.
    fn add(&mut self, rays: &[Ray], y: [f64; B], share: f64, fresnel: f64) {
        // Re(i^(m′−m)·a) is Re a or Im a, but for its sign.
        let part = |k: usize| {
            if k < self.real {
                Complex::ONE
            } else {
                Complex::new(0.0, 1.0)
            }
        };
        let weights: [f64; P] = std::array::from_fn(|k| {
            let (b, b2) = self.pairs[k];
            share * y[b] * y[b2] * turned(self.basis[b2].1 + 4 - self.basis[b].1, part(k))
        });
        let (even, odd) = weights.split_at(self.real);
        let put = |to: &mut [f64; P], a: Complex| {
            let (reals, imaginaries) = to.split_at_mut(even.len());
            reals
                .iter_mut()
                .zip(even)
                .for_each(|(to, w)| *to += w * a.re);
            imaginaries
                .iter_mut()
                .zip(odd)
                .for_each(|(to, w)| *to += w * a.im);
        };
        for (i, ray) in rays.iter().enumerate() {
            let at = cell_pair(i, 0);
            let top = [ray.top0 * fresnel, ray.top1 * fresnel];
            for (to, from) in self.mirrored[at..=at + i].iter_mut().zip(rays) {
                put(&mut to[0], top[0] * from.top0);
                put(&mut to[1], top[0] * from.top1);
                put(&mut to[2], top[1] * from.top0);
                put(&mut to[3], top[1] * from.top1);
            }
            // From the nearest cell above to the furthest.
            let mut near = [ray.mean, ray.slope];
            for (to, from) in self.direct[at..at + i].iter_mut().zip(rays).rev() {
                put(&mut to[0], near[0] * from.mean);
                put(&mut to[1], near[0] * from.slope);
                put(&mut to[2], near[1] * from.mean);
                put(&mut to[3], near[1] * from.slope);
                near = near.map(|near| near * from.pass);
            }
            let own = &mut self.own[i];
            put(&mut own[0], ray.own[0]);
            put(&mut own[1], ray.own[1]);
            put(&mut own[2], ray.own[1] * -3.0);
            put(&mut own[3], ray.own[2]);
        }
    }

    /// From harmonic b′ to b.
    fn harmonic(&self, sums: &[f64; P], b: usize, b2: usize) -> f64 {
        let k = self
            .pairs
            .iter()
            .position(|pair| *pair == (b.min(b2), b.max(b2)));
        let swapped = if b > b2 {
            sign(self.basis[b].1 + self.basis[b2].1)
        } else {
            1.0
        };
        k.map_or(0.0, |k| swapped * sums[k])
    }
}

/// (−1)ⁿ.
fn sign(n: usize) -> f64 {
    if n.is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// Re(iⁿ·a).
fn turned(n: usize, a: Complex) -> f64 {
    match n % 4 {
        0 => a.re,
        1 => -a.im,
        2 => -a.re,
        _ => a.im,
    }
}

/// The real spherical harmonics, even in the azimuth.
fn harmonics<const B: usize>(
    basis: [(usize, usize); B],
    mu: f64,
    sin: f64,
    cos_phi: f64,
) -> [f64; B] {
    basis.map(|lm| match lm {
        (0, 0) => (1.0 / (4.0 * PI)).sqrt(),
        (1, 0) => (3.0 / (4.0 * PI)).sqrt() * mu,
        (1, 1) => (3.0 / (4.0 * PI)).sqrt() * sin * cos_phi,
        (2, 0) => (5.0 / (16.0 * PI)).sqrt() * (3.0 * mu * mu - 1.0),
        (2, 1) => (15.0 / (4.0 * PI)).sqrt() * mu * sin * cos_phi,
        _ => (15.0 / (16.0 * PI)).sqrt() * sin * sin * (2.0 * cos_phi * cos_phi - 1.0),
    })
}

/// Solves the square system in place, by Gauss' elimination with pivots; `x` is the right side, then the
/// solution.
fn solve(a: &mut [f64], x: &mut [f64]) {
    let n = x.len();
    for k in 0..n {
        let size = |i: &usize| a[i * n + k].abs();
        let pivot = (k..n)
            .max_by(|i, j| size(i).total_cmp(&size(j)))
            .unwrap_or(k);
        if pivot != k {
            for j in k..n {
                a.swap(k * n + j, pivot * n + j);
            }
            x.swap(k, pivot);
        }
        let (above, below) = a.split_at_mut((k + 1) * n);
        let row = &above[k * n + k..];
        for i in k + 1..n {
            let target = &mut below[(i - k - 1) * n + k..(i - k) * n];
            let factor = target[0] / row[0];
            if factor != 0.0 {
                for (t, r) in target.iter_mut().zip(row) {
                    *t -= factor * r;
                }
                x[i] -= factor * x[k];
            }
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| a[k * n + j] * x[j]).sum();
        x[k] = (x[k] - known) / a[k * n + k];
    }
}
