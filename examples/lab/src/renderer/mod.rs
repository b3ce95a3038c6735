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
use wgpu::{BindingResource, TextureFormat, TextureView};

use crate::passes::{self, CLEAR, Pipeline, Slot};
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
    fn new(gpu: &Gpu, size: [u32; 2]) -> Self {
        let target = |name, format| gpu.target(&format!("subsurface_lab::renderer {name}"), size, format);
        Self {
            albedo: target("albedo", TextureFormat::Rgba16Float),
            normal: target("normal", TextureFormat::Rgba16Float),
            profile_id: target("profile id", TextureFormat::R8Uint),
            depth: target("depth", DEPTH),
            irradiance: target("irradiance", IRRADIANCE),
            specular: target("specular", TextureFormat::Rgba16Float),
        }
    }

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
        let gbuffer = GBuffer::new(gpu, size);
        let label = "subsurface_lab::renderer camera";
        let camera_layout = passes::layout(device, label, &[Slot::Uniform]);
        let camera = gpu.uniform::<CameraUniform>(label);
        let camera_group = passes::group(device, label, &camera_layout, &[camera.as_entire_binding()]);
        let material_layout = Mesh::material_layout(gpu);
        let lights = Lights::new(gpu);

        let label = "subsurface_lab::renderer deferred";
        let wgsl = [include_str!("material.wgsl"), lighting::SHADER, include_str!("deferred.wgsl")];
        let views = [&gbuffer.albedo, &gbuffer.normal, &gbuffer.profile_id, &gbuffer.depth];
        let (shade_layout, shade_group) = textures(gpu, label, None, &views);
        let shade = Pipeline {
            groups: &[Some(&camera_layout), None, Some(&lights.layout), Some(&shade_layout)],
            targets: &[IRRADIANCE.into(), TextureFormat::Rgba16Float.into()],
            ..Pipeline::of(label, &passes::module(device, label, &wgsl), ["vs_main", "fs_lighting"])
        }
        .make(device);

        let label = "subsurface_lab::renderer compose";
        let shader = passes::module(device, label, &[include_str!("compose.wgsl")]);
        let compose_uniform = gpu.uniform::<ComposeUniform>(label);
        let views = [&gbuffer.irradiance, &gbuffer.albedo, &gbuffer.specular, &gbuffer.depth];
        let (compose_layout, _) = textures(gpu, label, Some(&compose_uniform), &views);
        let compose = Pipeline {
            groups: &[Some(&compose_layout)],
            targets: &[PICTURE.into()],
            ..Pipeline::of(label, &shader, ["vs_main", "fs_compose"])
        }
        .make(device);
        Ok(Self {
            meshes: Mesh::upload(gpu, scene, &material_layout)?,
            bounds: scene.bounds(),
            size,
            gbuffer,
            lights,
            camera,
            camera_group,
            draw: gbuffer_pipeline(device, &camera_layout, &material_layout),
            camera_layout,
            material_layout,
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
        gpu.run(|encoder| {
            let targets = [(&g.albedo, CLEAR), (&g.normal, CLEAR), (&g.profile_id, CLEAR)];
            let depth = depth_attachment(&g.depth, wgpu::LoadOp::Clear(0.0));
            let label = "subsurface_lab::renderer gbuffer";
            let mut pass = passes::begin(encoder, label, &targets, Some(depth));
            pass.set_pipeline(&self.draw);
            pass.set_bind_group(0, &self.camera_group, &[]);
            for mesh in &self.meshes {
                pass.set_bind_group(1, &mesh.material, &[]);
                mesh.draw(&mut pass, 0..mesh.index_count);
            }
            drop(pass);

            let targets = [(&g.irradiance, CLEAR), (&g.specular, CLEAR)];
            let label = "subsurface_lab::renderer deferred";
            let mut pass = passes::begin(encoder, label, &targets, None);
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
        let label = "subsurface_lab::renderer compose";
        let views = [diffuse, &g.albedo, &g.specular, &g.depth];
        let (_, group) = textures(gpu, label, Some(&self.compose_uniform), &views);
        gpu.run(|encoder| {
            let targets = [(picture, wgpu::LoadOp::Load)];
            let mut pass = passes::begin(encoder, label, &targets, None);
            pass.set_pipeline(&self.compose);
            pass.set_bind_group(0, &group, &[]);
            pass.set_scissor_rect(columns.start, 0, columns.len() as u32, self.size[1]);
            pass.draw(0..3, 0..1);
        });
    }
}

fn gbuffer_pipeline(
    device: &wgpu::Device,
    camera: &wgpu::BindGroupLayout,
    material: &wgpu::BindGroupLayout,
) -> wgpu::RenderPipeline {
    let label = "subsurface_lab::renderer gbuffer";
    let wgsl = [include_str!("material.wgsl"), include_str!("gbuffer.wgsl")];
    let targets = [TextureFormat::Rgba16Float, TextureFormat::Rgba16Float, TextureFormat::R8Uint];
    Pipeline {
        groups: &[Some(camera), Some(material)],
        targets: &targets.map(Into::into),
        buffers: &[Mesh::VERTEX_LAYOUT],
        depth_stencil: Some(depth_state(wgpu::CompareFunction::Greater, true)),
        ..Pipeline::of(label, &passes::module(device, label, &wgsl), ["vs_screen", "fs_gbuffer"])
    }
    .make(device)
}

/// A bind group of textures that a fragment shader loads from, behind a uniform buffer or not.
fn textures(
    gpu: &Gpu,
    label: &str,
    uniform: Option<&wgpu::Buffer>,
    views: &[&TextureView],
) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
    let uniform = uniform.into_iter();
    let texture = |view: &&TextureView| match view.texture().format() {
        TextureFormat::R8Uint => Slot::Uint,
        _ => Slot::Float,
    };
    let slots: Vec<_> = uniform.clone().map(|_| Slot::Uniform).chain(views.iter().map(texture)).collect();
    let views = views.iter().map(|view| BindingResource::TextureView(view));
    let resources: Vec<_> = uniform.map(wgpu::Buffer::as_entire_binding).chain(views).collect();
    let layout = passes::layout(&gpu.device, label, &slots);
    let group = passes::group(&gpu.device, label, &layout, &resources);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wgsl::assert_layout;

    #[test]
    fn compose_lies_as_the_shader_has_it() {
        assert_layout!(include_str!("compose.wgsl"), "Compose", ComposeUniform { exposure, layer });
    }
}
