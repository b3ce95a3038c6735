//! The texture-space path against closed forms.

use glam::{DVec2, DVec3};
use subsurface::wgpu::TextureFormat;
use subsurface::{Atlas, AtlasView, Profile, TextureSpace};
use subsurface_lab::method::{self, OursUnrolled};
use subsurface_lab::synthetic::*;
use subsurface_lab::truth::closed_form::{scattered_cosine, scattered_step, step};

const FORMAT: TextureFormat = TextureFormat::Rgba32Float;

/// The path over an atlas.
fn scatter(size: u32, profile: &Profile, texel: impl Fn(DVec2) -> Texel) -> Vec<DVec3> {
    let mut path = OursUnrolled::new(&gpu().device, FORMAT, &[*profile]).unwrap();
    scatter_atlas(&mut path, FORMAT, size, texel).into_iter().map(rgb).collect()
}

/// Texels of triangles that are a line, a point, or two at one place have no area, and next to none.
#[test]
fn texels_without_area_are_numbers() {
    let forms: [fn(DVec2) -> DVec3; 4] = [
        |at| DVec3::new(at.x + at.y, 0.0, 0.0) * 0.1,
        |at| DVec3::new(at.x, 1e-7 * at.y, 0.0) * 0.1,
        |_| DVec3::ZERO,
        |at| DVec3::new(at.x.rem_euclid(4.0), at.y, 0.0) * 0.1,
    ];
    for (i, form) in forms.into_iter().enumerate() {
        for variance_mm2 in [0.0, 1e-12, 1e-4, 1.0, 1e6] {
            let even = |at: DVec2| Some((form(at), DVec3::splat(0.5)));
            let out = scatter(16, &single_gaussian(variance_mm2), even);
            for (at, e) in out.iter().enumerate() {
                // Even light stays, whatever the weights.
                let off = (*e - 0.5).abs().max_element();
                assert!(off < 1e-5, "form {i}, {variance_mm2} mm², texel {at}: {e}");
            }
        }
    }
}

#[test]
fn a_stretched_patch_matches_the_closed_form() {
    // mm per texel along u and v: square, stretched 2:1, and sheared.
    for (name, u, v) in [
        ("square", DVec2::new(0.15, 0.0), DVec2::new(0.0, 0.15)),
        ("2:1", DVec2::new(0.2, 0.0), DVec2::new(0.0, 0.1)),
        ("1:2, sheared", DVec2::new(0.1, 0.05), DVec2::new(0.08, 0.2)),
    ] {
        let size = 320;
        let place = |t: DVec2| (t.x - 160.0) * u + (t.y - 160.0) * v;
        for angle in [0.0, 27.0, 45.0, 90.0f64] {
            let across = DVec2::from_angle(angle.to_radians());
            let blur_mm2 = 0.04; // σ = .2 mm: a texel at its longest
            let out = scatter(size, &Profile::SKIN, |t| {
                let p = place(t);
                Some((p.extend(7.0), DVec3::splat(step(p.dot(across), blur_mm2))))
            });
            let mut errors = Vec::new();
            for (e, t) in out.iter().zip(texels(size)) {
                // Away from where the atlas's edge cuts the kernel.
                let margin = DVec2::new(9.6 / u.length(), 9.6 / v.length()) * 1.25;
                let inside = (t - 160.0).abs().cmplt(DVec2::splat(160.0) - margin).all();
                if inside {
                    let truth = scattered_step(place(t).dot(across), blur_mm2, &Profile::SKIN);
                    errors.push((*e - truth).abs().max_element());
                }
            }
            let worst = largest(errors);
            println!("{name}, edge at {angle}°: max error {worst:.5}");
            // One step of eight bits.
            assert!(worst <= 1.0 / 255.0 && worst > 0.0, "{name}, {angle}°: {worst}");
        }
    }
}

#[test]
fn a_sphere_matches_eq_7() {
    // The upper half, unrolled by its polar angle: texels shrink and shear all over.
    let (rho_mm, size) = (10.0, 256);
    let light = DVec3::new(1.0, 0.0, 1.0).normalize();
    let normal = |t: DVec2| {
        let d = (t - 128.0) / 120.0;
        let theta = d.length() * 1.9;
        (d.length() < 1.0).then(|| {
            let around = d.normalize_or(DVec2::X);
            (around * theta.sin()).extend(theta.cos())
        })
    };
    let truth = scattered_cosine(rho_mm, &Profile::SKIN);
    let out = scatter(size, &Profile::SKIN, |t| {
        normal(t).map(|n| (n * rho_mm, DVec3::splat(n.dot(light).max(0.0))))
    });
    let errors = out.iter().zip(texels(size)).filter_map(|(e, t)| {
        // The island ends at 109°; its edge cuts kernels up to 9.6 mm, or 55°, away.
        let n = normal(t).filter(|n| n.z > 55f64.to_radians().cos())?;
        Some(e.x - truth(n.dot(light)).x)
    });
    let red = rms(errors);
    println!("red RMS {red:.5}");
    // .0009 measured: unlike on the screen nothing is hidden, and what is left is the two passes on
    // a bent surface.
    assert!(red <= 0.0015, "{red}");
}

/// One effect, a view each: what the second prepares leaves the first as it is.
#[test]
fn two_atlases_share_a_submission() {
    let gpu = gpu();
    let lit = |t: DVec2| DVec3::splat(f64::from(u8::from(t.x > 16.0)));
    let [irradiance, positions] = &atlas(32, |t| Some((t.extend(0.0), lit(t))));
    let effect = TextureSpace::new(&gpu.device, FORMAT, &[Profile::SKIN]).unwrap();
    let scales = [1000.0, 200.0];
    let outputs = scales.map(|_| gpu.target("output", [32; 2], FORMAT));
    let together = {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut views = scales.map(|_| AtlasView::new());
        for ((view, output), mm_per_unit) in views.iter_mut().zip(&outputs).zip(scales) {
            let mut atlas = Atlas::new(irradiance, positions);
            atlas.mm_per_unit = mm_per_unit;
            view.prepare(&gpu.device, &gpu.queue, &effect, &atlas).unwrap();
            view.render(&mut encoder, output).unwrap();
        }
        gpu.queue.submit([encoder.finish()]);
        outputs.each_ref().map(|output| gpu.read(output))
    };
    // In turn, by one view.
    let mut alone = OursUnrolled { effect, view: AtlasView::new() };
    for ((output, expected), mm_per_unit) in outputs.iter().zip(&together).zip(scales) {
        let mut atlas = Atlas::new(irradiance, positions);
        atlas.mm_per_unit = mm_per_unit;
        method::scatter_atlas(gpu, &mut alone, &atlas, output).unwrap();
        assert_eq!(gpu.read(output), *expected, "{mm_per_unit}");
    }
    assert_ne!(together[0], together[1]);
}

#[test]
fn islands_are_dilated() {
    let size = 64;
    let inside = |t: DVec2| (t - 32.0).abs().max_element() < 16.0;
    let e = DVec3::new(0.3, 0.6, 0.9);
    let out = scatter(size, &Profile::SKIN, |t| inside(t).then(|| ((t * 0.2).extend(0.0), e)));
    for (found, t) in out.iter().zip(texels(size)) {
        let outside = (t - 32.0).abs().max_element() - 16.0;
        if outside < 4.0 {
            assert!((*found - e).abs().max_element() < 1e-5, "{t}: {found}");
        } else {
            assert_eq!(*found, DVec3::ZERO, "{t}");
        }
    }
}
