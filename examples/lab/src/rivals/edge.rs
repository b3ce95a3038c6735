//! Straight edges, which kernels are fitted on: what a profile makes of them in closed form, what a
//! separable kernel makes of them, and the search for the kernel of the least worst error.

use glam::{DVec3, Vec3};
use subsurface::Profile;

/// Angles of the edge to the pixels' axes; what is beyond 45° mirrors what is below.
const ANGLES_DEGREES: [f64; 3] = [0.0, 22.5, 45.0];

/// Variance of the edge that taps are fitted on: soft by a pixel at 4 px/mm. A sum of taps makes a
/// staircase of a hard edge.
const SOFT_MM2: f64 = 0.0625;

/// The profile in double precision.
pub fn terms(profile: &Profile) -> Vec<(f64, DVec3)> {
    let term = |g: &subsurface::Gaussian| (g.variance_mm2.into(), DVec3::from(g.weight.map(f64::from)));
    profile.gaussians().iter().map(term).collect()
}

/// The step edge at x mm, blurred by a Gaussian of this variance.
pub fn step(x_mm: f64, variance_mm2: f64) -> f64 {
    0.5 * (1.0 + libm::erf(x_mm / (2.0 * variance_mm2.max(1e-18)).sqrt()))
}

/// That edge, scattered by a profile.
pub fn scattered_step(x_mm: f64, blur_mm2: f64, terms: &[(f64, DVec3)]) -> DVec3 {
    terms.iter().map(|(v, weight)| *weight * step(x_mm, v + blur_mm2)).sum()
}

/// Distances from the edge at which errors are looked for, denser towards it; the other side
/// mirrors this one.
pub fn distances_mm(terms: &[(f64, DVec3)]) -> impl Iterator<Item = f64> {
    let widest = terms.iter().map(|(v, _)| *v).fold(0.0, f64::max);
    const STEPS: u32 = 40;
    (1..=STEPS).map(move |i| 4.0 * widest.sqrt() * (f64::from(i) / f64::from(STEPS)).powi(2))
}

/// What a separable kernel that is a sum of parts, a(x) = Σ cᵢ aᵢ(x), makes of edges: at each angle
/// and distance, Σᵢⱼ cᵢ cⱼ · the response of aᵢ(x)·aⱼ(y).
pub struct Responses {
    parts: usize,
    truth: Vec<DVec3>,
    /// `parts` × `parts` for each of `truth`.
    responses: Vec<f64>,
}

impl Responses {
    /// Of Gaussians of these variances, on soft edges.
    pub fn of_gaussians(terms: &[(f64, DVec3)], variances_mm2: &[f64]) -> Self {
        let v = variances_mm2;
        Self::new(terms, SOFT_MM2, v.len(), |x, (cos, sin), i, j| {
            step(x, v[i] * cos * cos + v[j] * sin * sin + SOFT_MM2)
        })
    }

    /// Of pairs of taps at ±`offsets_mm`, on soft edges.
    pub fn of_taps(terms: &[(f64, DVec3)], offsets_mm: &[f64]) -> Self {
        Self::new(terms, SOFT_MM2, offsets_mm.len(), |x, across, i, j| {
            let (a, b) = (offsets_mm[i] * across.0, offsets_mm[j] * across.1);
            let at = |shift: f64| step(x + shift, SOFT_MM2);
            0.25 * (at(a + b) + at(a - b) + at(b - a) + at(-a - b))
        })
    }

    fn new(
        terms: &[(f64, DVec3)],
        blur_mm2: f64,
        parts: usize,
        response: impl Fn(f64, (f64, f64), usize, usize) -> f64,
    ) -> Self {
        let (mut truth, mut responses) = (Vec::new(), Vec::new());
        for angle in ANGLES_DEGREES {
            let (sin, cos) = angle.to_radians().sin_cos();
            for x in distances_mm(terms) {
                truth.push(scattered_step(x, blur_mm2, terms));
                for i in 0..parts {
                    responses.extend((0..parts).map(|j| response(x, (cos, sin), i, j)));
                }
            }
        }
        Self { parts, truth, responses }
    }

    /// The worst error of the kernel Σ cᵢ aᵢ in one channel.
    pub fn worst(&self, c: &[f64], channel: usize) -> f64 {
        let response = |square: &[f64]| -> f64 {
            let row = |row: &[f64]| row.iter().zip(c).map(|(r, c)| r * c).sum::<f64>();
            c.iter().zip(square.chunks_exact(self.parts)).map(|(ci, r)| ci * row(r)).sum()
        };
        self.responses
            .chunks_exact(self.parts * self.parts)
            .zip(&self.truth)
            .map(|(square, truth)| (response(square) - truth[channel]).abs())
            .fold(0.0, f64::max)
    }
}

/// Where `f` is least, by the downhill simplex of Nelder & Mead 1965, begun anew around what it
/// found a few times, since worst errors have creases that it gets caught in.
pub fn minimise(f: impl Fn(&[f64]) -> f64, start: &[f64], spread: f64) -> (Vec<f64>, f64) {
    let mut best = (start.to_vec(), f(start));
    for round in 0..6 {
        let found = simplex(&f, &best.0, spread * 0.5f64.powi(round));
        if found.1 < best.1 {
            best = found;
        }
    }
    best
}

fn simplex(f: &impl Fn(&[f64]) -> f64, start: &[f64], spread: f64) -> (Vec<f64>, f64) {
    let n = start.len();
    let valued = |x: Vec<f64>| {
        let value = f(&x);
        (x, value)
    };
    let mut points: Vec<_> = (0..=n)
        .map(|i| {
            let mut x = start.to_vec();
            if i < n {
                x[i] += spread;
            }
            valued(x)
        })
        .collect();
    let blend = |a: &[f64], b: &[f64], t: f64| -> Vec<f64> {
        a.iter().zip(b).map(|(a, b)| a + t * (b - a)).collect()
    };
    for _ in 0..60 * n {
        points.sort_by(|a, b| a.1.total_cmp(&b.1));
        if points[n].1 - points[0].1 < 1e-6 {
            break;
        }
        let center: Vec<f64> =
            (0..n).map(|k| points[..n].iter().map(|p| p.0[k]).sum::<f64>() / n as f64).collect();
        let worst = points[n].clone();
        let reflected = valued(blend(&center, &worst.0, -1.0));
        if reflected.1 < points[0].1 {
            let expanded = valued(blend(&center, &worst.0, -2.0));
            points[n] = if expanded.1 < reflected.1 { expanded } else { reflected };
        } else if reflected.1 < points[n - 1].1 {
            points[n] = reflected;
        } else {
            let contracted = valued(blend(&center, &worst.0, 0.5));
            if contracted.1 < worst.1 {
                points[n] = contracted;
            } else {
                let best = points[0].0.clone();
                for p in &mut points[1..] {
                    *p = valued(blend(&best, &p.0, 0.5));
                }
            }
        }
    }
    points.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default()
}

/// A WGSL literal of three floats.
pub fn vec3f(v: DVec3) -> String {
    let Vec3 { x, y, z } = v.as_vec3();
    format!("vec3f({x:?}, {y:?}, {z:?})")
}
