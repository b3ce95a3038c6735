//! Models of surface reflection side by side: lobes, spheres, directional albedo, and what each costs.
//!
//! ```sh
//! cargo run --release --example specular
//! ```

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::OnceLock;
use std::time::Instant;

use glam::Vec3;
use image::RgbImage;
use image::imageops::overlay;
use serde_json::json;
use subsurface::Plan;
use subsurface::wgpu::TextureFormat;

use crate::chart::plot::panel::{DIM, LEGEND, SMALL, TITLE};
use crate::cli::{self, Arguments};
use crate::method::{self, Ours};
use crate::renderer::{BrdfTables, Camera, Environment, Gpu, Layer, Lighting, Renderer, Scene, Specular};
use crate::svg::{Point, Rasteriser, Stroke, Svg, Type};
use crate::{Error, model, output};

const HELP: &str = "\
Draws the models of surface reflection side by side, says what they reflect in all, and times them.

Usage: cargo run --release --example specular -- [OPTIONS]

  --slope X    RMS slope m of the facets, .05 to 1    [0.3]
  --out DIR    where specular.png goes                [out/specular]
";

/// Cosines of the angle to the normal, at which directional albedo is said.
const COSINES: [f64; 5] = [1.0, 0.7, 0.4, 0.2, 0.1];
/// Times that a table is timed.
const RUNS: usize = 20;
/// Of the drawing, whose pixels are twice as many; of its spheres.
const WIDTH: f64 = 960.0;
const SPHERE: u32 = 368;
/// Of skin.
const F0: f32 = 0.028;

pub fn main() -> ExitCode {
    cli::main(HELP, options, |(slope, out)| compare(slope, &out))
}

/// The slope and where to write to.
fn options(arguments: &mut Arguments) -> Result<(f32, PathBuf), Error> {
    let (mut slope, mut out) = (0.3, PathBuf::from("out/specular"));
    while let Some(name) = arguments.next_word()? {
        match name.as_str() {
            "--slope" => slope = arguments.number("0.05 to 1", |x| (0.05..=1.0).contains(x))?,
            "--out" => out = arguments.value()?.into(),
            _ => return Err(arguments.unknown()),
        }
    }
    Ok((slope, out))
}

/// What is known of a model.
struct Measured {
    model: Specular,
    /// f·cos θᵢ·cos θₒ, by angle, of light from each of three.
    lobes: Vec<Vec<f32>>,
    /// At F₀ = 1, and at skin's.
    albedo: [[f64; COSINES.len()]; 2],
    /// The largest at F₀ = 1, of any slope and from anywhere.
    most: f64,
    ns: f64,
    sphere: RgbImage,
}

fn compare(slope: f32, out: &std::path::Path) -> Result<(), Error> {
    let gpu = Gpu::headless()?;
    let tables = BrdfTables::new(&gpu);
    let spheres = Spheres::new(&gpu, slope)?;
    let measured = Specular::ALL
        .into_iter()
        .map(|model| Measured::new(&gpu, &tables, &spheres, model, slope))
        .collect::<Result<Vec<_>, _>>()?;
    let table = table(&measured, slope, &gpu);
    let png = output::png(&picture(&measured, slope)?)
        .map_err(|e| Error::new("specular.png", format!("\"{e}\""), "a picture that can be encoded"))?;
    let files = [("specular.txt".into(), table.clone().into_bytes()), ("specular.png".into(), png)];
    output::write(out, &files)
        .map_err(|e| Error::new("--out", format!("\"{e}\""), "a directory that can be written to"))?;
    print!("{table}");
    println!("{}", out.join("specular.png").display());
    Ok(())
}

impl Measured {
    fn new(
        gpu: &Gpu,
        tables: &BrdfTables,
        spheres: &Spheres,
        model: Specular,
        slope: f32,
    ) -> Result<Self, Error> {
        let target = |size| gpu.target("table", size, TextureFormat::Rgba16Float);
        let lobes = target(BrdfTables::LOBES_SIZE);
        tables.draw_lobes(gpu, model, slope, F0, &lobes);
        let lobes: Vec<f32> = gpu.read(&lobes).iter().map(|p| p[0]).collect();
        let albedo = target(BrdfTables::ALBEDO_SIZE);
        tables.draw_albedo(gpu, model, &albedo); // compiles
        let before = busy();
        for _ in 0..RUNS {
            tables.draw_albedo(gpu, model, &albedo);
        }
        let seconds = busy() - before;
        let texels = gpu.read(&albedo);
        let [width, height] = BrdfTables::ALBEDO_SIZE.map(|s| s as usize);
        // Between the rows, and the columns, that are nearest.
        let near = |at: f64, count: usize| {
            let at = (at * count as f64 - 0.5).clamp(0.0, (count - 1) as f64);
            (at as usize, (at as usize + 1).min(count - 1), at.fract())
        };
        let (above, below, down) = near(slope.into(), height);
        let at = |cos: f64, f0: f64| {
            let (left, right, across) = near(cos, width);
            let reflected = |x: usize, y: usize| {
                let [a, b, ..] = texels[y * width + x].map(f64::from);
                f0 * a + b
            };
            let row = |y: usize| reflected(left, y) * (1.0 - across) + reflected(right, y) * across;
            row(above) * (1.0 - down) + row(below) * down
        };
        // The printed model has no Fresnel term.
        let f0 = |f0: f32| if model == Specular::Printed { 1.0 } else { f64::from(f0) };
        Ok(Self {
            model,
            lobes: lobes.chunks(BrdfTables::LOBES_SIZE[0] as usize).map(<[f32]>::to_vec).collect(),
            albedo: [f0(1.0), f0(F0)].map(|f0| COSINES.map(|cos| at(cos, f0))),
            most: texels.iter().map(|t| f64::from(t[0] + t[1])).fold(0.0, f64::max),
            ns: 1e9 * seconds / (RUNS as u64 * BrdfTables::evaluations()) as f64,
            sphere: spheres.picture(gpu, model)?,
        })
    }
}

/// Seconds that this program has kept processors busy, which a software driver's work is, and what else runs
/// beside it is not; where the system does not say, the time since the first call.
fn busy() -> f64 {
    static START: OnceLock<Instant> = OnceLock::new();
    let since = START.get_or_init(Instant::now).elapsed().as_secs_f64();
    // User and system time, in hundredths of a second: fields 14 and 15, behind a name in brackets.
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    let ticks: Vec<f64> = fields.skip(11).take(2).filter_map(|field| field.parse().ok()).collect();
    if let [user, system] = ticks[..] { (user + system) / 100.0 } else { since }
}

/// A ball of skin in a studio.
struct Spheres {
    renderer: Renderer,
    camera: Camera,
    lighting: Lighting,
    plan: Plan,
}

impl Spheres {
    fn new(gpu: &Gpu, slope: f32) -> Result<Self, Error> {
        let scene = Scene::from_glb(&ball())?;
        let mut renderer = Renderer::new(gpu, &scene, [SPHERE; 2])?;
        let studio = Environment::studio();
        renderer.set_environment(gpu, &studio);
        let mut lighting = Lighting { slope, intensity: 1.0, f0: F0, ..Default::default() };
        studio.light(&mut lighting, 0.0);
        let camera = Camera { eye: Vec3::new(0.0, 0.0, 0.35), target: Vec3::ZERO, fov_y: 0.31 };
        Ok(Self { renderer, camera, lighting, plan: Plan::skin() })
    }

    fn picture(&self, gpu: &Gpu, model: Specular) -> Result<RgbImage, Error> {
        let lighting = Lighting { specular: model, ..self.lighting.clone() };
        self.renderer.render(gpu, &self.camera, &lighting, 1000.0)?;
        let output = self.renderer.scattered_target(gpu);
        let frame = self.renderer.gbuffer.frame(self.camera.projection([SPHERE; 2]), 1000.0);
        let mut ours = Ours::new(&gpu.device, output.texture().format(), &self.plan)?;
        method::scatter(gpu, &mut ours, &frame, &output)?;
        let pixels = self.renderer.compose(gpu, &output, Layer::Picture, 1.0);
        let picture = RgbImage::from_raw(SPHERE, SPHERE, pixels.into_flattened());
        picture.ok_or_else(|| Error::new("sphere", "another size", "a picture of its size"))
    }
}

/// A ball of 100 mm, as a glTF file.
fn ball() -> Vec<u8> {
    const RINGS: u32 = 96;
    const SECTORS: u32 = 192;
    let (mut normals, mut indices) = (Vec::new(), Vec::new());
    for ring in 0..=RINGS {
        for sector in 0..=SECTORS {
            let theta = std::f32::consts::PI * ring as f32 / RINGS as f32;
            let phi = std::f32::consts::TAU * sector as f32 / SECTORS as f32;
            normals.push([theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos()]);
            if ring < RINGS && sector < SECTORS {
                let [a, b] = [ring, ring + 1].map(|r| r * (SECTORS + 1) + sector);
                indices.extend([a, b, a + 1, a + 1, b, b + 1]);
            }
        }
    }
    let positions: Vec<[f32; 3]> = normals.iter().map(|n| n.map(|x| 0.05 * x)).collect();
    let parts: [&[u8]; 3] =
        [bytemuck::cast_slice(&positions), bytemuck::cast_slice(&normals), bytemuck::cast_slice(&indices)];
    let [p, n, i] = parts.map(<[u8]>::len);
    let count = normals.len();
    let json = json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"name": "ball", "primitives": [
            {"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "material": 0}
        ]}],
        "materials": [{"name": "skin", "pbrMetallicRoughness": {"baseColorFactor": [0.42, 0.24, 0.18, 1.0]}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": count,
             "min": [-0.05, -0.05, -0.05], "max": [0.05, 0.05, 0.05]},
            {"bufferView": 1, "componentType": 5126, "type": "VEC3", "count": count},
            {"bufferView": 2, "componentType": 5125, "type": "SCALAR", "count": indices.len()},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": p},
            {"buffer": 0, "byteOffset": p, "byteLength": n},
            {"buffer": 0, "byteOffset": p + n, "byteLength": i},
        ],
        "buffers": [{"byteLength": p + n + i}],
    });
    model::glb(json.to_string().as_bytes(), &parts.concat())
}

fn table(measured: &[Measured], slope: f32, gpu: &Gpu) -> String {
    let mut text = String::new();
    let say = |text: &mut String| {
        writeln!(text, "directional albedo at m = {slope}, by the cosine to the normal; {}", gpu.adapter)?;
        write!(text, "{:14}", "")?;
        for f in ["F = 1", "skin"] {
            write!(text, "  |")?;
            for cos in COSINES {
                write!(text, "{:>7}", format!("{cos} {}", if cos == 1.0 { f } else { "" }).trim_end())?;
            }
        }
        writeln!(text, "  | most, F = 1 | ns")?;
        for m in measured {
            write!(text, "{:14}", m.model.name())?;
            for albedo in &m.albedo {
                write!(text, "  |")?;
                for value in albedo {
                    write!(text, "{value:7.3}")?;
                }
            }
            writeln!(text, "  | {:11.3} | {:.2}", m.most, m.ns)?;
        }
        Ok::<_, std::fmt::Error>(())
    };
    say(&mut text).expect("a String takes all text");
    text
}

fn picture(measured: &[Measured], slope: f32) -> Result<RgbImage, Error> {
    const COLORS: [&str; 3] = ["#0072b2", "#009e73", "#d55e00"];
    let column = (WIDTH - 40.0) / measured.len() as f64;
    let mut svg = Svg::default();
    svg.text([20.0, 34.0], "Models of surface reflection", TITLE);
    let about = format!(
        "Flux of skin's facets, f times both cosines, m = {slope}; light from 0° (blue), 30° (green) and 60° (red) on \
         the left; each lobe to its largest."
    );
    svg.text([20.0, 55.0], &about, Type::new(DIM, 13.0));
    let spheres_top = 218.0;
    for (i, m) in measured.iter().enumerate() {
        let left = 20.0 + column * i as f64;
        let (middle, floor, reach) = (left + 0.5 * column, 178.0, 0.42 * column);
        svg.text([middle, 88.0], m.model.name(), LEGEND.anchored("middle"));
        svg.line(&[[middle - reach, floor], [middle + reach, floor]], Stroke::new("#999", 1.0));
        let largest = m.lobes.iter().map(|lobe| lobe.iter().fold(0.0, |most: f32, f| most.max(*f)));
        let largest: Vec<f32> = largest.collect();
        for ((lobe, largest), color) in m.lobes.iter().zip(&largest).zip(COLORS) {
            let count = lobe.len() as f64;
            let point = |(i, f): (usize, &f32)| -> Point {
                let angle = ((i as f64 + 0.5) / count - 0.5) * std::f64::consts::PI;
                let far = reach * f64::from(f / largest);
                [middle + far * angle.sin(), floor - far * angle.cos()]
            };
            svg.line(&lobe.iter().enumerate().map(point).collect::<Vec<_>>(), Stroke::new(color, 1.6));
        }
        let largest = largest.iter().map(|f| format!("{f:.3}")).collect::<Vec<_>>().join(", ");
        svg.text([middle, floor + 18.0], &format!("largest {largest}"), SMALL.anchored("middle"));
        let albedo = &m.albedo;
        for (line, text) in [
            format!("albedo at F = 1: {:.2} … {:.2}", albedo[0][0], albedo[0][COSINES.len() - 1]),
            format!("of skin: {:.3} … {:.3}", albedo[1][0], albedo[1][COSINES.len() - 1]),
        ]
        .iter()
        .enumerate()
        {
            let y = spheres_top + 0.5 * f64::from(SPHERE) + 18.0 + 16.0 * line as f64;
            svg.text([middle, y], text, SMALL.anchored("middle"));
        }
    }
    let height = spheres_top + 0.5 * f64::from(SPHERE) + 64.0;
    let caption = "A ball of 100 mm of skin in the studio, scattered by a plan. Albedo from straight above … at \
                   a cosine of 0.1.";
    svg.text([20.0, height - 10.0], caption, SMALL);
    let drawing = svg.finish(WIDTH, height, "Models of surface reflection");
    let refused =
        |e: Box<dyn std::error::Error>| Error::new("specular.png", format!("\"{e}\""), "a drawing");
    let mut picture = Rasteriser::new().picture(&drawing).map_err(refused)?;
    for (i, m) in measured.iter().enumerate() {
        let left = 2.0 * (20.0 + column * i as f64) + (2.0 * column - f64::from(SPHERE)) / 2.0;
        overlay(&mut picture, &m.sphere, left as i64, (2.0 * spheres_top) as i64);
    }
    Ok(picture)
}
