//! The pipelines, and what they bind.

use wgpu::{
    BindGroupLayout, BindingType, ColorWrites, ComputePipeline, Device, PrimitiveTopology,
    RenderPipeline, ShaderModule, ShaderStages, TextureFormat,
};

use crate::Output;
use crate::gpu::{self, FILTERED, FLOATS, READ, SAMPLER, UINTS, UNIFORM, WRITE};
use crate::plan::{Kinds, Shape, Weights};

/// Format of light and of means: linear filters may read it.
pub(super) const LIGHT: TextureFormat = TextureFormat::Rgba16Float;
/// Format of what tells where a surface is.
pub(super) const SHAPE: TextureFormat = TextureFormat::Rg32Uint;

const SURFACE: &str = include_str!("../../shaders/surface.wgsl");
pub(super) const TILES: &[&str] = &[include_str!("../../shaders/tiles.wgsl")];
pub(super) const PACK: &[&str] = &[SURFACE, include_str!("../../shaders/pack.wgsl")];
const HALVE: &[&str] = &[SURFACE, include_str!("../../shaders/halve.wgsl")];
const COPY: &[&str] = &[SURFACE, include_str!("../../shaders/copy.wgsl")];
const BLUR: &str = include_str!("../../shaders/blur.wgsl");
/// The blurs where all is simple, and elsewhere.
pub(super) const BLURS: [&[&str]; 2] = [
    &[SURFACE, BLUR, include_str!("../../shaders/simple.wgsl")],
    &[SURFACE, BLUR, include_str!("../../shaders/careful.wgsl")],
];

#[derive(Debug)]
pub(super) struct Compute {
    pub layout: BindGroupLayout,
    pub pipeline: ComputePipeline,
}

/// Pipelines of one layout: for simple tiles, and for the others.
#[derive(Debug)]
pub(super) struct OverTiles {
    pub layout: BindGroupLayout,
    pub pipelines: [RenderPipeline; 2],
}

/// All passes.
#[derive(Debug)]
pub(super) struct Passes {
    pub mark: Compute,
    pub gather: Compute,
    pub pack: OverTiles,
    pub halve: OverTiles,
    pub level: OverTiles,
    pub frame: OverTiles,
    pub copy_layout: BindGroupLayout,
    pub copy: RenderPipeline,
}

/// What the bindings of tiles.wgsl are.
fn tiles_binding(binding: u32) -> (u32, BindingType) {
    let ty = match binding {
        0 | 5 => UNIFORM,
        1 => FLOATS,
        2 | 10 => UINTS,
        3 | 6 => READ,
        _ => WRITE,
    };
    (binding, ty)
}

impl Passes {
    pub fn new(device: &Device, plan: &Weights, output: Output) -> Self {
        let tiles = gpu::module(device, "subsurface::pyramid tiles", TILES);
        let compute = |entry: &str, bindings: &[u32]| {
            let label = format!("subsurface::pyramid {entry}");
            let bindings: Vec<_> = bindings.iter().map(|b| tiles_binding(*b)).collect();
            let layout = gpu::layout(device, &label, ShaderStages::COMPUTE, &bindings);
            let pipeline = gpu::compute_pipeline(device, &label, &tiles, entry, &layout);
            Compute { layout, pipeline }
        };
        let over_tiles = |entry: &str,
                          vertex: [&str; 2],
                          files: [&[&str]; 2],
                          bindings: &[(u32, BindingType)],
                          targets: &[TextureFormat],
                          kinds: Option<&Kinds>| {
            let label = format!("subsurface::pyramid {entry}");
            let at = ShaderStages::VERTEX_FRAGMENT;
            let layout = gpu::layout(device, &label, at, bindings);
            let targets: Vec<_> = match entry {
                "fs_frame" => vec![Some(output.target(ColorWrites::COLOR))],
                _ => targets.iter().map(|t| Some((*t).into())).collect(),
            };
            let flag = |on| f64::from(u8::from(on));
            let pipelines = [0, 1].map(|careful| {
                let mut constants = vec![("CAREFUL", careful as f64)];
                if let Some(kinds) = kinds {
                    constants.extend([
                        ("BLURS", kinds.variances_px2.len() as f64),
                        ("THIRTEEN", flag(kinds.shape == Shape::Thirteen)),
                        ("SQUARE", flag(kinds.square_px2.is_some())),
                        ("FINEST", flag(entry == "fs_frame")),
                        ("DIFFERENCE", flag(output.adds())),
                    ]);
                }
                let module: ShaderModule = gpu::module(device, &label, files[careful]);
                gpu::Draw {
                    label: &label,
                    module: &module,
                    vertex: vertex[careful],
                    fragment: entry,
                    layout: &layout,
                    topology: PrimitiveTopology::TriangleStrip,
                    targets: &targets,
                    constants: &constants,
                }
                .pipeline(device)
            });
            OverTiles { layout, pipelines }
        };
        let surface = [LIGHT, SHAPE];
        let level = [
            (0, UNIFORM),
            (1, UNIFORM),
            (2, READ),
            (3, READ),
            (7, FILTERED),
            (8, UINTS),
            (9, FILTERED),
            (10, UINTS),
            (12, SAMPLER),
        ];
        let frame: Vec<_> = level
            .into_iter()
            .chain([(4, FLOATS), (5, FLOATS)])
            .collect();
        let copy_label = "subsurface::pyramid fs_copy";
        let copy_layout = gpu::layout(
            device,
            copy_label,
            ShaderStages::FRAGMENT,
            &[(0, UNIFORM), (4, FLOATS), (5, FLOATS)],
        );
        Self {
            mark: compute("mark", &[0, 1, 2, 3, 4]),
            gather: compute("gather", &[5, 6, 7, 8, 9, 10]),
            pack: over_tiles(
                "fs_pack",
                ["vs_tile"; 2],
                [PACK; 2],
                &[
                    (0, UNIFORM),
                    (1, UNIFORM),
                    (2, READ),
                    (4, FLOATS),
                    (5, FLOATS),
                    (6, UINTS),
                    (11, WRITE),
                ],
                &surface,
                None,
            ),
            halve: over_tiles(
                "fs_halve",
                ["vs_tile"; 2],
                [HALVE; 2],
                &[
                    (0, UNIFORM),
                    (1, UNIFORM),
                    (2, READ),
                    (7, FILTERED),
                    (8, UINTS),
                    (12, SAMPLER),
                ],
                &surface,
                None,
            ),
            level: over_tiles(
                "fs_level",
                ["vs_corner", "vs_tile"],
                BLURS,
                &level,
                &[LIGHT],
                Some(&plan.kernels.coarse),
            ),
            frame: over_tiles(
                "fs_frame",
                ["vs_corner", "vs_tile"],
                BLURS,
                &frame,
                &[],
                Some(&plan.kernels.fine),
            ),
            copy: gpu::Draw {
                label: copy_label,
                module: &gpu::module(device, copy_label, COPY),
                vertex: "vs_frame",
                fragment: "fs_copy",
                layout: &copy_layout,
                topology: PrimitiveTopology::TriangleList,
                targets: &[Some(output.target(ColorWrites::ALL))],
                constants: &[],
            }
            .pipeline(device),
            copy_layout,
        }
    }
}
