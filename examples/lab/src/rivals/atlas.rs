//! What the atlas rivals share: the texels' points, and the gutter around the islands. Driver of
//! `atlas.wgsl` and `gutter.wgsl`.

use crate::Error;
use glam::Vec4;
use subsurface::Atlas;
use subsurface::wgpu::util::DeviceExt;
use subsurface::wgpu::{
    self, BindGroup, BindingResource, Buffer, CommandEncoder, Device, TextureFormat, TextureView,
};

use super::pass::{Pass, Slot, TRIANGLE, size};

/// The shader text that readies an atlas goes behind this.
pub const ATLAS: &str = concat!(include_str!("triangle.wgsl"), include_str!("atlas.wgsl"));

/// The uniform of `atlas.wgsl`.
pub fn uniform(device: &Device, atlas: &Atlas) -> Result<Buffer, Error> {
    let [width, height] = size(atlas.irradiance);
    let got = size(atlas.positions);
    if got != [width, height] {
        return Err(Error::new(
            "positions: size",
            format!("{}x{}", got[0], got[1]),
            format!("{width}x{height} as the irradiance has"),
        ));
    }
    if !atlas.mm_per_unit.is_finite() || atlas.mm_per_unit <= 0.0 {
        return Err(Error::new("mm_per_unit", atlas.mm_per_unit.to_string(), "a finite number above 0"));
    }
    Ok(device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("rivals atlas"),
        contents: bytemuck::bytes_of(&Vec4::splat(atlas.mm_per_unit)),
        usage: wgpu::BufferUsages::UNIFORM,
    }))
}

/// The last pass.
pub struct Gutter {
    pass: Pass,
    prepared: Option<BindGroup>,
}

impl Gutter {
    pub fn new(device: &Device, format: TextureFormat) -> Self {
        Self {
            pass: Pass::new(
                device,
                "rivals gutter",
                (&[TRIANGLE, include_str!("gutter.wgsl")].concat(), "fs_gutter"),
                &[Slot::Float, Slot::Float],
                &[format.into()],
                &[],
            ),
            prepared: None,
        }
    }

    pub fn prepare(&mut self, device: &Device, sum: &TextureView, atlas: &Atlas) {
        let group = self.pass.bind(
            device,
            &[BindingResource::TextureView(sum), BindingResource::TextureView(atlas.irradiance)],
        );
        self.prepared = Some(group);
    }

    pub fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) {
        if let Some(group) = &self.prepared {
            self.pass.draw(encoder, group, &[output]);
        }
    }
}
