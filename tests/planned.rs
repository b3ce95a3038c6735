//! Scattering by a plan against closed forms, and against what the plan states.

use std::sync::OnceLock;

use glam::{DVec2, DVec3};
use subsurface::wgpu::TextureFormat;
use subsurface::{Error, Frame, Plan, Profile};
use subsurface_lab::method::{self, Ours};
use subsurface_lab::synthetic::*;
use subsurface_lab::truth::closed_form::{scattered_cosine, scattered_step, step};

/// Plans of the skin profile at 1/100 and 1/255.
fn plans() -> &'static [Plan; 2] {
    static PLANS: OnceLock<[Plan; 2]> = OnceLock::new();
    PLANS.get_or_init(|| {
        [100.0, 255.0].map(|steps: f32| Plan::new(&[Profile::SKIN], steps.recip()).unwrap())
    })
}

fn rgb(pixel: [f32; 4]) -> DVec3 {
    DVec3::new(pixel[0].into(), pixel[1].into(), pixel[2].into())
}

/// The largest error on an edge at an angle that is soft by a pixel, away from the picture's border.
fn edge_error(plan: &Plan, px_per_mm: f64, angle: f64) -> f64 {
    // What the border cuts from a kernel is not the closed form's.
    const REACH_MM: f64 = 9.6;
    let view = View::orthographic([400, 400], px_per_mm);
    let across = DVec3::new(angle.to_radians().cos(), angle.to_radians().sin(), 0.0);
    let blur_mm2 = px_per_mm.powi(-2);
    let g = view.shoot(plane(DVec3::Z, 300.0, |p| DVec3::splat(step(p.dot(across), blur_mm2))));
    let out = g.scatter_planned(plan);
    let half = DVec2::splat(200.0 / px_per_mm - REACH_MM);
    let inside = g.pixels(|h| h.point.truncate().abs().cmplt(half).all());
    let errors = inside.iter().map(|(i, hit)| {
        let truth = scattered_step(hit.point.dot(across), blur_mm2, &Profile::SKIN);
        (rgb(out[*i]) - truth).abs().max_element()
    });
    errors.fold(0.0, f64::max)
}

#[test]
fn soft_edges_keep_the_error_that_was_asked_for() {
    for plan in plans() {
        for px_per_mm in [0.5, 1.0, 2.0, 4.0, 12.0] {
            for angle in [0.0, 27.0, 45.0, 90.0] {
                let error = edge_error(plan, px_per_mm, angle);
                let max_error = f64::from(plan.max_error());
                println!("{max_error:.5} asked, {px_per_mm} px/mm, {angle}°: {error:.5}");
                assert!(error <= max_error, "{px_per_mm} px/mm, {angle}°: {error}");
            }
        }
    }
}

#[test]
fn hard_edges_keep_it_too() {
    let plan = &plans()[1];
    for px_per_mm in [1.5, 4.0, 8.0] {
        for angle in [0.0, 27.0, 45.0, 90.0f64] {
            let across = DVec3::new(angle.to_radians().cos(), angle.to_radians().sin(), 0.0);
            let g = View::orthographic([300, 300], px_per_mm)
                .shoot(plane(DVec3::Z, 300.0, |p| DVec3::splat(step(p.dot(across), 0.0))));
            let out = g.scatter_planned(plan);
            let out: Vec<DVec3> = out.into_iter().map(rgb).collect();
            // Across the middle of the edge, far from the picture's border.
            let along = DVec3::new(-across.y, across.x, 0.0);
            let near = |h: &Hit| {
                h.point.dot(along).abs() < 1.0 / px_per_mm && h.point.dot(across).abs() < 8.0 / px_per_mm
            };
            let pixels: Vec<usize> = g.pixels(near).iter().map(|(i, _)| *i).collect();
            let errors = g.errors(&out, &pixels);
            let error = errors.iter().map(|e| e.abs().max_element()).fold(0.0, f64::max);
            println!("hard, {px_per_mm} px/mm, {angle}°: {error:.5}");
            assert!(error <= f64::from(plan.max_error()), "{px_per_mm} px/mm, {angle}°: {error}");
        }
    }
}

/// Errors on a soft edge at places in mm from it, under a camera that looks at `center_mm`.
fn errors_at(
    effect: &mut Ours,
    view: View,
    px_per_mm: f64,
    center_mm: f64,
    blur_mm2: f64,
    places_mm: &[f64],
) -> Vec<DVec3> {
    let g = view.shoot(plane(DVec3::Z, 300.0, |p| DVec3::splat(step(p.x + center_mm, blur_mm2))));
    let out = g.scatter_by(effect, |_| ());
    let [width, height] = view.size.map(|s| s as usize);
    let row = &out[height / 2 * width..][..width];
    let error = |x: usize| {
        let mm = (x as f64 + 0.5 - width as f64 / 2.0) / px_per_mm + center_mm;
        rgb(row[x]) - scattered_step(mm, blur_mm2, &Profile::SKIN)
    };
    let at = |mm: &f64| {
        let x = (mm - center_mm) * px_per_mm + width as f64 / 2.0 - 0.5;
        error(x as usize).lerp(error(x as usize + 1), x.fract())
    };
    places_mm.iter().map(at).collect()
}

#[test]
fn a_moving_camera_does_not_make_skin_flicker() {
    let mut effect = ours(&plans()[1], TextureFormat::Rgba32Float);
    // By fractions of a pixel over what the coarse levels repeat after.
    for px_per_mm in [1.5, 4.0, 8.0] {
        let blur_mm2 = f64::powi(px_per_mm, -2);
        let places: Vec<f64> = (-20..=20).map(|i| 0.25 * f64::from(i)).collect();
        let mut low = vec![DVec3::INFINITY; places.len()];
        let mut high = vec![DVec3::NEG_INFINITY; places.len()];
        for frame in 0..48 {
            let moved_mm = 0.37 * f64::from(frame) / px_per_mm;
            let view = View::orthographic([400, 16], px_per_mm);
            let errors = errors_at(&mut effect, view, px_per_mm, moved_mm, blur_mm2, &places);
            for (i, error) in errors.iter().enumerate() {
                low[i] = low[i].min(*error);
                high[i] = high[i].max(*error);
            }
        }
        let swings = low.iter().zip(&high).map(|(l, h)| (*h - *l).max_element());
        let worst = swings.fold(0.0, f64::max);
        println!("{px_per_mm} px/mm: {worst:.5} from peak to peak");
        assert!(worst <= 1.0 / 255.0, "{px_per_mm} px/mm: {worst}");
    }
}

#[test]
fn zooming_in_goes_without_steps() {
    let mut effect = ours(&plans()[1], TextureFormat::Rgba32Float);
    // From .3 to 30 px/mm in 200 steps, the light soft by a pixel of the first.
    let blur_mm2 = f64::powi(0.3, -2);
    let places: Vec<f64> = (-8..=8).map(|i| 0.5 * f64::from(i)).collect();
    let mut before: Option<Vec<DVec3>> = None;
    let mut worst: f64 = 0.0;
    for frame in 0..=200 {
        let px_per_mm = 0.3 * f64::powf(100.0, f64::from(frame) / 200.0);
        let view = View::orthographic([1024, 8], px_per_mm);
        let errors = errors_at(&mut effect, view, px_per_mm, 0.0, blur_mm2, &places);
        for (now, before) in errors.iter().zip(before.iter().flatten()) {
            worst = worst.max((*now - *before).abs().max_element());
        }
        before = Some(errors);
    }
    println!("{worst:.5} from one frame to the next");
    assert!(worst <= 1.0 / 255.0, "{worst}");
}

#[test]
fn slopes_keep_it_while_they_are_not_steep() {
    // The largest error at 30°, and RMS: detail of a pixel across the contour falls between the taps
    // of a steep slope (docs/method.md).
    for (tilt, axis, most) in [
        (30.0, 20.0f64, 1.0 / 255.0),
        (60.0, 0.0, 0.004),
        (60.0, 45.0, 0.004),
        (80.0, 0.0, 0.01),
        (80.0, 20.0, 0.01),
    ] {
        let px_per_mm = 4.0;
        let view = View::orthographic([320, 320], px_per_mm);
        let normal = tilted_normal(tilt, axis);
        let along = DVec3::new(axis.to_radians().cos(), axis.to_radians().sin(), 0.0);
        let down = normal.cross(along);
        for edge in [0.0, 45.0, 90.0f64] {
            let (sin, cos) = edge.to_radians().sin_cos();
            let across = along * cos + down * sin;
            // A pixel is 1/cos(tilt) long down the slope.
            let footprint = DVec2::new(cos, sin / tilt.to_radians().cos()).length() / px_per_mm;
            let blur_mm2 = footprint * footprint;
            let anchor = DVec3::new(0.0, 0.0, -500.0);
            let g = view.shoot(plane(normal, 500.0, |p| DVec3::splat(step(p.dot(across), blur_mm2))));
            let out = g.scatter_planned(&plans()[1]);
            let half = DVec2::splat(160.0 / px_per_mm - 9.6);
            let near = |h: &Hit| (h.point - anchor).dot(across).abs() < 6.0;
            let pixels = g.pixels(|h| h.point.truncate().abs().cmplt(half).all() && near(h));
            let errors: Vec<f64> = pixels
                .iter()
                .map(|(i, h)| {
                    let place = (h.point - anchor).dot(across);
                    let truth = scattered_step(place, blur_mm2, &Profile::SKIN);
                    (rgb(out[*i]) - truth).abs().max_element()
                })
                .collect();
            let worst = errors.iter().copied().fold(0.0, f64::max);
            let rms = rms(errors);
            println!("tilt {tilt}° about {axis}°, edge at {edge}°: {worst:.5}, RMS {rms:.5}");
            let error = if tilt < 45.0 { worst } else { rms };
            assert!(error <= most, "{tilt}° about {axis}°, edge {edge}°: {worst}, {rms}");
        }
    }
}

#[test]
fn hard_edges_down_a_slope_are_off_by_no_more_than_the_docs_say() {
    // Taps of a slope lie further apart along its contour, or the Gaussian is cut off: an edge that is as
    // sharp as a pixel and runs down the slope sees both.
    for (tilt, most) in [(30.0, 2.0 / 255.0), (60.0, 0.025)] {
        for px_per_mm in [2.0, 4.0, 8.0] {
            let view = View::orthographic([256, 256], px_per_mm);
            let g = view.shoot(plane(tilted_normal(tilt, 0.0), 500.0, |p| DVec3::splat(step(p.x, 0.0))));
            let out = g.scatter_planned(&plans()[1]);
            let out: Vec<DVec3> = out.into_iter().map(rgb).collect();
            let middle = |h: &Hit| h.point.y.abs() < 1.0 / px_per_mm && h.point.x.abs() < 8.0 / px_per_mm;
            let pixels: Vec<usize> = g.pixels(middle).iter().map(|(i, _)| *i).collect();
            assert!(pixels.len() > 16);
            let errors = g.errors(&out, &pixels);
            let error = errors.iter().map(|e| e.abs().max_element());
            let error = error.fold(0.0, f64::max);
            println!("hard, down a slope of {tilt}°, {px_per_mm} px/mm: {error:.5}");
            assert!(error <= most, "{tilt}°, {px_per_mm} px/mm: {error}");
        }
    }
}

#[test]
fn a_sphere_is_as_near_to_eq_7_as_the_docs_say() {
    let rho_mm = 10.0;
    let light = DVec3::new(1.0, 0.0, 1.0).normalize();
    let truth = scattered_cosine(rho_mm, &Profile::SKIN);
    let view = View::orthographic([88, 88], 4.0);
    let g = view.shoot(sphere(rho_mm, 300.0, |n| DVec3::splat(n.dot(light).max(0.0))));
    let out = g.scatter_planned(&plans()[1]);
    let inside = g.pixels(|h| h.normal.z > 0.35);
    let error = rms(inside.iter().map(|(i, h)| rgb(out[*i]).x - truth(h.normal.dot(light)).x));
    println!("red RMS {error:.5} where n_z > .35");
    assert!(error <= 0.004, "{error}");
}

#[test]
fn layers_leak_no_more_than_the_docs_say() {
    // A coarse pixel keeps one surface.
    for (gap_mm, most) in [(2.0, 0.05), (5.0, 0.01), (10.0, 0.0005)] {
        for angle in [0.0, 20.0, 45.0f64] {
            let across = DVec3::new(angle.to_radians().cos(), angle.to_radians().sin(), 0.0);
            let near = plane(DVec3::Z, 300.0 - gap_mm, |_| DVec3::ZERO);
            let far = plane(DVec3::Z, 300.0, |_| DVec3::ONE);
            let g = View::orthographic([256, 256], 4.0).shoot(|origin, ray| {
                near(origin, ray).filter(|hit| hit.point.dot(across) < 0.0).or_else(|| far(origin, ray))
            });
            let out = g.scatter_planned(&plans()[1]);
            let out: Vec<DVec3> = out.into_iter().map(rgb).collect();
            let near = |h: &Hit| h.point.dot(across).abs() < 6.0 && h.point.truncate().length() < 20.0;
            let pixels = g.pixels(near).into_iter().step_by(97);
            let pixels: Vec<usize> = pixels.map(|(i, _)| i).collect();
            let errors = g.errors(&out, &pixels);
            let error = errors.iter().map(|e| e.abs().max_element()).fold(0.0, f64::max);
            println!("{gap_mm} mm, edge at {angle}°: {error:.5}");
            assert!(error <= most, "{gap_mm} mm, {angle}°: {error}");
        }
    }
}

#[test]
fn constant_light_stays_constant() {
    // A sphere over a sloping plane, with holes, in a wide perspective.
    let e = DVec3::new(0.8, 0.5, 0.3);
    let near = sphere(12.0, 60.0, |_| e);
    let far = plane(tilted_normal(50.0, 30.0), 75.0, |_| e);
    let g = View::perspective([320, 256], 60.0).shoot(|origin, ray| {
        let hit = near(origin, ray).or_else(|| far(origin, ray))?;
        let holes = (7.0 * hit.point.x).sin() * (5.0 * hit.point.y).sin() > 0.6;
        (!holes).then_some(hit)
    });
    for plan in plans() {
        let out = g.scatter_planned(plan);
        for (i, _) in g.pixels(|_| true) {
            // A few half floats of rounding, each 2⁻¹² of the value.
            let error = (rgb(out[i]) - e).abs().max_element();
            assert!(error <= 0.001, "pixel {i}: {error}");
        }
    }
}

#[test]
fn other_pixels_stay_bit_for_bit() {
    let ball = sphere(9.0, 60.0, |n| DVec3::splat(n.x.max(0.0)));
    for g in [
        View::perspective([201, 97], 40.0).shoot(&ball),
        // Nothing at all.
        View::perspective([64, 33], 40.0).shoot(|_, _| None),
    ] {
        let out = g.scatter_planned(&plans()[1]);
        for (pixel, hit) in out.iter().zip(&g.hits) {
            if hit.is_none() {
                assert_eq!(*pixel, [0.25, 0.25, 0.25, 0.5]);
            }
        }
    }
}

#[test]
fn no_scattering_leaks_onto_another_profile() {
    // Two halves of one plane, the left of profile 1 and lit; facing, and so steep that taps reach far.
    let profiles = [Profile::SKIN; 2];
    for (tilt, max_error) in [(0.0, 0.01), (75.0, 1.0 / 255.0)] {
        let surface =
            plane(tilted_normal(tilt, 0.0), 300.0, |p| DVec3::splat(f64::from(u8::from(p.x < 0.0))));
        let g = View::orthographic([160, 96], 4.0).shoot(|origin, ray| {
            let hit = surface(origin, ray)?;
            let id = if hit.point.x < 0.0 { 1 } else { 2 };
            Some(Hit { id, ..hit })
        });
        let plan = Plan::new(&profiles, max_error).unwrap();
        let out = g.scatter_planned(&plan);
        for (i, hit) in g.pixels(|_| true) {
            let error = (rgb(out[i]) - hit.irradiance).abs().max_element();
            assert!(error < 0.001, "{tilt}°, pixel {i}: {error}");
        }
    }
}

#[test]
fn frames_of_every_size_are_scattered() {
    let mut effect = ours(&plans()[1], TextureFormat::Rgba16Float);
    for size in [[1, 1], [1, 70], [333, 2], [17, 16]] {
        let gpu = gpu();
        let count = (size[0] * size[1]) as usize;
        let output = gpu.target("output", size, TextureFormat::Rgba16Float);
        let light = vec![[1.0f32, 0.5, 0.25, 1.0]; count];
        let light = gpu.upload("irradiance", size, TextureFormat::Rgba32Float, &light);
        let depth = gpu.upload("depth", size, TextureFormat::R32Float, &vec![0.5f32; count]);
        let id = gpu.upload("id", size, TextureFormat::R8Uint, &vec![1u8; count]);
        let projection = View::orthographic(size, 4.0).projection.as_mat4();
        let mut frame = Frame::new(&light, &depth, projection.to_cols_array_2d());
        frame.profile_id = Some(&id);
        frame.mm_per_unit = 1.0;
        method::scatter(gpu, &mut effect, &frame, &output).unwrap();
        for pixel in gpu.read(&output) {
            assert!((pixel[1] - 0.5).abs() < 0.001, "{size:?}: {pixel:?}");
        }
    }
}

#[test]
fn what_cannot_be_kept_is_refused() {
    for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let error = Plan::new(&[Profile::SKIN], bad).unwrap_err();
        assert!(error.to_string().starts_with("max_error: "), "{error}");
    }
    // What no pyramid keeps is told, with what can be kept.
    let error = Plan::new(&[Profile::SKIN], 1e-4).unwrap_err();
    let Error::MaxError { got, reachable } = error else {
        panic!("{error}");
    };
    assert!(got == 1e-4 && reachable > 1e-4, "{error}");
    assert!(Plan::new(&[Profile::SKIN], 1.01 * reachable).is_ok());
    let error = Plan::new(&[], 0.01).unwrap_err();
    assert!(error.to_string().starts_with("profiles: "), "{error}");
}
