//! What a reference needs to know of a scene beyond its G-buffer: the surface that each pixel
//! shows, and the light on any place of a surface, seen or not. Driver of
//! `probe.wgsl`.

use glam::{Vec2, Vec3, Vec4};
use wgpu::{BindingResource, TextureFormat};

use super::mesh::Mesh;
use super::{Camera, Gpu, Primitive, Renderer};
use crate::passes::{self, CLEAR, Pipeline, Slot};

/// Places are lit so many at a time, in a square texture.
const SIDE: u32 = 1024;
/// Numbers of a place, in fours.
const LAYERS: u32 = 6;

/// What a pixel shows.
#[derive(Clone, Copy, Debug)]
pub struct Visible {
    /// World position in mm; zero where nothing is.
    pub point_mm: Vec3,
    /// The way on the surface, in mm, to where the next pixel in the row and in the column looks.
    pub steps_mm: [Vec3; 2],
}

/// Asks a renderer for points and light.
pub struct Probe {
    position: wgpu::RenderPipeline,
    steps: wgpu::RenderPipeline,
    irradiance: wgpu::RenderPipeline,
    places: wgpu::Texture,
    group: wgpu::BindGroup,
    lit: wgpu::TextureView,
}

impl Probe {
    /// The passes for what `renderer` draws.
    pub fn new(gpu: &Gpu, renderer: &Renderer) -> Self {
        let label = "subsurface_lab::renderer probe";
        let device = &gpu.device;
        let wgsl = [include_str!("material.wgsl"), super::lighting::SHADER, include_str!("probe.wgsl")];
        let shader = passes::module(device, label, &wgsl);
        let layout = passes::layout(device, label, &[Slot::FloatLayers]);
        let places = gpu.layers(label, [SIDE, SIDE], LAYERS, TextureFormat::Rgba32Float);
        let all = super::gpu::array(&places);
        let group = passes::group(device, label, &layout, &[BindingResource::TextureView(&all)]);
        let visible = |fragment, targets: &[wgpu::ColorTargetState]| {
            Pipeline {
                groups: &[Some(&renderer.camera_layout), Some(&renderer.material_layout)],
                targets,
                buffers: &[Mesh::VERTEX_LAYOUT],
                depth_stencil: Some(super::depth_state(wgpu::CompareFunction::Equal, false)),
                ..Pipeline::of(label, &shader, ["vs_screen", fragment])
            }
            .make(device)
        };
        let irradiance = Pipeline {
            groups: &[
                Some(&renderer.camera_layout),
                Some(&renderer.material_layout),
                Some(&renderer.lights.layout),
                Some(&layout),
            ],
            targets: &[TextureFormat::Rgba32Float.into()],
            ..Pipeline::of(label, &shader, ["vs_probe", "fs_irradiance"])
        }
        .make(device);
        let numbers = || TextureFormat::Rgba32Float.into();
        Self {
            position: visible("fs_position", &[numbers()]),
            steps: visible("fs_steps", &[numbers(), numbers()]),
            irradiance,
            places,
            group,
            lit: gpu.target(label, [SIDE, SIDE], TextureFormat::Rgba32Float),
        }
    }

    /// What each pixel shows, as `renderer` last drew it.
    pub fn visible(&self, gpu: &Gpu, renderer: &Renderer) -> Vec<Visible> {
        let label = "subsurface_lab::renderer visible";
        let [position, x, y] =
            [(); 3].map(|()| gpu.target(label, renderer.size, TextureFormat::Rgba32Float));
        gpu.run(|encoder| {
            // Three targets are more bytes a pixel than every device has to allow.
            for (pipeline, targets) in [(&self.position, &[&position][..]), (&self.steps, &[&x, &y])] {
                let targets: Vec<_> = targets.iter().map(|target| (*target, CLEAR)).collect();
                let depth = super::depth_attachment(&renderer.gbuffer.depth, wgpu::LoadOp::Load);
                let mut pass = passes::begin(encoder, label, &targets, Some(depth));
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &renderer.camera_group, &[]);
                for mesh in &renderer.meshes {
                    pass.set_bind_group(1, &mesh.material, &[]);
                    mesh.draw(&mut pass, 0..mesh.index_count);
                }
            }
        });
        let read = |view| gpu.read(view).into_iter().map(|[x, y, z, _]| Vec3::new(x, y, z));
        read(&position)
            .zip(read(&x).zip(read(&y)))
            .map(|(point_mm, (x, y))| Visible { point_mm, steps_mm: [x, y] })
            .collect()
    }

    /// Irradiance/π at places of the scene's `primitive`, by the lights as `renderer` last drew them.
    /// A place is the number of a triangle and the shares of its corners. Detail is filtered as in a
    /// picture that `camera` takes; alpha is not looked at, and the outside alone is lit.
    pub fn irradiance(
        &self,
        gpu: &Gpu,
        renderer: &Renderer,
        camera: &Camera,
        (index, primitive): (usize, &Primitive),
        mm_per_unit: f32,
        places: &[(usize, Vec3)],
    ) -> Vec<Vec3> {
        let mut irradiance = Vec::with_capacity(places.len());
        for places in places.chunks((SIDE * SIDE) as usize) {
            let rows = (places.len() as u32).div_ceil(SIDE);
            let mut layers = vec![Vec4::ZERO; (LAYERS * rows * SIDE) as usize];
            for (i, place) in places.iter().enumerate() {
                let texels = texels(primitive, *place, camera, renderer.size, mm_per_unit);
                for (layer, texel) in texels.into_iter().enumerate() {
                    layers[layer * (rows * SIDE) as usize + i] = texel;
                }
            }
            gpu.queue.write_texture(
                self.places.as_image_copy(),
                bytemuck::cast_slice(&layers),
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(SIDE * 16),
                    rows_per_image: Some(rows),
                },
                wgpu::Extent3d { width: SIDE, height: rows, depth_or_array_layers: LAYERS },
            );
            gpu.run(|encoder| {
                let label = "subsurface_lab::renderer probe";
                let mut pass = passes::begin(encoder, label, &[(&self.lit, CLEAR)], None);
                pass.set_scissor_rect(0, 0, SIDE, rows);
                pass.set_pipeline(&self.irradiance);
                pass.set_bind_group(0, &renderer.camera_group, &[]);
                pass.set_bind_group(1, &renderer.meshes[index].material, &[]);
                pass.set_bind_group(2, &renderer.lights.group, &[]);
                pass.set_bind_group(3, &self.group, &[]);
                pass.draw(0..3, 0..1);
            });
            let lit = gpu.read(&self.lit);
            irradiance.extend(lit[..places.len()].iter().map(|e| Vec3::new(e[0], e[1], e[2])));
        }
        irradiance
    }
}

/// What the shader reads of a place.
fn texels(
    primitive: &Primitive,
    (triangle, shares): (usize, Vec3),
    camera: &Camera,
    size: [u32; 2],
    mm_per_unit: f32,
) -> [Vec4; LAYERS as usize] {
    let corner = |i: usize| &primitive.vertices[primitive.indices[3 * triangle + i] as usize];
    let [a, b, c] = [corner(0), corner(1), corner(2)];
    let position = |i: usize| Vec3::from(corner(i).position);
    let between = |of: fn(&super::Vertex) -> Vec4| shares.x * of(a) + shares.y * of(b) + shares.z * of(c);
    let world = between(|v| Vec3::from(v.position).extend(0.0)).truncate();
    let normal = between(|v| Vec3::from(v.normal).extend(0.0)).truncate();
    // As a picture has it: by the triangle's own plane.
    let plane = (position(1) - position(0)).cross(position(2) - position(0));
    let [x, y] = camera.footprint(size, world, plane.normalize_or(Vec3::Z));
    let uv = |v: &super::Vertex| Vec2::from(v.uv);
    let uv_area = (uv(b) - uv(a)).perp_dot(uv(c) - uv(a)).abs();
    let uv_per_unit = (uv_area / plane.length().max(f32::MIN_POSITIVE)).sqrt();
    [
        world.extend((x * y).sqrt() * mm_per_unit),
        normal.extend(x.max(y) * uv_per_unit),
        between(|v| v.tangent.into()),
        between(|v| Vec2::from(v.uv).extend(0.0).extend(0.0)),
        between(|v| v.mask.into()),
        between(|v| v.color.into()),
    ]
}
