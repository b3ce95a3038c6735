//! Runs the methods on one scene after the other.

use std::time::{Duration, Instant};

use crate::Error;
use glam::Vec3;
use image::RgbImage;
use indicatif::{ProgressBar, ProgressStyle};
use subsurface::wgpu::{Features, TextureFormat, TextureView};
use subsurface::{Frame, Profile};

use crate::chart::clock::{self, Clock};
use crate::chart::costs;
use crate::chart::heads::{self, HEADS, Textured, time_atlas};
use crate::chart::options::{Options, Plan};
use crate::chart::progress::{Done, Host, Interval, Visibility};
use crate::chart::report::SceneImages;
use crate::chart::row::Row;
use crate::chart::scene::{Head, Scene, Surface, rgb};
use crate::chart::score::{Knows, Score};
use crate::chart::truths::Truths;
use crate::chart::turning::{self, Turned};
use crate::method::{self, AtlasMethod, Ours, OursUnrolled, ScreenMethod};
use crate::metrics;
use crate::renderer::{AtlasRenderer, Gpu, Scene as Model};
use crate::rivals;

/// What results are written as.
const OUTPUT: TextureFormat = TextureFormat::Rgba16Float;

/// All methods by name.
pub const METHODS: [&str; 14] = [
    "copy",
    "none",
    "screen_exact",
    "screen_planned",
    "jimenez_2009",
    "jimenez_separable",
    "fitted_separable",
    "burley_disk",
    "jimenez_2010",
    "jimenez_2010_derived",
    "burley_2015",
    "texture_separable",
    "texture_cascade",
    "texture_2d",
];

/// Methods that are compared by the ratio of their times, and so are timed more often; with two layers, too.
const COMPARED: [(&str, &str); 9] = [
    ("copy", ""),
    ("screen_exact", ""),
    ("screen_planned", "1/50"),
    ("screen_planned", "1/100"),
    ("screen_planned", "1/255"),
    ("jimenez_separable", "11"),
    ("fitted_separable", "11"),
    ("jimenez_separable", "17"),
    ("fitted_separable", "17"),
];

/// What a setting ends with where our methods have the layer behind.
const TWO_LAYERS: &str = "two layers";

/// Errors that are asked for: one in so many.
const PLANNED: [u16; 3] = [50, 100, 255];

/// Frames that the cost to a host's CPU is the median of.
const HOST_FRAMES: usize = 31;

/// Side of the atlas of a full convolution while the light turns.
const TURNING_2D: u32 = 128;

/// Side of the pictures in the report, at most.
const THUMBNAIL: u32 = 256;

/// What stays the same from scene to scene.
pub struct Lab<'a> {
    pub gpu: Gpu,
    pub clock: Clock,
    pub plan: Plan,
    pub bar: ProgressBar,
    /// Of the skin profile, by the error that they keep.
    plans: Vec<(String, subsurface::Plan)>,
    model: Model,
    options: &'a Options,
}

impl<'a> Lab<'a> {
    /// # Errors
    /// No adapter; a size that it cannot render.
    pub fn new(model: Model, options: &'a Options) -> Result<Self, Error> {
        let gpu = Gpu::with(Features::TIMESTAMP_QUERY)?;
        let plan = Plan::new(options);
        gpu.check_size(plan.size)?;
        let style = ProgressStyle::with_template("{bar:24} {msg}");
        let bar = ProgressBar::no_length().with_style(style.expect("the template is a constant"));
        let mut plans = Vec::new();
        for steps in PLANNED {
            let plan = subsurface::Plan::new(&[Profile::SKIN], 1.0 / f32::from(steps))?;
            plans.push((format!("1/{steps}"), plan));
        }
        Ok(Self { clock: Clock::new(&gpu), gpu, plan, bar, plans, model, options })
    }

    fn wanted(&self, method: &str) -> bool {
        // The floor is what all is a multiple of.
        let methods = self.options.methods.as_ref();
        method == "copy" || methods.is_none_or(|m| m.iter().any(|name| name == method))
    }

    fn begin(&self, what: String, steps: usize) {
        self.bar.set_length(steps as u64);
        self.bar.set_position(0);
        self.bar.set_message(what);
        self.bar.enable_steady_tick(Duration::from_millis(200));
    }

    /// A scene, from drawing it to the rows of all methods.
    ///
    /// # Errors
    /// A scene that cannot be drawn; a cache that cannot be written.
    pub fn scene(&self, name: &str) -> Result<Done, Error> {
        let Self { gpu, model, .. } = self;
        let Plan { size, wide, stride, .. } = self.plan;
        self.begin(format!("{name}: drawing"), 1);
        let scene = Scene::new(gpu, model, self.options.mm_per_unit, name, [size, wide], stride)?;
        let cache = &self.options.cache;
        let truths = Truths::of(gpu, model, &scene, &Profile::SKIN, cache, &self.bar)?;
        let score = Score::new(&scene, &truths, read(gpu, &scene, &scene.irradiance));
        let mut done = Done::default();
        let [rel_rmse_eq7, rel_rmse_eq7_normalised] = score.visibility_error();
        done.visibility.push(Visibility { scene: name.into(), rel_rmse_eq7, rel_rmse_eq7_normalised });
        let copy_ms = self.screen(&scene, &score, &mut done)?;
        if let Surface::Head(head) = &scene.surface {
            self.textures(&scene, head, &score, copy_ms, &mut done)?;
        }
        Ok(done)
    }

    /// Ours in screen space.
    fn ours(&self) -> Result<Vec<rivals::Screen>, Error> {
        let device = &self.gpu.device;
        let exact = subsurface::Plan::exact(&[Profile::SKIN])?;
        let exact = Ours::new(device, OUTPUT, &exact)?;
        let mut methods: Vec<rivals::Screen> = vec![("screen_exact", String::new(), Box::new(exact))];
        for (setting, plan) in &self.plans {
            let planned = Ours::new(device, OUTPUT, plan)?;
            methods.push(("screen_planned", setting.clone(), Box::new(planned)));
        }
        Ok(methods)
    }

    /// Those in screen space that are wanted, the copy first.
    fn screen_methods(&self) -> Result<Vec<rivals::Screen>, Error> {
        let mut methods = rivals::screen(&self.gpu.device, OUTPUT, &Profile::SKIN)?;
        methods.splice(1..1, self.ours()?);
        methods.retain(|(name, ..)| self.wanted(name));
        Ok(methods)
    }

    /// Those that are wanted with the layer behind.
    fn back_methods(&self) -> Result<Vec<rivals::Screen>, Error> {
        let mut methods = self.ours()?;
        for (_, setting, _) in &mut methods {
            *setting = format!("{setting} {TWO_LAYERS}").trim_start().into();
        }
        methods.extend(rivals::transmission(&self.gpu.device, OUTPUT, &Profile::SKIN));
        methods.retain(|(name, ..)| self.wanted(name));
        Ok(methods)
    }

    /// All that are tried on a scene in screen space, the copy first.
    fn tried(&self, scene: &Scene) -> Result<Vec<Tried>, Error> {
        let tried = |knows| move |method| Tried { knows, method, result: Vec::new(), times: Vec::new() };
        let mut all: Vec<_> = self.screen_methods()?.into_iter().map(tried(Knows::Frame)).collect();
        if scene.back().is_some() {
            all.extend(self.back_methods()?.into_iter().map(tried(Knows::Back)));
        }
        Ok(all)
    }

    /// Every method in screen space; the median time of the copy.
    fn screen(&self, scene: &Scene, score: &Score, done: &mut Done) -> Result<f64, Error> {
        let gpu = &self.gpu;
        let mut all = self.tried(scene)?;
        self.begin(format!("{}: warming up", scene.name), all.len());
        let output = gpu.target("scattered", scene.size, OUTPUT);
        for tried in &mut all {
            let frame = tried.frame(scene);
            let (.., method) = &mut tried.method;
            method::scatter(gpu, &mut **method, &frame, &output)?;
            tried.result = read(gpu, scene, &output);
            self.bar.inc(1);
        }
        let timed: Vec<(&dyn ScreenMethod, &TextureView, bool)> = all
            .iter()
            .map(|tried| {
                let (.., method) = &tried.method;
                (method.as_ref(), &output, tried.is_compared())
            })
            .collect();
        let rounds = self.plan.rounds;
        self.begin(format!("{}: timing", scene.name), rounds.compared);
        let times = clock::rounds(gpu, &self.clock, &timed, rounds, || self.bar.inc(1))?;
        for (tried, times) in all.iter_mut().zip(times) {
            tried.times = times;
            let frame = tried.frame(scene);
            let (name, setting, method) = &mut tried.method;
            if name.starts_with("screen_") {
                done.host.push(Host {
                    scene: scene.name.clone(),
                    method: name.to_string(),
                    setting: setting.clone(),
                    cost: clock::host_cost(gpu, &mut **method, &frame, &output, HOST_FRAMES)?,
                });
            }
        }
        self.tell(scene, score, &all, done)?;
        Ok(metrics::median(&all[0].times))
    }

    /// Rows and pictures of what was tried in screen space.
    fn tell(&self, scene: &Scene, score: &Score, all: &[Tried], done: &mut Done) -> Result<(), Error> {
        let copy = &all[0];
        let mut images = images_of(&scene.name, score, Knows::Frame);
        let mut through = images_of(&format!("{}, {TWO_LAYERS}", scene.name), score, Knows::Back);
        if self.wanted("none") {
            let mut row = empty_row(scene, "none", "");
            score.fill(&mut row, &copy.result, Knows::Frame);
            show(&mut images, score, "no scattering", &copy.result, Knows::Frame);
            done.rows.push(row);
        }
        for Tried { knows, method: (name, setting, method), result, times } in all {
            let (x_copy, interval_95) = clock::ratio(times, &copy.times);
            let mut row = Row {
                ms: metrics::median(times),
                x_copy,
                fetches: method.fetches(scene.px_per_mm),
                scratch_bytes_per_pixel: Some(method.scratch_bytes_per_pixel()),
                ..empty_row(scene, name, setting)
            };
            score.fill(&mut row, result, *knows);
            let images = if *knows == Knows::Back { &mut through } else { &mut images };
            if *name != "copy" {
                show(images, score, &format!("{name} {setting}"), result, *knows);
            }
            done.rows.push(row);
            done.intervals.push(interval(scene, name, setting, times.len(), interval_95));
        }
        done.keep_images(&images)?;
        if scene.back().is_some() {
            done.notes.extend(layer_notes(scene, all));
            done.keep_images(&through)?;
        }
        Ok(())
    }

    /// Those in texture space that are wanted, with the side of their atlas.
    fn atlas_methods(&self, scene: &Scene) -> Result<Vec<(u32, rivals::Atlas)>, Error> {
        let mut methods: Vec<(u32, rivals::Atlas)> = Vec::new();
        for size in self.plan.atlases {
            let ours = OursUnrolled::new(&self.gpu.device, OUTPUT, &[Profile::SKIN])?;
            methods.push((*size, ("texture_separable", String::new(), Box::new(ours))));
            let rivals = rivals::atlas(&self.gpu.device, OUTPUT, &Profile::SKIN);
            methods.extend(rivals.into_iter().map(|rival| (*size, rival)));
        }
        // One timed run at one head is enough for the full convolution: it takes long.
        let has_2d = |size| scene.name == "front" && size == self.plan.atlas_2d;
        methods.retain(|(size, (name, ..))| self.wanted(name) && (*name != "texture_2d" || has_2d(*size)));
        Ok(methods)
    }

    /// Every method in texture space.
    fn textures(
        &self,
        scene: &Scene,
        head: &Head,
        score: &Score,
        copy_ms: f64,
        done: &mut Done,
    ) -> Result<(), Error> {
        let name = format!("{}, texture space", scene.name);
        let mut images = images_of(&name, score, Knows::Mesh);
        let methods = self.atlas_methods(scene)?;
        self.begin(name, methods.len());
        let output = self.gpu.target("scattered", scene.size, OUTPUT);
        for (size, (name, _, mut method)) in methods {
            let atlas = AtlasRenderer::new(&self.gpu, &head.renderer, size)?;
            let mut run = || {
                let (gpu, mm) = (&self.gpu, scene.mm_per_unit);
                time_atlas(gpu, &atlas, &head.renderer, method.as_mut(), mm, &output)
            };
            // One run warms up, and tells whether the model has UVs at all.
            if let Err(error) = run() {
                done.notes.push(format!("{}: no texture space: {error}.", scene.name));
                return Ok(());
            }
            let runs = if name == "texture_2d" { 1 } else { self.plan.atlas_runs };
            let since = Instant::now();
            let mut times = Vec::new();
            while times.is_empty()
                || times.len() < runs && since.elapsed().as_secs_f64() < self.plan.atlas_seconds
            {
                times.push(run()?);
            }
            let result = read(&self.gpu, scene, &output);
            let ms = metrics::median(&times);
            let pixels = f64::from(scene.size[0]) * f64::from(scene.size[1]);
            let texels = f64::from(size) * f64::from(size);
            let setting = size.to_string();
            let mut row = Row {
                ms,
                x_copy: ms / copy_ms,
                scratch_bytes_per_pixel: Some(method.scratch_bytes_per_texel() * texels / pixels),
                ..empty_row(scene, name, &setting)
            };
            score.fill(&mut row, &result, Knows::Mesh);
            let label = format!("{name} {setting}");
            show(&mut images, score, &label, &result, Knows::Mesh);
            done.rows.push(row);
            let runs = times.len();
            done.notes.push(format!("{}: {label} is the median of {runs} runs.", scene.name));
            self.bar.inc(1);
        }
        done.keep_images(&images)
    }

    /// What a pixel of skin costs, by the methods that are compared by their times.
    ///
    /// # Errors
    /// A model without skin in view; a size that cannot be rendered, or scattered by a method.
    pub fn costs(&self) -> Result<Done, Error> {
        let Self { gpu, model, .. } = self;
        let Plan { size, rounds, .. } = self.plan;
        self.begin("costs: warming up".into(), costs::SCENES.len());
        let scenes = costs::scenes(gpu, model, self.options.mm_per_unit, size)?;
        let (mut methods, mut outputs) = (Vec::new(), Vec::new());
        for scene in &scenes {
            let output = gpu.target("scattered", size, OUTPUT);
            // A method keeps one frame.
            let mut of_scene = self.screen_methods()?;
            // The exact effect, whose cost grows with the kernel, would take most of the time.
            of_scene.retain(|(name, setting, _)| {
                *name != "screen_exact" && COMPARED.contains(&(*name, setting.as_str()))
            });
            for (.., method) in &mut of_scene {
                method::scatter(gpu, &mut **method, &scene.frame(), &output)?;
            }
            outputs.push(output);
            methods.push(of_scene);
            self.bar.inc(1);
        }
        let mut timed: Vec<(&dyn ScreenMethod, &TextureView, bool)> = Vec::new();
        for (of_scene, output) in methods.iter().zip(&outputs) {
            timed.extend(of_scene.iter().map(|(.., m)| (m.as_ref(), output, true)));
        }
        self.begin("costs: timing".into(), rounds.compared);
        let times = clock::rounds(gpu, &self.clock, &timed, rounds, || self.bar.inc(1))?;
        let count = methods[0].len();
        let mut done = Done::default();
        for (s, scene) in scenes.iter().enumerate() {
            let copy = &times[s * count];
            for (m, (name, setting, method)) in methods[s].iter().enumerate() {
                let times = &times[s * count + m];
                let (x_copy, interval_95) = clock::ratio(times, copy);
                done.rows.push(Row {
                    ms: metrics::median(times),
                    x_copy,
                    fetches: method.fetches(scene.px_per_mm),
                    scratch_bytes_per_pixel: Some(method.scratch_bytes_per_pixel()),
                    ..empty_row(scene, name, setting)
                });
                done.intervals.push(interval(scene, name, setting, times.len(), interval_95));
            }
        }
        for (m, (name, setting, _)) in methods[0].iter().enumerate().skip(1) {
            let of_method = std::array::from_fn(|s| times[s * count + m].as_slice());
            let name = format!("{name} {setting}");
            done.notes.push(costs::note(&name, of_method, &times[0], &scenes));
        }
        Ok(done)
    }

    /// Error and time while the light turns.
    ///
    /// # Errors
    /// A model without skin in view.
    pub fn turning(&self) -> Result<Done, Error> {
        self.begin("turning: 360° in frames".into(), turning::FRAMES);
        let device = &self.gpu.device;
        let [.., (setting, plan)] = &self.plans[..] else {
            return Ok(Done::default());
        };
        let exact = subsurface::Plan::exact(&[Profile::SKIN])?;
        let side = self.plan.atlases[0];
        let mut names = vec![
            ("copy", String::new()),
            ("screen_planned", setting.clone()),
            ("screen_exact", String::new()),
            ("texture_separable", side.to_string()),
        ];
        let mut copy = rivals::screen(device, OUTPUT, &Profile::SKIN)?;
        copy.retain(|(name, ..)| *name == "copy");
        let mut planned = Ours::new(device, OUTPUT, plan)?;
        let mut exact = Ours::new(device, OUTPUT, &exact)?;
        let mut separable = OursUnrolled::new(device, OUTPUT, &[Profile::SKIN])?;
        let mut full = rivals::atlas(device, OUTPUT, &Profile::SKIN);
        full.retain(|(name, ..)| *name == "texture_2d");
        let mut methods: Vec<_> =
            copy.iter_mut().map(|(.., method)| turning::Method::Screen(method.as_mut())).collect();
        methods.extend([
            turning::Method::Screen(&mut planned),
            turning::Method::Screen(&mut exact),
            turning::Method::Atlas(&mut separable, side),
        ]);
        for (name, _, method) in &mut full {
            // At the least size, or it would take hours.
            names.push((*name, TURNING_2D.to_string()));
            methods.push(turning::Method::Atlas(method.as_mut(), TURNING_2D));
        }
        let (gpu, mm) = (&self.gpu, self.options.mm_per_unit);
        let (scene, none, turned) =
            turning::figure(gpu, &self.model, mm, &self.plan, &mut methods, || self.bar.inc(1))?;
        let names = names.iter().map(|(name, setting)| (*name, &**setting));
        let all = std::iter::once((("none", ""), &none)).chain(names.zip(&turned));
        Ok(turning_figures(&scene, all, turned.first().map_or(f64::NAN, |copy| copy.ms)))
    }

    /// Li & Shao's Fig. 8.
    ///
    /// # Errors
    /// A model without skin in view, or without UVs.
    pub fn heads(&self) -> Result<Done, Error> {
        self.begin("heads".into(), HEADS.len());
        let device = &self.gpu.device;
        let exact = subsurface::Plan::exact(&[Profile::SKIN])?;
        let mut screen = Ours::new(device, OUTPUT, &exact)?;
        let mut methods: Vec<(&str, u32, usize, Box<dyn AtlasMethod>)> = Vec::new();
        for (size, measured) in self.plan.atlases.iter().zip(self.plan.heads) {
            let ours = OursUnrolled::new(device, OUTPUT, &[Profile::SKIN])?;
            methods.push(("texture_separable", *size, *measured, Box::new(ours)));
        }
        for (name, _, method) in rivals::atlas(device, OUTPUT, &Profile::SKIN) {
            if name == "texture_2d" {
                methods.push((name, self.plan.atlas_2d, 1, method));
            }
        }
        methods.retain(|(name, ..)| self.wanted(name));
        let mut textured: Vec<Textured> = methods
            .iter_mut()
            .map(|(name, size, measured, method)| Textured {
                name: format!("{name} {size}"),
                method: method.as_mut(),
                size: *size,
                measured: *measured,
            })
            .collect();
        let screen: &mut dyn ScreenMethod = &mut screen;
        let (heads, notes) = heads::figure(
            &self.gpu,
            &self.model,
            &self.clock,
            self.options.mm_per_unit,
            &self.plan,
            self.wanted("screen_exact").then_some(screen),
            &mut textured,
            |what| {
                self.bar.inc(1);
                self.bar.set_message(what.to_owned());
            },
        )?;
        Ok(Done { heads, notes, ..Default::default() })
    }
}

/// A method in screen space, and what it came to on a scene.
struct Tried {
    knows: Knows,
    method: rivals::Screen,
    /// At the pixels that the truth is asked for.
    result: Vec<Vec3>,
    /// Milliseconds, one a round.
    times: Vec<f64>,
}

impl Tried {
    /// What it is handed.
    fn frame<'a>(&self, scene: &'a Scene) -> Frame<'a> {
        let mut frame = scene.frame();
        frame.back = scene.back().filter(|_| self.knows == Knows::Back);
        frame
    }

    /// Name and setting of the same method without the layer behind.
    fn of_one_layer(&self) -> (&str, &str) {
        let (name, setting, _) = &self.method;
        (name, setting.strip_suffix(TWO_LAYERS).unwrap_or(setting).trim_end())
    }

    fn is_compared(&self) -> bool {
        COMPARED.contains(&self.of_one_layer())
    }
}

/// What the reader of a scene that is lit from behind should know, and what the layer behind takes.
fn layer_notes(scene: &Scene, all: &[Tried]) -> Vec<String> {
    let name = &scene.name;
    let mut notes = vec![format!(
        "{name}: lit from behind. What comes through is in Eq. 7 and not in the visible integral, which \
         knows of no back: error_time_eq7 is the plot for it. \"{TWO_LAYERS}\" is ours with the surface \
         right behind the visible one, whose drawing and lighting is not in the time. jimenez_2010, \
         jimenez_2010_derived and burley_2015 are jimenez_separable 17 and transmission, by that surface's \
         true distance and light. All with that surface are compared with Eq. 7, normalised, in colour \
         differences, energy and pictures, too."
    )];
    for two in all.iter().filter(|tried| tried.knows == Knows::Back) {
        let (method, setting) = two.of_one_layer();
        let is_one = |t: &&Tried| t.knows == Knows::Frame && t.of_one_layer() == (method, setting);
        if let Some(one) = all.iter().find(is_one) {
            let (ratio, [low, high]) = clock::ratio(&two.times, &one.times);
            let method = format!("{method} {setting}");
            let ratio = format!("{ratio:.2} ({low:.2} to {high:.2})");
            notes.push(format!(
                "{name}: {} takes {ratio} times as long with {TWO_LAYERS} as with one.",
                method.trim_end()
            ));
        }
    }
    notes
}

/// A result, at the pixels that the truth is asked for.
fn read(gpu: &Gpu, scene: &Scene, texture: &TextureView) -> Vec<Vec3> {
    let pixels: Vec<Vec3> = gpu.read(texture).into_iter().map(rgb).collect();
    scene.asked(&pixels)
}

fn images_of(scene: &str, score: &Score, knows: Knows) -> SceneImages {
    SceneImages {
        scene: scene.into(),
        truth: thumbnail(score.picture(score.truth(knows))),
        entries: Vec::new(),
    }
}

/// What is said of methods, by their names and settings, while the light turns.
fn turning_figures<'a>(
    scene: &Scene,
    all: impl Iterator<Item = ((&'a str, &'a str), &'a Turned)>,
    copy_ms: f64,
) -> Done {
    let mut done = Done::default();
    done.notes.push(
        "turning: all are held to the visible integral, texture space, too, which knows of more light."
            .into(),
    );
    for ((name, setting), turned) in all {
        let percent = |error: f64| format!("{:.2} %", 100.0 * error);
        let [least, median, worst] = turned.spread().map(percent);
        let rest =
            turned.by_turning().map(|times| format!("; over the same light at rest at most {times:.4}"));
        done.notes.push(format!(
            "turning: {}: {} in the first of {} frames, {least} to {worst}, median {median}, {} over all{}.",
            format!("{name} {setting}").trim_end(),
            percent(turned.errors[0]),
            turned.errors.len(),
            percent(turned.rms()),
            rest.unwrap_or_default(),
        ));
        if turned.ms.is_finite() {
            let rel_rmse_visible = (name != "copy").then(|| turned.rms());
            let x_copy = turned.ms / copy_ms;
            let row = empty_row(scene, name, setting);
            done.rows.push(Row { ms: turned.ms, x_copy, rel_rmse_visible, ..row });
        }
    }
    done
}

fn interval(scene: &Scene, method: &str, setting: &str, runs: usize, interval_95: [f64; 2]) -> Interval {
    Interval {
        scene: scene.name.clone(),
        method: method.into(),
        setting: setting.into(),
        runs,
        interval_95,
    }
}

fn empty_row(scene: &Scene, method: &str, setting: &str) -> Row {
    Row {
        scene: scene.name.clone(),
        method: method.into(),
        setting: setting.into(),
        width: scene.size[0],
        height: scene.size[1],
        skin_pixels: scene.pixels.len(),
        px_per_mm: scene.px_per_mm,
        ms: 0.0,
        x_copy: 0.0,
        fetches: None,
        rel_rmse_visible: None,
        max_error_visible: None,
        rel_rmse_eq7: None,
        max_error_eq7: None,
        rel_rmse_eq7_normalised: None,
        delta_e2000_p99: None,
        flip_mean: None,
        energy_ratio: None,
        scratch_bytes_per_pixel: None,
    }
}

fn show(images: &mut SceneImages, score: &Score, label: &str, result: &[Vec3], knows: Knows) {
    images.entries.push((
        label.trim().to_owned(),
        thumbnail(score.picture(result)),
        thumbnail(score.error_map(result, knows)),
    ));
}

fn thumbnail(picture: RgbImage) -> RgbImage {
    let largest = picture.width().max(picture.height());
    if largest <= THUMBNAIL {
        return picture;
    }
    let side = |s: u32| (s * THUMBNAIL / largest).max(1);
    image::imageops::thumbnail(&picture, side(picture.width()), side(picture.height()))
}

#[cfg(test)]
mod tests {
    use crate::cli::Arguments;

    use super::*;

    #[test]
    fn the_layer_behind_has_rows_of_its_own_and_is_nearer_to_eq_7() {
        let cache = std::env::temp_dir().join(format!("chart-{}", std::process::id()));
        let methods = ["screen_planned", "burley_2015"].map(String::from).to_vec();
        let options = Options {
            methods: Some(methods),
            size: Some([128; 2]),
            cache: cache.clone(),
            ..Options::parse(&mut Arguments::new(["--quick"])).unwrap()
        };
        let lab = Lab::new(Model::from_glb(crate::HEAD).unwrap(), &options).unwrap();
        let done = lab.scene("ear").unwrap();
        std::fs::remove_dir_all(&cache).unwrap();
        let row = |method: &str, setting: &str| {
            done.rows.iter().find(|row| row.method == method && row.setting == setting).unwrap()
        };
        for setting in ["1/50", "1/100", "1/255"] {
            let [one, two] =
                [setting.into(), format!("{setting} {TWO_LAYERS}")].map(|s| row("screen_planned", &s));
            let errors = [one, two].map(|row| row.rel_rmse_eq7_normalised.unwrap());
            println!("{setting}: {errors:.4?}");
            assert!(errors[1] < errors[0], "{setting}: {errors:?}");
            assert!(one.rel_rmse_visible.is_some() && two.rel_rmse_visible.is_none());
            assert!(two.scratch_bytes_per_pixel > one.scratch_bytes_per_pixel);
            let says = format!("screen_planned {setting} takes ");
            assert!(done.notes.iter().any(|note| note.contains(&says)), "{:?}", done.notes);
        }
        assert_eq!(row("burley_2015", "").rel_rmse_visible, None);
        let pictures = done.images().unwrap();
        let through = pictures.iter().find(|images| images.scene == "ear, two layers").unwrap();
        assert_eq!(through.entries.len(), 4);
    }
}
