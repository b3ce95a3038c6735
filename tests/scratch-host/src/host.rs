//! What a deferred renderer has anyway: textures, a G-buffer with diffuse light, and read-back.

use std::sync::mpsc;

use wgpu::TextureFormat::{Depth32Float, R8Uint, Rgba16Float};
use wgpu::{TextureFormat, TextureUsages, TextureView};

pub const WIDTH: u32 = 640;
pub const HEIGHT: u32 = 480;
pub const NEAR: f32 = 0.05;

pub type Failure = Box<dyn std::error::Error>;
pub type Pixels = Vec<[u16; 4]>;

pub fn target(device: &wgpu::Device, format: TextureFormat) -> TextureView {
    let copied = format == Rgba16Float;
    let copies = TextureUsages::COPY_SRC | TextureUsages::COPY_DST;
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: WIDTH,
            height: HEIGHT,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: TextureUsages::RENDER_ATTACHMENT
            | TextureUsages::TEXTURE_BINDING
            | if copied {
                copies
            } else {
                TextureUsages::empty()
            },
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

pub struct GBuffer {
    pub irradiance: TextureView,
    pub lit: TextureView, // irradiance times albedo
    pub id: TextureView,
    pub depth: TextureView,
}

impl GBuffer {
    pub fn draw(
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        proj: glam::Mat4,
    ) -> Self {
        let g = Self {
            irradiance: target(device, Rgba16Float),
            lit: target(device, Rgba16Float),
            id: target(device, R8Uint),
            depth: target(device, Depth32Float),
        };
        let module = device.create_shader_module(wgpu::include_wgsl!("scene.wgsl"));
        let constants = [
            ("scale_x", proj.x_axis.x.into()),
            ("scale_y", proj.y_axis.y.into()),
            ("near", NEAR.into()),
        ];
        let options = |constants| wgpu::PipelineCompilationOptions {
            constants,
            ..Default::default()
        };
        let colours = [&g.irradiance, &g.id, &g.lit];
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: Depth32Float,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options: options(&constants),
                targets: &colours.map(|view| Some(view.texture().format().into())),
            }),
            multiview_mask: None,
            cache: None,
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &colours.map(|view| {
                Some(wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: Default::default(),
                })
            }),
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &g.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        pass.draw(0..3, 0..1);
        drop(pass);
        g
    }
}

pub fn read(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    view: &TextureView,
) -> Result<Pixels, Failure> {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(WIDTH * HEIGHT * 8),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        view.texture().as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(WIDTH * 8),
                rows_per_image: None,
            },
        },
        view.texture().size(),
    );
    queue.submit([encoder.finish()]);
    let (sender, receiver) = mpsc::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |result| {
        drop(sender.send(result))
    });
    device.poll(wgpu::PollType::wait_indefinitely())?;
    receiver.recv()??;
    let bytes = buffer.get_mapped_range(..)?;
    let half = |b: &[u8]| u16::from_le_bytes([b[0], b[1]]);
    Ok(bytes
        .chunks(8)
        .map(|p| [0, 2, 4, 6].map(|i| half(&p[i..])))
        .collect())
}

pub fn float(half: u16) -> f32 {
    let (exponent, fraction) = (i32::from(half >> 10 & 31), f32::from(half & 1023));
    let size = match exponent {
        0 => fraction / 1024.0 * 2f32.powi(-14),
        31 => f32::NAN,
        _ => (1.0 + fraction / 1024.0) * 2f32.powi(exponent - 15),
    };
    if half >> 15 == 1 { -size } else { size }
}
