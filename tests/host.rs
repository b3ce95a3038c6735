//! What a host may ask for beyond a frame of its own: a part of a target, ids or none, less of the
//! effect, sums in place; by both effects.

use std::sync::OnceLock;

use glam::{DMat4, DVec3, DVec4, Mat4};
use subsurface::wgpu::{self, CommandEncoder, TextureFormat, TextureView};
use subsurface::{Frame, Output, Plan, Profile, ScreenSpace, Viewport};
use subsurface_lab::renderer::Gpu;
use subsurface_lab::synthetic::{View, apart, gpu, plane, sphere};
use subsurface_lab::truth::closed_form::step;

const SIZE: [u32; 2] = [96, 80];
const HALF: TextureFormat = TextureFormat::Rgba16Float;

/// A plan of skin, or the exact sum.
fn plan(planned: bool) -> &'static Plan {
    static PLANS: OnceLock<[Plan; 2]> = OnceLock::new();
    let plans = PLANS.get_or_init(|| {
        let skin = [Profile::SKIN];
        [Plan::exact(&skin).unwrap(), Plan::new(&skin, 0.01).unwrap()]
    });
    &plans[usize::from(planned)]
}

/// Scatters a frame by a new effect and a new view.
fn record(planned: bool, to: Output, frame: &Frame, output: &TextureView, encoder: &mut CommandEncoder) {
    let gpu = gpu();
    let effect = ScreenSpace::new(&gpu.device, to, plan(planned)).unwrap();
    let mut view = subsurface::View::new();
    view.prepare(&gpu.device, &gpu.queue, &effect, frame).unwrap();
    view.render(encoder, output).unwrap();
}

/// A sphere before nothing, in half floats.
struct Scene {
    size: [u32; 2],
    irradiance: Vec<[f32; 4]>,
    depth: Vec<f32>,
    id: Vec<u8>,
    projection: Mat4,
}

/// Its textures.
struct Uploaded {
    irradiance: TextureView,
    depth: TextureView,
    id: TextureView,
    projection: Mat4,
}

impl Uploaded {
    fn frame(&self) -> Frame<'_> {
        let mut frame = Frame::new(&self.irradiance, &self.depth, self.projection.to_cols_array_2d());
        frame.profile_id = Some(&self.id);
        frame.mm_per_unit = 1.0;
        frame
    }
}

/// What a host asks for beyond a frame of its own.
#[derive(Default)]
struct Asked<'a> {
    no_ids: bool,
    strength: Option<&'a TextureView>,
    albedo: Option<&'a TextureView>,
    viewport: Option<Viewport>,
}

/// At a corner of a picture that has other things all around.
const PLACE: Viewport = Viewport { x: 40, y: 24, width: SIZE[0], height: SIZE[1] };

impl Scene {
    fn new() -> Self {
        let view = View::perspective(SIZE, 40.0);
        let light = DVec3::new(0.8, 0.3, 0.5).normalize();
        let seen = view.shoot(sphere(9.0, 36.0, |n| DVec3::new(1.0, 0.5, 0.25) * n.dot(light).max(0.0)));
        let hits = &seen.hits;
        let color = |e: DVec3| {
            let half = |x: f64| half::f16::from_f64(x).to_f32();
            [half(e.x), half(e.y), half(e.z), 0.5]
        };
        let clip = |p: DVec3| view.projection * p.extend(1.0);
        Self {
            size: SIZE,
            irradiance: hits
                .iter()
                .map(|h| color(h.map_or(DVec3::splat(0.25), |h| h.irradiance)))
                .collect(),
            depth: hits
                .iter()
                .map(|h| h.map_or(0.0, |h| (clip(h.point).z / clip(h.point).w) as f32))
                .collect(),
            id: hits.iter().map(|h| u8::from(h.is_some())).collect(),
            projection: view.projection.as_mat4(),
        }
    }

    fn upload(&self, gpu: &Gpu) -> Uploaded {
        Uploaded {
            irradiance: gpu.upload("irradiance", self.size, HALF, &halves(&self.irradiance)),
            depth: gpu.upload("depth", self.size, TextureFormat::R32Float, &self.depth),
            id: gpu.upload("id", self.size, TextureFormat::R8Uint, &self.id),
            projection: self.projection,
        }
    }

    /// The same in a larger picture, full of skin that would bleed in.
    fn within_more(&self) -> Self {
        let size = [160, 128];
        let mut more = Self {
            size,
            irradiance: Vec::new(),
            depth: Vec::new(),
            id: Vec::new(),
            projection: self.projection,
        };
        for i in more.places() {
            more.irradiance.push(i.map_or([8.0, 8.0, 8.0, 1.0], |i| self.irradiance[i]));
            more.depth.push(i.map_or(0.3, |i| self.depth[i]));
            more.id.push(i.map_or(1, |i| self.id[i]));
        }
        more
    }

    /// Of each pixel of the larger picture, which it is of the smaller one.
    fn places(&self) -> Vec<Option<usize>> {
        let width = self.size[0];
        let place = |i: u32| {
            let x = (i % width).checked_sub(PLACE.x)?;
            let y = (i / width).checked_sub(PLACE.y)?;
            (x < SIZE[0] && y < SIZE[1]).then_some((y * SIZE[0] + x) as usize)
        };
        (0..self.size[0] * self.size[1]).map(place).collect()
    }

    /// What an effect leaves in a target that held `before`.
    fn scatter(&self, planned: bool, output: Output, before: &[[f32; 4]], asked: Asked) -> Vec<[f32; 4]> {
        let gpu = gpu();
        let to = gpu.target("output", self.size, HALF);
        let held = gpu.upload("before", self.size, HALF, &halves(before));
        gpu.run(|encoder| {
            let [from, to] = [&held, &to].map(|view| view.texture().as_image_copy());
            encoder.copy_texture_to_texture(from, to, held.texture().size());
        });
        let mut textures = self.upload(gpu);
        let full = TextureFormat::Rgba32Float;
        textures.irradiance = gpu.upload("irradiance", self.size, full, &self.irradiance);
        let mut frame = textures.frame();
        if asked.no_ids {
            frame.profile_id = None;
        }
        frame.strength = asked.strength;
        frame.albedo = asked.albedo;
        frame.viewport = asked.viewport;
        gpu.run(|encoder| record(planned, output, &frame, &to, encoder));
        gpu.read(&to)
    }

    fn scattered(&self, planned: bool, asked: Asked) -> Vec<[f32; 4]> {
        let nothing = vec![[0.0; 4]; self.depth.len()];
        self.scatter(planned, HALF.into(), &nothing, asked)
    }
}

fn halves(pixels: &[[f32; 4]]) -> Vec<[u16; 4]> {
    let bits = |x: f32| half::f16::from_f32(x).to_bits();
    pixels.iter().map(|p| p.map(bits)).collect()
}

#[test]
fn a_viewport_is_a_frame_of_its_own() {
    let alone = Scene::new();
    let more = alone.within_more();
    let around = [3.0, 2.0, 1.0, 0.5];
    let shares = |count: usize| (0..count).map(|i| (i * 37 % 251) as u8).collect::<Vec<_>>();
    let strength_alone = shares(alone.depth.len());
    let strength_more: Vec<u8> =
        more.places().iter().map(|place| place.map_or(0, |i| strength_alone[i])).collect();
    let strength =
        |scene: &Scene, shares: &[u8]| gpu().upload("strength", scene.size, TextureFormat::R8Unorm, shares);
    let strength_alone = strength(&alone, &strength_alone);
    let strength_more = strength(&more, &strength_more);
    for planned in [false, true] {
        let shared = Asked { strength: Some(&strength_alone), ..Asked::default() };
        let truth = alone.scattered(planned, shared);
        assert!(apart(&truth, &alone.irradiance) > 0.02);
        let before = vec![around; more.depth.len()];
        let in_place = Asked { viewport: Some(PLACE), strength: Some(&strength_more), ..Asked::default() };
        let out = more.scatter(planned, HALF.into(), &before, in_place);
        for (i, pixel) in out.iter().enumerate() {
            let (x, y) = (i as u32 % more.size[0], i as u32 / more.size[0]);
            let inside =
                x >= PLACE.x && y >= PLACE.y && x < PLACE.x + PLACE.width && y < PLACE.y + PLACE.height;
            let expected = match inside {
                true => truth[((y - PLACE.y) * SIZE[0] + x - PLACE.x) as usize],
                false => around,
            };
            assert_eq!(*pixel, expected, "planned: {planned}, at {x}, {y}");
        }
    }
}

/// What an effect keeps from frame to frame is never of another frame.
#[test]
fn one_effect_serves_frames_that_change() {
    let gpu = gpu();
    let more = Scene::new().within_more();
    let output = gpu.target("output", more.size, HALF);
    let textures = more.upload(gpu);
    let mut first = textures.frame();
    first.viewport = Some(PLACE);
    let changed = |change: &dyn Fn(&mut Frame)| {
        let mut frame = first;
        change(&mut frame);
        frame
    };
    let frames = [
        first,
        changed(&|f| f.viewport = Some(Viewport { x: 0, y: 3, ..PLACE })),
        changed(&|f| f.viewport = None),
        changed(&|f| f.mm_per_unit = 3.0),
        changed(&|f| f.profile_id = None),
        first,
    ];
    let effects = [false, true].map(|p| ScreenSpace::new(&gpu.device, HALF, plan(p)).unwrap());
    let mut view = subsurface::View::new();
    let seen = |record: &mut dyn FnMut(&mut CommandEncoder)| {
        let nothing = vec![[0.0; 4]; more.depth.len()];
        let cleared = gpu.upload("cleared", more.size, HALF, &halves(&nothing));
        gpu.run(|encoder| {
            let [from, to] = [&cleared, &output].map(|view| view.texture().as_image_copy());
            encoder.copy_texture_to_texture(from, to, cleared.texture().size());
            record(encoder);
        });
        gpu.read(&output)
    };
    for (i, frame) in frames.iter().enumerate() {
        // One view for both effects, which keep their scratch side by side.
        for (effect, by_plan) in effects.iter().zip([false, true]) {
            let anew = seen(&mut |encoder| record(by_plan, HALF.into(), frame, &output, encoder));
            let kept = seen(&mut |encoder| {
                view.prepare(&gpu.device, &gpu.queue, effect, frame).unwrap();
                view.render(encoder, &output).unwrap();
            });
            assert_eq!(kept, anew, "frame {i}, planned: {by_plan}");
        }
    }
}

/// Two plans, two sizes and two views by turns. Scratch textures follow the sizes.
#[test]
fn no_pipeline_is_made_from_frame_to_frame() {
    // A device of its own, since it counts for all tests at once.
    let gpu = &Gpu::headless().unwrap();
    let scenes = [Scene::new(), Scene::new().within_more()];
    let textures = scenes.each_ref().map(|scene| scene.upload(gpu));
    let plans = [0.004, 0.01].map(|e| Plan::new(&[Profile::SKIN], e).unwrap());
    let effects = plans.map(|plan| ScreenSpace::new(&gpu.device, HALF, &plan).unwrap());
    let mut views = [(); 2].map(|()| subsurface::View::new());
    let made = || {
        let counters = gpu.device.get_internal_counters().hal;
        let pipelines = counters.render_pipelines.read() + counters.compute_pipelines.read();
        assert!(pipelines > 0, "the device counts");
        [pipelines, counters.shader_modules.read()]
    };
    let before = made();
    let outputs = scenes.each_ref().map(|scene| gpu.target("output", scene.size, HALF));
    for i in 0..1000 {
        // Each view alternates between the plans, and both between the sizes.
        let (effect, view) = (&effects[i % 2], &mut views[i / 2 % 2]);
        view.prepare(&gpu.device, &gpu.queue, effect, &textures[i / 4 % 2].frame()).unwrap();
        // What was dropped goes when the queue is next submitted and done.
        if i % 100 < 8 {
            gpu.run(|encoder| view.render(encoder, &outputs[i / 4 % 2])).unwrap();
        }
        assert_eq!(before, made(), "frame {i}");
    }
}

/// Two cameras in one submission give what each gives alone.
#[test]
fn views_share_a_submission() {
    let gpu = gpu();
    let scene = Scene::new();
    let textures = scene.upload(gpu);
    let frame = |mm_per_unit| {
        let mut frame = textures.frame();
        frame.mm_per_unit = mm_per_unit;
        frame
    };
    for planned in [false, true] {
        let effect = ScreenSpace::new(&gpu.device, HALF, plan(planned)).unwrap();
        let mut views = [(); 2].map(|()| subsurface::View::new());
        let outputs = [(); 2].map(|()| gpu.target("output", scene.size, HALF));
        gpu.run(|encoder| {
            for ((view, output), mm_per_unit) in views.iter_mut().zip(&outputs).zip([1.0, 3.0]) {
                let frame = frame(mm_per_unit);
                view.prepare(&gpu.device, &gpu.queue, &effect, &frame).unwrap();
                view.render(encoder, output).unwrap();
            }
        });
        for (output, mm_per_unit) in outputs.iter().zip([1.0, 3.0]) {
            let alone = gpu.target("alone", scene.size, HALF);
            let frame = frame(mm_per_unit);
            gpu.run(|encoder| record(planned, HALF.into(), &frame, &alone, encoder));
            assert_eq!(gpu.read(output), gpu.read(&alone), "planned: {planned}");
        }
    }
}

/// Levels for skin that is nearer than any are left out, and nothing else changes.
#[test]
fn a_host_that_knows_its_nearest_skin_pays_for_fewer_levels() {
    let gpu = gpu();
    let scene = Scene::new();
    let textures = scene.upload(gpu);
    let to_view = scene.projection.inverse();
    let distance = |d: &f32| -to_view.project_point3(glam::Vec3::new(0.0, 0.0, *d)).z;
    let seen = scene.depth.iter().filter(|d| **d != 0.0);
    let nearest = seen.map(distance).fold(f32::MAX, f32::min);
    let effect = ScreenSpace::new(&gpu.device, HALF, plan(true)).unwrap();
    let levels_and_picture = |nearest| {
        let mut frame = textures.frame();
        frame.profile_id = None;
        frame.nearest = nearest;
        let mut view = subsurface::View::new();
        view.prepare(&gpu.device, &gpu.queue, &effect, &frame).unwrap();
        let output = gpu.target("output", scene.size, HALF);
        gpu.run(|encoder| view.render(encoder, &output).unwrap());
        (view.tiles().unwrap().levels.len(), gpu.read(&output))
    };
    let (all, whole) = levels_and_picture(None);
    let (some, known) = levels_and_picture(Some(nearest));
    let (fewest, wrong) = levels_and_picture(Some(100.0 * nearest));
    println!("the frame and its levels: {all}, {some} for skin at {nearest} mm, {fewest} from far away");
    assert!(fewest < some && some < all, "{fewest} {some} {all}");
    assert_eq!(known, whole);
    // As it says: it scatters too little.
    assert!(wrong != whole && wrong.iter().flatten().all(|c| c.is_finite()));
}

/// Times of passes, where the device takes them.
#[test]
fn passes_tell_their_times() {
    let gpu = gpu();
    if !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
        println!("this device takes no times");
        return;
    }
    let scene = Scene::new();
    let textures = scene.upload(gpu);
    let mut frame = textures.frame();
    frame.profile_id = None;
    let output = gpu.target("output", scene.size, HALF);
    let count = 2 * subsurface::View::MAX_PASSES;
    let queries = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
        label: None,
        ty: wgpu::QueryType::Timestamp,
        count,
    });
    let bytes = 8 * u64::from(count);
    let buffer = |usage| {
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: bytes,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    };
    let resolved = buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC);
    let read = buffer(wgpu::BufferUsages::MAP_READ);
    for planned in [false, true] {
        let effect = ScreenSpace::new(&gpu.device, HALF, plan(planned)).unwrap();
        let mut view = subsurface::View::new();
        view.prepare(&gpu.device, &gpu.queue, &effect, &frame).unwrap();
        let labels = gpu.run(|encoder| {
            let labels = view.render_timed(encoder, &output, &queries, 0).unwrap();
            encoder.resolve_query_set(&queries, 0..2 * labels.len() as u32, &resolved, 0);
            encoder.copy_buffer_to_buffer(&resolved, 0, &read, 0, bytes);
            labels
        });
        assert!(labels.len() <= subsurface::View::MAX_PASSES as usize);
        let distinct: std::collections::BTreeSet<_> = labels.iter().collect();
        assert_eq!(distinct.len(), labels.len(), "{labels:?}");
        read.map_async(wgpu::MapMode::Read, .., |result| result.unwrap());
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let times: Vec<u64> = bytemuck::pod_collect_to_vec(&read.get_mapped_range(..).unwrap());
        read.unmap();
        for (label, pair) in labels.iter().zip(times.chunks(2)) {
            assert!(pair[0] <= pair[1] && pair[0] > 0, "{label}: {pair:?}");
        }
        // The same as without times.
        let without = gpu.target("output", scene.size, HALF);
        gpu.run(|encoder| record(planned, HALF.into(), &frame, &without, encoder));
        assert_eq!(gpu.read(&output), gpu.read(&without));
    }
}

#[test]
fn without_ids_all_before_the_far_plane_scatters() {
    let scene = Scene::new();
    for planned in [false, true] {
        let no_ids = Asked { no_ids: true, ..Asked::default() };
        let by_id = scene.scattered(planned, Asked::default());
        let by_depth = scene.scattered(planned, no_ids);
        assert_eq!(by_id, by_depth, "planned: {planned}");
    }
}

/// Depth at the far plane is nowhere, whichever end of 0 to 1 that is.
#[test]
fn the_far_plane_is_told_from_the_near_one() {
    let scene = Scene::new();
    let orthographic = |at_near: f32, at_far: f32, near_depth: f32| {
        // z from at_near, 0 or above, to at_far, below; half a millimetre a pixel.
        let slope = (1.0 - 2.0 * near_depth) / (at_far - at_near);
        Mat4::from_cols(
            glam::Vec4::new(4.0 / SIZE[0] as f32, 0.0, 0.0, 0.0),
            glam::Vec4::new(0.0, 4.0 / SIZE[1] as f32, 0.0, 0.0),
            glam::Vec4::new(0.0, 0.0, slope, 0.0),
            glam::Vec4::new(0.0, 0.0, near_depth - slope * at_near, 1.0),
        )
    };
    for (name, projection, far) in [
        ("forward", orthographic(0.0, -1000.0, 0.0), 1.0),
        ("reversed", orthographic(0.0, -1000.0, 1.0), 0.0),
        ("forward, sees behind", orthographic(2000.0, -1000.0, 0.0), 1.0),
        ("reversed, sees behind", orthographic(1000.0, -1000.0, 1.0), 0.0),
    ] {
        let flat = Scene {
            size: SIZE,
            irradiance: scene.irradiance.clone(),
            // A plane in the middle of what is seen, and nothing on the right.
            depth: (0..scene.depth.len())
                .map(|i| if i % SIZE[0] as usize >= 60 { far } else { 0.5 })
                .collect(),
            id: scene.id.clone(),
            projection,
        };
        for planned in [false, true] {
            let by_depth = Asked { no_ids: true, ..Asked::default() };
            let out = flat.scattered(planned, by_depth);
            for (i, pixel) in out.iter().enumerate() {
                let kept = *pixel == flat.irradiance[i];
                let beyond = i % SIZE[0] as usize >= 60;
                assert!(kept || !beyond, "{name}, planned: {planned}, pixel {i}");
            }
            let left: Vec<usize> = (0..out.len()).filter(|i| i % SIZE[0] as usize <= 50).collect();
            let pick = |all: &[[f32; 4]]| left.iter().map(|i| all[*i]).collect::<Vec<_>>();
            let changed = apart(&pick(&out), &pick(&flat.irradiance));
            assert!(changed > 0.02, "{name}, planned: {planned}: {changed}");
        }
    }
}

#[test]
fn strength_says_how_much() {
    let scene = Scene::new();
    // A third each of none, half and all.
    let share = |i: usize| [0u8, 128, 255][(i % SIZE[0] as usize) / 32];
    let strength: Vec<u8> = (0..scene.depth.len()).map(share).collect();
    let strength = gpu().upload("strength", scene.size, TextureFormat::R8Unorm, &strength);
    for planned in [false, true] {
        let shared = Asked { strength: Some(&strength), ..Asked::default() };
        let all = scene.scattered(planned, Asked::default());
        let some = scene.scattered(planned, shared);
        for (i, pixel) in some.iter().enumerate() {
            let before = scene.irradiance[i];
            match share(i) {
                0 => assert_eq!(*pixel, before, "planned: {planned}, pixel {i}"),
                255 => assert_eq!(*pixel, all[i], "planned: {planned}, pixel {i}"),
                half => {
                    let t = f32::from(half) / 255.0;
                    for c in 0..3 {
                        let expected = before[c] + t * (all[i][c] - before[c]);
                        // Two roundings to half floats, of steps of .001 at 1.
                        assert!((pixel[c] - expected).abs() <= 0.001);
                    }
                }
            }
        }
    }
}

#[test]
fn light_beyond_half_floats_stays_a_number() {
    let mut bright = Scene::new();
    let at = |x: u32, y: u32| (y * SIZE[0] + x) as usize;
    let (first, second) = (at(60, 40), at(50, 30));
    assert!(bright.id[first] == 1 && bright.id[second] == 1);
    bright.irradiance[first] = [1e9, 1.0, 1.0, 1.0];
    bright.irradiance[second] = [1.0, -1e9, 1.0, 1.0];
    for planned in [false, true] {
        let out = bright.scattered(planned, Asked::default());
        assert!(out.iter().flatten().all(|c| c.is_finite()), "planned: {planned}");
    }
}

#[test]
fn sums_in_place_are_what_a_final_pass_would_add() {
    let scene = Scene::new();
    let specular: Vec<[f32; 4]> =
        (0..scene.depth.len()).map(|i| [i as f32 % 7.0 / 16.0, 0.25, 0.5, 0.75]).collect();
    let plus = |a: &[[f32; 4]], b: &[[f32; 4]]| -> Vec<[f32; 4]> {
        let sum = |(a, b): (&[f32; 4], &[f32; 4])| [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3]];
        a.iter().zip(b).map(sum).collect()
    };
    for planned in [false, true] {
        let scattered = scene.scattered(planned, Asked::default());
        let expected = plus(&specular, &scattered);
        let lit = plus(&specular, &scene.irradiance);
        let added = scene.scatter(planned, Output::AddScattered(HALF), &specular, Asked::default());
        let changed = scene.scatter(planned, Output::AddDifference(HALF), &lit, Asked::default());
        // Up to three roundings of half floats, or truncations, of steps of .001 from 1 to 2.
        let worst = [&added, &changed].map(|out| apart(out, &expected));
        println!("planned: {planned}, off by {worst:?}");
        assert!(worst[0].max(worst[1]) <= 0.003, "{worst:?}");
        // What does not scatter is not touched.
        for (i, _) in scene.id.iter().enumerate().filter(|(_, id)| **id == 0) {
            assert_eq!(changed[i].map(f32::to_bits), bits_of_half(lit[i]), "planned: {planned}");
        }
    }
}

/// Paint that is handed in beside the light stays where it is.
#[test]
fn albedo_multiplies_what_is_added() {
    let scene = Scene::new();
    let paint: Vec<[f32; 4]> = (0..scene.depth.len())
        .map(|i| [[0.75, 0.5, 0.25, 1.0], [0.25, 0.25, 0.5, 0.0]][i / 5 % 2])
        .collect();
    let albedo = gpu().upload("albedo", scene.size, HALF, &halves(&paint));
    let times = |a: &[f32; 4], b: &[f32; 4]| [a[0] * b[0], a[1] * b[1], a[2] * b[2], 0.5];
    for planned in [false, true] {
        let asked = || Asked { albedo: Some(&albedo), ..Asked::default() };
        let scattered = scene.scattered(planned, Asked::default());
        let painted =
            |light: &[[f32; 4]]| -> Vec<_> { light.iter().zip(&paint).map(|(a, b)| times(a, b)).collect() };
        let wanted = painted(&scattered);
        let nothing = vec![[0.0, 0.0, 0.0, 0.5]; paint.len()];
        let lit = painted(&scene.irradiance);
        let added = scene.scatter(planned, Output::AddScattered(HALF), &nothing, asked());
        let changed = scene.scatter(planned, Output::AddDifference(HALF), &lit, asked());
        // Up to three roundings of half floats, or truncations, of steps of .0005 below 1.
        let worst = [&added, &changed].map(|out| apart(out, &wanted));
        println!("planned: {planned}, off by {worst:?}");
        assert!(worst[0].max(worst[1]) <= 0.0015, "{worst:?}");
    }
}

fn bits_of_half(pixel: [f32; 4]) -> [u32; 4] {
    pixel.map(|x| half::f16::from_f32(x).to_f32().to_bits())
}

/// A camera of any kind: a field of view in degrees or millimetres seen, pixels, and the mm of a unit.
struct Camera {
    name: &'static str,
    size: [u32; 2],
    /// Clip from view space in mm.
    projection: DMat4,
    distance_mm: f64,
    mm_per_unit: f64,
    viewport: Option<Viewport>,
}

/// A strip of a frame that is `whole` high, so that large frames need not be drawn whole.
fn cameras() -> Vec<Camera> {
    // As wide on the plane as 5 px/mm make it.
    let strip = [256u32, 64];
    let px_per_mm = 5.0;
    let perspective = |whole: f64, degrees: f64, z: f64, offset: f64, shift: f64| {
        let f = 1.0 / (degrees.to_radians() / 2.0).tan();
        // Pixels of the whole frame over those of the strip.
        let (sx, sy) = (whole / f64::from(strip[0]), whole / f64::from(strip[1]));
        let projection = DMat4::from_cols(
            DVec4::new(f * sx, 0.0, 0.0, 0.0),
            DVec4::new(0.0, f * sy, 0.0, 0.0),
            DVec4::new(shift, 0.0, z, -1.0),
            DVec4::new(0.0, 0.0, offset, 0.0),
        );
        (projection, f * whole / 2.0 / px_per_mm)
    };
    let (near, far) = (1.0, 10_000.0);
    let mut cameras = Vec::new();
    let mut add = |name, (projection, distance_mm): (DMat4, f64), mm_per_unit, viewport| {
        cameras.push(Camera { name, size: strip, projection, distance_mm, mm_per_unit, viewport });
    };
    let infinite = |whole, degrees| perspective(whole, degrees, 0.0, near, 0.0);
    add("10°, 720p", infinite(720.0, 10.0), 1.0, None);
    add("110°, 720p", infinite(720.0, 110.0), 1.0, None);
    add("10°, 4K", infinite(2160.0, 10.0), 1.0, None);
    add("110°, 4K", infinite(2160.0, 110.0), 1.0, None);
    add("units of 1 µm", infinite(1080.0, 40.0), 1e-3, None);
    add("units of 1 m", infinite(1080.0, 40.0), 1e3, None);
    add("off centre", perspective(1080.0, 40.0, 0.0, near, 0.2), 1.0, None);
    let range = far - near;
    let forward = perspective(1080.0, 40.0, -far / range, -far * near / range, 0.0);
    add("forward", forward, 1.0, None);
    let reversed = perspective(1080.0, 40.0, near / range, far * near / range, 0.0);
    add("reversed", reversed, 1.0, None);
    add("forward infinite", perspective(1080.0, 40.0, -1.0, -near, 0.0), 1.0, None);
    let orthographic = View::orthographic(strip, px_per_mm).projection;
    add("orthographic", (orthographic, 100.0), 1.0, None);
    let corner = Viewport { x: 31, y: 17, width: strip[0], height: strip[1] };
    add("viewport", infinite(1080.0, 40.0), 1.0, Some(corner));
    cameras
}

impl Camera {
    /// Standard deviation of red across a line of 1 mm, in mm.
    fn line_width_mm(&self, planned: bool) -> f64 {
        let view = View { size: self.size, projection: self.projection };
        // What is off centre is looked at where it is.
        let middle = view.ray(glam::DVec2::new(128.0, 32.0));
        let x0 = (middle.0 + middle.1 * self.distance_mm).x;
        let seen = view.shoot(plane(DVec3::Z, self.distance_mm, |p| {
            let x = p.x - x0;
            DVec3::splat(step(x + 0.5, 0.04) - step(x - 0.5, 0.04))
        }));
        let from_units = DMat4::from_scale(DVec3::splat(self.mm_per_unit));
        let target = match self.viewport {
            Some(v) => [v.x + v.width + 5, v.y + v.height + 9],
            None => self.size,
        };
        let first = self.viewport.map_or([0, 0], |v| [v.x, v.y]);
        let gpu = gpu();
        let mut irradiance = vec![[1.0f32; 4]; (target[0] * target[1]) as usize];
        let mut depth = vec![0.5f32; irradiance.len()];
        let mut places = Vec::new();
        for (i, hit) in seen.hits.iter().enumerate() {
            let hit = hit.expect("a plane");
            let (x, y) = (i as u32 % self.size[0], i as u32 / self.size[0]);
            let at = ((y + first[1]) * target[0] + x + first[0]) as usize;
            let e = hit.irradiance.as_vec3();
            irradiance[at] = [e.x, e.y, e.z, 1.0];
            let clip = self.projection * hit.point.extend(1.0);
            depth[at] = (clip.z / clip.w) as f32;
            if y == self.size[1] / 2 {
                places.push((at, hit.point.x));
            }
        }
        let full = TextureFormat::Rgba32Float;
        let output = gpu.target("output", target, full);
        let irradiance = gpu.upload("irradiance", target, full, &irradiance);
        let depth = gpu.upload("depth", target, TextureFormat::R32Float, &depth);
        let projection = (self.projection * from_units).as_mat4().to_cols_array_2d();
        let mut frame = Frame::new(&irradiance, &depth, projection);
        frame.viewport = self.viewport;
        frame.mm_per_unit = self.mm_per_unit as f32;
        gpu.run(|encoder| record(planned, full.into(), &frame, &output, encoder));
        let out = gpu.read(&output);
        let moment = |f: &dyn Fn(f64) -> f64| -> f64 {
            let parts = places.iter().map(|(i, x)| f64::from(out[*i][0]) * f(*x));
            parts.sum()
        };
        let mass = moment(&|_| 1.0);
        let mean = moment(&|x| x) / mass;
        (moment(&|x| (x - mean) * (x - mean)) / mass).sqrt()
    }
}

#[test]
fn a_line_has_its_width_in_mm_through_every_camera() {
    for planned in [false, true] {
        let cameras = cameras();
        let widths = cameras.iter().map(|c| c.line_width_mm(planned));
        let widths: Vec<f64> = widths.collect();
        for (camera, width) in cameras.iter().zip(&widths) {
            println!("planned: {planned}, {}: {width:.4} mm", camera.name);
        }
        // Of the line, soft by .04 mm², and of red in the profile; the frame cuts some of it off, and a plan
        // has more far away, within its error.
        let skin = Profile::SKIN;
        let of_red = |g: &subsurface::Gaussian| f64::from(g.weight[0] * g.variance_mm2);
        let red: f64 = skin.gaussians().iter().map(of_red).sum();
        let truth = (red + 1.0 / 12.0 + 0.04).sqrt();
        let most_off = if planned { 0.3 } else { 0.01 };
        for width in &widths {
            assert!((width / truth - 1.0).abs() <= most_off, "{width} mm, {truth} mm");
        }
        let least = widths.iter().copied().fold(f64::MAX, f64::min);
        let most = widths.iter().copied().fold(0.0, f64::max);
        assert!(most / least <= 1.0002, "planned: {planned}: {least} to {most} mm");
    }
}
