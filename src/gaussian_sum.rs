//! The sum of Gaussians over a surface given by a position per pixel: what the screen-space and
//! the texture-space effect share. Driver of `shaders/gaussian_sum.wgsl`.

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, Vec4};
use wgpu::{
    BindGroup, BindGroupLayout, ColorTargetState, CommandEncoder, Device, RenderPipeline,
    TextureFormat, TextureView,
};

use crate::frame::{NormalSettings, Viewport};
use crate::{MAX_PROFILES, Output, Profile};

/// Per pixel: E·A and A, Σ over a row, and the running sum. Full floats: twelve roundings to half
/// floats would lose energy.
pub(crate) const SCRATCH: TextureFormat = TextureFormat::Rgba32Float;

const POSITIONS: u32 = 1;
const IRRADIANCE: u32 = 2;
const SOURCE: u32 = 3;
const ROWS: u32 = 4;
const SUM: u32 = 5;
const STRENGTH: u32 = 6;
const NORMAL: u32 = 7;

const SHADER: &str = concat!(
    include_str!("../shaders/host.wgsl"),
    include_str!("../shaders/gaussian_sum.wgsl")
);

/// `Settings` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct Settings {
    pub gaussians: [Vec4; MAX_PROFILES * Profile::MAX_GAUSSIANS],
    /// See the shader; zero where the surface itself tells.
    pub spacing: Vec4,
    pub rays: Vec4,
    pub normals: NormalSettings,
    pub mm_per_unit: f32,
    /// Pixels.
    pub gutter: i32,
    pub profiles: u32,
    pub has_strength: u32,
    /// Of the irradiance, the output and the strength.
    pub first_pixel: UVec2,
    pub pad: [u32; 2],
}

impl Settings {
    pub fn new(profiles: &[Profile], mm_per_unit: f32) -> Self {
        let mut settings = Self {
            mm_per_unit,
            profiles: profiles.len() as u32,
            ..Self::zeroed()
        };
        for (slots, profile) in settings
            .gaussians
            .chunks_exact_mut(Profile::MAX_GAUSSIANS)
            .zip(profiles)
        {
            for (slot, g) in slots.iter_mut().zip(profile.gaussians()) {
                *slot = g.weight.extend(g.variance_mm2);
            }
        }
        settings
    }
}

/// The passes, and what they need for the frame that was last prepared.
pub(crate) struct GaussianSum {
    label: &'static str,
    output: Output,
    source: Pass,
    rows: Pass,
    sum: Pass,
    resolve: Pass,
    scratch: Option<Scratch>,
    frame: Option<Frame>,
}

struct Pass {
    label: String,
    /// Bindings of the textures that it reads.
    textures: Vec<u32>,
    layout: BindGroupLayout,
    pipeline: RenderPipeline,
}

struct Scratch {
    size: [u32; 2],
    source: TextureView,
    rows: TextureView,
    sums: [TextureView; 2],
}

struct Frame {
    gaussians: u32,
    output: TextureView,
    viewport: Option<Viewport>,
    source: BindGroup,
    rows: BindGroup,
    /// Reads the one sum, writes the other.
    sums: [BindGroup; 2],
    resolve: BindGroup,
}

/// Views and numbers of one frame, already checked.
pub(crate) struct Inputs<'a> {
    pub positions: &'a TextureView,
    pub irradiance: &'a TextureView,
    pub output: &'a TextureView,
    pub strength: Option<&'a TextureView>,
    pub normal: Option<&'a TextureView>,
    pub viewport: Option<Viewport>,
    pub profiles: &'a [Profile],
    pub settings: Settings,
}

impl GaussianSum {
    pub fn new(device: &Device, output: Output, label: &'static str) -> Self {
        let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let pass = |name: &str, textures: &[u32], target| {
            let label = format!("{label} {name}");
            Pass::new(device, &shader, &label, name, textures, target)
        };
        let resolve = match output.is_difference() {
            true => "fs_difference",
            false => "fs_resolve",
        };
        Self {
            label,
            output,
            source: pass(
                "fs_source",
                &[POSITIONS, IRRADIANCE, NORMAL],
                SCRATCH.into(),
            ),
            rows: pass("fs_rows", &[POSITIONS, SOURCE, NORMAL], SCRATCH.into()),
            sum: pass(
                "fs_sum",
                &[POSITIONS, IRRADIANCE, SOURCE, ROWS, SUM, NORMAL],
                SCRATCH.into(),
            ),
            resolve: pass(
                resolve,
                &[POSITIONS, IRRADIANCE, SUM, STRENGTH],
                output.target(wgpu::ColorWrites::ALL),
            ),
            scratch: None,
            frame: None,
        }
    }

    pub fn prepare(&mut self, device: &Device, inputs: &Inputs) {
        let size = crate::input::size(inputs.positions);
        if self.scratch.as_ref().is_none_or(|s| s.size != size) {
            self.scratch = None; // The old one goes before the new one comes.
        }
        let label = self.label;
        let scratch = self
            .scratch
            .get_or_insert_with(|| Scratch::new(device, size, label));
        let settings = uniform(device, &format!("{label} settings"), &inputs.settings);

        let group = |pass: &Pass, sum: usize| {
            pass.bind(device, &settings, |binding| match binding {
                POSITIONS => inputs.positions,
                IRRADIANCE => inputs.irradiance,
                SOURCE => &scratch.source,
                ROWS => &scratch.rows,
                // Not looked at where there is none.
                STRENGTH => inputs.strength.unwrap_or(inputs.irradiance),
                NORMAL => inputs.normal.unwrap_or(inputs.irradiance),
                _ => &scratch.sums[sum],
            })
        };
        let gaussians = inputs
            .profiles
            .iter()
            .map(|p| p.gaussians().len())
            .max()
            .unwrap_or(0);
        self.frame = Some(Frame {
            gaussians: gaussians as u32,
            output: inputs.output.clone(),
            viewport: inputs.viewport,
            source: group(&self.source, 0),
            rows: group(&self.rows, 0),
            sums: [group(&self.sum, 0), group(&self.sum, 1)],
            resolve: group(&self.resolve, gaussians % 2),
        });
    }

    /// Records the frame, and calls `after` with the label of each pass.
    pub fn render(
        &self,
        encoder: &mut CommandEncoder,
        after: &mut dyn FnMut(&str, &mut CommandEncoder),
    ) {
        let (Some(scratch), Some(frame)) = (&self.scratch, &self.frame) else {
            return;
        };
        let mut draw = |name: &str, pass: &Pass, group, to, i| {
            let label = format!("{} {name}", self.label);
            draw_full_screen(encoder, &label, &pass.pipeline, group, to, i);
            after(&label, encoder);
        };
        draw("source", &self.source, &frame.source, &scratch.source, 0);
        for i in 0..frame.gaussians {
            let from = i as usize % 2;
            let (group, to) = (&frame.sums[from], &scratch.sums[1 - from]);
            let along = |what| format!("Gaussian {} along {what}", i + 1);
            draw(&along("rows"), &self.rows, &frame.rows, &scratch.rows, i);
            draw(&along("columns"), &self.sum, group, to, i);
        }
        let label = format!("{} resolve", self.label);
        {
            let keeps = self.output.adds() || frame.viewport.is_some();
            let mut pass = begin(encoder, &label, &[&frame.output], keeps);
            if let Some(viewport) = frame.viewport {
                viewport.apply(&mut pass);
            }
            pass.set_pipeline(&self.resolve.pipeline);
            pass.set_bind_group(0, &frame.resolve, &[]);
            pass.draw(0..3, 0..1);
        }
        after(&label, encoder);
    }
}

impl Scratch {
    fn new(device: &Device, size: [u32; 2], label: &str) -> Self {
        let view = |name: &str| scratch_view(device, &format!("{label} {name}"), size, SCRATCH);
        Self {
            size,
            source: view("source"),
            rows: view("rows"),
            sums: [view("sum 0"), view("sum 1")],
        }
    }
}

/// A uniform buffer of its own for each frame, so that several may be recorded before a submit.
pub(crate) fn uniform<T: Pod>(device: &Device, label: &str, contents: &T) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::UNIFORM;
    filled(device, label, bytemuck::bytes_of(contents), usage)
}

/// A buffer that holds these bytes, as many as a multiple of four; on a device that is lost one of nothing,
/// where wgpu's own helper panics.
pub(crate) fn filled(
    device: &Device,
    label: &str,
    contents: &[u8],
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: contents.len() as u64,
        usage,
        mapped_at_creation: true,
    });
    // What was lost, the device has told the host.
    if let Ok(mut bytes) = buffer.get_mapped_range_mut(..) {
        bytes.slice(..).copy_from_slice(contents);
    }
    buffer.unmap();
    buffer
}

/// A texture that passes hand to each other.
pub(crate) fn scratch_view(
    device: &Device,
    label: &str,
    size: [u32; 2],
    format: TextureFormat,
) -> TextureView {
    device
        .create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d {
                width: size[0],
                height: size[1],
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        })
        .create_view(&Default::default())
}

/// A texture that shaders load floats from; depth formats are floats, too.
pub(crate) fn float_texture(binding: u32) -> wgpu::BindGroupLayoutEntry {
    texture(
        binding,
        wgpu::TextureSampleType::Float { filterable: false },
    )
}

/// A texture that shaders load unsigned integers from.
pub(crate) fn uint_texture(binding: u32) -> wgpu::BindGroupLayoutEntry {
    texture(binding, wgpu::TextureSampleType::Uint)
}

fn texture(binding: u32, sample_type: wgpu::TextureSampleType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty: wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    }
}

/// The uniform buffer of a pass, at binding 0.
pub(crate) const UNIFORM: wgpu::BindGroupLayoutEntry = wgpu::BindGroupLayoutEntry {
    binding: 0,
    visibility: wgpu::ShaderStages::FRAGMENT,
    ty: wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    },
    count: None,
};

/// A pipeline that draws one triangle over its target.
pub(crate) fn full_screen(
    device: &Device,
    shader: &wgpu::ShaderModule,
    label: &str,
    entry_point: &str,
    layout: &BindGroupLayout,
    target: ColorTargetState,
) -> RenderPipeline {
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some("vs_main"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: shader,
            entry_point: Some(entry_point),
            compilation_options: Default::default(),
            targets: &[Some(target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Draws `pipeline` over all of `target`; the instance index carries `instance`.
pub(crate) fn draw_full_screen(
    encoder: &mut CommandEncoder,
    label: &str,
    pipeline: &RenderPipeline,
    group: &BindGroup,
    target: &TextureView,
    instance: u32,
) {
    // Every pixel is written.
    let mut pass = begin(encoder, label, &[target], false);
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, group, &[]);
    pass.draw(0..3, instance..instance + 1);
}

/// Begins a pass over targets that keep what they hold, or are cleared, which spares tilers the load.
pub(crate) fn begin<'a>(
    encoder: &'a mut CommandEncoder,
    label: &str,
    targets: &[&TextureView],
    keeps: bool,
) -> wgpu::RenderPass<'a> {
    let load = match keeps {
        true => wgpu::LoadOp::Load,
        false => wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
    };
    let attachment = |view| {
        Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load,
                store: wgpu::StoreOp::Store,
            },
        })
    };
    let attachments: Vec<_> = targets.iter().map(|view| attachment(*view)).collect();
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &attachments,
        ..Default::default()
    })
}

impl Pass {
    fn new(
        device: &Device,
        shader: &wgpu::ShaderModule,
        label: &str,
        entry_point: &str,
        textures: &[u32],
        target: ColorTargetState,
    ) -> Self {
        let mut entries = vec![UNIFORM];
        entries.extend(textures.iter().map(|&binding| float_texture(binding)));
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(label),
            entries: &entries,
        });
        Self {
            label: label.into(),
            pipeline: full_screen(device, shader, label, entry_point, &layout, target),
            textures: textures.to_vec(),
            layout,
        }
    }

    fn bind<'a>(
        &self,
        device: &Device,
        settings: &wgpu::Buffer,
        view: impl Fn(u32) -> &'a TextureView,
    ) -> BindGroup {
        let mut entries = vec![wgpu::BindGroupEntry {
            binding: 0,
            resource: settings.as_entire_binding(),
        }];
        entries.extend(self.textures.iter().map(|&binding| wgpu::BindGroupEntry {
            binding,
            resource: wgpu::BindingResource::TextureView(view(binding)),
        }));
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(&self.label),
            layout: &self.layout,
            entries: &entries,
        })
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
            "Normals",
            NormalSettings {
                has,
                decode,
                to_view
            }
        );
        assert_layout!(
            SHADER,
            "Settings",
            Settings {
                gaussians,
                spacing,
                rays,
                normals,
                mm_per_unit,
                gutter,
                profiles,
                has_strength,
                first_pixel
            }
        );
    }
}
