//! Primitives and their materials on the device. Driver of `material.wgsl`.

use std::ops::Range;

use crate::Error;
use bytemuck::{Pod, Zeroable};
use wgpu::util::DeviceExt;
use wgpu::{BindingResource, BufferUsages, TextureFormat};

use super::Gpu;
use super::scene::{Image, Material, Primitive, Scene, Vertex};
use crate::passes::{self, Slot};

const LABEL: &str = "subsurface_lab::renderer mesh";

/// `Material` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct MaterialUniform {
    base_color: [f32; 4],
    normal_scale: f32,
    alpha_cutoff: f32,
    slope: f32,
    profile_id: u32,
    procedural: u32,
    pad: [u32; 3],
}

impl MaterialUniform {
    fn of(primitive: &Primitive, material: &Material) -> Self {
        Self {
            base_color: material.base_color,
            normal_scale: material.normal_scale,
            alpha_cutoff: material.alpha_cutoff,
            slope: (material.roughness * material.roughness).max(0.02),
            profile_id: material.profile_id.into(),
            procedural: primitive.procedural.into(),
            pad: [0; 3],
        }
    }
}

/// One primitive, ready to be drawn.
pub(super) struct Mesh {
    pub name: String,
    pub index_count: u32,
    pub pages: Vec<Range<u32>>,
    pub profile_id: u8,
    pub material: wgpu::BindGroup,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
}

const ATTRIBUTES: [wgpu::VertexAttribute; 7] = wgpu::vertex_attr_array![
    0 => Float32x3, 1 => Float32x3, 2 => Float32x4, 3 => Float32x2, 4 => Float32x2, 5 => Float32x4,
    6 => Float32x4
];

impl Mesh {
    pub const VERTEX_LAYOUT: Option<wgpu::VertexBufferLayout<'static>> = Some(wgpu::VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &ATTRIBUTES,
    });

    /// Layout of a material's bind group.
    pub fn material_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
        let slots = [Slot::Uniform, Slot::Filtered, Slot::Filtered, Slot::Sampler];
        passes::layout(&gpu.device, "subsurface_lab::renderer material", &slots)
    }

    /// All primitives of a scene.
    ///
    /// # Errors
    /// A primitive that is too large for a buffer.
    pub fn upload(gpu: &Gpu, scene: &Scene, layout: &wgpu::BindGroupLayout) -> Result<Vec<Self>, Error> {
        let texture = |index: Option<usize>, format, default: [u8; 4]| {
            let plain = Image { width: 1, height: 1, rgba8: default.to_vec() };
            upload_image(gpu, index.map_or(&plain, |i| &scene.images[i]), format)
        };
        let limit = gpu.device.limits().max_buffer_size;
        let mesh = |primitive: &Primitive| {
            let largest = size_of_val(&*primitive.vertices).max(4 * primitive.indices.len());
            if largest as u64 > limit {
                return Err(Error::new(
                    &primitive.name,
                    format!("{largest} bytes of vertices or indices"),
                    format!("at most {limit}"),
                ));
            }
            let material = &scene.materials[primitive.material];
            let color = texture(material.base_color_texture, TextureFormat::Rgba8UnormSrgb, [255; 4]);
            let normal = texture(material.normal_texture, TextureFormat::Rgba8Unorm, [128, 128, 255, 255]);
            let uniform = MaterialUniform::of(primitive, material);
            Ok(Self {
                name: primitive.name.clone(),
                index_count: primitive.indices.len() as u32,
                pages: primitive.pages.clone(),
                profile_id: material.profile_id,
                material: passes::group(
                    &gpu.device,
                    LABEL,
                    layout,
                    &[
                        buffer(gpu, &[uniform], BufferUsages::UNIFORM).as_entire_binding(),
                        BindingResource::TextureView(&color),
                        BindingResource::TextureView(&normal),
                        BindingResource::Sampler(&sampler(gpu, material.wrap)),
                    ],
                ),
                vertices: buffer(gpu, &primitive.vertices, BufferUsages::VERTEX),
                indices: buffer(gpu, &primitive.indices, BufferUsages::INDEX),
            })
        };
        scene.primitives.iter().map(mesh).collect()
    }

    /// Draws a range of the indices.
    pub fn draw(&self, pass: &mut wgpu::RenderPass, indices: Range<u32>) {
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(indices, 0, 0..1);
    }
}

fn sampler(gpu: &Gpu, [u, v]: [wgpu::AddressMode; 2]) -> wgpu::Sampler {
    gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some(LABEL),
        address_mode_u: u,
        address_mode_v: v,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..Default::default()
    })
}

fn buffer<T: Pod>(gpu: &Gpu, contents: &[T], usage: BufferUsages) -> wgpu::Buffer {
    let contents = bytemuck::cast_slice(contents);
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(LABEL), contents, usage })
}

/// An image with its mip levels, without those that are larger than the device takes.
fn upload_image(gpu: &Gpu, image: &Image, format: wgpu::TextureFormat) -> wgpu::TextureView {
    let limit = gpu.device.limits().max_texture_dimension_2d;
    let mut level = image.clone();
    while level.width > limit || level.height > limit {
        level = half(&level);
    }
    let (width, height) = (level.width, level.height);
    let levels = width.max(height).ilog2() + 1;
    let mut bytes = level.rgba8.clone();
    for _ in 1..levels {
        level = half(&level);
        bytes.extend_from_slice(&level.rgba8);
    }
    gpu.device
        .create_texture_with_data(
            &gpu.queue,
            &wgpu::TextureDescriptor {
                label: Some("subsurface_lab::renderer image"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: levels,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            },
            Default::default(),
            &bytes,
        )
        .create_view(&Default::default())
}

/// The next mip level: each pixel the mean of up to four.
fn half(image: &Image) -> Image {
    let (width, height) = ((image.width / 2).max(1), (image.height / 2).max(1));
    let mut rgba8 = Vec::with_capacity((width * height * 4) as usize);
    for y in 0..height {
        for x in 0..width {
            for c in 0..4 {
                let at = |dx: u32, dy: u32| {
                    let x = (2 * x + dx).min(image.width - 1) as usize;
                    let y = (2 * y + dy).min(image.height - 1) as usize;
                    u16::from(image.rgba8[4 * (y * image.width as usize + x) + c])
                };
                rgba8.push(((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) + 2) / 4) as u8);
            }
        }
    }
    Image { width, height, rgba8 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wgsl::assert_layout;

    const SHADER: &str = include_str!("material.wgsl");

    #[test]
    fn materials_lie_as_the_shader_has_them() {
        assert_layout!(
            SHADER,
            "Material",
            MaterialUniform { base_color, normal_scale, alpha_cutoff, slope, profile_id, procedural }
        );
    }

    #[test]
    fn cameras_lie_as_the_shader_has_them() {
        use crate::renderer::CameraUniform;
        assert_layout!(
            SHADER,
            "Camera",
            CameraUniform { view, view_projection, inverse_view_projection, eye, mm_per_unit }
        );
    }
}
