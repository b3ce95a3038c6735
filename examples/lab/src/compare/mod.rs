//! Renders a head four ways — no scattering, texture space, screen space by a plan and by the exact sum —
//! measures how far they are apart, and writes pictures, layers and a report.
//!
//! ```sh
//! cargo run --release --example compare
//! ```

mod report;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use crate::Error;
use glam::{Mat4, Vec3, Vec4};
use image::RgbImage;
use indicatif::{ProgressBar, ProgressStyle};
use subsurface::{Atlas, DEFAULT_MAX_ERROR, Frame, Plan, Profile, wgpu};

use crate::chart::truths::eq7;
use crate::cli::Arguments;
use crate::method::{self, Ours, OursUnrolled, ScreenMethod};
use crate::metrics::{self, Layer};
use crate::profile::Description;
use crate::renderer::{
    AtlasRenderer, BackRenderer, Camera, Environment, Gpu, Layer as Shown, Lighting, Primitive, Probe,
    Renderer, Scene, View,
};
use crate::truth::Patch;
use crate::{cli, output, srgb};
use report::{DIFFERENCE_GAIN, ModeReport, Report};

/// Runs that a median is taken of: this many, or as many as fit into this time.
const TIMED_RUNS: usize = 5;
const TIMED_SECONDS: f64 = 10.0;

/// Gaussians narrower than this, in texels, are lost in an atlas.
const RESOLVED_TEXELS: f32 = 0.6;

const NOT_SMOOTH: &str = "Pictures of this size are not anti-aliased: the device cannot render twice it.";

/// The mode of the integral over the whole mesh.
const EQ7: &str = "eq7";

const HELP: &str = "\
Renders a head without scattering, in texture space, and in screen space by a plan and by the exact sum.

Usage: cargo run --release --example compare -- [OPTIONS]

  --model FILE        a .glb or .gltf file                        [the built-in head]
  --size WxH          of the pictures, in pixels                  [512x512]
  --view VIEW         front, three-quarter, profile, close-up, ear [front]
  --light LIGHT       portrait, or behind the head                [portrait]
  --back              hands in the layer behind, too; with behind [no]
  --eq7               the integral over the whole mesh, too: minutes
  --look-at X,Y,Z     a point to look at, in scene units          [the face]
  --distance X        from that point, in mm                      [600]
  --turn X            of the camera about the head, in degrees    [0]
  --skin NAME,…       materials, meshes or nodes that are skin    [by their names]
  --not-skin NAME,…   materials, meshes or nodes that are not     [by their names]
  --profile MATERIAL  light, medium, dark or another name, or a   [skin, six Gaussians]
                      file, as `--example profile` takes them
  --max-error X       largest error of the plan, of white         [1/255]
  --mm-per-unit X     length of a scene unit in mm                [1000: metres]
  --specular FORM     kelemen, printed (Li & Shao's), blinn-phong,
                      beckmann or ggx                             [kelemen]
  --environment FILE  light from a picture, .hdr or .exr, of all
                      directions; studio: a built-in one          [three lights]
  --environment-turn X  of it, about y, in degrees                [0]
  --texture-size N    of the atlas, in texels                     [2048]
  --exposure X        of the pictures                             [1]
  --out DIR           where the report goes                       [out/compare]
";

struct Options {
    model: Option<PathBuf>,
    size: [u32; 2],
    view: View,
    view_name: String,
    look_at: Option<Vec3>,
    distance_mm: Option<f32>,
    turn_degrees: f32,
    /// Names of what is skin, and of what is not.
    skin: [Vec<String>; 2],
    /// What it is of, and the profile by that.
    material: Description,
    profile: Profile,
    max_error: f32,
    mm_per_unit: f32,
    lighting: Lighting,
    /// Whether screen space is shown with the layer behind, too.
    has_back: bool,
    has_eq7: bool,
    environment: Option<Environment>,
    environment_turn_degrees: f32,
    texture_size: u32,
    exposure: f32,
    out: PathBuf,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            model: None,
            size: [512, 512],
            view: View::Front,
            view_name: "front".into(),
            look_at: None,
            distance_mm: None,
            turn_degrees: 0.0,
            skin: Default::default(),
            material: Description::skin_of_2007(),
            profile: Profile::SKIN,
            max_error: DEFAULT_MAX_ERROR,
            mm_per_unit: 1000.0,
            lighting: Lighting::default(),
            has_back: false,
            has_eq7: false,
            environment: None,
            environment_turn_degrees: 0.0,
            texture_size: 2048,
            exposure: 1.0,
            out: "out/compare".into(),
        }
    }
}

pub fn main() -> ExitCode {
    cli::main(HELP, options, |options| compare(&options))
}

fn options(arguments: &mut Arguments) -> Result<Options, Error> {
    let mut options = Options::default();
    let degrees = |arguments: &mut Arguments| {
        arguments.number("a number within ±3.4e38", |degrees: &f32| degrees.is_finite())
    };
    while let Some(name) = arguments.next_word()? {
        match name.as_str() {
            "--model" => options.model = Some(arguments.value()?.into()),
            "--out" => options.out = arguments.value()?.into(),
            "--size" => options.size = arguments.size("", |_| true)?,
            "--view" => {
                options.view_name = arguments.value()?;
                options.view = options.view_name.parse()?;
            }
            "--look-at" => {
                let needs = "X,Y,Z in scene units, such as 0,1.6,0";
                options.look_at = Some(arguments.value_by(needs, point)?);
            }
            "--distance" => options.distance_mm = Some(arguments.positive()?),
            "--turn" => options.turn_degrees = degrees(arguments)?,
            "--skin" => options.skin[0] = arguments.names()?,
            "--not-skin" => options.skin[1] = arguments.names()?,
            "--profile" => options.material = Description::load(&arguments.value()?)?,
            "--specular" => options.lighting.specular = arguments.value()?.parse()?,
            "--light" => {
                let specular = options.lighting.specular;
                let lighting = arguments.value_by("portrait or behind", |text| match text {
                    "portrait" => Some(Lighting::default()),
                    "behind" => Some(Lighting::behind()),
                    _ => None,
                })?;
                options.lighting = Lighting { specular, ..lighting };
            }
            "--back" => options.has_back = true,
            "--eq7" => options.has_eq7 = true,
            "--environment" => options.environment = Some(Environment::named(&arguments.value()?)?),
            "--environment-turn" => options.environment_turn_degrees = degrees(arguments)?,
            "--max-error" => options.max_error = arguments.max_error()?,
            "--mm-per-unit" => options.mm_per_unit = arguments.positive()?,
            "--exposure" => options.exposure = arguments.positive()?,
            "--texture-size" => {
                let needs = "a whole number of texels, 1 or more";
                options.texture_size = arguments.number(needs, |texels| *texels > 0)?;
            }
            _ => return Err(arguments.unknown()),
        }
    }
    if let (Some(distance_mm), None) = (options.distance_mm, options.look_at) {
        return Err(Error::new("--distance", distance_mm, "--look-at, from where it is measured"));
    }
    if let Some(name) = options.skin[0].iter().find(|name| options.skin[1].contains(name)) {
        return Err(Error::new("--not-skin", name, "names that --skin has not"));
    }
    // What they depend on was perhaps said after them.
    options.profile = options.material.profile(None, options.max_error)?;
    if let Some(environment) = &options.environment {
        environment.light(&mut options.lighting, options.environment_turn_degrees.to_radians());
    }
    Ok(options)
}

fn point(text: &str) -> Option<Vec3> {
    let numbers: Option<Vec<f32>> = text.split(',').map(|x| x.trim().parse().ok()).collect();
    Some(Vec3::from(<[f32; 3]>::try_from(numbers?).ok()?)).filter(|point| point.is_finite())
}

/// A mode's scattered irradiance on the device, and what it cost.
struct Scattered {
    name: &'static str,
    title: String,
    view: wgpu::TextureView,
    runs: usize,
    /// Median over the runs.
    ms: f64,
    /// Of `ms`, what the atlas's drawing and its blur take; texture space alone has them.
    atlas_ms: Option<[f64; 2]>,
}

/// The scene, drawn and lit at one size, and scattered by every mode that can be had.
struct Shot {
    size: [u32; 2],
    renderer: Renderer,
    camera: Camera,
    /// Where it is asked for.
    back: Option<BackRenderer>,
    modes: Vec<Scattered>,
    /// Modes that cannot be had: title and reason.
    unavailable: Vec<(String, String)>,
}

fn compare(options: &Options) -> Result<(), Error> {
    let started = Instant::now();
    let progress = ProgressBar::new(5)
        .with_style(ProgressStyle::with_template("{bar:24} {msg}").expect("the template is a constant"));
    let step = |message: &str| {
        progress.inc(1);
        progress.set_message(message.to_owned());
    };

    step("loading the model");
    let loaded = Loaded::new(options)?;
    let scene = &loaded.scene;
    let gpu = Gpu::headless()?;

    step("scattering");
    let mut shot = Shot::new(&gpu, scene, options, options.size, TIMED_RUNS)?;
    if options.has_eq7 {
        step("Eq. 7 over the whole mesh");
        shot.add_eq7(&gpu, scene, options, &progress);
    }

    // What is measured is of pixels that have one sample each, as methods take them.
    step("scattering at twice the size, for smooth pictures");
    let fine = Shot::fine(&gpu, scene, options)?;

    step("measuring");
    let frame = Skin::read(&gpu, &shot);
    let measured = measure(&gpu, &shot, fine.as_ref(), &frame, options.exposure);
    let mut notes = shot.notes(options, &frame);
    let needs_fine = !options.has_eq7 && fine.is_none();
    notes.extend(needs_fine.then(|| NOT_SMOOTH.to_owned()));
    notes.extend(loaded.notes());
    let command = std::iter::once("compare".to_owned()).chain(std::env::args().skip(1));
    let report = Report {
        adapter: gpu.adapter.clone(),
        size: options.size,
        model: loaded.name.clone(),
        attribution: options.model.is_none().then(|| "MakeHuman base mesh and targets, CC0 1.0".into()),
        view: options.view_name.clone(),
        skin_pixels: frame.skin.iter().filter(|skin| **skin).count(),
        mm_per_px: f64::from(options.mm_per_unit / shot.camera.px_per_unit(options.size)),
        mm_per_texel: loaded.mm_per_texel()[1].into(),
        texture_size: options.texture_size,
        max_error: options.max_error,
        unresolved: loaded.unresolved(&options.profile),
        notes,
        command: command.collect::<Vec<_>>().join(" "),
        modes: measured.reports,
        unavailable: shot.unavailable,
    };

    step("writing the report");
    write(&options.out, &report, &measured.layers)?;
    progress.finish_and_clear();
    println!("{}", report::table(&report));
    println!("{} in {:.1} s", options.out.join("report.html").display(), started.elapsed().as_secs_f64());
    Ok(())
}

/// The model.
struct Loaded {
    name: String,
    scene: Scene,
    size_mm: f32,
    /// Width of a texel on each primitive that scatters, on its fullest page.
    texels_mm: Vec<(String, f32)>,
}

impl Loaded {
    fn new(options: &Options) -> Result<Self, Error> {
        let (name, mut scene) = match &options.model {
            Some(path) => (path.display().to_string(), Scene::load(path)?),
            None => ("built-in head".to_owned(), Scene::from_glb(crate::HEAD)?),
        };
        let (low, high) = scene.bounds();
        let size_mm = (high - low).max_element() * options.mm_per_unit;
        if !(size_mm > 0.0 && size_mm < 1e9) {
            let needs = "one above 0 and below 1e9 mm; --mm-per-unit says how long its unit is";
            return Err(Error::new(name, format!("a size of {size_mm} mm"), needs));
        }
        scene.choose(&options.skin[0], true, "--skin")?;
        scene.choose(&options.skin[1], false, "--not-skin")?;
        if let Some(albedo) = options.material.albedo {
            scene.color_skin(Vec3::from(albedo.map(|a| a as f32)));
        }
        let skin = scene.primitives.iter().filter(|p| scene.materials[p.material].profile_id == 1);
        let texel = |p: &Primitive| {
            let page = (0..p.pages.len()).max_by_key(|i| p.pages[*i].len());
            let texel = page.map_or(0.0, |page| p.texel_size(page, options.texture_size));
            (p.name.clone(), texel * options.mm_per_unit)
        };
        let texels_mm = skin.map(texel).filter(|(_, mm)| *mm > 0.0).collect();
        Ok(Self { name, scene, size_mm, texels_mm })
    }

    /// The finest and the coarsest texel.
    fn mm_per_texel(&self) -> [f32; 2] {
        let mm = || self.texels_mm.iter().map(|(_, mm)| *mm);
        [mm().fold(f32::INFINITY, f32::min), mm().fold(0.0, f32::max)]
    }

    /// Gaussians that an atlas loses.
    fn unresolved(&self, profile: &Profile) -> Vec<String> {
        let mut found = Vec::new();
        for (name, mm) in &self.texels_mm {
            for g in profile.gaussians() {
                let sigma_mm = g.variance_mm2.sqrt();
                if sigma_mm < RESOLVED_TEXELS * mm {
                    found.push(format!("σ {sigma_mm:.3} mm is {:.2} texels on {name}", sigma_mm / mm));
                }
            }
        }
        found
    }

    /// What the reader of a report should know.
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let [finest, coarsest] = self.mm_per_texel();
        if finest < coarsest {
            notes.push(format!(
                "The primitives differ: {finest:.3} to {coarsest:.3} mm a texel; the coarsest is given."
            ));
        }
        // A face of a doll, or of a statue; nobody's.
        if !(30.0..=3000.0).contains(&self.size_mm) {
            notes.push(format!(
                "The model is {:.0} mm long: --mm-per-unit says how many millimetres its unit has.",
                self.size_mm
            ));
        }
        notes.extend(self.scene.notes());
        notes
    }
}

impl Shot {
    fn new(
        gpu: &Gpu,
        scene: &Scene,
        options: &Options,
        size: [u32; 2],
        most_runs: usize,
    ) -> Result<Self, Error> {
        let mut renderer = Renderer::new(gpu, scene, size)?;
        let distance = options.distance_mm.unwrap_or(600.0) / options.mm_per_unit;
        let camera = match options.look_at {
            Some(point) => Camera::looking_at(scene, options.view, point, distance),
            None => Camera::framing(scene, options.view, size),
        }
        .turned(options.turn_degrees.to_radians());
        if let Some(environment) = &options.environment {
            renderer.set_environment(gpu, environment);
        }
        renderer.render(gpu, &camera, &options.lighting, options.mm_per_unit)?;
        let back = options.has_back.then(|| BackRenderer::new(gpu, &renderer));
        if let Some(back) = &back {
            back.render(gpu, &renderer);
        }
        let none = Scattered {
            name: "none",
            title: "no scattering".into(),
            view: renderer.gbuffer.irradiance.clone(),
            runs: 0,
            ms: 0.0,
            atlas_ms: None,
        };
        let mut shot = Self { size, renderer, camera, back, modes: vec![none], unavailable: Vec::new() };
        match shot.texture_space(gpu, options, most_runs) {
            Ok(mode) => shot.modes.push(mode),
            Err(error) => shot.unavailable.push(("texture space".into(), error.to_string())),
        }
        let title = format!("screen space, a plan at {}", fraction(options.max_error));
        match Plan::new(&[options.profile], options.max_error) {
            Ok(plan) => {
                let names = ["screen_planned", "screen_planned_back"];
                shot.screen_space(gpu, options, names, &title, &plan, most_runs)?;
            }
            Err(error) => shot.unavailable.push((title, error.to_string())),
        }
        let exact = Plan::exact(&[options.profile])?;
        let names = ["screen_space", "screen_space_back"];
        shot.screen_space(gpu, options, names, "screen space, the exact sum", &exact, most_runs)?;
        Ok(shot)
    }

    /// At twice the size, where the device can render it; Eq. 7 would take four times as long.
    fn fine(gpu: &Gpu, scene: &Scene, options: &Options) -> Result<Option<Self>, Error> {
        let twice = options.size.map(|s| s.saturating_mul(2));
        match gpu.check_size(twice) {
            Ok(()) if !options.has_eq7 => Self::new(gpu, scene, options, twice, 1).map(Some),
            _ => Ok(None),
        }
    }

    /// Adds the modes of a plan: of what is seen, and with the layer behind where there is one.
    fn screen_space(
        &mut self,
        gpu: &Gpu,
        options: &Options,
        names: [&'static str; 2],
        title: &str,
        plan: &Plan,
        most_runs: usize,
    ) -> Result<(), Error> {
        let format = self.renderer.scattered_target(gpu).texture().format();
        let mut ours = Ours::new(&gpu.device, format, plan)?;
        let mut frame = self.frame(options);
        let back = frame.back.take();
        let mut modes = vec![self.scattered(gpu, names[0], title.into(), &mut ours, &frame, most_runs)?];
        if back.is_some() {
            frame.back = back;
            let title = format!("{title}, two layers");
            modes.push(self.scattered(gpu, names[1], title, &mut ours, &frame, most_runs)?);
        }
        self.modes.extend(modes);
        Ok(())
    }

    /// With the layer behind where there is one.
    fn frame(&self, options: &Options) -> Frame<'_> {
        let projection = self.camera.projection(self.size);
        let mut frame = self.renderer.gbuffer.frame(projection, options.mm_per_unit);
        frame.back = self.back.as_ref().map(BackRenderer::layer);
        frame
    }

    fn scattered(
        &self,
        gpu: &Gpu,
        name: &'static str,
        title: String,
        method: &mut dyn ScreenMethod,
        frame: &Frame,
        most_runs: usize,
    ) -> Result<Scattered, Error> {
        let output = self.renderer.scattered_target(gpu);
        let mut times = Vec::new();
        let timed = Instant::now();
        while more_runs(times.len(), most_runs, timed) {
            let start = Instant::now();
            method::scatter(gpu, method, frame, &output)?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
        Ok(Scattered {
            name,
            title,
            view: output,
            runs: times.len(),
            ms: metrics::median(&times),
            atlas_ms: None,
        })
    }

    /// What the reader of its report should know.
    fn notes(&self, options: &Options, frame: &Skin) -> Vec<String> {
        let timed = self.modes.iter().filter(|m| m.runs > 0);
        let runs: Vec<_> = timed.map(|m| format!("{} of {}", m.title, m.runs)).collect();
        let mut notes = vec![
            format!(
                "Timings are medians of runs, submit and wait ({}); on a software driver they compare \
                 the modes with each other, not with a GPU.",
                runs.join(", ")
            ),
            format!(
                "Profile: {}, {} Gaussians, off by {:.4}, which comes on top of what a plan is off by.",
                options.material.title,
                options.profile.gaussians().len(),
                options.profile.fit_error()
            ),
        ];
        if !frame.skin.contains(&true) {
            notes.push("No skin is in view: --skin names it, --look-at and --turn look elsewhere.".into());
        }
        notes
    }

    /// What the camera sees of a mode.
    fn picture(&self, gpu: &Gpu, mode: usize, shown: Shown, exposure: f32) -> RgbImage {
        let [width, height] = self.size;
        let pixels = self.renderer.compose(gpu, &self.modes[mode].view, shown, exposure);
        RgbImage::from_raw(width, height, pixels.into_flattened())
            .expect("the renderer gives a picture of its size")
    }

    /// Adds Eq. 7 over all of the mesh, each Gaussian divided by its mass, as a mode.
    fn add_eq7(&mut self, gpu: &Gpu, scene: &Scene, options: &Options, progress: &ProgressBar) {
        let visible = Probe::new(gpu, &self.renderer).visible(gpu, &self.renderer);
        let mut light = gpu.read(&self.renderer.gbuffer.irradiance);
        let ids = gpu.read_bytes(self.renderer.gbuffer.profile_id.texture());
        let skin: Vec<usize> = (0..ids.len()).filter(|i| ids[*i] == 1).collect();
        let patch = |i: &usize| {
            let irradiance = Vec4::from(light[*i]).truncate();
            Patch { point_mm: visible[*i].point_mm, area_mm2: 0.0, irradiance }
        };
        let asked: Vec<Patch> = skin.iter().map(patch).collect();
        let done = std::sync::Mutex::new(0.0);
        let tell = |share: f64| {
            if let Ok(mut done) = done.lock() {
                *done += share;
                progress.set_message(format!("Eq. 7 over the whole mesh: {:.0} %", 100.0 * *done));
            }
        };
        let since = Instant::now();
        let by = (&self.renderer, &self.camera);
        let truth = eq7(gpu, scene, by, options.mm_per_unit, &asked, &options.profile, 1.0, &tell);
        for (i, scattered) in skin.iter().zip(truth.normalised) {
            light[*i] = scattered.extend(light[*i][3]).to_array();
        }
        self.modes.push(Scattered {
            name: EQ7,
            title: "Eq. 7 over the whole mesh".into(),
            view: gpu.upload("Eq. 7", self.size, wgpu::TextureFormat::Rgba32Float, &light),
            runs: 0,
            ms: since.elapsed().as_secs_f64() * 1e3,
            atlas_ms: None,
        });
    }

    /// Fails only where the model has no UVs for it.
    fn texture_space(&self, gpu: &Gpu, options: &Options, most_runs: usize) -> Result<Scattered, Error> {
        let renderer = &self.renderer;
        let atlas = AtlasRenderer::new(gpu, renderer, options.texture_size)?;
        let output = renderer.scattered_target(gpu);
        let format = output.texture().format();
        let mut effect = OursUnrolled::new(&gpu.device, format, &[options.profile])?;
        let (mut raster, mut blur, mut both) = (Vec::new(), Vec::new(), Vec::new());
        let timed = Instant::now();
        while more_runs(both.len(), most_runs, timed) {
            let mut blur_ms = 0.0;
            let scatter = |atlas: &Atlas, to: &wgpu::TextureView| {
                let start = Instant::now();
                method::scatter_atlas(gpu, &mut effect, atlas, to)?;
                blur_ms += start.elapsed().as_secs_f64() * 1e3;
                Ok(())
            };
            let raster_ms = atlas.render(gpu, renderer, 1, options.mm_per_unit, &output, scatter)?;
            raster.push(raster_ms);
            blur.push(blur_ms);
            both.push(raster_ms + blur_ms);
        }
        Ok(Scattered {
            name: "texture_space",
            title: "texture space".into(),
            view: output,
            runs: both.len(),
            ms: metrics::median(&both),
            atlas_ms: Some([metrics::median(&raster), metrics::median(&blur)]),
        })
    }
}

/// As people write it: 1/255 for .00392.
fn fraction(error: f32) -> String {
    let parts = error.recip().round();
    match (error * parts - 1.0).abs() < 1e-3 && parts > 1.0 {
        true => format!("1/{parts}"),
        false => error.to_string(),
    }
}

fn more_runs(done: usize, most: usize, since: Instant) -> bool {
    done == 0 || (done < most && since.elapsed().as_secs_f64() < TIMED_SECONDS)
}

/// What the measures need of the G-buffer.
struct Skin {
    skin: Vec<bool>,
    /// Surface area that a pixel shows, up to a common factor.
    area: Vec<f64>,
    albedo: Vec<Vec3>,
}

impl Skin {
    fn read(gpu: &Gpu, shot: &Shot) -> Self {
        let g = &shot.renderer.gbuffer;
        let skin: Vec<bool> = gpu
            .read_bytes(g.profile_id.texture())
            .iter()
            .map(|id| *id == 1) // the one profile
            .collect();
        let depth: Vec<f32> = bytemuck::pod_collect_to_vec(&gpu.read_bytes(g.depth.texture()));
        let projection = shot.camera.projection(shot.size);
        let inverse = projection.as_dmat4().inverse().as_mat4();
        let area = depth
            .iter()
            .zip(gpu.read(&g.normal))
            .enumerate()
            .map(|(i, (depth, normal))| area(i, *depth, normal, inverse, shot.size))
            .collect();
        let albedo = gpu.read(&g.albedo).iter().map(|p| Vec4::from(*p).truncate()).collect();
        Self { skin, area, albedo }
    }

    /// Light that leaves the skin, by what its albedo leaves of the light in it.
    fn radiance(&self, irradiance: &Layer) -> Layer {
        let lit = irradiance.pixels.iter().zip(&self.albedo);
        Layer { pixels: lit.map(|(e, a)| (Vec3::from(*e) * *a).to_array()).collect(), ..*irradiance }
    }

    /// The light on all of the skin in view.
    fn energy(&self, irradiance: &Layer) -> f64 {
        let pixels = irradiance.pixels.iter().zip(&self.area).zip(&self.skin);
        let skin = pixels.filter(|(_, skin)| **skin);
        skin.map(|((e, area), _)| f64::from(e.iter().sum::<f32>()) * area).sum()
    }
}

/// z³/|n·p| of a pinhole camera (numerator and denominator in view space). Interpolated normals
/// lean away at silhouettes, where this has no bound: there a pixel counts for ten.
fn area(i: usize, depth: f32, normal: [f32; 4], inverse: Mat4, size: [u32; 2]) -> f64 {
    if depth == 0.0 {
        return 0.0;
    }
    let pixel = [i as u32 % size[0], i as u32 / size[0]];
    let uv = [0, 1].map(|k| (pixel[k] as f32 + 0.5) / size[k] as f32);
    let p = inverse.project_point3(Vec3::new(2.0 * uv[0] - 1.0, 1.0 - 2.0 * uv[1], depth));
    let facing = (Vec4::from(normal).truncate().dot(p) / p.length()).abs();
    f64::from(p.z.abs().powi(3) / (facing.max(0.1) * p.length()))
}

struct Measured {
    reports: Vec<ModeReport>,
    /// Name of the mode, scattered irradiance.
    layers: Vec<(&'static str, Layer)>,
}

/// Where two layers differ by more than 0.01.
fn changed(a: &Layer, b: &Layer, mask: &[bool]) -> Vec<bool> {
    let apart = |(a, b): (&[f32; 3], &[f32; 3])| (Vec3::from(*a) - Vec3::from(*b)).abs().max_element();
    let apart = a.pixels.iter().zip(&b.pixels).map(apart);
    apart.zip(mask).map(|(apart, inside)| *inside && apart > 0.01).collect()
}

fn measure(gpu: &Gpu, shot: &Shot, fine: Option<&Shot>, frame: &Skin, exposure: f32) -> Measured {
    let [width, height] = shot.size;
    let modes = &shot.modes;
    let light = |m: &Scattered| {
        let pixels = gpu.read(&m.view).iter().map(|p| [p[0], p[1], p[2]]).collect();
        Layer { width, height, pixels }
    };
    let irradiance: Vec<Layer> = modes.iter().map(light).collect();
    let radiance: Vec<Layer> = irradiance.iter().map(|e| frame.radiance(e)).collect();
    let smooth = |i, shown| match fine {
        Some(fine) => srgb::halved(&fine.picture(gpu, i, shown, exposure)),
        None => shot.picture(gpu, i, shown, exposure),
    };
    let pictures: Vec<_> =
        (0..modes.len()).map(|i| shot.picture(gpu, i, Shown::Picture, exposure)).collect();

    // The rim of a silhouette is left out: there a pixel's E is as much of the edge as of the skin.
    let inner = metrics::erode(&frame.skin, width, height, 2);
    let reference = modes.iter().position(|m| m.name == "texture_space");
    let truth = modes.iter().position(|m| m.name == EQ7);
    let scattered = reference.map(|r| changed(&irradiance[r], &irradiance[0], &inner));
    // A measure of two layers, of a mode and of what it is held to, where that is there.
    type Of = fn(&Layer, &Layer, &[bool]) -> Option<f64>;
    let to = |layers: &[Layer], i: usize, other: Option<usize>, mask: &[bool], of: Of| {
        other.and_then(|other| of(&layers[i], &layers[other], mask))
    };
    let rmse = metrics::relative_rmse;
    let mut reports = Vec::new();
    for (i, mode) in modes.iter().enumerate() {
        let flip = reference.map(|r| metrics::flip_mean(&pictures[i], &pictures[r], &inner));
        let energy = frame.energy(&irradiance[i]) / frame.energy(&irradiance[0]);
        reports.push(ModeReport {
            name: mode.name,
            title: mode.title.clone(),
            ms: mode.ms,
            ms_raster: mode.atlas_ms.map(|[raster, _]| raster),
            ms_blur: mode.atlas_ms.map(|[_, blur]| blur),
            rel_rmse: to(&irradiance, i, reference, &inner, rmse),
            rel_rmse_scattered: scattered
                .as_ref()
                .and_then(|mask| to(&irradiance, i, reference, mask, rmse)),
            rel_rmse_eq7: to(&irradiance, i, truth, &inner, rmse),
            max_error: to(&irradiance, i, reference, &inner, metrics::max_error),
            delta_e2000_p99: to(&radiance, i, reference, &inner, |a, b, mask| {
                metrics::delta_e2000_percentile(a, b, mask, 0.99)
            }),
            flip_mean: flip.as_ref().and_then(|(mean, _)| *mean),
            energy_ratio: Some(energy).filter(|ratio| ratio.is_finite()),
            picture: smooth(i, Shown::Picture),
            diffuse: smooth(i, Shown::Diffuse),
            difference: reference
                .map(|r| metrics::difference(&irradiance[i], &irradiance[r], DIFFERENCE_GAIN)),
            flip: flip.map(|(_, heat)| heat),
        });
    }
    let names = modes.iter().map(|m| m.name);
    Measured { reports, layers: names.zip(irradiance).collect() }
}

fn write(out: &Path, report: &Report, layers: &[(&'static str, Layer)]) -> Result<(), Error> {
    let files = files(report, layers)
        .map_err(|e| Error::new("report", format!("\"{e}\""), "pictures that can be encoded"))?;
    output::write(out, &files)
        .map_err(|e| Error::new("--out", format!("\"{e}\""), "a directory that can be written to"))
}

fn files(report: &Report, layers: &[(&'static str, Layer)]) -> image::ImageResult<Vec<(String, Vec<u8>)>> {
    let mut files = Vec::new();
    for mode in &report.modes {
        let pictures = [
            ("picture", Some(&mode.picture)),
            ("diffuse", Some(&mode.diffuse)),
            ("difference", mode.difference.as_ref()),
            ("flip", mode.flip.as_ref()),
        ];
        for (what, picture) in pictures {
            if let Some(picture) = picture {
                files.push((format!("{}_{what}.png", mode.name), output::png(picture)?));
            }
        }
    }
    for (name, layer) in layers {
        files.push((format!("{name}_diffuse.exr"), report::exr(layer)?));
    }
    files.push(("report.json".into(), report::json(report).into_bytes()));
    files.push(("report.html".into(), report::html(report)?.into_bytes()));
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rivals;

    /// Names of modes with their relative RMSE to Eq. 7 over the whole mesh: over skin without its rim, and over
    /// that part of it which the layer behind scatters to.
    fn to_eq7(view: View, size: [u32; 2], lighting: Lighting) -> Vec<(&'static str, [f64; 2])> {
        let gpu = Gpu::headless().unwrap();
        let scene = Scene::from_glb(crate::HEAD).unwrap();
        // An ear fills the frame: else pores that fall between pixels are most of the error.
        let look_at = (view == View::Ear).then_some(Vec3::new(-0.0733, -0.0108, -0.0127));
        let options = Options {
            size,
            view,
            look_at,
            distance_mm: Some(150.0),
            lighting,
            has_back: true,
            texture_size: 64,
            ..Default::default()
        };
        let mut shot = Shot::new(&gpu, &scene, &options, size, 1).unwrap();
        let format = shot.renderer.scattered_target(&gpu).texture().format();
        for (name, _, mut method) in rivals::transmission(&gpu.device, format, &options.profile) {
            let frame = shot.frame(&options);
            let mode = shot.scattered(&gpu, name, name.into(), &mut *method, &frame, 1).unwrap();
            shot.modes.push(mode);
        }
        shot.add_eq7(&gpu, &scene, &options, &ProgressBar::hidden());
        let frame = Skin::read(&gpu, &shot);
        let layers = measure(&gpu, &shot, None, &frame, 1.0).layers;
        let layer = |name| &layers.iter().find(|(mode, _)| *mode == name).unwrap().1;
        let inner = metrics::erode(&frame.skin, size[0], size[1], 2);
        let pairs = layer("screen_space").pixels.iter().zip(&layer("screen_space_back").pixels);
        let reached: Vec<bool> = inner.iter().zip(pairs).map(|(inner, (a, b))| *inner && a != b).collect();
        let error = |of, mask| metrics::relative_rmse(of, layer(EQ7), mask).unwrap();
        let errors: Vec<_> = layers
            .iter()
            .map(|(name, of)| (*name, [&inner, &reached].map(|mask| error(of, mask))))
            .collect();
        println!("{view:?}, to Eq. 7 over skin, and where the layer behind reaches: {errors:.4?}");
        errors
    }

    #[test]
    fn two_layers_are_nearer_to_eq_7_where_light_comes_through_and_as_near_elsewhere() {
        // By size what is left is of rims, and of pores that fall between pixels.
        let from_behind = (View::Ear, [160, 256], Lighting::behind(), [0.6; 2]);
        let from_the_front = (View::Front, [112; 2], Lighting::default(), [1.0; 2]);
        for (view, size, lighting, at_most) in [from_the_front, from_behind] {
            let errors = to_eq7(view, size, lighting);
            let of = |name: &str| errors.iter().find(|(mode, _)| *mode == name).unwrap().1;
            for mode in ["screen_space", "screen_planned"] {
                let (visible, both) = (of(mode), of(&format!("{mode}_back")));
                for i in [0, 1] {
                    assert!(
                        both[i] <= at_most[i] * visible[i],
                        "{view:?}: {mode} {visible:?}, two layers {both:?}"
                    );
                }
            }
        }
    }
}
