//! The host's side of texture space: draws each UV page of each mesh into an atlas, lets an effect
//! scatter it, and draws the result back onto the screen. Driver of `atlas.wgsl`
//! and `resample.wgsl`.

use crate::Error;
use subsurface::{Atlas, TextureSpace};
use web_time::Instant;
use wgpu::TextureFormat;

use super::{Gpu, IRRADIANCE, Pipeline, Renderer, mesh::Mesh};

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
        let light_shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("subsurface_lab::renderer atlas"),
            source: wgpu::ShaderSource::Wgsl(
                [
                    TextureSpace::VERTEX_WGSL,
                    include_str!("material.wgsl"),
                    super::lighting::SHADER,
                    include_str!("atlas.wgsl"),
                ]
                .concat()
                .into(),
            ),
        });
        let light = super::pipeline(
            gpu,
            Pipeline {
                label: "subsurface_lab::renderer atlas",
                shader: &light_shader,
                vertex: "vs_atlas",
                fragment: "fs_atlas",
                groups: &[
                    Some(&renderer.camera_layout),
                    Some(&renderer.material_layout),
                    Some(&renderer.lights.layout),
                ],
                targets: &[IRRADIANCE, TextureFormat::Rgba32Float],
                buffers: &[Mesh::VERTEX_LAYOUT],
                depth_stencil: None,
            },
        );

        let resample_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("subsurface_lab::renderer resample"),
            entries: &[
                wgpu::BindGroupLayoutEntry {
                    binding: 0,
                    visibility: wgpu::ShaderStages::FRAGMENT,
                    ty: wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Float { filterable: true },
                        view_dimension: wgpu::TextureViewDimension::D2,
                        multisampled: false,
                    },
                    count: None,
                },
                wgpu::BindGroupLayoutEntry {
                    binding: 1,
                    visibility: wgpu::ShaderStages::FRAGMENT,
                    ty: wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
                    count: None,
                },
            ],
        });
        let resample_shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("subsurface_lab::renderer resample"),
            source: wgpu::ShaderSource::Wgsl(
                [include_str!("material.wgsl"), include_str!("resample.wgsl")].concat().into(),
            ),
        });
        let resample = super::pipeline(
            gpu,
            Pipeline {
                label: "subsurface_lab::renderer resample",
                shader: &resample_shader,
                vertex: "vs_screen",
                fragment: "fs_resample",
                groups: &[
                    Some(&renderer.camera_layout),
                    Some(&renderer.material_layout),
                    Some(&resample_layout),
                ],
                targets: &[IRRADIANCE],
                buffers: &[Mesh::VERTEX_LAYOUT],
                depth_stencil: Some(super::depth_state(wgpu::CompareFunction::Equal, false)),
            },
        );

        let target = |name, format| gpu.target(name, size, format);
        let scattered = target("subsurface_lab::renderer atlas scattered", IRRADIANCE);
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("subsurface_lab::renderer resample"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let resample_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("subsurface_lab::renderer resample"),
            layout: &resample_layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&scattered),
                },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&sampler) },
            ],
        });
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
        let clear = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("subsurface_lab::renderer atlas"),
            color_attachments: &[
                Some(super::color_attachment(&self.irradiance, clear)),
                Some(super::color_attachment(&self.positions, clear)),
            ],
            ..Default::default()
        });
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
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("subsurface_lab::renderer resample"),
            color_attachments: &[Some(super::color_attachment(output, wgpu::LoadOp::Load))],
            depth_stencil_attachment: Some(super::depth_attachment(
                &renderer.gbuffer.depth,
                wgpu::LoadOp::Load,
            )),
            ..Default::default()
        });
        pass.set_pipeline(&self.resample);
        pass.set_bind_group(0, &renderer.camera_group, &[]);
        pass.set_bind_group(1, &mesh.material, &[]);
        pass.set_bind_group(2, &self.resample_group, &[]);
        mesh.draw(&mut pass, page);
    }
}
