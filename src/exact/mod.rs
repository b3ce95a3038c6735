//! The exact sum in screen space: from depth to positions, then each Gaussian by the distances between
//! them. Drives `shaders/exact/positions.wgsl`.

pub(crate) mod gaussian_sum;

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, UVec2, Vec2};
use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, Device, Queue, RenderPipeline, ShaderStages,
    TextureFormat, TextureView,
};

use crate::gpu::{self, Recorder};
use crate::optics::Optics;
use crate::{Frame, MAX_PROFILES, Output, Profile};
use gaussian_sum::{GaussianSum, Inputs, SCRATCH, Sums, Textures};

/// Bytes of positions, and of what [`GaussianSum`] takes: source, rows and two sums.
pub(crate) fn scratch_bytes([width, height]: [u32; 2]) -> u64 {
    5 * 16 * u64::from(width) * u64::from(height)
}

/// What a back layer takes on top: positions, source, and where its blocks are.
pub(crate) fn back_scratch_bytes(size: [u32; 2]) -> u64 {
    let count = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
    16 * (2 * count(size) + count(gaussian_sum::blocks(size)))
}

const LABEL: &str = "subsurface::exact";
const SHADER: &str = include_str!("../../shaders/exact/positions.wgsl");

/// `Settings` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Settings {
    inverse_projection: Mat4,
    first_pixel: UVec2,
    size: Vec2,
    far: f32,
    has_id: u32,
    first_ids: [u32; 2],
}

/// As the shader has them: four bits for each profile, for the first one that is equal.
fn first_ids(profiles: &[Profile]) -> [u32; 2] {
    let mut ids = 0u64;
    for i in 0..MAX_PROFILES {
        let is_equal = |p: &Profile| profiles.get(i).is_some_and(|q| p.gaussians() == q.gaussians());
        // Ids without a profile stay what they are.
        let first = profiles.iter().position(is_equal).unwrap_or(i);
        ids |= (first as u64) << (4 * i);
    }
    [ids as u32, (ids >> 32) as u32]
}

/// The passes.
#[derive(Debug)]
pub(crate) struct Exact {
    layout: BindGroupLayout,
    positions: RenderPipeline,
    /// Bound where a frame has no ids.
    no_id: TextureView,
    sum: GaussianSum,
}

/// What one view needs.
#[derive(Debug)]
pub(crate) struct ExactView {
    front: Surface,
    back: Option<Surface>,
    sums: Sums,
}

/// One layer of a frame, turned into positions.
#[derive(Debug)]
struct Surface {
    settings: Buffer,
    positions: TextureView,
    bound: Option<Bound>,
}

#[derive(Debug)]
struct Bound {
    depth: TextureView,
    profile_id: TextureView,
    group: BindGroup,
}

impl Surface {
    fn new(device: &Device, size: [u32; 2]) -> Self {
        Self {
            settings: gpu::uniform_buffer::<Settings>(device, "subsurface::exact settings"),
            positions: gpu::scratch_texture(device, "subsurface::exact positions", size, SCRATCH),
            bound: None,
        }
    }
}

impl Exact {
    pub(crate) fn new(device: &Device, output: Output) -> Self {
        let label = "subsurface::exact positions";
        let bindings = [(0, gpu::UNIFORM), (1, gpu::FLOATS), (2, gpu::UINTS)];
        let layout = gpu::layout(device, label, ShaderStages::FRAGMENT, &bindings);
        let positions = gpu::Draw {
            label,
            module: &gpu::module(device, label, &[SHADER]),
            vertex: "vs_main",
            fragment: "fs_positions",
            layout: &layout,
            topology: wgpu::PrimitiveTopology::TriangleList,
            targets: &[Some(SCRATCH.into())],
            constants: &[],
        }
        .pipeline(device);
        Self {
            layout,
            positions,
            no_id: gpu::scratch_texture(device, label, [1, 1], TextureFormat::R8Uint),
            sum: GaussianSum::new(device, output, LABEL, true),
        }
    }

    /// Uploads the numbers of a frame. Makes anew what a change of its size, or of its textures, asks for.
    pub(crate) fn prepare(
        &self,
        device: &Device,
        queue: &Queue,
        view: &mut Option<ExactView>,
        frame: &Frame,
        optics: &Optics,
        profiles: &[Profile],
    ) {
        let size = frame.rectangle().size();
        if view.as_ref().is_some_and(|v| v.sums.size() != size) {
            *view = None; // The old scratch goes before the new one comes.
        }
        let view = view.get_or_insert_with(|| ExactView {
            front: Surface::new(device, size),
            back: None,
            sums: self.sum.sums(device, size),
        });
        let numbers = Settings {
            inverse_projection: optics.inverse_projection,
            first_pixel: frame.rectangle().first(),
            size: UVec2::from(size).as_vec2(),
            far: optics.far,
            has_id: 0,
            first_ids: first_ids(profiles),
        };
        let front = (frame.depth, frame.profile_id);
        self.prepare_surface(device, queue, &mut view.front, numbers, front);
        match frame.back {
            Some(back) => {
                let surface = view.back.get_or_insert_with(|| Surface::new(device, size));
                let layer = (back.depth, back.profile_id.or(frame.profile_id));
                self.prepare_surface(device, queue, surface, numbers, layer);
            }
            None => view.back = None,
        }
        let back = frame.back.zip(view.back.as_ref());
        let textures = Textures {
            positions: view.front.positions.clone(),
            irradiance: frame.irradiance.clone(),
            strength: frame.strength.unwrap_or(frame.irradiance).clone(),
            albedo: frame.albedo.unwrap_or(frame.irradiance).clone(),
            back: back.map(|(back, surface)| [surface.positions.clone(), back.irradiance.clone()]),
        };
        let settings = gaussian_sum::Settings {
            spacing: optics.spacing(),
            first_pixel: frame.rectangle().first(),
            has_strength: u32::from(frame.strength.is_some()),
            has_albedo: u32::from(frame.albedo.is_some()),
            ..gaussian_sum::Settings::new(profiles, 1.0)
        };
        let inputs = Inputs::new(profiles, textures, settings, frame.viewport);
        self.sum.prepare(device, queue, &mut view.sums, inputs);
    }

    /// Uploads the numbers of a layer, and binds its textures where they are others than before.
    fn prepare_surface(
        &self,
        device: &Device,
        queue: &Queue,
        surface: &mut Surface,
        numbers: Settings,
        layer: (&TextureView, Option<&TextureView>),
    ) {
        let (depth, profile_id) = layer;
        let settings = Settings { has_id: u32::from(profile_id.is_some()), ..numbers };
        queue.write_buffer(&surface.settings, 0, bytemuck::bytes_of(&settings));
        let profile_id = profile_id.unwrap_or(&self.no_id);
        let is_bound = |b: &Bound| b.depth == *depth && b.profile_id == *profile_id;
        if !surface.bound.as_ref().is_some_and(is_bound) {
            let resources = [
                (0, surface.settings.as_entire_binding()),
                (1, BindingResource::TextureView(depth)),
                (2, BindingResource::TextureView(profile_id)),
            ];
            surface.bound = Some(Bound {
                depth: depth.clone(),
                profile_id: profile_id.clone(),
                group: gpu::group(device, LABEL, &self.layout, &resources),
            });
        }
    }

    /// Records the frame that was last prepared.
    pub(crate) fn render(&self, recorder: &mut Recorder, view: &ExactView, output: &TextureView) {
        let layers = [("positions", Some(&view.front)), ("positions of the back", view.back.as_ref())];
        for (name, surface) in layers {
            let Some((surface, bound)) = surface.and_then(|s| Some((s, s.bound.as_ref()?))) else {
                continue;
            };
            let mut pass = recorder.draw(&format!("{LABEL} {name}"), &[&surface.positions], false);
            pass.set_pipeline(&self.positions);
            pass.set_bind_group(0, &bound.group, &[]);
            pass.draw(0..3, 0..1);
        }
        self.sum.render(recorder, &view.sums, output);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wgsl::assert_layout;

    #[test]
    fn settings_lie_as_the_shader_has_them() {
        assert_layout!(
            SHADER,
            "Settings",
            Settings { inverse_projection, first_pixel, size, far, has_id, first_ids }
        );
        assert_eq!(crate::wgsl::constant(SHADER, "MAX_PROFILES") as usize, MAX_PROFILES);
    }
}
