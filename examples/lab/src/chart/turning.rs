//! A studio that turns around a head: the light of each frame is another, as Yang & Wang 2013 have it, whose
//! multi-layered rendering is what Li & Shao compare with.

use std::f32::consts::TAU;
use std::time::Instant;

use glam::Vec3;
use subsurface::Profile;
use subsurface::wgpu::TextureView;

use crate::Error;
use crate::chart::heads::time_atlas;
use crate::chart::options::Plan;
use crate::chart::scene::{Scene, Surface, rgb};
use crate::method::{self, AtlasMethod, ScreenMethod};
use crate::metrics;
use crate::renderer::{AtlasRenderer, Camera, Environment, Gpu, Lighting, Scene as Model, View};
use crate::truth::{Pixel, visible_integral};

/// Frames of a whole turn, and how many of them an atlas is drawn for.
pub const FRAMES: usize = 100;
const ATLAS_FRAMES: usize = 5;

/// Who is compared.
pub enum Method<'a> {
    Screen(&'a mut dyn ScreenMethod),
    /// And the side of its atlas.
    Atlas(&'a mut dyn AtlasMethod, u32),
}

/// Of one method.
#[derive(Default)]
pub struct Turned {
    /// Relative RMSE to the visible integral of the frame's own light.
    pub errors: Vec<f64>,
    /// The same once that light rests: of screen methods, which might keep something of frames before.
    pub at_rest: Vec<f64>,
    /// Median.
    pub ms: f64,
}

impl Turned {
    /// Over all frames.
    pub fn rms(&self) -> f64 {
        (self.errors.iter().map(|e| e * e).sum::<f64>() / self.errors.len() as f64).sqrt()
    }

    /// The least, the median and the worst.
    pub fn spread(&self) -> [f64; 3] {
        let errors = || self.errors.iter().copied();
        [
            errors().fold(f64::INFINITY, f64::min),
            metrics::median(&self.errors),
            errors().fold(0.0, f64::max),
        ]
    }

    /// How many times as much as at rest a frame is off while the light turns, at most; none, of atlases.
    pub fn by_turning(&self) -> Option<f64> {
        let times = self.errors.iter().zip(&self.at_rest).map(|(turning, rest)| turning / rest);
        times.reduce(f64::max)
    }
}

/// The scene as it was in the first frame, no scattering, and what became of each method.
///
/// # Errors
/// What the methods refuse; a model without skin in view.
pub fn figure(
    gpu: &Gpu,
    model: &Model,
    mm_per_unit: f32,
    plan: &Plan,
    methods: &mut [Method],
    mut step: impl FnMut(),
) -> Result<(Scene, Turned, Vec<Turned>), Error> {
    let studio = Environment::studio();
    let mut lighting = Lighting::default();
    let scene = scene(gpu, model, mm_per_unit, plan, &studio)?;
    let asked = Asked::of(&scene);
    let Surface::Head(head) = &scene.surface else {
        return Err(Error::new("turning", "a surface known on paper", "a head"));
    };

    let output = head.renderer.scattered_target(gpu);
    let mut fallen = Vec::new();
    let mut turned: Vec<_> = methods.iter().map(|_| Turned::default()).collect();
    let mut times = vec![Vec::new(); methods.len()];
    let mut atlases = Vec::new();
    for method in methods.iter() {
        atlases.push(match method {
            Method::Screen(_) => None,
            Method::Atlas(_, side) => Some(AtlasRenderer::new(gpu, &head.renderer, *side)?),
        });
    }
    for frame in 0..FRAMES {
        studio.light(&mut lighting, TAU * frame as f32 / FRAMES as f32);
        head.renderer.render(gpu, &head.camera, &lighting, mm_per_unit)?;
        let light = read(gpu, &head.renderer.gbuffer.irradiance);
        let truth = asked.truth(&scene, &light);
        let error = |result: &[Vec3]| asked.error(result, &truth);
        fallen.push(error(&light));
        for (i, method) in methods.iter_mut().enumerate() {
            let ms = match (&mut *method, &atlases[i]) {
                (Method::Screen(method), _) => {
                    let start = Instant::now();
                    method::scatter(gpu, &mut **method, &scene.frame(), &output)?;
                    start.elapsed().as_secs_f64() * 1e3
                }
                (Method::Atlas(method, _), Some(atlas)) if frame % (FRAMES / ATLAS_FRAMES) == 0 => {
                    time_atlas(gpu, atlas, &head.renderer, &mut **method, mm_per_unit, &output)?
                }
                _ => continue,
            };
            turned[i].errors.push(error(&read(gpu, &output)));
            times[i].push(ms);
            if let Method::Screen(method) = method {
                method::scatter(gpu, &mut **method, &scene.frame(), &output)?;
                turned[i].at_rest.push(error(&read(gpu, &output)));
            }
        }
        step();
    }
    turned.iter_mut().zip(times).for_each(|(turned, times)| turned.ms = metrics::median(&times));
    Ok((scene, Turned { errors: fallen, ms: f64::NAN, ..Turned::default() }, turned))
}

/// The head in a studio, smaller than that of the other charts.
fn scene(
    gpu: &Gpu,
    model: &Model,
    mm_per_unit: f32,
    plan: &Plan,
    studio: &Environment,
) -> Result<Scene, Error> {
    let size = plan.size.map(|s| s / 2);
    let camera = Camera::framing(model, View::Front, size);
    let mut scene = Scene::head(gpu, model, mm_per_unit, "turning", size, camera)?;
    scene.stride = 2 * plan.stride;
    if let Surface::Head(head) = &mut scene.surface {
        head.renderer.set_environment(gpu, studio);
    }
    Ok(scene)
}

/// Pixels that the truth is asked for: skin less its rim.
struct Asked {
    skin: Vec<usize>,
    pixels: Vec<usize>,
    /// Where they are among those of skin.
    places: Vec<usize>,
}

impl Asked {
    fn of(scene: &Scene) -> Self {
        let inner = metrics::erode(&scene.skin, scene.size[0], scene.size[1], 1);
        let mut among = vec![usize::MAX; scene.skin.len()];
        let skin: Vec<usize> = (0..scene.skin.len()).filter(|i| scene.skin[*i]).collect();
        skin.iter().enumerate().for_each(|(place, i)| among[*i] = place);
        let all: Vec<usize> = (0..scene.skin.len()).collect();
        let pixels: Vec<usize> = scene.asked(&all).into_iter().filter(|i| inner[*i]).collect();
        let places = pixels.iter().map(|i| among[*i]).collect();
        Self { skin, pixels, places }
    }

    /// The visible integral of this light.
    fn truth(&self, scene: &Scene, light: &[Vec3]) -> Vec<Vec3> {
        let lit = |(pixel, i): (&Pixel, &usize)| {
            let mut pixel = *pixel;
            pixel.patch.irradiance = light[*i];
            pixel
        };
        let pixels: Vec<Pixel> = scene.pixels.iter().zip(&self.skin).map(lit).collect();
        visible_integral(&pixels, &self.places, &Profile::SKIN, &|_| ())
    }

    /// Relative RMSE.
    fn error(&self, result: &[Vec3], truth: &[Vec3]) -> f64 {
        let [mut off, mut all] = [0.0; 2];
        for (i, truth) in self.pixels.iter().zip(truth) {
            off += f64::from((result[*i] - *truth).length_squared());
            all += f64::from(truth.length_squared());
        }
        (off / all).sqrt()
    }
}

fn read(gpu: &Gpu, texture: &TextureView) -> Vec<Vec3> {
    gpu.read(texture).into_iter().map(rgb).collect()
}
