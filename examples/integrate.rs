//! The smallest host: hands a frame to the effect in screen space and an atlas to the one in texture space,
//! and reads both results back. Choosing the mode is choosing which of them a final pass samples.
//!
//! All inputs are made up on the CPU: a plane lit on its right half, and, for light from behind, another face
//! 2 mm behind it that is lit on its left half. A renderer hands over the textures that it has. What a host
//! writes is `struct Skin` or `struct SkinAtlas`, and their functions.

use glam::Mat4;
use subsurface::wgpu::{CommandEncoder, Device, Queue, TextureFormat, TextureView};
use subsurface::{
    Atlas, AtlasView, BackLayer, Error, Frame, Plan, Profile, ScreenSpace, TextureSpace, View,
};
use subsurface_lab::renderer::Gpu;

/// What the deferred renderer has by the time its diffuse light is done.
struct GBuffer {
    irradiance: TextureView,
    depth: TextureView,
    profile_id: TextureView,
    projection: Mat4,
    /// Irradiance and depth of the skin right behind what is seen; optional.
    back: Option<[TextureView; 2]>,
}

// The integration, as README.md shows it.
struct Skin {
    effect: ScreenSpace, // shared by all cameras
    view: View,          // one for each camera
}

impl Skin {
    fn new(device: &Device) -> Result<Self, Error> {
        let effect = ScreenSpace::new(device, TextureFormat::Rgba16Float, &Plan::skin())?;
        let view = View::new();
        Ok(Self { effect, view })
    }

    /// After lighting, before specular and tone mapping.
    fn scatter(
        &mut self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        g: &GBuffer,
        scattered: &TextureView,
    ) -> Result<(), Error> {
        let mut frame = Frame::new(&g.irradiance, &g.depth, g.projection.to_cols_array_2d());
        frame.profile_id = Some(&g.profile_id); // 1 on skin, 0 elsewhere
        frame.mm_per_unit = 1000.0; // a scene in metres
        let back = g.back.as_ref(); // for light from behind: ears, nostrils, fingers
        frame.back = back.map(|[irradiance, depth]| BackLayer::new(irradiance, depth));
        self.view.prepare(device, queue, &self.effect, &frame)?;
        self.view.render(encoder, scattered)
    }
}

/// What it has by the time it has drawn the head into its atlas, by `TextureSpace::VERTEX_WGSL`.
struct Unrolled {
    irradiance: TextureView,
    positions: TextureView,
}

// The integration in texture space.
struct SkinAtlas {
    effect: TextureSpace, // shared by all atlases
    view: AtlasView,      // one for each atlas of a submission
}

impl SkinAtlas {
    fn new(device: &Device) -> Result<Self, Error> {
        let effect = TextureSpace::new(device, TextureFormat::Rgba16Float, &[Profile::SKIN])?;
        Ok(Self { effect, view: AtlasView::new() })
    }

    /// After the atlas is lit, before the head is drawn with what comes out.
    fn scatter(
        &mut self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        unrolled: &Unrolled,
        scattered: &TextureView,
    ) -> Result<(), Error> {
        // Positions in metres, and 1 where there is skin.
        let atlas = Atlas::new(&unrolled.irradiance, &unrolled.positions);
        self.view.prepare(device, queue, &self.effect, &atlas)?;
        self.view.render(encoder, scattered)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let gpu = Gpu::headless()?;
    let [frame, lit_from_behind] = [false, true].map(|has_back| made_up_frame(&gpu, has_back));
    let unrolled = made_up_atlas(&gpu);
    let [on_screen, on_atlas, through] = ["scattered", "scattered atlas", "scattered through"]
        .map(|name| gpu.target(name, SIZE, TextureFormat::Rgba16Float));
    let mut skin = Skin::new(&gpu.device)?;
    // A view for each frame of a submission.
    let mut thin_skin = Skin { effect: skin.effect.clone(), view: View::new() };
    let mut atlas = SkinAtlas::new(&gpu.device)?;
    let (device, queue) = (&gpu.device, &gpu.queue);
    let mut encoder = device.create_command_encoder(&Default::default());
    skin.scatter(device, queue, &mut encoder, &frame, &on_screen)?;
    thin_skin.scatter(device, queue, &mut encoder, &lit_from_behind, &through)?;
    atlas.scatter(device, queue, &mut encoder, &unrolled, &on_atlas)?;
    queue.submit([encoder.finish()]);

    let screen = gpu.read(&on_screen);
    let texture = gpu.read(&on_atlas);
    let through = gpu.read(&through);
    println!("        screen space         texture space        lit from behind, too");
    println!("   mm   red  green   blue    red  green   blue    red  green   blue");
    let [width, _] = SIZE.map(|s| s as usize);
    for x in (width / 2 - 12..width / 2 + 12).step_by(2) {
        let mm = (x as f32 + 0.5 - width as f32 / 2.0) / PX_PER_MM;
        let ([r, g, b, _], [s, t, u, _], [v, w, z, _]) = (screen[x], texture[x], through[x]);
        println!("{mm:5.2} {r:6.3} {g:6.3} {b:6.3} {s:6.3} {t:6.3} {u:6.3} {v:6.3} {w:6.3} {z:6.3}");
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

/// A plane half a metre away, and maybe its back.
fn made_up_frame(gpu: &Gpu, has_back: bool) -> GBuffer {
    let count = (SIZE[0] * SIZE[1]) as usize;
    let half = SIZE.map(|s| s as f32 / PX_PER_MM / 2000.0);
    let dark: Vec<[f32; 4]> = light().iter().map(|e| e.map(|c| 1.0 - c)).collect();
    let back = || {
        let light = gpu.upload("irradiance of the back", SIZE, TextureFormat::Rgba32Float, &dark);
        [light, gpu.upload("depth of the back", SIZE, TextureFormat::R32Float, &vec![0.502f32; count])]
    };
    GBuffer {
        back: has_back.then(back),
        irradiance: gpu.upload("irradiance", SIZE, TextureFormat::Rgba32Float, &light()),
        depth: gpu.upload("depth", SIZE, TextureFormat::R32Float, &vec![0.5f32; count]),
        profile_id: gpu.upload("profile id", SIZE, TextureFormat::R8Uint, &vec![1u8; count]),
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
    }
}
