//! Scattering by a plan, over a pyramid of the frame: drives `shaders/tiles.wgsl`, and the passes
//! over tiles that follow `shaders/surface.wgsl`.

mod passes;
mod scratch;

use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, Device, Queue, Sampler, TextureFormat,
    TextureView,
};

use crate::frame::Viewport;
use crate::gpu::{self, Recorder};
use crate::optics::Optics;
use crate::plan::Weights;
use crate::{Error, Frame, Output};
use passes::{Compute, LIGHT, OverTiles, Passes};
use scratch::{COLUMNS, DRAW_BYTES, LevelScratch, Scratch};

/// The passes of a plan, and its weights.
#[derive(Debug)]
pub(crate) struct Pyramid {
    output: Output,
    plan: Weights,
    weights: Buffer,
    passes: Passes,
    linear: Sampler,
    /// Bound where a frame has no ids.
    no_id: TextureView,
    /// Bound where there is no coarser level.
    no_mean: TextureView,
}

/// What one view needs, and the groups of its last frame.
#[derive(Debug)]
pub(crate) struct PyramidView {
    scratch: Scratch,
    groups: Option<Groups>,
}

#[derive(Debug)]
struct Groups {
    /// The weights of the plan that they bind.
    weights: Buffer,
    read: Textures,
    viewport: Option<Viewport>,
    mark: BindGroup,
    gather: Vec<BindGroup>,
    pack: BindGroup,
    /// Of each level from 1 on.
    halve: Vec<BindGroup>,
    level: Vec<BindGroup>,
    frame: BindGroup,
    copy: BindGroup,
}

/// What is bound of a host's.
#[derive(Clone, Debug, PartialEq)]
struct Textures {
    irradiance: TextureView,
    depth: TextureView,
    profile_id: TextureView,
    /// The irradiance where there is none; it is not looked at then.
    strength: TextureView,
    albedo: TextureView,
}

impl Pyramid {
    /// # Errors
    /// A device that allows less than WebGPU's default limits.
    pub fn new(device: &Device, output: Output, plan: &Weights) -> Result<Self, Error> {
        let limits = device.limits();
        for (limit, got, needs) in [
            (
                "max_storage_buffers_per_shader_stage",
                limits.max_storage_buffers_per_shader_stage,
                4,
            ),
            (
                "max_compute_invocations_per_workgroup",
                limits.max_compute_invocations_per_workgroup,
                64,
            ),
            (
                "max_compute_workgroup_size_x",
                limits.max_compute_workgroup_size_x,
                64,
            ),
        ] {
            if got < needs {
                return Err(Error::Limit { limit, got, needs });
            }
        }
        let texture = |label, format| gpu::scratch_texture(device, label, [1, 1], format);
        Ok(Self {
            output,
            plan: plan.clone(),
            weights: gpu::filled_buffer(
                device,
                "subsurface::pyramid weights",
                bytemuck::cast_slice(&plan.table()),
                wgpu::BufferUsages::STORAGE,
            ),
            passes: Passes::new(device, plan, output),
            linear: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("subsurface::pyramid linear"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            no_id: texture("subsurface::pyramid no id", TextureFormat::R8Uint),
            no_mean: texture("subsurface::pyramid no mean", LIGHT),
        })
    }

    /// Bytes of scratch memory of a view of so many pixels.
    pub fn scratch_bytes(&self, size: [u32; 2]) -> u64 {
        scratch::bytes(size, &self.plan)
    }

    /// Uploads the numbers of a frame. Makes anew what a change of its size, or of its textures, asks for.
    pub fn prepare(
        &self,
        device: &Device,
        queue: &Queue,
        view: &mut Option<PyramidView>,
        frame: &Frame,
        optics: &Optics,
    ) {
        let size = frame.rectangle().size();
        if view.as_ref().is_some_and(|v| v.scratch.size != size) {
            *view = None; // The old scratch goes before the new one comes.
        }
        let view = view.get_or_insert_with(|| PyramidView {
            scratch: Scratch::new(device, queue, size, &self.plan),
            groups: None,
        });
        let plan = &self.plan;
        let numbers = scratch::View {
            has_id: u32::from(frame.profile_id.is_some()),
            has_strength: u32::from(frame.strength.is_some()),
            far: optics.far,
            has_albedo: u32::from(frame.albedo.is_some()),
            origin: optics.origin,
            step: optics.step,
            depth_to_mm: optics.depth_to_mm(),
            first_octave: plan.first_octave(),
            rows: plan.row_count() as u32,
            stride: plan.stride() as u32,
            profiles: plan.profiles.len() as u32,
            first_pixel: frame.rectangle().first(),
            size: size.into(),
        };
        queue.write_buffer(&view.scratch.view, 0, bytemuck::bytes_of(&numbers));
        let read = Textures {
            irradiance: frame.irradiance.clone(),
            depth: frame.depth.clone(),
            profile_id: frame.profile_id.unwrap_or(&self.no_id).clone(),
            strength: frame.strength.unwrap_or(frame.irradiance).clone(),
            albedo: frame.albedo.unwrap_or(frame.irradiance).clone(),
        };
        match &mut view.groups {
            Some(groups) if groups.read == read && groups.weights == self.weights => {
                groups.viewport = frame.viewport;
            }
            groups => {
                view.scratch.set_plan(queue, plan);
                *groups = Some(self.bind(device, &view.scratch, read, frame.viewport));
            }
        }
    }

    fn bind(
        &self,
        device: &Device,
        scratch: &Scratch,
        read: Textures,
        viewport: Option<Viewport>,
    ) -> Groups {
        use BindingResource::{Sampler, TextureView as Texture};
        let group = |layout: &BindGroupLayout, resources: &[(u32, BindingResource)]| {
            gpu::group(device, "subsurface::pyramid", layout, resources)
        };
        let passes = &self.passes;
        let levels = &scratch.levels;
        let base = &levels[0];
        let view = scratch.view.as_entire_binding();
        let blur = |pass: &OverTiles, l: usize| {
            // The last level has none that is coarser; it does not look.
            let (shape, mean) = match levels.get(l + 1) {
                Some(next) => (&next.shape, scratch.mean(l + 1)),
                None => (&levels[l].shape, &self.no_mean),
            };
            let mut resources = vec![
                (0, view.clone()),
                (1, levels[l].settings.as_entire_binding()),
                (2, levels[l].list.as_entire_binding()),
                (3, self.weights.as_entire_binding()),
                (7, Texture(&levels[l].light)),
                (8, Texture(&levels[l].shape)),
                (9, Texture(mean)),
                (10, Texture(shape)),
                (12, Sampler(&self.linear)),
            ];
            if l == 0 {
                resources.push((4, Texture(&read.strength)));
                resources.push((5, Texture(&read.albedo)));
            }
            group(&pass.layout, &resources)
        };
        let gather = |l: usize| {
            let below = match l {
                0 => &scratch.marked,
                _ => &levels[l - 1].marked,
            };
            let resources = [
                (5, levels[l].gathering.as_entire_binding()),
                (6, below.as_entire_binding()),
                (7, levels[l].marked.as_entire_binding()),
                (8, levels[l].draws.as_entire_binding()),
                (9, levels[l].list.as_entire_binding()),
                (10, Texture(&base.shape)),
            ];
            group(&passes.gather.layout, &resources)
        };
        let halve = |l: usize| {
            let resources = [
                (0, view.clone()),
                (1, levels[l].settings.as_entire_binding()),
                (2, levels[l].list.as_entire_binding()),
                (7, Texture(&levels[l - 1].light)),
                (8, Texture(&levels[l - 1].shape)),
                (12, Sampler(&self.linear)),
            ];
            group(&passes.halve.layout, &resources)
        };
        Groups {
            weights: self.weights.clone(),
            viewport,
            mark: group(
                &passes.mark.layout,
                &[
                    (0, view.clone()),
                    (1, Texture(&read.depth)),
                    (2, Texture(&read.profile_id)),
                    (3, self.weights.as_entire_binding()),
                    (4, scratch.marked.as_entire_binding()),
                ],
            ),
            gather: (0..levels.len()).map(gather).collect(),
            pack: group(
                &passes.pack.layout,
                &[
                    (0, view.clone()),
                    (1, base.settings.as_entire_binding()),
                    (2, base.list.as_entire_binding()),
                    (4, Texture(&read.irradiance)),
                    (5, Texture(&read.depth)),
                    (6, Texture(&read.profile_id)),
                    (11, scratch.marked.as_entire_binding()),
                ],
            ),
            halve: (1..levels.len()).map(halve).collect(),
            level: (1..levels.len()).map(|l| blur(&passes.level, l)).collect(),
            frame: blur(&passes.frame, 0),
            copy: group(
                &passes.copy_layout,
                &[
                    (0, view.clone()),
                    (4, Texture(&read.irradiance)),
                    (5, Texture(&read.albedo)),
                ],
            ),
            read,
        }
    }

    /// Records the frame that was last prepared.
    pub fn render(&self, recorder: &mut Recorder, view: &PyramidView, output: &TextureView) {
        let PyramidView { scratch, groups } = view;
        let (Some(groups), [base, coarser @ ..]) = (groups, &scratch.levels[..]) else {
            return;
        };
        let passes = &self.passes;
        for level in &scratch.levels {
            forget_tiles(recorder, level);
        }
        recorder.encoder.clear_buffer(&scratch.marked, 0, None);
        {
            let mut pass = recorder.dispatch("subsurface::pyramid tiles");
            pass.set_pipeline(&passes.mark.pipeline);
            pass.set_bind_group(0, &groups.mark, &[]);
            pass.dispatch_workgroups(base.size[0].div_ceil(COLUMNS), base.tiles[1], 1);
            // All of the frame's; which of them are simple shows when they are packed.
            gather(&mut pass, &passes.gather, &groups.gather[0], base);
        }
        {
            let targets = [&base.light, &base.shape];
            let mut pass = recorder.draw("subsurface::pyramid pack", &targets, false);
            over_tiles(&mut pass, &passes.pack, &groups.pack, base);
        }
        forget_tiles(recorder, base);
        {
            let mut pass = recorder.dispatch("subsurface::pyramid simple tiles");
            for (group, level) in groups.gather.iter().zip(&scratch.levels) {
                gather(&mut pass, &passes.gather, group, level);
            }
        }
        for ((group, level), l) in groups.halve.iter().zip(coarser).zip(1..) {
            let label = format!("subsurface::pyramid halve to level {l}");
            let targets = [&level.light, &level.shape];
            let mut pass = recorder.draw(&label, &targets, false);
            over_tiles(&mut pass, &passes.halve, group, level);
        }
        for l in (1..scratch.levels.len()).rev() {
            let (group, level) = (&groups.level[l - 1], &scratch.levels[l]);
            let label = format!("subsurface::pyramid blur level {l}");
            let mut pass = recorder.draw(&label, &[scratch.mean(l)], false);
            let [x, y] = level.size.map(|s| s as f32);
            pass.set_viewport(0.0, 0.0, x, y, 0.0, 1.0);
            over_tiles(&mut pass, &passes.level, group, level);
        }
        let keeps = self.output.adds() || groups.viewport.is_some();
        let mut pass = recorder.draw("subsurface::pyramid blur frame", &[output], keeps);
        if let Some(viewport) = groups.viewport {
            viewport.apply(&mut pass);
        }
        if !self.output.is_difference() {
            pass.set_pipeline(&passes.copy);
            pass.set_bind_group(0, &groups.copy, &[]);
            pass.draw(0..3, 0..1);
        }
        over_tiles(&mut pass, &passes.frame, &groups.frame, base);
    }
}

fn forget_tiles(recorder: &mut Recorder, level: &LevelScratch) {
    for i in 0..2 {
        let draw = i * DRAW_BYTES + 4;
        recorder.encoder.clear_buffer(&level.draws, draw, Some(4));
    }
}

fn gather(pass: &mut wgpu::ComputePass, to: &Compute, group: &BindGroup, level: &LevelScratch) {
    let [x, y] = level.tiles;
    pass.set_pipeline(&to.pipeline);
    pass.set_bind_group(0, group, &[]);
    pass.dispatch_workgroups(x.div_ceil(8), y.div_ceil(8), 1);
}

/// Draws the simple tiles of a level by the first, the others by the second.
fn over_tiles(
    pass: &mut wgpu::RenderPass,
    draws: &OverTiles,
    group: &BindGroup,
    level: &LevelScratch,
) {
    pass.set_bind_group(0, group, &[]);
    for (i, pipeline) in (0..).zip(&draws.pipelines) {
        pass.set_pipeline(pipeline);
        pass.draw_indirect(&level.draws, i * DRAW_BYTES);
    }
}
