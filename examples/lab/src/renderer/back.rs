//! The surface right behind the visible one, as a host draws it for light that comes through thin parts. Driver
//! of `back.wgsl`.

use subsurface::BackLayer;
use wgpu::{TextureFormat, TextureView};

use super::mesh::Mesh;
use super::{DEPTH, Gpu, IRRADIANCE, Renderer};
use crate::passes::{self, CLEAR, Pipeline};

/// Textures of the back layer, and the pass that draws it.
pub struct BackRenderer {
    irradiance: TextureView,
    depth: TextureView,
    profile_id: TextureView,
    draw: wgpu::RenderPipeline,
    visible: wgpu::BindGroup,
}

impl BackRenderer {
    /// Behind what `renderer` draws.
    pub fn new(gpu: &Gpu, renderer: &Renderer) -> Self {
        let label = "subsurface_lab::renderer back";
        let target = |format| gpu.target(label, renderer.size, format);
        let wgsl = [include_str!("material.wgsl"), super::lighting::SHADER, include_str!("back.wgsl")];
        let shader = passes::module(&gpu.device, label, &wgsl);
        let (layout, visible) = super::textures(gpu, label, None, &[&renderer.gbuffer.depth]);
        let draw = Pipeline {
            groups: &[
                Some(&renderer.camera_layout),
                Some(&renderer.material_layout),
                Some(&renderer.lights.layout),
                Some(&layout),
            ],
            targets: &[IRRADIANCE.into(), TextureFormat::R8Uint.into()],
            buffers: &[Mesh::VERTEX_LAYOUT],
            depth_stencil: Some(super::depth_state(wgpu::CompareFunction::Greater, true)),
            ..Pipeline::of(label, &shader, ["vs_screen", "fs_back"])
        }
        .make(&gpu.device);
        Self {
            irradiance: target(IRRADIANCE),
            depth: target(DEPTH),
            profile_id: target(TextureFormat::R8Uint),
            draw,
            visible,
        }
    }

    /// Draws and lights what is behind the frame that `renderer` drew last: of skin alone.
    pub fn render(&self, gpu: &Gpu, renderer: &Renderer) {
        let targets = [(&self.irradiance, CLEAR), (&self.profile_id, CLEAR)];
        let depth = super::depth_attachment(&self.depth, wgpu::LoadOp::Clear(0.0));
        gpu.run(|encoder| {
            let label = "subsurface_lab::renderer back";
            let mut pass = passes::begin(encoder, label, &targets, Some(depth));
            pass.set_pipeline(&self.draw);
            pass.set_bind_group(0, &renderer.camera_group, &[]);
            pass.set_bind_group(2, &renderer.lights.group, &[]);
            pass.set_bind_group(3, &self.visible, &[]);
            for mesh in renderer.meshes.iter().filter(|mesh| mesh.profile_id != 0) {
                pass.set_bind_group(1, &mesh.material, &[]);
                mesh.draw(&mut pass, 0..mesh.index_count);
            }
        });
    }

    /// As the effects take it.
    pub fn layer(&self) -> BackLayer<'_> {
        let mut layer = BackLayer::new(&self.irradiance, &self.depth);
        layer.profile_id = Some(&self.profile_id);
        layer
    }
}
