//! What an effect sees, drawn over a host's picture.

use subsurface::wgpu::TextureFormat;
use subsurface::{Error, Overlay, Plan, Profile, ScreenSpace, Show};
use subsurface_lab::renderer::{Camera, Lighting, Renderer, Scene, View};
use subsurface_lab::synthetic::gpu;

const SIZE: [u32; 2] = [256, 256];

/// The head under each overlay, over black: bytes of red, green, blue and alpha.
fn shown(mm_per_unit: f32) -> [Vec<[u8; 4]>; 4] {
    let gpu = gpu();
    let scene = Scene::from_glb(subsurface_lab::HEAD).unwrap();
    let renderer = Renderer::new(gpu, &scene, SIZE).unwrap();
    let camera = Camera::framing(&scene, View::Front, SIZE);
    renderer.render(gpu, &camera, &Lighting::default(), mm_per_unit).unwrap();
    let frame = renderer.gbuffer.frame(camera.projection(SIZE), mm_per_unit);
    let output = renderer.scattered_target(gpu);
    let format = output.texture().format();
    let effect = ScreenSpace::new(&gpu.device, format, &Plan::skin()).unwrap();
    let mut view = subsurface::View::new();
    view.prepare(&gpu.device, &gpu.queue, &effect, &frame).unwrap();
    gpu.run(|encoder| view.render(encoder, &output)).unwrap();
    let overlay = Overlay::new(&gpu.device, TextureFormat::Rgba8Unorm).unwrap();
    [Show::PxPerMm, Show::Level, Show::Class, Show::NoProfile].map(|show| {
        let target = gpu.target("picture", SIZE, TextureFormat::Rgba8Unorm);
        gpu.run(|encoder| overlay.render(&gpu.device, encoder, &view, show, &target)).unwrap();
        bytemuck::pod_collect_to_vec(&gpu.read_bytes(target.texture()))
    })
}

#[test]
fn a_head_of_the_wrong_size_is_seen_at_once() {
    // The middle of the forehead.
    let forehead = |pixels: &[[u8; 4]]| pixels[70 * SIZE[0] as usize + 128];
    let [metres, ..] = shown(1000.0);
    let [r, g, b, _] = forehead(&metres);
    assert!(g > r && g > b, "green at 0.9 px/mm: {r} {g} {b}");
    let [too_large, ..] = shown(100_000.0);
    let [r, g, b, _] = forehead(&too_large);
    assert!(b > r && b > g, "blue at 0.009 px/mm: {r} {g} {b}");
    let [too_small, ..] = shown(10.0);
    let [r, g, b, _] = forehead(&too_small);
    assert!(r > g && r > b, "red at 90 px/mm: {r} {g} {b}");
}

#[test]
fn overlays_say_what_is_done() {
    let pictures = shown(1000.0);
    if let Ok(directory) = std::env::var("PICTURES") {
        for (name, pixels) in ["px_per_mm", "level", "class", "no_profile"].iter().zip(&pictures) {
            let bytes = pixels.iter().flat_map(|p| [p[0], p[1], p[2]]).collect();
            let picture = image::RgbImage::from_raw(SIZE[0], SIZE[1], bytes).unwrap();
            picture.save(format!("{directory}/{name}.png")).unwrap();
        }
    }
    let [_, level, class, no_profile] = &pictures;
    let count = |pixels: &[[u8; 4]], is: fn(&[u8; 4]) -> bool| pixels.iter().filter(|p| is(p)).count();
    let skin = count(no_profile, |p| p[1] > 0);
    // A front of the head, of about the third of a frame.
    assert!((15_000..40_000).contains(&skin), "{skin}");
    // Every pixel of skin is of some class, and has some level.
    let planar = count(class, |[r, g, _, _]| *r < 40 && *g > 60);
    let direct = count(class, |[r, g, _, _]| *r > 100 && *g < 40);
    println!("{planar} planar, {direct} direct");
    assert_eq!(planar + direct, skin);
    assert!(direct < skin / 5, "{planar} {direct}");
    assert_eq!(count(level, |p| p[0] > 0 || p[1] > 0 || p[2] > 0), skin);
}

#[test]
fn only_a_plan_can_be_shown() {
    let gpu = gpu();
    let overlay = Overlay::new(&gpu.device, TextureFormat::Rgba8Unorm).unwrap();
    let target = gpu.target("picture", SIZE, TextureFormat::Rgba8Unorm);
    let render = |view: &subsurface::View| {
        gpu.run(|encoder| overlay.render(&gpu.device, encoder, view, Show::Class, &target))
    };
    let mut view = subsurface::View::new();
    assert_eq!(render(&view), Err(Error::NotPrepared));
    let half = TextureFormat::Rgba16Float;
    let exact = Plan::exact(&[Profile::SKIN]).unwrap();
    let effect = ScreenSpace::new(&gpu.device, half, &exact).unwrap();
    let light = gpu.target("light", SIZE, half);
    let depth = gpu.target("depth", SIZE, TextureFormat::Depth32Float);
    let projection = subsurface_lab::synthetic::View::perspective(SIZE, 40.0).projection;
    let frame = subsurface::Frame::new(&light, &depth, projection.as_mat4().to_cols_array_2d());
    view.prepare(&gpu.device, &gpu.queue, &effect, &frame).unwrap();
    assert_eq!(render(&view), Err(Error::NoPyramid));
}
