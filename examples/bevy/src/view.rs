//! What one camera needs: textures of its light, and a view of the effect.

use bevy::camera::{MainPassResolutionOverride, Viewport};
use bevy::core_pipeline::prepass::ViewPrepassTextures;
use bevy::ecs::prelude::{Commands, Component, Entity, Query, Res, ResMut, With, Without};
use bevy::log::warn_once;
use bevy::math::UVec2;
use bevy::render::camera::{ExtractedCamera, TemporalJitter};
use bevy::render::render_resource::{
    Extent3d, TextureDescriptor, TextureDimension, TextureUsages, UniformBuffer,
};
use bevy::render::renderer::{RenderDevice, RenderQueue};
use bevy::render::texture::{CachedTexture, TextureCache};
use bevy::render::view::ExtractedView;
use subsurface::{Frame, Plan, View};

use crate::effects::Effects;
use crate::pipelines::{LIGHT_FORMAT, PROFILE_ID_FORMAT, SkinUniform};
use crate::{FIRST_PASS_ID, SubsurfaceProfiles, SubsurfaceScattering};

/// The light of a camera's skin, in the render world, for passes that come after; there while the camera
/// scatters. All have the size of the
/// camera's target and are 0 where there is no skin. They can be copied from.
#[derive(Component, Clone)]
pub struct ViewSubsurfaceTextures {
    /// Diffuse light, without albedo, before it scatters: in units of white, Rgba16Float.
    pub irradiance: CachedTexture,
    /// The same after it has scattered.
    pub scattered: CachedTexture,
    /// All other light: specular, clear coat, emissive.
    pub specular: CachedTexture,
    /// Which of [`SubsurfaceProfiles::profiles`] a pixel has, counted from 1: R8Uint.
    pub profile_id: CachedTexture,
    /// The error that the plan of this frame was asked for: another than the camera's until its own is ready.
    pub max_error: f32,
}

/// The state of a camera that scatters.
#[derive(Component, Default)]
pub struct SkinView {
    pub view: View,
    pub uniform: UniformBuffer<SkinUniform>,
}

type CameraParts<'a> = (
    Entity,
    &'a SubsurfaceScattering,
    &'a ExtractedCamera,
    &'a ExtractedView,
    &'a ViewPrepassTextures,
    Option<&'a TemporalJitter>,
    Option<&'a MainPassResolutionOverride>,
    Option<&'a mut SkinView>,
);

/// Prepares the frame of each camera that scatters, and forgets those that do so no more.
pub(crate) fn prepare_views(
    mut commands: Commands,
    mut cameras: Query<CameraParts>,
    gone: Query<Entity, (With<SkinView>, Without<SubsurfaceScattering>)>,
    effects: Res<Effects>,
    profiles: Res<SubsurfaceProfiles>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut cache: ResMut<TextureCache>,
) {
    for entity in &gone {
        commands.entity(entity).remove::<(SkinView, ViewSubsurfaceTextures)>();
    }
    for (entity, settings, camera, view, prepass, jitter, size, state) in &mut cameras {
        let Some(mut state) = state else {
            commands.entity(entity).insert(SkinView::default());
            continue;
        };
        let effect = effects.get(&profiles, settings);
        let (Some(effect), Some(depth)) = (effect, prepass.depth_only_view()) else {
            commands.entity(entity).remove::<ViewSubsurfaceTextures>();
            continue;
        };
        let textures = ViewSubsurfaceTextures::new(&mut cache, &device, prepass.size, effect.plan());
        let viewport = Viewport::from_viewport_and_override(camera.viewport.as_ref(), size);
        let viewport = viewport.map(|v| subsurface::Viewport {
            x: v.physical_position.x,
            y: v.physical_position.y,
            width: v.physical_size.x,
            height: v.physical_size.y,
        });
        let pixels = viewport.map_or([prepass.size.width, prepass.size.height], |v| [v.width, v.height]);
        let mut projection = view.clip_from_view;
        if let Some(jitter) = jitter {
            jitter.jitter_projection(&mut projection, UVec2::from_array(pixels).as_vec2());
        }
        let light = &textures.irradiance.default_view;
        let mut frame = Frame::new(light, depth, projection.to_cols_array_2d());
        frame.profile_id = Some(&*textures.profile_id.default_view);
        frame.mm_per_unit = settings.mm_per_unit;
        frame.viewport = viewport;
        if let Err(error) = state.view.prepare(device.wgpu_device(), &queue, effect, &frame) {
            warn_once!("A camera does not scatter: {error}.");
            commands.entity(entity).remove::<ViewSubsurfaceTextures>();
            continue;
        }
        state.uniform.set(SkinUniform {
            first_pass_id: FIRST_PASS_ID.into(),
            strength: settings.strength.clamp(0.0, 1.0),
            debug: settings.debug.code(),
            padding: 0,
        });
        state.uniform.write_buffer(&device, &queue);
        commands.entity(entity).insert(textures);
    }
}

impl ViewSubsurfaceTextures {
    fn new(cache: &mut TextureCache, device: &RenderDevice, size: Extent3d, plan: &Plan) -> Self {
        let mut texture = |label, format| {
            let descriptor = TextureDescriptor {
                label: Some(label),
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format,
                usage: TextureUsages::RENDER_ATTACHMENT
                    | TextureUsages::TEXTURE_BINDING
                    | TextureUsages::COPY_SRC,
                view_formats: &[],
            };
            cache.get(device, descriptor)
        };
        Self {
            irradiance: texture("subsurface_irradiance", LIGHT_FORMAT),
            scattered: texture("subsurface_scattered", LIGHT_FORMAT),
            specular: texture("subsurface_specular", LIGHT_FORMAT),
            profile_id: texture("subsurface_profile_id", PROFILE_ID_FORMAT),
            max_error: plan.max_error(),
        }
    }
}
