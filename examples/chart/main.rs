//! The chart of speed against accuracy: every method on every scene, timed and held to the integral
//! that it approximates.
//!
//! ```sh
//! cargo run --release --example chart
//! ```

mod clock;
mod files;
#[cfg(test)]
mod fixture;
mod heads;
mod method;
#[path = "../shared/metrics.rs"]
mod metrics;
#[path = "../shared/output.rs"]
mod output;
#[path = "../shared/page.rs"]
mod page;
mod plot;
mod progress;
mod report;
mod rivals;
mod row;
mod scene;
mod score;
mod truths;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use glam::Vec3;
use image::RgbImage;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use subsurface::renderer::{AtlasRenderer, Gpu, Scene as Model};
use subsurface::wgpu::TextureFormat;
use subsurface::{Error, Profile, ScreenFrame, ScreenSpace, TextureSpace};

use clock::Rounds;
use files::Chart;
use heads::Textured;
use method::{AtlasMethod, ScreenMethod};
use plot::Series;
use progress::{Done, Interval, Progress};
use report::SceneImages;
use row::Row;
use scene::{Scene, Surface, rgb};
use score::{Knows, Score};
use truths::Truths;

/// The built-in head, which `compare` owns.
const HEAD: &[u8] = include_bytes!("../compare/head.glb");

/// What results are written as.
const OUTPUT: TextureFormat = TextureFormat::Rgba16Float;

/// Methods that are compared by the ratio of their times, and so are timed more often.
const COMPARED: [(&str, &str); 3] = [
    ("copy", ""),
    ("jimenez_separable", "17"),
    ("fitted_separable", "17"),
];

/// Side of the pictures in the report, at most.
const THUMBNAIL: u32 = 256;

const HELP: &str = "\
Times every method on every scene, measures how far it is from the exact integrals, and draws one
against the other.

Usage: cargo run --release --example chart -- [OPTIONS]

  --scenes LIST     of front, three-quarter, close-up, far, profile, sphere, edge_0.5 to edge_64
                    and heads, separated by commas                      [all]
  --methods LIST    such as screen_exact,burley_disk                    [all]
  --size WxH        of the frames, in pixels                            [512x512; quick: 256x256]
  --quick           fewer runs, smaller atlases, truths at every fourth pixel, not every second
  --model FILE      a .glb or .gltf file                                [the built-in head]
  --mm-per-unit X   length of the model's unit in mm                    [1000: metres]
  --cache DIR       where truths and finished scenes are kept           [out/chart-cache]
  --out DIR         where the chart goes                                [out/chart]

A run that was stopped goes on with the scene that it was at.
";

struct Options {
    scenes: Option<Vec<String>>,
    methods: Option<Vec<String>>,
    size: Option<[u32; 2]>,
    quick: bool,
    model: Option<PathBuf>,
    mm_per_unit: f32,
    cache: PathBuf,
    out: PathBuf,
}

fn main() -> ExitCode {
    match options().and_then(|options| options.map_or(Ok(()), |o| chart(&o))) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The command line; `None` when it asked for help.
fn options() -> Result<Option<Options>, Error> {
    use lexopt::prelude::*;

    let mut options = Options {
        scenes: None,
        methods: None,
        size: None,
        quick: false,
        model: None,
        mm_per_unit: 1000.0,
        cache: "out/chart-cache".into(),
        out: "out/chart".into(),
    };
    let refused = |e: lexopt::Error| {
        let got = format!("\"{e}\"");
        Error::new("command line", got, "options as --help lists them")
    };
    let mut parser = lexopt::Parser::from_env();
    while let Some(arg) = parser.next().map_err(refused)? {
        let name = match arg {
            Long(name) => name.to_string(),
            Short('h') => "help".into(),
            other => return Err(refused(other.unexpected())),
        };
        let mut text = || parser.value().and_then(|v| v.string()).map_err(refused);
        let list = |text: String| Some(text.split(',').map(String::from).collect());
        match name.as_str() {
            "help" => {
                print!("{HELP}");
                return Ok(None);
            }
            "quick" => options.quick = true,
            "scenes" => options.scenes = list(text()?),
            "methods" => options.methods = list(text()?),
            "model" => options.model = Some(text()?.into()),
            "cache" => options.cache = text()?.into(),
            "out" => options.out = text()?.into(),
            "size" => options.size = Some(size(&text()?)?),
            "mm-per-unit" => {
                let text = text()?;
                options.mm_per_unit = text
                    .parse()
                    .ok()
                    .filter(|x: &f32| x.is_finite() && *x > 0.0)
                    .ok_or_else(|| Error::new("--mm-per-unit", text, "a number above 0"))?;
            }
            _ => return Err(refused(Long(name.as_str()).unexpected())),
        }
    }
    Ok(Some(options))
}

fn size(text: &str) -> Result<[u32; 2], Error> {
    text.split_once('x')
        .and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]))
        // A pixel less would leave nothing once rims are taken off.
        .filter(|size: &[u32; 2]| size.iter().all(|s| *s >= 16))
        .ok_or_else(|| {
            let needs = "WIDTHxHEIGHT in pixels, such as 512x512, at least 16x16";
            Error::new("--size", text, needs)
        })
}

/// What `--quick` cuts, and nothing else does.
struct Plan {
    size: [u32; 2],
    rounds: Rounds,
    /// The truth is asked for at every so many pixels, each way.
    stride: u32,
    /// Sides of the atlases, in texels.
    atlases: &'static [u32],
    /// A full convolution takes a minute at 512².
    atlas_2d: u32,
    /// Runs of an atlas, or as many as fit into this time.
    atlas_runs: usize,
    atlas_seconds: f64,
}

impl Plan {
    fn new(options: &Options) -> Self {
        let size = |default| options.size.unwrap_or([default; 2]);
        if options.quick {
            return Self {
                size: size(256),
                rounds: Rounds {
                    all: 3,
                    compared: 5,
                },
                stride: 4,
                atlases: &[256, 512],
                atlas_2d: 256,
                atlas_runs: 1,
                atlas_seconds: 0.0,
            };
        }
        Self {
            size: size(512),
            rounds: Rounds {
                all: 9,
                compared: 31,
            },
            stride: 2,
            atlases: &[512, 1024],
            atlas_2d: 512,
            atlas_runs: 9,
            atlas_seconds: 20.0,
        }
    }
}

/// What stays the same from scene to scene.
struct Lab<'a> {
    gpu: Gpu,
    model: Model,
    options: &'a Options,
    plan: Plan,
    bar: ProgressBar,
}

fn chart(options: &Options) -> Result<(), Error> {
    let started = Instant::now();
    let (model_name, model) = match &options.model {
        Some(path) => (path.display().to_string(), Model::load(path)?),
        None => (
            "the built-in head (MakeHuman base mesh, CC0)".to_owned(),
            Model::from_glb(HEAD)?,
        ),
    };
    let bar = ProgressBar::no_length().with_style(
        ProgressStyle::with_template("{bar:24} {msg}").expect("the template is a constant"),
    );
    let lab = Lab {
        gpu: Gpu::headless()?,
        model,
        options,
        plan: Plan::new(options),
        bar,
    };
    let known: Vec<String> = scene::names().into_iter().chain(["heads".into()]).collect();
    let scenes = options.scenes.clone().unwrap_or_else(|| known.clone());
    if let Some(unknown) = scenes.iter().find(|s| !known.contains(s)) {
        return Err(Error::new("--scenes", unknown, known.join(", ")));
    }
    lab.check_methods()?;

    let command = std::iter::once("chart".to_owned())
        .chain(std::env::args().skip(1))
        .collect::<Vec<_>>()
        .join(" ");
    let progress = Progress::new(&options.cache, &lab.gpu.adapter, &command)?;
    let mut done = Vec::new();
    for name in &scenes {
        done.push(match progress.read(name) {
            Some(kept) => kept,
            None => {
                let new = if name == "heads" {
                    lab.heads()?
                } else {
                    lab.scene(name)?
                };
                progress.keep(name, &new)?;
                new
            }
        });
    }

    let rows: Vec<Row> = done.iter().flat_map(|d| d.rows.clone()).collect();
    let images = done
        .iter()
        .filter_map(Done::images)
        .collect::<Result<Vec<_>, _>>()?;
    let heads: Vec<Series> = done.iter().flat_map(|d| d.heads.clone()).collect();
    let intervals: Vec<&Interval> = done.iter().flat_map(|d| &d.intervals).collect();
    let notes: Vec<String> = notes()
        .into_iter()
        .chain(done.iter().flat_map(|d| d.notes.clone()))
        .collect();
    let [width, height] = lab.plan.size;
    let about = json!({
        "adapter": lab.gpu.adapter,
        "model": model_name,
        "size": format!("{width}x{height}"),
        "command": command,
        "x_copy_intervals_95": intervals,
        "notes": notes,
    });
    let caption = format!(
        "{}, {width}×{height}, {model_name}\n`cargo run --release --example {}`",
        lab.gpu.adapter,
        command.replacen("chart", "chart --", 1),
    );
    let files = files::files(&Chart {
        rows: &rows,
        about: &about,
        caption: &caption,
        heads: &heads,
        images: &images,
    })
    .map_err(|e| Error::new("chart", format!("\"{e}\""), "files that can be made"))?;
    output::write(&options.out, &files)
        .map_err(|e| Error::new("--out", format!("\"{e}\""), "a directory to write to"))?;
    progress.forget();
    lab.bar.finish_and_clear();
    println!("{}", table(&rows));
    println!(
        "{} in {:.0} s",
        options.out.join("report.html").display(),
        started.elapsed().as_secs_f64()
    );
    Ok(())
}

fn notes() -> Vec<String> {
    [
        "Errors are of irradiance/π over skin, a rim of one pixel left out.",
        "Screen-space methods are compared with the visible integral, in colour differences and \
         energy, too; texture-space methods with the surface integral, each Gaussian divided by its mass.",
        "rel_rmse_eq7 is Eq. 7 as printed; error_time_eq7 draws rel_rmse_eq7_normalised.",
        "jimenez_separable has the published construction with falloff, strength and width fitted \
         to the skin profile, burley_disk has its three shapes fitted to it; jimenez_2009 has its authors' own fit.",
        "Texture-space times hold the drawing and lighting of the atlas, which screen space has from \
         the frame; each is the median of as many runs as the notes of chart.json say.",
    ]
    .map(String::from)
    .to_vec()
}

impl Lab<'_> {
    fn wanted(&self, method: &str) -> bool {
        // The floor is what all is a multiple of.
        let methods = self.options.methods.as_ref();
        method == "copy" || methods.is_none_or(|m| m.iter().any(|name| name == method))
    }

    fn check_methods(&self) -> Result<(), Error> {
        let mut known = vec!["none", "texture_separable"];
        known.extend(self.screen_methods()?.iter().map(|m| m.0));
        known.extend(self.atlas_methods().iter().map(|m| m.0));
        known.dedup();
        let wanted = self.options.methods.iter().flatten();
        match wanted.into_iter().find(|m| !known.contains(&m.as_str())) {
            Some(unknown) => Err(Error::new("--methods", unknown, known.join(", "))),
            None => Ok(()),
        }
    }

    fn screen_methods(&self) -> Result<Vec<rivals::Screen>, Error> {
        let mut methods = rivals::screen(&self.gpu.device, OUTPUT, &Profile::SKIN)?;
        let exact = ScreenSpace::new(&self.gpu.device, OUTPUT)?;
        methods.insert(1, ("screen_exact", String::new(), Box::new(exact)));
        Ok(methods)
    }

    fn atlas_methods(&self) -> Vec<rivals::Atlas> {
        rivals::atlas(&self.gpu.device, OUTPUT, &Profile::SKIN)
    }

    fn begin(&self, what: String, steps: usize) {
        self.bar.set_length(steps as u64);
        self.bar.set_position(0);
        self.bar.set_message(what);
        self.bar.enable_steady_tick(Duration::from_millis(200));
    }

    fn scene(&self, name: &str) -> Result<Done, Error> {
        let Self { gpu, model, .. } = self;
        let mm_per_unit = self.options.mm_per_unit;
        self.begin(format!("{name}: drawing"), 1);
        let scene = Scene::new(
            gpu,
            model,
            mm_per_unit,
            name,
            self.plan.size,
            self.plan.stride,
        )?;
        if scene.pixels.is_empty() {
            return Err(Error::new(name, "no skin in view", "a model that scatters"));
        }
        let cache = &self.options.cache;
        let truths = Truths::of(gpu, model, &scene, &Profile::SKIN, cache, &self.bar)?;
        let score = Score::new(&scene, &truths);
        let mut done = Done::default();
        let mut images = SceneImages {
            scene: name.into(),
            truth: thumbnail(score.picture(&truths.visible)),
            entries: Vec::new(),
        };
        let copy_ms = self.screen(&scene, &score, &mut done, &mut images)?;
        if let Surface::Head(_) = &scene.surface {
            self.textures(&scene, &score, copy_ms, &mut done, &mut images)?;
        }
        done.keep_images(&images)?;
        Ok(done)
    }

    /// Every method in screen space; the median time of the copy.
    fn screen(
        &self,
        scene: &Scene,
        score: &Score,
        done: &mut Done,
        images: &mut SceneImages,
    ) -> Result<f64, Error> {
        let gpu = &self.gpu;
        let mut methods = self.screen_methods()?;
        methods.retain(|(name, ..)| self.wanted(name));
        self.begin(format!("{}: warming up", scene.name), methods.len());
        let output = gpu.target("scattered", scene.size, OUTPUT);
        let frame = scene.frame(&output);
        let mut results = Vec::new();
        for (_, _, method) in &mut methods {
            method.prepare(&gpu.device, &frame)?;
            gpu.run(|encoder| method.render(encoder));
            results.push(read(gpu, scene, &output));
            self.bar.inc(1);
        }
        let timed: Vec<(&dyn ScreenMethod, bool)> = methods
            .iter()
            .map(|(name, setting, method)| {
                let compared = COMPARED.contains(&(*name, setting.as_str()));
                (method.as_ref(), compared)
            })
            .collect();
        let rounds = self.plan.rounds;
        self.begin(format!("{}: timing", scene.name), rounds.compared);
        let times = clock::rounds(gpu, &timed, rounds, || self.bar.inc(1));

        if self.wanted("none") {
            let mut row = empty_row(scene, "none", "");
            score.fill(&mut row, &results[0], Knows::Frame);
            show(images, score, "no scattering", &results[0], Knows::Frame);
            done.rows.push(row);
        }
        for (i, (name, setting, method)) in methods.iter().enumerate() {
            let (x_copy, interval_95) = clock::ratio(&times[i], &times[0]);
            let mut row = Row {
                ms: clock::median(&times[i]),
                x_copy,
                fetches: method.fetches(scene.px_per_mm),
                scratch_bytes_per_pixel: Some(method.scratch_bytes_per_pixel()),
                ..empty_row(scene, name, setting)
            };
            score.fill(&mut row, &results[i], Knows::Frame);
            if *name != "copy" {
                show(
                    images,
                    score,
                    &format!("{name} {setting}"),
                    &results[i],
                    Knows::Frame,
                );
            }
            done.rows.push(row);
            done.intervals.push(Interval {
                scene: scene.name.clone(),
                method: (*name).into(),
                setting: setting.clone(),
                runs: times[i].len(),
                interval_95,
            });
        }
        Ok(clock::median(&times[0]))
    }

    /// Every method in texture space.
    fn textures(
        &self,
        scene: &Scene,
        score: &Score,
        copy_ms: f64,
        done: &mut Done,
        images: &mut SceneImages,
    ) -> Result<(), Error> {
        let mut methods: Vec<(&str, u32, Box<dyn AtlasMethod>)> = Vec::new();
        for size in self.plan.atlases {
            let ours = TextureSpace::new(&self.gpu.device, OUTPUT)?;
            methods.push(("texture_separable", *size, Box::new(ours)));
        }
        for (name, _, method) in self.atlas_methods() {
            // One timed run at one head is enough for the full convolution: it takes a minute.
            match name {
                "texture_2d" if scene.name != "front" => continue,
                "texture_2d" => methods.push((name, self.plan.atlas_2d, method)),
                _ => methods.push((name, self.plan.atlases[self.plan.atlases.len() - 1], method)),
            }
        }
        methods.retain(|(name, ..)| self.wanted(name));
        self.begin(format!("{}: texture space", scene.name), methods.len());
        let output = self.gpu.target("scattered", scene.size, OUTPUT);
        for (name, size, mut method) in methods {
            let (times, result) = self.texture(scene, name, size, method.as_mut(), &output)?;
            let ms = clock::median(&times);
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
            show(
                images,
                score,
                &format!("{name} {setting}"),
                &result,
                Knows::Mesh,
            );
            done.rows.push(row);
            done.notes.push(format!(
                "{}: {name} {setting} is the median of {} runs.",
                scene.name,
                times.len()
            ));
            self.bar.inc(1);
        }
        Ok(())
    }

    /// Times in ms, and the result.
    fn texture(
        &self,
        scene: &Scene,
        name: &str,
        size: u32,
        method: &mut dyn AtlasMethod,
        output: &subsurface::wgpu::TextureView,
    ) -> Result<(Vec<f64>, Vec<Vec3>), Error> {
        let Surface::Head(head) = &scene.surface else {
            return Ok(Default::default());
        };
        let gpu = &self.gpu;
        let atlas = AtlasRenderer::new(gpu, &head.renderer, size)?;
        let mut times = Vec::new();
        let since = Instant::now();
        let enough = |runs: usize| match name {
            "texture_2d" => runs >= 1,
            _ => {
                runs >= self.plan.atlas_runs
                    || runs >= 1 && since.elapsed().as_secs_f64() > self.plan.atlas_seconds
            }
        };
        while !enough(times.len()) {
            let took = atlas.render(
                gpu,
                &head.renderer,
                &[Profile::SKIN],
                scene.mm_per_unit,
                output,
                |atlas| {
                    method.prepare(&gpu.device, atlas)?;
                    gpu.run(|encoder| method.render(encoder));
                    Ok(())
                },
            )?;
            times.push(took.raster_ms + took.blur_ms);
        }
        Ok((times, read(gpu, scene, output)))
    }

    /// Li & Shao's Fig. 8.
    fn heads(&self) -> Result<Done, Error> {
        const STEPS: usize = 5;
        self.begin("heads".into(), STEPS);
        let device = &self.gpu.device;
        let mut screen = ScreenSpace::new(device, OUTPUT)?;
        let mut separable = Vec::new();
        for size in self.plan.atlases {
            separable.push((*size, TextureSpace::new(device, OUTPUT)?));
        }
        let mut textured: Vec<Textured> = separable
            .iter_mut()
            .map(|(size, method)| Textured {
                name: format!("texture_separable {size}"),
                method,
                size: *size,
                measured: STEPS,
            })
            .collect();
        let mut atlas_methods = self.atlas_methods();
        for (name, _, method) in &mut atlas_methods {
            if *name == "texture_2d" {
                textured.push(Textured {
                    name: format!("{name} {}", self.plan.atlas_2d),
                    method: method.as_mut(),
                    size: self.plan.atlas_2d,
                    measured: 1,
                });
            }
        }
        let (heads, notes) = heads::figure(
            &self.gpu,
            &self.model,
            self.options.mm_per_unit,
            self.plan.size,
            &mut screen,
            &mut textured,
            |what| {
                self.bar.inc(1);
                self.bar.set_message(what.to_owned());
            },
        )?;
        Ok(Done {
            heads,
            notes,
            ..Default::default()
        })
    }
}

impl Scene {
    fn frame<'a>(&'a self, output: &'a subsurface::wgpu::TextureView) -> ScreenFrame<'a> {
        ScreenFrame {
            irradiance: &self.irradiance,
            depth: &self.depth,
            profile_id: &self.profile_id,
            output,
            projection: self.projection,
            mm_per_unit: self.mm_per_unit,
            profiles: &[Profile::SKIN],
        }
    }
}

/// A result, at the pixels that the truth is asked for.
fn read(gpu: &Gpu, scene: &Scene, output: &subsurface::wgpu::TextureView) -> Vec<Vec3> {
    let pixels: Vec<Vec3> = gpu.read(output).into_iter().map(rgb).collect();
    scene.asked(&pixels)
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

fn table(rows: &[Row]) -> String {
    let percent = |v: Option<f64>| v.map_or("-".into(), |v| format!("{:.3} %", 100.0 * v));
    let mut lines = vec![format!(
        "{:<14} {:<26} {:>10} {:>8} {:>12} {:>12}",
        "scene", "method", "ms", "x copy", "to visible", "to Eq. 7"
    )];
    lines.extend(rows.iter().map(|row| {
        format!(
            "{:<14} {:<26} {:>10.2} {:>8.1} {:>12} {:>12}",
            row.scene,
            format!("{} {}", row.method, row.setting),
            row.ms,
            row.x_copy,
            percent(row.rel_rmse_visible),
            percent(row.rel_rmse_eq7_normalised),
        )
    }));
    lines.join("\n")
}
