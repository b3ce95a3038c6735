//! No scattering: one read and one write a pixel, the unit that the chart measures time in. Driver
//! of `copy.wgsl`.

use crate::Error;
use subsurface::Frame;
use subsurface::wgpu::{
    BindGroup, BindingResource, CommandEncoder, Device, Queue, TextureFormat, TextureView,
};

use super::pass::{Pass, Slot, TRIANGLE};
use crate::method::ScreenMethod;

pub struct Copy {
    pass: Pass,
    prepared: Option<BindGroup>,
}

impl Copy {
    pub fn new(device: &Device, format: TextureFormat) -> Self {
        Self {
            pass: Pass::new(
                device,
                "rivals copy",
                (&[TRIANGLE, include_str!("copy.wgsl")].concat(), "fs_copy"),
                &[Slot::Float],
                &[format.into()],
                &[],
            ),
            prepared: None,
        }
    }
}

impl ScreenMethod for Copy {
    fn prepare(&mut self, device: &Device, _: &Queue, frame: &Frame) -> Result<(), Error> {
        let irradiance = BindingResource::TextureView(frame.irradiance);
        let group = self.pass.bind(device, &[irradiance]);
        self.prepared = Some(group);
        Ok(())
    }

    fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error> {
        if let Some(group) = &self.prepared {
            self.pass.draw(encoder, group, &[output]);
        }
        Ok(())
    }

    fn fetches(&self, _px_per_mm: f64) -> Option<f64> {
        Some(1.0)
    }

    fn scratch_bytes_per_pixel(&self) -> f64 {
        0.0
    }
}
