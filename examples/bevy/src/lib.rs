//! Screen-space subsurface scattering for Bevy's deferred renderer: light that enters skin comes out some
//! millimetres away, red farther than blue.
//!
//! Add [`SubsurfacePlugin`], [`SubsurfaceScattering`] to a camera and [`SubsurfaceProfile`] to the meshes
//! that are skin:
//!
//! ```no_run
//! use bevy::prelude::*;
//! use subsurface_bevy::{SubsurfacePlugin, SubsurfaceProfile, SubsurfaceScattering};
//!
//! fn setup(
//!     mut commands: Commands,
//!     mut meshes: ResMut<Assets<Mesh>>,
//!     mut materials: ResMut<Assets<StandardMaterial>>,
//! ) {
//!     commands.spawn((Camera3d::default(), SubsurfaceScattering::default()));
//!     commands.spawn((
//!         Mesh3d(meshes.add(Sphere::new(0.1))), // metres
//!         MeshMaterial3d(materials.add(Color::srgb(0.8, 0.6, 0.5))),
//!         SubsurfaceProfile::default(), // skin
//!     ));
//! }
//!
//! App::new()
//!     .insert_resource(bevy::pbr::DefaultOpaqueRendererMethod::deferred())
//!     .add_plugins((DefaultPlugins, SubsurfacePlugin))
//!     .add_systems(Startup, setup)
//!     .run();
//! ```
//!
//! # How a frame is drawn
//!
//! ```text
//! deferred prepass → copy of the lighting ids
//!   → light skin: diffuse light E, and all other light S, apart
//!   → scatter E                      (the crate `subsurface`)
//!   → compose skin: S + albedo × E   with fog, and tone mapping where the camera is not HDR
//! → Bevy's deferred lighting of all else → SSR → opaque → transparent → TAA → tone mapping
//! ```
//!
//! Meshes with a profile get a [`deferred_lighting_pass_id`] of their own, [`FIRST_PASS_ID`] or more, so
//! Bevy leaves their pixels to us. While something is missing — the component on the camera, a pipeline that
//! is not made yet — Bevy's own shader draws them, and the picture is Bevy's, bit for bit.
//!
//! [`deferred_lighting_pass_id`]: bevy::pbr::StandardMaterial::deferred_lighting_pass_id

mod effects;
mod gltf;
mod lighting;
mod pipelines;
mod profile;
mod settings;
mod view;
mod warnings;

use bevy::app::{App, Plugin, PostUpdate};
use bevy::asset::{AssetEventSystems, embedded_asset};
use bevy::core_pipeline::core_3d::main_opaque_pass_3d;
use bevy::core_pipeline::deferred::copy_lighting_id::copy_deferred_lighting_id;
use bevy::core_pipeline::schedule::{Core3d, Core3dSystems};
use bevy::ecs::schedule::IntoScheduleConfigs;
use bevy::pbr::deferred::{deferred_lighting, init_deferred_lighting_layout};
use bevy::render::extract_component::ExtractComponentPlugin;
use bevy::render::extract_resource::ExtractResourcePlugin;
use bevy::render::{GpuResourceAppExt, Render, RenderApp, RenderStartup, RenderSystems};

pub use gltf::SubsurfaceGltf;
pub use lighting::subsurface_lighting;
pub use profile::{FIRST_PASS_ID, SubsurfaceGaussian, SubsurfaceProfile, SubsurfaceProfiles};
pub use settings::{SubsurfaceDebug, SubsurfaceScattering};
pub use subsurface;
pub use view::ViewSubsurfaceTextures;

/// Adds subsurface scattering to Bevy.
///
/// See [`SubsurfaceScattering`] for cameras and [`SubsurfaceProfile`] for meshes. Add it after
/// `DefaultPlugins`; it needs `PbrPlugin`.
#[derive(Clone, Copy, Debug, Default)]
pub struct SubsurfacePlugin;

impl Plugin for SubsurfacePlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "lighting.wesl");
        app.register_type::<SubsurfaceScattering>()
            .register_type::<SubsurfaceProfile>()
            .init_resource::<SubsurfaceProfiles>()
            .init_resource::<SubsurfaceGltf>()
            .add_plugins((
                ExtractComponentPlugin::<SubsurfaceScattering>::default(),
                ExtractResourcePlugin::<SubsurfaceProfiles>::default(),
            ))
            .add_systems(
                PostUpdate,
                (gltf::mark_skin, profile::assign_profiles, warnings::warn_of_unscattered)
                    .chain()
                    .before(AssetEventSystems),
            );
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_gpu_resource::<effects::Effects>()
            .init_gpu_resource::<pipelines::Pipelines>()
            .add_systems(RenderStartup, pipelines::init_layouts.after(init_deferred_lighting_layout))
            .add_systems(
                Render,
                (
                    (effects::make_effects, pipelines::queue_pipelines).in_set(RenderSystems::Prepare),
                    view::prepare_views.in_set(RenderSystems::PrepareBindGroups),
                ),
            )
            .add_systems(
                Core3d,
                subsurface_lighting
                    // Bevy's lighting discards the ids when it is done.
                    .after(copy_deferred_lighting_id)
                    .before(deferred_lighting)
                    .before(main_opaque_pass_3d)
                    .in_set(Core3dSystems::MainPass),
            );
    }
}
