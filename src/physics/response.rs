//! How the light of one colour that entered a surface at a point leaves it around that point.

use std::f64::consts::{FRAC_PI_2, PI};

/// A part of the light, spread one way.
#[derive(Clone, Copy, Debug)]
enum Term {
    Gaussian {
        variance_mm2: f64,
    },
    /// As much on each mm² between two radii.
    Ring {
        inner_mm: f64,
        outer_mm: f64,
    },
}

/// A radially symmetric R(r), the flux that leaves per mm² and unit of power that entered, as a sum of
/// Gaussians or rings.
#[derive(Clone, Debug, Default)]
pub struct Response {
    /// What each part spreads, and how.
    terms: Vec<(f64, Term)>,
}

impl Response {
    /// Gaussians of (variance in mm², energy).
    pub fn gaussians(terms: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let terms = terms.into_iter();
        let term = |(variance_mm2, energy)| (energy, Term::Gaussian { variance_mm2 });
        Self { terms: terms.map(term).collect() }
    }

    /// Rings of (inner radius, outer radius, energy), in mm.
    pub fn rings(rings: impl IntoIterator<Item = (f64, f64, f64)>) -> Self {
        let rings = rings.into_iter();
        let term = |(inner_mm, outer_mm, energy)| (energy, Term::Ring { inner_mm, outer_mm });
        Self { terms: rings.map(term).collect() }
    }

    /// The radial profile `r`, given per mm² and sampled in rings of equal ratio from `from_mm` to `to_mm`.
    pub(super) fn sample(from_mm: f64, to_mm: f64, r: impl Fn(f64) -> f64) -> Self {
        const RINGS: usize = 400;
        let step = (to_mm / from_mm).ln() / RINGS as f64;
        let at = |i: f64| from_mm * (i * step).exp();
        let ring = |i: usize| {
            let middle = at(i as f64 + 0.5);
            let energy = 2.0 * PI * middle * middle * r(middle) * step;
            (at(i as f64), at(i as f64 + 1.0), energy)
        };
        // Within the first ring, R ∝ 1/r or flatter.
        let core = (0.0, from_mm, 2.0 * PI * from_mm * from_mm * r(from_mm));
        Self::rings([core].into_iter().chain((0..RINGS).map(ring)))
    }

    /// The sum of responses, each times its weight, which may be negative: colours from a spectrum.
    pub fn sum<'a>(parts: impl IntoIterator<Item = (f64, &'a Self)>) -> Self {
        let scaled = |(weight, part): (f64, &'a Self)| {
            part.terms.iter().map(move |&(energy, term)| (weight * energy, term))
        };
        Self { terms: parts.into_iter().flat_map(scaled).collect() }
    }

    /// The albedo R = ∫R(r)·2πr dr: what leaves of the light that entered.
    pub fn albedo(&self) -> f64 {
        self.terms.iter().map(|(energy, _)| energy).sum()
    }

    /// R(r) in 1/mm².
    pub fn radial(&self, r_mm: f64) -> f64 {
        let at = |(energy, term): &(f64, Term)| match *term {
            Term::Gaussian { variance_mm2: v } => energy * (-0.5 * r_mm * r_mm / v).exp() / (2.0 * PI * v),
            Term::Ring { inner_mm, outer_mm } if inner_mm <= r_mm && r_mm < outer_mm => {
                energy / (PI * (outer_mm * outer_mm - inner_mm * inner_mm))
            }
            Term::Ring { .. } => 0.0,
        };
        self.terms.iter().map(at).sum()
    }

    /// The step edge E(x), x ≥ 0: how bright a point x mm inside light is that ends along a line, against
    /// light without end. ½ at the line.
    pub fn edge(&self, x_mm: f64) -> f64 {
        let at = |(energy, term): &(f64, Term)| match *term {
            Term::Gaussian { variance_mm2 } => energy * step(x_mm, variance_mm2),
            Term::Ring { inner_mm, outer_mm } => energy * (0.5 + 0.5 * ring_edge(x_mm, inner_mm, outer_mm)),
        };
        self.terms.iter().map(at).sum::<f64>() / self.albedo()
    }

    /// Half the width in mm of the strip around a line of light that holds this share, 0 to 1, of what
    /// leaves: 2E − 1 of it.
    pub fn half_width(&self, share: f64) -> f64 {
        let holds = |x_mm: f64| 2.0 * self.edge(x_mm) - 1.0;
        // Halvings from a range that no medium leaves.
        let (mut least, mut most) = (1e-15f64, 1e15f64);
        for _ in 0..60 {
            let middle = (least * most).sqrt();
            if holds(middle) < share {
                least = middle;
            } else {
                most = middle;
            }
        }
        (least * most).sqrt()
    }
}

/// The step edge, spread by a Gaussian.
pub(super) fn step(x_mm: f64, variance_mm2: f64) -> f64 {
    if variance_mm2 == 0.0 {
        return if x_mm > 0.0 { 1.0 } else { 0.5 };
    }
    0.5 * libm::erfc(-x_mm / (2.0 * variance_mm2).sqrt())
}

/// The mean of 2/π·asin(min(1, x/r)) over a ring: what the strip |·| < x holds of it.
fn ring_edge(x: f64, inner: f64, outer: f64) -> f64 {
    if x >= outer {
        return 1.0;
    }
    // ∫ asin(min(1, x/r))·r dr, twice.
    let whole = |r: f64| {
        if r <= x { FRAC_PI_2 * r * r } else { r * r * (x / r).asin() + x * (r * r - x * x).sqrt() }
    };
    (whole(outer) - whole(inner)) / (FRAC_PI_2 * (outer * outer - inner * inner))
}
