//! A frame as the screen-space rivals read it. Driver of `packed.wgsl`.

use crate::Error;
use glam::Vec4;
use subsurface::Frame;
use subsurface::wgpu::util::DeviceExt;
use subsurface::wgpu::{
    self, BindGroup, Buffer, CommandEncoder, Device, TextureFormat, TextureView,
};

use super::pass::{Pass, Slot, Target, scratch, size};

/// Color, for which the papers take half floats.
pub const COLOR: TextureFormat = TextureFormat::Rgba16Float;
const SURFACE: TextureFormat = TextureFormat::R32Uint;

/// Bytes a pixel.
pub const PACKED_BYTES: f64 = 8.0 + 4.0;
/// Texels read for a pixel.
pub const PACKED_FETCHES: f64 = 3.0;

/// The shader text that rivals put theirs behind.
pub const SCREEN: &str = concat!(include_str!("triangle.wgsl"), include_str!("screen.wgsl"));

/// Color with the mask in alpha, and depth with the id. The papers have linear depth and a stencil
/// from their G-buffers; here a pass of its own makes them, which spares every tap a division and
/// a fetch.
pub struct Packed {
    pass: Pass,
    /// Whether the pass writes the irradiance to the output, too.
    copies: bool,
    scratch: Option<[TextureView; 2]>,
    prepared: Option<BindGroup>,
}

/// What [`Packed::prepare`] leaves for the passes behind it.
pub struct Inputs {
    pub frame: Buffer,
    pub color: TextureView,
    pub surface: TextureView,
}

impl Packed {
    /// `copy_to` is the output's format where the irradiance is to be written there at once.
    pub fn new(device: &Device, copy_to: Option<TextureFormat>) -> Self {
        let mut targets: Vec<Target> = vec![COLOR.into(), SURFACE.into()];
        targets.extend(copy_to.map(Target::from));
        Self {
            pass: Pass::new(
                device,
                "rivals packed",
                (&[SCREEN, include_str!("packed.wgsl")].concat(), "fs_pack"),
                &[Slot::Uniform, Slot::Float, Slot::Float, Slot::Uint],
                &targets,
                &[],
            ),
            copies: copy_to.is_some(),
            scratch: None,
            prepared: None,
        }
    }

    pub fn prepare(&mut self, device: &Device, frame: &Frame) -> Result<Inputs, Error> {
        let (Some(profile_id), None, None) = (frame.profile_id, frame.strength, frame.viewport)
        else {
            return Err(Error::new(
                "frame",
                "no profile_id, or a strength or viewport",
                "ids alone: rivals know no more",
            ));
        };
        let uniform = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("rivals frame"),
            contents: bytemuck::bytes_of(&uniform(frame, profile_id)?),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let views = scratch(
            device,
            "rivals packed",
            self.scratch.take(),
            size(frame.irradiance),
            [COLOR, SURFACE],
        );
        let group = self.pass.bind(
            device,
            &[
                uniform.as_entire_binding(),
                wgpu::BindingResource::TextureView(frame.irradiance),
                wgpu::BindingResource::TextureView(frame.depth),
                wgpu::BindingResource::TextureView(profile_id),
            ],
        );
        self.prepared = Some(group);
        let [color, surface] = self.scratch.insert(views).clone();
        Ok(Inputs {
            frame: uniform,
            color,
            surface,
        })
    }

    /// `output` is where the irradiance goes, if anywhere.
    pub fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) {
        if let (Some(group), Some([color, surface])) = (&self.prepared, &self.scratch) {
            let mut targets = vec![color, surface];
            if self.copies {
                targets.push(output);
            }
            self.pass.draw(encoder, group, &targets);
        }
    }
}

/// `frame` of the shaders. With clip z and w linear in view z, depth d = (P₂₂z + P₂₃)/(P₃₂z + P₃₃)
/// solves to z = (P₂₃ − d·P₃₃)/(d·P₃₂ − P₂₂), and a pixel is 2|w|/(W·P₀₀) wide.
fn uniform(frame: &Frame, profile_id: &wgpu::TextureView) -> Result<[Vec4; 2], Error> {
    let p = glam::Mat4::from_cols_array_2d(&frame.projection);
    let mm = frame.mm_per_unit;
    let size = size(frame.irradiance);
    for (input, view) in [("depth", frame.depth), ("profile_id", profile_id)] {
        let [width, height] = self::size(view);
        if [width, height] != size {
            return Err(Error::new(
                format!("{input}: size"),
                format!("{width}x{height}"),
                format!("{}x{} as the irradiance has", size[0], size[1]),
            ));
        }
    }
    let (z, w) = (p.row(2), p.row(3));
    let of_z_alone = [z.x, z.y, w.x, w.y] == [0.0; 4];
    if !p.is_finite() || p.determinant() == 0.0 || !of_z_alone || p.x_axis.y != 0.0 {
        return Err(Error::new(
            "projection",
            format!("{p}"),
            "a finite, invertible projection whose depth is of view z alone",
        ));
    }
    if !mm.is_finite() || mm <= 0.0 {
        return Err(Error::new(
            "mm_per_unit",
            mm.to_string(),
            "a finite number above 0",
        ));
    }
    let x = 2.0 / (size[0] as f32 * p.x_axis.x);
    let y = 2.0 / (size[1] as f32 * p.y_axis.y);
    Ok([
        Vec4::new(z.w * mm, w.w * mm, w.z, z.z),
        Vec4::new(x * w.w * mm, x * w.z, y * w.w * mm, y * w.z),
    ])
}
