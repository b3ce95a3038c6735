//! A synthetic frame on the device, as a host would hand it over.

use glam::{DVec3, Mat4};
use half::f16;
use subsurface::Frame;
use subsurface::wgpu::{TextureFormat, TextureView};

use crate::renderer::Gpu;
use crate::stability::lab::OUTPUT;
use crate::synthetic::GBuffer;

/// What a frame holds, before it is uploaded: a case may change any of it.
#[derive(Clone)]
pub struct Texels {
    pub size: [u32; 2],
    /// Linear, in half floats on the device.
    pub irradiance: Vec<[f32; 4]>,
    pub depth: Vec<f32>,
    pub profile_id: Vec<u8>,
    pub projection: Mat4,
}

/// The same, uploaded.
pub struct HostFrame {
    irradiance: TextureView,
    depth: TextureView,
    profile_id: TextureView,
    pub output: TextureView,
    projection: Mat4,
}

impl Texels {
    /// `background` is the light where nothing is hit.
    pub fn of(g: &GBuffer, background: DVec3) -> Self {
        let light = |e: DVec3| e.as_vec3().extend(1.0).to_array();
        let depth = |point: DVec3| {
            let clip = g.view.projection * point.extend(1.0);
            (clip.z / clip.w) as f32
        };
        let hits = g.hits.iter();
        Self {
            size: g.view.size,
            irradiance: hits
                .clone()
                .map(|h| light(h.map_or(background, |h| h.irradiance)))
                .collect(),
            depth: hits
                .clone()
                .map(|h| h.map_or(0.0, |h| depth(h.point)))
                .collect(),
            profile_id: hits.map(|h| h.map_or(0, |h| h.id as u8)).collect(),
            projection: g.view.projection.as_mat4(),
        }
    }

    pub fn upload(&self, gpu: &Gpu) -> HostFrame {
        let size = self.size;
        HostFrame {
            irradiance: halves(gpu, "irradiance", size, &self.irradiance),
            depth: gpu.upload("depth", size, TextureFormat::R32Float, &self.depth),
            profile_id: gpu.upload("profile id", size, TextureFormat::R8Uint, &self.profile_id),
            output: gpu.target("scattered", size, OUTPUT),
            projection: self.projection,
        }
    }
}

fn halves(gpu: &Gpu, label: &str, size: [u32; 2], texels: &[[f32; 4]]) -> TextureView {
    let bits = texels.iter().map(|t| t.map(|c| f16::from_f32(c).to_bits()));
    let bits: Vec<[u16; 4]> = bits.collect();
    gpu.upload(label, size, TextureFormat::Rgba16Float, &bits)
}

impl HostFrame {
    /// In mm, of skin.
    pub fn inputs(&self) -> Frame<'_> {
        let projection = self.projection.to_cols_array_2d();
        let mut frame = Frame::new(&self.irradiance, &self.depth, projection);
        frame.profile_id = Some(&self.profile_id);
        frame.mm_per_unit = 1.0;
        frame
    }
}
