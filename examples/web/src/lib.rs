//! The page: what the browser's script calls. The script has the controls and the canvas; here are the
//! scene, the effects and the measurements.

mod bench;
mod stage;
mod wait;

use std::cell::RefCell;
use std::rc::Rc;

use subsurface::{Gaussian, Plan, Profile};
use subsurface_lab::renderer::{Gpu, Lighting, Scene};
use wasm_bindgen::JsError;
use wasm_bindgen::prelude::wasm_bindgen;
use web_sys::HtmlCanvasElement;
use wgpu::{CurrentSurfaceTexture, Instance, InstanceDescriptor, Surface, SurfaceTarget, TextureFormat};

use bench::Bench;
use stage::{Look, Model, Stage};

/// How light is scattered.
#[wasm_bindgen]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// As it fell.
    None = 0,
    /// Over an atlas.
    Texture = 1,
    /// On the screen, by a plan.
    Screen = 2,
    /// On the screen, by the exact sum.
    Exact = 3,
}

/// What is shown of it.
#[wasm_bindgen]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Show {
    /// The finished picture.
    Picture = 0,
    /// Its diffuse light alone, without albedo.
    Diffuse = 1,
    /// Over the picture, the pixels that a mm spans.
    PxPerMm = 2,
    /// Over the picture, the coarsest level of the plan's pyramid.
    Level = 3,
    /// Over the picture, how the plan blurs each tile.
    Class = 4,
}

/// A device, a canvas, and the scene that is drawn onto it.
#[wasm_bindgen]
pub struct Page {
    gpu: Rc<Gpu>,
    surface: Surface<'static>,
    stage: RefCell<Stage>,
}

#[wasm_bindgen]
impl Page {
    /// A page that draws the built-in head onto a canvas, by a plan for skin.
    ///
    /// # Errors
    /// No device; a canvas without pixels, or with more than the device has.
    pub async fn open(canvas: HtmlCanvasElement) -> Result<Page, JsError> {
        console_error_panic_hook::set_once();
        let size = [canvas.width(), canvas.height()];
        let instance = Instance::new(InstanceDescriptor::new_without_display_handle());
        let surface = instance.create_surface(SurfaceTarget::Canvas(canvas))?;
        let gpu = Rc::new(Gpu::of(&instance, wgpu::Features::TIMESTAMP_QUERY).await?);
        let model = Model { scene: Scene::from_glb(subsurface_lab::HEAD)?, mm_per_unit: 1000.0 };
        let stage = Stage::new(Rc::clone(&gpu), model, size)?;
        let page = Self { gpu, surface, stage: RefCell::new(stage) };
        page.configure(size);
        Ok(page)
    }

    /// Of the canvas, which has been given another size.
    ///
    /// # Errors
    /// A size of 0 or beyond the device's limits.
    pub fn resize(&self, width: u32, height: u32) -> Result<(), JsError> {
        self.stage.borrow_mut().resize([width, height])?;
        self.configure([width, height]);
        Ok(())
    }

    fn configure(&self, [width, height]: [u32; 2]) {
        self.surface.configure(
            &self.gpu.device,
            &wgpu::SurfaceConfiguration {
                // Pictures are copied into it.
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_DST,
                format: TextureFormat::Rgba8Unorm,
                color_space: wgpu::SurfaceColorSpace::Auto,
                width,
                height,
                present_mode: wgpu::PresentMode::Fifo,
                desired_maximum_frame_latency: 2,
                alpha_mode: wgpu::CompositeAlphaMode::Opaque,
                view_formats: Vec::new(),
            },
        );
    }

    /// Another model, seen from the front: a .glb file. Returns what was taken for skin and what was not.
    ///
    /// # Errors
    /// A file that cannot be read, or drawn.
    pub fn load(&self, glb: &[u8], mm_per_unit: f32) -> Result<String, JsError> {
        let scene = Scene::from_glb(glb)?;
        let notes = scene.notes().join(" ");
        self.stage.borrow_mut().set_model(Model { scene, mm_per_unit })?;
        Ok(notes)
    }

    /// Another profile: of each Gaussian its variance in mm² and its red, green and blue weights; the
    /// profile is then scaled in width. And the largest error of the plan, of white.
    ///
    /// # Errors
    /// No profile; an error that no plan keeps.
    pub fn plan(&self, gaussians: &[f32], scale: f32, max_error: f32) -> Result<(), JsError> {
        let (gaussians, _) = gaussians.as_chunks::<4>();
        let gaussians = gaussians.iter().map(|[variance_mm2, red, green, blue]| Gaussian {
            variance_mm2: variance_mm2 * scale * scale,
            weight: [*red, *green, *blue],
        });
        let profile = Profile::new(&Vec::from_iter(gaussians))?;
        // Those of skin need not be fitted.
        let known = [Plan::skin(), Plan::skin_fast()];
        let known = known.into_iter().find(|p| p.profiles() == [profile] && p.max_error() == max_error);
        let plan = known.map_or_else(|| Plan::new(&[profile], max_error), Ok)?;
        self.stage.borrow_mut().set_plan(plan);
        Ok(())
    }

    /// The profile of skin, as [`plan`](Self::plan) takes it.
    pub fn skin() -> Vec<f32> {
        let gaussians = Profile::SKIN.gaussians().iter();
        gaussians.flat_map(|g| [g.variance_mm2, g.weight[0], g.weight[1], g.weight[2]]).collect()
    }

    /// Draws both sides of a divider, `at` from 0, the left border, to 1.
    ///
    /// # Errors
    /// A mode that the model cannot have.
    pub fn draw(&self, left: Mode, right: Mode, at: f32, show: Show) -> Result<(), JsError> {
        let mut stage = self.stage.borrow_mut();
        let picture = stage.draw(&Look { sides: [left, right], divider: at, show })?;
        let (CurrentSurfaceTexture::Success(canvas) | CurrentSurfaceTexture::Suboptimal(canvas)) =
            self.surface.get_current_texture()
        else {
            return Ok(()); // the canvas is not seen
        };
        self.gpu.run(|encoder| {
            encoder.copy_texture_to_texture(
                picture.texture().as_image_copy(),
                canvas.texture.as_image_copy(),
                picture.texture().size(),
            );
        });
        self.gpu.queue.present(canvas);
        Ok(())
    }

    /// Until the device has done all that it was asked for.
    ///
    /// # Errors
    /// A device that is lost.
    pub async fn done(&self) -> Result<(), JsError> {
        wait::done(&self.gpu.queue).await
    }

    /// What was last drawn, as sRGB bytes: red, green, blue and alpha.
    ///
    /// # Errors
    /// A device that is lost.
    pub async fn picture(&self) -> Result<Vec<u8>, JsError> {
        let copied = self.gpu.copy_out(self.stage.borrow().picture().texture());
        wait::bytes(copied).await
    }

    /// The scene follows a drag by a share of the canvas's height, to the right and down.
    pub fn turn(&self, right: f32, down: f32) {
        self.stage.borrow_mut().move_camera(|orbit| orbit.turn(right, down));
    }

    /// The scene follows a drag across the canvas, by a share of its height.
    pub fn shift(&self, right: f32, down: f32) {
        self.stage.borrow_mut().move_camera(|orbit| orbit.shift(right, down));
    }

    /// Nearer by notches of a wheel, or farther.
    pub fn zoom(&self, notches: f32) {
        self.stage.borrow_mut().move_camera(|orbit| orbit.zoom(notches));
    }

    /// The key light follows a drag.
    pub fn turn_light(&self, right: f32, down: f32) {
        self.stage.borrow_mut().turn_light(right, down);
    }

    /// Half the angle under which the key light is seen, in degrees, 0 to 10.
    pub fn set_light_radius(&self, degrees: f32) {
        self.stage.borrow_mut().set_light_radius(degrees);
    }

    /// Camera and light as at first.
    pub fn reset(&self) {
        self.stage.borrow_mut().reset();
    }

    /// Texels of the atlas, each way.
    pub fn set_atlas_size(&self, texels: u32) {
        self.stage.borrow_mut().set_atlas_size(texels);
    }

    /// The modes, to be measured in what is shown.
    ///
    /// # Errors
    /// As [`draw`](Self::draw).
    pub async fn measure(&self) -> Result<Bench, JsError> {
        let (shot, plan) = self.stage.borrow().shot()?;
        Bench::of_modes(Rc::clone(&self.gpu), shot, &plan).await
    }

    /// All methods, to be measured on the built-in head from the front, at a size in pixels.
    ///
    /// # Errors
    /// A size that the device cannot draw.
    pub async fn chart(&self, width: u32, height: u32) -> Result<Bench, JsError> {
        let scene = Scene::from_glb(subsurface_lab::HEAD)?;
        let model = Model { scene, mm_per_unit: 1000.0 };
        let mut shot = model.shot(&self.gpu, [width, height], None, &Lighting::default())?;
        shot.atlas_size = self.stage.borrow().atlas_size();
        Bench::of_all(Rc::clone(&self.gpu), shot).await
    }
}
