//! What a host hands over, as a case may change it: a frame, and an atlas whose texels are the pixels of
//! that frame, so that methods of both spaces know the same.

use glam::{DVec3, Mat4, Vec3};
use half::f16;
use subsurface::wgpu::{TextureFormat, TextureView};
use subsurface::{Atlas, BackLayer, Frame};

use crate::renderer::Gpu;
use crate::stability::lab::OUTPUT;
use crate::synthetic::GBuffer;

/// Pixels in memory, in mm.
#[derive(Clone)]
pub struct Texels {
    pub size: [u32; 2],
    /// Linear, in half floats on the device.
    pub irradiance: Vec<[f32; 4]>,
    pub depth: Vec<f32>,
    pub profile_id: Vec<u8>,
    /// And 1 in the last component; all 0 where there is no skin.
    pub positions_mm: Vec<[f32; 4]>,
    /// Irradiance and depth of the layer behind.
    pub back: Option<(Vec<[f32; 4]>, Vec<f32>)>,
    pub projection: Mat4,
    /// The unit in which they are handed over.
    pub mm_per_unit: f32,
}

/// The same on a device.
pub struct Uploaded {
    irradiance: TextureView,
    depth: TextureView,
    profile_id: TextureView,
    positions: TextureView,
    back: Option<[TextureView; 2]>,
    pub output: TextureView,
    projection: Mat4,
    mm_per_unit: f32,
}

impl Texels {
    /// Of skin; `background` is the light where nothing is hit.
    pub fn of(g: &GBuffer, background: f64) -> Self {
        let position = |point: DVec3| point.as_vec3().extend(1.0).to_array();
        let hits = || g.hits.iter().copied();
        let (irradiance, depth) = light_and_depth(g, background);
        Self {
            size: g.view.size,
            irradiance,
            depth,
            profile_id: hits().map(|h| h.map_or(0, |h| h.id as u8)).collect(),
            positions_mm: hits().map(|h| h.map_or([0.0; 4], |h| position(h.point))).collect(),
            back: None,
            projection: g.view.projection.as_mat4(),
            mm_per_unit: 1.0,
        }
    }

    /// With a layer behind it.
    pub fn before(self, back: &GBuffer) -> Self {
        Self { back: Some(light_and_depth(back, 0.0)), ..self }
    }

    /// Lights a pixel, in grey.
    pub fn light(&mut self, pixel: usize, light: f32) {
        self.irradiance[pixel] = [light, light, light, 1.0];
    }

    /// Leaves a pixel without skin.
    pub fn clear(&mut self, pixel: usize) {
        self.profile_id[pixel] = 0;
        self.positions_mm[pixel] = [0.0; 4];
    }

    /// Pixels of skin.
    pub fn skin(&self) -> Vec<usize> {
        let ids = self.profile_id.iter().enumerate();
        ids.filter(|(_, id)| **id != 0).map(|(i, _)| i).collect()
    }

    /// With an output of its own.
    pub fn upload(&self, gpu: &Gpu) -> Uploaded {
        let (size, unit) = (self.size, self.mm_per_unit);
        let positions = self.positions_mm.iter();
        let positions: Vec<_> =
            positions.map(|[x, y, z, id]| [x / unit, y / unit, z / unit, *id]).collect();
        let half = |c| f16::from_f32(c).to_bits();
        let light = |name: &str, texels: &[[f32; 4]]| {
            let halves: Vec<_> = texels.iter().map(|e| e.map(half)).collect();
            gpu.upload(name, size, TextureFormat::Rgba16Float, &halves)
        };
        let depth = |name: &str, texels: &[f32]| gpu.upload(name, size, TextureFormat::R32Float, texels);
        let full = TextureFormat::Rgba32Float;
        Uploaded {
            irradiance: light("irradiance", &self.irradiance),
            depth: depth("depth", &self.depth),
            back: self.back.as_ref().map(|(e, z)| [light("back irradiance", e), depth("back depth", z)]),
            profile_id: gpu.upload("profile id", size, TextureFormat::R8Uint, &self.profile_id),
            positions: gpu.upload("positions", size, full, &positions),
            output: gpu.target("scattered", size, OUTPUT),
            projection: self.projection * Mat4::from_scale(Vec3::splat(unit)),
            mm_per_unit: unit,
        }
    }
}

impl Uploaded {
    pub fn frame(&self) -> Frame<'_> {
        let projection = self.projection.to_cols_array_2d();
        let mut frame = Frame::new(&self.irradiance, &self.depth, projection);
        frame.profile_id = Some(&self.profile_id);
        frame.mm_per_unit = self.mm_per_unit;
        let back = self.back.as_ref();
        frame.back = back.map(|[irradiance, depth]| BackLayer::new(irradiance, depth));
        frame
    }

    pub fn atlas(&self) -> Atlas<'_> {
        let mut atlas = Atlas::new(&self.irradiance, &self.positions);
        atlas.mm_per_unit = self.mm_per_unit;
        atlas
    }
}

/// Of each pixel; `background` where nothing is hit, at the depth of the far plane.
fn light_and_depth(g: &GBuffer, background: f64) -> (Vec<[f32; 4]>, Vec<f32>) {
    let background = DVec3::splat(background);
    let light = |e: DVec3| e.as_vec3().extend(1.0).to_array();
    let depth = |point: DVec3| {
        let clip = g.view.projection * point.extend(1.0);
        (clip.z / clip.w) as f32
    };
    let hits = || g.hits.iter();
    (
        hits().map(|h| light(h.map_or(background, |h| h.irradiance))).collect(),
        hits().map(|h| h.map_or(0.0, |h| depth(h.point))).collect(),
    )
}
