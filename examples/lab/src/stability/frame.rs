//! A synthetic frame on the device, as a host would hand it over.

use glam::{DVec3, Mat3, Mat4};
use half::f16;
use subsurface::wgpu::{TextureFormat, TextureView};
use subsurface::{Normals, Profile, ScreenFrame};

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
pub struct Frame {
    irradiance: TextureView,
    depth: TextureView,
    profile_id: TextureView,
    normal: Option<TextureView>,
    output: TextureView,
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

    pub fn upload(&self, gpu: &Gpu) -> Frame {
        let size = self.size;
        Frame {
            irradiance: halves(gpu, "irradiance", size, &self.irradiance),
            depth: gpu.upload("depth", size, TextureFormat::R32Float, &self.depth),
            profile_id: gpu.upload("profile id", size, TextureFormat::R8Uint, &self.profile_id),
            normal: None,
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

impl Frame {
    /// With the normals of what it shows.
    pub fn with_normals(mut self, gpu: &Gpu, g: &GBuffer) -> Self {
        let normals = g.hits.iter().map(|hit| {
            let normal = hit.map_or(DVec3::ZERO, |h| h.normal);
            normal.as_vec3().extend(0.0).to_array()
        });
        let normals: Vec<_> = normals.collect();
        self.normal = Some(halves(gpu, "normal", g.view.size, &normals));
        self
    }

    /// In mm, of skin.
    pub fn inputs(&self) -> ScreenFrame<'_> {
        ScreenFrame {
            irradiance: &self.irradiance,
            depth: &self.depth,
            profile_id: Some(&self.profile_id),
            normal: self.normal.as_ref().map(|texture| Normals {
                texture,
                to_view: Mat3::IDENTITY,
            }),
            strength: None,
            viewport: None,
            output: &self.output,
            projection: self.projection,
            mm_per_unit: 1.0,
            profiles: &[Profile::SKIN],
        }
    }
}
