//! A synthetic surface in texture space: islands of an atlas, and the way from a pixel to its texel.

use glam::{DVec2, DVec3, UVec2, Vec3};
use half::f16;
use subsurface::wgpu::{TextureFormat, TextureView};
use subsurface::{Atlas, Profile};

use crate::Error;
use crate::renderer::Gpu;
use crate::stability::case::Results;
use crate::stability::lab::{Lab, OUTPUT};
use crate::truth::{self, Patch, Pixel};

/// What a texel shows.
#[derive(Clone, Copy)]
pub struct Texel {
    pub point_mm: DVec3,
    pub irradiance: DVec3,
    /// Of skin, that the texel covers.
    pub area_mm2: f64,
}

/// The atlas of a surface, `size` texels.
pub struct Unwrapped {
    size: [u32; 2],
    irradiance: Vec<[u16; 4]>,
    positions: Vec<[f32; 4]>,
    /// The texels that show skin, for the truth.
    skin: Vec<Pixel>,
}

/// The same on the device.
pub struct Uploaded {
    irradiance: TextureView,
    positions: TextureView,
    pub output: TextureView,
}

impl Unwrapped {
    /// What `texel` finds at the middle of each texel, in UVs from 0 to 1.
    pub fn new(size: [u32; 2], texel: impl Fn(DVec2) -> Option<Texel>) -> Self {
        let (mut irradiance, mut positions) = (Vec::new(), Vec::new());
        let mut skin = Vec::new();
        let scale = UVec2::from(size).as_dvec2();
        for y in 0..size[1] {
            for x in 0..size[0] {
                let uv = (DVec2::new(x.into(), y.into()) + 0.5) / scale;
                let found = texel(uv);
                let light = found.map_or(DVec3::ZERO, |t| t.irradiance).extend(1.0);
                irradiance.push(light.to_array().map(|c| f16::from_f64(c).to_bits()));
                let point = found.map_or(DVec3::ZERO, |t| t.point_mm).as_vec3();
                let id = if found.is_some() { 1.0 } else { 0.0 };
                positions.push(point.extend(id).to_array());
                skin.extend(found.map(|t| pixel(t.point_mm, t.irradiance, t.area_mm2)));
            }
        }
        Self { size, irradiance, positions, skin }
    }

    /// The integral over all of the surface, hidden parts included, at these points of it; each with
    /// its irradiance, as narrow Gaussians have it.
    pub fn truth(&self, points: &[(DVec3, DVec3)]) -> Vec<DVec3> {
        let first = self.skin.len();
        // Points that are asked for have no area, so that nothing is counted twice.
        let points = points.iter().map(|(point, e)| pixel(*point, *e, 0.0));
        let pixels: Vec<Pixel> = self.skin.iter().copied().chain(points).collect();
        let asked: Vec<usize> = (first..pixels.len()).collect();
        let sums = truth::visible_integral(&pixels, &asked, &Profile::SKIN, &|_| ());
        sums.iter().map(|s| s.as_dvec3()).collect()
    }

    /// What every method in texture space gives at these UVs, by bilinear fetches as a host's
    /// final pass makes them.
    ///
    /// # Errors
    /// An atlas that a method refuses.
    pub fn scatter(&self, lab: &Lab, uvs: &[DVec2]) -> Result<Results, Error> {
        let uploaded = self.upload(&lab.gpu);
        let results = lab.scatter_atlas(&uploaded.atlas(), &uploaded.output)?.into_iter();
        let fetched = |texels: Vec<Vec3>| uvs.iter().map(|uv| self.fetch(&texels, *uv)).collect();
        Ok(results.map(|(name, texels)| (name, fetched(texels))).collect())
    }

    /// With an output of its own.
    pub fn upload(&self, gpu: &Gpu) -> Uploaded {
        let size = self.size;
        let half = TextureFormat::Rgba16Float;
        let full = TextureFormat::Rgba32Float;
        Uploaded {
            irradiance: gpu.upload("irradiance", size, half, &self.irradiance),
            positions: gpu.upload("positions", size, full, &self.positions),
            output: gpu.target("scattered", size, OUTPUT),
        }
    }

    fn fetch(&self, texels: &[Vec3], uv: DVec2) -> Vec3 {
        let size = UVec2::from(self.size).as_ivec2();
        let at = uv * size.as_dvec2() - 0.5;
        let first = at.floor();
        let share = (at - first).as_vec2();
        let first = first.as_ivec2();
        let texel = |dx: i32, dy: i32| {
            let x = (first.x + dx).clamp(0, size.x - 1);
            let y = (first.y + dy).clamp(0, size.y - 1);
            texels[(y * size.x + x) as usize]
        };
        let row = |dy| texel(0, dy).lerp(texel(1, dy), share.x);
        row(0).lerp(row(1), share.y)
    }
}

impl Uploaded {
    /// In mm, of skin.
    pub fn atlas(&self) -> Atlas<'_> {
        let mut atlas = Atlas::new(&self.irradiance, &self.positions);
        atlas.mm_per_unit = 1.0;
        atlas
    }
}

fn pixel(point_mm: DVec3, irradiance: DVec3, area_mm2: f64) -> Pixel {
    Pixel {
        patch: Patch {
            point_mm: point_mm.as_vec3(),
            area_mm2: area_mm2 as f32,
            irradiance: irradiance.as_vec3(),
        },
        // The texels' own spacing, in whatever direction: Gaussians narrower than it would come out too narrow.
        steps_mm: [DVec3::X, DVec3::Y].map(|step| (step * area_mm2.sqrt()).as_vec3()),
    }
}
