//! The sum of Gaussians over a surface that is given by a position per pixel: what the exact effect and
//! texture space share, and over a second one behind it. Drives `shaders/exact/gaussian_sum.wgsl` and
//! `back_layer.wgsl`.

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, Vec4};
use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, ColorTargetState, ColorWrites, Device,
    PrimitiveTopology, Queue, RenderPipeline, ShaderStages, TextureFormat, TextureView,
};

use crate::frame::Viewport;
use crate::gpu::{self, Recorder};
use crate::{MAX_PROFILES, Output, Profile};

/// Per pixel: E·A and A, Σ over a row, and the running sum. Full floats: twelve roundings to half
/// floats would lose energy.
pub(crate) const SCRATCH: TextureFormat = TextureFormat::Rgba32Float;

pub(crate) const SHADER: &str = include_str!("../../shaders/exact/gaussian_sum.wgsl");
const BACK_LAYER: &str = include_str!("../../shaders/exact/back_layer.wgsl");

/// Side of the blocks that tell where a back layer is.
const BLOCK: u32 = 8;

/// Columns and rows of blocks of a surface of this size.
pub(super) fn blocks(size: [u32; 2]) -> [u32; 2] {
    size.map(|s| s.div_ceil(BLOCK))
}

/// Bindings of the shaders.
const SETTINGS: u32 = 0;
const POSITIONS: u32 = 1;
const IRRADIANCE: u32 = 2;
const SOURCE: u32 = 3;
const ROWS: u32 = 4;
const SUM: u32 = 5;
const STRENGTH: u32 = 6;
const ALBEDO: u32 = 7;
const BACK_POSITIONS: u32 = 8;
const BACK_SOURCE: u32 = 9;
const BLOCKS: u32 = 10;

/// `Settings` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct Settings {
    pub gaussians: [Vec4; MAX_PROFILES * Profile::MAX_GAUSSIANS],
    /// See the shader; zero where the surface itself tells.
    pub spacing: Vec4,
    pub mm_per_unit: f32,
    /// In pixels.
    pub gutter: i32,
    pub profiles: u32,
    pub has_strength: u32,
    pub has_albedo: u32,
    pub pad: u32,
    /// Of the irradiance, the output and the strength.
    pub first_pixel: UVec2,
}

impl Settings {
    pub(crate) fn new(profiles: &[Profile], mm_per_unit: f32) -> Self {
        let mut settings = Self { mm_per_unit, profiles: profiles.len() as u32, ..Self::zeroed() };
        let slots = settings.gaussians.chunks_exact_mut(Profile::MAX_GAUSSIANS);
        for (slots, profile) in slots.zip(profiles) {
            for (slot, g) in slots.iter_mut().zip(profile.gaussians()) {
                let [r, gr, b] = g.weight;
                *slot = Vec4::new(r, gr, b, g.variance_mm2);
            }
        }
        settings
    }
}

/// The passes, for any number of surfaces.
#[derive(Debug)]
pub(crate) struct GaussianSum {
    label: &'static str,
    output: Output,
    source: Pass,
    rows: Pass,
    sum: Pass,
    resolve: Pass,
    /// `None` where no surface has a layer behind it.
    layers: Option<Layers>,
}

/// The passes of a back layer, besides that of its source.
#[derive(Debug)]
struct Layers {
    blocks: Pass,
    sum: Pass,
}

#[derive(Debug)]
struct Pass {
    /// Bindings of the textures that it reads.
    textures: Vec<u32>,
    layout: BindGroupLayout,
    pipeline: RenderPipeline,
}

/// What one surface needs, and the groups of its last frame.
#[derive(Debug)]
pub(crate) struct Sums {
    size: [u32; 2],
    settings: Buffer,
    source: TextureView,
    rows: TextureView,
    sums: [TextureView; 2],
    back: Option<BackScratch>,
    groups: Option<Groups>,
}

/// What a back layer takes on top.
#[derive(Debug)]
struct BackScratch {
    source: TextureView,
    blocks: TextureView,
}

#[derive(Debug)]
struct Groups {
    read: Textures,
    source: BindGroup,
    rows: BindGroup,
    /// Of a back layer, the groups of its source and of its blocks.
    back: Option<[BindGroup; 2]>,
    /// Reads the one sum, writes the other.
    sums: [BindGroup; 2],
    /// Of either sum.
    resolve: [BindGroup; 2],
    gaussians: u32,
    viewport: Option<Viewport>,
}

/// One frame, already checked.
pub(crate) struct Inputs {
    pub(crate) textures: Textures,
    pub(crate) settings: Settings,
    /// The most that a profile has.
    pub(crate) gaussians: u32,
    pub(crate) viewport: Option<Viewport>,
}

impl Inputs {
    pub(crate) fn new(
        profiles: &[Profile],
        textures: Textures,
        settings: Settings,
        viewport: Option<Viewport>,
    ) -> Self {
        let counts = profiles.iter().map(|p| p.gaussians().len() as u32);
        Self { textures, settings, gaussians: counts.max().unwrap_or(0), viewport }
    }
}

/// The textures of one frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Textures {
    pub positions: TextureView,
    pub irradiance: TextureView,
    /// The irradiance where there is none; it is not looked at then.
    pub strength: TextureView,
    pub albedo: TextureView,
    /// Positions and irradiance of the surface behind.
    pub back: Option<[TextureView; 2]>,
}

impl GaussianSum {
    /// `has_layers`: whether frames may have a back layer.
    pub(crate) fn new(device: &Device, output: Output, label: &'static str, has_layers: bool) -> Self {
        let module = gpu::module(device, label, &[SHADER, BACK_LAYER]);
        let pass = |fragment: &str, textures: &[u32], target: ColorTargetState| {
            let label = format!("{label} {fragment}");
            let mut bindings = vec![(SETTINGS, gpu::UNIFORM)];
            bindings.extend(textures.iter().map(|b| (*b, gpu::FLOATS)));
            let layout = gpu::layout(device, &label, ShaderStages::FRAGMENT, &bindings);
            let pipeline = gpu::Draw {
                label: &label,
                module: &module,
                vertex: "vs_main",
                fragment,
                layout: &layout,
                topology: PrimitiveTopology::TriangleList,
                targets: &[Some(target)],
                constants: &[],
            }
            .pipeline(device);
            Pass { textures: textures.to_vec(), layout, pipeline }
        };
        let resolve = match output {
            Output::Scattered(_) => "fs_resolve",
            Output::AddScattered(_) => "fs_add",
            Output::AddDifference(_) => "fs_difference",
        };
        let sums = [POSITIONS, IRRADIANCE, SOURCE, ROWS, SUM];
        let layers = || Layers {
            blocks: pass("fs_blocks", &[POSITIONS], SCRATCH.into()),
            sum: pass(
                "fs_sum_layers",
                &[&sums[..], &[BACK_POSITIONS, BACK_SOURCE, BLOCKS]].concat(),
                SCRATCH.into(),
            ),
        };
        Self {
            label,
            output,
            source: pass("fs_source", &[POSITIONS, IRRADIANCE], SCRATCH.into()),
            rows: pass("fs_rows", &[POSITIONS, SOURCE], SCRATCH.into()),
            sum: pass("fs_sum", &sums, SCRATCH.into()),
            resolve: pass(
                resolve,
                &[POSITIONS, IRRADIANCE, SUM, STRENGTH, ALBEDO],
                output.target(ColorWrites::ALL),
            ),
            layers: has_layers.then(layers),
        }
    }

    /// Scratch for a surface of this size.
    pub(crate) fn sums(&self, device: &Device, size: [u32; 2]) -> Sums {
        let label = self.label;
        let view = |name: &str| gpu::scratch_texture(device, &format!("{label} {name}"), size, SCRATCH);
        Sums {
            size,
            settings: gpu::uniform_buffer::<Settings>(device, &format!("{label} settings")),
            source: view("source"),
            rows: view("rows"),
            sums: [view("sum 0"), view("sum 1")],
            back: None,
            groups: None,
        }
    }

    fn back_scratch(&self, device: &Device, size: [u32; 2]) -> BackScratch {
        let view = |name: &str, size| {
            gpu::scratch_texture(device, &format!("{} {name}", self.label), size, SCRATCH)
        };
        BackScratch {
            source: view("source of the back", size),
            blocks: view("blocks of the back", blocks(size)),
        }
    }

    /// Uploads the numbers of a frame, and binds its textures where they are others than before.
    pub(crate) fn prepare(&self, device: &Device, queue: &Queue, sums: &mut Sums, inputs: Inputs) {
        queue.write_buffer(&sums.settings, 0, bytemuck::bytes_of(&inputs.settings));
        match &mut sums.groups {
            Some(groups) if groups.read == inputs.textures => {
                groups.gaussians = inputs.gaussians;
                groups.viewport = inputs.viewport;
            }
            _ => {
                sums.back = match (sums.back.take(), &inputs.textures.back) {
                    (made, Some(_)) => made.or_else(|| Some(self.back_scratch(device, sums.size))),
                    (_, None) => None,
                };
                sums.groups = Some(self.bind(device, sums, inputs));
            }
        }
    }

    fn bind(&self, device: &Device, sums: &Sums, inputs: Inputs) -> Groups {
        let read = inputs.textures;
        let back = read.back.as_ref().zip(sums.back.as_ref());
        let group_over = |pass: &Pass, positions, irradiance, sum: usize| {
            let texture = |binding: &u32| {
                let view = match (*binding, back) {
                    (IRRADIANCE, _) => irradiance,
                    (SOURCE, _) => &sums.source,
                    (ROWS, _) => &sums.rows,
                    (SUM, _) => &sums.sums[sum],
                    (STRENGTH, _) => &read.strength,
                    (ALBEDO, _) => &read.albedo,
                    (BACK_POSITIONS, Some(([positions, _], _))) => positions,
                    (BACK_SOURCE, Some((_, back))) => &back.source,
                    (BLOCKS, Some((_, back))) => &back.blocks,
                    _ => positions,
                };
                (*binding, BindingResource::TextureView(view))
            };
            let mut resources = vec![(SETTINGS, sums.settings.as_entire_binding())];
            resources.extend(pass.textures.iter().map(texture));
            gpu::group(device, self.label, &pass.layout, &resources)
        };
        let group = |pass, sum| group_over(pass, &read.positions, &read.irradiance, sum);
        let layers = self.layers.as_ref().zip(read.back.as_ref());
        let sum = layers.map_or(&self.sum, |(layers, _)| &layers.sum);
        Groups {
            source: group(&self.source, 0),
            rows: group(&self.rows, 0),
            back: layers.map(|(layers, [positions, irradiance])| {
                [&self.source, &layers.blocks].map(|pass| group_over(pass, positions, irradiance, 0))
            }),
            sums: [group(sum, 0), group(sum, 1)],
            resolve: [group(&self.resolve, 0), group(&self.resolve, 1)],
            read,
            gaussians: inputs.gaussians,
            viewport: inputs.viewport,
        }
    }

    /// Records the frame that was last prepared; nothing before the first.
    pub(crate) fn render(&self, recorder: &mut Recorder, sums: &Sums, output: &TextureView) {
        let Some(groups) = &sums.groups else { return };
        let mut draw = |name: &str, pass: &Pass, group, to, instance: u32| {
            let label = format!("{} {name}", self.label);
            // Every pixel is written.
            let mut recording = recorder.draw(&label, &[to], false);
            recording.set_pipeline(&pass.pipeline);
            recording.set_bind_group(0, group, &[]);
            recording.draw(0..3, instance..instance + 1);
        };
        draw("source", &self.source, &groups.source, &sums.source, 0);
        let mut sum = &self.sum;
        if let (Some(layers), Some(back), Some([source, blocks])) = (&self.layers, &sums.back, &groups.back)
        {
            draw("source of the back", &self.source, source, &back.source, 0);
            draw("blocks of the back", &layers.blocks, blocks, &back.blocks, 0);
            sum = &layers.sum;
        }
        for i in 0..groups.gaussians {
            let from = i as usize % 2;
            let (group, to) = (&groups.sums[from], &sums.sums[1 - from]);
            let along = |what| format!("Gaussian {} along {what}", i + 1);
            draw(&along("rows"), &self.rows, &groups.rows, &sums.rows, i);
            draw(&along("columns"), sum, group, to, i);
        }
        let keeps = self.output.adds() || groups.viewport.is_some();
        let mut pass = recorder.draw(&format!("{} resolve", self.label), &[output], keeps);
        if let Some(viewport) = groups.viewport {
            viewport.apply(&mut pass);
        }
        let last = groups.gaussians as usize % 2;
        pass.set_pipeline(&self.resolve.pipeline);
        pass.set_bind_group(0, &groups.resolve[last], &[]);
        pass.draw(0..3, 0..1);
    }
}

impl Sums {
    pub(crate) fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The textures of the frame that was last prepared.
    pub(crate) fn read(&self) -> Option<&Textures> {
        self.groups.as_ref().map(|groups| &groups.read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wgsl::assert_layout;

    #[test]
    fn constants_are_those_of_the_shader() {
        let shader = [SHADER, BACK_LAYER].concat();
        let slots = crate::wgsl::constant(&shader, "MAX_GAUSSIANS");
        assert_eq!(slots as usize, Profile::MAX_GAUSSIANS);
        assert_eq!(crate::wgsl::constant(&shader, "BLOCK") as u32, BLOCK);
    }

    #[test]
    fn settings_lie_as_the_shader_has_them() {
        assert_layout!(
            SHADER,
            "Settings",
            Settings {
                gaussians,
                spacing,
                mm_per_unit,
                gutter,
                profiles,
                has_strength,
                has_albedo,
                first_pixel
            }
        );
    }
}
