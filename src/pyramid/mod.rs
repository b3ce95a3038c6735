//! Scattering by a plan, over a pyramid of the frame: drives `shaders/tiles.wgsl`, and the passes
//! over tiles that follow `shaders/surface.wgsl`.

mod passes;
mod scratch;

use wgpu::{
    BindGroup, BindGroupLayout, Buffer, CommandEncoder, Device, Queue, Sampler, TextureFormat,
    TextureView,
};

use crate::frame::{NormalSettings, Optics, Viewport};
use crate::gaussian_sum::{begin, filled, scratch_view};
use crate::plan::Weights;
use crate::{Output, ScreenFrame};
use passes::{Compute, Draw, LIGHT, Passes, Shaders};
use scratch::{COLUMNS, DRAW_BYTES, LevelScratch, Scratch, View};

/// What a frame hands over, already checked.
pub(crate) struct Inputs<'a> {
    pub frame: &'a ScreenFrame<'a>,
    pub optics: Optics,
    pub plan: &'a Weights,
}

/// The passes, and what they need for the frame that was last prepared.
pub(crate) struct Pyramid {
    output: Output,
    shaders: Shaders,
    linear: Sampler,
    /// Bound where a frame has no ids.
    no_id: TextureView,
    planned: Option<Planned>,
    scratch: Option<Scratch>,
    frame: Option<Frame>,
}

/// What follows from the plan.
struct Planned {
    plan: Weights,
    weights: Buffer,
    passes: Passes,
}

/// The groups of one frame.
struct Frame {
    views: Views,
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
#[derive(Clone, PartialEq)]
struct Views {
    irradiance: TextureView,
    depth: TextureView,
    profile_id: TextureView,
    strength: TextureView,
    normal: TextureView,
    output: TextureView,
}

impl Pyramid {
    pub fn new(device: &Device, output: Output) -> Self {
        Self {
            output,
            shaders: Shaders::new(device),
            linear: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("subsurface linear"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            no_id: scratch_view(device, "subsurface no id", [1, 1], TextureFormat::R8Uint),
            planned: None,
            scratch: None,
            frame: None,
        }
    }

    /// Uploads what the frame needs; makes anew what a new plan, size or texture asks for.
    pub fn prepare(&mut self, device: &Device, queue: &Queue, inputs: &Inputs) {
        let frame = inputs.frame;
        let viewport = frame.viewport();
        let size = viewport.size();
        if self.planned.as_ref().is_none_or(|p| p.plan != *inputs.plan) {
            self.scratch = None;
            self.frame = None;
            self.planned = Some(Planned {
                plan: inputs.plan.clone(),
                weights: weights(device, inputs.plan),
                passes: Passes::new(device, &self.shaders, inputs.plan, self.output),
            });
        }
        let Some(planned) = &self.planned else { return };
        if self.scratch.as_ref().is_none_or(|s| s.size != size) {
            self.frame = None;
            self.scratch = None; // The old one goes before the new one comes.
            self.scratch = Some(Scratch::new(device, queue, size, &planned.plan));
        }
        let Some(scratch) = &self.scratch else { return };
        let plan = &planned.plan;
        let optics = &inputs.optics;
        let view = View {
            has_id: u32::from(frame.profile_id.is_some()),
            has_strength: u32::from(frame.strength.is_some()),
            far: optics.far,
            pad: 0,
            origin: optics.origin,
            step: optics.step,
            depth_to_mm: optics.depth_to_mm(),
            first_octave: plan.first_octave(),
            rows: plan.row_count() as u32,
            stride: plan.stride() as u32,
            profiles: plan.profiles.len() as u32,
            first_pixel: viewport.first(),
            size: size.into(),
        };
        queue.write_buffer(&scratch.view, 0, bytemuck::bytes_of(&view));
        let normals = NormalSettings::new(frame.normal);
        queue.write_buffer(&scratch.normals, 0, bytemuck::bytes_of(&normals));
        let views = Views {
            irradiance: frame.irradiance.clone(),
            depth: frame.depth.clone(),
            profile_id: frame.profile_id.unwrap_or(&self.no_id).clone(),
            // Not looked at where there is none.
            strength: frame.strength.unwrap_or(frame.irradiance).clone(),
            normal: frame.normal.map_or(frame.irradiance, |n| n.texture).clone(),
            output: frame.output.clone(),
        };
        match &mut self.frame {
            Some(made) if made.views == views => made.viewport = frame.viewport,
            made => {
                let linear = &self.linear;
                let groups = Frame::new(device, linear, planned, scratch, views, frame.viewport);
                *made = Some(groups);
            }
        }
    }

    /// Gives back what the frame that was last prepared needs.
    pub fn forget(&mut self) {
        self.frame = None;
        self.scratch = None;
    }

    /// Records the frame, and calls `after` with the label of each pass.
    pub fn render(
        &self,
        encoder: &mut CommandEncoder,
        after: &mut dyn FnMut(&str, &mut CommandEncoder),
    ) {
        let (Some(planned), Some(scratch), Some(frame)) =
            (&self.planned, &self.scratch, &self.frame)
        else {
            return;
        };
        let passes = &planned.passes;
        let [base, coarser @ ..] = &scratch.levels[..] else {
            return;
        };
        for level in &scratch.levels {
            forget_tiles(encoder, level);
        }
        encoder.clear_buffer(&scratch.marked, 0, None);
        let label = "subsurface tiles";
        {
            let mut pass = begin_compute(encoder, label);
            pass.set_pipeline(&passes.mark.pipeline);
            pass.set_bind_group(0, &frame.mark, &[]);
            pass.dispatch_workgroups(base.size[0].div_ceil(COLUMNS), base.tiles[1], 1);
            // All of the frame's; which of them are simple shows when they are packed.
            gather(&mut pass, &passes.gather, &frame.gather[0], base);
        }
        after(label, encoder);
        let label = "subsurface pack";
        {
            let targets = [&base.light, &base.shape];
            let mut pass = begin(encoder, label, &targets, false);
            over_tiles(&mut pass, passes.pack.each_ref(), &frame.pack, base);
        }
        after(label, encoder);
        forget_tiles(encoder, base);
        let label = "subsurface simple tiles";
        {
            let mut pass = begin_compute(encoder, label);
            for (group, level) in frame.gather.iter().zip(&scratch.levels) {
                gather(&mut pass, &passes.gather, group, level);
            }
        }
        after(label, encoder);
        for ((group, level), l) in frame.halve.iter().zip(coarser).zip(1..) {
            let label = format!("subsurface halve to level {l}");
            {
                let targets = [&level.light, &level.shape];
                let mut pass = begin(encoder, &label, &targets, false);
                over_tiles(&mut pass, passes.halve.each_ref(), group, level);
            }
            after(&label, encoder);
        }
        for l in (1..scratch.levels.len()).rev() {
            let label = format!("subsurface blur level {l}");
            {
                let (group, level) = (&frame.level[l - 1], &scratch.levels[l]);
                let mut pass = begin(encoder, &label, &[scratch.mean(l)], false);
                let [x, y] = level.size.map(|s| s as f32);
                pass.set_viewport(0.0, 0.0, x, y, 0.0, 1.0);
                over_tiles(&mut pass, passes.level.each_ref(), group, level);
            }
            after(&label, encoder);
        }
        let label = "subsurface blur frame";
        {
            let keeps = self.output.adds() || frame.viewport.is_some();
            let mut pass = begin(encoder, label, &[&frame.views.output], keeps);
            if let Some(viewport) = frame.viewport {
                viewport.apply(&mut pass);
            }
            if !self.output.is_difference() {
                pass.set_pipeline(&passes.copy.pipeline);
                pass.set_bind_group(0, &frame.copy, &[]);
                pass.draw(0..3, 0..1);
            }
            over_tiles(&mut pass, passes.frame.each_ref(), &frame.frame, base);
        }
        after(label, encoder);
    }
}

fn forget_tiles(encoder: &mut CommandEncoder, level: &LevelScratch) {
    for i in 0..2 {
        encoder.clear_buffer(&level.draws, i * DRAW_BYTES + 4, Some(4));
    }
}

fn begin_compute<'a>(encoder: &'a mut CommandEncoder, label: &str) -> wgpu::ComputePass<'a> {
    encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some(label),
        timestamp_writes: None,
    })
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
    draws: [&Draw; 2],
    group: &BindGroup,
    level: &LevelScratch,
) {
    pass.set_bind_group(0, group, &[]);
    for (i, draw) in (0..).zip(draws) {
        pass.set_pipeline(&draw.pipeline);
        pass.draw_indirect(&level.draws, i * DRAW_BYTES);
    }
}

fn weights(device: &Device, plan: &Weights) -> Buffer {
    let table = plan.table();
    let contents = bytemuck::cast_slice(&table);
    filled(
        device,
        "subsurface weights",
        contents,
        wgpu::BufferUsages::STORAGE,
    )
}

impl Frame {
    fn new(
        device: &Device,
        linear: &Sampler,
        planned: &Planned,
        scratch: &Scratch,
        views: Views,
        viewport: Option<Viewport>,
    ) -> Self {
        let Planned {
            weights, passes, ..
        } = planned;
        let Views {
            irradiance,
            depth,
            profile_id,
            strength,
            normal,
            ..
        } = &views;
        use wgpu::BindingResource::{Sampler, TextureView as Texture};
        let group = |layout: &BindGroupLayout, entries: &[(u32, wgpu::BindingResource)]| {
            let entries: Vec<_> = entries
                .iter()
                .map(|(binding, resource)| wgpu::BindGroupEntry {
                    binding: *binding,
                    resource: resource.clone(),
                })
                .collect();
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("subsurface"),
                layout,
                entries: &entries,
            })
        };
        let levels = &scratch.levels;
        let base = &levels[0];
        let view = scratch.view.as_entire_binding();
        let none = scratch_view(device, "subsurface nothing", [1, 1], LIGHT);
        let blur = |draw: &Draw, l: usize| {
            // The last level has none that is coarser; it does not look.
            let (shape, mean) = match levels.get(l + 1) {
                Some(next) => (&next.shape, scratch.mean(l + 1)),
                None => (&levels[l].shape, &none),
            };
            let mut entries = vec![
                (0, view.clone()),
                (1, levels[l].settings.as_entire_binding()),
                (2, levels[l].list.as_entire_binding()),
                (3, weights.as_entire_binding()),
                (7, Texture(&levels[l].light)),
                (8, Texture(&levels[l].shape)),
                (9, Texture(mean)),
                (10, Texture(shape)),
                (12, Sampler(linear)),
            ];
            if l == 0 {
                entries.push((4, Texture(strength)));
            }
            group(&draw.layout, &entries)
        };
        let gather = |l: usize| {
            let below = match l {
                0 => &scratch.marked,
                _ => &levels[l - 1].marked,
            };
            let entries = [
                (5, levels[l].gathering.as_entire_binding()),
                (6, below.as_entire_binding()),
                (7, levels[l].marked.as_entire_binding()),
                (8, levels[l].draws.as_entire_binding()),
                (9, levels[l].list.as_entire_binding()),
                (10, Texture(&base.shape)),
            ];
            group(&passes.gather.layout, &entries)
        };
        let halve = |l: usize| {
            let entries = [
                (0, view.clone()),
                (1, levels[l].settings.as_entire_binding()),
                (2, levels[l].list.as_entire_binding()),
                (7, Texture(&levels[l - 1].light)),
                (8, Texture(&levels[l - 1].shape)),
                (12, Sampler(linear)),
            ];
            group(&passes.halve[0].layout, &entries)
        };
        Self {
            viewport,
            mark: group(
                &passes.mark.layout,
                &[
                    (0, view.clone()),
                    (1, Texture(depth)),
                    (2, Texture(profile_id)),
                    (3, weights.as_entire_binding()),
                    (4, scratch.marked.as_entire_binding()),
                ],
            ),
            gather: (0..levels.len()).map(gather).collect(),
            pack: group(
                &passes.pack[0].layout,
                &[
                    (0, view.clone()),
                    (1, base.settings.as_entire_binding()),
                    (2, base.list.as_entire_binding()),
                    (4, Texture(irradiance)),
                    (5, Texture(depth)),
                    (6, Texture(profile_id)),
                    (11, scratch.marked.as_entire_binding()),
                    (13, scratch.normals.as_entire_binding()),
                    (14, Texture(normal)),
                ],
            ),
            halve: (1..levels.len()).map(halve).collect(),
            level: (1..levels.len())
                .map(|l| blur(&passes.level[0], l))
                .collect(),
            frame: blur(&passes.frame[0], 0),
            copy: group(&passes.copy.layout, &[(4, Texture(irradiance))]),
            views: views.clone(),
        }
    }
}
