//! One surface for methods of both spaces: a frame, and an atlas whose texels are the pixels of that
//! frame, so that all know the same.

use crate::Error;
use glam::{DVec3, Mat4, Vec3};
use subsurface::wgpu::{CommandEncoder, TextureFormat, TextureView};
use subsurface::{Atlas, Frame, Plan, Profile, TextureSpace};

use super::Results;
use crate::method::{AtlasMethod, Ours, ScreenMethod};
use crate::renderer::Gpu;
use crate::stability::frame::{HostFrame, Texels};
use crate::stability::lab::{self, Lab, OUTPUT};
use crate::synthetic::GBuffer;

/// What a case may change before it is uploaded.
#[derive(Clone)]
pub struct Surface {
    pub texels: Texels,
    /// And 1 in the last component; all 0 where there is no skin.
    pub positions_mm: Vec<[f32; 4]>,
    pub profile: Profile,
    pub mm_per_unit: f32,
}

/// The same on a device.
pub struct Uploaded {
    frame: HostFrame,
    positions: TextureView,
    mm_per_unit: f32,
}

impl Surface {
    /// Of skin, in mm; `background` is the light where nothing is hit.
    pub fn of(g: &GBuffer, background: DVec3) -> Self {
        let positions = g
            .hits
            .iter()
            .map(|hit| hit.map_or([0.0; 4], |h| h.point.as_vec3().extend(1.0).to_array()));
        Self {
            texels: Texels::of(g, background),
            positions_mm: positions.collect(),
            profile: Profile::SKIN,
            mm_per_unit: 1.0,
        }
    }

    /// Lights a pixel, in gray.
    pub fn light(&mut self, pixel: usize, light: f32) {
        self.texels.irradiance[pixel] = [light, light, light, 1.0];
    }

    /// Leaves a pixel without skin.
    pub fn clear(&mut self, pixel: usize) {
        self.texels.profile_id[pixel] = 0;
        self.positions_mm[pixel] = [0.0; 4];
    }

    /// Pixels of skin.
    pub fn skin(&self) -> Vec<usize> {
        let ids = self.texels.profile_id.iter().enumerate();
        ids.filter(|(_, id)| **id != 0).map(|(i, _)| i).collect()
    }

    pub fn upload(&self, gpu: &Gpu) -> Uploaded {
        let unit = self.mm_per_unit;
        let texels = Texels {
            projection: self.texels.projection * Mat4::from_scale(Vec3::splat(unit)),
            ..self.texels.clone()
        };
        let positions = self.positions_mm.iter();
        let positions: Vec<_> = positions
            .map(|[x, y, z, id]| [x / unit, y / unit, z / unit, *id])
            .collect();
        let full = TextureFormat::Rgba32Float;
        Uploaded {
            frame: texels.upload(gpu),
            positions: gpu.upload("positions", texels.size, full, &positions),
            mm_per_unit: unit,
        }
    }
}

impl Uploaded {
    pub fn frame(&self) -> Frame<'_> {
        let mut frame = self.frame.inputs();
        frame.mm_per_unit = self.mm_per_unit;
        frame
    }

    pub fn output(&self) -> &TextureView {
        &self.frame.output
    }

    pub fn atlas(&self) -> Atlas<'_> {
        let frame = self.frame();
        Atlas {
            irradiance: frame.irradiance,
            positions: &self.positions,
            mm_per_unit: frame.mm_per_unit,
        }
    }

    /// What the lab's methods make of skin.
    ///
    /// # Errors
    /// A surface that a method refuses.
    pub fn scatter(&self, lab: &Lab) -> Result<Results, Error> {
        let mut results = lab.scatter(&self.frame(), self.output())?;
        results.extend(lab.scatter_atlas(&self.atlas(), self.output())?);
        Ok(results)
    }

    /// What a method makes of it, alpha included.
    ///
    /// # Errors
    /// A surface that it refuses.
    pub fn by(&self, gpu: &Gpu, method: &mut Method) -> Result<Vec<[f32; 4]>, Error> {
        method.prepare(gpu, self)?;
        gpu.run(|encoder| method.render(encoder, self.output()))?;
        Ok(self.read(gpu))
    }

    /// What was written last.
    pub fn read(&self, gpu: &Gpu) -> Vec<[f32; 4]> {
        gpu.read(self.output())
    }
}

/// A method of either space.
pub enum Method {
    Screen(Box<dyn ScreenMethod>),
    Texture(Box<dyn AtlasMethod>),
}

impl Method {
    /// # Errors
    /// A surface that it refuses.
    pub fn prepare(&mut self, gpu: &Gpu, surface: &Uploaded) -> Result<(), Error> {
        let (device, queue) = (&gpu.device, &gpu.queue);
        match self {
            Self::Screen(method) => method.prepare(device, queue, &surface.frame()),
            Self::Texture(method) => method.prepare(device, queue, &surface.atlas()),
        }
    }

    /// # Errors
    /// An output that it refuses.
    pub fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error> {
        match self {
            Self::Screen(method) => method.render(encoder, output),
            Self::Texture(method) => method.render(encoder, output),
        }
    }
}

pub type Methods = Vec<(&'static str, Method)>;

/// This crate's alone, new.
///
/// # Errors
/// A device that one of them refuses.
pub fn ours(gpu: &Gpu, plan: &Plan) -> Result<Methods, Error> {
    let device = &gpu.device;
    let exact = Plan::exact(plan.profiles())?;
    let exact = Box::new(Ours::new(device, OUTPUT, &exact)?);
    let planned = Box::new(Ours::new(device, OUTPUT, plan)?);
    let texture = Box::new(TextureSpace::new(device, OUTPUT, plan.profiles())?);
    Ok(vec![
        ("screen_exact", Method::Screen(exact)),
        ("screen_planned", Method::Screen(planned)),
        ("texture_separable", Method::Texture(texture)),
    ])
}

/// Every method of both spaces, new.
///
/// # Errors
/// A device that a method refuses.
pub fn methods(gpu: &Gpu, profile: &Profile, plan: &Plan) -> Result<Methods, Error> {
    let screen = lab::screen_methods(gpu, profile, plan)?.into_iter();
    let texture = lab::texture_methods(gpu, profile)?.into_iter();
    let screen = screen.map(|(name, method)| (name, Method::Screen(method)));
    let texture = texture.map(|(name, method)| (name, Method::Texture(method)));
    Ok(screen.chain(texture).collect())
}
