//! A device without a window, and the way of pixels to it and back.

use wgpu::util::{DeviceExt, TextureBlitter};
use wgpu::{TextureFormat, TextureUsages, TextureView};

use crate::Error;

/// A headless device, at WebGPU's default limits.
pub struct Gpu {
    /// The adapter's name and driver.
    pub adapter: String,
    /// Whether it draws in software.
    pub is_cpu: bool,
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    to_float: TextureBlitter,
}

impl Gpu {
    /// The adapter that wgpu prefers, or the one that `WGPU_ADAPTER_NAME` names a part of; without any
    /// feature, which is what the effects need at most.
    ///
    /// # Errors
    /// No adapter, or one that gives no device.
    pub fn headless() -> Result<Self, Error> {
        Self::with(wgpu::Features::empty())
    }

    /// The same with those of these features that the adapter has.
    ///
    /// # Errors
    /// As [`headless`](Self::headless).
    pub fn with(features: wgpu::Features) -> Result<Self, Error> {
        if let Ok(name) = std::env::var("WGPU_BACKEND")
            && wgpu::Backends::from_env().is_none_or(|backends| backends.is_empty())
        {
            return Err(Error::new("WGPU_BACKEND", name, "vulkan, metal or dx12"));
        }
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        pollster::block_on(Self::of(&instance, features))
    }

    /// The same of an instance, for those that may not wait: a page in a browser.
    ///
    /// # Errors
    /// As [`headless`](Self::headless).
    pub async fn of(instance: &wgpu::Instance, features: wgpu::Features) -> Result<Self, Error> {
        let no_adapter = |e: &dyn std::fmt::Display| {
            Error::new(
                "graphics adapter",
                format!("none ({})", e.to_string().replace('\n', " ")),
                "a Vulkan, Metal or DirectX 12 driver; on Linux ./setup installs one",
            )
        };
        let adapter = match std::env::var("WGPU_ADAPTER_NAME") {
            Ok(name) => named(instance, &name).await?,
            Err(_) => instance
                .request_adapter(&wgpu::RequestAdapterOptions {
                    power_preference: wgpu::PowerPreference::HighPerformance,
                    ..Default::default()
                })
                .await
                .map_err(|e| no_adapter(&e))?,
        };
        let (device, queue) = adapter
            .request_device(&wgpu::DeviceDescriptor {
                label: Some("subsurface_lab::Gpu"),
                required_features: adapter.features() & features,
                ..Default::default()
            })
            .await
            .map_err(|e| no_adapter(&e))?;
        let info = adapter.get_info();
        Ok(Self {
            adapter: format!("{} ({:?}, {})", info.name, info.backend, info.driver_info),
            is_cpu: info.device_type == wgpu::DeviceType::Cpu,
            to_float: TextureBlitter::new(&device, TextureFormat::Rgba32Float),
            device,
            queue,
        })
    }

    /// Whether pictures of this size can be rendered and read back.
    ///
    /// # Errors
    /// A size of 0 or beyond the device's limits.
    pub fn check_size(&self, size: [u32; 2]) -> Result<(), Error> {
        let limits = self.device.limits();
        let limit = limits.max_texture_dimension_2d;
        // Pictures are read back as full floats, in rows of a multiple of 256 bytes.
        let bytes = u64::from(size[0].div_ceil(16)) * 256 * u64::from(size[1]);
        if size.iter().any(|&s| s == 0 || s > limit) || bytes > limits.max_buffer_size {
            return Err(Error::new(
                "size",
                format!("{}x{}", size[0], size[1]),
                format!("1 to {limit} pixels each way, at most {} together", limits.max_buffer_size / 16),
            ));
        }
        Ok(())
    }

    /// A texture of its own that passes render to and read from, and that can be copied out.
    pub fn target(&self, label: &str, size: [u32; 2], format: TextureFormat) -> TextureView {
        self.device
            .create_texture(&descriptor(label, size, format, TextureUsages::RENDER_ATTACHMENT))
            .create_view(&Default::default())
    }

    /// A texture with layers, which passes render to and read from, and that can be written.
    pub(super) fn layers(
        &self,
        label: &str,
        size: [u32; 2],
        layers: u32,
        format: TextureFormat,
    ) -> wgpu::Texture {
        let mut descriptor = descriptor(label, size, format, TextureUsages::RENDER_ATTACHMENT);
        descriptor.size.depth_or_array_layers = layers;
        self.device.create_texture(&descriptor)
    }

    /// A texture that holds `texels`, row by row.
    ///
    /// # Panics
    /// Where `texels` are not of the format and size.
    pub fn upload<T: bytemuck::Pod>(
        &self,
        label: &str,
        size: [u32; 2],
        format: TextureFormat,
        texels: &[T],
    ) -> TextureView {
        self.device
            .create_texture_with_data(
                &self.queue,
                &descriptor(label, size, format, TextureUsages::empty()),
                Default::default(),
                bytemuck::cast_slice(texels),
            )
            .create_view(&Default::default())
    }

    /// A uniform buffer for one `T`.
    pub(super) fn uniform<T: bytemuck::Pod>(&self, label: &str) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: size_of::<T>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// Submits what `record` records and waits until it is done, but in a browser, which may not wait.
    /// Returns what `record` returns.
    pub fn run<T>(&self, record: impl FnOnce(&mut wgpu::CommandEncoder) -> T) -> T {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let result = record(&mut encoder);
        self.queue.submit([encoder.finish()]);
        self.wait();
        result
    }

    /// The pixels of a float texture, row by row, red to alpha.
    pub fn read(&self, view: &TextureView) -> Vec<[f32; 4]> {
        bytemuck::pod_collect_to_vec(&self.wait_for(self.copy_out(self.to_float(view).texture())))
    }

    /// A copy of a float texture as Rgba32Float.
    pub fn to_float(&self, view: &TextureView) -> TextureView {
        let size = [view.texture().width(), view.texture().height()];
        let copy = self.target("subsurface_lab::Gpu copy", size, TextureFormat::Rgba32Float);
        self.run(|encoder| self.to_float.copy(&self.device, encoder, view, &copy));
        copy
    }

    /// The bytes of an uncompressed texture, row by row.
    pub fn read_bytes(&self, texture: &wgpu::Texture) -> Vec<u8> {
        self.wait_for(self.copy_out(texture))
    }

    /// Copies the bytes of an uncompressed texture to where the CPU can read them.
    pub fn copy_out(&self, texture: &wgpu::Texture) -> Readback {
        let texel = texture.format().block_copy_size(None).unwrap_or(0);
        let row = texture.width() * texel;
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let readback = Readback::new(self, [row, padded], texture.height());
        self.run(|encoder| {
            encoder.copy_texture_to_buffer(
                texture.as_image_copy(),
                wgpu::TexelCopyBufferInfo {
                    buffer: &readback.buffer,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(padded),
                        rows_per_image: None,
                    },
                },
                texture.size(),
            );
        });
        readback
    }

    /// The bytes of a buffer that may be copied.
    pub fn read_buffer(&self, buffer: &wgpu::Buffer) -> Vec<u8> {
        let bytes = buffer.size();
        let readback = Readback::new(self, [bytes as u32; 2], 1);
        self.run(|encoder| encoder.copy_buffer_to_buffer(buffer, 0, &readback.buffer, 0, bytes));
        self.wait_for(readback)
    }

    /// Maps what was copied, and waits for it.
    pub(super) fn wait_for(&self, readback: Readback) -> Vec<u8> {
        readback.buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        self.wait();
        readback.bytes()
    }

    fn wait(&self) {
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .expect("a headless device is only lost with its driver");
    }
}

/// All layers of a texture.
pub(super) fn array(texture: &wgpu::Texture) -> TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    })
}

/// One layer of a texture.
pub(super) fn layer(texture: &wgpu::Texture, base_array_layer: u32) -> TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2),
        base_array_layer,
        array_layer_count: Some(1),
        ..Default::default()
    })
}

/// Bytes on their way from the device.
pub struct Readback {
    /// To be mapped before they are read.
    pub buffer: wgpu::Buffer,
    /// Bytes of a row, without and with what pads it.
    row: [u32; 2],
}

impl Readback {
    /// Rows of so many bytes, without and with what pads them.
    pub(super) fn new(gpu: &Gpu, row: [u32; 2], rows: u32) -> Self {
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("subsurface_lab::Gpu readback"),
            size: u64::from(row[1]) * u64::from(rows),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        Self { buffer, row }
    }

    /// The rows, without what pads them.
    ///
    /// # Panics
    /// Where the buffer is not mapped.
    pub fn bytes(&self) -> Vec<u8> {
        let mapped =
            self.buffer.get_mapped_range(..).expect("a readback buffer is mapped before it is read");
        let [row, padded] = self.row.map(|bytes| bytes as usize);
        mapped.chunks_exact(padded).flat_map(|r| &r[..row]).copied().collect()
    }
}

/// The first adapter whose name holds this, in whatever case. wgpu's own function panics if there is none.
async fn named(instance: &wgpu::Instance, part: &str) -> Result<wgpu::Adapter, Error> {
    let adapters = instance.enumerate_adapters(wgpu::Backends::all()).await;
    let names: Vec<String> = adapters.iter().map(|adapter| adapter.get_info().name).collect();
    let holds = |name: &String| name.to_lowercase().contains(&part.to_lowercase());
    let found = names.iter().position(holds).and_then(|i| adapters.into_iter().nth(i));
    found.ok_or_else(|| {
        let needs = format!("a part of an adapter's name: {}", names.join(", "));
        Error::new("WGPU_ADAPTER_NAME", part, needs)
    })
}

fn descriptor<'a>(
    label: &'a str,
    size: [u32; 2],
    format: TextureFormat,
    usage: TextureUsages,
) -> wgpu::TextureDescriptor<'a> {
    wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: usage | TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_SRC | TextureUsages::COPY_DST,
        view_formats: &[],
    }
}
