//! Li & Shao's Fig. 8: frames a second against the number of heads.

use std::time::Instant;

use crate::Error;
use subsurface::wgpu::TextureView;

use crate::chart::clock::Clock;
use crate::chart::options::Plan;
use crate::chart::plot::Series;
use crate::chart::scene::{Scene, Surface};
use crate::method::{AtlasMethod, ScreenMethod};
use crate::metrics;
use crate::renderer::{AtlasRenderer, Camera, Gpu, Renderer, Scene as Model, View};

/// Numbers of heads, and the columns in which they stand.
pub const HEADS: [(usize, usize); 5] = [(1, 1), (2, 2), (4, 2), (8, 4), (16, 4)];

/// What the figure compares: a method over an atlas of a size, how many heads it is timed at.
pub struct Textured<'a> {
    pub name: String,
    pub method: &'a mut dyn AtlasMethod,
    pub size: u32,
    pub measured: usize,
}

/// Frames a second of the scattering alone; in texture space with the drawing and lighting of the
/// atlas, which it cannot do without. The frame keeps its pixels, and heads shrink as they become
/// more, so that skin keeps its pixels, too; the figures of that are in the notes.
///
/// # Errors
/// What the methods refuse.
#[allow(clippy::too_many_arguments, reason = "each is a thing of its own")]
pub fn figure(
    gpu: &Gpu,
    model: &Model,
    clock: &Clock,
    mm_per_unit: f32,
    plan: &Plan,
    mut screen: Option<&mut dyn ScreenMethod>,
    textured: &mut [Textured],
    mut step: impl FnMut(&str),
) -> Result<(Vec<Series>, Vec<String>), Error> {
    let mut skin = Vec::new();
    let mut on_screen = Vec::new();
    let mut in_texture = vec![Vec::<(f64, f64)>::new(); textured.len()];
    for (i, (heads, columns)) in HEADS.into_iter().enumerate() {
        step(&format!("{heads} heads"));
        let scene = crowd(gpu, model, mm_per_unit, plan.size, heads, columns)?;
        let Surface::Head(head) = &scene.surface else {
            continue;
        };
        skin.push(scene.pixels.len().to_string());
        let output = head.renderer.scattered_target(gpu);
        if let Some(screen) = &mut screen {
            screen.prepare(&gpu.device, &gpu.queue, &scene.frame())?;
            let repeats = clock.repeats(gpu, &**screen, &output)?;
            let ms = median_ms(plan, || clock.ms(gpu, &**screen, &output, repeats))?;
            on_screen.push((heads as f64, 1e3 / ms));
        }
        for (t, points) in textured.iter_mut().zip(&mut in_texture) {
            if i >= t.measured {
                // Each head has an atlas of its own.
                let (first, fps) = points[0];
                points.push((heads as f64, fps * first / heads as f64));
                continue;
            }
            let atlas = AtlasRenderer::new(gpu, &head.renderer, t.size)?;
            let ms = median_ms(plan, || {
                time_atlas(gpu, &atlas, &head.renderer, t.method, mm_per_unit, &output)
            })?;
            points.push((heads as f64, 1e3 / ms));
        }
    }
    let mut series = Vec::new();
    if screen.is_some() {
        series.push(Series { name: "screen_exact".into(), points: on_screen, extrapolated_from: None });
    }
    for (t, points) in textured.iter().zip(in_texture) {
        series.push(Series {
            name: t.name.clone(),
            extrapolated_from: (t.measured < points.len()).then_some(t.measured),
            points,
        });
    }
    let heads = HEADS.map(|(heads, _)| heads.to_string()).join(", ");
    let note = format!("Pixels of skin at {heads} heads: {}.", skin.join(", "));
    Ok((series, vec![note]))
}

/// Milliseconds that an atlas method takes, from drawing and lighting the atlas to done.
///
/// # Errors
/// What the method or the renderer refuses.
pub fn time_atlas(
    gpu: &Gpu,
    atlas: &AtlasRenderer,
    renderer: &Renderer,
    method: &mut dyn AtlasMethod,
    mm_per_unit: f32,
    output: &TextureView,
) -> Result<f64, Error> {
    let mut blur_ms = 0.0;
    let raster_ms = atlas.render(gpu, renderer, 1, mm_per_unit, output, |atlas, to| {
        method.prepare(&gpu.device, &gpu.queue, atlas)?;
        let start = Instant::now();
        gpu.run(|encoder| method.render(encoder, to))?;
        blur_ms += start.elapsed().as_secs_f64() * 1e3;
        Ok(())
    })?;
    Ok(raster_ms + blur_ms)
}

/// Of as many runs as there is time for, after one that warms up.
fn median_ms(plan: &Plan, mut run: impl FnMut() -> Result<f64, Error>) -> Result<f64, Error> {
    run()?;
    let since = Instant::now();
    let mut times = Vec::new();
    while times.is_empty()
        || times.len() < plan.atlas_runs && since.elapsed().as_secs_f64() < plan.atlas_seconds
    {
        times.push(run()?);
    }
    Ok(metrics::median(&times))
}

/// Heads in rows and columns, across a frame of as many pixels as `size` has.
fn crowd(
    gpu: &Gpu,
    model: &Model,
    mm_per_unit: f32,
    size: [u32; 2],
    heads: usize,
    columns: usize,
) -> Result<Scene, Error> {
    let rows = heads / columns;
    let wide = (columns as f64 / rows as f64).sqrt();
    let size = [(f64::from(size[0]) * wide).round() as u32, (f64::from(size[1]) / wide).round() as u32];
    let one = Camera::framing(model, View::Front, [size[1], size[1]]);
    let back = one.eye - one.target;
    // What a frame of one head shows, from edge to edge.
    let cell = 2.0 * back.length() * (one.fov_y / 2.0).tan();
    let mut crowd = model.clone();
    crowd.primitives.clear();
    for i in 0..heads {
        let at = |i: usize, of: usize| (i as f32 - (of - 1) as f32 / 2.0) * cell;
        let shift = [at(i % columns, columns), at(i / columns, rows), 0.0];
        for primitive in &model.primitives {
            let mut primitive = primitive.clone();
            for vertex in &mut primitive.vertices {
                for (coordinate, shift) in vertex.position.iter_mut().zip(shift) {
                    *coordinate += shift;
                }
            }
            crowd.primitives.push(primitive);
        }
    }
    let camera = Camera { eye: one.target + back * rows as f32, ..one };
    Scene::head(gpu, &crowd, mm_per_unit, &format!("{heads} heads"), size, camera)
}
