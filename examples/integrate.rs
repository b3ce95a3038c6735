//! The smallest host: hands the effect a frame and reads the scattered layer back.
//!
//! The frame is made up on the CPU, a plane lit on its right half; a renderer hands over the
//! textures it has. What a host writes is `struct Skin` and its two functions.

use glam::Mat4;
use subsurface::renderer::Gpu;
use subsurface::wgpu::{self, TextureFormat};
use subsurface::{DEFAULT_MAX_ERROR, Error, Plan, PlannedScreenSpace, Profile, ScreenFrame};

/// What the deferred renderer has by the time its diffuse light is done.
struct Frame {
    irradiance: wgpu::TextureView,
    depth: wgpu::TextureView,
    profile_id: wgpu::TextureView,
    scattered: wgpu::TextureView,
    projection: Mat4,
}

// The integration: README.md shows these lines.
struct Skin {
    plan: Plan,
    effect: PlannedScreenSpace,
}

impl Skin {
    fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            plan: Plan::new(&[Profile::SKIN], DEFAULT_MAX_ERROR)?, // some seconds
            effect: PlannedScreenSpace::new(device, TextureFormat::Rgba16Float)?,
        })
    }

    /// After lighting, before specular and tone mapping.
    fn scatter(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        frame: &Frame,
    ) -> Result<(), Error> {
        let inputs = ScreenFrame {
            irradiance: &frame.irradiance,       // linear, without albedo
            depth: &frame.depth,                 // as the projection wrote it
            profile_id: Some(&frame.profile_id), // 1 on skin, 0 elsewhere
            normal: None,
            strength: None,
            viewport: None,
            output: &frame.scattered, // multiply this one by the albedo
            projection: frame.projection,
            mm_per_unit: 1000.0, // a scene in metres
            profiles: &[Profile::SKIN],
        };
        self.effect.prepare(device, queue, &inputs, &self.plan)?;
        self.effect.render(encoder);
        Ok(())
    }
}

fn main() -> Result<(), Error> {
    let gpu = Gpu::headless()?;
    let frame = made_up_frame(&gpu);
    let mut skin = Skin::new(&gpu.device)?;
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    skin.scatter(&gpu.device, &gpu.queue, &mut encoder, &frame)?;
    gpu.queue.submit([encoder.finish()]);

    let width = frame.scattered.texture().width() as usize;
    let pixels = gpu.read(&frame.scattered);
    println!("   mm   red  green   blue");
    for x in (width / 2 - 12..width / 2 + 12).step_by(2) {
        let [r, g, b, _] = pixels[x];
        let mm = (x as f32 + 0.5 - width as f32 / 2.0) / 4.0;
        println!("{mm:5.2} {r:6.3} {g:6.3} {b:6.3}");
    }
    Ok(())
}

/// A plane half a metre away, 4 pixels a millimetre, dark on the left and lit on the right.
fn made_up_frame(gpu: &Gpu) -> Frame {
    let size = [128, 64];
    let lit = |i: u32| f32::from(u8::from(i % size[0] >= size[0] / 2));
    let each_pixel = 0..size[0] * size[1];
    let irradiance: Vec<_> = each_pixel.clone().map(|i| [lit(i); 4]).collect();
    let depth: Vec<f32> = each_pixel.clone().map(|_| 0.5).collect();
    let profile_id: Vec<u8> = each_pixel.map(|_| 1).collect();
    let (half_width, half_height) = (0.016, 0.008);
    Frame {
        irradiance: gpu.upload("irradiance", size, TextureFormat::Rgba32Float, &irradiance),
        depth: gpu.upload("depth", size, TextureFormat::R32Float, &depth),
        profile_id: gpu.upload("profile id", size, TextureFormat::R8Uint, &profile_id),
        scattered: gpu.target("scattered", size, TextureFormat::Rgba16Float),
        // Orthographic, a metre deep.
        projection: glam::camera::rh::proj::directx::orthographic(
            -half_width,
            half_width,
            -half_height,
            half_height,
            0.0,
            1.0,
        ),
    }
}
