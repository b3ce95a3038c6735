//! The host's side of texture space: draws each UV page of each mesh into an atlas, lets an effect
//! scatter it, and draws the result back onto the screen. Driver of `atlas.wgsl`
//! and `resample.wgsl`.

use crate::Error;
use subsurface::{Atlas, TextureSpace};
use web_time::Instant;
use wgpu::{BindingResource, LoadOp, TextureFormat};

use super::{Gpu, IRRADIANCE, Renderer, mesh::Mesh};
use crate::passes::{self, CLEAR, Pipeline, Slot};

/// The atlas of one page, used for one after the other.
pub struct AtlasRenderer {
    irradiance: wgpu::TextureView,
    positions: wgpu::TextureView,
    scattered: wgpu::TextureView,
    light: wgpu::RenderPipeline,
    resample: wgpu::RenderPipeline,
    resample_group: wgpu::BindGroup,
}

impl AtlasRenderer {
    /// An atlas of `size` × `size` texels a page.
    ///
    /// # Errors
    /// A size of 0 or beyond the device's limit.
    pub fn new(gpu: &Gpu, renderer: &Renderer, size: u32) -> Result<Self, Error> {
        let limit = gpu.device.limits().max_texture_dimension_2d;
        if size == 0 || size > limit {
            return Err(Error::new("texture size", size.to_string(), format!("1 to {limit}")));
        }
        let size = [size, size];
        let device = &gpu.device;
        let light = light_pipeline(gpu, renderer);
        let label = "subsurface_lab::renderer resample";
        let layout = passes::layout(device, label, &[Slot::Filtered, Slot::Sampler]);
        let wgsl = [include_str!("material.wgsl"), include_str!("resample.wgsl")];
        let shader = passes::module(device, label, &wgsl);
        let resample = Pipeline {
            groups: &[Some(&renderer.camera_layout), Some(&renderer.material_layout), Some(&layout)],
            targets: &[IRRADIANCE.into()],
            buffers: &[Mesh::VERTEX_LAYOUT],
            depth_stencil: Some(super::depth_state(wgpu::CompareFunction::Equal, false)),
            ..Pipeline::of(label, &shader, ["vs_screen", "fs_resample"])
        }
        .make(device);

        let target = |name, format| gpu.target(name, size, format);
        let scattered = target("subsurface_lab::renderer atlas scattered", IRRADIANCE);
        let sampler = passes::linear_sampler(device, label);
        let resources = [BindingResource::TextureView(&scattered), BindingResource::Sampler(&sampler)];
        let resample_group = passes::group(device, label, &layout, &resources);
        Ok(Self {
            irradiance: target("subsurface_lab::renderer atlas irradiance", IRRADIANCE),
            positions: target("subsurface_lab::renderer atlas positions", TextureFormat::Rgba32Float),
            scattered,
            light,
            resample,
            resample_group,
        })
    }

    /// Has the scene scattered as `renderer` last lit it and draws the result into `output`, which
    /// elsewhere takes the irradiance as it was; primitives of the first `profiles` ids scatter. `scatter` fills
    /// the texture that it is handed beside an atlas, of `output`'s format, and waits for it. Returns the wall time of drawing and lighting
    /// the atlases, submit and wait, in ms; that of `scatter` is the caller's to take.
    ///
    /// # Errors
    /// A primitive that scatters and has no UVs; those of `scatter`.
    pub fn render(
        &self,
        gpu: &Gpu,
        renderer: &Renderer,
        profiles: usize,
        mm_per_unit: f32,
        output: &wgpu::TextureView,
        mut scatter: impl FnMut(&Atlas, &wgpu::TextureView) -> Result<(), Error>,
    ) -> Result<f64, Error> {
        let scatters = 1..=profiles;
        let skin = || {
            let meshes = renderer.meshes.iter();
            meshes.filter(|m| scatters.contains(&m.profile_id.into()))
        };
        if let Some(mesh) = skin().find(|m| m.pages.is_empty()) {
            return Err(Error::new(
                format!("texture space: {}", mesh.name),
                "no UVs",
                "TEXCOORD_0 (screen space does without)",
            ));
        }
        gpu.run(|encoder| {
            encoder.copy_texture_to_texture(
                renderer.gbuffer.irradiance.texture().as_image_copy(),
                output.texture().as_image_copy(),
                output.texture().size(),
            );
        });
        let mut raster_ms = 0.0;
        for mesh in skin() {
            for page in &mesh.pages {
                let start = Instant::now();
                gpu.run(|encoder| self.draw_atlas(encoder, renderer, mesh, page.clone()));
                raster_ms += start.elapsed().as_secs_f64() * 1e3;

                let mut atlas = Atlas::new(&self.irradiance, &self.positions);
                atlas.mm_per_unit = mm_per_unit;
                scatter(&atlas, &self.scattered)?;

                gpu.run(|encoder| self.draw_screen(encoder, renderer, mesh, page.clone(), output));
            }
        }
        Ok(raster_ms)
    }

    fn draw_atlas(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        renderer: &Renderer,
        mesh: &Mesh,
        page: std::ops::Range<u32>,
    ) {
        let targets = [(&self.irradiance, CLEAR), (&self.positions, CLEAR)];
        let mut pass = passes::begin(encoder, "subsurface_lab::renderer atlas", &targets, None);
        pass.set_pipeline(&self.light);
        pass.set_bind_group(0, &renderer.camera_group, &[]);
        pass.set_bind_group(1, &mesh.material, &[]);
        pass.set_bind_group(2, &renderer.lights.group, &[]);
        mesh.draw(&mut pass, page);
    }

    fn draw_screen(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        renderer: &Renderer,
        mesh: &Mesh,
        page: std::ops::Range<u32>,
        output: &wgpu::TextureView,
    ) {
        let depth = super::depth_attachment(&renderer.gbuffer.depth, LoadOp::Load);
        let targets = [(output, LoadOp::Load)];
        let mut pass = passes::begin(encoder, "subsurface_lab::renderer resample", &targets, Some(depth));
        pass.set_pipeline(&self.resample);
        pass.set_bind_group(0, &renderer.camera_group, &[]);
        pass.set_bind_group(1, &mesh.material, &[]);
        pass.set_bind_group(2, &self.resample_group, &[]);
        mesh.draw(&mut pass, page);
    }
}

/// Draws a mesh into UV space, lit.
fn light_pipeline(gpu: &Gpu, renderer: &Renderer) -> wgpu::RenderPipeline {
    let label = "subsurface_lab::renderer atlas";
    let wgsl = [
        TextureSpace::VERTEX_WGSL,
        include_str!("material.wgsl"),
        super::lighting::SHADER,
        include_str!("atlas.wgsl"),
    ];
    let shader = passes::module(&gpu.device, label, &wgsl);
    Pipeline {
        groups: &[
            Some(&renderer.camera_layout),
            Some(&renderer.material_layout),
            Some(&renderer.lights.layout),
        ],
        targets: &[IRRADIANCE.into(), TextureFormat::Rgba32Float.into()],
        buffers: &[Mesh::VERTEX_LAYOUT],
        ..Pipeline::of(label, &shader, ["vs_atlas", "fs_atlas"])
    }
    .make(&gpu.device)
}
