//! A head, a light that turns about it, and a slider for the error.
//!
//! ```sh
//! cargo run --release --example head [-- FILE.glb [MATERIAL…]]
//! ```
//!
//! The materials named, besides those with the extra `subsurface_profile`, are skin. Space turns scattering
//! off and on, D shows the light before it scatters, after it, and the difference; L stops the light.

mod smooth;

use std::path::PathBuf;

use bevy::asset::UnapprovedPathMode;
use bevy::light::CascadeShadowConfigBuilder;
use bevy::pbr::DefaultOpaqueRendererMethod;
use bevy::picking::hover::Hovered;
use bevy::prelude::*;
use bevy::ui_widgets::{
    Slider, SliderRange, SliderThumb, SliderValue, TrackClick, observe, slider_self_update,
};
use subsurface_bevy::{
    SubsurfaceDebug, SubsurfaceGltf, SubsurfacePlugin, SubsurfaceProfile, SubsurfaceScattering,
};

/// The model to show, which may lie anywhere.
#[derive(Resource)]
struct Model(PathBuf);

const BUILT_IN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../lab/src/compare/head.glb");

/// Turns about the head.
#[derive(Component)]
struct Sun;

/// Says what is shown.
#[derive(Component)]
struct Label;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let model = arguments.next().unwrap_or_else(|| BUILT_IN.into());
    let materials = arguments.map(|name| (name, SubsurfaceProfile::default())).collect();
    let assets = AssetPlugin { unapproved_path_mode: UnapprovedPathMode::Allow, ..default() };
    App::new()
        .add_plugins((DefaultPlugins.set(assets), SubsurfacePlugin))
        .insert_resource(DefaultOpaqueRendererMethod::deferred())
        .insert_resource(SubsurfaceGltf { materials, ..default() })
        .insert_resource(ClearColor(Color::BLACK))
        .insert_resource(Model(model.into()))
        .add_systems(Startup, (set_scene, set_slider))
        .add_systems(Update, (smooth_built_in, turn_light, take_keys, take_slider, write_label).chain())
        .run();
}

fn set_scene(mut commands: Commands, assets: Res<AssetServer>, model: Res<Model>) {
    let scene = GltfAssetLabel::Scene(0).from_asset(model.0.clone());
    commands.spawn(WorldAssetRoot(assets.load(scene)));
    let sun = DirectionalLight { illuminance: 8000.0, shadow_maps_enabled: true, ..default() };
    let cascades =
        CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 2.0, ..default() }.build();
    commands.spawn((Sun, sun, cascades, Transform::default()));
    commands.spawn((
        Camera3d::default(),
        AmbientLight { brightness: 100.0, ..default() },
        Projection::from(PerspectiveProjection { near: 0.05, fov: 0.5, ..default() }),
        Transform::from_xyz(0.0, 0.0, 0.75),
        SubsurfaceScattering::default(),
    ));
}

/// The built-in head has no normals.
fn smooth_built_in(
    model: Res<Model>,
    spawned: Query<&Mesh3d, Added<Mesh3d>>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    if model.0 != PathBuf::from(BUILT_IN) {
        return;
    }
    for mesh in &spawned {
        if let Some(mut mesh) = meshes.get_mut(mesh.id()) {
            smooth::smooth_normals(&mut mesh);
        }
    }
}

fn set_slider(mut commands: Commands) {
    let bar = Node { height: px(6), margin: UiRect::top(px(5)), ..default() };
    let track = Node {
        position_type: PositionType::Absolute,
        left: px(0),
        right: px(16),
        top: px(0),
        bottom: px(0),
        ..default()
    };
    let thumb = Node {
        position_type: PositionType::Absolute,
        width: px(16),
        height: px(16),
        border_radius: BorderRadius::MAX,
        ..default()
    };
    let slider = (
        Node { width: px(260), height: px(16), flex_direction: FlexDirection::Column, ..default() },
        Slider { track_click: TrackClick::Snap, ..default() },
        SliderValue(255.0f32.log2()),
        SliderRange::new(4.0, 9.0),
        Hovered::default(),
        observe(slider_self_update),
        children![
            (bar, BackgroundColor(Color::srgb(0.2, 0.2, 0.2))),
            (track, children![(thumb, SliderThumb, BackgroundColor(Color::srgb(0.9, 0.5, 0.4)))]),
        ],
    );
    let corner = Node {
        position_type: PositionType::Absolute,
        left: px(16),
        bottom: px(16),
        flex_direction: FlexDirection::Column,
        row_gap: px(8),
        ..default()
    };
    commands.spawn((corner, children![(Label, Text::default()), slider]));
}

fn turn_light(
    time: Res<Time>,
    keys: Res<ButtonInput<KeyCode>>,
    mut sun: Query<&mut Transform, With<Sun>>,
    mut stopped: Local<bool>,
    mut angle: Local<f32>,
) {
    *stopped ^= keys.just_pressed(KeyCode::KeyL);
    if !*stopped {
        *angle += time.delta_secs() * 0.5;
    }
    for mut sun in &mut sun {
        let from = Vec3::new(angle.sin(), 0.4, angle.cos());
        *sun = Transform::from_translation(from).looking_at(Vec3::ZERO, Vec3::Y);
    }
}

/// Space and D.
fn take_keys(
    mut commands: Commands,
    keys: Res<ButtonInput<KeyCode>>,
    mut cameras: Query<(Entity, Option<&mut SubsurfaceScattering>), With<Camera3d>>,
) {
    for (camera, scattering) in &mut cameras {
        match scattering {
            Some(_) if keys.just_pressed(KeyCode::Space) => {
                commands.entity(camera).remove::<SubsurfaceScattering>();
            }
            None if keys.just_pressed(KeyCode::Space) => {
                commands.entity(camera).insert(SubsurfaceScattering::default());
            }
            Some(mut scattering) if keys.just_pressed(KeyCode::KeyD) => {
                scattering.debug = match scattering.debug {
                    SubsurfaceDebug::Off => SubsurfaceDebug::Irradiance,
                    SubsurfaceDebug::Irradiance => SubsurfaceDebug::Scattered,
                    SubsurfaceDebug::Scattered => SubsurfaceDebug::Difference,
                    SubsurfaceDebug::Difference => SubsurfaceDebug::Off,
                };
            }
            _ => {}
        }
    }
}

/// The slider holds log₂ of 1/error, in steps of a quarter of an octave.
fn take_slider(
    sliders: Query<(&SliderValue, &SliderRange, &Children)>,
    children: Query<&Children>,
    mut thumbs: Query<&mut Node, With<SliderThumb>>,
    mut cameras: Query<&mut SubsurfaceScattering>,
) {
    for (value, range, parts) in &sliders {
        let max_error = if (value.0 - 255.0f32.log2()).abs() < 0.05 {
            SubsurfaceScattering::default().max_error
        } else {
            (-(value.0 * 4.0).round() / 4.0).exp2()
        };
        for mut scattering in &mut cameras {
            if scattering.max_error != max_error {
                scattering.max_error = max_error;
            }
        }
        for part in parts.iter().flat_map(|part| children.iter_descendants(part)) {
            if let Ok(mut thumb) = thumbs.get_mut(part) {
                thumb.left = percent(range.thumb_position(value.0) * 100.0);
            }
        }
    }
}

fn write_label(
    cameras: Query<Option<&SubsurfaceScattering>, With<Camera3d>>,
    mut labels: Query<&mut Text, With<Label>>,
) {
    for (scattering, mut label) in cameras.iter().zip(&mut labels) {
        let text = match scattering {
            None => "No scattering (space)".into(),
            Some(SubsurfaceScattering { max_error, debug, .. }) => {
                let shown = match debug {
                    SubsurfaceDebug::Off => String::new(),
                    debug => format!(", {debug:?}"),
                };
                format!("Error at most 1/{:.0} of white{shown} (space, D, L)", 1.0 / max_error)
            }
        };
        if label.0 != text {
            label.0 = text;
        }
    }
}
