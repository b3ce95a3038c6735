//! The smallest scene: a ball of skin, lit from the side.

use bevy::pbr::DefaultOpaqueRendererMethod;
use bevy::prelude::*;
use subsurface_bevy::{SubsurfacePlugin, SubsurfaceProfile, SubsurfaceScattering};

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, SubsurfacePlugin))
        .insert_resource(DefaultOpaqueRendererMethod::deferred())
        .add_systems(Startup, setup)
        .run();
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    commands.spawn((
        Mesh3d(meshes.add(Sphere::new(0.04).mesh().uv(64, 48))), // metres
        MeshMaterial3d(materials.add(Color::srgb(0.8, 0.6, 0.5))),
        SubsurfaceProfile::default(), // skin
    ));
    commands.spawn((
        DirectionalLight::default(),
        Transform::from_xyz(-1.0, 0.5, 0.1).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Camera3d::default(),
        Projection::from(PerspectiveProjection { near: 0.01, ..default() }),
        Transform::from_xyz(0.0, 0.0, 0.15),
        SubsurfaceScattering::default(),
    ));
}
