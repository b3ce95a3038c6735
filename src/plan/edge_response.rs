//! What the passes make of straight edges: the columns that a plan's weights are fitted on.
//!
//! A picture of an edge along a direction (a, b) of small integers is a signal over k = a·x + b·y, and
//! so is all that blurs and downsampling make of it.

use std::collections::BTreeMap;

use libm::erfc;

use super::kernels::Kernels;
use super::kernels::Taps;
use crate::Profile;

/// Of the signals, in pixels; wide enough for the widest level.
const LENGTH: usize = 16384;

/// An edge that is passed through the pyramid: across which direction, soft by σ = 1 px or hard, and
/// where the pixels that look at it lie.
struct Edge {
    across: [i32; 2],
    soft: bool,
    /// In pixels.
    shift: f64,
}

/// Along an axis, where phases matter most, every phase of the fine levels and some of the coarse ones.
const SHIFTS: [f64; 10] = [0.0, 0.4, 1.0, 2.0, 3.0, 6.3, 13.0, 27.6, 54.0, 105.0];
/// At 45° and 27°.
const OBLIQUE: [[i32; 2]; 2] = [[1, 1], [2, 1]];
const OBLIQUE_SHIFTS: [f64; 3] = [0.3, 2.9, 13.0];

/// The directions across which edges are looked at.
const DIRECTIONS: [[i32; 2]; 3] = [[1, 0], OBLIQUE[0], OBLIQUE[1]];

/// Edges, where they are looked at, and what each blur makes of them there.
pub(super) struct Responses {
    samples: Vec<Sample>,
    /// Of the light that stays, then of each blur: its response at every sample.
    pub columns: Vec<Vec<f64>>,
}

struct Sample {
    across: [i32; 2],
    soft: bool,
    /// Distance from the edge, in pixels.
    x: f64,
}

impl Responses {
    pub(super) fn new(kernels: &Kernels, levels: usize) -> Self {
        let mut responses =
            Self { samples: Vec::new(), columns: vec![Vec::new(); kernels.variances_px2(levels).len()] };
        for soft in [true, false] {
            let of_axis = SHIFTS.iter().map(|shift| ([1, 0], *shift));
            let oblique = OBLIQUE.iter().flat_map(|across| OBLIQUE_SHIFTS.map(|shift| (*across, shift)));
            for (across, shift) in of_axis.chain(oblique) {
                let edge = Edge { across, soft, shift };
                edge.pass(kernels, levels, &edge.pixels(), &mut responses);
            }
        }
        responses
    }

    /// What the profile makes of the edges at `px_per_mm`, for each colour: Σᵢ wᵢ times the response of the
    /// Gaussian vᵢ to a step (Li & Shao 2015, Eq. 9).
    ///
    /// A hard edge is scattered by the weights of the visible integral, on the pixels' lattice.
    pub(super) fn wanted(&self, profile: &Profile, px_per_mm: f64) -> [Vec<f64>; 3] {
        let mut wanted = [0; 3].map(|_| vec![0.0; self.samples.len()]);
        for gaussian in profile.gaussians() {
            let px2 = f64::from(gaussian.variance_mm2) * px_per_mm * px_per_mm;
            let beyond = DIRECTIONS.map(|across| (across, beyond_on_lattice(across, px2)));
            for (i, sample) in self.samples.iter().enumerate() {
                let passed = match beyond.iter().find(|(across, _)| *across == sample.across) {
                    _ if sample.soft => step(sample.x, px2 + 1.0),
                    Some((across, Some(beyond))) => {
                        let n = (sample.x.abs() * length(*across) - 0.5).round() as usize;
                        let above = 1.0 - beyond.get(n).unwrap_or(&0.0);
                        if sample.x > 0.0 { above } else { 1.0 - above }
                    }
                    _ => step(sample.x, px2),
                };
                for (column, weight) in wanted.iter_mut().zip(gaussian.weight) {
                    column[i] += f64::from(weight) * passed;
                }
            }
        }
        wanted
    }
}

fn length([a, b]: [i32; 2]) -> f64 {
    f64::from(a * a + b * b).sqrt()
}

/// ½(1 + erf(x/√2v)), a unit edge that a Gaussian has passed over.
fn step(x: f64, variance: f64) -> f64 {
    // erfc(6) is less than the last digit of 1.
    if x.abs() >= 6.0 * (2.0 * variance).sqrt() {
        return f64::from(x > 0.0);
    }
    0.5 * erfc(-x / (2.0 * variance).sqrt())
}

/// The share of the light that point weights on the lattice put beyond n + ½ steps of k on one side, n
/// from 0; of wide Gaussians none, since the lattice no longer matters.
fn beyond_on_lattice([a, b]: [i32; 2], variance_px2: f64) -> Option<Vec<f64>> {
    // Beyond, the sum over half the lattice is within 1e-4 of the integral.
    if variance_px2 > 100.0 {
        return None;
    }
    let s = lattice_variance(variance_px2);
    let reach = (7.0 * s.sqrt()).ceil() as i32 + 1;
    let weight = |n: i32| (-f64::from(n * n) / (2.0 * s)).exp();
    let weights: Vec<f64> = (-reach..=reach).map(weight).collect();
    let mass: f64 = weights.iter().sum();
    // Over k = a·x + b·y, from its least on.
    let middle = ((a + b) * reach) as usize;
    let mut of_k = vec![0.0; 2 * middle + 1];
    for (x, of_x) in weights.iter().enumerate() {
        for (y, of_y) in weights.iter().enumerate() {
            of_k[a as usize * x + b as usize * y] += of_x * of_y;
        }
    }
    let mut beyond = 0.0;
    let from_last = of_k[middle + 1..].iter().rev().map(|w| {
        beyond += w / (mass * mass);
        beyond
    });
    let mut steps: Vec<f64> = from_last.collect();
    steps.reverse();
    Some(steps)
}

/// As `lattice_variance` in `shaders/exact/gaussian_sum.wgsl`, which derives it; in px².
fn lattice_variance(s: f64) -> f64 {
    const WAVE: f64 = 1.1;
    if !(1e-6..=0.4).contains(&s) {
        return s.max(1e-9);
    }
    let passed = (-0.5 * WAVE * WAVE * s).exp();
    let (near, far) = (WAVE.cos(), (2.0 * WAVE).cos());
    let mut w = 0.0;
    for _ in 0..12 {
        let w4 = f64::powi(w, 4);
        w = 0.5 * (1.0 - passed - 2.0 * (passed - far) * w4) / (passed - near);
    }
    -0.5 / w.ln()
}

fn product(rows: &[(i32, f64)], columns: &[(i32, f64)]) -> Taps {
    let pair = |(x, u): &(i32, f64), (y, v): &(i32, f64)| ([*x, *y], u * v);
    let taps = rows.iter().flat_map(|r| columns.iter().map(move |c| pair(r, c)));
    taps.collect()
}

/// The same over k.
fn projected(taps: &Taps, [a, b]: [i32; 2]) -> Vec<(i32, f64)> {
    let mut sums = BTreeMap::new();
    for ([x, y], w) in taps {
        *sums.entry(a * x + b * y).or_insert(0.0) += w;
    }
    sums.into_iter().collect()
}

/// A picture that depends on k alone and goes on as it ends.
struct Signal {
    /// k of the first value.
    first: i32,
    values: Vec<f64>,
}

impl Signal {
    fn at(&self, k: i32) -> f64 {
        let last = self.values.len() as i32 - 1;
        self.values[(k - self.first).clamp(0, last) as usize]
    }

    fn sum(&self, k: i32, taps: &[(i32, f64)]) -> f64 {
        taps.iter().map(|(offset, w)| w * self.at(k + offset)).sum()
    }

    fn downsampled(&self, across: [i32; 2]) -> Self {
        let row = [(-1, 0.125), (0, 0.375), (1, 0.375), (2, 0.125)];
        let taps = projected(&product(&row, &row), across);
        let first = self.first / 2;
        let values = (0..self.values.len() as i32 / 2).map(|i| self.sum(2 * (first + i), &taps));
        Self { first, values: values.collect() }
    }
}

/// The pixels of the next level that a pixel is interpolated from, of one axis.
fn upsampling(pixel: i32) -> [(i32, f64); 2] {
    let near = pixel.div_euclid(2);
    let other = if pixel.rem_euclid(2) == 0 { near - 1 } else { near + 1 };
    [(near, 0.75), (other, 0.25)]
}

/// Those of level `l` that a pixel of the frame is interpolated from, level by level.
fn interpolation(pixel: i32, l: usize) -> Vec<(i32, f64)> {
    let mut pixels = BTreeMap::from([(pixel, 1.0)]);
    for _ in 0..l {
        let mut coarser = BTreeMap::new();
        for (pixel, w) in pixels {
            for (next, share) in upsampling(pixel) {
                *coarser.entry(next).or_insert(0.0) += w * share;
            }
        }
        pixels = coarser;
    }
    pixels.into_iter().collect()
}

impl Edge {
    /// How far the pixels of k lie from the edge, in pixels; positive where it is lit.
    fn distance(&self, k: i32) -> f64 {
        let n = length(self.across);
        if self.soft {
            // The edge goes through the corner of a pixel, shifted.
            let corner = f64::from(self.across[0] + self.across[1]) / 2.0;
            return (f64::from(k) + corner) / n + self.shift;
        }
        // Pixels know of a hard edge only between which two it lies.
        (f64::from(k) + 0.5 + (self.shift * n).floor()) / n
    }

    fn pass(&self, kernels: &Kernels, levels: usize, pixels: &[[i32; 2]], to: &mut Responses) {
        let n = length(self.across);
        let half = (LENGTH as f64 / 2.0 * n) as i32;
        let edge = |k| match self.soft {
            true => step(self.distance(k), 1.0),
            false => f64::from(self.distance(k) > 0.0),
        };
        let frame = Signal { first: -half, values: (-half..half).map(edge).collect() };
        let [a, b] = self.across;
        let ks: Vec<i32> = pixels.iter().map(|[x, y]| a * x + b * y).collect();
        to.samples.extend(ks.iter().map(|k| Sample {
            across: self.across,
            soft: self.soft,
            x: self.distance(*k),
        }));
        let mut columns = to.columns.iter_mut();
        let mut add = |response: &mut dyn Iterator<Item = f64>| {
            if let Some(column) = columns.next() {
                column.extend(response);
            }
        };
        add(&mut ks.iter().map(|k| frame.at(*k)));
        for blur in kernels.fine.blurs() {
            let taps = projected(&blur.taps(0), self.across);
            add(&mut ks.iter().map(|k| frame.sum(*k, &taps)));
        }
        let mut signal = frame;
        for l in 1..=levels {
            signal = signal.downsampled(self.across);
            let from: Vec<_> = pixels
                .iter()
                .map(|[x, y]| {
                    projected(&product(&interpolation(*x, l), &interpolation(*y, l)), self.across)
                })
                .collect();
            for blur in kernels.coarse.blurs() {
                let taps = projected(&blur.taps(l), self.across);
                let mean =
                    |from: &Vec<(i32, f64)>| from.iter().map(|(k, w)| w * signal.sum(*k, &taps)).sum();
                add(&mut from.iter().map(mean));
            }
        }
    }

    /// Pixels on both sides of the edge, further and further apart.
    fn pixels(&self) -> Vec<[i32; 2]> {
        let reach = 0.42 * LENGTH as f64;
        let mut offsets: Vec<i32> = (0..8).collect();
        let mut offset = 8.0;
        while offset < reach {
            offsets.push(offset as i32);
            offset *= 1.18;
        }
        // Along an oblique edge a pixel's column may be even or odd at the same distance.
        let [a, b] = self.across;
        let column = |i: usize| if b == 0 { 0 } else { (i as i32 % 4) - 2 };
        let place = |(i, offset): (usize, i32)| {
            let k = (f64::from(offset) * length([a, b])).round() as i32;
            [(k - b * column(i)).div_euclid(a), column(i)]
        };
        let both = offsets.iter().flat_map(|o| [*o, -1 - o]);
        both.enumerate().map(place).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lattices_have_the_variance_of_the_shader() {
        let shader = crate::exact::gaussian_sum::SHADER;
        let variances: Vec<f32> = (0..=40).map(|i| 1e-3 * 399f32.powf(i as f32 / 40.0)).collect();
        let inputs: Vec<_> = variances.iter().map(|v| [*v, 1.0, 0.0, 0.0]).collect();
        let call = "vec4f(lattice_variance(x.x, x.y), 0.0, 0.0, 0.0)";
        let found = crate::wgsl::evaluate(shader, call, &inputs);
        for (v, [found, ..]) in variances.iter().zip(found) {
            let wanted = lattice_variance(f64::from(*v));
            // 1 − e^(−ω²v/2) of a single float, from which all follows, has a digit less for each that v is
            // below 1.
            let allowed = 1e-5 + 2e-7 / f64::from(*v);
            let off = (f64::from(found) / wanted - 1.0).abs();
            assert!(off < allowed, "{v} px²: {found}, {wanted}");
        }
    }
    use crate::plan::KERNELS;

    #[test]
    fn every_kernel_has_its_variance() {
        // The second moment of the response to an edge is the sum of all variances.
        for across in [[1, 0], OBLIQUE[0]] {
            let edge = Edge { across, soft: true, shift: 0.3 };
            // One pixel after the other along a row.
            let pixels: Vec<_> = (-160..160).map(|x| [x, 0]).collect();
            for kernels in KERNELS {
                let variances = kernels.variances_px2(3);
                let mut passed =
                    Responses { samples: Vec::new(), columns: vec![Vec::new(); variances.len()] };
                edge.pass(&kernels, 3, &pixels, &mut passed);
                // Differences of neighbours see the edge through the step between them.
                let between = (passed.samples[1].x - passed.samples[0].x).powi(2) / 12.0;
                for (column, variance) in passed.columns.iter().zip(variances) {
                    let differences = column.windows(2).zip(passed.samples.windows(2));
                    let moment: f64 =
                        differences.map(|(c, s)| (c[1] - c[0]) * (0.5 * (s[0].x + s[1].x)).powi(2)).sum();
                    let found = moment - 1.0 - between;
                    assert!(
                        (found - variance).abs() < 0.02 * variance + 1e-3,
                        "{across:?}: {found} for {variance}"
                    );
                }
            }
        }
    }
}
