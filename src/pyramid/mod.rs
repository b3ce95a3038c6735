//! Scattering by a plan, over a pyramid of the frame: drives `shaders/pyramid/`. A compute pass packs the frame
//! and says what its tiles hold, another lists those of each level by their class; all others are drawn over
//! these lists.

mod back;
mod passes;
mod scratch;

use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, Device, Queue, Sampler, TextureFormat, TextureView,
};

use crate::frame::Viewport;
use crate::gpu::{self, Recorder};
use crate::optics::Optics;
use crate::plan::Weights;
use crate::{Error, Frame, Output, Profile};
use back::Back;
pub(crate) use passes::OVERLAY;
use passes::{LIGHT, OverTiles, Passes};
use scratch::{CLASSES, DRAW_BYTES, SIDE, Scratch};

/// What doubt (`list_tiles.wgsl`) there may be in a tile for it to be planar, over the error of the plan: of the frame,
/// and of its levels. Found on heads: beyond, errors grow.
const FRAME_LIMIT: f32 = 98.0;
const LEVEL_LIMIT: f32 = 184.0;

/// The passes of a plan, and its weights.
#[derive(Debug)]
pub(crate) struct Pyramid {
    output: Output,
    plan: Weights,
    /// Of a back layer: `back::reach`.
    back_reach: [f32; 2],
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
    back: Option<Back>,
    groups: Option<Groups>,
}

#[derive(Debug)]
struct Groups {
    /// The weights of the plan that they bind.
    weights: Buffer,
    read: Textures,
    /// The coarsest level that the nearest skin needs, of those that there are.
    last: usize,
    viewport: Option<Viewport>,
    pack: BindGroup,
    back: Option<back::Groups>,
    list_tiles: BindGroup,
    /// Of each level from 1 on.
    downsample: Vec<BindGroup>,
    level: Vec<BindGroup>,
    frame: BindGroup,
    copy: BindGroup,
}

/// What an [`Overlay`](crate::Overlay) reads.
pub(crate) struct Seen<'a> {
    pub(crate) size: [u32; 2],
    pub(crate) viewport: Option<Viewport>,
    pub(crate) view: &'a Buffer,
    pub(crate) weights: &'a Buffer,
    pub(crate) grids: &'a Buffer,
    pub(crate) contents: &'a Buffer,
    /// What the tiles hold of the layer behind; anything where there is none.
    pub(crate) back_tiles: &'a Buffer,
    pub(crate) depth: &'a TextureView,
    pub(crate) profile_id: &'a TextureView,
}

/// By what a device drew the last frame of a view, for tools that count it.
#[derive(Debug)]
pub struct Tiles<'a> {
    /// Indirect draws: of each level one of the planar tiles and one of the others, its second word their number.
    /// `COPY_SRC`.
    pub draws: &'a Buffer,
    /// Tiles, x in the low half of a word: of each level, the frame first, as many words as it has tiles, the
    /// planar ones from the front on, the others from the end. `COPY_SRC`.
    pub list: &'a Buffer,
    /// A word a tile, levels in the same order: bit 0 where a back layer is within reach, bit 1 where any
    /// is packed. `COPY_SRC`.
    pub back: Option<&'a Buffer>,
    /// Columns and rows of tiles of each level that is drawn.
    pub levels: Vec<[u32; 2]>,
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
    back: Option<back::Textures>,
}

impl Pyramid {
    /// # Errors
    /// A device that allows less than WebGPU's default limits.
    pub(crate) fn new(
        device: &Device,
        output: Output,
        plan: &Weights,
        profiles: &[Profile],
    ) -> Result<Self, Error> {
        let limits = device.limits();
        for (limit, got, needs) in [
            ("max_storage_buffers_per_shader_stage", limits.max_storage_buffers_per_shader_stage, 4),
            ("max_compute_invocations_per_workgroup", limits.max_compute_invocations_per_workgroup, 64),
            ("max_compute_workgroup_size_x", limits.max_compute_workgroup_size_x, 64),
        ] {
            if got < needs {
                return Err(Error::Limit { limit, got, needs });
            }
        }
        let texture = |label, format| gpu::scratch_texture(device, label, [1, 1], format);
        Ok(Self {
            output,
            plan: plan.clone(),
            back_reach: back::reach(profiles, plan.predicted_error()),
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
    pub(crate) fn scratch_bytes(&self, size: [u32; 2]) -> u64 {
        scratch::bytes(size, &self.plan)
    }

    /// What a back layer takes on top.
    pub(crate) fn back_scratch_bytes(&self, size: [u32; 2]) -> u64 {
        scratch::back_bytes(size, &self.plan)
    }

    /// Uploads the numbers of a frame. Makes anew what a change of its size, or of its textures, asks for.
    pub(crate) fn prepare(
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
            back: None,
            groups: None,
        });
        match frame.back {
            Some(_) => drop(view.back.get_or_insert_with(|| Back::new(device, &view.scratch))),
            None => view.back = None,
        }
        let plan = &self.plan;
        let nearest_mm = frame.nearest.map(|nearest| nearest * frame.mm_per_unit);
        let coarsest = plan.coarsest_level(optics.nearest_px_per_mm(nearest_mm));
        let last = coarsest.max(1).min(view.scratch.levels.len() - 1);
        let [back_reach, back_growth] = frame.back.map_or([0.0; 2], |_| self.back_reach);
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
            frame_limit: FRAME_LIMIT * plan.predicted_error(),
            level_limit: LEVEL_LIMIT * plan.predicted_error(),
            levels: last as u32,
            back_reach,
            back_growth,
            pad: [0; 3],
        };
        queue.write_buffer(&view.scratch.view, 0, bytemuck::bytes_of(&numbers));
        let back_id = frame.back.and_then(|back| back.profile_id).or(frame.profile_id);
        if let Some(back) = &view.back {
            back.upload(queue, &numbers, back_id.is_some());
        }
        let read = Textures {
            irradiance: frame.irradiance.clone(),
            depth: frame.depth.clone(),
            profile_id: frame.profile_id.unwrap_or(&self.no_id).clone(),
            strength: frame.strength.unwrap_or(frame.irradiance).clone(),
            albedo: frame.albedo.unwrap_or(frame.irradiance).clone(),
            back: frame.back.map(|back| {
                [back.irradiance, back.depth, back_id.unwrap_or(&self.no_id)].map(TextureView::clone)
            }),
        };
        match &mut view.groups {
            Some(groups)
                if groups.read == read && groups.weights == self.weights && groups.last == last =>
            {
                groups.viewport = frame.viewport;
            }
            groups => {
                view.scratch.set_plan(queue, plan, last);
                let back = view.back.as_ref();
                *groups = Some(self.bind(device, &view.scratch, back, read, last, frame.viewport));
            }
        }
    }

    fn bind(
        &self,
        device: &Device,
        scratch: &Scratch,
        back: Option<&Back>,
        read: Textures,
        last: usize,
        viewport: Option<Viewport>,
    ) -> Groups {
        use BindingResource::{Sampler, TextureView as Texture};
        let group = |layout: &BindGroupLayout, resources: &[(u32, BindingResource)]| {
            gpu::group(device, "subsurface::pyramid", layout, resources)
        };
        let passes = &self.passes;
        let levels = &scratch.levels[..=last];
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
                (2, scratch.list.as_entire_binding()),
                (3, self.weights.as_entire_binding()),
                (7, Texture(&levels[l].light)),
                (8, Texture(&levels[l].shape)),
                (9, Texture(mean)),
                (10, Texture(shape)),
                (12, Sampler(&self.linear)),
                (13, scratch.steps.as_entire_binding()),
                (14, Texture(&scratch.lights)),
                (15, Texture(&scratch.shapes)),
                // Where there is no back these are not looked at.
                (16, Texture(back.map_or(&scratch.lights, |back| &back.lights))),
                (17, Texture(back.map_or(&scratch.shapes, |back| &back.shapes))),
            ];
            if l == 0 {
                resources.push((4, Texture(&read.strength)));
                resources.push((5, Texture(&read.albedo)));
                resources.push((6, Texture(&read.irradiance)));
                let tiles = back.map_or(&scratch.contents, |back| &back.tiles);
                resources.push((18, tiles.as_entire_binding()));
            }
            group(&pass.layout, &resources)
        };
        let downsample = |l: usize| {
            let resources = [
                (0, view.clone()),
                (1, levels[l].settings.as_entire_binding()),
                (2, scratch.list.as_entire_binding()),
                (7, Texture(&levels[l - 1].light)),
                (8, Texture(&levels[l - 1].shape)),
                (12, Sampler(&self.linear)),
            ];
            group(&passes.downsample.layout, &resources)
        };
        Groups {
            weights: self.weights.clone(),
            last,
            viewport,
            pack: group(
                &passes.pack.layout,
                &[
                    (0, view.clone()),
                    (1, base.settings.as_entire_binding()),
                    (3, self.weights.as_entire_binding()),
                    (4, Texture(&read.irradiance)),
                    (5, Texture(&read.depth)),
                    (6, Texture(&read.profile_id)),
                    (7, Texture(&base.light)),
                    (8, Texture(&base.shape)),
                    (9, scratch.grids.as_entire_binding()),
                    (10, scratch.contents.as_entire_binding()),
                ],
            ),
            list_tiles: group(
                &passes.list_tiles.layout,
                &[
                    (0, view.clone()),
                    (9, scratch.grids.as_entire_binding()),
                    (10, scratch.contents.as_entire_binding()),
                    (11, scratch.draws.as_entire_binding()),
                    (12, scratch.list.as_entire_binding()),
                    (13, back.map_or(&scratch.contents, |back| &back.tiles).as_entire_binding()),
                ],
            ),
            back: back.zip(read.back.as_ref()).map(|(back, read)| {
                let computes = [&passes.pack_back, &passes.halve_back];
                back.bind(device, computes, scratch, last, &self.weights, read)
            }),
            downsample: (1..=last).map(downsample).collect(),
            level: (1..=last).map(|l| blur(&passes.level, l)).collect(),
            frame: blur(&passes.frame, 0),
            copy: group(
                &passes.copy_layout,
                &[
                    (0, view.clone()),
                    (4, Texture(&read.irradiance)),
                    (5, Texture(&read.albedo)),
                    (8, Texture(&base.shape)),
                    (9, scratch.grids.as_entire_binding()),
                    (10, scratch.contents.as_entire_binding()),
                ],
            ),
            read,
        }
    }

    /// What an overlay reads of the frame, of `size` pixels, that was last prepared.
    pub(crate) fn seen<'a>(&'a self, view: &'a PyramidView, size: [u32; 2]) -> Option<Seen<'a>> {
        let groups = view.groups.as_ref()?;
        Some(Seen {
            size,
            viewport: groups.viewport,
            view: &view.scratch.view,
            weights: &self.weights,
            grids: &view.scratch.grids,
            contents: &view.scratch.contents,
            back_tiles: view.back.as_ref().map_or(&view.scratch.contents, |back| &back.tiles),
            depth: &groups.read.depth,
            profile_id: &groups.read.profile_id,
        })
    }

    pub(crate) fn tiles(view: &PyramidView) -> Tiles<'_> {
        let scratch = &view.scratch;
        let last = view.groups.as_ref().map_or(0, |groups| groups.last);
        Tiles {
            draws: &scratch.draws,
            list: &scratch.list,
            back: view.back.as_ref().map(|back| &back.tiles),
            levels: scratch.levels[..=last].iter().map(|level| level.tiles).collect(),
        }
    }

    /// Records the frame that was last prepared.
    pub(crate) fn render(&self, recorder: &mut Recorder, view: &PyramidView, output: &TextureView) {
        let PyramidView { scratch, groups, back } = view;
        let (Some(groups), [base, coarser @ ..]) = (groups, &scratch.levels[..]) else {
            return;
        };
        let passes = &self.passes;
        let draws = scratch.draws.size();
        let encoder = &mut *recorder.encoder;
        encoder.copy_buffer_to_buffer(&scratch.no_draws, 0, &scratch.draws, 0, draws);
        encoder.clear_buffer(&scratch.contents, 0, None);
        if let Some(back) = back {
            encoder.clear_buffer(&back.tiles, 0, None);
        }
        // Nothing is drawn: it clears what is packed.
        let front = [&base.light, &base.shape];
        let cleared: Vec<_> = front.into_iter().chain(back.iter().flat_map(Back::finest)).collect();
        recorder.draw("subsurface::pyramid clear", &cleared, false);
        {
            let [x, y] = base.tiles;
            let mut pass = recorder.dispatch("subsurface::pyramid pack");
            pass.set_pipeline(&passes.pack.pipeline);
            pass.set_bind_group(0, &groups.pack, &[]);
            let packing = base.tiles.map(|count| count.div_ceil(SIDE));
            pass.dispatch_workgroups(packing[0], packing[1], 1);
            if let Some(back) = &groups.back {
                back.pack(&mut pass, &passes.pack_back, packing);
            }
            pass.set_pipeline(&passes.list_tiles.pipeline);
            pass.set_bind_group(0, &groups.list_tiles, &[]);
            pass.dispatch_workgroups(x.div_ceil(8), y.div_ceil(8), groups.last as u32 + 1);
        }
        if let Some(back) = &groups.back {
            back.halve(recorder, &passes.halve_back, scratch);
        }
        for ((group, level), l) in groups.downsample.iter().zip(coarser).zip(1..) {
            let label = format!("subsurface::pyramid downsample to level {l}");
            let mut pass = recorder.draw(&label, &[&level.light, &level.shape], false);
            over_tiles(&mut pass, &passes.downsample, group, scratch, l, false);
        }
        for l in (1..=groups.last).rev() {
            let (group, level) = (&groups.level[l - 1], &scratch.levels[l]);
            let label = format!("subsurface::pyramid blur level {l}");
            let mut pass = recorder.draw(&label, &[scratch.mean(l)], false);
            let [x, y] = level.size.map(|s| s as f32);
            pass.set_viewport(0.0, 0.0, x, y, 0.0, 1.0);
            over_tiles(&mut pass, &passes.level, group, scratch, l, false);
        }
        let keeps = self.output.adds() || groups.viewport.is_some();
        let mut pass = recorder.draw("subsurface::pyramid blur frame", &[output], keeps);
        if let Some(viewport) = groups.viewport {
            viewport.apply(&mut pass);
        }
        if !self.output.is_difference() {
            pass.set_pipeline(&passes.copy);
            pass.set_bind_group(0, &groups.copy, &[]);
            let [x, y] = coarser.first().map_or([0, 0], |level| level.tiles);
            pass.draw(0..4, 0..x * y);
        }
        over_tiles(&mut pass, &passes.frame, &groups.frame, scratch, 0, back.is_some());
    }
}

/// Draws the planar tiles of a level by the first, the others by the second; where there is a back layer within
/// reach by that which knows it.
fn over_tiles(
    pass: &mut wgpu::RenderPass,
    draws: &OverTiles,
    group: &BindGroup,
    scratch: &Scratch,
    l: usize,
    has_back: bool,
) {
    pass.set_bind_group(0, group, &[]);
    for (i, pipeline) in (CLASSES * l as u64..).zip(&draws.pipelines) {
        pass.set_pipeline(pipeline);
        pass.draw_indirect(&scratch.draws, i * DRAW_BYTES);
    }
    if let Some(with_back) = draws.with_back.as_ref().filter(|_| has_back) {
        pass.set_pipeline(with_back);
        pass.draw_indirect(&scratch.draws, (CLASSES * (l as u64 + 1) - 1) * DRAW_BYTES);
    }
}
