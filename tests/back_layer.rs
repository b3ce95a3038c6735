//! Light that comes through thin parts: the effect over the visible surface and the one behind it.

use glam::{DVec3, Vec3};
use subsurface::wgpu::TextureFormat;
use subsurface::{Plan, Profile, Viewport};
use subsurface_lab::method::{self, Ours};
use subsurface_lab::renderer::{BackRenderer, Camera, Lighting, Renderer, Scene, Sky, View as CameraView};
use subsurface_lab::synthetic::*;
use subsurface_lab::truth::closed_form::{scattered_cosine, through_slab};

const FULL: TextureFormat = TextureFormat::Rgba32Float;

fn exact() -> Plan {
    Plan::exact(&[Profile::SKIN]).unwrap()
}

/// The exact sum, and a plan at the default error.
fn both() -> [Plan; 2] {
    [exact(), Plan::skin()]
}

/// A slab seen from the front, of light on its near and far face; and the layer of the far one.
fn slab(thickness_mm: f64, light: [f64; 2]) -> [GBuffer; 2] {
    let view = View::orthographic([96; 2], 4.0);
    let face = |distance_mm: f64, light| {
        view.shoot(move |origin, ray| plane(DVec3::Z, distance_mm, |_| DVec3::splat(light))(origin, ray))
    };
    [face(300.0, light[0]), face(300.0 + thickness_mm, light[1])]
}

/// The largest difference of any channel over these pixels.
fn worst(out: &[[f32; 4]], pixels: &[usize], truth: impl Fn(usize) -> DVec3) -> f64 {
    let differences = pixels.iter().map(|i| (rgb(out[*i]) - truth(*i)).abs().max_element());
    largest(differences)
}

/// Pixels of skin.
fn skin(g: &GBuffer) -> Vec<usize> {
    g.pixels(|h| h.id == 1).iter().map(|(i, _)| *i).collect()
}

#[test]
fn even_light_on_all_sides_stays_even() {
    let view = View::perspective([160, 160], 30.0);
    let ball = [
        view.shoot(sphere(10.0, 60.0, |_| DVec3::ONE)),
        view.shoot(sphere_back(10.0, 60.0, |_| DVec3::ONE)),
    ];
    for [front, back] in [slab(2.0, [1.0; 2]), ball] {
        // Full floats throughout, and half floats between the passes of a plan.
        for (plan, at_most) in both().iter().zip([1e-4, 1e-3]) {
            let out = front.scatter_over(Some(&back), &mut ours(plan, FULL), |_| ());
            let error = worst(&out, &skin(&front), |_| DVec3::ONE);
            assert!(error <= at_most, "{error}");
        }
    }
}

#[test]
fn even_light_on_a_closed_head_stays_even() {
    let gpu = gpu();
    let size = [192; 2];
    let scene = Scene::from_glb(subsurface_lab::HEAD).unwrap();
    let renderer = Renderer::new(gpu, &scene, size).unwrap();
    let camera = Camera::framing(&scene, CameraView::Front, size);
    let mut sky = Sky([Vec3::ZERO; 9]);
    sky.0[0] = Vec3::ONE;
    let lighting = Lighting { lights: vec![], sky, ..Default::default() };
    renderer.render(gpu, &camera, &lighting, 1000.0).unwrap();
    let back = BackRenderer::new(gpu, &renderer);
    back.render(gpu, &renderer);
    let mut frame = renderer.gbuffer.frame(camera.projection(size), 1000.0);
    frame.back = Some(back.layer());
    let output = gpu.target("scattered", size, FULL);
    let ids = gpu.read_bytes(renderer.gbuffer.profile_id.texture());
    let skin: Vec<usize> = (0..ids.len()).filter(|i| ids[*i] == 1).collect();
    for plan in &both() {
        method::scatter(gpu, &mut ours(plan, FULL), &frame, &output).unwrap();
        let error = worst(&gpu.read(&output), &skin, |_| DVec3::ONE);
        assert!(!skin.is_empty() && error <= 0.001, "{error}");
    }
}

#[test]
fn a_slab_passes_what_eq_7_says() {
    for thickness_mm in [0.5, 1.5, 2.0, 4.0, 8.0] {
        let [front, back] = slab(thickness_mm, [0.0, 1.0]);
        let [_, through] = through_slab(thickness_mm, &Profile::SKIN);
        // A plan mixes Gaussians of other widths, which agree less on a gap than on an edge, and sums those of a
        // level as one: least where a gap is as wide as the narrow ones, 2 px.
        let planned = if thickness_mm < 1.0 { 0.025 } else { 0.01 };
        for (plan, at_most) in both().iter().zip([0.001, planned]) {
            let out = front.scatter_over(Some(&back), &mut ours(plan, FULL), |_| ());
            let error = worst(&out, &[48 * 96 + 48], |_| through);
            println!("{thickness_mm} mm: {error:.5} of {:.3}", through.x);
            assert!(error <= at_most, "{thickness_mm} mm: {error}");
        }
    }
}

#[test]
fn a_ball_lit_from_behind_is_that_of_eq_7() {
    let light = DVec3::new(0.6, 0.3, -0.74).normalize();
    let lit = move |normal: DVec3| DVec3::splat(normal.dot(light).max(0.0));
    let view = View::orthographic([96; 2], 4.0);
    let front = view.shoot(sphere(10.0, 300.0, lit));
    let back = view.shoot(sphere_back(10.0, 300.0, lit));
    let scattered = scattered_cosine(10.0, &Profile::SKIN);
    let truth = |i: usize| front.hits[i].map_or(DVec3::ZERO, |h| scattered(h.normal.dot(light)));
    // Without the outermost pixels, whose areas are guesses.
    let inner: Vec<usize> = front.pixels(|h| h.normal.z > 0.2).iter().map(|(i, _)| *i).collect();
    let mut exact = ours(&exact(), FULL);
    let visible = worst(&front.scatter_by(&mut exact, |_| ()), &inner, truth);
    let both = worst(&front.scatter_over(Some(&back), &mut exact, |_| ()), &inner, truth);
    println!("visible {visible:.4}, both {both:.4}");
    assert!(both <= 0.011 && both < 0.6 * visible, "visible {visible}, both {both}");
}

#[test]
fn what_is_far_behind_or_of_another_profile_changes_nothing() {
    for plan in &both() {
        nothing_changes(&mut ours(plan, FULL));
    }
}

fn nothing_changes(ours: &mut Ours) {
    let [front, mut far] = slab(40.0, [0.5, 1.0]);
    let alone = front.scatter_by(ours, |_| ());
    assert_eq!(front.scatter_over(Some(&far), ours, |_| ()), alone, "far behind");
    for hit in &mut far.hits {
        *hit = None;
    }
    assert_eq!(front.scatter_over(Some(&far), ours, |_| ()), alone, "nothing behind");
    let [_, mut other] = slab(1.0, [0.5, 1.0]);
    for hit in other.hits.iter_mut().flatten() {
        hit.id = 2;
    }
    assert_eq!(front.scatter_over(Some(&other), ours, |_| ()), alone, "another profile");
    // And again: a layer leaves nothing behind.
    let [_, near] = slab(1.0, [0.5, 1.0]);
    assert_ne!(front.scatter_over(Some(&near), ours, |_| ()), alone);
    assert_eq!(front.scatter_by(ours, |_| ()), alone, "the layer is gone");
}

#[test]
fn without_ids_of_its_own_a_back_is_of_the_pixels_profile() {
    let [front, back] = slab(1.5, [0.0, 1.0]);
    for plan in &both() {
        let mut ours = ours(plan, FULL);
        let with = front.scatter_over(Some(&back), &mut ours, |_| ());
        let without = front.scatter_over(Some(&back), &mut ours, |frame| {
            frame.back = frame.back.map(|back| subsurface::BackLayer::new(back.irradiance, back.depth));
        });
        assert_eq!(with, without);
    }
}

#[test]
fn a_viewport_holds_both_layers() {
    let [front, back] = slab(1.5, [0.0, 1.0]);
    let whole = front.scatter_over(Some(&back), &mut ours(&exact(), FULL), |_| ());
    let half = Viewport { x: 48, y: 0, width: 48, height: 96 };
    let out = front.scatter_over(Some(&back), &mut ours(&exact(), FULL), |frame| {
        frame.viewport = Some(half);
    });
    // An even slab does not tell where it ends, since each Gaussian is divided by its mass.
    let pixel = 48 * 96 + 72;
    let error = (rgb(out[pixel]) - rgb(whole[pixel])).abs().max_element();
    assert!(error <= 1e-4, "{error}");
    assert_eq!(out[0], [0.0; 4], "outside nothing is written");
}
