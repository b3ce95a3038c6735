//! Burley's normalised diffusion, summed over a disk of samples that each pixel turns its own way.
//! Driver of `burley_disk.wgsl`.
//!
//! E. Golubev. *Efficient screen-space subsurface scattering using Burley's normalized diffusion in
//! real-time.* SIGGRAPH Advances in Real-Time Rendering, 2018; *Sampling Burley's normalized
//! diffusion profiles*, 2019.

use std::f64::consts::PI;
use std::fmt::Write;

use crate::Error;
use glam::DVec3;
use subsurface::wgpu::{
    BindGroup, BindingResource, CommandEncoder, Device, Queue, TextureFormat, TextureView,
};
use subsurface::{Frame, Profile};

use super::edge::{distances_mm, minimise, scattered_step, terms, vec3f};
use super::packed::{PACKED_BYTES, PACKED_FETCHES, Packed, SCREEN};
use super::pass::{Over, Pass, Slot};
use crate::method::ScreenMethod;

/// As in the shader.
const REACH: f64 = 16.6;
const PX_PER_SAMPLE: f64 = 4.0;
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// The shape s of each channel, in 1/mm, whose edge is nearest to that of `profile`, and the worst
/// error on that edge.
pub fn fitted_shape(profile: &Profile) -> (DVec3, DVec3) {
    let terms = terms(profile);
    let edge: Vec<_> = distances_mm(&terms).map(|x| (x, scattered_step(x, 0.0, &terms))).collect();
    let radii = radii(256);
    let (mut shape, mut worst) = (DVec3::ZERO, DVec3::ZERO);
    for channel in 0..3 {
        let error = |p: &[f64]| -> f64 {
            let s = p[0].exp();
            let off = |(x, truth): &(f64, DVec3)| (step(&radii, s * x) - truth[channel]).abs();
            edge.iter().map(off).fold(0.0, f64::max)
        };
        let (best, least) = minimise(error, &[0.0], 1.0);
        shape[channel] = best[0].exp();
        worst[channel] = least;
    }
    (shape, worst)
}

/// Radii sr within which equal shares of the light stay, at the middle of each: the inverse of the
/// CDF 1 − ¼e^(−sr) − ¾e^(−sr/3).
fn radii(count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| {
            let u = 1.0 - (i as f64 + 0.5) / count as f64;
            let g = (1.0 + 4.0 * u * (2.0 * u + (1.0 + 4.0 * u * u).sqrt())).cbrt();
            3.0 * ((1.0 + 1.0 / g + g) / (4.0 * u)).ln()
        })
        .collect()
}

/// The step edge at distance sx ≥ 0: of the light on a ring of radius sr, acos(x/r)/π lies beyond.
fn step(radii: &[f64], sx: f64) -> f64 {
    let beyond: f64 = radii.iter().map(|r| (sx / r).min(1.0).acos()).sum();
    1.0 - beyond / PI / radii.len() as f64
}

pub struct BurleyDisk {
    packed: Packed,
    disk: Pass,
    samples: usize,
    widest_per_mm: f64,
    prepared: Option<BindGroup>,
}

impl BurleyDisk {
    /// With at most `samples` samples a pixel, of the given shape in 1/mm.
    pub fn new(device: &Device, format: TextureFormat, shape: DVec3, samples: usize) -> Self {
        let slots = [Slot::Uniform, Slot::Float, Slot::Uint, Slot::Float];
        let shader = [SCREEN, include_str!("burley_disk.wgsl"), &samples_wgsl(shape, samples)].concat();
        Self {
            packed: Packed::new(device, format),
            disk: Pass::over(
                Over::Skin,
                device,
                "rivals burley_disk",
                (&shader, "fs_disk"),
                &slots,
                &[format.into()],
                &[],
            ),
            samples,
            widest_per_mm: shape.min_element(),
            prepared: None,
        }
    }
}

/// The samples, written out. Radii are of the channel that scatters farthest.
fn samples_wgsl(shape: DVec3, samples: usize) -> String {
    let widest_per_mm = shape.min_element();
    let mut text = format!(
        "const S_PER_MM = {};\n\
         const WIDEST_PER_MM = {widest_per_mm:?};\n\
         const SAMPLES = {:?};\n\
         fn all_samples(center: Center) -> Sums {{\n    \
         var sums: Sums;\n",
        vec3f(shape),
        samples as f64
    );
    for (i, sr) in radii(samples).into_iter().enumerate() {
        let r_mm = sr / widest_per_mm;
        let over_pdf = r_mm / widest_per_mm / ((-sr).exp() + (-sr / 3.0).exp());
        let (sin, cos) = (i as f64 * GOLDEN_ANGLE).sin_cos();
        // Writing to a String cannot fail.
        let _ =
            writeln!(text, "    sample(center, {r_mm:?}, {over_pdf:?}, vec2f({cos:?}, {sin:?}), &sums);");
    }
    text + "    return sums;\n}\n"
}

impl ScreenMethod for BurleyDisk {
    fn prepare(&mut self, device: &Device, _: &Queue, frame: &Frame) -> Result<(), Error> {
        let inputs = self.packed.prepare(device, frame)?;
        let group = self.disk.bind(
            device,
            &[
                inputs.frame.as_entire_binding(),
                BindingResource::TextureView(&inputs.color),
                BindingResource::TextureView(&inputs.surface),
                BindingResource::TextureView(frame.irradiance),
            ],
        );
        self.prepared = Some(group);
        Ok(())
    }

    fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error> {
        if let Some(group) = &self.prepared {
            self.packed.render(encoder);
            self.packed.finish(encoder, (&self.disk, group), output);
        }
        Ok(())
    }

    /// Color and surface for each sample, the pixel's surface and the alpha that is kept.
    fn fetches(&self, px_per_mm: f64) -> Option<f64> {
        let reach_px = REACH / self.widest_per_mm * px_per_mm;
        let samples = match (PI * reach_px * reach_px / PX_PER_SAMPLE).ceil() {
            _ if reach_px < 1.0 => 0.0,
            count => count.min(self.samples as f64),
        };
        Some(PACKED_FETCHES + 2.0 + 2.0 * samples)
    }

    fn scratch_bytes_per_pixel(&self) -> f64 {
        PACKED_BYTES
    }
}
