//! The scene on the device: draws it, scatters its light, and keeps what has not changed.

use std::rc::Rc;

use subsurface::wgpu::TextureView;
use subsurface::{Overlay, Plan};
use subsurface_lab::Error;
use subsurface_lab::method::{self, Ours, OursUnrolled};
use subsurface_lab::renderer::{
    AtlasRenderer, Camera, Gpu, Layer, Lighting, Orbit, Renderer, Scene, View, turn_light,
};

use crate::{Mode, Show};

/// Side of the atlas in texels, at first.
const ATLAS: u32 = 1024;

/// What is drawn.
pub struct Model {
    pub scene: Scene,
    pub mm_per_unit: f32,
}

/// What is asked for.
pub struct Look {
    /// Left and right of the divider.
    pub sides: [Mode; 2],
    /// Where it is, from 0 to 1.
    pub divider: f32,
    pub show: Show,
}

/// A model, drawn and lit.
pub struct Shot {
    pub renderer: Renderer,
    pub camera: Camera,
    pub size: [u32; 2],
    pub mm_per_unit: f32,
    /// Side of its atlas in texels.
    pub atlas_size: u32,
}

impl Model {
    /// Drawn at a size by a camera, or from the front.
    ///
    /// # Errors
    /// A size that the device cannot draw; lights that cannot be used.
    pub fn shot(
        &self,
        gpu: &Gpu,
        size: [u32; 2],
        camera: Option<Camera>,
        lighting: &Lighting,
    ) -> Result<Shot, Error> {
        let renderer = Renderer::new(gpu, &self.scene, size)?;
        let camera = camera.unwrap_or_else(|| Camera::framing(&self.scene, View::Front, size));
        renderer.render(gpu, &camera, lighting, self.mm_per_unit)?;
        Ok(Shot { renderer, camera, size, mm_per_unit: self.mm_per_unit, atlas_size: ATLAS })
    }
}

impl Shot {
    /// As methods take it.
    pub fn frame(&self) -> subsurface::Frame<'_> {
        self.renderer.gbuffer.frame(self.camera.projection(self.size), self.mm_per_unit)
    }
}

/// A scene, its effects, and how it is seen.
pub struct Stage {
    gpu: Rc<Gpu>,
    model: Model,
    orbit: Orbit,
    lighting: Lighting,
    /// Whether camera or light moved since it was drawn.
    is_stale: bool,
    shot: Shot,
    plan: Plan,
    effects: Effects,
    /// By mode; none where it is to be done.
    scattered: [Option<TextureView>; 4],
    picture: TextureView,
}

/// Made when they are first asked for, as a driver may compile for seconds.
#[derive(Default)]
struct Effects {
    screen: Option<Ours>,
    exact: Option<Ours>,
    texture: Option<OursUnrolled>,
    atlas: Option<AtlasRenderer>,
    overlay: Option<Overlay>,
}

impl Stage {
    /// # Errors
    /// A size of 0 or beyond the device's limits; a model that cannot be drawn.
    pub fn new(gpu: Rc<Gpu>, model: Model, size: [u32; 2]) -> Result<Self, Error> {
        let lighting = Lighting::default();
        let shot = model.shot(&gpu, size, None, &lighting)?;
        Ok(Self {
            orbit: shot.camera.into(),
            picture: shot.renderer.picture_target(&gpu),
            gpu,
            model,
            lighting,
            is_stale: false,
            shot,
            plan: Plan::skin(),
            effects: Effects::default(),
            scattered: Default::default(),
        })
    }

    pub fn resize(&mut self, size: [u32; 2]) -> Result<(), Error> {
        let camera = self.orbit.camera();
        let shot = self.model.shot(&self.gpu, size, Some(camera), &self.lighting)?;
        self.take(Shot { atlas_size: self.shot.atlas_size, ..shot });
        Ok(())
    }

    pub fn set_model(&mut self, model: Model) -> Result<(), Error> {
        let shot = model.shot(&self.gpu, self.shot.size, None, &self.lighting)?;
        self.orbit = shot.camera.into();
        self.model = model;
        self.take(Shot { atlas_size: self.shot.atlas_size, ..shot });
        Ok(())
    }

    fn take(&mut self, shot: Shot) {
        self.picture = shot.renderer.picture_target(&self.gpu);
        self.shot = shot;
        self.is_stale = false;
        self.scattered = Default::default();
        self.effects.atlas = None;
    }

    pub fn set_plan(&mut self, plan: Plan) {
        let has_same_profile = self.plan.profiles() == plan.profiles();
        self.plan = plan;
        self.scattered[Mode::Screen as usize] = None;
        self.effects.screen = None;
        if !has_same_profile {
            self.scattered = Default::default();
            self.effects.exact = None;
            self.effects.texture = None;
        }
    }

    pub fn atlas_size(&self) -> u32 {
        self.shot.atlas_size
    }

    pub fn set_atlas_size(&mut self, texels: u32) {
        self.shot.atlas_size = texels;
        self.effects.atlas = None;
        self.scattered[Mode::Texture as usize] = None;
    }

    pub fn move_camera(&mut self, by: impl FnOnce(&mut Orbit)) {
        by(&mut self.orbit);
        self.is_stale = true;
    }

    pub fn turn_light(&mut self, right: f32, down: f32) {
        if let Some(key) = self.lighting.lights.first_mut() {
            key.direction = turn_light(key.direction, right, down);
        }
        self.is_stale = true;
    }

    pub fn set_light_radius(&mut self, degrees: f32) {
        if let Some(key) = self.lighting.lights.first_mut() {
            key.radius_degrees = degrees;
        }
        self.is_stale = true;
    }

    pub fn reset(&mut self) {
        self.lighting = Lighting::default();
        self.orbit = Camera::framing(&self.model.scene, View::Front, self.shot.size).into();
        self.is_stale = true;
    }

    /// What was last drawn: Rgba8UnormSrgb.
    pub fn picture(&self) -> &TextureView {
        &self.picture
    }

    /// What is seen, drawn once more for somebody else, and the plan that it is scattered by.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn shot(&self) -> Result<(Shot, Plan), Error> {
        let camera = Some(self.orbit.camera());
        let shot = self.model.shot(&self.gpu, self.shot.size, camera, &self.lighting)?;
        Ok((Shot { atlas_size: self.shot.atlas_size, ..shot }, self.plan.clone()))
    }

    /// # Errors
    /// A mode that the model cannot have.
    pub fn draw(&mut self, look: &Look) -> Result<&TextureView, Error> {
        if self.is_stale {
            self.shot.camera = self.orbit.camera();
            let Shot { renderer, camera, mm_per_unit, .. } = &self.shot;
            renderer.render(&self.gpu, camera, &self.lighting, *mm_per_unit)?;
            self.scattered = Default::default();
            self.is_stale = false;
        }
        let width = self.shot.size[0];
        let at = ((look.divider.clamp(0.0, 1.0) * width as f32).round() as u32).min(width);
        let layer = if look.show == Show::Diffuse { Layer::Diffuse } else { Layer::Picture };
        for (mode, columns) in look.sides.into_iter().zip([0..at, at..width]) {
            if !columns.is_empty() {
                let diffuse = self.scattered(mode)?;
                self.shot.renderer.draw_picture(&self.gpu, &diffuse, layer, 1.0, columns, &self.picture);
            }
        }
        let over = match look.show {
            Show::Picture | Show::Diffuse => None,
            Show::PxPerMm => Some(subsurface::Show::PxPerMm),
            Show::Level => Some(subsurface::Show::Level),
            Show::Class => Some(subsurface::Show::Class),
        };
        if let Some(over) = over {
            self.draw_over(over)?;
        }
        Ok(&self.picture)
    }

    /// What the plan sees, over the picture.
    fn draw_over(&mut self, show: subsurface::Show) -> Result<(), Error> {
        self.scattered(Mode::Screen)?;
        let device = &self.gpu.device;
        let format = self.picture.texture().format();
        let overlay = made(&mut self.effects.overlay, || Ok(Overlay::new(device, format)?))?;
        let Some(ours) = &self.effects.screen else { return Ok(()) };
        Ok(self.gpu.run(|encoder| overlay.render(device, encoder, &ours.view, show, &self.picture))?)
    }

    /// Light by a mode; what is there is not done again.
    fn scattered(&mut self, mode: Mode) -> Result<TextureView, Error> {
        if let Some(there) = &self.scattered[mode as usize] {
            return Ok(there.clone());
        }
        let Self { gpu, shot, plan, effects, .. } = self;
        if mode == Mode::None {
            return Ok(shot.renderer.gbuffer.irradiance.clone());
        }
        let output = shot.renderer.scattered_target(gpu);
        let format = output.texture().format();
        let profiles = plan.profiles();
        match mode {
            Mode::None => {}
            Mode::Screen => {
                let ours = made(&mut effects.screen, || Ours::new(&gpu.device, format, plan))?;
                method::scatter(gpu, ours, &shot.frame(), &output)?;
            }
            Mode::Exact => {
                let exact = || Ours::new(&gpu.device, format, &Plan::exact(profiles)?);
                let ours = made(&mut effects.exact, exact)?;
                method::scatter(gpu, ours, &shot.frame(), &output)?;
            }
            Mode::Texture => {
                let effect = || OursUnrolled::new(&gpu.device, format, profiles);
                let effect = made(&mut effects.texture, effect)?;
                let atlas = || AtlasRenderer::new(gpu, &shot.renderer, shot.atlas_size);
                let atlas = made(&mut effects.atlas, atlas)?;
                atlas.render(
                    gpu,
                    &shot.renderer,
                    profiles.len(),
                    shot.mm_per_unit,
                    &output,
                    |atlas, to| method::scatter_atlas(gpu, effect, atlas, to),
                )?;
            }
        }
        self.scattered[mode as usize] = Some(output.clone());
        Ok(output)
    }
}

/// What is there, or is made now.
fn made<T>(place: &mut Option<T>, make: impl FnOnce() -> Result<T, Error>) -> Result<&mut T, Error> {
    let thing = match place.take() {
        Some(thing) => thing,
        None => make()?,
    };
    Ok(place.insert(thing))
}
