//! Times the methods on a full frame of skin that faces the camera, 512×512 at 4 px/mm.

mod method;
mod rivals;

use std::time::Instant;

use subsurface::renderer::Gpu;
use subsurface::wgpu::TextureFormat;
use subsurface::{Atlas, Error, Profile, ScreenFrame, ScreenSpace, TextureSpace};

const SIZE: [u32; 2] = [512, 512];
const PX_PER_MM: f32 = 4.0;

fn main() -> Result<(), Error> {
    let gpu = Gpu::headless()?;
    let format = TextureFormat::Rgba16Float;
    let profile = Profile::SKIN;
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    let irradiance = gpu.upload(
        "irradiance",
        SIZE,
        TextureFormat::Rgba32Float,
        &vec![[0.5f32; 4]; pixels],
    );
    let half = gpu.target("irradiance", SIZE, format);
    let output = gpu.target("output", SIZE, format);
    let scale = 2.0 * PX_PER_MM / SIZE[0] as f32;
    let frame = ScreenFrame {
        irradiance: &half,
        depth: &gpu.upload(
            "depth",
            SIZE,
            TextureFormat::R32Float,
            &vec![0.3f32; pixels],
        ),
        profile_id: &gpu.upload(
            "profile id",
            SIZE,
            TextureFormat::R8Uint,
            &vec![1u8; pixels],
        ),
        output: &output,
        projection: glam::Mat4::from_scale(glam::Vec3::new(scale, scale, -1e-3)),
        mm_per_unit: 1.0,
        profiles: &[profile],
    };
    let mut methods = rivals::screen(&gpu.device, format, &profile)?;
    let ours = ScreenSpace::new(&gpu.device, format)?;
    methods.push(("subsurface", String::new(), Box::new(ours)));
    for (name, setting, mut method) in methods {
        method.prepare(&gpu.device, &frame)?;
        let ms = milliseconds(&gpu, 5, |encoder| method.render(encoder));
        let fetches = method.fetches(PX_PER_MM.into()).unwrap_or_default();
        let bytes = method.scratch_bytes_per_pixel();
        println!("{name} {setting}: {ms:.1} ms, {fetches} fetches, {bytes} B a pixel");
    }

    let texel = |i: usize| {
        let at = glam::UVec2::new(i as u32 % SIZE[0], i as u32 / SIZE[0]).as_vec2() / PX_PER_MM;
        [at.x, at.y, 0.0, 1.0]
    };
    let positions: Vec<_> = (0..pixels).map(texel).collect();
    let atlas = Atlas {
        irradiance: &irradiance,
        positions: &gpu.upload("positions", SIZE, TextureFormat::Rgba32Float, &positions),
        output: &output,
        mm_per_unit: 1.0,
        profiles: &[profile],
    };
    let mut methods = rivals::atlas(&gpu.device, format, &profile);
    let ours = TextureSpace::new(&gpu.device, format)?;
    methods.push(("subsurface", String::new(), Box::new(ours)));
    for (name, setting, mut method) in methods {
        method.prepare(&gpu.device, &atlas)?;
        let ms = milliseconds(&gpu, 1, |encoder| method.render(encoder));
        let bytes = method.scratch_bytes_per_texel();
        println!("{name} {setting}: {ms:.1} ms, {bytes} B a texel");
    }
    Ok(())
}

/// The least wall time of some runs, after one that warms up.
fn milliseconds(
    gpu: &Gpu,
    runs: usize,
    record: impl Fn(&mut subsurface::wgpu::CommandEncoder),
) -> f64 {
    gpu.run(&record);
    let time = |_| {
        let start = Instant::now();
        gpu.run(&record);
        start.elapsed().as_secs_f64() * 1e3
    };
    (0..runs).map(time).fold(f64::MAX, f64::min)
}
