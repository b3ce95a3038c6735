//! The smallest host: hands a frame to the effect in screen space and an atlas to the one in texture
//! space, and reads both results back. Choosing the mode is choosing which of them a final pass samples.
//!
//! Both are made up on the CPU, a plane lit on its right half; a renderer hands over the textures it
//! has. What a host writes is `struct Skin` or `struct SkinAtlas`, and their functions.

use glam::Mat4;
use subsurface::wgpu::{self, TextureFormat};
use subsurface::{
    Atlas, DEFAULT_MAX_ERROR, Error, Plan, PlannedScreenSpace, Profile, ScreenFrame, TextureSpace,
};
use subsurface_lab::renderer::Gpu;

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

/// What it has by the time it has drawn the head into its atlas, by `TextureSpace::VERTEX_WGSL`.
struct Unrolled {
    irradiance: wgpu::TextureView,
    positions: wgpu::TextureView,
    scattered: wgpu::TextureView,
}

// The integration in texture space.
struct SkinAtlas {
    effect: TextureSpace,
}

impl SkinAtlas {
    fn new(device: &wgpu::Device) -> Result<Self, Error> {
        let effect = TextureSpace::new(device, TextureFormat::Rgba16Float)?;
        Ok(Self { effect })
    }

    /// After the atlas is lit, before the head is drawn with what comes out.
    fn scatter(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        unrolled: &Unrolled,
    ) -> Result<(), Error> {
        let inputs = Atlas {
            irradiance: &unrolled.irradiance,
            positions: &unrolled.positions, // in metres, and 1 where there is skin
            output: &unrolled.scattered,    // sample this one by the mesh's UVs
            mm_per_unit: 1000.0,
            profiles: &[Profile::SKIN],
        };
        self.effect.prepare(device, &inputs)?;
        self.effect.render(encoder);
        Ok(())
    }
}

fn main() -> Result<(), Error> {
    let gpu = Gpu::headless()?;
    let frame = made_up_frame(&gpu);
    let unrolled = made_up_atlas(&gpu);
    let mut skin = Skin::new(&gpu.device)?;
    let mut atlas = SkinAtlas::new(&gpu.device)?;
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    skin.scatter(&gpu.device, &gpu.queue, &mut encoder, &frame)?;
    atlas.scatter(&gpu.device, &mut encoder, &unrolled)?;
    gpu.queue.submit([encoder.finish()]);

    let screen = gpu.read(&frame.scattered);
    let texture = gpu.read(&unrolled.scattered);
    println!("        screen space         texture space");
    println!("   mm   red  green   blue    red  green   blue");
    let [width, _] = SIZE.map(|s| s as usize);
    for x in (width / 2 - 12..width / 2 + 12).step_by(2) {
        let mm = (x as f32 + 0.5 - width as f32 / 2.0) / PX_PER_MM;
        let ([r, g, b, _], [s, t, u, _]) = (screen[x], texture[x]);
        println!("{mm:5.2} {r:6.3} {g:6.3} {b:6.3} {s:6.3} {t:6.3} {u:6.3}");
    }
    Ok(())
}

const SIZE: [u32; 2] = [128, 64];
const PX_PER_MM: f32 = 4.0;

/// Dark on the left, lit on the right.
fn light() -> Vec<[f32; 4]> {
    let lit = |i: u32| f32::from(u8::from(i % SIZE[0] >= SIZE[0] / 2));
    (0..SIZE[0] * SIZE[1]).map(|i| [lit(i); 4]).collect()
}

/// A plane half a metre away.
fn made_up_frame(gpu: &Gpu) -> Frame {
    let count = (SIZE[0] * SIZE[1]) as usize;
    let half = SIZE.map(|s| s as f32 / PX_PER_MM / 2000.0);
    Frame {
        irradiance: gpu.upload("irradiance", SIZE, TextureFormat::Rgba32Float, &light()),
        depth: gpu.upload("depth", SIZE, TextureFormat::R32Float, &vec![0.5f32; count]),
        profile_id: gpu.upload("profile id", SIZE, TextureFormat::R8Uint, &vec![1u8; count]),
        scattered: gpu.target("scattered", SIZE, TextureFormat::Rgba16Float),
        // Orthographic, a metre deep.
        projection: glam::camera::rh::proj::directx::orthographic(
            -half[0], half[0], -half[1], half[1], 0.0, 1.0,
        ),
    }
}

/// The same plane, unrolled.
fn made_up_atlas(gpu: &Gpu) -> Unrolled {
    let metres = |texels: u32| texels as f32 / PX_PER_MM / 1000.0;
    let point = |i: u32| [metres(i % SIZE[0]), metres(i / SIZE[0]), -0.5, 1.0];
    let positions: Vec<[f32; 4]> = (0..SIZE[0] * SIZE[1]).map(point).collect();
    let full = TextureFormat::Rgba32Float;
    Unrolled {
        irradiance: gpu.upload("irradiance of the atlas", SIZE, full, &light()),
        positions: gpu.upload("positions", SIZE, full, &positions),
        scattered: gpu.target("scattered atlas", SIZE, TextureFormat::Rgba16Float),
    }
}
