//! What methods take, and how far they are from the exact sum, on the GPU of whoever looks.
//!
//! The page asks for one figure at a time, so that it can show how far it got. Methods are timed in turn, so
//! that a clock that changes changes for all.

use std::rc::Rc;

use subsurface::wgpu::{TextureFormat, TextureView};
use subsurface::{Atlas, Plan, Profile};
use subsurface_lab::Error;
use subsurface_lab::method::{self, Ours, OursUnrolled, ScreenMethod};
use subsurface_lab::metrics::{self, Layer};
use subsurface_lab::renderer::{AtlasRenderer, Gpu, Timestamps};
use subsurface_lab::rivals;
use wasm_bindgen::JsError;
use wasm_bindgen::prelude::wasm_bindgen;
use web_time::Instant;

use crate::stage::Shot;
use crate::wait;

/// What results are written as.
const OUTPUT: TextureFormat = TextureFormat::Rgba16Float;
/// A run is repeated until it lasts so long: browsers round the device's times to 0.1 ms.
const LONG_ENOUGH_MS: f64 = 30.0;
const MOST_REPEATS: u32 = 64;
/// Errors that plans are fitted for, one in so many.
const PLANNED: [u16; 3] = [50, 100, 255];

/// Methods on one frame.
#[wasm_bindgen]
pub struct Bench {
    gpu: Rc<Gpu>,
    shot: Shot,
    entries: Vec<Entry>,
    profiles: usize,
    output: TextureView,
    timestamps: Option<Timestamps>,
    exact: Layer,
    /// Skin, without the rim of a pixel, whose light is as much the background's.
    inner: Vec<bool>,
}

struct Entry {
    name: String,
    setting: String,
    method: Method,
    /// Runs within a submission; 0 before the first.
    repeats: u32,
}

enum Method {
    /// Light as it falls.
    None,
    Screen(Box<dyn ScreenMethod>),
    Texture(OursUnrolled, AtlasRenderer),
}

impl Entry {
    fn new(name: &str, setting: impl ToString, method: Method) -> Self {
        Self { name: name.into(), setting: setting.to_string(), method, repeats: 0 }
    }
}

impl Bench {
    /// What the page shows.
    pub async fn of_modes(gpu: Rc<Gpu>, shot: Shot, plan: &Plan) -> Result<Self, JsError> {
        let planned = Ours::new(&gpu.device, OUTPUT, plan)?;
        let setting = format!("1/{:.0}", plan.max_error().recip());
        let screen = Entry::new("screen_planned", setting, Method::Screen(Box::new(planned)));
        Self::new(gpu, shot, plan.profiles(), vec![screen]).await
    }

    /// Everything that is known to us, for skin.
    pub async fn of_all(gpu: Rc<Gpu>, shot: Shot) -> Result<Self, JsError> {
        let mut entries = Vec::new();
        for steps in PLANNED {
            let plan = Plan::new(&[Profile::SKIN], 1.0 / f32::from(steps))?;
            let planned = Ours::new(&gpu.device, OUTPUT, &plan)?;
            let setting = format!("1/{steps}");
            entries.push(Entry::new("screen_planned", setting, Method::Screen(Box::new(planned))));
        }
        for (name, setting, method) in rivals::screen(&gpu.device, OUTPUT, &Profile::SKIN)? {
            entries.push(Entry::new(name, setting, Method::Screen(method)));
        }
        Self::new(gpu, shot, &[Profile::SKIN], entries).await
    }

    /// These, with the exact sum, texture space where the model has it, and nothing.
    async fn new(
        gpu: Rc<Gpu>,
        shot: Shot,
        profiles: &[Profile],
        mut entries: Vec<Entry>,
    ) -> Result<Self, JsError> {
        let output = gpu.target("scattered", shot.size, OUTPUT);
        let plan = Plan::exact(profiles)?;
        let exact = Ours::new(&gpu.device, OUTPUT, &plan)?;
        entries.insert(0, Entry::new("none", "", Method::None));
        entries.insert(1, Entry::new("screen_exact", "", Method::Screen(Box::new(exact))));
        let atlas = AtlasRenderer::new(&gpu, &shot.renderer, shot.atlas_size)?;
        let effect = OursUnrolled::new(&gpu.device, OUTPUT, profiles)?;
        entries.push(Entry::new("texture_separable", shot.atlas_size, Method::Texture(effect, atlas)));
        let ids = wait::bytes(gpu.copy_out(shot.renderer.gbuffer.profile_id.texture())).await?;
        let skin: Vec<bool> = ids.into_iter().map(|id| id == 1).collect(); // the one profile
        let [width, height] = shot.size;
        let mut bench = Self {
            inner: metrics::erode(&skin, width, height, 1),
            timestamps: Timestamps::new(&gpu, 2),
            exact: Layer { width, height, pixels: Vec::new() },
            gpu,
            shot,
            profiles: profiles.len(),
            entries,
            output,
        };
        bench.scatter(1)?;
        bench.exact = bench.read(&bench.output).await?;
        Ok(bench)
    }

    fn scatter(&mut self, i: usize) -> Result<(), Error> {
        let Self { gpu, shot, output, profiles, .. } = self;
        match &mut self.entries[i].method {
            Method::None => Ok(()),
            Method::Screen(method) => method::scatter(gpu, &mut **method, &shot.frame(), output),
            Method::Texture(effect, atlas) => {
                let Shot { renderer, mm_per_unit, .. } = shot;
                let scatter =
                    |atlas: &Atlas, to: &TextureView| method::scatter_atlas(gpu, effect, atlas, to);
                atlas.render(gpu, renderer, *profiles, *mm_per_unit, output, scatter).map(|_| ())
            }
        }
    }

    async fn read(&self, view: &TextureView) -> Result<Layer, JsError> {
        let bytes = wait::bytes(self.gpu.copy_out(self.gpu.to_float(view).texture())).await?;
        let pixels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
        let pixels = pixels.into_iter().map(|[r, g, b, _]| [r, g, b]).collect();
        let [width, height] = self.shot.size;
        Ok(Layer { width, height, pixels })
    }

    /// Milliseconds of so many runs.
    async fn run(&mut self, i: usize, repeats: u32) -> Result<f64, JsError> {
        if let (Method::Screen(method), Some(timestamps)) = (&self.entries[i].method, &self.timestamps) {
            let (recorded, times) = timestamps.submit(&self.gpu, |encoder| {
                timestamps.mark(encoder, 0);
                let recorded = (0..repeats).try_for_each(|_| method.render(encoder, &self.output));
                timestamps.mark(encoder, 1);
                (recorded, 2)
            });
            recorded?;
            if let Some(times) = times {
                let times = Timestamps::ms(&self.gpu, &wait::bytes(times).await?);
                if times[1] > times[0] {
                    return Ok(times[1] - times[0]);
                }
            }
            // Some drivers leave out passes that do nothing, and so their times.
            self.timestamps = None;
        }
        wait::done(&self.gpu.queue).await?;
        let since = Instant::now();
        match &self.entries[i].method {
            Method::Screen(method) => self
                .gpu
                .run(|encoder| (0..repeats).try_for_each(|_| method.render(encoder, &self.output)))?,
            Method::None | Method::Texture(..) => (0..repeats).try_for_each(|_| self.scatter(i))?,
        }
        wait::done(&self.gpu.queue).await?;
        Ok(since.elapsed().as_secs_f64() * 1e3)
    }
}

#[wasm_bindgen]
impl Bench {
    /// How many methods there are.
    #[wasm_bindgen(getter)]
    pub fn length(&self) -> usize {
        self.entries.len()
    }

    /// A method's name, as the lab's chart has it.
    pub fn name(&self, i: usize) -> String {
        self.entries[i].name.clone()
    }

    /// What a method was made for: an error, taps, samples, or texels.
    pub fn setting(&self, i: usize) -> String {
        self.entries[i].setting.clone()
    }

    /// What tells a method's time.
    pub fn clock(&self, i: usize) -> String {
        let is_device = self.timestamps.is_some() && matches!(self.entries[i].method, Method::Screen(_));
        if is_device { "timestamps" } else { "wall clock" }.into()
    }

    /// How far a method is from the exact sum, of the irradiance over skin: relative RMSE, and the largest
    /// error of any channel. NaN where no skin is in view.
    ///
    /// # Errors
    /// A model that the method cannot have.
    pub async fn errors(&mut self, i: usize) -> Result<Vec<f64>, JsError> {
        self.scatter(i)?;
        let view = match self.entries[i].method {
            Method::None => &self.shot.renderer.gbuffer.irradiance,
            _ => &self.output,
        };
        let result = self.read(view).await?;
        let errors = [metrics::relative_rmse, metrics::max_error]
            .map(|error| error(&result, &self.exact, &self.inner).unwrap_or(f64::NAN));
        Ok(errors.to_vec())
    }

    /// Milliseconds of a method, after [`errors`](Self::errors): the mean of the runs of a submission.
    ///
    /// # Errors
    /// A device that is lost.
    pub async fn ms(&mut self, i: usize) -> Result<f64, JsError> {
        if matches!(self.entries[i].method, Method::None) {
            return Ok(0.0);
        }
        if self.entries[i].repeats == 0 {
            let mut repeats = 1;
            while repeats < MOST_REPEATS && self.run(i, repeats).await? < LONG_ENOUGH_MS {
                repeats *= 2;
            }
            self.entries[i].repeats = repeats;
        }
        let repeats = self.entries[i].repeats;
        Ok(self.run(i, repeats).await? / f64::from(repeats))
    }
}
