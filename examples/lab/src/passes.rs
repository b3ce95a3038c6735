//! What the passes of the renderer and of the rivals are made of.

use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, BindingType, Color, ColorTargetState, CommandEncoder,
    DepthStencilState, Device, LoadOp, RenderPass, RenderPassDepthStencilAttachment, RenderPipeline,
    SamplerBindingType, ShaderStages, TextureSampleType, TextureView, TextureViewDimension,
};

/// What a binding is; groups number their bindings from 0 in their order.
#[derive(Clone, Copy)]
pub enum Slot {
    Uniform,
    /// Loaded, of any float or depth format.
    Float,
    /// Sampled with filtering.
    Filtered,
    Uint,
    /// As `Float` and `Filtered`, of textures with layers.
    FloatLayers,
    FilteredLayers,
    /// Sampled by comparison.
    DepthLayers,
    Sampler,
    Comparison,
}

impl Slot {
    fn binding_type(self) -> BindingType {
        const FLOAT: TextureSampleType = TextureSampleType::Float { filterable: false };
        const FILTERED: TextureSampleType = TextureSampleType::Float { filterable: true };
        let (sample_type, view_dimension) = match self {
            Self::Uniform => {
                return BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                };
            }
            Self::Sampler => return BindingType::Sampler(SamplerBindingType::Filtering),
            Self::Comparison => return BindingType::Sampler(SamplerBindingType::Comparison),
            Self::Float => (FLOAT, TextureViewDimension::D2),
            Self::Filtered => (FILTERED, TextureViewDimension::D2),
            Self::Uint => (TextureSampleType::Uint, TextureViewDimension::D2),
            Self::FloatLayers => (FLOAT, TextureViewDimension::D2Array),
            Self::FilteredLayers => (FILTERED, TextureViewDimension::D2Array),
            Self::DepthLayers => (TextureSampleType::Depth, TextureViewDimension::D2Array),
        };
        BindingType::Texture { sample_type, view_dimension, multisampled: false }
    }
}

/// The layout of a group.
pub fn layout(device: &Device, label: &str, slots: &[Slot]) -> BindGroupLayout {
    let entry = |(slot, binding): (&Slot, _)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::VERTEX_FRAGMENT,
        ty: slot.binding_type(),
        count: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &Vec::from_iter(slots.iter().zip(0..).map(entry)),
    })
}

/// A group of the resources for these slots.
pub fn group(
    device: &Device,
    label: &str,
    layout: &BindGroupLayout,
    resources: &[BindingResource],
) -> BindGroup {
    let resources = resources.iter().cloned().zip(0..);
    let entries: Vec<_> =
        resources.map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource }).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}

/// A module of these texts, in their order.
pub fn module(device: &Device, label: &str, wgsl: &[&str]) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(wgsl.concat().into()),
    })
}

/// Bilinear, clamped to the edge.
pub fn linear_sampler(device: &Device, label: &str) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some(label),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    })
}

/// What pipelines differ in.
pub struct Pipeline<'a> {
    pub label: &'a str,
    pub shader: &'a wgpu::ShaderModule,
    /// Entry points.
    pub vertex: &'a str,
    pub fragment: &'a str,
    pub groups: &'a [Option<&'a BindGroupLayout>],
    /// Without any there is no fragment shader.
    pub targets: &'a [ColorTargetState],
    /// Meshes, both sides of their triangles, or one triangle over the targets.
    pub buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    pub depth_stencil: Option<DepthStencilState>,
    /// Values of the fragment shader's `override`s.
    pub constants: &'a [(&'a str, f64)],
}

impl<'a> Pipeline<'a> {
    /// One that binds and draws nothing yet.
    pub fn of(label: &'a str, shader: &'a wgpu::ShaderModule, [vertex, fragment]: [&'a str; 2]) -> Self {
        Self {
            label,
            shader,
            vertex,
            fragment,
            groups: &[],
            targets: &[],
            buffers: &[],
            depth_stencil: None,
            constants: &[],
        }
    }

    pub fn make(self, device: &Device) -> RenderPipeline {
        let Self { label, shader, vertex, fragment, groups, targets, buffers, depth_stencil, constants } =
            self;
        let targets: Vec<_> = targets.iter().cloned().map(Some).collect();
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: groups,
            immediate_size: 0,
        });
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(label),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: shader,
                entry_point: Some(vertex),
                compilation_options: Default::default(),
                buffers,
            },
            primitive: Default::default(),
            depth_stencil,
            multisample: Default::default(),
            fragment: (!targets.is_empty()).then_some(wgpu::FragmentState {
                module: shader,
                entry_point: Some(fragment),
                compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// For targets of which every pixel is written, or that start from nothing.
pub const CLEAR: LoadOp<Color> = LoadOp::Clear(Color::TRANSPARENT);

/// Begins a pass over targets, each cleared or kept, and what tests depth or stencil.
pub fn begin<'a>(
    encoder: &'a mut CommandEncoder,
    label: &str,
    targets: &[(&TextureView, LoadOp<Color>)],
    depth_stencil_attachment: Option<RenderPassDepthStencilAttachment<'_>>,
) -> RenderPass<'a> {
    let attachment = |&(view, load)| {
        Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        })
    };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &targets.iter().map(attachment).collect::<Vec<_>>(),
        depth_stencil_attachment,
        ..Default::default()
    })
}
