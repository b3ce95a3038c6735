//! A frame as the screen-space rivals read it. Driver of `packed.wgsl`.

use crate::Error;
use glam::Vec4;
use subsurface::Frame;
use subsurface::wgpu::util::DeviceExt;
use subsurface::wgpu::{
    self, BindGroup, Buffer, Color, CommandEncoder, Device, LoadOp, TextureFormat, TextureView,
};

use super::pass::{self, CLEAR, Over, Pass, STENCIL, Slot, TRIANGLE, scratch, size};

/// Color, for which the papers take half floats.
pub const COLOR: TextureFormat = TextureFormat::Rgba16Float;
const SURFACE: TextureFormat = TextureFormat::R32Uint;

/// Bytes a pixel, the stencil's too.
pub const PACKED_BYTES: f64 = 8.0 + 4.0 + 1.0;
/// Texels read for a pixel.
pub const PACKED_FETCHES: f64 = 3.0;

/// The shader text that rivals put theirs behind.
pub const SCREEN: &str = concat!(include_str!("triangle.wgsl"), include_str!("screen.wgsl"));

/// Color with the mask in alpha, depth with the id, and a stencil of skin, by which all passes behind draw. The
/// papers have linear depth and the stencil from their G-buffers; here a pass of its own makes them, which
/// spares every tap a division and a fetch.
pub struct Packed {
    pass: Pass,
    /// Light as it was, where there is no skin.
    rest: Pass,
    scratch: Option<[TextureView; 3]>,
    /// Of both passes.
    prepared: Option<[BindGroup; 2]>,
}

/// What [`Packed::prepare`] leaves for the passes behind it.
pub struct Inputs {
    pub frame: Buffer,
    pub color: TextureView,
    pub surface: TextureView,
}

impl Packed {
    /// For outputs of `format`.
    pub fn new(device: &Device, format: TextureFormat) -> Self {
        Self {
            pass: Pass::over(
                Over::Marking,
                device,
                "rivals packed",
                (&[SCREEN, include_str!("packed.wgsl")].concat(), "fs_pack"),
                &[Slot::Uniform, Slot::Float, Slot::Float, Slot::Uint],
                &[COLOR.into(), SURFACE.into()],
                &[],
            ),
            rest: Pass::over(
                Over::Rest,
                device,
                "rivals rest",
                (&[TRIANGLE, include_str!("copy.wgsl")].concat(), "fs_copy"),
                &[Slot::Float],
                &[format.into()],
                &[],
            ),
            scratch: None,
            prepared: None,
        }
    }

    pub fn prepare(&mut self, device: &Device, frame: &Frame) -> Result<Inputs, Error> {
        let (Some(profile_id), None, None) = (frame.profile_id, frame.strength, frame.viewport) else {
            return Err(Error::new(
                "frame",
                "no profile_id, or a strength or viewport",
                "ids alone: rivals know no more",
            ));
        };
        let uniform = uniform_buffer(device, frame, profile_id)?;
        let views = scratch(
            device,
            "rivals packed",
            self.scratch.take(),
            size(frame.irradiance),
            [COLOR, SURFACE, STENCIL],
        );
        let texture = wgpu::BindingResource::TextureView;
        self.prepared = Some([
            self.pass.bind(
                device,
                &[
                    uniform.as_entire_binding(),
                    texture(frame.irradiance),
                    texture(frame.depth),
                    texture(profile_id),
                ],
            ),
            self.rest.bind(device, &[texture(frame.irradiance)]),
        ]);
        let [color, surface, _] = self.scratch.insert(views).clone();
        Ok(Inputs { frame: uniform, color, surface })
    }

    pub fn render(&self, encoder: &mut CommandEncoder) {
        if let (Some([pack, _]), Some([color, surface, stencil])) = (&self.prepared, &self.scratch) {
            let targets = [(color, CLEAR), (surface, CLEAR)];
            let draws = [(&self.pass, pack)];
            pass::draw(encoder, &draws, &targets, Some(stencil), Color::BLACK);
        }
    }

    /// A pass over skin, to targets each cleared or kept, with the constant that blending uses.
    pub fn draw(
        &self,
        encoder: &mut CommandEncoder,
        pass: (&Pass, &BindGroup),
        targets: &[(&TextureView, LoadOp<Color>)],
        blend_constant: Color,
    ) {
        let stencil = self.scratch.as_ref().map(|[.., stencil]| stencil);
        pass::draw(encoder, &[pass], targets, stencil, blend_constant);
    }

    /// A method's last pass over skin, and the light as it was elsewhere.
    pub fn finish(&self, encoder: &mut CommandEncoder, pass: (&Pass, &BindGroup), output: &TextureView) {
        if let (Some([_, rest]), Some([.., stencil])) = (&self.prepared, &self.scratch) {
            let draws = [pass, (&self.rest, rest)];
            pass::draw(encoder, &draws, &[(output, CLEAR)], Some(stencil), Color::BLACK);
        }
    }
}

/// `frame` of the shaders.
pub fn uniform_buffer(
    device: &Device,
    frame: &Frame,
    profile_id: &wgpu::TextureView,
) -> Result<Buffer, Error> {
    Ok(device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("rivals frame"),
        contents: bytemuck::bytes_of(&uniform(frame, profile_id)?),
        usage: wgpu::BufferUsages::UNIFORM,
    }))
}

/// With clip z and w linear in view z, depth d = (P₂₂z + P₂₃)/(P₃₂z + P₃₃)
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
        return Err(Error::new("mm_per_unit", mm.to_string(), "a finite number above 0"));
    }
    let x = 2.0 / (size[0] as f32 * p.x_axis.x);
    let y = 2.0 / (size[1] as f32 * p.y_axis.y);
    Ok([Vec4::new(z.w * mm, w.w * mm, w.z, z.z), Vec4::new(x * w.w * mm, x * w.z, y * w.w * mm, y * w.z)])
}
