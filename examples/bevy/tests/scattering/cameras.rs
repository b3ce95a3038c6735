//! Several cameras and several profiles: each as if it were alone.

use bevy::camera::Viewport;
use bevy::prelude::*;
use subsurface_bevy::{SubsurfaceGaussian, SubsurfaceProfile, SubsurfaceScattering};

use crate::picture::Picture;
use crate::scene::{HDR, SIZE, add_balls, add_camera, add_sun, skin_mask};
use crate::stage::Stage;

fn skin() -> Option<[SubsurfaceProfile; 2]> {
    Some([SubsurfaceProfile::default(), SubsurfaceProfile::default()])
}

fn wax() -> SubsurfaceProfile {
    let gaussian = SubsurfaceGaussian { variance_mm2: 4.0, weight: Vec3::ONE };
    SubsurfaceProfile { gaussians: vec![gaussian] }
}

/// How a camera looks.
#[derive(Clone, Copy)]
struct Look {
    from: Vec3,
    fov: f32,
    settings: SubsurfaceScattering,
    /// x, y, width and height.
    viewport: Option<[u32; 4]>,
    order: isize,
    clear_color: ClearColorConfig,
}

fn add_look(world: &mut World, target: &Handle<Image>, look: &Look) -> Entity {
    let camera = add_camera(world, target);
    let viewport = look.viewport.map(|[x, y, width, height]| Viewport {
        physical_position: UVec2::new(x, y),
        physical_size: UVec2::new(width, height),
        ..default()
    });
    world.entity_mut(camera).insert((
        Camera { order: look.order, viewport, clear_color: look.clear_color, ..default() },
        Transform::from_translation(look.from).looking_at(Vec3::ZERO, Vec3::Y),
        Projection::from(PerspectiveProjection { fov: look.fov, near: 0.01, ..default() }),
        look.settings,
    ));
    camera
}

/// The pictures of some cameras at once, one target each or all on one.
fn pictures(stage: &mut Stage, looks: &[Look], one_target: bool) -> Vec<Picture> {
    let shared = stage.image(SIZE, HDR);
    let targets: Vec<_> =
        looks.iter().map(|_| if one_target { shared.clone() } else { stage.image(SIZE, HDR) }).collect();
    let cameras: Vec<Entity> = stage.set(|world| {
        add_balls(world, skin());
        add_sun(world);
        looks.iter().zip(&targets).map(|(look, target)| add_look(world, target, look)).collect()
    });
    stage.settle(looks.len());
    // Until its own plan is ready a camera scatters by another's.
    let has_its_own = |stage: &mut Stage, (look, camera): (&Look, &Entity)| {
        stage.textures(*camera).max_error == look.settings.max_error
    };
    while !looks.iter().zip(&cameras).all(|pair| has_its_own(stage, pair)) {
        std::thread::sleep(std::time::Duration::from_millis(5));
        stage.update();
    }
    targets.iter().map(|target| stage.read(target)).collect()
}

#[test]
fn each_camera_is_as_if_alone() {
    let mut stage = Stage::new(true);
    let left = Look {
        from: Vec3::new(-0.05, 0.02, 0.15),
        fov: 0.6,
        settings: SubsurfaceScattering::default(),
        viewport: None,
        order: 0,
        clear_color: ClearColorConfig::Default,
    };
    let right = Look {
        from: Vec3::new(0.08, 0.03, 0.1),
        fov: 0.9,
        settings: SubsurfaceScattering { max_error: 0.02, ..default() },
        order: 1,
        ..left
    };
    let alone = [left, right].map(|look| pictures(&mut stage, &[look], false));
    let both = pictures(&mut stage, &[left, right], false);
    for (picture, alone) in both.iter().zip(&alone) {
        assert_eq!(picture.difference(&alone[0], |_| true), (0.0, 0));
    }
    assert!(alone[0][0].difference(&alone[1][0], |_| true).0 > 0.1);

    // Side by side on one target.
    let left = Look { viewport: Some([0, 0, 128, 256]), ..left };
    let right = Look { viewport: Some([128, 16, 120, 230]), clear_color: ClearColorConfig::None, ..right };
    let of_right = |i: usize| {
        let (x, y) = (i as u32 % SIZE[0], i as u32 / SIZE[0]);
        (128..248).contains(&x) && (16..246).contains(&y)
    };
    let both = pictures(&mut stage, &[left, right], true);
    let alone = pictures(&mut stage, &[left], true);
    assert_eq!(both[0].difference(&alone[0], |i| i as u32 % SIZE[0] < 128), (0.0, 0));
    let alone =
        pictures(&mut stage, &[Look { order: 0, clear_color: ClearColorConfig::Default, ..right }], true);
    assert_eq!(both[0].difference(&alone[0], of_right), (0.0, 0));
}

/// The picture of the balls with these profiles by the exact sum, and which pixels are skin of them.
fn with_profiles(stage: &mut Stage, profiles: [Option<SubsurfaceProfile>; 2]) -> (Picture, Vec<bool>) {
    let target = stage.image(SIZE, HDR);
    let camera = stage.set(|world| {
        for (ball, profile) in add_balls(world, None).into_iter().zip(profiles) {
            if let Some(profile) = profile {
                world.entity_mut(ball).insert(profile);
            }
        }
        add_sun(world);
        let camera = add_camera(world, &target);
        let exact = SubsurfaceScattering { max_error: 0.0, ..default() };
        world.entity_mut(camera).insert(exact);
        camera
    });
    stage.settle(1);
    (stage.read(&target), skin_mask(stage, camera))
}

#[test]
fn each_profile_is_as_if_alone() {
    let one = SubsurfaceProfile::default();
    // A stage of its own for each, since a profile keeps its place.
    let (both, _) = with_profiles(&mut Stage::new(true), [Some(one.clone()), Some(wax())]);
    for profiles in [[Some(one.clone()), None], [None, Some(wax())]] {
        let (alone, mask) = with_profiles(&mut Stage::new(true), profiles);
        let (most, pixels) = both.difference(&alone, |i| mask[i]);
        println!("two profiles: {pixels} pixels differ from one alone, {most:.6} at most");
        assert_eq!((most, pixels), (0.0, 0));
    }
}

#[test]
fn more_than_sixteen_profiles_leave_sixteen() {
    use subsurface_bevy::{FIRST_PASS_ID, SubsurfaceProfiles};
    let mut profiles = SubsurfaceProfiles::default();
    let of = |i: u32| SubsurfaceProfile {
        gaussians: vec![SubsurfaceGaussian { variance_mm2: i as f32, weight: Vec3::ONE }],
    };
    for i in 0..16 {
        assert_eq!(profiles.pass_id(&of(i)).map(u32::from), Ok(u32::from(FIRST_PASS_ID) + i));
    }
    assert_eq!(profiles.pass_id(&of(3)), Ok(FIRST_PASS_ID + 3));
    let refused = profiles.pass_id(&of(16)).expect_err("too many");
    assert_eq!(refused.to_string(), "profiles: got 17, needs 1 to 16");
}
