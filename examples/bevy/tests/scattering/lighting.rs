//! With the plugin, Bevy's picture is Bevy's where nothing scatters, whatever lights it.

use bevy::camera::Hdr;
use bevy::camera::{ScalingMode, Viewport};
use bevy::core_pipeline::tonemapping::{DebandDither, Tonemapping};
use bevy::light::EnvironmentMapLight;
use bevy::pbr::{DistanceFog, FogFalloff, ScreenSpaceAmbientOcclusion, ScreenSpaceReflections};
use bevy::prelude::*;
use bevy::render::render_resource::TextureFormat;
use subsurface_bevy::{SubsurfaceProfile, SubsurfaceScattering};

use crate::picture::Picture;
use crate::scene::{HDR, SIZE, add_balls, add_camera, add_mesh, add_sun, skin_color, skin_mask};
use crate::stage::{Prop, Stage};

/// Something of Bevy's that a picture has on top of balls, floor and sun.
struct Case {
    name: &'static str,
    add: fn(&mut World, Entity),
    format: TextureFormat,
    /// Whether pixels that are not skin show skin.
    shows_skin: bool,
}

const fn case(name: &'static str, add: fn(&mut World, Entity)) -> Case {
    Case { name, add, format: HDR, shows_skin: false }
}

const CASES: [Case; 15] = [
    case("sun with shadows", |_, _| {}),
    Case {
        format: TextureFormat::Rgba8UnormSrgb,
        ..case("tone mapping, not HDR", |world, camera| {
            let mut camera = world.entity_mut(camera);
            camera.remove::<Hdr>().insert((Tonemapping::AcesFitted, DebandDither::Enabled));
        })
    },
    case("point light with shadows", |world, _| {
        let light = PointLight { intensity: 300.0, shadow_maps_enabled: true, ..default() };
        world.spawn((Prop, light, Transform::from_xyz(0.05, 0.1, 0.1)));
    }),
    case("spot light with shadows", |world, _| {
        let light = SpotLight { intensity: 600.0, shadow_maps_enabled: true, ..default() };
        let at = Transform::from_xyz(0.05, 0.1, 0.1).looking_at(Vec3::ZERO, Vec3::Y);
        world.spawn((Prop, light, at));
    }),
    case("environment map", |world, camera| {
        let mut images = world.resource_mut::<Assets<Image>>();
        let colors = [Color::srgb(0.5, 0.7, 1.0), Color::srgb(0.9, 0.8, 0.7), Color::srgb(0.3, 0.2, 0.1)];
        let [top, middle, bottom] = colors;
        let map = EnvironmentMapLight {
            intensity: 800.0,
            ..EnvironmentMapLight::hemispherical_gradient(&mut images, top, middle, bottom)
        };
        world.entity_mut(camera).insert(map);
    }),
    case("ambient light", |world, camera| {
        world.entity_mut(camera).insert(AmbientLight { brightness: 500.0, ..default() });
    }),
    case("ambient occlusion", |world, camera| {
        world.entity_mut(camera).insert((
            ScreenSpaceAmbientOcclusion::default(),
            AmbientLight { brightness: 2000.0, ..default() },
        ));
    }),
    case("fog", |world, camera| {
        world.entity_mut(camera).insert(DistanceFog {
            color: Color::srgb(0.6, 0.7, 0.8),
            falloff: FogFalloff::Exponential { density: 5.0 },
            ..default()
        });
    }),
    Case {
        shows_skin: true,
        ..case("reflections", |world, camera| {
            world.entity_mut(camera).insert(ScreenSpaceReflections::default());
        })
    },
    Case {
        shows_skin: true,
        ..case("glass in front", |world, _| {
            let glass = StandardMaterial {
                alpha_mode: AlphaMode::Blend,
                ..Color::srgba(0.2, 0.2, 0.9, 0.4).into()
            };
            add_mesh(world, Cuboid::new(0.05, 0.05, 0.001), glass, Transform::from_xyz(0.0, 0.0, 0.06));
        })
    },
    case("orthographic", |world, camera| {
        let projection = OrthographicProjection {
            scaling_mode: ScalingMode::FixedVertical { viewport_height: 0.12 },
            near: 0.01,
            far: 1.0,
            ..OrthographicProjection::default_3d()
        };
        world.entity_mut(camera).insert(Projection::from(projection));
    }),
    case("viewport", |world, camera| {
        let viewport = Viewport {
            physical_position: UVec2::new(40, 24),
            physical_size: UVec2::new(180, 200),
            ..default()
        };
        world.get_mut::<Camera>(camera).expect("a camera").viewport = Some(viewport);
    }),
    case("clear coat, emissive", |world, _| {
        let material =
            StandardMaterial { clearcoat: 0.8, emissive: LinearRgba::rgb(0.2, 0.05, 0.02), ..skin_color() };
        let at = Transform::from_xyz(0.0, 0.035, 0.02);
        let ball = add_mesh(world, Sphere::new(0.012).mesh().uv(32, 24), material, at);
        world.entity_mut(ball).insert(SubsurfaceProfile::default());
    }),
    case("exposure", |world, camera| {
        world.entity_mut(camera).insert(bevy::camera::Exposure { ev100: 9.0 });
    }),
    case("unlit skin", |world, _| {
        let material = StandardMaterial { unlit: true, ..skin_color() };
        let at = Transform::from_xyz(0.0, 0.035, 0.02);
        let ball = add_mesh(world, Sphere::new(0.012).mesh().uv(32, 24), material, at);
        world.entity_mut(ball).insert(SubsurfaceProfile::default());
    }),
];

/// The camera's picture in two frames, which are one.
fn still(stage: &mut Stage, target: &Handle<Image>) -> Picture {
    let first = stage.read(target);
    stage.update();
    let second = stage.read(target);
    assert_eq!(first.difference(&second, |_| true), (0.0, 0), "two frames of a still scene");
    second
}

fn set(stage: &mut Stage, case: &Case) -> (Handle<Image>, Entity) {
    let target = stage.image(SIZE, case.format);
    let camera = stage.set(|world| {
        let skin = SubsurfaceProfile::default();
        add_balls(world, Some([skin.clone(), skin]));
        add_sun(world);
        let camera = add_camera(world, &target);
        (case.add)(world, camera);
        camera
    });
    (target, camera)
}

#[test]
fn what_does_not_scatter_is_bevys() {
    let mut plain = Stage::new(false);
    let mut stage = Stage::new(true);
    for case in &CASES {
        let is_noisy = case.name == "reflections";
        plain.holds_frame_count = is_noisy;
        stage.holds_frame_count = is_noisy;
        let (target, _) = set(&mut plain, case);
        plain.settle(0);
        let bevys = still(&mut plain, &target);

        // Without the component, Bevy's own shader draws all.
        let (target, camera) = set(&mut stage, case);
        stage.settle(0);
        let off = still(&mut stage, &target);
        assert_eq!(off.difference(&bevys, |_| true), (0.0, 0), "{}: off", case.name);

        // Lit apart and put together, but with no share of scattered light.
        let world = stage.app.world_mut();
        world.entity_mut(camera).insert(SubsurfaceScattering { strength: 0.0, ..default() });
        stage.settle(1);
        let unscattered = still(&mut stage, &target);
        let mask = skin_mask(&mut stage, camera);
        let skin = mask.iter().filter(|skin| **skin).count();
        assert!(skin > 5000, "{}: {skin} pixels of skin", case.name);

        let world = stage.app.world_mut();
        world.entity_mut(camera).insert(SubsurfaceScattering::default());
        stage.settle(1);
        let on = still(&mut stage, &target);

        stage.app.world_mut().entity_mut(camera).remove::<SubsurfaceScattering>();
        stage.settle(0);
        let removed = still(&mut stage, &target);

        let (of_lighting, pixels) = unscattered.difference(&bevys, |i| mask[i]);
        let (of_scattering, _) = on.difference(&bevys, |i| mask[i]);
        println!(
            "{}: lit apart, {pixels} of {skin} pixels of skin differ, {of_lighting:.5} at most; \
             scattered, {of_scattering:.3}",
            case.name
        );
        // A half float near 2 steps by .001; a byte is a step of 1/255 that may fall to either side.
        let most = if case.format == HDR { 0.001 } else { 1.001 / 255.0 };
        assert!(of_lighting <= most, "{}: {of_lighting}", case.name);
        assert!(of_scattering > 0.02, "{}: nothing scatters", case.name);
        let others = |picture: &Picture| picture.difference(&bevys, |i| !mask[i]);
        if case.shows_skin {
            assert!(others(&unscattered).0 <= most, "{}: not skin", case.name);
        } else {
            assert_eq!(others(&unscattered), (0.0, 0), "{}: not skin, lit apart", case.name);
            assert_eq!(others(&on), (0.0, 0), "{}: not skin", case.name);
        }
        assert_eq!(removed.difference(&bevys, |_| true), (0.0, 0), "{}: removed", case.name);
    }
}

#[test]
fn a_profile_that_is_removed_leaves_bevys_picture() {
    let case = &CASES[0];
    let mut plain = Stage::new(false);
    let (target, _) = set(&mut plain, case);
    plain.settle(0);
    let bevys = still(&mut plain, &target);

    let mut stage = Stage::new(true);
    let (target, camera) = set(&mut stage, case);
    let world = stage.app.world_mut();
    world.entity_mut(camera).insert(SubsurfaceScattering::default());
    stage.settle(1);
    assert!(still(&mut stage, &target).difference(&bevys, |_| true).0 > 0.02, "nothing scatters");

    let world = stage.app.world_mut();
    let skin: Vec<Entity> = world.query_filtered::<Entity, With<SubsurfaceProfile>>().iter(world).collect();
    for mesh in skin {
        world.entity_mut(mesh).remove::<SubsurfaceProfile>();
    }
    for _ in 0..3 {
        stage.update();
    }
    assert_eq!(still(&mut stage, &target).difference(&bevys, |_| true), (0.0, 0));
}
