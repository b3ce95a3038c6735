//! The first scattering in screen space: a cascade of Gaussian blurs. Driver of
//! `jimenez_2009.wgsl`.
//!
//! J. Jimenez, V. Sundstedt, D. Gutierrez. *Screen-space perceptual rendering of human skin.* ACM
//! Transactions on Applied Perception 6(4), 2009.

use crate::Error;
use glam::DVec3;
use subsurface::Frame;
use subsurface::wgpu::{
    self, BindGroup, BindingResource, BlendFactor, Color, ColorTargetState, ColorWrites, CommandEncoder,
    Device, LoadOp, Queue, Sampler, TextureFormat, TextureView,
};

use super::copy::Copy;
use super::packed::{COLOR, PACKED_BYTES, PACKED_FETCHES, Packed, SCREEN};
use super::pass::{CLEAR, Over, Pass, Slot, scratch, size};
use crate::method::ScreenMethod;
use crate::passes::linear_sampler;

/// Skin as the paper has it, in four Gaussians (variance in mm², weights of red, green and blue);
/// the narrowest is the pixel itself.
const SKIN: [(f64, DVec3); 4] = [
    (0.0, DVec3::new(0.2405, 0.4474, 0.6158)),
    (0.05165, DVec3::new(0.1159, 0.3662, 0.3439)),
    (0.27193, DVec3::new(0.1836, 0.1864, 0.0)),
    (2.00626, DVec3::new(0.4600, 0.0, 0.0403)),
];

/// Each blur is of what the former one left, by the variance that it lacks, and blends into the
/// output as the paper does it: lerped by its weight among those so far.
pub struct Jimenez2009 {
    packed: Packed,
    /// What the blurs are blended onto.
    copy: Copy,
    blurs: Vec<Blur>,
    linear: Sampler,
    scratch: Option<[TextureView; 1]>,
    prepared: Option<Prepared>,
}

struct Blur {
    rows: Pass,
    columns: Pass,
    share: Color,
}

struct Prepared {
    /// For each blur, along rows and along columns.
    groups: Vec<(BindGroup, BindGroup)>,
    color: TextureView,
}

impl Jimenez2009 {
    /// # Errors
    /// An output format that cannot be blended onto.
    pub fn new(device: &Device, format: TextureFormat) -> Result<Self, Error> {
        let features = format.guaranteed_format_features(device.features());
        let blendable = wgpu::TextureFormatFeatureFlags::BLENDABLE;
        if !features.flags.contains(blendable) {
            return Err(Error::new(
                "output_format",
                format!("{format:?}"),
                "a format that can be blended onto",
            ));
        }
        let shader = [SCREEN, include_str!("seven_taps.wgsl"), include_str!("jimenez_2009.wgsl")].concat();
        let slots = [Slot::Uniform, Slot::Filtered, Slot::Sampler, Slot::Uint];
        let sum = ColorTargetState {
            format,
            blend: Some(wgpu::BlendState {
                color: wgpu::BlendComponent {
                    src_factor: BlendFactor::Constant,
                    dst_factor: BlendFactor::OneMinusConstant,
                    operation: wgpu::BlendOperation::Add,
                },
                alpha: wgpu::BlendComponent::REPLACE,
            }),
            write_mask: ColorWrites::COLOR,
        };
        let mut blurs = Vec::new();
        let (mut before_mm2, mut so_far) = SKIN[0];
        for (variance_mm2, weight) in SKIN.into_iter().skip(1) {
            so_far += weight;
            let share = weight / so_far;
            let sigma_mm = (variance_mm2 - before_mm2).sqrt();
            before_mm2 = variance_mm2;
            let pass = |entry_point, targets: &[ColorTargetState]| {
                Pass::over(
                    Over::Skin,
                    device,
                    &format!("rivals jimenez_2009 {entry_point}"),
                    (&shader, entry_point),
                    &slots,
                    targets,
                    &[("sigma_mm", sigma_mm)],
                )
            };
            blurs.push(Blur {
                rows: pass("fs_rows", &[COLOR.into()]),
                columns: pass("fs_columns", &[COLOR.into(), sum.clone()]),
                share: Color { r: share.x, g: share.y, b: share.z, a: 1.0 },
            });
        }
        Ok(Self {
            packed: Packed::new(device, format),
            copy: Copy::new(device, format),
            blurs,
            linear: linear_sampler(device, "rivals jimenez_2009"),
            scratch: None,
            prepared: None,
        })
    }
}

impl ScreenMethod for Jimenez2009 {
    fn prepare(&mut self, device: &Device, queue: &Queue, frame: &Frame) -> Result<(), Error> {
        self.copy.prepare(device, queue, frame)?;
        let inputs = self.packed.prepare(device, frame)?;
        let size = size(frame.irradiance);
        let label = "rivals jimenez_2009 rows";
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
                ],
            )
        };
        let groups = self
            .blurs
            .iter()
            .map(|blur| (bind(&blur.rows, &inputs.color), bind(&blur.columns, rows)))
            .collect();
        self.prepared = Some(Prepared { groups, color: inputs.color });
        Ok(())
    }

    fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error> {
        let (Some([rows]), Some(prepared)) = (&self.scratch, &self.prepared) else {
            return Ok(());
        };
        self.packed.render(encoder);
        self.copy.render(encoder, output)?;
        for (blur, (row_group, column_group)) in self.blurs.iter().zip(&prepared.groups) {
            let targets = [(rows, CLEAR)];
            self.packed.draw(encoder, (&blur.rows, row_group), &targets, blur.share);
            let targets = [(&prepared.color, CLEAR), (output, LoadOp::Load)];
            self.packed.draw(encoder, (&blur.columns, column_group), &targets, blur.share);
        }
        Ok(())
    }

    /// The copy; seven taps and the surface, six times.
    fn fetches(&self, _px_per_mm: f64) -> Option<f64> {
        Some(1.0 + PACKED_FETCHES + 2.0 * 8.0 * self.blurs.len() as f64)
    }

    fn scratch_bytes_per_pixel(&self) -> f64 {
        PACKED_BYTES + 8.0
    }
}
