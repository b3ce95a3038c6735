//! What the passes make of an edge, in one dimension: the columns that a plan's weights are fitted
//! on. Edges along an axis are the worst; at other angles the phases of the pixels average.

use libm::erfc;

use super::{Kernels, own_blur};
use crate::Profile;

/// Of the signals, in pixels; wide enough for the widest level.
const LENGTH: usize = 8192;

/// Where the edges lie, in pixels: every phase of the fine levels, some of the coarse ones.
const SHIFTS: [f64; 10] = [0.0, 0.4, 1.0, 2.0, 3.0, 6.3, 13.0, 27.6, 54.0, 105.0];

/// An edge, where it is looked at, and what each kernel makes of it there.
pub(super) struct Responses {
    samples: Vec<Sample>,
    /// A row a sample, a column a kernel: the light that stays first.
    pub columns: Vec<Vec<f64>>,
}

struct Sample {
    /// Distance from the edge, in pixels.
    x: f64,
    /// Whether the edge is soft by σ = 1 px, not hard.
    soft: bool,
}

impl Responses {
    pub fn new(kernels: &Kernels, levels: usize) -> Self {
        let middle = LENGTH / 2;
        let mut offsets: Vec<usize> = (0..8).collect();
        let mut offset = 8.0;
        while offset < 0.42 * LENGTH as f64 {
            offsets.push(offset as usize);
            offset *= 1.18;
        }
        let mut responses = Self {
            samples: Vec::new(),
            columns: Vec::new(),
        };
        for shift in SHIFTS {
            for soft in [true, false] {
                // Pixels know of a hard edge only between which two it lies.
                let shift = if soft { shift } else { shift.floor() };
                let x = |i: usize| i as f64 + 0.5 - middle as f64 + shift;
                let edge = |i: usize| match soft {
                    true => step(x(i), 1.0),
                    false => f64::from(x(i) > 0.0),
                };
                let edge: Vec<f64> = (0..LENGTH).map(edge).collect();
                let passed = kernels.pass(&edge, levels);
                for offset in offsets.iter().flat_map(|o| [middle + o, middle - 1 - o]) {
                    responses.samples.push(Sample { x: x(offset), soft });
                    let column = passed.iter().map(|p| p[offset]);
                    responses.columns.push(column.collect());
                }
            }
        }
        responses
    }

    /// What the profile makes of the edges at `px_per_mm`, for each colour.
    ///
    /// A hard edge is scattered by the weights of the visible integral, on the pixels' lattice.
    pub fn wanted(&self, profile: &Profile, px_per_mm: f64) -> [Vec<f64>; 3] {
        let gaussians: Vec<_> = profile
            .gaussians()
            .iter()
            .map(|g| {
                let px2 = f64::from(g.variance_mm2) * px_per_mm * px_per_mm;
                (g.weight.as_dvec3(), px2, lattice_steps(px2))
            })
            .collect();
        let mut wanted = [const { Vec::new() }; 3];
        for sample in &self.samples {
            let mut sum = glam::DVec3::ZERO;
            for (weight, px2, steps) in &gaussians {
                let passed = match (sample.soft, steps) {
                    (true, _) => step(sample.x, px2 + 1.0),
                    (false, None) => step(sample.x, *px2),
                    (false, Some(steps)) => {
                        let beyond = steps.get((sample.x.abs() - 0.5) as usize);
                        let above = 1.0 - beyond.unwrap_or(&0.0);
                        if sample.x > 0.0 { above } else { 1.0 - above }
                    }
                };
                sum += *weight * passed;
            }
            for (column, value) in wanted.iter_mut().zip(sum.to_array()) {
                column.push(value);
            }
        }
        wanted
    }
}

/// ½(1 + erf(x/√2v)), a unit edge that a Gaussian has passed over.
fn step(x: f64, variance: f64) -> f64 {
    if variance == 0.0 {
        return f64::from(x > 0.0);
    }
    0.5 * erfc(-x / (2.0 * variance).sqrt())
}

/// The share of the light that point weights on the lattice put beyond n + ½ pixels on one side, n
/// from 0; of wide Gaussians none, since the lattice no longer matters.
fn lattice_steps(variance_px2: f64) -> Option<Vec<f64>> {
    // Beyond, the sum over half the lattice is within 1e-4 of the integral.
    if variance_px2 > 100.0 {
        return None;
    }
    let s = lattice_variance(variance_px2);
    let weight = |n: usize| (-((n * n) as f64) / (2.0 * s)).exp();
    let reach = (7.0 * s.sqrt()).ceil() as usize + 1;
    let mass: f64 = weight(0) + 2.0 * (1..=reach).map(weight).sum::<f64>();
    let mut beyond = 0.0;
    let mut steps: Vec<f64> = (0..=reach)
        .rev()
        .map(|n| {
            let step = beyond / mass;
            beyond += weight(n);
            step
        })
        .collect();
    steps.reverse();
    Some(steps)
}

/// As `lattice_variance` in `shaders/gaussian_sum.wgsl`, in px².
fn lattice_variance(s: f64) -> f64 {
    const WAVE: f64 = 1.1;
    if !(1e-6..=0.4).contains(&s) {
        return s.max(1e-9);
    }
    let passed = (-0.5 * WAVE * WAVE * s).exp();
    let (near, far) = (WAVE.cos(), (2.0 * WAVE).cos());
    let mut w = 0.0;
    for _ in 0..8 {
        let w4 = f64::powi(w, 4);
        w = 0.5 * (1.0 - passed - 2.0 * (passed - far) * w4) / (passed - near);
    }
    -0.5 / w.ln()
}

impl Kernels {
    /// What each kernel makes of a signal, at its own resolution and brought back to the pixels'; the
    /// signal itself first.
    fn pass(&self, signal: &[f64], levels: usize) -> Vec<Vec<f64>> {
        let mut columns = vec![signal.to_vec()];
        for (i, (variance, _)) in self.fine.blurs.iter().enumerate() {
            columns.push(blurred(signal, &self.fine.marginal(i, *variance)));
        }
        let mut level = signal.to_vec();
        for l in 1..=levels {
            level = downsampled(&level);
            for (i, (variance, _)) in self.coarse.blurs.iter().enumerate() {
                let remains = variance - own_blur(l);
                let mut passed = blurred(&level, &self.coarse.marginal(i, remains));
                for _ in 0..l {
                    passed = upsampled(&passed);
                }
                columns.push(passed);
            }
        }
        columns
    }
}

/// A value of a signal that goes on as it ends.
fn at(signal: &[f64], i: isize) -> f64 {
    signal[i.clamp(0, signal.len() as isize - 1) as usize]
}

/// `taps` reach as far to both sides.
fn blurred(signal: &[f64], taps: &[f64]) -> Vec<f64> {
    let reach = taps.len() as isize / 2;
    let sum = |i| {
        let terms = taps.iter().zip(-reach..);
        terms
            .map(|(tap, offset)| tap * at(signal, i + offset))
            .sum()
    };
    (0..signal.len() as isize).map(sum).collect()
}

fn downsampled(signal: &[f64]) -> Vec<f64> {
    let pair = |i| (at(signal, 2 * i), at(signal, 2 * i + 1));
    let sum = |i| {
        let (a, b) = pair(i);
        0.125 * (at(signal, 2 * i - 1) + at(signal, 2 * i + 2)) + 0.375 * (a + b)
    };
    (0..signal.len() as isize / 2).map(sum).collect()
}

fn upsampled(signal: &[f64]) -> Vec<f64> {
    let between = |i: isize| {
        let other = if i % 2 == 0 { i / 2 - 1 } else { i / 2 + 1 };
        0.75 * at(signal, i / 2) + 0.25 * at(signal, other)
    };
    (0..2 * signal.len() as isize).map(between).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::KERNELS;

    #[test]
    fn every_kernel_has_its_variance() {
        // The second moment of the response to an edge is the sum of all variances.
        let middle = LENGTH as f64 / 2.0;
        let edge: Vec<f64> = (0..LENGTH)
            .map(|i| step(i as f64 + 0.5 - middle, 1.0))
            .collect();
        for kernels in KERNELS {
            let columns = kernels.pass(&edge, 3);
            let fine = kernels.fine.blurs.iter().map(|b| b.0);
            let coarse = |l| {
                kernels
                    .coarse
                    .blurs
                    .iter()
                    .map(move |b| b.0 * f64::powi(4.0, l))
            };
            let wanted = [0.0]
                .into_iter()
                .chain(fine)
                .chain((1..=3).flat_map(coarse));
            for (column, variance) in columns.iter().zip(wanted) {
                let moment: f64 = column
                    .windows(2)
                    .zip(1..)
                    .map(|(pair, i)| (pair[1] - pair[0]) * (i as f64 - middle).powi(2))
                    .sum();
                // Differences of neighbours see the edge through a pixel: 1/12 px² more.
                let found = moment - 1.0 - 1.0 / 12.0;
                assert!(
                    (found - variance).abs() < 0.02 * variance + 1e-3,
                    "{found} for {variance}"
                );
            }
        }
    }
}
