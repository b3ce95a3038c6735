//! How cells of depth light each other: the kernel of the integral equation of transport at one spatial
//! frequency, summed over directions.
//!
//! The unknowns are x = i^−m·L_lm, moments of the radiance in real spherical harmonics, which makes all
//! coefficients real: azimuths φ and π − φ give a term and its conjugate, times (−1)^(m + m′). Down is the
//! direction of the harmonics; up, Y_lm is times (−1)^(l + m) and a cell's slope times −1.

use std::f64::consts::PI;

use super::complex::Complex;
use super::quadrature::Direction;

/// A direction through a cell. Of light u of the way through, ∫e^−xu du and ∫(2u − 1)e^−xu du are what the
/// cell's mean and its slope receive and emit.
#[derive(Clone, Copy, Default)]
pub(super) struct Ray {
    /// What passes the whole cell: e^−x.
    pub(super) pass: Complex,
    /// Mean and slope.
    parts: [Complex; 2],
    /// Both times what passes all cells above.
    pub(super) top: [Complex; 2],
    /// Within the cell, one way, as [`Kernel::own`].
    own: [Complex; 4],
}

impl Ray {
    /// The ray of `through` what passes all cells above.
    pub(super) fn new(x: Complex, through: Complex) -> Self {
        let pass = x.exp_neg();
        // Mean, slope, mean to mean, slope to mean and slope to slope.
        let mut parts = [Complex::default(); 5];
        if x.norm_squared() < 0.04 {
            let mut power = Complex::ONE; // (−x)ⁿ/n!
            for n in (0..9).map(f64::from) {
                for (sum, part) in parts.iter_mut().zip([
                    1.0 / (n + 1.0),
                    n / ((n + 1.0) * (n + 2.0)),
                    1.0 / ((n + 1.0) * (n + 2.0)),
                    -1.0 / ((n + 2.0) * (n + 3.0)), // of the slope over x
                    1.0 / (n + 1.0) - 3.0 / (n + 2.0) + 2.0 / (n + 4.0),
                ]) {
                    *sum += power * part;
                }
                power = power * x * (-1.0 / (n + 1.0));
            }
        } else {
            let inverse = x.recip();
            // ∫uⁿe^−xu du.
            let zeroth = (Complex::ONE - pass) * inverse;
            let first = (zeroth - pass) * inverse;
            let second = (first * 2.0 - pass) * inverse;
            let third = (second * 3.0 - pass) * inverse;
            let slope = first * 2.0 - zeroth;
            let mean_to_mean = (Complex::ONE - zeroth) * inverse;
            let slope_to_slope = zeroth - first * 3.0 + third * 2.0;
            parts = [zeroth, slope, mean_to_mean, slope * inverse, slope_to_slope];
        }
        let [mean, slope, a, b, c] = parts;
        Self {
            pass,
            parts: [mean, slope],
            top: [through * mean, through * slope],
            own: [a, b, b * -3.0, c],
        }
    }
}

/// What directions sum to, for B harmonics (l, m), but for what does not depend on them: [2p + q] is from a
/// cell's part q (mean, slope) to part p, [k] between the harmonics of pair k.
pub(super) struct Kernel<const B: usize, const P: usize> {
    /// Down from cell c to cell i > c, at [`cell_pair`].
    direct: Vec<[[f64; P]; 4]>,
    /// Up from cell c to the surface and back down to cell i ≥ c.
    mirrored: Vec<[[f64; P]; 4]>,
    /// Down within a cell.
    own: Vec<[[f64; P]; 4]>,
    /// Out of the surface, from a cell's mean and slope, by harmonic.
    emitted: Vec<f64>,
    basis: [(usize, usize); B],
    /// Pairs b ≤ b′: first those with m + m′ even, which take the real part of what a ray carries.
    pairs: [(usize, usize); P],
    /// How many those are.
    real: usize,
    /// The pair from b′ to b, and its sign in that order.
    pair_of: [[(usize, f64); B]; B],
}

/// Of a ray, what is not worth its sums.
const NOTHING: f64 = 1e-7;

fn cell_pair(i: usize, c: usize) -> usize {
    i * (i + 1) / 2 + c
}

/// All [p, q, b, b′].
fn terms<const B: usize>() -> impl Iterator<Item = [usize; 4]> {
    (0..4 * B * B).map(|i| [i / (2 * B * B), i / (B * B) % 2, i / B % B, i % B])
}

impl<const B: usize, const P: usize> Kernel<B, P> {
    pub(super) fn new(basis: [(usize, usize); B], cells: usize) -> Self {
        let odd = |&(b, b2): &(usize, usize)| (basis[b].1 + basis[b2].1) % 2 == 1;
        let mut list: Vec<_> = (0..B).flat_map(|b| (b..B).map(move |b2| (b, b2))).collect();
        list.sort_by_key(odd);
        let pairs: [(usize, usize); P] = std::array::from_fn(|k| list[k]);
        let mut pair_of = [[(0, 1.0); B]; B];
        for (k, &(b, b2)) in pairs.iter().enumerate() {
            pair_of[b2][b] = (k, sign(basis[b].1 + basis[b2].1));
            pair_of[b][b2] = (k, 1.0);
        }
        Self {
            direct: vec![[[0.0; P]; 4]; cell_pair(cells, 0)],
            mirrored: vec![[[0.0; P]; 4]; cell_pair(cells, 0)],
            own: vec![[[0.0; P]; 4]; cells],
            emitted: vec![0.0; cells * 2 * B],
            basis,
            real: pairs.iter().filter(|pair| !odd(pair)).count(),
            pairs,
            pair_of,
        }
    }

    /// Adds rays along a direction with harmonics `y`, which is this share of all solid angles.
    pub(super) fn add(&mut self, rays: &[Ray], y: [f64; B], share: f64, direction: &Direction) {
        // Re(i^(m′−m)·a) is Re a or Im a, but for its sign.
        let (one, i) = (Complex::ONE, Complex::new(0.0, 1.0));
        let weights: [f64; P] = std::array::from_fn(|k| {
            let (b, b2) = self.pairs[k];
            let part = if k < self.real { one } else { i };
            let turns = self.basis[b2].1 + 4 - self.basis[b].1;
            share / direction.mu * y[b] * y[b2] * turned(turns, part)
        });
        let (even, odd) = weights.split_at(self.real);
        let add = |to: &mut [f64], weights: &[f64], a: f64| {
            to.iter_mut().zip(weights).for_each(|(to, w)| *to += w * a);
        };
        let put = |to: &mut [f64; P], a: Complex| {
            let (reals, imaginaries) = to.split_at_mut(even.len());
            add(reals, even, a.re);
            add(imaginaries, odd, a.im);
        };
        let put_all = |to: &mut [[f64; P]; 4], a: [Complex; 2], from: [Complex; 2]| {
            put(&mut to[0], a[0] * from[0]);
            put(&mut to[1], a[0] * from[1]);
            put(&mut to[2], a[1] * from[0]);
            put(&mut to[3], a[1] * from[1]);
        };
        let matters = |a: Complex| a.norm_squared() > NOTHING * NOTHING;
        for (i, ray) in rays.iter().enumerate() {
            let at = cell_pair(i, 0);
            let top = ray.top.map(|top| top * direction.fresnel);
            for (to, from) in self.mirrored[at..=at + i].iter_mut().zip(rays) {
                if !matters(top[0] * from.top[0]) {
                    break;
                }
                put_all(to, top, from.top);
            }
            // From the nearest cell above to the furthest that is seen.
            let mut near = ray.parts;
            for (to, from) in self.direct[at..at + i].iter_mut().zip(rays).rev() {
                if !matters(near[0]) {
                    break;
                }
                put_all(to, near, from.parts);
                near = near.map(|near| near * from.pass);
            }
            for (to, own) in self.own[i].iter_mut().zip(ray.own) {
                put(to, own);
            }
            for (q, top) in ray.top.into_iter().enumerate() {
                for (b, (l, m)) in self.basis.into_iter().enumerate() {
                    let leaves = share * (1.0 - direction.fresnel) * y[b] * sign(l + m);
                    self.emitted[(i * 2 + q) * B + b] += leaves * turned(m, top);
                }
            }
        }
    }

    /// The matrix K, row by row, of unknowns by cell, part and harmonic; `scatters` is how much of degree l a
    /// cell scatters.
    pub(super) fn matrix(&self, scatters: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let size = self.emitted.len();
        let index = |cell: usize, part: usize, b: usize| (cell * 2 + part) * B + b;
        let mut k = vec![0.0; size * size];
        let receives = [1.0, 3.0];
        for (i, own) in self.own.iter().enumerate() {
            for [p, q, b, b2] in terms::<B>() {
                let [(l, m), (l2, m2)] = [self.basis[b], self.basis[b2]];
                let (pair, order) = self.pair_of[b][b2];
                let both = 1.0 + sign(p + q + l + l2 + m + m2);
                k[index(i, p, b) * size + index(i, q, b2)] +=
                    order * both * own[2 * p + q][pair] * scatters(i, l2);
                for c in 0..=i {
                    let at = cell_pair(i, c);
                    let direct = order * self.direct[at][2 * p + q][pair];
                    let mirrored = order * self.mirrored[at][2 * p + q][pair];
                    // From c, above, to i: straight down, or up and mirrored.
                    let down = receives[p] * (sign(q) * direct + sign(l2 + m2) * mirrored);
                    k[index(i, p, b) * size + index(c, q, b2)] += down * scatters(c, l2);
                    if c < i {
                        // From i to c: straight up, or mirrored.
                        let up = receives[q] * (sign(q + l + l2) * direct + sign(l + m2) * mirrored);
                        k[index(c, q, b2) * size + index(i, p, b)] += up * scatters(i, l);
                    }
                }
            }
        }
        k
    }

    /// What leaves the surface of each unknown.
    pub(super) fn emitted(&self, scatters: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let leaves = |(i, e): (usize, &f64)| e * scatters(i / (2 * B), self.basis[i % B].0);
        self.emitted.iter().enumerate().map(leaves).collect()
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
pub(super) fn harmonics<const B: usize>(
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
