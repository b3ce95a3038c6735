//! The pipelines of skin, variants of the one by which Bevy lights all else.

use std::collections::HashMap;

use bevy::asset::{AssetServer, Handle, load_embedded_asset};
use bevy::core_pipeline::prepass::DeferredPrepass;
use bevy::ecs::prelude::{Commands, Component, Entity, Query, Res, ResMut, Resource, With};
use bevy::pbr::deferred::{DeferredLightingLayout, DeferredLightingPipeline, PbrDeferredLightingDepthId};
use bevy::pbr::{MeshPipelineKey, ViewKeyCache};
use bevy::render::camera::ExtractedCamera;
use bevy::render::render_resource::binding_types::{texture_2d, uniform_buffer};
use bevy::render::render_resource::{
    BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedRenderPipelineId, ColorTargetState,
    ColorWrites, CompareFunction, PipelineCache, RenderPipelineDescriptor, ShaderStages, ShaderType,
    SpecializedRenderPipeline, TextureFormat, TextureSampleType, UniformBuffer,
};
use bevy::render::renderer::{RenderDevice, RenderQueue};
use bevy::render::view::ExtractedView;
use bevy::shader::Shader;

use crate::{FIRST_PASS_ID, SubsurfaceScattering};

/// Light, in units of white.
pub(crate) const LIGHT_FORMAT: TextureFormat = TextureFormat::Rgba16Float;
/// Ids of profiles, counted from 1.
pub(crate) const PROFILE_ID_FORMAT: TextureFormat = TextureFormat::R8Uint;

/// As in lighting.wesl; begins as Bevy's `PbrDeferredLightingDepthId`, since its vertex shader reads it.
#[derive(Clone, Copy, Default, ShaderType)]
pub struct SkinUniform {
    pub first_pass_id: u32,
    pub strength: f32,
    pub debug: u32,
    pub padding: u32,
}

/// What the pipelines of a camera read.
#[derive(Resource)]
pub struct Layouts {
    /// Of Bevy's own pipeline, which reads nothing but the lighting id to draw.
    pub plain: BindGroupLayoutDescriptor,
    /// The ids of all profiles.
    pub plain_ids: Vec<UniformBuffer<PbrDeferredLightingDepthId>>,
    pub light: BindGroupLayoutDescriptor,
    pub compose: BindGroupLayoutDescriptor,
    shader: Handle<Shader>,
}

/// The pipelines of a camera that scatters.
#[derive(Component, Clone, Copy)]
pub struct SkinPipelines {
    /// Lights skin, diffuse light apart.
    pub light: CachedRenderPipelineId,
    /// Puts it together again.
    pub compose: CachedRenderPipelineId,
}

/// All that were asked for.
#[derive(Resource, Default)]
pub(crate) struct Pipelines(HashMap<MeshPipelineKey, SkinPipelines>);

pub(crate) fn init_layouts(
    mut commands: Commands,
    bevys: Option<Res<DeferredLightingLayout>>,
    assets: Res<AssetServer>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let Some(bevys) = bevys else {
        return; // a renderer without Bevy's deferred lighting
    };
    let [.., plain] = &bevys.specialize(MeshPipelineKey::NONE).layout[..] else {
        return;
    };
    let plain_ids = (FIRST_PASS_ID..=u8::MAX).map(|id| {
        let mut uniform = UniformBuffer::from(PbrDeferredLightingDepthId::new(id));
        uniform.write_buffer(&device, &queue);
        uniform
    });
    let light = texture_2d(TextureSampleType::Float { filterable: false });
    let ids = texture_2d(TextureSampleType::Uint);
    let uniform = uniform_buffer::<SkinUniform>(false).visibility(ShaderStages::VERTEX_FRAGMENT);
    commands.insert_resource(Layouts {
        plain: plain.clone(),
        plain_ids: plain_ids.collect(),
        light: BindGroupLayoutDescriptor::new(
            "subsurface_light_layout",
            &BindGroupLayoutEntries::with_indices(ShaderStages::FRAGMENT, ((0, uniform), (1, ids))),
        ),
        compose: BindGroupLayoutDescriptor::new(
            "subsurface_compose_layout",
            &BindGroupLayoutEntries::with_indices(
                ShaderStages::FRAGMENT,
                ((0, uniform), (2, light), (3, light), (4, light)),
            ),
        ),
        shader: load_embedded_asset!(assets.as_ref(), "lighting.wesl"),
    });
}

/// Queues the pipelines of each camera that scatters, once Bevy's own is there; Bevy makes them off the render
/// thread.
pub(crate) fn queue_pipelines(
    mut commands: Commands,
    cameras: Query<
        (Entity, &ExtractedView, &DeferredLightingPipeline),
        (With<ExtractedCamera>, With<DeferredPrepass>, With<SubsurfaceScattering>),
    >,
    cache: Res<PipelineCache>,
    keys: Res<ViewKeyCache>,
    bevys: Option<Res<DeferredLightingLayout>>,
    layouts: Option<Res<Layouts>>,
    mut pipelines: ResMut<Pipelines>,
) {
    let (Some(bevys), Some(layouts)) = (bevys, layouts) else {
        return;
    };
    for (entity, view, of_bevy) in &cameras {
        if cache.get_render_pipeline(of_bevy.pipeline_id).is_none() {
            continue;
        }
        let Some(key) = keys.get(&view.retained_view_entity) else {
            continue;
        };
        let pipelines = pipelines.0.entry(*key).or_insert_with(|| SkinPipelines {
            light: cache.queue_render_pipeline(layouts.light(bevys.specialize(*key))),
            compose: cache.queue_render_pipeline(layouts.compose(bevys.specialize(*key))),
        });
        commands.entity(entity).insert(*pipelines);
    }
}

impl Layouts {
    fn light(&self, bevys: RenderPipelineDescriptor) -> RenderPipelineDescriptor {
        let targets = [LIGHT_FORMAT, LIGHT_FORMAT, PROFILE_ID_FORMAT]
            .map(|format| Some(ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL }));
        let mut descriptor = self.variant(bevys, "subsurface_light", &self.light);
        if let Some(fragment) = &mut descriptor.fragment {
            fragment.targets = targets.into();
            // The light has neither fog nor a tone yet.
            fragment.shader_defs.retain(|def| *def != "TONEMAP_IN_SHADER".into());
        }
        descriptor
    }

    fn compose(&self, bevys: RenderPipelineDescriptor) -> RenderPipelineDescriptor {
        self.variant(bevys, "subsurface_compose", &self.compose)
    }

    /// Bevy's pipeline with an entry point of our shader, named as the label, that draws all profiles at once:
    /// where the lighting id is at least the first one.
    fn variant(
        &self,
        bevys: RenderPipelineDescriptor,
        label: &'static str,
        layout: &BindGroupLayoutDescriptor,
    ) -> RenderPipelineDescriptor {
        let mut descriptor = bevys;
        descriptor.label = Some(label.into());
        if let Some(depth) = &mut descriptor.depth_stencil {
            depth.depth_compare = Some(CompareFunction::LessEqual);
        }
        if let Some(last) = descriptor.layout.last_mut() {
            *last = layout.clone();
        }
        if let Some(fragment) = &mut descriptor.fragment {
            fragment.shader = self.shader.clone();
            fragment.entry_point = Some(label.into());
        }
        descriptor
    }
}
