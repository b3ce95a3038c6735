//! The pipelines, and what they bind.

use wgpu::{
    BindGroupLayout, BindingType, ColorWrites, ComputePipeline, Device, PrimitiveTopology, RenderPipeline,
    ShaderModule, ShaderStages, TextureFormat,
};

use crate::Output;
use crate::gpu::{self, FILTERED, FLOATS, READ, SAMPLER, UINTS, UNIFORM, WRITE};
use crate::plan::{Kinds, Shape, Weights};

/// Format of light and of means: linear filters may read it.
pub(super) const LIGHT: TextureFormat = TextureFormat::Rgba16Float;
/// Format of what tells where a surface is.
pub(super) const SHAPE: TextureFormat = TextureFormat::Rg32Uint;

/// A file of the pyramid's shaders.
macro_rules! wgsl {
    ($name:literal) => {
        include_str!(concat!("../../shaders/pyramid/", $name, ".wgsl"))
    };
}
const SURFACE: &str = wgsl!("surface");
const BLUR: &str = wgsl!("blur");
const HOST: &str = wgsl!("host");
const TILES: &str = wgsl!("list_tiles");
pub(super) const PACK: &[&str] = &[SURFACE, HOST, wgsl!("pack")];
pub(super) const LIST_TILES: &[&str] = &[SURFACE, TILES];
const DOWNSAMPLE: &[&str] = &[SURFACE, wgsl!("downsample")];
pub(super) const PLANAR: &[&str] = &[SURFACE, BLUR, wgsl!("planar")];
pub(super) const DIRECT: &[&str] = &[SURFACE, BLUR, wgsl!("direct")];
const PACK_BACK: &[&str] = &[SURFACE, HOST, wgsl!("pack"), wgsl!("pack_back")];
const HALVE_BACK: &[&str] = &[SURFACE, wgsl!("downsample"), wgsl!("halve_back")];
const COPY: &[&str] = &[SURFACE, TILES, wgsl!("copy")];
/// Of [`Overlay`](crate::Overlay).
pub(crate) const OVERLAY: &[&str] = &[SURFACE, HOST, TILES, wgsl!("overlay")];

#[derive(Debug)]
pub(super) struct Compute {
    pub layout: BindGroupLayout,
    pub pipeline: ComputePipeline,
}

/// Pipelines over the tiles of a level, by their class.
#[derive(Debug)]
pub(super) struct OverTiles {
    pub layout: BindGroupLayout,
    pub pipelines: Vec<RenderPipeline>,
    /// Of the tiles of the last class that have a back layer within reach; of the frame alone.
    pub with_back: Option<RenderPipeline>,
}

/// All passes.
#[derive(Debug)]
pub(super) struct Passes {
    pub pack: Compute,
    pub list_tiles: Compute,
    pub pack_back: Compute,
    pub halve_back: Compute,
    pub downsample: OverTiles,
    pub level: OverTiles,
    pub frame: OverTiles,
    pub copy_layout: BindGroupLayout,
    pub copy: RenderPipeline,
}

impl Passes {
    pub(super) fn new(device: &Device, plan: &Weights, output: Output) -> Self {
        let flag = |on| f64::from(u8::from(on));
        let one_profile = flag(plan.has_one_profile());
        let compute = |entry: &str, files: &[&str], bindings: &[(u32, BindingType)]| {
            let label = format!("subsurface::pyramid {entry}");
            let module = gpu::module(device, &label, files);
            let layout = gpu::layout(device, &label, ShaderStages::COMPUTE, bindings);
            let constants = [("ONE_PROFILE", one_profile)];
            let pipeline = gpu::compute_pipeline(device, &label, &module, entry, &layout, &constants);
            Compute { layout, pipeline }
        };
        let over_tiles = |entry: &str,
                          classes: &[(&str, &[&str])],
                          bindings: &[(u32, BindingType)],
                          targets: &[TextureFormat],
                          kinds: Option<&Kinds>| {
            let label = format!("subsurface::pyramid {entry}");
            let at = ShaderStages::VERTEX_FRAGMENT;
            let layout = gpu::layout(device, &label, at, bindings);
            let targets: Vec<_> = match entry {
                "fs_frame" => vec![Some(output.target(ColorWrites::ALL))],
                _ => targets.iter().map(|t| Some((*t).into())).collect(),
            };
            let pipeline = |class: u32, (vertex, files): (&str, &[&str]), has_back: bool| {
                let mut constants = vec![("CLASS", class.into())];
                if let Some(kinds) = kinds {
                    constants.extend([
                        ("BLURS", kinds.variances_px2.len() as f64),
                        ("THIRTEEN", flag(kinds.shape == Shape::Thirteen)),
                        ("SQUARE", flag(kinds.square_px2.is_some())),
                        ("FINEST", flag(entry == "fs_frame")),
                        ("DIFFERENCE", flag(output.is_difference())),
                    ]);
                }
                if files == DIRECT {
                    constants.push(("ONE_PROFILE", one_profile));
                    constants.push(("BACK", flag(has_back)));
                }
                let module: ShaderModule = gpu::module(device, &label, files);
                gpu::Draw {
                    label: &label,
                    module: &module,
                    vertex,
                    fragment: entry,
                    layout: &layout,
                    topology: PrimitiveTopology::TriangleStrip,
                    targets: &targets,
                    constants: &constants,
                }
                .pipeline(device)
            };
            let pipelines =
                (0..).zip(classes).map(|(class, files)| pipeline(class, *files, false)).collect();
            let last = (0..).zip(classes).last().filter(|_| entry == "fs_frame");
            let with_back = last.map(|(class, files)| pipeline(class, *files, true));
            OverTiles { layout, pipelines, with_back }
        };
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
            (13, UNIFORM),
            (14, FLOATS),
            (15, UINTS),
            (16, FLOATS),
            (17, UINTS),
        ];
        let frame: Vec<_> =
            level.into_iter().chain([(4, FLOATS), (5, FLOATS), (6, FLOATS), (18, READ)]).collect();
        let copy_label = "subsurface::pyramid fs_copy";
        let copy_layout = gpu::layout(
            device,
            copy_label,
            ShaderStages::VERTEX_FRAGMENT,
            &[(0, UNIFORM), (4, FLOATS), (5, FLOATS), (8, UINTS), (9, UNIFORM), (10, READ)],
        );
        Self {
            pack: compute(
                "pack_tiles",
                PACK,
                &[
                    (0, UNIFORM),
                    (1, UNIFORM),
                    (3, READ),
                    (4, FLOATS),
                    (5, FLOATS),
                    (6, UINTS),
                    (7, gpu::stored(LIGHT)),
                    (8, gpu::stored(SHAPE)),
                    (9, UNIFORM),
                    (10, WRITE),
                ],
            ),
            list_tiles: compute(
                "list_tiles",
                LIST_TILES,
                &[(0, UNIFORM), (9, UNIFORM), (10, READ), (11, WRITE), (12, WRITE), (13, READ)],
            ),
            pack_back: compute(
                "pack_back",
                PACK_BACK,
                &[
                    (0, UNIFORM),
                    (1, UNIFORM),
                    (3, READ),
                    (4, FLOATS),
                    (5, FLOATS),
                    (6, UINTS),
                    (7, gpu::stored(LIGHT)),
                    (8, gpu::stored(SHAPE)),
                    (9, UNIFORM),
                    (10, WRITE),
                    (11, UINTS),
                    (12, WRITE),
                    (13, FLOATS),
                ],
            ),
            halve_back: compute(
                "halve_back",
                HALVE_BACK,
                &[
                    (0, UNIFORM),
                    (1, UNIFORM),
                    (7, FLOATS),
                    (8, UINTS),
                    (9, UNIFORM),
                    (12, READ),
                    (13, gpu::stored(LIGHT)),
                    (14, gpu::stored(SHAPE)),
                ],
            ),
            downsample: over_tiles(
                "fs_downsample",
                &[("vs_tile", DOWNSAMPLE); 2],
                &[(0, UNIFORM), (1, UNIFORM), (2, READ), (7, FILTERED), (8, UINTS), (12, SAMPLER)],
                &[LIGHT, SHAPE],
                None,
            ),
            level: over_tiles(
                "fs_level",
                &[("vs_corner", PLANAR), ("vs_tile", DIRECT)],
                &level,
                &[LIGHT],
                Some(&plan.kernels.coarse),
            ),
            frame: over_tiles(
                "fs_frame",
                &[("vs_corner", PLANAR), ("vs_direct", DIRECT)],
                &frame,
                &[],
                Some(&plan.kernels.fine),
            ),
            copy: gpu::Draw {
                label: copy_label,
                module: &gpu::module(device, copy_label, COPY),
                vertex: "vs_copy",
                fragment: "fs_copy",
                layout: &copy_layout,
                topology: PrimitiveTopology::TriangleStrip,
                targets: &[Some(output.target(ColorWrites::ALL))],
                constants: &[],
            }
            .pipeline(device),
            copy_layout,
        }
    }
}
