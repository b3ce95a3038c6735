//! Scattering by a plan, over a pyramid of the frame. Driver of `shaders/tiles.wgsl` and
//! `shaders/pyramid.wgsl`.

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, Vec2, Vec4};
use wgpu::{
    BindGroup, BindGroupLayout, BindingType, Buffer, BufferBindingType, BufferUsages,
    CommandEncoder, Device, Queue, RenderPipeline, ShaderStages, TextureFormat, TextureSampleType,
    TextureView,
};

use crate::gaussian_sum::scratch_view;
use crate::plan::{Plan, own_blur};

/// Side of a tile, in pixels of its level.
const TILE: u32 = 16;

const PACKED: TextureFormat = TextureFormat::Rgba32Uint;
const SUM: TextureFormat = TextureFormat::Rg32Uint;

/// `View` of both shaders.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct View {
    origin: Vec4,
    step: Vec4,
    depth_to_mm: Vec4,
    first_octave: f32,
    rows: u32,
    stride: u32,
    profiles: u32,
}

/// `Blur` of pyramid.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Blur {
    variance: f32,
    own: f32,
    widen: f32,
    reach: f32,
    slot: [u32; 4],
}

/// `Level` of pyramid.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Level {
    blurs: [Blur; 4],
    size: Vec2,
    scale: f32,
    rest: u32,
    coarser: u32,
    pad: [u32; 3],
}

/// `Level` of tiles.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Gathering {
    tiles: UVec2,
    below: UVec2,
    level: u32,
    pad: u32,
}

/// Where a frame's pixels are, in mm.
pub(crate) struct Optics {
    /// x and y over z of the surface at the corner of the frame, then the part that is not over z.
    pub origin: Vec4,
    /// The same for a step of one pixel.
    pub step: Vec4,
    /// z = (x·depth + y)/(z·depth + w).
    pub depth_to_mm: Vec4,
}

/// What a frame hands over, already checked.
pub(crate) struct Inputs<'a> {
    pub irradiance: &'a TextureView,
    pub depth: &'a TextureView,
    pub profile_id: &'a TextureView,
    pub output: &'a TextureView,
    pub optics: Optics,
    pub plan: &'a Plan,
}

/// The passes, and what they need for the frame that was last prepared.
pub(crate) struct Pyramid {
    output_format: TextureFormat,
    tiles_shader: wgpu::ShaderModule,
    shader: wgpu::ShaderModule,
    planned: Option<Planned>,
    scratch: Option<Scratch>,
    frame: Option<Frame>,
}

/// What follows from the plan.
struct Planned {
    plan: Plan,
    weights: Buffer,
    mark: Compute,
    gather: Compute,
    pack: Draw,
    halve: Draw,
    level: Draw,
    frame: Draw,
    copy: Draw,
}

/// What follows from the size of the frame, too.
struct Scratch {
    size: [u32; 2],
    view: Buffer,
    tops: Buffer,
    levels: Vec<LevelScratch>,
}

struct LevelScratch {
    tiles: [u32; 2],
    gathering: Buffer,
    settings: Buffer,
    packed: TextureView,
    /// Of all but the frame itself, which is summed into the output.
    sum: Option<TextureView>,
    tops: Buffer,
    list: Buffer,
    draw: Buffer,
}

/// The groups of one frame.
struct Frame {
    inputs: [TextureView; 4],
    mark: BindGroup,
    gather: Vec<BindGroup>,
    pack: BindGroup,
    halve: Vec<BindGroup>,
    levels: Vec<BindGroup>,
    frame: BindGroup,
    copy: BindGroup,
}

struct Compute {
    layout: BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

struct Draw {
    layout: BindGroupLayout,
    pipeline: RenderPipeline,
}

impl Pyramid {
    pub fn new(device: &Device, output_format: TextureFormat) -> Self {
        Self {
            output_format,
            tiles_shader: device.create_shader_module(wgpu::include_wgsl!("../shaders/tiles.wgsl")),
            shader: device.create_shader_module(wgpu::include_wgsl!("../shaders/pyramid.wgsl")),
            planned: None,
            scratch: None,
            frame: None,
        }
    }

    /// Uploads what the frame needs; makes anew what a new plan, size or texture asks for.
    pub fn prepare(&mut self, device: &Device, queue: &Queue, inputs: &Inputs) {
        let size = crate::input::size(inputs.irradiance);
        if self.planned.as_ref().is_none_or(|p| p.plan != *inputs.plan) {
            self.scratch = None;
            self.frame = None;
            self.planned = Some(self.plan(device, inputs.plan));
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
            origin: optics.origin,
            step: optics.step,
            depth_to_mm: optics.depth_to_mm,
            first_octave: plan.first_octave(),
            rows: plan.row_count() as u32,
            stride: plan.stride() as u32,
            profiles: plan.profile_count() as u32,
        };
        queue.write_buffer(&scratch.view, 0, bytemuck::bytes_of(&view));
        let views = [
            inputs.irradiance,
            inputs.depth,
            inputs.profile_id,
            inputs.output,
        ];
        let same = |f: &Frame| f.inputs.iter().zip(views).all(|(a, b)| a == b);
        if !self.frame.as_ref().is_some_and(same) {
            self.frame = Some(Frame::new(device, planned, scratch, views));
        }
    }

    pub fn render(&self, encoder: &mut CommandEncoder) {
        let (Some(planned), Some(scratch), Some(frame)) =
            (&self.planned, &self.scratch, &self.frame)
        else {
            return;
        };
        for level in &scratch.levels {
            encoder.clear_buffer(&level.draw, 4, Some(4));
        }
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("subsurface tiles"),
                timestamp_writes: None,
            });
            let [x, y] = scratch.levels[0].tiles;
            pass.set_pipeline(&planned.mark.pipeline);
            pass.set_bind_group(0, &frame.mark, &[]);
            pass.dispatch_workgroups(x, y, 1);
            pass.set_pipeline(&planned.gather.pipeline);
            for (group, level) in frame.gather.iter().zip(&scratch.levels) {
                pass.set_bind_group(0, group, &[]);
                pass.dispatch_workgroups(level.tiles[0].div_ceil(8), level.tiles[1].div_ceil(8), 1);
            }
        }
        let over_tiles = |encoder: &mut CommandEncoder,
                          label: &str,
                          draw: &Draw,
                          group,
                          to,
                          level: &LevelScratch,
                          load| {
            let mut pass = begin(encoder, label, to, load);
            pass.set_pipeline(&draw.pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.draw_indirect(&level.draw, 0);
        };
        // What lies outside of the tiles is never read.
        let clear = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
        let base = &scratch.levels[0];
        over_tiles(
            encoder,
            "subsurface pack",
            &planned.pack,
            &frame.pack,
            &base.packed,
            base,
            clear,
        );
        for (group, level) in frame.halve.iter().zip(&scratch.levels[1..]) {
            over_tiles(
                encoder,
                "subsurface halve",
                &planned.halve,
                group,
                &level.packed,
                level,
                clear,
            );
        }
        for (group, level) in frame.levels.iter().zip(&scratch.levels[1..]).rev() {
            if let Some(sum) = &level.sum {
                over_tiles(
                    encoder,
                    "subsurface level",
                    &planned.level,
                    group,
                    sum,
                    level,
                    clear,
                );
            }
        }
        let output = &frame.inputs[3];
        {
            let mut pass = begin(encoder, "subsurface copy", output, clear);
            pass.set_pipeline(&planned.copy.pipeline);
            pass.set_bind_group(0, &frame.copy, &[]);
            pass.draw(0..3, 0..1);
        }
        over_tiles(
            encoder,
            "subsurface frame",
            &planned.frame,
            &frame.frame,
            output,
            base,
            wgpu::LoadOp::Load,
        );
    }

    fn plan(&self, device: &Device, plan: &Plan) -> Planned {
        let [mark, gather] = [("mark", &[0, 1, 2, 3, 4][..]), ("gather", &[5, 6, 7, 8, 9])].map(
            |(entry, bindings)| {
                let entries: Vec<_> = bindings.iter().map(|b| tiles_entry(*b)).collect();
                Compute::new(device, &self.tiles_shader, entry, &entries)
            },
        );
        let fine = &plan.kernels.fine;
        let coarse = &plan.kernels.coarse;
        let constants = |taps: &crate::plan::Taps| {
            [
                ("BLURS", taps.blurs.len() as f64),
                ("DIAMOND", f64::from(u8::from(taps.diamond))),
            ]
        };
        let draw = |vertex, entry, bindings: &[u32], format, constants: &[(&str, f64)]| {
            Draw::new(
                device,
                &self.shader,
                [vertex, entry],
                bindings,
                format,
                constants,
            )
        };
        Planned {
            weights: storage(
                device,
                "subsurface weights",
                bytemuck::cast_slice(&plan.table()),
            ),
            mark,
            gather,
            pack: draw("vs_tile", "fs_pack", &[0, 1, 2, 4, 5, 6], PACKED, &[]),
            halve: draw("vs_tile", "fs_halve", &[0, 1, 2, 8], PACKED, &[]),
            level: draw(
                "vs_tile",
                "fs_level",
                &[0, 1, 2, 3, 7, 9, 10],
                SUM,
                &constants(coarse),
            ),
            frame: draw(
                "vs_tile",
                "fs_frame",
                &[0, 1, 2, 3, 4, 7, 9, 10],
                self.output_format,
                &constants(fine),
            ),
            copy: draw("vs_frame", "fs_copy", &[4], self.output_format, &[]),
            plan: plan.clone(),
        }
    }
}

fn begin<'a>(
    encoder: &'a mut CommandEncoder,
    label: &str,
    to: &TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
) -> wgpu::RenderPass<'a> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: to,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load,
                store: wgpu::StoreOp::Store,
            },
        })],
        ..Default::default()
    })
}

impl Scratch {
    fn new(device: &Device, queue: &Queue, size: [u32; 2], plan: &Plan) -> Self {
        let uniform = |label: &str, size: usize| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size as u64,
                usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let buffer = |label: &str, words: u32, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: 4 * u64::from(words),
                usage,
                mapped_at_creation: false,
            })
        };
        // A level of one pixel has nothing above it.
        let largest = size[0].max(size[1]);
        let levels = plan
            .levels
            .min(largest.next_power_of_two().ilog2() as usize);
        let mut below = size.map(|s| s.div_ceil(TILE));
        let tiles_of_frame = below[0] * below[1];
        let levels: Vec<_> = (0..=levels)
            .map(|l| {
                let size = size.map(|s| s.div_ceil(1 << l));
                let tiles = size.map(|s| s.div_ceil(TILE));
                let count = tiles[0] * tiles[1];
                let level = LevelScratch {
                    tiles,
                    gathering: uniform("subsurface tiles of a level", size_of::<Gathering>()),
                    settings: uniform("subsurface level", size_of::<Level>()),
                    packed: scratch_view(device, "subsurface surface", size, PACKED),
                    sum: (l > 0).then(|| scratch_view(device, "subsurface sum", size, SUM)),
                    tops: buffer("subsurface tops", count, BufferUsages::STORAGE),
                    list: buffer("subsurface tiles", count, BufferUsages::STORAGE),
                    draw: buffer(
                        "subsurface draw",
                        4,
                        BufferUsages::STORAGE
                            | BufferUsages::INDIRECT
                            | BufferUsages::COPY_DST
                            | BufferUsages::COPY_SRC,
                    ),
                };
                queue.write_buffer(&level.draw, 0, bytemuck::bytes_of(&[6u32, 0, 0, 0]));
                let gathering = Gathering {
                    tiles: tiles.into(),
                    below: below.into(),
                    level: l as u32,
                    pad: 0,
                };
                queue.write_buffer(&level.gathering, 0, bytemuck::bytes_of(&gathering));
                let settings = level_settings(plan, l, levels, size);
                queue.write_buffer(&level.settings, 0, bytemuck::bytes_of(&settings));
                below = tiles;
                level
            })
            .collect();
        Self {
            size,
            view: uniform("subsurface view", size_of::<View>()),
            tops: buffer("subsurface tops", tiles_of_frame, BufferUsages::STORAGE),
            levels,
        }
    }
}

fn level_settings(plan: &Plan, l: usize, levels: usize, size: [u32; 2]) -> Level {
    let taps = if l == 0 {
        &plan.kernels.fine
    } else {
        &plan.kernels.coarse
    };
    let mut blurs = [Blur::zeroed(); 4];
    for (j, (blur, (variance, reach))) in blurs.iter_mut().zip(taps.blurs).enumerate() {
        let own = own_blur(l);
        let remains = variance - own;
        *blur = Blur {
            variance: *variance as f32,
            own: own as f32,
            widen: (taps.exponent(j, remains) / remains) as f32,
            reach: *reach as f32,
            slot: [plan.slot(l, j) as u32, 0, 0, 0],
        };
    }
    Level {
        blurs,
        size: Vec2::new(size[0] as f32, size[1] as f32),
        scale: (1 << l) as f32,
        rest: plan.rest_slot(l) as u32,
        coarser: u32::from(l < levels),
        pad: [0; 3],
    }
}

fn storage(device: &Device, label: &str, contents: &[u8]) -> Buffer {
    use wgpu::util::DeviceExt;
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(label),
        contents,
        usage: BufferUsages::STORAGE,
    })
}

impl Frame {
    fn new(
        device: &Device,
        planned: &Planned,
        scratch: &Scratch,
        views: [&TextureView; 4],
    ) -> Self {
        let [irradiance, depth, profile_id, _] = views;
        use wgpu::BindingResource::TextureView as Texture;
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
        let coarser = |l: usize| {
            // The last level has none; it does not look.
            let next = levels.get(l + 1).unwrap_or(&levels[l]);
            let sum = levels.get(l + 1).and_then(|n| n.sum.as_ref());
            (&next.packed, sum)
        };
        let none = scratch_view(device, "subsurface nothing", [1, 1], SUM);
        let level_entries = |l: usize| {
            let level = &levels[l];
            let (packed, sum) = coarser(l);
            vec![
                (0, scratch.view.as_entire_binding()),
                (1, level.settings.as_entire_binding()),
                (2, level.list.as_entire_binding()),
                (3, planned.weights.as_entire_binding()),
                (7, Texture(&level.packed)),
                (9, Texture(packed)),
                (10, Texture(sum.unwrap_or(&none))),
            ]
        };
        let gather = (0..levels.len()).map(|l| {
            let below = if l == 0 {
                &scratch.tops
            } else {
                &levels[l - 1].tops
            };
            group(
                &planned.gather.layout,
                &[
                    (5, levels[l].gathering.as_entire_binding()),
                    (6, below.as_entire_binding()),
                    (7, levels[l].tops.as_entire_binding()),
                    (8, levels[l].draw.as_entire_binding()),
                    (9, levels[l].list.as_entire_binding()),
                ],
            )
        });
        let halve = (1..levels.len()).map(|l| {
            group(
                &planned.halve.layout,
                &[
                    (0, scratch.view.as_entire_binding()),
                    (1, levels[l].settings.as_entire_binding()),
                    (2, levels[l].list.as_entire_binding()),
                    (8, Texture(&levels[l - 1].packed)),
                ],
            )
        });
        let mut frame = level_entries(0);
        frame.push((4, Texture(irradiance)));
        Self {
            inputs: views.map(Clone::clone),
            mark: group(
                &planned.mark.layout,
                &[
                    (0, scratch.view.as_entire_binding()),
                    (1, Texture(depth)),
                    (2, Texture(profile_id)),
                    (3, planned.weights.as_entire_binding()),
                    (4, scratch.tops.as_entire_binding()),
                ],
            ),
            gather: gather.collect(),
            pack: group(
                &planned.pack.layout,
                &[
                    (0, scratch.view.as_entire_binding()),
                    (1, base.settings.as_entire_binding()),
                    (2, base.list.as_entire_binding()),
                    (4, Texture(irradiance)),
                    (5, Texture(depth)),
                    (6, Texture(profile_id)),
                ],
            ),
            halve: halve.collect(),
            levels: (1..levels.len())
                .map(|l| group(&planned.level.layout, &level_entries(l)))
                .collect(),
            frame: group(&planned.frame.layout, &frame),
            copy: group(&planned.copy.layout, &[(4, Texture(irradiance))]),
        }
    }
}

fn buffer_entry(
    binding: u32,
    visibility: ShaderStages,
    ty: BufferBindingType,
) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: BindingType::Buffer {
            ty,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
}

fn texture_entry(
    binding: u32,
    visibility: ShaderStages,
    sample_type: TextureSampleType,
) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    }
}

const FLOAT: TextureSampleType = TextureSampleType::Float { filterable: false };
const READ: BufferBindingType = BufferBindingType::Storage { read_only: true };
const WRITE: BufferBindingType = BufferBindingType::Storage { read_only: false };

/// What the bindings of tiles.wgsl are.
fn tiles_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    let at = ShaderStages::COMPUTE;
    match binding {
        0 | 5 => buffer_entry(binding, at, BufferBindingType::Uniform),
        1 => texture_entry(binding, at, FLOAT),
        2 => texture_entry(binding, at, TextureSampleType::Uint),
        3 | 6 => buffer_entry(binding, at, READ),
        _ => buffer_entry(binding, at, WRITE),
    }
}

/// What the bindings of pyramid.wgsl are.
fn entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    let at = ShaderStages::VERTEX_FRAGMENT;
    match binding {
        0 | 1 => buffer_entry(binding, at, BufferBindingType::Uniform),
        2 => buffer_entry(binding, ShaderStages::VERTEX, READ),
        3 => buffer_entry(binding, ShaderStages::FRAGMENT, READ),
        4 | 5 => texture_entry(binding, ShaderStages::FRAGMENT, FLOAT),
        _ => texture_entry(binding, ShaderStages::FRAGMENT, TextureSampleType::Uint),
    }
}

fn layout(
    device: &Device,
    label: &str,
    entries: &[wgpu::BindGroupLayoutEntry],
) -> (BindGroupLayout, wgpu::PipelineLayout) {
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries,
    });
    let pipeline = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    (layout, pipeline)
}

impl Compute {
    fn new(
        device: &Device,
        module: &wgpu::ShaderModule,
        entry_point: &str,
        entries: &[wgpu::BindGroupLayoutEntry],
    ) -> Self {
        let (layout, pipeline_layout) = layout(device, entry_point, entries);
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry_point),
            layout: Some(&pipeline_layout),
            module,
            entry_point: Some(entry_point),
            compilation_options: Default::default(),
            cache: None,
        });
        Self { layout, pipeline }
    }
}

impl Draw {
    fn new(
        device: &Device,
        module: &wgpu::ShaderModule,
        [vertex, fragment]: [&str; 2],
        bindings: &[u32],
        format: TextureFormat,
        constants: &[(&str, f64)],
    ) -> Self {
        let entries: Vec<_> = bindings.iter().map(|b| entry(*b)).collect();
        let (layout, pipeline_layout) = layout(device, fragment, &entries);
        let options = wgpu::PipelineCompilationOptions {
            constants,
            ..Default::default()
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(fragment),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(vertex),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(fragment),
                compilation_options: options,
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { layout, pipeline }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wgsl::assert_layout;

    const PYRAMID: &str = include_str!("../shaders/pyramid.wgsl");
    const TILES: &str = include_str!("../shaders/tiles.wgsl");

    #[test]
    fn constants_are_those_of_the_shaders() {
        for shader in [PYRAMID, TILES] {
            assert!(shader.contains(&format!("const TILE = {TILE}u;")));
            let rows = crate::plan::ROWS_PER_OCTAVE;
            assert!(shader.contains(&format!("const ROWS_PER_OCTAVE = {rows:.1};")));
        }
    }

    #[test]
    fn structs_lie_as_the_shaders_have_them() {
        assert_layout!(
            PYRAMID,
            "View",
            View {
                origin,
                step,
                depth_to_mm,
                first_octave,
                rows,
                stride,
                profiles
            }
        );
        assert_layout!(
            PYRAMID,
            "Blur",
            Blur {
                variance,
                own,
                widen,
                reach,
                slot
            }
        );
        assert_layout!(
            PYRAMID,
            "Level",
            Level {
                blurs,
                size,
                scale,
                rest,
                coarser
            }
        );
        assert_eq!(
            crate::wgsl::layout(TILES, "View"),
            crate::wgsl::layout(PYRAMID, "View")
        );
        assert_layout!(
            TILES,
            "Level",
            Gathering {
                tiles,
                below,
                level
            }
        );
    }
}
