//! Light from behind as engines ship it: on top of a screen-space method, what falls on the far side times what a
//! slab of the part's thickness passes. Driver of `transmission.wgsl`.
//!
//! Both papers guess the far side: its thickness by a shadow map or a texture, its light by the visible normal
//! turned around. Here they get the truth, the layer behind: thickness along the camera's axis, and light.

use subsurface::wgpu::{
    self, BindGroup, BindingResource, Color, ColorTargetState, ColorWrites, CommandEncoder, Device, LoadOp,
    Queue, TextureFormat, TextureView,
};
use subsurface::{Frame, Profile};

use super::edge::{terms, vec3f};
use super::packed::{SCREEN, uniform_buffer};
use super::pass::{self, Pass, Slot};
use super::{burley_disk, separable};
use crate::Error;
use crate::method::ScreenMethod;

/// On top of the separable kernel of 17 taps; without a layer behind, that alone.
pub struct Transmission {
    base: separable::Separable,
    pass: Pass,
    prepared: Option<BindGroup>,
}

/// What a slab passes, in WGSL: Σ w e^(−t²/fv). The papers' code has f = 1 and a scale of t that is set by eye; the
/// integral of a Gaussian over a plane at the distance t has f = 2.
pub fn gaussians(profile: &Profile, factor: f64) -> String {
    let terms = terms(profile).into_iter().filter(|(variance_mm2, _)| *variance_mm2 > 0.0);
    let terms =
        terms.map(|(v, weight)| format!("{} * exp(t_mm * t_mm / {:?})", vec3f(weight), -factor * v));
    transmittance(&terms.collect::<Vec<_>>().join(" + "))
}

/// ¼(e^(−st) + 3e^(−st/3)).
pub fn burley(profile: &Profile) -> String {
    let (shape, _) = burley_disk::fitted_shape(profile);
    let third = format!("exp({} * t_mm)", vec3f(shape / -3.0));
    transmittance(&format!("0.25 * (pow({third}, vec3f(3.0)) + 3.0 * {third})"))
}

fn transmittance(sum: &str) -> String {
    format!("fn transmittance(t_mm: f32) -> vec3f {{\n    return {sum};\n}}\n")
}

impl Transmission {
    pub fn new(device: &Device, format: TextureFormat, profile: &Profile, transmittance: &str) -> Self {
        let one = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        let blend = Some(wgpu::BlendState { color: one, alpha: one });
        Self {
            base: separable::Separable::new(device, format, &separable::published_kernel(profile, 8)),
            pass: Pass::new(
                device,
                "rivals transmission",
                (&[SCREEN, include_str!("transmission.wgsl"), transmittance].concat(), "fs_transmission"),
                &[Slot::Uniform, Slot::Float, Slot::Uint, Slot::Float, Slot::Float],
                &[ColorTargetState { format, blend, write_mask: ColorWrites::COLOR }],
                &[],
            ),
            prepared: None,
        }
    }
}

impl ScreenMethod for Transmission {
    fn prepare(&mut self, device: &Device, queue: &Queue, frame: &Frame) -> Result<(), Error> {
        self.base.prepare(device, queue, frame)?;
        self.prepared = match (frame.profile_id, frame.back) {
            (Some(profile_id), Some(back)) => {
                let texture = BindingResource::TextureView;
                let uniform = uniform_buffer(device, frame, profile_id)?;
                let textures = [frame.depth, profile_id, back.irradiance, back.depth].map(texture);
                let resources: Vec<_> =
                    std::iter::once(uniform.as_entire_binding()).chain(textures).collect();
                Some(self.pass.bind(device, &resources))
            }
            _ => None,
        };
        Ok(())
    }

    fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error> {
        self.base.render(encoder, output)?;
        if let Some(group) = &self.prepared {
            pass::draw(encoder, &[(&self.pass, group)], &[(output, LoadOp::Load)], None, Color::BLACK);
        }
        Ok(())
    }

    fn fetches(&self, px_per_mm: f64) -> Option<f64> {
        Some(self.base.fetches(px_per_mm)? + 4.0)
    }

    fn scratch_bytes_per_pixel(&self) -> f64 {
        self.base.scratch_bytes_per_pixel()
    }
}
