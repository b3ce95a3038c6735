//! A line of light of 1 mm, against what convolution makes of it.

use bevy::asset::RenderAssetUsages;
use bevy::camera::ScalingMode;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use subsurface_bevy::subsurface::Profile;
use subsurface_bevy::{SubsurfaceGaussian, SubsurfaceProfile, SubsurfaceScattering};

use crate::scene::{HDR, add_camera, add_mesh};
use crate::stage::{Prop, Stage};

/// Metres that a picture is wide. Light of the widest Gaussian of skin goes 9.5 mm at most.
const WIDTH: f32 = 0.032;

/// A plane that shows its normals to the light on a strip of 1 mm and hides them elsewhere.
fn strip() -> Mesh {
    let columns =
        [(-0.05, -1.0), (-0.0005, -1.0), (-0.0005, 1.0), (0.0005, 1.0), (0.0005, -1.0), (0.05, -1.0)];
    let ends = [-0.05f32, 0.05];
    let vertices = columns.iter().flat_map(|(x, n)| ends.map(|y| ([*x, y, 0.0], [0.0, 0.0, *n])));
    let (positions, normals): (Vec<[f32; 3]>, Vec<[f32; 3]>) = vertices.unzip();
    let quad = |i: u32| [0, 2, 1, 1, 2, 3].map(|k| 4 * i + k);
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
        .with_inserted_indices(Indices::U32((0..3).flat_map(quad).collect()))
}

/// Red across the line, at places in mm from its middle: before and after scattering.
fn across(
    stage: &mut Stage,
    profile: &SubsurfaceProfile,
    max_error: f32,
    perspective: bool,
    pixels: u32,
) -> [Vec<(f64, f64)>; 2] {
    let size = [pixels, pixels / 2];
    let target = stage.image(size, HDR);
    let camera = stage.set(|world| {
        let material =
            StandardMaterial { perceptual_roughness: 1.0, reflectance: 0.0, ..Color::WHITE.into() };
        let plane = add_mesh(world, strip(), material, Transform::IDENTITY);
        world.entity_mut(plane).insert(profile.clone());
        let sun = DirectionalLight { illuminance: 3000.0, ..default() };
        world.spawn((Prop, sun, Transform::from_xyz(0.0, 0.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y)));
        let camera = add_camera(world, &target);
        let height = WIDTH / 2.0;
        let projection = if perspective {
            let fov = 2.0 * (height / 2.0 / 0.1).atan();
            Projection::from(PerspectiveProjection { fov, near: 0.01, ..default() })
        } else {
            Projection::from(OrthographicProjection {
                scaling_mode: ScalingMode::FixedVertical { viewport_height: height },
                near: 0.01,
                far: 1.0,
                ..OrthographicProjection::default_3d()
            })
        };
        let at = Transform::from_xyz(0.0, 0.0, 0.1).looking_at(Vec3::ZERO, Vec3::Y);
        let settings = SubsurfaceScattering { max_error, ..default() };
        let dark = AmbientLight { brightness: 0.0, ..default() };
        world.entity_mut(camera).insert((projection, at, settings, dark));
        camera
    });
    stage.settle(1);
    let textures = stage.textures(camera);
    let mm = f64::from(WIDTH) * 1000.0 / f64::from(pixels);
    [textures.irradiance, textures.scattered].map(|texture| {
        let picture = stage.read_texture(&texture.texture);
        let first = (size[0] * (size[1] / 2)) as usize;
        let row = &picture.pixels[first..first + size[0] as usize];
        let place = |i: usize| (i as f64 + 0.5 - f64::from(pixels) / 2.0) * mm;
        row.iter().enumerate().map(|(i, p)| (place(i), f64::from(p[0]))).collect()
    })
}

/// Root of the mean square distance from the middle, in mm.
fn deviation(row: &[(f64, f64)]) -> f64 {
    let mass: f64 = row.iter().map(|(_, e)| e).sum();
    let mean = row.iter().map(|(x, e)| x * e).sum::<f64>() / mass;
    (row.iter().map(|(x, e)| (x - mean).powi(2) * e).sum::<f64>() / mass).sqrt()
}

/// Where light falls to half of its most, from side to side, in mm.
fn full_width_at_half_maximum(row: &[(f64, f64)]) -> f64 {
    let most = row.iter().map(|(_, e)| *e).fold(0.0, f64::max);
    let cross = |pair: &[(f64, f64)]| {
        let [(x, e), (y, f)] = [pair[0], pair[1]];
        ((e - most / 2.0) * (f - most / 2.0) < 0.0).then(|| x + (y - x) * (most / 2.0 - e) / (f - e))
    };
    let crossings: Vec<f64> = row.windows(2).filter_map(cross).collect();
    let [left, right] = crossings[..] else { panic!("{crossings:?}") };
    right - left
}

const CAMERAS: [(bool, u32); 4] = [(false, 256), (false, 512), (true, 256), (true, 512)];

#[test]
fn a_line_of_a_millimetre_has_its_width() {
    let mut stage = Stage::new(true);

    // Skin by the exact sum: variances of convolved distributions add.
    let skin = SubsurfaceProfile::default();
    let of_red = |g: &SubsurfaceGaussian| f64::from(g.weight.x * g.variance_mm2);
    let truth = (skin.gaussians.iter().map(of_red).sum::<f64>() + 1.0 / 12.0).sqrt();
    for (perspective, pixels) in CAMERAS {
        let [before, after] = across(&mut stage, &skin, 0.0, perspective, pixels);
        let line = deviation(&before) * 12.0f64.sqrt();
        let width = deviation(&after);
        println!(
            "skin, exact, perspective: {perspective}, {pixels} px: the line is {line:.4} mm wide, its red \
             light {width:.4} mm, {truth:.4} by the closed form: {:+.2} %",
            (width / truth - 1.0) * 100.0
        );
        assert!((line - 1.0).abs() < 0.01);
        assert!((width / truth - 1.0).abs() < 0.01);
    }

    // A Gaussian of 1 mm², by the plan that is used by default. With N the normal distribution, the light is
    // N(x + ½) − N(x − ½).
    let gaussian = SubsurfaceGaussian { variance_mm2: 1.0, weight: Vec3::ONE };
    let one = SubsurfaceProfile { gaussians: vec![gaussian] };
    let light = |x: f64| normal(x + 0.5) - normal(x - 0.5);
    let half = light(0.0) / 2.0;
    let (mut near, mut far) = (0.0, 5.0);
    for _ in 0..60 {
        let middle = (near + far) / 2.0;
        if light(middle) > half { near = middle } else { far = middle }
    }
    let truth = 2.0 * near;
    // Another stage, or the plan of skin would be used until that of both is ready.
    let mut stage = Stage::new(true);
    let default = SubsurfaceScattering::default().max_error;
    for (perspective, pixels) in CAMERAS {
        let [_, after] = across(&mut stage, &one, default, perspective, pixels);
        let width = full_width_at_half_maximum(&after);
        println!(
            "1 mm², 1/255, perspective: {perspective}, {pixels} px: {width:.4} mm at half of the most, \
             {truth:.4} by the closed form: {:+.2} %",
            (width / truth - 1.0) * 100.0
        );
        assert!((width / truth - 1.0).abs() < 0.01);
    }
    assert_eq!(Profile::try_from(&skin), Ok(Profile::SKIN));
}

/// The normal distribution up to x, by Simpson's rule.
fn normal(x: f64) -> f64 {
    const STEPS: usize = 2000;
    let h = x / STEPS as f64;
    let density = |t: f64| (-t * t / 2.0).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let weight = |i: usize| match i {
        0 | STEPS => 1.0,
        i if i % 2 == 1 => 4.0,
        _ => 2.0,
    };
    0.5 + (0..=STEPS).map(|i| weight(i) * density(i as f64 * h)).sum::<f64>() * h / 3.0
}
