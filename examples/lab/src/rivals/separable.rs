//! Two passes of one kernel with a weight for each colour: the separable kernels. Driver of
//! `separable.wgsl`.
//!
//! J. Jimenez, K. Zsolnai, A. Jarabo et al. *Separable subsurface scattering.* Computer Graphics
//! Forum 34(6), 2015, and the kernel and depth test of the authors' demo of 2012.

use std::fmt::Write;

use crate::Error;
use glam::DVec3;
use subsurface::wgpu::{
    BindGroup, BindingResource, Color, CommandEncoder, Device, Queue, Sampler, TextureFormat, TextureView,
};
use subsurface::{Frame, Profile};

use super::edge::{Responses, minimise, step, terms, vec3f};
use super::packed::{COLOR, PACKED_BYTES, PACKED_FETCHES, Packed, SCREEN};
use super::pass::{CLEAR, Over, Pass, Slot, scratch, size};
use crate::method::ScreenMethod;
use crate::passes::linear_sampler;

/// Depth difference, as a multiple of the kernel's width, from which a tap takes the center's
/// light. The demo has s = 300 · distance to the projection window · `sssWidth` · |Δz| in units of
/// its scene: with its field of view of 20° and its `sssWidth` of .012, s = 1 at 4.08 `sssWidth`. Its
/// outermost tap lies `sssWidth` · distance / z of the frame away, which is 2z / distance tall: the
/// width is two of them.
const WIDTHS_SATURATE: f64 = 0.5 / (300.0 * 5.671 * 0.012 * 0.012);

/// A kernel of 2n + 1 taps: the center and n pairs.
#[derive(Clone, Debug)]
pub struct Kernel {
    /// Distance of each pair from the center, which is the first, at 0.
    pub offsets_mm: Vec<f64>,
    /// Weight of each pair, both taps together; they sum to 1.
    pub weights: Vec<DVec3>,
    /// Where the demo's outermost tap is, to which all taps scale.
    width_mm: f64,
    /// The worst error on the edges that it was fitted on.
    pub worst: f64,
}

/// The kernel of the demo, of `pairs` pairs: the red column of the skin profile without its
/// narrowest Gaussian, *evaluated* at the offsets, stretched for each colour by a falloff, weighted
/// by the gap to the neighbouring taps, normalised, and lerped with the center by a strength.
///
/// What it scatters by is a profile of its own. The chart gives it its best: width, falloffs and
/// strengths are those of the least worst error on edges against `profile`.
pub fn published_kernel(profile: &Profile, pairs: usize) -> Kernel {
    let terms = terms(profile);
    let range = if 2 * pairs + 1 > 20 { 3.0 } else { 2.0 };
    let fit = |width_mm: f64| {
        let offsets_mm = offsets(pairs, range * width_mm / 3.0);
        let responses = Responses::of_taps(&terms, &offsets_mm);
        let mut weights = vec![DVec3::ZERO; pairs + 1];
        let mut worst: f64 = 0.0;
        for channel in 0..3 {
            let column = |p: &[f64]| published_weights(pairs, range, p[0].exp(), p[1].clamp(0.0, 1.0));
            let error = |p: &[f64]| responses.worst(&column(p), channel);
            let starts = [[0.0, 0.9], [-1.0, 0.5], [-2.0, 0.3]];
            let (best, least) = starts
                .iter()
                .map(|start| minimise(error, start, 0.5))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap_or_default();
            worst = worst.max(least);
            for (to, from) in weights.iter_mut().zip(column(&best)) {
                to[channel] = from;
            }
        }
        Kernel { offsets_mm, weights, width_mm, worst }
    };
    best_width(profile, fit)
}

/// One channel of the demo's kernel at a falloff and a strength, pairs together.
fn published_weights(pairs: usize, range: f64, falloff: f64, strength: f64) -> Vec<f64> {
    // Red of the skin profile, variances in units of the kernel.
    const RED: [(f64, f64); 5] =
        [(0.0484, 0.100), (0.187, 0.118), (0.567, 0.113), (1.99, 0.358), (7.41, 0.078)];
    let profile = |x: f64| -> f64 {
        let r = x / (0.001 + falloff);
        RED.iter().map(|(v, w)| w * (-r * r / (2.0 * v)).exp() / (2.0 * std::f64::consts::PI * v)).sum()
    };
    let o = offsets(pairs, range);
    let gap = |k: usize| match k {
        0 => o[1],
        k if k == pairs => o[k] - o[k - 1],
        k => o[k + 1] - o[k - 1],
    };
    let mut weights: Vec<f64> = (0..=pairs).map(|k| gap(k) * profile(o[k])).collect();
    let sum: f64 = weights.iter().sum();
    for w in &mut weights {
        *w *= strength / sum;
    }
    weights[0] += 1.0 - strength;
    weights
}

/// The best single separable kernel of `pairs` pairs: a(x) = Σ cⱼ G₁(vⱼ, x), see [`line_mixture`];
/// each tap has the integral of a over its cell.
pub fn fitted_kernel(profile: &Profile, pairs: usize) -> Kernel {
    let terms = terms(profile);
    let (mixture, _) = line_mixture(profile);
    let below = |x_mm: f64| -> DVec3 { mixture.iter().map(|(v, c)| *c * step(x_mm, *v)).sum() };
    let fit = |width_mm: f64| {
        let offsets_mm = offsets(pairs, width_mm);
        let boundary = |k: usize| match k {
            k if k < pairs => below(0.5 * (offsets_mm[k] + offsets_mm[k + 1])),
            _ => DVec3::ONE,
        };
        // Twice what lies on this side: half of the center's cell, then the pairs'.
        let mut before = DVec3::splat(0.5);
        let weights: Vec<_> = (0..=pairs)
            .map(|k| 2.0 * (boundary(k) - std::mem::replace(&mut before, boundary(k))))
            .collect();
        let responses = Responses::of_taps(&terms, &offsets_mm);
        let worst = (0..3)
            .map(|channel| {
                let column: Vec<_> = weights.iter().map(|w| w[channel]).collect();
                responses.worst(&column, channel)
            })
            .fold(0.0, f64::max);
        Kernel { offsets_mm, weights, width_mm, worst }
    };
    best_width(profile, fit)
}

/// The kernel along a line that, passed along rows and columns, has the least worst error on edges
/// at 0 to 45°: a(x) = Σ cⱼ G₁(vⱼ, x) with cⱼ ≥ 0 over the variances of the profile, and over none,
/// which is light that stays. Returns each vⱼ in mm² with the cⱼ of red, green and blue, and the
/// worst error of each color on the edges that they were fitted on.
pub fn line_mixture(profile: &Profile) -> (Vec<(f64, DVec3)>, DVec3) {
    let terms = terms(profile);
    let start: Vec<_> = std::iter::once((0.0, DVec3::ZERO)).chain(terms.iter().copied()).collect();
    let variances_mm2: Vec<_> = start.iter().map(|(v, _)| *v).collect();
    let responses = Responses::of_gaussians(&terms, &variances_mm2);
    // Shares of squares are at least 0 and sum to 1.
    let shares = |p: &[f64]| -> Vec<f64> {
        let sum: f64 = p.iter().map(|p| p * p).sum();
        p.iter().map(|p| p * p / sum.max(1e-12)).collect()
    };
    let mut mixture = start.clone();
    let mut worst = DVec3::ZERO;
    for channel in 0..3 {
        let start: Vec<_> = start.iter().map(|(_, w)| w[channel].sqrt()).collect();
        let (best, least) = minimise(|p| responses.worst(&shares(p), channel), &start, 0.2);
        worst[channel] = least;
        for ((_, to), from) in mixture.iter_mut().zip(shares(&best)) {
            to[channel] = from;
        }
    }
    (mixture, worst)
}

/// The kernel of the least worst error over widths from .5 to 10 of the widest Gaussian's σ.
fn best_width(profile: &Profile, fit: impl Fn(f64) -> Kernel) -> Kernel {
    let widest = terms(profile).iter().map(|(v, _)| *v).fold(0.0, f64::max);
    const STEPS: i32 = 24;
    let width = |i: i32| 0.5 * widest.sqrt() * 20f64.powf(f64::from(i) / f64::from(STEPS));
    let mut best = fit(width(0));
    for i in 1..=STEPS {
        let kernel = fit(width(i));
        if kernel.worst < best.worst {
            best = kernel;
        }
    }
    best
}

/// The demo's offsets, denser towards the center: sgn(o)·o²/R with o evenly from −R to R; here
/// those from 0 to `reach` = R.
fn offsets(pairs: usize, reach: f64) -> Vec<f64> {
    (0..=pairs).map(|k| reach * (k as f64 / pairs as f64).powi(2)).collect()
}

/// A separable kernel, passed along rows and then along columns.
pub struct Separable {
    packed: Packed,
    rows: Pass,
    columns: Pass,
    linear: Sampler,
    taps: usize,
    scratch: Option<[TextureView; 1]>,
    prepared: Option<(BindGroup, BindGroup)>,
}

impl Separable {
    pub fn new(device: &Device, format: TextureFormat, kernel: &Kernel) -> Self {
        let shader = [SCREEN, include_str!("separable.wgsl"), &kernel.wgsl()].concat();
        let slots = [Slot::Uniform, Slot::Filtered, Slot::Sampler, Slot::Uint, Slot::Float];
        let pass = |entry_point, target: TextureFormat| {
            let label = format!("rivals separable {entry_point}");
            let shader = (shader.as_str(), entry_point);
            Pass::over(Over::Skin, device, &label, shader, &slots, &[target.into()], &[])
        };
        Self {
            packed: Packed::new(device, format),
            rows: pass("fs_rows", COLOR),
            columns: pass("fs_columns", format),
            linear: linear_sampler(device, "rivals separable"),
            taps: 2 * kernel.weights.len() - 1,
            scratch: None,
            prepared: None,
        }
    }
}

impl Kernel {
    /// The taps, written out.
    fn wgsl(&self) -> String {
        let saturates = WIDTHS_SATURATE * self.width_mm;
        let mut text = format!(
            "const MM_SATURATES = {saturates:?};\n\
             fn taps(center: Center) -> vec3f {{\n    \
             var sum = {} * center.color;\n",
            vec3f(self.weights[0])
        );
        for (offset, pair) in self.offsets_mm.iter().zip(&self.weights).skip(1) {
            // Writing to a String cannot fail.
            let _ = writeln!(
                text,
                "    sum += {} * (tap(center, {offset:?}) + tap(center, -{offset:?}));",
                vec3f(*pair * 0.5)
            );
        }
        text + "    return sum;\n}\n"
    }
}

impl ScreenMethod for Separable {
    fn prepare(&mut self, device: &Device, _: &Queue, frame: &Frame) -> Result<(), Error> {
        let inputs = self.packed.prepare(device, frame)?;
        let size = size(frame.irradiance);
        let label = "rivals separable rows";
        let views = scratch(device, label, self.scratch.take(), size, [COLOR]);
        let [rows] = self.scratch.insert(views);
        let bind = |pass: &Pass, color| {
            pass.bind(
                device,
                &[
                    inputs.frame.as_entire_binding(),
                    BindingResource::TextureView(color),
                    BindingResource::Sampler(&self.linear),
                    BindingResource::TextureView(&inputs.surface),
                    BindingResource::TextureView(frame.irradiance),
                ],
            )
        };
        self.prepared = Some((bind(&self.rows, &inputs.color), bind(&self.columns, rows)));
        Ok(())
    }

    fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error> {
        if let (Some([rows]), Some((row_group, column_group))) = (&self.scratch, &self.prepared) {
            self.packed.render(encoder);
            let targets = [(rows, CLEAR)];
            self.packed.draw(encoder, (&self.rows, row_group), &targets, Color::BLACK);
            self.packed.finish(encoder, (&self.columns, column_group), output);
        }
        Ok(())
    }

    /// Color and surface for each tap of both passes, and the alpha that is kept.
    fn fetches(&self, _px_per_mm: f64) -> Option<f64> {
        Some(PACKED_FETCHES + 2.0 * 2.0 * self.taps as f64 + 1.0)
    }

    fn scratch_bytes_per_pixel(&self) -> f64 {
        PACKED_BYTES + 8.0
    }
}
