//! A small deferred renderer that plays the host in the examples and tests. It knows the effects
//! only as any host would.
//!
//! [`Renderer::render`] fills a [`GBuffer`]; a mode of scattering turns its irradiance into
//! another texture (or none does); [`Renderer::compose`] makes the picture from the one or the
//! other.

mod accessor;
mod atlas;
mod attributes;
mod back;
mod brdf;
mod camera;
#[cfg(feature = "programs")]
mod environment;
mod gpu;
mod head;
mod lighting;
mod materials;
mod mesh;
mod names;
mod orbit;
mod pages;
mod probe;
mod reader;
mod scene;
mod tangents;
mod timestamps;

pub use atlas::AtlasRenderer;
pub use back::BackRenderer;
pub use brdf::BrdfTables;
pub use camera::{Camera, View};
#[cfg(feature = "programs")]
pub use environment::Environment;
pub use gpu::{Gpu, Readback};
pub use lighting::{Light, Lighting, Sky, Specular};
pub use orbit::{Orbit, turn_light};
pub use probe::{Probe, Visible};
pub use scene::{Image, Material, Primitive, Scene, Vertex};
pub use timestamps::Timestamps;

use std::ops::Range;

use crate::Error;
use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3};
use subsurface::Frame;
use wgpu::{TextureFormat, TextureView};

use lighting::Lights;
use mesh::Mesh;

/// Of irradiance, before and after scattering.
const IRRADIANCE: TextureFormat = TextureFormat::Rgba16Float;
const DEPTH: TextureFormat = TextureFormat::Depth32Float;
const PICTURE: TextureFormat = TextureFormat::Rgba8UnormSrgb;

/// What a frame leaves for the passes after it.
pub struct GBuffer {
    /// Linear albedo; alpha is the material's Beckmann slope. Rgba16Float.
    pub albedo: TextureView,
    /// View-space normals. Rgba16Float.
    pub normal: TextureView,
    /// Scattering profile, 0 for none. R8Uint.
    pub profile_id: TextureView,
    /// Reversed, infinite depth; 0 where nothing is. Depth32Float.
    pub depth: TextureView,
    /// Lit diffuse irradiance/π: the radiance of a white diffuse surface. Rgba16Float.
    pub irradiance: TextureView,
    /// Surface reflection. Rgba16Float.
    pub specular: TextureView,
}

impl GBuffer {
    /// As the effects take it: with ids, whatever else a frame may have at its default.
    pub fn frame(&self, projection: Mat4, mm_per_unit: f32) -> Frame<'_> {
        let projection = projection.to_cols_array_2d();
        let mut frame = Frame::new(&self.irradiance, &self.depth, projection);
        frame.profile_id = Some(&self.profile_id);
        frame.mm_per_unit = mm_per_unit;
        frame
    }
}

/// What [`Renderer::compose`] shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// The finished picture.
    Picture,
    /// The diffuse irradiance alone, without albedo.
    Diffuse,
}

/// A scene on the device, and the passes that draw it at one size.
pub struct Renderer {
    /// Filled by [`Renderer::render`].
    pub gbuffer: GBuffer,
    size: [u32; 2],
    bounds: (Vec3, Vec3),
    meshes: Vec<Mesh>,
    lights: Lights,
    camera: wgpu::Buffer,
    camera_layout: wgpu::BindGroupLayout,
    camera_group: wgpu::BindGroup,
    material_layout: wgpu::BindGroupLayout,
    draw: wgpu::RenderPipeline,
    shade: wgpu::RenderPipeline,
    shade_group: wgpu::BindGroup,
    compose: wgpu::RenderPipeline,
    compose_uniform: wgpu::Buffer,
}

/// `Camera` of the shaders.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct CameraUniform {
    view: Mat4,
    view_projection: Mat4,
    inverse_view_projection: Mat4,
    eye: Vec3,
    mm_per_unit: f32,
}

/// `Compose` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct ComposeUniform {
    exposure: f32,
    layer: u32,
}

impl Renderer {
    /// Uploads a scene, for pictures of `size` pixels.
    ///
    /// # Errors
    /// A size of 0 or beyond the device's limits; a primitive that is too large for a buffer.
    pub fn new(gpu: &Gpu, scene: &Scene, size: [u32; 2]) -> Result<Self, Error> {
        let device = &gpu.device;
        gpu.check_size(size)?;
        let target = |name, format| gpu.target(name, size, format);
        let gbuffer = GBuffer {
            albedo: target("subsurface_lab::renderer albedo", TextureFormat::Rgba16Float),
            normal: target("subsurface_lab::renderer normal", TextureFormat::Rgba16Float),
            profile_id: target("subsurface_lab::renderer profile id", TextureFormat::R8Uint),
            depth: target("subsurface_lab::renderer depth", DEPTH),
            irradiance: target("subsurface_lab::renderer irradiance", IRRADIANCE),
            specular: target("subsurface_lab::renderer specular", TextureFormat::Rgba16Float),
        };
        let camera_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("subsurface_lab::renderer camera"),
            entries: &[uniform_entry(wgpu::ShaderStages::VERTEX_FRAGMENT)],
        });
        let camera = gpu.uniform::<CameraUniform>("subsurface_lab::renderer camera");
        let camera_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("subsurface_lab::renderer camera"),
            layout: &camera_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: camera.as_entire_binding() }],
        });
        let material_layout = Mesh::material_layout(gpu);
        let lights = Lights::new(gpu);
        let module = |name, parts: &[&str]| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(name),
                source: wgpu::ShaderSource::Wgsl(parts.concat().into()),
            })
        };

        let draw = pipeline(
            gpu,
            Pipeline {
                label: "subsurface_lab::renderer gbuffer",
                shader: &module(
                    "subsurface_lab::renderer gbuffer",
                    &[include_str!("material.wgsl"), include_str!("gbuffer.wgsl")],
                ),
                vertex: "vs_screen",
                fragment: "fs_gbuffer",
                groups: &[Some(&camera_layout), Some(&material_layout)],
                targets: &[TextureFormat::Rgba16Float, TextureFormat::Rgba16Float, TextureFormat::R8Uint],
                buffers: &[Mesh::VERTEX_LAYOUT],
                depth_stencil: Some(depth_state(wgpu::CompareFunction::Greater, true)),
            },
        );

        let (shade_layout, shade_group) = textures(
            gpu,
            "subsurface_lab::renderer deferred",
            None,
            &[&gbuffer.albedo, &gbuffer.normal, &gbuffer.profile_id, &gbuffer.depth],
        );
        let shade = pipeline(
            gpu,
            Pipeline {
                label: "subsurface_lab::renderer deferred",
                shader: &module(
                    "subsurface_lab::renderer deferred",
                    &[include_str!("material.wgsl"), lighting::SHADER, include_str!("deferred.wgsl")],
                ),
                vertex: "vs_main",
                fragment: "fs_lighting",
                groups: &[Some(&camera_layout), None, Some(&lights.layout), Some(&shade_layout)],
                targets: &[IRRADIANCE, TextureFormat::Rgba16Float],
                buffers: &[],
                depth_stencil: None,
            },
        );

        let compose_uniform = gpu.uniform::<ComposeUniform>("subsurface_lab::renderer compose");
        let (compose_layout, _) = textures(
            gpu,
            "subsurface_lab::renderer compose",
            Some(&compose_uniform),
            &[&gbuffer.irradiance, &gbuffer.albedo, &gbuffer.specular, &gbuffer.depth],
        );
        let compose = pipeline(
            gpu,
            Pipeline {
                label: "subsurface_lab::renderer compose",
                shader: &module("subsurface_lab::renderer compose", &[include_str!("compose.wgsl")]),
                vertex: "vs_main",
                fragment: "fs_compose",
                groups: &[Some(&compose_layout)],
                targets: &[PICTURE],
                buffers: &[],
                depth_stencil: None,
            },
        );
        Ok(Self {
            meshes: Mesh::upload(gpu, scene, &material_layout)?,
            bounds: scene.bounds(),
            size,
            gbuffer,
            lights,
            camera,
            camera_layout,
            camera_group,
            material_layout,
            draw,
            shade,
            shade_group,
            compose,
            compose_uniform,
        })
    }

    /// Has an environment behind the scene and reflected in it where [`Lighting::turn`] says so.
    #[cfg(feature = "programs")]
    pub fn set_environment(&mut self, gpu: &Gpu, environment: &Environment) {
        self.lights.set_environment(gpu, &environment.maps(gpu));
    }

    /// Draws and lights the scene into the G-buffer.
    ///
    /// # Errors
    /// Lights that cannot be used.
    pub fn render(
        &self,
        gpu: &Gpu,
        camera: &Camera,
        lighting: &Lighting,
        mm_per_unit: f32,
    ) -> Result<(), Error> {
        let view_projection = camera.projection(self.size) * camera.view();
        let uniform = CameraUniform {
            view: camera.view(),
            view_projection,
            // In double precision, since the far plane is infinitely far away.
            inverse_view_projection: view_projection.as_dmat4().inverse().as_mat4(),
            eye: camera.eye,
            mm_per_unit,
        };
        gpu.queue.write_buffer(&self.camera, 0, bytemuck::bytes_of(&uniform));
        self.lights.render(gpu, lighting, &self.meshes, self.bounds)?;

        let g = &self.gbuffer;
        let clear = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
        gpu.run(|encoder| {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("subsurface_lab::renderer gbuffer"),
                color_attachments: &[&g.albedo, &g.normal, &g.profile_id]
                    .map(|view| Some(color_attachment(view, clear))),
                depth_stencil_attachment: Some(depth_attachment(&g.depth, wgpu::LoadOp::Clear(0.0))),
                ..Default::default()
            });
            pass.set_pipeline(&self.draw);
            pass.set_bind_group(0, &self.camera_group, &[]);
            for mesh in &self.meshes {
                pass.set_bind_group(1, &mesh.material, &[]);
                mesh.draw(&mut pass, 0..mesh.index_count);
            }
            drop(pass);

            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("subsurface_lab::renderer deferred"),
                color_attachments: &[&g.irradiance, &g.specular]
                    .map(|view| Some(color_attachment(view, clear))),
                ..Default::default()
            });
            pass.set_pipeline(&self.shade);
            pass.set_bind_group(0, &self.camera_group, &[]);
            pass.set_bind_group(2, &self.lights.group, &[]);
            pass.set_bind_group(3, &self.shade_group, &[]);
            pass.draw(0..3, 0..1);
        });
        Ok(())
    }

    /// A target for scattered irradiance, of this renderer's size and format.
    pub fn scattered_target(&self, gpu: &Gpu) -> TextureView {
        gpu.target("subsurface_lab::renderer scattered", self.size, IRRADIANCE)
    }

    /// The picture that a diffuse layer gives: tone-mapped sRGB bytes, red, green, blue.
    pub fn compose(&self, gpu: &Gpu, diffuse: &TextureView, layer: Layer, exposure: f32) -> Vec<[u8; 3]> {
        let picture = self.picture_target(gpu);
        self.draw_picture(gpu, diffuse, layer, exposure, 0..self.size[0], &picture);
        gpu.read_bytes(picture.texture()).chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect()
    }

    /// A target for pictures, of this renderer's size: Rgba8UnormSrgb.
    pub fn picture_target(&self, gpu: &Gpu) -> TextureView {
        gpu.target("subsurface_lab::renderer picture", self.size, PICTURE)
    }

    /// Draws the picture that a diffuse layer gives into these columns of a target that
    /// [`picture_target`](Self::picture_target) made, and leaves the others.
    ///
    /// # Panics
    /// Columns that the target does not have.
    pub fn draw_picture(
        &self,
        gpu: &Gpu,
        diffuse: &TextureView,
        layer: Layer,
        exposure: f32,
        columns: Range<u32>,
        picture: &TextureView,
    ) {
        gpu.queue.write_buffer(
            &self.compose_uniform,
            0,
            bytemuck::bytes_of(&ComposeUniform { exposure, layer: (layer == Layer::Diffuse).into() }),
        );
        let g = &self.gbuffer;
        let (_, group) = textures(
            gpu,
            "subsurface_lab::renderer compose",
            Some(&self.compose_uniform),
            &[diffuse, &g.albedo, &g.specular, &g.depth],
        );
        gpu.run(|encoder| {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("subsurface_lab::renderer compose"),
                color_attachments: &[Some(color_attachment(picture, wgpu::LoadOp::Load))],
                ..Default::default()
            });
            pass.set_pipeline(&self.compose);
            pass.set_bind_group(0, &group, &[]);
            pass.set_scissor_rect(columns.start, 0, columns.len() as u32, self.size[1]);
            pass.draw(0..3, 0..1);
        });
    }
}

fn uniform_entry(visibility: wgpu::ShaderStages) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding: 0,
        visibility,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
}

/// A bind group of textures that a fragment shader loads from, behind a uniform buffer or not.
fn textures(
    gpu: &Gpu,
    label: &str,
    uniform: Option<&wgpu::Buffer>,
    views: &[&TextureView],
) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
    let mut layout = Vec::new();
    let mut entries = Vec::new();
    if let Some(buffer) = uniform {
        layout.push(uniform_entry(wgpu::ShaderStages::FRAGMENT));
        entries.push(wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() });
    }
    for view in views {
        let binding = layout.len() as u32;
        let sample_type = match view.texture().format().sample_type(None, None) {
            Some(wgpu::TextureSampleType::Uint) => wgpu::TextureSampleType::Uint,
            _ => wgpu::TextureSampleType::Float { filterable: false },
        };
        layout.push(wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        });
        entries.push(wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::TextureView(view) });
    }
    let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &layout,
    });
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout: &layout,
        entries: &entries,
    });
    (layout, group)
}

fn depth_state(compare: wgpu::CompareFunction, write: bool) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(write),
        depth_compare: Some(compare),
        stencil: Default::default(),
        bias: Default::default(),
    }
}

fn depth_attachment(
    view: &TextureView,
    load: wgpu::LoadOp<f32>,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    }
}

fn color_attachment(
    view: &TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
) -> wgpu::RenderPassColorAttachment<'_> {
    wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
    }
}

/// What the renderer's pipelines differ in.
struct Pipeline<'a> {
    label: &'a str,
    shader: &'a wgpu::ShaderModule,
    /// Entry points.
    vertex: &'a str,
    fragment: &'a str,
    groups: &'a [Option<&'a wgpu::BindGroupLayout>],
    targets: &'a [TextureFormat],
    /// Meshes, both sides of their triangles, or one triangle over the targets.
    buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    depth_stencil: Option<wgpu::DepthStencilState>,
}

fn pipeline(gpu: &Gpu, parts: Pipeline) -> wgpu::RenderPipeline {
    let Pipeline { label, shader, vertex, fragment, groups, targets, buffers, depth_stencil } = parts;
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: groups,
        immediate_size: 0,
    });
    let targets: Vec<_> = targets.iter().map(|&f| Some(f.into())).collect();
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some(vertex),
            compilation_options: Default::default(),
            buffers,
        },
        primitive: Default::default(),
        depth_stencil,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: shader,
            entry_point: Some(fragment),
            compilation_options: Default::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wgsl::assert_layout;

    #[test]
    fn compose_lies_as_the_shader_has_it() {
        assert_layout!(include_str!("compose.wgsl"), "Compose", ComposeUniform { exposure, layer });
    }
}
