//! The whole way from a head to both modes' layers, by the renderer that plays the host.

use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

use glam::DVec3;
use subsurface::wgpu::{TextureFormat, TextureView};
use subsurface::{Plan, Profile};
use subsurface_lab::renderer::{
    AtlasRenderer, BrdfTables, Camera, Environment, Gpu, Layer, Lighting, Renderer, Scene, Specular, View,
};
use subsurface_lab::synthetic::{gpu, ours};
use subsurface_lab::{
    Error,
    method::{self, OursUnrolled},
};
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
    let mut effect = OursUnrolled::new(&gpu().device, format, &[Profile::SKIN])?;
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

/// Directional albedo of a model: without Fresnel, by slope and cosine.
fn albedo(model: Specular) -> Vec<Vec<f32>> {
    let target = gpu().target("albedo", BrdfTables::ALBEDO_SIZE, TextureFormat::Rgba16Float);
    BrdfTables::new(gpu()).draw_albedo(gpu(), model, &target);
    let texels = gpu().read(&target);
    let rows = texels.chunks(BrdfTables::ALBEDO_SIZE[0] as usize);
    rows.map(|row| row.iter().map(|t| t[0] + t[1]).collect()).collect()
}

#[test]
fn no_surface_reflects_more_than_it_gets() {
    for model in Specular::ALL {
        let table = albedo(model);
        let most = table.iter().flatten().fold(0.0, |most: f32, a| most.max(*a));
        println!("{}: {most:.3}", model.name());
        match model {
            // For want of Fresnel and of the 4 of the half vector's solid angle: 4/π, less what goes down.
            Specular::Printed => assert!(most > 1.2),
            // Half floats, and sums of 2048 directions.
            _ => assert!(most < 1.005, "{}: {most}", model.name()),
        }
    }
    // Smooth facets seen from above reflect all that comes, straight back.
    for model in [Specular::Kelemen, Specular::Beckmann, Specular::Ggx] {
        let smooth = albedo(model)[0][BrdfTables::ALBEDO_SIZE[0] as usize - 1];
        assert!((smooth - 1.0).abs() < 0.01, "{}: {smooth}", model.name());
    }
}

#[test]
fn lobes_and_directional_albedo_are_of_one_function() {
    // Light from 0°: the model depends on the angle alone, so that the lobe is all there is to sum, and what is
    // reflected of a beam from above is what is seen of an even sky from there.
    const SLOPE_ROW: usize = 8;
    let [width, height] = BrdfTables::ALBEDO_SIZE.map(|s| s as usize);
    let slope = (SLOPE_ROW as f32 + 0.5) / height as f32;
    let target = gpu().target("lobes", BrdfTables::LOBES_SIZE, TextureFormat::Rgba16Float);
    for model in [Specular::BlinnPhong, Specular::Ggx, Specular::Beckmann] {
        BrdfTables::new(gpu()).draw_lobes(gpu(), model, slope, 1.0, &target);
        let lobe = gpu().read(&target);
        let count = BrdfTables::LOBES_SIZE[0] as usize;
        let step = std::f32::consts::PI / count as f32;
        // f·cos θₒ, of both sides of the plane.
        let sum: f32 = (0..count)
            .map(|i| {
                let angle = ((i as f32 + 0.5) / count as f32 - 0.5) * std::f32::consts::PI;
                lobe[i][0] * angle.sin().abs() * std::f32::consts::PI * step
            })
            .sum();
        let expected = albedo(model)[SLOPE_ROW][width - 1];
        // The table's last column is of 10° from above.
        assert!((sum / expected - 1.0).abs() < 0.02, "{}: {sum} {expected}", model.name());
    }
}

#[test]
fn a_table_of_albedo_is_the_integral() {
    // GGX from near the surface, where Schlick's term is large: (f, f·(1 − v·h)⁵), over the hemisphere in steps.
    let [width, height] = BrdfTables::ALBEDO_SIZE.map(f64::from);
    let (column, row) = (4, 5);
    let (n_v, m2) = ((column as f64 + 0.5) / width, ((row as f64 + 0.5) / height).powi(2));
    let v = DVec3::new((1.0 - n_v * n_v).sqrt(), 0.0, n_v);
    let (rings, sectors) = (600, 300);
    let mut expected = [0.0; 2];
    for i in 0..rings * sectors {
        let theta = ((i / sectors) as f64 + 0.5) / rings as f64 * FRAC_PI_2;
        let phi = ((i % sectors) as f64 + 0.5) / sectors as f64 * PI;
        let l = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        let h = (l + v).normalize();
        let d = m2 / (PI * (1.0 - h.z * h.z * (1.0 - m2)).powi(2));
        let shadow = |a: f64, b: f64| a * (b * b * (1.0 - m2) + m2).sqrt();
        let f = d * 0.5 / (shadow(n_v, l.z) + shadow(l.z, n_v)) * l.z;
        let share = f * theta.sin() * FRAC_PI_2 / rings as f64 * 2.0 * PI / sectors as f64;
        let schlick = (1.0 - v.dot(h)).powi(5);
        expected[0] += share * (1.0 - schlick);
        expected[1] += share * schlick;
    }
    let target = gpu().target("albedo", BrdfTables::ALBEDO_SIZE, TextureFormat::Rgba16Float);
    BrdfTables::new(gpu()).draw_albedo(gpu(), Specular::Ggx, &target);
    let texel = gpu().read(&target)[row * width as usize + column];
    for (got, expected) in texel.into_iter().zip(expected) {
        // What 2048 directions leave.
        assert!((f64::from(got) - expected).abs() < 0.005, "{texel:?} is not {expected}");
    }
}

#[test]
fn a_turning_environment_allocates_nothing() {
    // A device of its own, whose counts are of nobody else.
    let gpu = &Gpu::headless().unwrap();
    let scene = Scene::from_glb(subsurface_lab::HEAD).unwrap();
    let mut renderer = Renderer::new(gpu, &scene, SIZE).unwrap();
    let studio = Environment::studio();
    renderer.set_environment(gpu, &studio);
    let camera = Camera::framing(&scene, View::Front, SIZE);
    let mut lighting = Lighting::default();
    let mut turned = |share: f32| {
        studio.light(&mut lighting, share * std::f32::consts::TAU);
        renderer.render(gpu, &camera, &lighting, 1000.0).unwrap();
        gpu.run(|_| ()); // what was dropped goes
        let counters = gpu.device.get_internal_counters().hal;
        [&counters.buffers, &counters.textures, &counters.texture_views, &counters.bind_groups]
            .map(|counter| counter.read())
    };
    turned(0.0);
    let first = turned(0.0);
    for i in 1..8 {
        assert_eq!(turned(i as f32 / 8.0), first);
    }
    // It is seen, reflected, and moves.
    let g = &renderer.gbuffer;
    let [here, light] = [gpu.read(&g.specular), gpu.read(&g.irradiance)];
    turned(0.5);
    let [there, other] = [gpu.read(&g.specular), gpu.read(&g.irradiance)];
    let corner = here[0];
    assert!(corner[3] == 1.0 && corner[0] > 0.0, "{corner:?}");
    assert!(here != there && light != other);
}

#[test]
fn a_file_lights_the_side_that_it_says() {
    // Radiance's format, flat: a pixel of 64, the rest 1/8. The middle is what the camera looks at.
    let [width, height] = [32, 16];
    let file = |column: usize| {
        let mut bytes =
            format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
        for i in 0..width * height {
            let exponent = if i == (height / 2 - 1) * width + column { 135 } else { 126 };
            bytes.extend([128, 128, 128, exponent]);
        }
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("side-{column}.hdr"));
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let scene = Scene::from_glb(subsurface_lab::HEAD).unwrap();
    let mut renderer = Renderer::new(gpu(), &scene, SIZE).unwrap();
    let camera = Camera::framing(&scene, View::Front, SIZE);
    let mut sides = |column: usize| {
        let environment = Environment::named(file(column).to_str().unwrap()).unwrap();
        let mut lighting = Lighting::default();
        renderer.set_environment(gpu(), &environment);
        environment.light(&mut lighting, 0.0);
        renderer.render(gpu(), &camera, &lighting, 1000.0).unwrap();
        let g = &renderer.gbuffer;
        let skin = gpu().read_bytes(g.profile_id.texture());
        // Left and right, of light and of reflection.
        [&g.irradiance, &g.specular].map(|light| {
            let mut sums = [0.0f32; 2];
            let pixels = gpu().read(light).into_iter().zip(&skin).enumerate();
            for (i, (light, _)) in pixels.filter(|(_, (_, skin))| **skin == 1) {
                sums[i % SIZE[0] as usize / (SIZE[0] as usize / 2)] += light[0];
            }
            sums
        })
    };
    // +X is to the right of the head's picture.
    for [left, right] in sides(3 * width / 4) {
        assert!(right > 2.0 * left && left > 0.0, "left {left}, right {right}");
    }
    for [left, right] in sides(width / 4) {
        assert!(left > 2.0 * right && right > 0.0, "left {left}, right {right}");
    }
}

#[test]
fn a_frame_of_light_that_turns_is_that_of_light_at_rest() {
    let scene = Scene::from_glb(subsurface_lab::HEAD).unwrap();
    let renderer = Renderer::new(gpu(), &scene, SIZE).unwrap();
    let camera = Camera::framing(&scene, View::Front, SIZE);
    let studio = Environment::studio();
    let output = renderer.scattered_target(gpu());
    let new = || ours(&Plan::skin(), output.texture().format());
    let mut lighting = Lighting::default();
    let mut scattered = |by: &mut method::Ours, share: f32| {
        studio.light(&mut lighting, share * std::f32::consts::TAU);
        renderer.render(gpu(), &camera, &lighting, 1000.0).unwrap();
        let frame = renderer.gbuffer.frame(camera.projection(SIZE), 1000.0);
        method::scatter(gpu(), by, &frame, &output).unwrap();
        gpu().read(&output)
    };
    let mut turning = new();
    let frames = [0.0, 0.2, 0.6].map(|share| scattered(&mut turning, share));
    assert!(frames[0] != frames[1] && frames[1] != frames[2]);
    assert!(frames[2] == scattered(&mut new(), 0.6), "the effect remembers");
}
