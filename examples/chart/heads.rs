//! Li & Shao's Fig. 8: frames a second against the number of heads.

use std::time::Instant;

use subsurface::renderer::{AtlasRenderer, AtlasTimes, Camera, Gpu, Scene as Model, View};
use subsurface::{Error, Profile, ScreenFrame};

use crate::method::{AtlasMethod, ScreenMethod};
use crate::plot::Series;
use crate::scene::{Scene, Surface};

/// Numbers of heads, and the columns in which they stand.
const HEADS: [(usize, usize); 5] = [(1, 1), (2, 2), (4, 2), (8, 4), (16, 4)];

/// A series runs as often as fits into this time, and once at least.
const SECONDS: f64 = 10.0;
const RUNS: usize = 9;

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
pub fn figure(
    gpu: &Gpu,
    model: &Model,
    mm_per_unit: f32,
    size: [u32; 2],
    screen: &mut dyn ScreenMethod,
    textured: &mut [Textured],
    mut step: impl FnMut(&str),
) -> Result<(Vec<Series>, Vec<String>), Error> {
    let profiles = [Profile::SKIN];
    let mut skin = Vec::new();
    let mut on_screen = Vec::new();
    let mut in_texture = vec![Vec::<(f64, f64)>::new(); textured.len()];
    for (i, (heads, columns)) in HEADS.into_iter().enumerate() {
        step(&format!("{heads} heads"));
        let scene = crowd(gpu, model, mm_per_unit, size, heads, columns)?;
        let Surface::Head(head) = &scene.surface else {
            continue;
        };
        skin.push(scene.pixels.len().to_string());
        let output = head.renderer.scattered_target(gpu);
        screen.prepare(
            &gpu.device,
            &ScreenFrame {
                irradiance: &scene.irradiance,
                depth: &scene.depth,
                profile_id: &scene.profile_id,
                output: &output,
                projection: scene.projection,
                mm_per_unit,
                profiles: &profiles,
            },
        )?;
        gpu.run(|encoder| screen.render(encoder));
        let ms = median_ms(|| {
            let start = Instant::now();
            gpu.run(|encoder| screen.render(encoder));
            Ok(start.elapsed().as_secs_f64() * 1e3)
        })?;
        on_screen.push((heads as f64, 1e3 / ms));
        for (t, points) in textured.iter_mut().zip(&mut in_texture) {
            if i >= t.measured {
                // Each head has an atlas of its own.
                let (first, fps) = points[0];
                points.push((heads as f64, fps * first / heads as f64));
                continue;
            }
            let atlas = AtlasRenderer::new(gpu, &head.renderer, t.size)?;
            let ms = median_ms(|| {
                let AtlasTimes { raster_ms, blur_ms } = atlas.render(
                    gpu,
                    &head.renderer,
                    &profiles,
                    mm_per_unit,
                    &output,
                    |atlas| {
                        t.method.prepare(&gpu.device, atlas)?;
                        gpu.run(|encoder| t.method.render(encoder));
                        Ok(())
                    },
                )?;
                Ok(raster_ms + blur_ms)
            })?;
            points.push((heads as f64, 1e3 / ms));
        }
    }
    let mut series = vec![Series {
        name: "screen_exact".into(),
        points: on_screen,
        extrapolated_from: None,
    }];
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

fn median_ms(mut run: impl FnMut() -> Result<f64, Error>) -> Result<f64, Error> {
    let since = Instant::now();
    let mut times = Vec::new();
    while times.is_empty() || times.len() < RUNS && since.elapsed().as_secs_f64() < SECONDS {
        times.push(run()?);
    }
    Ok(crate::clock::median(&times))
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
    let size = [
        (f64::from(size[0]) * wide).round() as u32,
        (f64::from(size[1]) / wide).round() as u32,
    ];
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
    let camera = Camera {
        eye: one.target + back * rows as f32,
        ..one
    };
    Scene::head(
        gpu,
        &crowd,
        mm_per_unit,
        &format!("{heads} heads"),
        size,
        camera,
    )
}
