//! Lights skin, scatters its diffuse light, and puts the picture together.

use bevy::core_pipeline::deferred::copy_lighting_id::DeferredLightingIdDepthTexture;
use bevy::core_pipeline::prepass::ViewPrepassTextures;
use bevy::ecs::prelude::Res;
use bevy::log::warn_once;
use bevy::pbr::MeshViewBindGroup;
use bevy::pbr::deferred::DeferredLightingPipeline;
use bevy::render::diagnostic::RecordDiagnostics;
use bevy::render::render_resource::{
    BindGroup, BindGroupEntries, LoadOp, Operations, PipelineCache, RenderPassColorAttachment,
    RenderPassDepthStencilAttachment, RenderPassDescriptor, RenderPipeline, StoreOp,
};
use bevy::render::renderer::{RenderContext, ViewQuery};
use bevy::render::texture::CachedTexture;
use bevy::render::view::ViewTarget;

use crate::SubsurfaceProfiles;
use crate::pipelines::{Layouts, SkinPipelines};
use crate::view::{SkinView, ViewSubsurfaceTextures};

type Parts<'a> = (
    &'a ViewTarget,
    &'a MeshViewBindGroup,
    &'a ViewPrepassTextures,
    &'a DeferredLightingIdDepthTexture,
    &'a DeferredLightingPipeline,
    Option<(&'a SkinView, &'a SkinPipelines, &'a ViewSubsurfaceTextures)>,
);

/// Draws the skin of a camera. Systems of your own that read or change lit skin run after it.
pub fn subsurface_lighting(
    view: ViewQuery<Parts>,
    cache: Res<PipelineCache>,
    layouts: Res<Layouts>,
    profiles: Res<SubsurfaceProfiles>,
    mut context: RenderContext,
) {
    if profiles.profiles().next().is_none() {
        return;
    }
    let (target, mesh_view, prepass, ids, bevys, scattering) = view.into_inner();
    let drawer = Drawer { mesh_view, ids };
    if let Some((state, pipelines, textures)) = scattering
        && let Some(pass_id) = &prepass.deferred_lighting_pass_id
        && let Some(uniform) = state.uniform.binding()
        && let Some(light) = cache.get_render_pipeline(pipelines.light)
        && let Some(compose) = cache.get_render_pipeline(pipelines.compose)
    {
        let ViewSubsurfaceTextures { irradiance, scattered, specular, profile_id, .. } = textures;
        let device = context.render_device().clone();
        let group = device.create_bind_group(
            "subsurface_light",
            &cache.get_bind_group_layout(&layouts.light),
            &BindGroupEntries::with_indices(((0, uniform.clone()), (1, &pass_id.texture.default_view))),
        );
        let attachments = [irradiance, specular, profile_id].map(cleared);
        drawer.draw(&mut context, "subsurface_light", &attachments, light, &group);
        if let Err(error) = state.view.render(context.command_encoder(), &scattered.default_view) {
            warn_once!("A camera does not scatter: {error}.");
        } else {
            let group = device.create_bind_group(
                "subsurface_compose",
                &cache.get_bind_group_layout(&layouts.compose),
                &BindGroupEntries::with_indices((
                    (0, uniform),
                    (2, &specular.default_view),
                    (3, &irradiance.default_view),
                    (4, &scattered.default_view),
                )),
            );
            let attachments = [Some(target.get_color_attachment())];
            drawer.draw(&mut context, "subsurface_compose", &attachments, compose, &group);
            return;
        }
    }
    // Bevy's own pipeline, once for each profile.
    let Some(plain) = cache.get_render_pipeline(bevys.pipeline_id) else {
        return;
    };
    for (id, _) in layouts.plain_ids.iter().zip(profiles.profiles()) {
        let Some(id) = id.binding() else {
            continue;
        };
        let group = context.render_device().create_bind_group(
            "subsurface_plain",
            &cache.get_bind_group_layout(&layouts.plain),
            &BindGroupEntries::single(id),
        );
        let attachments = [Some(target.get_color_attachment())];
        drawer.draw(&mut context, "subsurface_plain", &attachments, plain, &group);
    }
}

/// A target that is 0 where nothing is drawn.
fn cleared(texture: &CachedTexture) -> Option<RenderPassColorAttachment<'_>> {
    Some(RenderPassColorAttachment {
        view: &texture.default_view,
        depth_slice: None,
        resolve_target: None,
        ops: Operations { load: LoadOp::Clear(Default::default()), store: StoreOp::Store },
    })
}

/// What all draws of skin share.
struct Drawer<'a> {
    mesh_view: &'a MeshViewBindGroup,
    ids: &'a DeferredLightingIdDepthTexture,
}

impl Drawer<'_> {
    /// Covers the pixels of skin, which the depth test finds by their ids.
    fn draw(
        &self,
        context: &mut RenderContext,
        label: &'static str,
        color_attachments: &[Option<RenderPassColorAttachment>],
        pipeline: &RenderPipeline,
        group: &BindGroup,
    ) {
        let diagnostics = context.diagnostic_recorder();
        let diagnostics = diagnostics.as_deref();
        let mut pass = context.begin_tracked_render_pass(RenderPassDescriptor {
            label: Some(label),
            color_attachments,
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: &self.ids.texture.default_view,
                depth_ops: None, // read alone
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        let span = diagnostics.pass_span(&mut pass, label);
        pass.set_render_pipeline(pipeline);
        pass.set_bind_group(0, &self.mesh_view.main, &self.mesh_view.main_offsets);
        pass.set_bind_group(1, &self.mesh_view.binding_array, &[]);
        pass.set_bind_group(2, group, &[]);
        pass.draw(0..3, 0..1);
        span.end(&mut pass);
    }
}
