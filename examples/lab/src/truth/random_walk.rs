//! What a layered medium does with light, by following light: the reference for the solver of
//! [`subsurface::physics`], with which it shares the description of a medium and Fresnel's equations.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use subsurface::physics::{Incidence, Medium, Response, fresnel_inside};

use super::Progress;

/// Paths are walked in as many parts, whose spread is the error.
const PARTS: usize = 64;
/// Rings: a disc, then as many to a decade from here.
const FIRST_MM: f64 = 1e-4;
const PER_DECADE: f64 = 40.0;
const RINGS: usize = 300;

/// Where paths left a surface that they entered at a point.
#[derive(Clone, Debug)]
pub struct Walk {
    /// By part, what left in each ring, of a path's light.
    parts: Vec<[f64; RINGS]>,
}

/// Walks so many paths (as a multiple of 64), on all cores; the same seed gives the same numbers on any
/// number of them.
pub fn random_walk(
    medium: &Medium,
    incidence: Incidence,
    paths: u64,
    seed: u64,
    progress: Progress,
) -> Walk {
    let each = paths.div_ceil(PARTS as u64).max(1);
    let parts = (0..PARTS as u64).into_par_iter().map(|part| {
        let mut random = Random(seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ (part << 48));
        let mut rings = [0.0; RINGS];
        for _ in 0..each {
            path(medium, incidence, &mut random, &mut rings);
        }
        progress(1.0 / PARTS as f64);
        rings.map(|light| light / each as f64)
    });
    Walk { parts: parts.collect() }
}

impl Walk {
    /// The albedo and its standard error.
    pub fn albedo(&self) -> [f64; 2] {
        self.estimate(|response| response.albedo(), false)
    }

    /// The step edge E(x) of all paths, and its standard error.
    pub fn edge(&self, x_mm: f64) -> [f64; 2] {
        self.estimate(|response| response.edge(x_mm), true)
    }

    /// The mean of R(r) in 1/mm² between two radii, and its standard error. Radii are rounded to the
    /// nearest of the rings.
    pub fn annulus(&self, inner_mm: f64, outer_mm: f64) -> [f64; 2] {
        let [from, to] = [inner_mm, outer_mm].map(|r| (1.0 + position(r)).round() as usize);
        let area = PI * (radius(to).powi(2) - radius(from).powi(2));
        let mean = |rings: &[f64; RINGS]| rings[from..to].iter().sum::<f64>() / area;
        spread(self.parts.iter().map(mean))
    }

    /// What left, in rings.
    pub fn response(&self) -> Response {
        let mut rings = [0.0; RINGS];
        for part in &self.parts {
            for (sum, light) in rings.iter_mut().zip(part) {
                *sum += light / PARTS as f64;
            }
        }
        response(&rings)
    }

    /// The mean over the parts, or of all parts together, and the standard error.
    fn estimate(&self, of: impl Fn(&Response) -> f64, together: bool) -> [f64; 2] {
        let [mean, error] = spread(self.parts.iter().map(|rings| of(&response(rings))));
        // A ratio is biased in small parts.
        [if together { of(&self.response()) } else { mean }, error]
    }
}

fn spread(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let values: Vec<f64> = values.collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    [mean, (variance / n).sqrt()]
}

/// Rings from [`FIRST_MM`] in steps of a ratio.
fn position(r_mm: f64) -> f64 {
    (r_mm / FIRST_MM).log10() * PER_DECADE
}

/// The inner radius of ring i.
fn radius(i: usize) -> f64 {
    match i {
        0 => 0.0,
        _ => FIRST_MM * 10f64.powf((i - 1) as f64 / PER_DECADE),
    }
}

fn response(rings: &[f64; RINGS]) -> Response {
    let ring = |(i, light): (usize, &f64)| (radius(i), radius(i + 1), *light);
    Response::rings(rings.iter().enumerate().map(ring))
}

/// Light on its way through layers.
struct Light {
    weight: f64,
    /// In mm, z down.
    at: [f64; 3],
    way: [f64; 3],
    layer: usize,
    /// Of the layer, in mm.
    top: f64,
}

/// Follows light from the surface until it is gone.
fn path(medium: &Medium, incidence: Incidence, random: &mut Random, rings: &mut [f64; RINGS]) {
    let eta = medium.eta();
    let mut light = Light { weight: 1.0, at: [0.0; 3], way: [0.0, 0.0, 1.0], layer: 0, top: 0.0 };
    if incidence == Incidence::Cosine {
        let u = random.next();
        let inside = (1.0 - (1.0 - u) / (eta * eta)).sqrt();
        light.weight = 1.0 - fresnel_inside(inside, eta);
        light.way = [(1.0 - inside * inside).sqrt(), 0.0, inside];
    }
    loop {
        // An optical depth to the next event.
        light.fly(medium, -(1.0 - random.next()).ln(), rings);
        if light.weight == 0.0 {
            return;
        }
        let here = &medium.layers()[light.layer];
        light.weight *= here.sigma_s_per_mm / (here.sigma_a_per_mm + here.sigma_s_per_mm);
        // What is too weak to matter goes on in one of ten, with ten times the weight.
        if light.weight < 0.02 {
            if random.next() >= 0.1 {
                return;
            }
            light.weight *= 10.0;
            if light.weight == 0.0 {
                return;
            }
        }
        light.way = scatter(light.way, here.g, random);
    }
}

impl Light {
    /// Goes on for so much optical depth, through faces and back from the surface; what leaves falls into
    /// rings.
    fn fly(&mut self, medium: &Medium, mut left: f64, rings: &mut [f64; RINGS]) {
        let layers = medium.layers();
        loop {
            let here = &layers[self.layer];
            let sigma_t = here.sigma_a_per_mm + here.sigma_s_per_mm;
            let (mut to_face, mut next) = (f64::INFINITY, self.layer);
            if self.way[2] > 0.0 && here.thickness_mm < f64::INFINITY {
                to_face = (self.top + here.thickness_mm - self.at[2]) / self.way[2];
                next = self.layer + 1;
            } else if self.way[2] < 0.0 {
                to_face = (self.top - self.at[2]) / self.way[2];
                next = self.layer.wrapping_sub(1);
            }
            let to_face = to_face.max(0.0);
            let ends = left <= sigma_t * to_face;
            let step = if ends { left / sigma_t } else { to_face };
            for (at, way) in self.at.iter_mut().zip(self.way) {
                *at += step * way;
            }
            if ends {
                return;
            }
            left -= sigma_t * to_face;
            if next == usize::MAX {
                let reflected = fresnel_inside(-self.way[2], medium.eta());
                let r = self.at[0].hypot(self.at[1]);
                let ring = (1.0 + position(r).floor()).clamp(0.0, (RINGS - 1) as f64);
                rings[ring as usize] += self.weight * (1.0 - reflected);
                self.weight *= reflected;
                self.at[2] = 0.0;
                self.way[2] = -self.way[2];
                if self.weight == 0.0 {
                    return;
                }
            } else {
                // On the face itself, or rounding would leave it on the wrong side.
                let is_below = next > self.layer;
                self.at[2] = if is_below { self.top + here.thickness_mm } else { self.top };
                self.top = if is_below { self.at[2] } else { self.top - layers[next].thickness_mm };
                self.layer = next;
            }
        }
    }
}

/// A direction by Henyey & Greenstein's phase function.
fn scatter(way: [f64; 3], g: f64, random: &mut Random) -> [f64; 3] {
    let u = random.next();
    let cos = if g.abs() < 1e-3 {
        // To first order in g.
        let c = 2.0 * u - 1.0;
        c + 1.5 * g * (1.0 - c * c)
    } else {
        let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
        (1.0 + g * g - s * s) / (2.0 * g)
    };
    let cos = cos.clamp(-1.0, 1.0);
    let sin = (1.0 - cos * cos).sqrt();
    let (sin_phi, cos_phi) = (TAU * random.next()).sin_cos();
    let [x, y, z] = way;
    // Any two directions across the way: Duff et al., *Building an orthonormal basis, revisited*, 2017.
    let sign = 1f64.copysign(z);
    let a = -1.0 / (sign + z);
    let b = x * y * a;
    let right = [1.0 + sign * x * x * a, sign * b, -sign * x];
    let up = [b, sign + y * y * a, -y];
    let turned: [f64; 3] =
        std::array::from_fn(|i| cos * way[i] + sin * (cos_phi * right[i] + sin_phi * up[i]));
    let length = turned.iter().map(|v| v * v).sum::<f64>().sqrt();
    turned.map(|v| v / length)
}

/// SplitMix64: G. L. Steele, D. Lea & C. H. Flood, *Fast splittable pseudorandom number generators*, 2014.
struct Random(u64);

impl Random {
    /// 0 to 1, 1 excluded.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z >> 11) as f64 * 2f64.powi(-53)
    }
}
