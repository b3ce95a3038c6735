//! Where integrands are sampled: Gauss' nodes, and directions that cluster where Fresnel bends.

use std::f64::consts::PI;

/// The nodes and weights of Gauss–Legendre quadrature on 0 to 1.
pub(super) fn gauss(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (mut p, mut below) = (1.0, 0.0);
                for l in 0..n {
                    let l = l as f64;
                    (p, below) = (((2.0 * l + 1.0) * x * p - l * below) / (l + 1.0), p);
                }
                slope = n as f64 * (x * p - below) / (x * x - 1.0);
                let step = p / slope;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// The Fresnel reflectance, from inside a medium of relative index `eta` ≥ 1, at cos θ = `mu`.
pub fn fresnel_inside(mu: f64, eta: f64) -> f64 {
    let sin2 = eta * eta * (1.0 - mu * mu);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let outside = (1.0 - sin2).sqrt();
    fresnel(mu, outside, eta)
}

/// The Fresnel reflectance between the cosine inside and the cosine outside that it refracts to.
pub(super) fn fresnel(inside: f64, outside: f64, eta: f64) -> f64 {
    let s = (eta * inside - outside) / (eta * inside + outside);
    let p = (inside - eta * outside) / (inside + eta * outside);
    0.5 * (s * s + p * p)
}

/// A direction towards the surface, from inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direction {
    /// cos θ.
    pub(super) mu: f64,
    /// Its share of ∫₀¹dμ.
    pub(super) weight: f64,
    /// The Fresnel reflectance from inside.
    pub(super) fresnel: f64,
}

/// Directions over the hemisphere, `n` to either side of the critical angle. They cluster at its ends, where
/// Fresnel bends, and at μ = 0 and 1, where rays are long and waves stand still.
pub(super) fn directions(n: usize, eta: f64) -> Vec<Direction> {
    let (ends, slope) = (|t: f64| t * t * (3.0 - 2.0 * t), |t: f64| 6.0 * t * (1.0 - t));
    let critical = (1.0 - 1.0 / (eta * eta)).sqrt();
    let at = |mu: f64, weight: f64| Direction { mu, weight, fresnel: fresnel_inside(mu, eta) };
    if eta == 1.0 {
        let nodes = gauss(2 * n).into_iter();
        return nodes.map(|(t, w)| at(ends(t), slope(t) * w)).collect();
    }
    let nodes = gauss(n);
    let beyond = nodes
        .iter()
        .map(|(t, w)| Direction { fresnel: 1.0, ..at(critical * t * t, critical * 2.0 * t * w) });
    let leaves = 1.0 - critical;
    let within = nodes.iter().map(|(t, w)| at(critical + leaves * ends(*t), leaves * slope(*t) * w));
    beyond.chain(within).collect()
}

/// Henyey & Greenstein's phase function of mean cosine g at a cosine between both ways.
pub(super) fn henyey_greenstein(g: f64, cos: f64) -> f64 {
    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5))
}
