//! Over time: TAA, resizing, toggling, the first frame.

use std::time::{Duration, Instant};

use bevy::anti_alias::taa::TemporalAntiAliasing;
use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::renderer::RenderDevice;
use subsurface_bevy::{SubsurfaceDebug, SubsurfaceProfile, SubsurfaceScattering};

use crate::scene::{HDR, SIZE, add_balls, add_camera, add_sun, skin_mask};
use crate::stage::Stage;

fn skin() -> Option<[SubsurfaceProfile; 2]> {
    Some([SubsurfaceProfile::default(), SubsurfaceProfile::default()])
}

fn set(stage: &mut Stage) -> (Handle<Image>, Entity, [Entity; 2]) {
    let target = stage.image(SIZE, HDR);
    let (camera, balls) = stage.set(|world| {
        let balls = add_balls(world, skin());
        add_sun(world);
        (add_camera(world, &target), balls)
    });
    (target, camera, balls)
}

/// Pixels whose neighbours up to 3 away are skin, too: TAA blurs borders.
fn inside(mask: &[bool]) -> Vec<bool> {
    let [width, height] = SIZE.map(|s| s as usize);
    let within = |i: usize| {
        let (x, y) = (i % width, i / width);
        (3..width - 3).contains(&x)
            && (3..height - 3).contains(&y)
            && (y - 3..=y + 3).all(|y| (x - 3..=x + 3).all(|x| mask[y * width + x]))
    };
    (0..mask.len()).map(within).collect()
}

/// What TAA does to the mean over skin, with `settings`.
fn change_by_taa(stage: &mut Stage, inside: &[bool], settings: SubsurfaceScattering) -> [f64; 3] {
    let (target, camera, _) = set(stage);
    stage.app.world_mut().entity_mut(camera).insert(settings);
    stage.settle(1);
    let without = stage.read(&target);
    stage.app.world_mut().entity_mut(camera).insert(TemporalAntiAliasing::default());
    for _ in 0..64 {
        stage.update();
    }
    let with = stage.read(&target);
    assert!(without.difference(&with, |_| true).1 > 0, "TAA did nothing");
    let [a, b] = [&without, &with].map(|picture| picture.mean(|i| inside[i]));
    println!("mean over skin by strength {}: without TAA {a:.5?}, with it {b:.5?}", settings.strength);
    [0, 1, 2].map(|c| b[c] - a[c])
}

/// TAA darkens edges of light, and loses 0.8 % of the mean over Bevy's own picture of these balls: what
/// matters is that scattered skin does not lose more.
#[test]
fn taa_leaves_the_light_of_skin() {
    let mut stage = Stage::new(true);
    let scattered = SubsurfaceScattering::default();
    let (_, camera, _) = set(&mut stage);
    stage.app.world_mut().entity_mut(camera).insert(scattered);
    stage.settle(1);
    let inside = inside(&skin_mask(&mut stage, camera));
    let bevys = SubsurfaceScattering { strength: 0.0, ..scattered };
    let [bevys, ours] = [bevys, scattered].map(|settings| change_by_taa(&mut stage, &inside, settings));
    for c in 0..3 {
        assert!((ours[c] - bevys[c]).abs() <= 0.001, "{ours:?}, Bevy's own {bevys:?}");
    }
}

fn allocated_bytes(stage: &Stage) -> u64 {
    let device = stage.app.sub_app(RenderApp).world().resource::<RenderDevice>();
    let report = device.wgpu_device().generate_allocator_report().expect("a backend that counts");
    report.total_allocated_bytes
}

#[test]
fn frames_of_resizing_and_toggling_leave_nothing_behind() {
    let mut stage = Stage::new(true);
    let (_, camera, balls) = set(&mut stage);
    let mut bytes = Vec::new();
    for frame in 0..300u32 {
        let turn = frame % 60;
        let world = stage.app.world_mut();
        if turn.is_multiple_of(12) {
            let size = [[256, 256], [64, 96], [1, 1], [300, 120], [129, 255]][(turn / 12) as usize];
            let target = stage.image(size, HDR);
            let world = stage.app.world_mut();
            world.entity_mut(camera).insert(RenderTarget::Image(target.into()));
        } else if turn % 7 == 1 {
            let max_error = [1.0 / 255.0, 0.01, 0.0, f32::NAN][(turn / 7 % 4) as usize];
            let debug = [SubsurfaceDebug::Off, SubsurfaceDebug::Difference][(turn % 2) as usize];
            let settings = SubsurfaceScattering { max_error, debug, ..default() };
            world.entity_mut(camera).insert(settings);
        } else if turn % 7 == 5 {
            world.entity_mut(camera).remove::<SubsurfaceScattering>();
        } else if turn % 7 == 3 {
            world.entity_mut(balls[0]).remove::<SubsurfaceProfile>();
        } else if turn % 7 == 4 {
            world.entity_mut(balls[0]).insert(SubsurfaceProfile::default());
        }
        stage.update();
        if turn == 59 {
            // All that is being made is made.
            for _ in 0..20 {
                std::thread::sleep(Duration::from_millis(20));
                stage.update();
            }
            bytes.push(allocated_bytes(&stage));
        }
    }
    println!("bytes on the device after each 60 frames: {bytes:?}");
    let [_, second, .., last] = bytes[..] else { panic!("{bytes:?}") };
    // Blocks of the allocator come and go; a leak of a frame a turn would be 4 MB in all.
    assert!(last <= second + second / 100, "{bytes:?}");
}

/// The first frames of an app, as a game has them: pipelines are made beside them.
fn first_frames(has_plugin: bool) -> (Duration, Duration) {
    let mut stage = Stage::with(has_plugin, false);
    let target = stage.image(SIZE, HDR);
    let world = stage.app.world_mut();
    add_balls(world, has_plugin.then(skin).flatten());
    add_sun(world);
    let camera = add_camera(world, &target);
    if has_plugin {
        world.entity_mut(camera).insert(SubsurfaceScattering::default());
    }
    let time = |stage: &mut Stage| {
        let since = Instant::now();
        stage.update();
        since.elapsed()
    };
    let first = time(&mut stage);
    let longest = (0..30).map(|_| time(&mut stage)).max().expect("some frames");
    (first, longest)
}

#[test]
fn the_first_frame_waits_for_nothing() {
    // What else the machine does only adds to a time.
    let least = |times: Vec<Duration>| times.into_iter().min().expect("some times");
    // What the driver and Bevy make once for all.
    first_frames(true);
    let (mut plain, mut with) = (Vec::new(), Vec::new());
    for _ in 0..8 {
        plain.push(first_frames(false));
        with.push(first_frames(true));
    }
    let [plain, with] = [plain, with].map(|times| {
        let (first, longest): (Vec<_>, Vec<_>) = times.into_iter().unzip();
        (least(first), least(longest))
    });
    let ratio = with.0.as_secs_f64() / plain.0.as_secs_f64();
    println!("first frame {:?}, with the plugin {:?}: {ratio:.2}", plain.0, with.0);
    println!("longest of the next 30 {:?}, with the plugin {:?}", plain.1, with.1);
    assert!(ratio <= 1.2);
}
