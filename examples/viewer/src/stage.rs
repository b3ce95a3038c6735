//! The scene on a device of its own and on a thread of its own: draws, scatters, takes the time and
//! measures. A software driver works for seconds, and does a device's work in order; on the window's
//! device and thread, the window would wait for it.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Instant;

use image::RgbImage;
use subsurface::wgpu::TextureView;
use subsurface::{Atlas, Overlay, Plan, Profile, ScreenSpace, Show};
use subsurface_lab::Error;
use subsurface_lab::method::{Ours, OursUnrolled};
use subsurface_lab::metrics;
use subsurface_lab::renderer::{
    AtlasRenderer, BackRenderer, Camera, Environment, Gpu, Layer as Shown, Lighting, Renderer, Scene,
    Timestamps,
};

use crate::layer::Layer;
use crate::legend::Legend;
use crate::passes::Pass;
use crate::{passes, width};

/// While the view moves, effects that took longer wait until it rests.
const PATIENCE_MS: f64 = 400.0;

/// What a frame depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    pub size: [u32; 2],
    pub camera: Camera,
    pub lighting: Lighting,
    /// Screen space is handed the surface behind the visible one, too.
    pub has_back: bool,
    pub profile: Profile,
    /// None: the first is still being fitted. It may be of another profile, while the next is.
    pub plan: Option<Arc<Plan>>,
    /// What is shown, from left to right.
    pub layers: Vec<Layer>,
    /// A drag goes on.
    pub is_moving: bool,
}

/// A frame that is asked for.
pub struct Request {
    /// Counts them.
    pub number: u64,
    pub look: Look,
    /// Errors against the exact sum, too.
    pub measure: bool,
    /// The time of each pass of what is shown, too.
    pub time_passes: bool,
}

/// One layer, drawn.
pub struct Picture {
    /// What is seen, in words; where it is not what was asked for, why.
    pub title: String,
    pub image: RgbImage,
    /// Of false colours.
    pub legend: Option<Legend>,
}

/// What an effect took.
#[derive(Clone, Copy, Debug)]
pub struct Time {
    pub layer: Layer,
    /// Wall clock, from preparing to the end of the wait.
    pub ms: f64,
    /// Shaders were compiled and textures made within it.
    pub is_first: bool,
}

/// The answer to a request.
pub struct Frame {
    /// That of its request.
    pub number: u64,
    pub look: Look,
    pub pictures: Vec<Arc<Picture>>,
    /// Drawing and lighting, wall clock.
    pub draw_ms: f64,
    /// Making a picture of scattered light and reading it back, wall clock.
    pub compose_ms: Option<f64>,
    /// Of the effects that this view has been scattered by.
    pub times: Vec<Time>,
    /// Of those whose passes were timed for this view.
    pub passes: Vec<(Layer, Vec<Pass>)>,
    /// Relative RMSE against the exact sum, where it was measured for this view.
    pub errors: Vec<(Layer, Option<f64>)>,
}

/// What stays the same.
pub struct Stage {
    pub gpu: Gpu,
    pub scene: Scene,
    pub mm_per_unit: f32,
    /// Side of the atlas, in texels.
    pub texture_size: u32,
    /// What is reflected where the lighting says how far it is turned.
    pub environment: Option<Environment>,
}

impl Stage {
    /// Answers requests until there are no more: the newest, and none that is older.
    pub fn run(self, requests: Receiver<Request>, answer: impl Fn(Result<Frame, Error>)) {
        let mut set = None;
        let mut effects = Effects { timestamps: passes::timestamps(&self.gpu), ..Default::default() };
        while let Ok(mut request) = requests.recv() {
            while let Ok(newer) = requests.try_recv() {
                request = Request {
                    measure: request.measure || newer.measure,
                    time_passes: request.time_passes || newer.time_passes,
                    ..newer
                };
            }
            answer(self.frame(&mut set, &mut effects, request));
        }
    }

    fn frame(
        &self,
        kept: &mut Option<Set>,
        effects: &mut Effects,
        request: Request,
    ) -> Result<Frame, Error> {
        // Textures of another size go before those of this one come.
        kept.take_if(|set| set.size != request.look.size);
        let mut set = match kept.take() {
            Some(set) => set,
            None => Set::new(self, &request.look)?,
        };
        set.draw(self, &request.look)?;
        let with = &mut With { stage: self, effects, look: &request.look };
        let mut pictures = Vec::new();
        for layer in &request.look.layers {
            pictures.push(set.picture(with, *layer)?);
        }
        if request.measure {
            set.measure(with)?;
        }
        if request.time_passes {
            set.time_passes(with)?;
        }
        let shots = &set.view.shots;
        let frame = Frame {
            pictures,
            draw_ms: set.view.draw_ms,
            compose_ms: set.view.compose_ms,
            times: Layer::ALL.iter().filter_map(|layer| shots.get(layer)?.time).collect(),
            passes: Layer::ALL
                .iter()
                .filter_map(|layer| Some((*layer, shots.get(layer)?.passes.clone()?)))
                .collect(),
            errors: set.view.errors.clone(),
            number: request.number,
            look: request.look,
        };
        *kept = Some(set);
        Ok(frame)
    }
}

/// Made when they are first asked for, and kept over changes of size: a driver may compile for seconds.
#[derive(Default)]
struct Effects {
    /// None where the device has none.
    timestamps: Option<Timestamps>,
    screen: HashMap<Layer, Ours>,
    texture: Option<(Profile, OursUnrolled)>,
    overlay: Option<Overlay>,
    /// What each took last.
    last_ms: HashMap<Layer, f64>,
}

/// What layers are made of.
struct With<'a> {
    stage: &'a Stage,
    effects: &'a mut Effects,
    look: &'a Look,
}

/// All that is made for one size of picture.
struct Set {
    size: [u32; 2],
    renderer: Renderer,
    outputs: HashMap<Layer, TextureView>,
    /// Made when it is first asked for.
    atlas: Option<AtlasRenderer>,
    /// Made when it is first asked for.
    back: Option<BackRenderer>,
    view: View,
}

/// What is known of one view.
struct View {
    camera: Camera,
    lighting: Lighting,
    has_back: bool,
    profile: Profile,
    plan: Option<Arc<Plan>>,
    draw_ms: f64,
    compose_ms: Option<f64>,
    shots: HashMap<Layer, Shot>,
    errors: Vec<(Layer, Option<f64>)>,
}

#[derive(Clone)]
struct Shot {
    picture: Arc<Picture>,
    /// Scattered, or as it fell; none behind false colours.
    irradiance: Option<TextureView>,
    time: Option<Time>,
    passes: Option<Vec<Pass>>,
}

/// What an effect leaves.
struct Scattered {
    title: String,
    irradiance: TextureView,
    /// None where nothing was to be done.
    taken_ms: Option<f64>,
}

impl View {
    fn new(stage: &Stage, renderer: &Renderer, look: &Look) -> Result<Self, Error> {
        let since = Instant::now();
        let (camera, lighting) = (look.camera, look.lighting.clone());
        renderer.render(&stage.gpu, &camera, &lighting, stage.mm_per_unit)?;
        Ok(Self {
            camera,
            lighting,
            has_back: false,
            profile: look.profile,
            plan: look.plan.clone(),
            draw_ms: ms(since),
            compose_ms: None,
            shots: HashMap::new(),
            errors: Vec::new(),
        })
    }
}

impl Set {
    fn new(stage: &Stage, look: &Look) -> Result<Self, Error> {
        let mut renderer = Renderer::new(&stage.gpu, &stage.scene, look.size)?;
        if let Some(environment) = &stage.environment {
            renderer.set_environment(&stage.gpu, environment);
        }
        Ok(Self {
            size: look.size,
            view: View::new(stage, &renderer, look)?,
            renderer,
            outputs: HashMap::new(),
            atlas: None,
            back: None,
        })
    }

    /// Draws what is asked for unless that is there, and forgets what is of something else.
    fn draw(&mut self, stage: &Stage, look: &Look) -> Result<(), Error> {
        let view = &mut self.view;
        if view.camera != look.camera || view.lighting != look.lighting {
            *view = View::new(stage, &self.renderer, look)?;
        }
        if view.has_back != look.has_back {
            view.shots.retain(|layer, _| !matches!(layer, Layer::Screen | Layer::Exact | Layer::Level));
            view.errors.clear();
            view.has_back = look.has_back;
            if look.has_back {
                let make = || BackRenderer::new(&stage.gpu, &self.renderer);
                self.back.get_or_insert_with(make).render(&stage.gpu, &self.renderer);
            }
        }
        if view.profile != look.profile {
            // The plan brings its own.
            let stays = |l: &Layer| matches!(l, Layer::None | Layer::Screen | Layer::Level);
            view.shots.retain(|layer, _| stays(layer));
            view.errors.clear();
            view.profile = look.profile;
        }
        if view.plan != look.plan {
            let goes = |l: &Layer| matches!(l, Layer::Screen | Layer::Level);
            view.shots.retain(|layer, _| !goes(layer));
            view.errors.clear();
            view.plan = look.plan.clone();
        }
        Ok(())
    }

    /// The layer or, where it cannot be had, the light as it fell and why.
    fn picture(&mut self, with: &mut With, layer: Layer) -> Result<Arc<Picture>, Error> {
        // Levels are drawn over what the plan scatters.
        let effect = if layer == Layer::Level { Layer::Screen } else { layer };
        let last_ms = with.effects.last_ms.get(&effect).copied().unwrap_or(0.0);
        let is_known = self.view.shots.contains_key(&layer);
        let is_planned = matches!(layer, Layer::Screen | Layer::Level);
        let why = if is_planned && with.look.plan.is_none() {
            "no plan is fitted yet".to_owned()
        } else if with.look.is_moving && last_ms > PATIENCE_MS && !is_known {
            format!("{} follows at rest", layer.title())
        } else {
            match self.shot(with, layer) {
                Ok(shot) => return Ok(shot.picture),
                // Some models cannot have it.
                Err(error) if layer == Layer::Texture => error.to_string(),
                Err(error) => return Err(error),
            }
        };
        let plain = self.shot(with, Layer::None)?.picture;
        Ok(Arc::new(Picture {
            title: format!("{} ({why})", plain.title),
            image: plain.image.clone(),
            legend: None,
        }))
    }

    fn shot(&mut self, with: &mut With, layer: Layer) -> Result<Shot, Error> {
        if let Some(shot) = self.view.shots.get(&layer) {
            return Ok(shot.clone());
        }
        let shot = match layer {
            Layer::Width => self.width(with.stage, with.look)?,
            Layer::Level => self.level(with)?,
            _ => self.scatter(with, layer)?,
        };
        self.view.shots.insert(layer, shot.clone());
        Ok(shot)
    }

    fn scatter(&mut self, with: &mut With, layer: Layer) -> Result<Shot, Error> {
        let Scattered { title, irradiance, taken_ms } = self.run_effect(with, layer, None)?;
        let time = taken_ms.map(|ms| Time {
            layer,
            ms,
            is_first: with.effects.last_ms.insert(layer, ms).is_none(),
        });
        let since = Instant::now();
        let pixels = self.renderer.compose(&with.stage.gpu, &irradiance, Shown::Picture, 1.0);
        self.view.compose_ms = Some(ms(since));
        Ok(Shot { irradiance: Some(irradiance), time, ..self.drawn(title, pixels, None)? })
    }

    /// Runs the effects that are shown once more, and has the device time their passes.
    fn time_passes(&mut self, with: &mut With) -> Result<(), Error> {
        for layer in with.look.layers.iter().filter(|layer| layer.has_passes()) {
            // None where it could not be had; and whoever was shown has compiled.
            if !self.view.shots.contains_key(layer) {
                continue;
            }
            let mut passes = Vec::new();
            self.run_effect(with, *layer, Some(&mut passes))?;
            if let Some(shot) = self.view.shots.get_mut(layer) {
                shot.passes = Some(passes);
            }
        }
        Ok(())
    }

    /// `passes` takes the times of the effect's passes, where they are asked for and the device has them.
    fn run_effect(
        &mut self,
        with: &mut With,
        layer: Layer,
        passes: Option<&mut Vec<Pass>>,
    ) -> Result<Scattered, Error> {
        let fallen = &self.renderer.gbuffer.irradiance;
        let mut title = layer.title().to_owned();
        let plan = match (layer, &with.look.plan) {
            (Layer::Screen, Some(plan)) => {
                title = format!("{title} at {:.4}", plan.max_error());
                Some((**plan).clone())
            }
            (Layer::Exact, _) => Some(Plan::exact(&[with.look.profile])?),
            (Layer::Texture, _) => None,
            _ => {
                return Ok(Scattered { title, irradiance: fallen.clone(), taken_ms: None });
            }
        };
        self.outputs.entry(layer).or_insert_with(|| self.renderer.scattered_target(&with.stage.gpu));
        let since = Instant::now();
        match plan {
            Some(plan) => self.run_plan(with, (layer, &plan), passes)?,
            None => {
                title = format!("{title}, {0}×{0}", with.stage.texture_size);
                self.run_atlas(with, passes)?;
            }
        }
        Ok(Scattered { title, irradiance: self.outputs[&layer].clone(), taken_ms: Some(ms(since)) })
    }

    fn run_plan(
        &self,
        with: &mut With,
        (layer, plan): (Layer, &Plan),
        passes: Option<&mut Vec<Pass>>,
    ) -> Result<(), Error> {
        let (gpu, output) = (&with.stage.gpu, &self.outputs[&layer]);
        let format = output.texture().format();
        let ours = match with.effects.screen.entry(layer) {
            Entry::Occupied(kept) => kept.into_mut(),
            Entry::Vacant(none) => none.insert(Ours::new(&gpu.device, format, plan)?),
        };
        if ours.effect.plan() != plan {
            ours.effect = ScreenSpace::new(&gpu.device, format, plan)?;
        }
        let projection = with.look.camera.projection(self.size);
        let mut frame = self.renderer.gbuffer.frame(projection, with.stage.mm_per_unit);
        frame.back = self.back.as_ref().filter(|_| with.look.has_back).map(BackRenderer::layer);
        let Ours { effect, view, .. } = ours;
        view.prepare(&gpu.device, &gpu.queue, effect, &frame)?;
        let times = with.effects.timestamps.as_ref().zip(passes);
        passes::run(gpu, times, |encoder, queries| match queries {
            Some(queries) => view.render_timed(encoder, output, queries, 0),
            None => view.render(encoder, output).map(|()| Vec::new()),
        })
    }

    fn run_atlas(&mut self, with: &mut With, mut passes: Option<&mut Vec<Pass>>) -> Result<(), Error> {
        let (gpu, output) = (&with.stage.gpu, &self.outputs[&Layer::Texture]);
        let format = output.texture().format();
        let effect = match with.effects.texture.take() {
            Some((profile, effect)) if profile == with.look.profile => effect,
            _ => OursUnrolled::new(&gpu.device, format, &[with.look.profile])?,
        };
        let (_, OursUnrolled { effect, view }) = with.effects.texture.insert((with.look.profile, effect));
        if self.atlas.is_none() {
            self.atlas = Some(AtlasRenderer::new(gpu, &self.renderer, with.stage.texture_size)?);
        }
        let scatter = |atlas: &Atlas, to: &TextureView| {
            view.prepare(&gpu.device, &gpu.queue, effect, atlas)?;
            let times = with.effects.timestamps.as_ref().zip(passes.as_deref_mut());
            passes::run(gpu, times, |encoder, queries| match queries {
                Some(queries) => view.render_timed(encoder, to, queries, 0),
                None => view.render(encoder, to).map(|()| Vec::new()),
            })
        };
        if let Some(atlas) = &self.atlas {
            atlas.render(gpu, &self.renderer, 1, with.stage.mm_per_unit, output, scatter)?;
        }
        Ok(())
    }

    fn width(&self, stage: &Stage, look: &Look) -> Result<Shot, Error> {
        let depth = &self.renderer.gbuffer.depth;
        let depth: Vec<f32> = bytemuck::pod_collect_to_vec(&stage.gpu.read_bytes(depth.texture()));
        let skin = self.skin(stage);
        let widest_mm = width::widest_mm(&look.profile);
        let widths = width::in_pixels(widest_mm, &depth, &skin, &look.camera, self.size, stage.mm_per_unit);
        let range = width::range(&widths);
        let pixels = width::picture(&widths, range);
        self.drawn(Layer::Width.title().to_owned(), pixels, range.map(Legend::Width))
    }

    /// What the library shows of the plan's levels, over the picture.
    fn level(&mut self, with: &mut With) -> Result<Shot, Error> {
        let shot = self.shot(with, Layer::Screen)?;
        let gpu = &with.stage.gpu;
        let target = self.renderer.picture_target(gpu);
        if let Some(light) = &shot.irradiance {
            let columns = 0..self.size[0];
            self.renderer.draw_picture(gpu, light, Shown::Picture, 1.0, columns, &target);
        }
        let overlay = match with.effects.overlay.take() {
            Some(overlay) => overlay,
            None => Overlay::new(&gpu.device, target.texture().format())?,
        };
        let overlay = with.effects.overlay.insert(overlay);
        if let Some(Ours { view, .. }) = with.effects.screen.get(&Layer::Screen) {
            gpu.run(|encoder| overlay.render(&gpu.device, encoder, view, Show::Level, &target))?;
        }
        let pixels = gpu.read_bytes(target.texture());
        let pixels = pixels.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect();
        let error = with.look.plan.as_ref().map_or(0.0, |plan| plan.max_error());
        let title = format!("{} at {error:.4}", Layer::Level.title());
        self.drawn(title, pixels, Some(Legend::Levels))
    }

    fn drawn(&self, title: String, pixels: Vec<[u8; 3]>, legend: Option<Legend>) -> Result<Shot, Error> {
        Ok(Shot {
            picture: Arc::new(Picture { title, image: image(self.size, pixels)?, legend }),
            irradiance: None,
            time: None,
            passes: None,
        })
    }

    /// Holds what is cheap, and what is there, to the exact sum.
    fn measure(&mut self, with: &mut With) -> Result<(), Error> {
        let mut layers = vec![Layer::None];
        if self.view.shots.contains_key(&Layer::Texture) {
            layers.push(Layer::Texture);
        }
        // While a plan is on its way, the old one may be of another profile.
        let plan = with.look.plan.as_ref();
        if plan.is_some_and(|plan| plan.profiles() == [with.look.profile]) {
            layers.push(Layer::Screen);
        }
        // Whoever asks for figures wants no first run among the times.
        let is_first = |shot: &Shot| shot.time.is_some_and(|time| time.is_first);
        self.view.shots.retain(|_, shot| !is_first(shot));

        let [width, height] = self.size;
        let skin = metrics::erode(&self.skin(with.stage), width, height, 2);
        let mut light = |layer| -> Result<metrics::Layer, Error> {
            let shot = self.shot(with, layer)?;
            let pixels = shot.irradiance.iter().flat_map(|v| with.stage.gpu.read(v));
            Ok(metrics::Layer { width, height, pixels: pixels.map(|[r, g, b, _]| [r, g, b]).collect() })
        };
        let exact = light(Layer::Exact)?;
        let mut errors = Vec::new();
        for layer in layers {
            let error = metrics::relative_rmse(&light(layer)?, &exact, &skin);
            errors.push((layer, error));
        }
        self.view.errors = errors;
        Ok(())
    }

    /// What scatters: the first profile, as there is no other.
    fn skin(&self, stage: &Stage) -> Vec<bool> {
        let ids = self.renderer.gbuffer.profile_id.texture();
        let ids = stage.gpu.read_bytes(ids);
        ids.into_iter().map(|id| id == 1).collect()
    }
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

fn image(size: [u32; 2], pixels: Vec<[u8; 3]>) -> Result<RgbImage, Error> {
    let count = pixels.len();
    RgbImage::from_raw(size[0], size[1], pixels.into_flattened())
        .ok_or_else(|| Error::new("picture", format!("{count} pixels"), "one of its size"))
}
