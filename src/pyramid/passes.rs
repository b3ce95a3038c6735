//! The pipelines, and what they bind.

use wgpu::{
    BindGroupLayout, BindingType, BufferBindingType, Device, RenderPipeline, ShaderModule,
    ShaderStages, TextureFormat, TextureSampleType,
};

use crate::Output;
use crate::plan::{Kinds, Shape, Weights};

/// Format of light and of means: linear filters may read it.
pub(super) const LIGHT: TextureFormat = TextureFormat::Rgba16Float;
/// Format of what tells where a surface is.
pub(super) const SHAPE: TextureFormat = TextureFormat::Rg32Uint;

/// The WGSL of a pass over tiles.
macro_rules! over_surface {
    ($file:literal) => {
        concat!(
            include_str!("../../shaders/surface.wgsl"),
            include_str!(concat!("../../shaders/", $file))
        )
    };
}
pub(super) const PACK: &str = concat!(
    include_str!("../../shaders/host.wgsl"),
    over_surface!("pack.wgsl")
);
const HALVE: &str = over_surface!("halve.wgsl");
/// The blurs where all is simple, and elsewhere.
pub(super) const BLURS: [&str; 2] = [
    concat!(
        over_surface!("blur.wgsl"),
        include_str!("../../shaders/simple.wgsl")
    ),
    concat!(
        over_surface!("blur.wgsl"),
        include_str!("../../shaders/careful.wgsl")
    ),
];
pub(super) const TILES: &str = include_str!("../../shaders/tiles.wgsl");

/// The shaders, which serve every plan.
pub(super) struct Shaders {
    tiles: ShaderModule,
    pack: ShaderModule,
    halve: ShaderModule,
    blurs: [ShaderModule; 2],
    copy: ShaderModule,
}

impl Shaders {
    pub fn new(device: &Device) -> Self {
        let module = |label: &str, source: &str| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            })
        };
        Self {
            tiles: module("subsurface tiles", TILES),
            pack: module("subsurface pack", PACK),
            halve: module("subsurface halve", HALVE),
            blurs: BLURS.map(|source| module("subsurface blur", source)),
            copy: module("subsurface copy", include_str!("../../shaders/copy.wgsl")),
        }
    }
}

/// Bindings of the blurs; the frame's know of the strength.
const LEVEL: [u32; 9] = [0, 1, 2, 3, 7, 8, 9, 10, 12];
const FRAME: [u32; 10] = [0, 1, 2, 3, 4, 7, 8, 9, 10, 12];

/// All passes; those over tiles for the simple ones and for the others.
pub(super) struct Passes {
    pub mark: Compute,
    pub gather: Compute,
    pub pack: [Draw; 2],
    pub halve: [Draw; 2],
    pub level: [Draw; 2],
    pub frame: [Draw; 2],
    pub copy: Draw,
}

impl Passes {
    pub fn new(device: &Device, shaders: &Shaders, plan: &Weights, output: Output) -> Self {
        let compute = |entry, bindings: &[u32]| {
            let entries: Vec<_> = bindings.iter().map(|b| tiles_entry(*b)).collect();
            Compute::new(device, &shaders.tiles, entry, &entries)
        };
        let both = |draw: &dyn Fn(f64) -> Draw| [draw(0.0), draw(1.0)];
        let blur = |entry, bindings: &[u32], target: wgpu::ColorTargetState, kinds: &Kinds| {
            let flag = |on| f64::from(u8::from(on));
            [(0, "vs_corner"), (1, "vs_tile")].map(|(careful, vertex)| {
                let constants = [
                    ("CAREFUL", careful as f64),
                    ("BLURS", kinds.variances_px2.len() as f64),
                    ("THIRTEEN", flag(kinds.shape == Shape::Thirteen)),
                    ("SQUARE", flag(kinds.square_px2.is_some())),
                    ("FINEST", flag(entry == "fs_frame")),
                    ("DIFFERENCE", flag(output.adds())),
                ];
                Draw::new(
                    device,
                    &shaders.blurs[careful],
                    [vertex, entry],
                    bindings,
                    &[Some(target.clone())],
                    &constants,
                )
            })
        };
        let surface = [Some(LIGHT.into()), Some(SHAPE.into())];
        Self {
            mark: compute("mark", &[0, 1, 2, 3, 4]),
            gather: compute("gather", &[5, 6, 7, 8, 9, 10]),
            pack: both(&|careful| {
                Draw::new(
                    device,
                    &shaders.pack,
                    ["vs_tile", "fs_pack"],
                    &[0, 1, 2, 4, 5, 6, 11, 13, 14],
                    &surface,
                    &[("CAREFUL", careful)],
                )
            }),
            halve: both(&|careful| {
                Draw::new(
                    device,
                    &shaders.halve,
                    ["vs_tile", "fs_halve"],
                    &[0, 1, 2, 7, 8, 12],
                    &surface,
                    &[("CAREFUL", careful)],
                )
            }),
            level: blur("fs_level", &LEVEL, LIGHT.into(), &plan.kernels.coarse),
            frame: blur(
                "fs_frame",
                &FRAME,
                output.target(wgpu::ColorWrites::COLOR),
                &plan.kernels.fine,
            ),
            copy: Draw::new(
                device,
                &shaders.copy,
                ["vs_frame", "fs_copy"],
                &[4],
                &[Some(output.target(wgpu::ColorWrites::ALL))],
                &[],
            ),
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
const FILTERED: TextureSampleType = TextureSampleType::Float { filterable: true };
const READ: BufferBindingType = BufferBindingType::Storage { read_only: true };
const WRITE: BufferBindingType = BufferBindingType::Storage { read_only: false };

/// What the bindings of tiles.wgsl are.
fn tiles_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    let at = ShaderStages::COMPUTE;
    match binding {
        0 | 5 => buffer_entry(binding, at, BufferBindingType::Uniform),
        1 => texture_entry(binding, at, FLOAT),
        2 | 10 => texture_entry(binding, at, TextureSampleType::Uint),
        3 | 6 => buffer_entry(binding, at, READ),
        _ => buffer_entry(binding, at, WRITE),
    }
}

/// What the bindings of the passes that draw are.
fn entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    let at = ShaderStages::FRAGMENT;
    match binding {
        0 | 1 => buffer_entry(
            binding,
            at | ShaderStages::VERTEX,
            BufferBindingType::Uniform,
        ),
        2 => buffer_entry(binding, ShaderStages::VERTEX, READ),
        3 => buffer_entry(binding, at | ShaderStages::VERTEX, READ),
        4 | 5 | 14 => texture_entry(binding, at, FLOAT),
        13 => buffer_entry(binding, at, BufferBindingType::Uniform),
        7 | 9 => texture_entry(binding, at, FILTERED),
        11 => buffer_entry(binding, at, WRITE),
        12 => wgpu::BindGroupLayoutEntry {
            binding,
            visibility: at,
            ty: BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
            count: None,
        },
        8 => texture_entry(binding, at | ShaderStages::VERTEX, TextureSampleType::Uint),
        _ => texture_entry(binding, at, TextureSampleType::Uint),
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

pub(super) struct Compute {
    pub layout: BindGroupLayout,
    pub pipeline: wgpu::ComputePipeline,
}

impl Compute {
    fn new(
        device: &Device,
        module: &ShaderModule,
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

pub(super) struct Draw {
    pub layout: BindGroupLayout,
    pub pipeline: RenderPipeline,
}

impl Draw {
    fn new(
        device: &Device,
        module: &ShaderModule,
        [vertex, fragment]: [&str; 2],
        bindings: &[u32],
        targets: &[Option<wgpu::ColorTargetState>],
        constants: &[(&str, f64)],
    ) -> Self {
        let entries: Vec<_> = bindings.iter().map(|b| entry(*b)).collect();
        let (layout, pipeline_layout) = layout(device, fragment, &entries);
        let options = || wgpu::PipelineCompilationOptions {
            constants,
            ..Default::default()
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(fragment),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(vertex),
                compilation_options: options(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState {
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                ..Default::default()
            },
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(fragment),
                compilation_options: options(),
                targets,
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { layout, pipeline }
    }
}
