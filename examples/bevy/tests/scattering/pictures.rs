//! The pictures of the README.

use std::path::Path;
use std::time::{Duration, Instant};

use bevy::light::EnvironmentMapLight;
use bevy::prelude::*;
use bevy::render::render_resource::TextureFormat;
use image::codecs::jpeg::JpegEncoder;
use subsurface_bevy::{SubsurfaceProfile, SubsurfaceScattering};

use crate::picture::Picture;
use crate::scene::{add_camera, add_sun};
use crate::smooth::smooth_normals;
use crate::stage::{Prop, Stage};

const SIZE: [u32; 2] = [1024, 1024];

fn write(name: &str, byte: impl Fn(usize, usize) -> u8) {
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    let bytes: Vec<u8> = (0..pixels).flat_map(|i| [0, 1, 2].map(|c| byte(i, c))).collect();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("images").join(name);
    std::fs::create_dir_all(path.parent().expect("a directory")).expect("a directory");
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, 85)
        .encode(&bytes, SIZE[0], SIZE[1], image::ExtendedColorType::Rgb8)
        .expect("a picture");
    std::fs::write(path, jpeg).expect("a file that is written");
}

/// The head, whose file says by an extra what is skin.
fn head(stage: &mut Stage) -> (Handle<Image>, Entity) {
    let target = stage.image(SIZE, TextureFormat::Rgba8UnormSrgb);
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../lab/src/compare/head.glb");
    let scene = GltfAssetLabel::Scene(0).from_asset(file);
    let scene = stage.app.world().resource::<AssetServer>().load(scene);
    let camera = stage.set(|world| {
        world.spawn((Prop, WorldAssetRoot(scene)));
        let sun = add_sun(world);
        world.get_mut::<DirectionalLight>(sun).expect("the sun").illuminance = 3200.0;
        let at = Transform::from_xyz(-1.0, 0.35, 0.2).looking_at(Vec3::ZERO, Vec3::Y);
        world.entity_mut(sun).insert(at);
        let camera = add_camera(world, &target);
        let mut images = world.resource_mut::<Assets<Image>>();
        let sky = [Color::srgb(0.5, 0.6, 0.8), Color::srgb(0.4, 0.4, 0.45), Color::srgb(0.2, 0.15, 0.1)];
        let [top, middle, bottom] = sky;
        let sky = EnvironmentMapLight {
            intensity: 150.0,
            ..EnvironmentMapLight::hemispherical_gradient(&mut images, top, middle, bottom)
        };
        world.entity_mut(camera).insert((
            sky,
            Projection::from(PerspectiveProjection { fov: 0.5, near: 0.05, ..default() }),
            Transform::from_xyz(-0.06, -0.02, 0.42).looking_at(Vec3::new(0.0, -0.03, 0.0), Vec3::Y),
        ));
        camera
    });
    let since = Instant::now();
    loop {
        stage.update();
        let world = stage.app.world_mut();
        if world.query::<&SubsurfaceProfile>().iter(world).count() > 0 {
            let meshes: Vec<_> = world.query::<&Mesh3d>().iter(world).map(|mesh| mesh.id()).collect();
            let mut assets = world.resource_mut::<Assets<Mesh>>();
            for id in meshes {
                smooth_normals(&mut assets.get_mut(id).expect("a mesh of the head"));
            }
            return (target, camera);
        }
        assert!(since.elapsed() < Duration::from_secs(60), "no skin in {file}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// `cargo test -- --ignored pictures`
#[test]
#[ignore = "no check, but what renders the README's pictures into images/"]
fn pictures() {
    let mut stage = Stage::new(true);
    let (target, camera) = head(&mut stage);
    for _ in 0..10 {
        stage.update();
    }
    let off: Picture = stage.read(&target);
    stage.app.world_mut().entity_mut(camera).insert(SubsurfaceScattering::default());
    stage.settle(1);
    let on = stage.read(&target);
    let of = |picture: &Picture, i: usize, c: usize| picture.pixels[i][c];
    write("off.jpg", |i, c| (of(&off, i, c) * 255.0) as u8);
    write("on.jpg", |i, c| (of(&on, i, c) * 255.0) as u8);
    write("difference.jpg", |i, c| (127.5 + 4.0 * 255.0 * (of(&on, i, c) - of(&off, i, c))) as u8);
}

/// A file that says what is skin is skin without a word of code.
#[test]
fn an_extra_of_a_file_makes_skin() {
    let mut stage = Stage::new(true);
    let (_, camera) = head(&mut stage);
    let world = stage.app.world_mut();
    let skin = world.query::<&SubsurfaceProfile>().iter(world).count();
    assert_eq!(skin, 1, "the eyes are none");
    world.entity_mut(camera).insert(SubsurfaceScattering::default());
    stage.settle(1);
}
