//! Two balls of skin on a floor that is none, lit from the side.

use bevy::camera::Hdr;
use bevy::camera::RenderTarget;
use bevy::camera::visibility::RenderLayers;
use bevy::core_pipeline::prepass::{DeferredPrepass, DepthPrepass};
use bevy::core_pipeline::tonemapping::{DebandDither, Tonemapping};
use bevy::light::CascadeShadowConfigBuilder;
use bevy::prelude::*;
use bevy::render::render_resource::TextureFormat;
use subsurface_bevy::SubsurfaceProfile;

use crate::stage::{Prop, Stage};

/// Width and height of pictures: 2 pixels a mm.
pub const SIZE: [u32; 2] = [256, 256];
pub const HDR: TextureFormat = TextureFormat::Rgba16Float;

/// A mesh that is drawn.
pub fn add_mesh(
    world: &mut World,
    mesh: impl Into<Mesh>,
    material: impl Into<StandardMaterial>,
    place: Transform,
) -> Entity {
    let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
    world.spawn((Prop, Mesh3d(mesh), MeshMaterial3d(material), place)).id()
}

pub fn skin_color() -> StandardMaterial {
    StandardMaterial { base_color: Color::srgb(0.8, 0.6, 0.5), perceptual_roughness: 0.45, ..default() }
}

/// Adds the balls, of which the first throws a shadow on the second, and the floor.
pub fn add_balls(world: &mut World, profiles: Option<[SubsurfaceProfile; 2]>) -> [Entity; 2] {
    let ball = |radius: f32| Sphere::new(radius).mesh().uv(48, 32);
    let [near, far] =
        [(ball(0.022), Vec3::new(-0.022, 0.0, 0.01)), (ball(0.035), Vec3::new(0.025, 0.0, -0.01))]
            .map(|(mesh, at)| add_mesh(world, mesh, skin_color(), Transform::from_translation(at)));
    if let Some([of_near, of_far]) = profiles {
        world.entity_mut(near).insert(of_near);
        world.entity_mut(far).insert(of_far);
    }
    let floor = StandardMaterial { perceptual_roughness: 0.3, ..Color::srgb(0.2, 0.5, 0.3).into() };
    let below = Transform::from_xyz(0.0, -0.045, 0.0);
    add_mesh(world, Cuboid::new(0.3, 0.02, 0.3), floor, below);
    [near, far]
}

/// A light from the left, with shadows.
pub fn add_sun(world: &mut World) -> Entity {
    let cascades =
        CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 0.6, ..default() }.build();
    let sun = DirectionalLight { illuminance: 3000.0, shadow_maps_enabled: true, ..default() };
    let from = Transform::from_xyz(-1.0, 0.6, 0.7).looking_at(Vec3::ZERO, Vec3::Y);
    world.spawn((Prop, sun, cascades, from)).id()
}

/// A deferred camera as Bevy has it, its picture as it was lit.
pub fn add_camera(world: &mut World, target: &Handle<Image>) -> Entity {
    let camera = (
        Prop,
        Camera3d::default(),
        RenderTarget::Image(target.clone().into()),
        Hdr,
        Tonemapping::None,
        DebandDither::Disabled,
        Msaa::Off,
        DepthPrepass,
        DeferredPrepass,
        Projection::from(PerspectiveProjection { near: 0.01, ..default() }),
        Transform::from_xyz(0.0, 0.02, 0.155).looking_at(Vec3::ZERO, Vec3::Y),
        RenderLayers::layer(0),
    );
    world.spawn(camera).id()
}

/// Which pixels are skin of a camera that scatters: by the ids that the plugin found.
pub fn skin_mask(stage: &mut Stage, camera: Entity) -> Vec<bool> {
    let textures = stage.textures(camera);
    let ids = stage.read_texture(&textures.profile_id.texture);
    ids.pixels.iter().map(|p| p[0] > 0.0).collect()
}
