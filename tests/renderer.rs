//! The whole way from a head to both modes' layers, by the renderer that plays the host.

use subsurface::wgpu::TextureView;
use subsurface::{Plan, Profile, TextureSpace};
use subsurface_lab::renderer::{AtlasRenderer, Camera, Layer, Lighting, Renderer, Scene, View};
use subsurface_lab::synthetic::{gpu, ours};
use subsurface_lab::{Error, method};
const SIZE: [u32; 2] = [256, 256];

struct Head {
    renderer: Renderer,
    camera: Camera,
}

fn render(scene: &Scene) -> Head {
    let renderer = Renderer::new(gpu(), scene, SIZE).unwrap();
    let camera = Camera::framing(scene, View::Front, SIZE);
    renderer.render(gpu(), &camera, &Lighting::default(), 1000.0).unwrap();
    Head { renderer, camera }
}

fn screen_space(head: &Head) -> TextureView {
    let output = head.renderer.scattered_target(gpu());
    let format = output.texture().format();
    let plan = Plan::exact(&[Profile::SKIN]).unwrap();
    let frame = head.renderer.gbuffer.frame(head.camera.projection(SIZE), 1000.0);
    method::scatter(gpu(), &mut ours(&plan, format), &frame, &output).unwrap();
    output
}

/// Texture space, into `output`.
fn scatter_texture(head: &Head, size: u32, output: &TextureView) -> Result<(), Error> {
    let format = output.texture().format();
    let mut effect = TextureSpace::new(&gpu().device, format, &[Profile::SKIN])?;
    let atlas = AtlasRenderer::new(gpu(), &head.renderer, size)?;
    atlas.render(gpu(), &head.renderer, 1, 1000.0, output, |atlas, output| {
        method::scatter_atlas(gpu(), &mut effect, atlas, output)
    })?;
    Ok(())
}

#[test]
fn both_modes_agree_better_than_with_no_scattering() {
    let scene = Scene::from_glb(subsurface_lab::HEAD).unwrap();
    let head = render(&scene);
    let screen = gpu().read(&screen_space(&head));
    let output = head.renderer.scattered_target(gpu());
    scatter_texture(&head, 1024, &output).unwrap();
    let texture = gpu().read(&output);
    let none = gpu().read(&head.renderer.gbuffer.irradiance);
    let skin = gpu().read_bytes(head.renderer.gbuffer.profile_id.texture());

    let width = SIZE[0] as i64;
    // Not on the rim of two pixels, where a pixel is half skin.
    let inner = |i: usize| {
        let (x, y) = (i as i64 % width, i as i64 / width);
        let around = |d: i64| (x + d % 5 - 2, y + d / 5 - 2);
        (0..25).map(around).all(|(x, y)| {
            let inside = (0..width).contains(&x) && (0..width).contains(&y);
            !inside || skin[(y * width + x) as usize] == 1
        })
    };
    let (mut from_screen, mut from_none, mut sums) = (0.0, 0.0, [0.0f64; 3]);
    for i in (0..skin.len()).filter(|&i| inner(i)) {
        for c in 0..3 {
            from_screen += f64::from(screen[i][c] - texture[i][c]).powi(2);
            from_none += f64::from(none[i][c] - texture[i][c]).powi(2);
            for (sum, layer) in sums.iter_mut().zip([&none, &screen, &texture]) {
                *sum += f64::from(layer[i][c]);
            }
        }
    }
    let ratio = (from_screen / from_none).sqrt();
    println!("screen space {ratio:.3} of what no scattering differs; sums {sums:?}");
    // .6 is what the two modes have to reach at twice the size; at this one fewer kernels are
    // wider than a pixel, and both are closer to no scattering.
    assert!(ratio <= 0.75, "{ratio}");
    // Neither adds nor takes light.
    assert!((sums[1] / sums[0] - 1.0).abs() <= 0.02 && (sums[2] / sums[0] - 1.0).abs() <= 0.02);
    // What does not scatter is what it was, in both.
    for i in (0..skin.len()).filter(|&i| skin[i] == 0) {
        assert_eq!(none[i].map(f32::to_bits), screen[i].map(f32::to_bits));
        assert_eq!(none[i].map(f32::to_bits), texture[i].map(f32::to_bits));
    }
}

#[test]
fn a_mesh_without_uvs_scatters_in_screen_space_only() {
    let mut scene = Scene::from_glb(subsurface_lab::HEAD).unwrap();
    for primitive in &mut scene.primitives {
        primitive.pages.clear(); // as the loader leaves it where TEXCOORD_0 is missing
    }
    let head = render(&scene);
    let output = head.renderer.scattered_target(gpu());
    let error = scatter_texture(&head, 256, &output).unwrap_err().to_string();
    assert!(error.contains("no UVs") && error.contains("TEXCOORD_0"), "{error}");
    assert_ne!(gpu().read(&screen_space(&head)), gpu().read(&head.renderer.gbuffer.irradiance));
}

#[test]
fn the_picture_shows_a_lit_head() {
    let scene = Scene::from_glb(subsurface_lab::HEAD).unwrap();
    let head = render(&scene);
    let irradiance = &head.renderer.gbuffer.irradiance;
    let picture = head.renderer.compose(gpu(), irradiance, Layer::Picture, 1.0);
    let skin = gpu().read_bytes(head.renderer.gbuffer.profile_id.texture());
    let mean = |half: fn(usize) -> bool| {
        let pixels = (0..skin.len()).filter(|&i| skin[i] == 1 && half(i % SIZE[0] as usize));
        let (sum, n) = pixels.fold((0.0, 0.0), |(sum, n), i| (sum + f64::from(picture[i][0]), n + 1.0));
        sum / n
    };
    // The key light stands to the left.
    let (left, right) = (mean(|x| x < 100), mean(|x| x > 156));
    assert!(left > 1.5 * right && right > 10.0, "left {left}, right {right}");
}

#[test]
fn sizes_that_do_not_fit_are_named() {
    let scene = Scene::from_glb(subsurface_lab::HEAD).unwrap();
    for size in [[0, 10], [10, 0], [100_000, 10], [8192, 8192]] {
        let error = Renderer::new(gpu(), &scene, size).err().expect("refused");
        assert!(error.to_string().starts_with("size: "), "{error}");
    }
    let head = render(&scene);
    for size in [0, 100_000] {
        assert!(AtlasRenderer::new(gpu(), &head.renderer, size).is_err());
    }
}
