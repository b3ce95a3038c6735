//! The filter against the renderer that wrote the dump, and what it reads.

use std::fs;
use std::path::Path;

use exr::math::Vec2;
use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Image, IntegerBounds, Layer,
    LayerAttributes, WritableImage,
};
use glam::camera::rh::proj::directx::{perspective, perspective_infinite_reverse};
use glam::{DVec3, Mat4};
use serde_json::json;
use subsurface::wgpu::TextureFormat;
use subsurface::{Frame, Plan, Profile, ScreenSpace, View};

use crate::filter::dump::write_depth;
use crate::filter::fixture::{
    Plane, Scratch, floats, halves, read_rgb, rgb, run, write, write_as, write_json,
};
use crate::renderer::{Camera, Gpu, Lighting, Renderer, Scene, View};

/// The built-in head, rendered.
struct Head {
    gpu: Gpu,
    renderer: Renderer,
    projection: Mat4,
}

impl Head {
    const SIZE: [u32; 2] = [256, 256];

    fn new() -> Self {
        let gpu = Gpu::headless().unwrap();
        let scene = Scene::from_glb(crate::HEAD).unwrap();
        let renderer = Renderer::new(&gpu, &scene, Self::SIZE).unwrap();
        let camera = Camera::framing(&scene, View::Front, Self::SIZE);
        renderer
            .render(&gpu, &camera, &Lighting::default(), 1000.0)
            .unwrap();
        Self {
            projection: camera.projection(Self::SIZE),
            gpu,
            renderer,
        }
    }

    /// Leaves it as another program would; `samples` of the depth.
    fn dump(&self, case: &Path, samples: fn(Vec<f32>) -> FlatSamples) {
        let (gpu, g) = (&self.gpu, &self.renderer.gbuffer);
        let inverse = self.projection.as_dmat4().inverse();
        let depth: Vec<f32> = bytemuck::pod_collect_to_vec(&gpu.read_bytes(g.depth.texture()));
        let distance = depth.iter().map(|d| match d {
            0.0 => 0.0,
            d => -inverse.project_point3(DVec3::new(0.0, 0.0, (*d).into())).z as f32,
        });
        let ids = gpu.read_bytes(g.profile_id.texture());
        let at = |name| case.join(name);
        write(
            &at("irradiance.exr"),
            Self::SIZE,
            rgb(&gpu.read(&g.irradiance), halves),
        );
        write(
            &at("depth.exr"),
            Self::SIZE,
            vec![("depth.V", samples(distance.collect()))],
        );
        write(
            &at("profile_id.exr"),
            Self::SIZE,
            vec![(
                "Y",
                FlatSamples::U32(ids.iter().map(|id| (*id).into()).collect()),
            )],
        );
        let files = json!({
            "irradiance": "irradiance.exr",
            "depth": "depth.exr",
            "profile_id": "profile_id.exr",
        });
        write_json(case, Self::SIZE, self.projection, &files);
    }

    /// What the effect makes of the renderer's own textures.
    fn scattered(&self, plan: Option<&Plan>, format: TextureFormat) -> Vec<[f32; 4]> {
        let (gpu, g) = (&self.gpu, &self.renderer.gbuffer);
        let output = gpu.target("scattered", Self::SIZE, format);
        let frame = ScreenFrame {
            irradiance: &g.irradiance,
            depth: &g.depth,
            profile_id: Some(&g.profile_id),
            normal: None,
            strength: None,
            viewport: None,
            output: &output,
            projection: self.projection,
            mm_per_unit: 1000.0,
            profiles: &[Profile::SKIN],
        };
        match plan {
            None => {
                let mut effect = ScreenSpace::new(&gpu.device, format).unwrap();
                effect.prepare(&gpu.device, &frame).unwrap();
                gpu.run(|encoder| effect.render(encoder));
            }
            Some(plan) => {
                let mut effect = PlannedScreenSpace::new(&gpu.device, format).unwrap();
                effect
                    .prepare(&gpu.device, &gpu.queue, &frame, plan)
                    .unwrap();
                gpu.run(|encoder| effect.render(encoder));
            }
        }
        gpu.read(&output)
    }
}

/// How far what is scattered may be from the renderer's, relative. Depth that went through a distance
/// in a float and back may be a place off, here 3e-5 mm, where pixels are .6 mm apart: slopes, by which
/// areas are weighed, move by 5e-5 between two pixels.
const APART: f32 = 2e-4;
/// But for a value or two of each effect, where a place of depth decides something: by a plan, how a half float
/// between passes is rounded (seen: .0003 in red, nothing in green and blue); by the exact effect, whether a row of pixels
/// strays from the plane and is summed anew (seen: .0004, and none where the bounds of that are 2 % wider).
const BEYOND: usize = 2;
const APART_AT_MOST: f32 = 6e-4;

#[test]
fn a_dump_scatters_as_the_frame_did() {
    let head = Head::new();
    let case = Scratch::new("head");
    head.dump(&case.0, floats);
    let g = &head.renderer.gbuffer;
    let irradiance = head.gpu.read(&g.irradiance);
    let ids = head.gpu.read_bytes(g.profile_id.texture());
    let plan = Plan::new(&[Profile::SKIN], 0.01).unwrap();
    let dir = case.0.to_str().unwrap();
    let out = case.0.join("out.exr");
    for (plan, how) in [
        (Some(&plan), vec!["--max-error", "0.01", "--png", "--plan"]),
        (None, vec!["--exact"]),
    ] {
        run(&[&[dir, "--out", out.to_str().unwrap()], how.as_slice()].concat()).unwrap();
        let ours = read_rgb(&out);
        // With an output as wide as ours, and with the renderer's own.
        let wide = head.scattered(plan, TextureFormat::Rgba32Float);
        let theirs = head.scattered(plan, TextureFormat::Rgba16Float);
        let (mut apart, mut apart_half, mut same) = (0.0_f32, 0.0_f32, 0);
        let (mut beyond, mut count) = (0, 0);
        for (i, ours) in ours.iter().enumerate() {
            if ids[i] == 0 {
                assert_eq!(ours, &irradiance[i][..3], "pixel {i} does not scatter");
                continue;
            }
            for (c, ours) in ours.iter().enumerate() {
                // Below 2⁻¹⁴ half floats go in even steps.
                let relative = |theirs: f32| (ours - theirs).abs() / theirs.max(1.0 / 16384.0);
                apart = apart.max(relative(wide[i][c]));
                beyond += usize::from(relative(wide[i][c]) > APART);
                count += 1;
                apart_half = apart_half.max(relative(theirs[i][c]));
                same += usize::from(*ours == wide[i][c]);
            }
        }
        println!(
            "{how:?}: {apart:.1e} apart, {beyond} of {count} values beyond {APART:e}, {same} the same; \
             {apart_half:.1e} in half floats"
        );
        assert!(apart < APART_AT_MOST, "{apart}");
        assert!(beyond <= BEYOND, "{beyond} of {count}");
        // One place of a half float: the device may round to either side.
        assert!(apart_half < 1.0 / 1024.0 + APART_AT_MOST, "{apart_half}");
    }
    if let Some(keep) = std::env::var_os("FILTER_OUT") {
        let files = [
            "gbuffer.json",
            "irradiance.exr",
            "depth.exr",
            "profile_id.exr",
        ];
        let files = files.map(|f| (f.to_owned(), fs::read(case.0.join(f)).unwrap()));
        crate::output::write(keep.as_ref(), &files).unwrap();
    }
}

/// Why a dump in half floats is told of.
#[test]
fn half_floats_of_depth_show() {
    let head = Head::new();
    let case = Scratch::new("half");
    head.dump(&case.0, halves);
    let out = case.0.join("out.exr");
    let [dir, out] = [&case.0, &out].map(|path| path.to_str().unwrap());
    run(&[dir, "--out", out, "--exact"]).unwrap();
    let ours = read_rgb(Path::new(out));
    let theirs = head.scattered(None, TextureFormat::Rgba32Float);
    let apart = ours
        .iter()
        .zip(&theirs)
        .flat_map(|(a, b)| [0, 1, 2].map(|c| (a[c] - b[c]).abs()));
    let worst = apart.fold(0.0, f32::max);
    println!("half floats of depth: {worst} apart");
    assert!(worst > 0.01, "{worst}");
}

#[test]
fn light_that_is_even_stays() {
    let plane = Plane::new("even");
    for how in [&["--exact"] as &[&str], &[], &["--variance-scale", "4"]] {
        for e in plane.run(how).unwrap().as_flattened() {
            // Half floats between the passes.
            assert!((e - 0.5).abs() < 0.5 / 1024.0, "{e}");
        }
    }
}

#[test]
fn what_does_not_scatter_comes_out_as_it_was() {
    let plane = Plane::new("background");
    // No half float, nor is any of it light that was scattered.
    let odd = |i: usize, c: usize| 0.1 + i as f32 * 1e-6 - c as f32;
    plane.irradiance(odd);
    let ids = |i: usize| f32::from(u8::from(i % 8 < 4));
    for (what, change) in [
        ("no depth", (|p| p.depth(|_| 0.0)) as fn(&Plane)),
        ("id 0", |p| p.ids(|_| 0.0)),
    ] {
        plane.depth(|_| 0.5);
        plane.ids(ids);
        change(&plane);
        for how in [&["--exact"] as &[&str], &[]] {
            for (i, e) in plane.run(how).unwrap().into_iter().enumerate() {
                assert_eq!(e, [0, 1, 2].map(|c| odd(i, c)), "{what}, pixel {i}");
            }
        }
    }
    // Without ids all that has depth scatters, and nothing else. Neighbours differ enough that none comes out as it
    // was by chance.
    let uneven = |i: usize, c: usize| odd(i, c) + (i % 3) as f32;
    plane.irradiance(uneven);
    plane.json("/files/profile_id", json!("none"));
    plane.depth(|i| 0.5 * ids(i));
    let out = plane.run(&["--exact"]).unwrap();
    for (i, e) in out.into_iter().enumerate() {
        let same = e == [0, 1, 2].map(|c| uneven(i, c));
        assert_eq!(same, ids(i) == 0.0, "pixel {i}");
    }
}

#[test]
fn ids_choose_among_the_profiles() {
    let plane = Plane::new("profiles");
    let still = plane.at("still.json");
    let text = r#"{"gaussians": [{"variance_mm2": 0, "weight": [1, 1, 1]}]}"#;
    fs::write(&still, text).unwrap();
    plane.irradiance(|i, _| (i % 3) as f32);
    plane.ids(|i| if i < 16 { 1.0 } else { 2.0 });
    let profiles = [
        "--exact",
        "--profile",
        "skin",
        "--profile",
        still.to_str().unwrap(),
    ];
    for (i, e) in plane.run(&profiles).unwrap().into_iter().enumerate() {
        let same = e == [(i % 3) as f32; 3];
        assert_eq!(same, i >= 16, "pixel {i}: {e:?}");
    }
}

#[test]
fn files_are_read_whatever_they_call_their_channels() {
    let plane = Plane::new("channels");
    plane.irradiance(|i, c| (i + c) as f32);
    plane.depth(|i| 0.5 + i as f32 / 1024.0);
    let expected = plane.run(&["--exact"]).unwrap();
    let irradiance = |c: usize| (0..Plane::PIXELS).map(move |i| (i + c) as f32);
    let depth = || (0..Plane::PIXELS).map(|i| 0.5 + i as f32 / 1024.0);
    let mut encodings = vec![
        Encoding::UNCOMPRESSED,
        Encoding::FAST_LOSSLESS,
        Encoding::SMALL_LOSSLESS,
        Encoding::SMALL_FAST_LOSSLESS,
    ];
    for compression in [Compression::ZIP1, Compression::RLE] {
        encodings.push(Encoding {
            compression,
            ..Encoding::SMALL_LOSSLESS
        });
    }
    for encoding in encodings {
        for samples in [floats, halves] as [fn(Vec<f32>) -> FlatSamples; 2] {
            let s = |values: &mut dyn Iterator<Item = f32>| samples(values.collect());
            for names in [
                ["R", "G", "B"],
                ["Layer.Pass.R", "Layer.Pass.G", "Layer.Pass.B"],
            ] {
                let [r, g, b] = [0, 1, 2].map(|c| s(&mut irradiance(c)));
                let alpha = s(&mut depth());
                let channels = vec![(names[0], r), (names[1], g), (names[2], b), ("A", alpha)];
                write_as(&plane.at("irradiance.exr"), Plane::SIZE, channels, encoding);
                for names in [
                    vec!["Y"],
                    vec!["depth.V", "depth.A"],
                    vec!["R", "G", "B", "A"],
                ] {
                    let channels = names.into_iter().map(|n| (n, s(&mut depth()))).collect();
                    write_as(&plane.at("depth.exr"), Plane::SIZE, channels, encoding);
                    assert_eq!(plane.run(&["--exact"]).unwrap(), expected, "{encoding:?}");
                }
            }
        }
    }
}

#[test]
fn what_a_file_leaves_out_of_its_window_is_nothing() {
    let plane = Plane::new("window");
    plane.irradiance(|i, _| i as f32);
    // The middle two rows alone, moved so that one column is off to the left.
    let samples = floats([0.5; 16]);
    let channels = AnyChannels::sort([AnyChannel::new("Z", samples)].into_iter().collect());
    let attributes = LayerAttributes {
        layer_position: Vec2(-1, 1),
        ..Default::default()
    };
    let layer = Layer::new((8, 2), attributes, Encoding::SMALL_LOSSLESS, channels);
    let mut image = Image::from_layer(layer);
    image.attributes.display_window = IntegerBounds::from_dimensions((8, 4));
    image
        .write()
        .non_parallel()
        .to_file(plane.at("depth.exr"))
        .unwrap();
    for (i, e) in plane.run(&["--exact"]).unwrap().into_iter().enumerate() {
        let inside = (1..3).contains(&(i / 8)) && i % 8 < 7;
        assert_eq!(e != [i as f32; 3], inside, "pixel {i}: {e:?}");
    }
}

/// How far the rounding of depth to a float moves a surface, relative to its distance.
#[test]
fn depth_survives_its_rounding() {
    let worst = |projection, from: f32, to: f32| {
        let distances = (0..=10_000).map(|i| from * (to / from).powf(i as f32 / 10_000.0));
        let errors = distances.map(|z| {
            let (_, error) = write_depth(projection, z).unwrap();
            error / f64::from(z)
        });
        errors.fold(0.0, f64::max)
    };
    let reversed = perspective_infinite_reverse(0.4, 1.0, 0.01);
    let forward = perspective(0.4, 1.0, 0.1, 100.0);
    for (from, to) in [(0.1, 1.0), (1.0, 10.0), (10.0, 100.0)] {
        let errors = [reversed, forward].map(|p| worst(p, from, to));
        println!(
            "{from} to {to} units: reversed {:.1e}, forward {:.1e}",
            errors[0], errors[1]
        );
        // Half of the last place of a float, wherever it is.
        assert!(errors[0] <= 2f64.powi(-24) * 1.001);
        // Half of the last place of 1, times dz/dd = z²/near.
        assert!(errors[1] <= 2f64.powi(-25) * f64::from(to) / 0.1 * 1.01);
    }
}
