//! The layer behind the frame, as the pyramid has it. Drives `shaders/pyramid/pack_back.wgsl` and
//! `halve_back.wgsl`.

use glam::Vec3;
use wgpu::{BindGroup, BindingResource, Buffer, BufferUsages, Device, Queue, TextureView};

use super::passes::{Compute, LIGHT, SHAPE};
use super::scratch::{self, Scratch, View};
use crate::Profile;
use crate::gpu::{self, Recorder};

/// `[r, g]`: a layer changes the light by more than `error`, a part of white, where the square of its distance behind
/// the surface, in mm, is under r² + g·ln d, with d the difference of their light.
pub(super) fn reach(profiles: &[Profile], error: f32) -> [f32; 2] {
    let [far, near] = [error, LESS * error].map(|error| reach_mm(profiles, error));
    [far, (far * far - near * near) / LESS.ln()]
}

/// That line goes through d = 1 and d = 1 over this.
const LESS: f32 = 10.0;

/// At which distance Σ w e^(−t²/2v) is down to an error.
fn reach_mm(profiles: &[Profile], error: f32) -> f32 {
    let is_seen = |t: f32| {
        let left = |profile: &Profile| {
            let each = profile.gaussians().iter().filter(|g| g.variance_mm2 > 0.0);
            each.map(|g| Vec3::from(g.weight) * (-0.5 * t * t / g.variance_mm2).exp()).sum::<Vec3>()
        };
        profiles.iter().any(|profile| left(profile).max_element() > error)
    };
    let gaussians = profiles.iter().flat_map(Profile::gaussians);
    let widest_mm = gaussians.map(|g| g.variance_mm2).fold(0.0, f32::max).sqrt();
    // Beyond 4 σ there are 3e-4 left.
    let (mut near, mut far) = (0.0, 4.0 * widest_mm);
    for _ in 0..16 {
        let middle = 0.5 * (near + far);
        if is_seen(middle) {
            near = middle;
        } else {
            far = middle;
        }
    }
    far
}

/// What one view needs for it.
#[derive(Debug)]
pub(super) struct Back {
    /// The numbers of the frame, as those of the back.
    pub view: Buffer,
    /// What each tile holds of it.
    pub tiles: Buffer,
    /// All levels of light, and of where the surface is.
    pub lights: TextureView,
    pub shapes: TextureView,
    /// The same of each level.
    levels: Vec<[TextureView; 2]>,
}

/// The groups of the last frame.
#[derive(Debug)]
pub(super) struct Groups {
    pack: BindGroup,
    /// Of each level from 1 on.
    halve: Vec<BindGroup>,
}

/// Irradiance, depth and profile id.
pub(super) type Textures = [TextureView; 3];

impl Back {
    pub(super) fn new(device: &Device, front: &Scratch) -> Self {
        // Passes clear the finest level.
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::STORAGE_BINDING;
        let count = front.levels.len();
        let mips = |label, format| scratch::mips(device, label, front.size, count, format, usage);
        let lights = mips("subsurface::pyramid light of the back", LIGHT);
        let shapes = mips("subsurface::pyramid shape of the back", SHAPE);
        Self {
            view: gpu::uniform_buffer::<View>(device, "subsurface::pyramid view of the back"),
            tiles: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("subsurface::pyramid tiles of the back"),
                size: 4 * front.levels.iter().map(|l| u64::from(l.tiles[0] * l.tiles[1])).sum::<u64>(),
                usage: BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            levels: (0..count)
                .map(|l| [&lights, &shapes].map(|texture| scratch::mip(texture, l)))
                .collect(),
            lights: lights.create_view(&Default::default()),
            shapes: shapes.create_view(&Default::default()),
        }
    }

    /// Light and shape, as fine as the frame.
    pub(super) fn finest(&self) -> &[TextureView; 2] {
        &self.levels[0]
    }

    /// Uploads the numbers of a frame; `has_id`: whether the back has ids.
    pub(super) fn upload(&self, queue: &Queue, numbers: &View, has_id: bool) {
        let numbers = View { has_id: has_id.into(), ..*numbers };
        queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&numbers));
    }

    pub(super) fn bind(
        &self,
        device: &Device,
        [pack, halve]: [&Compute; 2],
        front: &Scratch,
        last: usize,
        weights: &Buffer,
        [irradiance, depth, profile_id]: &Textures,
    ) -> Groups {
        use BindingResource::TextureView as Texture;
        let label = "subsurface::pyramid back";
        let [light, shape] = &self.levels[0];
        let pack = gpu::group(
            device,
            label,
            &pack.layout,
            &[
                (0, self.view.as_entire_binding()),
                (1, front.levels[0].settings.as_entire_binding()),
                (3, weights.as_entire_binding()),
                (4, Texture(irradiance)),
                (5, Texture(depth)),
                (6, Texture(profile_id)),
                (7, Texture(light)),
                (8, Texture(shape)),
                (9, front.grids.as_entire_binding()),
                (10, front.contents.as_entire_binding()),
                (11, Texture(&front.levels[0].shape)),
                (12, self.tiles.as_entire_binding()),
                (13, Texture(&front.levels[0].light)),
            ],
        );
        let pairs = self.levels.iter().zip(&self.levels[1..]).zip(&front.levels[1..]);
        let halve = pairs.take(last).map(|(([light, shape], halved), level)| {
            gpu::group(
                device,
                label,
                &halve.layout,
                &[
                    (0, self.view.as_entire_binding()),
                    (1, level.settings.as_entire_binding()),
                    (7, Texture(light)),
                    (8, Texture(shape)),
                    (9, front.grids.as_entire_binding()),
                    (12, self.tiles.as_entire_binding()),
                    (13, Texture(&halved[0])),
                    (14, Texture(&halved[1])),
                ],
            )
        });
        Groups { pack, halve: halve.collect() }
    }
}

impl Groups {
    /// Packs so many groups of tiles, after the frame itself was packed.
    pub(super) fn pack(&self, pass: &mut wgpu::ComputePass, compute: &Compute, [x, y]: [u32; 2]) {
        pass.set_pipeline(&compute.pipeline);
        pass.set_bind_group(0, &self.pack, &[]);
        pass.dispatch_workgroups(x, y, 1);
    }

    /// Makes all levels, in one pass.
    pub(super) fn halve(&self, recorder: &mut Recorder, compute: &Compute, front: &Scratch) {
        let mut pass = recorder.dispatch("subsurface::pyramid halve back");
        pass.set_pipeline(&compute.pipeline);
        for (group, level) in self.halve.iter().zip(&front.levels[1..]) {
            let [x, y] = level.tiles;
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(x, y, 1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_its_reach_a_layer_changes_the_light_by_the_error() {
        let red = |t2: f32| -> f32 {
            let gaussians = Profile::SKIN.gaussians().iter();
            gaussians.map(|g| g.weight[0] * (-0.5 * t2 / g.variance_mm2).exp()).sum()
        };
        for error in [1.0 / 255.0, 1.0 / 100.0] {
            let [reach, growth] = reach(&[Profile::SKIN], error);
            for difference in [1.0, 0.7, 0.4, 0.2, 0.1] {
                let change = difference * red(reach * reach + growth * f32::ln(difference));
                // A line stands for a curve that bends below it: between its ends it is up to a quarter early.
                assert!(change > 0.75 * error && change < 1.01 * error, "{error} {difference}: {change}");
            }
        }
    }
}
