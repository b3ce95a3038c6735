//! What the passes need of wgpu: scratch textures, buffers, layouts and pipelines, and an encoder that
//! names passes and takes their time.

use wgpu::{
    BindGroup, BindGroupLayout, BindGroupLayoutEntry, BindingResource, BindingType, Buffer,
    BufferBindingType, BufferUsages, ColorTargetState, CommandEncoder, Device, QuerySet, RenderPipeline,
    ShaderModule, ShaderStages, TextureFormat, TextureSampleType, TextureView,
};

/// A texture that passes hand to each other.
pub(crate) fn scratch_texture(
    device: &Device,
    label: &str,
    size: [u32; 2],
    format: TextureFormat,
) -> TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

/// A buffer for a `T` of each frame.
pub(crate) fn uniform_buffer<T>(device: &Device, label: &str) -> Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size_of::<T>() as u64,
        usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// A buffer that holds these bytes, as many as a multiple of four. On a device that is lost it holds
/// nothing, where wgpu's own helper panics.
pub(crate) fn filled_buffer(device: &Device, label: &str, contents: &[u8], usage: BufferUsages) -> Buffer {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: contents.len() as u64,
        usage,
        mapped_at_creation: true,
    });
    // The device has told the host that it is lost.
    if let Ok(mut bytes) = buffer.get_mapped_range_mut(..) {
        bytes.slice(..).copy_from_slice(contents);
    }
    buffer.unmap();
    buffer
}

/// A module of these files, in their order.
pub(crate) fn module(device: &Device, label: &str, files: &[&str]) -> ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(files.concat().into()),
    })
}

/// A texture that shaders load floats from; depth formats are floats, too.
pub(crate) const FLOATS: BindingType = texture_type(TextureSampleType::Float { filterable: false });
/// A texture that shaders filter.
pub(crate) const FILTERED: BindingType = texture_type(TextureSampleType::Float { filterable: true });
/// A texture that shaders load unsigned integers from.
pub(crate) const UINTS: BindingType = texture_type(TextureSampleType::Uint);
/// A linear sampler.
pub(crate) const SAMPLER: BindingType = BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
/// Numbers of a frame.
pub(crate) const UNIFORM: BindingType = buffer_type(BufferBindingType::Uniform);
/// A buffer that shaders read.
pub(crate) const READ: BindingType = buffer_type(BufferBindingType::Storage { read_only: true });
/// A buffer that shaders write.
pub(crate) const WRITE: BindingType = buffer_type(BufferBindingType::Storage { read_only: false });

/// A texture of a format that shaders write.
pub(crate) const fn stored(format: TextureFormat) -> BindingType {
    BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::WriteOnly,
        format,
        view_dimension: wgpu::TextureViewDimension::D2,
    }
}

const fn texture_type(sample_type: TextureSampleType) -> BindingType {
    BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    }
}

const fn buffer_type(ty: BufferBindingType) -> BindingType {
    BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

/// A layout of bindings, each with its number and type, for these stages. Vertices do not write, by WebGPU's
/// default limits.
pub(crate) fn layout(
    device: &Device,
    label: &str,
    visibility: ShaderStages,
    bindings: &[(u32, BindingType)],
) -> BindGroupLayout {
    let entry = |&(binding, ty)| BindGroupLayoutEntry {
        binding,
        visibility: match ty == WRITE {
            true => visibility - ShaderStages::VERTEX,
            false => visibility,
        },
        ty,
        count: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &bindings.iter().map(entry).collect::<Vec<_>>(),
    })
}

/// A group of resources by their bindings.
pub(crate) fn group(
    device: &Device,
    label: &str,
    layout: &BindGroupLayout,
    resources: &[(u32, BindingResource)],
) -> BindGroup {
    let entries: Vec<_> = resources
        .iter()
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding: *binding, resource: resource.clone() })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}

/// How a render pipeline is made.
pub(crate) struct Draw<'a> {
    pub label: &'a str,
    pub module: &'a ShaderModule,
    pub vertex: &'a str,
    pub fragment: &'a str,
    pub layout: &'a BindGroupLayout,
    pub topology: wgpu::PrimitiveTopology,
    pub targets: &'a [Option<ColorTargetState>],
    /// Values of `override` constants.
    pub constants: &'a [(&'a str, f64)],
}

impl Draw<'_> {
    pub(crate) fn pipeline(&self, device: &Device) -> RenderPipeline {
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(self.label),
            bind_group_layouts: &[Some(self.layout)],
            immediate_size: 0,
        });
        let options =
            || wgpu::PipelineCompilationOptions { constants: self.constants, ..Default::default() };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.label),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: self.module,
                entry_point: Some(self.vertex),
                compilation_options: options(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState { topology: self.topology, ..Default::default() },
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: self.module,
                entry_point: Some(self.fragment),
                compilation_options: options(),
                targets: self.targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// A compute pipeline without constants.
pub(crate) fn compute_pipeline(
    device: &Device,
    label: &str,
    module: &ShaderModule,
    entry_point: &str,
    layout: &BindGroupLayout,
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(label),
        layout: Some(&layout),
        module,
        entry_point: Some(entry_point),
        compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
        cache: None,
    })
}

/// Where passes are recorded: names each, and has the GPU write its times where a host asks for them.
pub(crate) struct Recorder<'a> {
    pub encoder: &'a mut CommandEncoder,
    /// Queries, and the number of the first that is free.
    times: Option<(&'a QuerySet, u32)>,
    labels: Vec<String>,
}

impl<'a> Recorder<'a> {
    pub(crate) fn new(encoder: &'a mut CommandEncoder, times: Option<(&'a QuerySet, u32)>) -> Self {
        Self { encoder, times, labels: Vec::new() }
    }

    /// The labels of all passes so far.
    pub(crate) fn finish(self) -> Vec<String> {
        self.labels
    }

    /// The queries of the pass of this label, where times are asked for.
    fn queries(&mut self, label: &str) -> Option<(&'a QuerySet, Option<u32>, Option<u32>)> {
        let (set, first) = self.times?;
        let query = first + 2 * self.labels.len() as u32;
        self.labels.push(label.into());
        Some((set, Some(query), Some(query + 1)))
    }

    /// Begins a pass over targets that keep what they hold, or are cleared, which spares tilers the load.
    pub(crate) fn draw(
        &mut self,
        label: &str,
        targets: &[&TextureView],
        keeps: bool,
    ) -> wgpu::RenderPass<'_> {
        let load = match keeps {
            true => wgpu::LoadOp::Load,
            false => wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
        };
        let attachment = |view| {
            Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
            })
        };
        let attachments: Vec<_> = targets.iter().map(|view| attachment(*view)).collect();
        let queries = self.queries(label);
        self.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(label),
            color_attachments: &attachments,
            timestamp_writes: queries.map(|(query_set, beginning, end)| wgpu::RenderPassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: beginning,
                end_of_pass_write_index: end,
            }),
            ..Default::default()
        })
    }

    /// Begins a pass of dispatches.
    pub(crate) fn dispatch(&mut self, label: &str) -> wgpu::ComputePass<'_> {
        let queries = self.queries(label);
        self.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(label),
            timestamp_writes: queries.map(|(query_set, beginning, end)| wgpu::ComputePassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: beginning,
                end_of_pass_write_index: end,
            }),
        })
    }
}
