//! Scattering by a plan against closed forms, and against what the plan states.

use std::sync::OnceLock;

use glam::{DVec2, DVec3};
use subsurface::{Error, Plan, Profile};
use subsurface_lab::synthetic::*;
use subsurface_lab::truth::closed_form::{scattered_step, step};

/// Plans of the skin profile at 1/100 and 1/255.
fn plans() -> &'static [Plan; 2] {
    static PLANS: OnceLock<[Plan; 2]> = OnceLock::new();
    PLANS.get_or_init(|| {
        [100.0, 255.0].map(|steps: f32| Plan::new(&[Profile::SKIN], steps.recip()).unwrap())
    })
}

/// The largest error on an edge at an angle that is soft by a pixel, away from the picture's border.
fn edge_error(plan: &Plan, px_per_mm: f64, angle: f64) -> f64 {
    // What the border cuts from a kernel is not the closed form's.
    const REACH_MM: f64 = 9.6;
    let view = View::orthographic([400, 400], px_per_mm);
    let across = direction(angle);
    let blur_mm2 = px_per_mm.powi(-2);
    let g = view.shoot(plane(DVec3::Z, 300.0, |p| DVec3::splat(step(p.dot(across), blur_mm2))));
    let out = g.scatter_planned(plan);
    let half = DVec2::splat(200.0 / px_per_mm - REACH_MM);
    let inside = g.pixels(|h| h.point.truncate().abs().cmplt(half).all());
    let errors = inside.iter().map(|(i, hit)| {
        let truth = scattered_step(hit.point.dot(across), blur_mm2, &Profile::SKIN);
        (rgb(out[*i]) - truth).abs().max_element()
    });
    largest(errors)
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
        for angle in [0.0, 27.0, 45.0, 90.0] {
            let across = direction(angle);
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
            let error = largest(errors.iter().map(|e| e.abs().max_element()));
            println!("hard, {px_per_mm} px/mm, {angle}°: {error:.5}");
            assert!(error <= f64::from(plan.max_error()), "{px_per_mm} px/mm, {angle}°: {error}");
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
            let error = largest(error);
            println!("hard, down a slope of {tilt}°, {px_per_mm} px/mm: {error:.5}");
            assert!(error <= most, "{tilt}°, {px_per_mm} px/mm: {error}");
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
    let profiles = [Profile::SKIN, Profile::SKIN.scaled(1.4).unwrap()];
    for (tilt, max_error) in [(0.0, 0.01), (75.0, 1.0 / 255.0)] {
        let surface =
            plane(tilted_normal(tilt, 0.0), 300.0, |p| DVec3::splat(f64::from(u8::from(p.x < 0.0))));
        let g = View::orthographic([160, 96], 4.0).shoot(|origin, ray| {
            let hit = surface(origin, ray)?;
            let id = if hit.point.x < 0.0 { 1 } else { 2 };
            Some(Hit { id, ..hit })
        });
        let plan = Plan::new(&profiles, max_error).unwrap();
        let mut one = g.clone();
        one.hits.iter_mut().flatten().for_each(|hit| hit.id = 1);
        let mixed = one.scatter_planned(&plan);
        let changes = g.pixels(|_| true).into_iter().map(|(i, h)| (rgb(mixed[i]) - h.irradiance).x.abs());
        assert!(largest(changes) > 0.1, "{tilt}°: halves of one profile mix");
        let out = g.scatter_planned(&plan);
        for (i, hit) in g.pixels(|_| true) {
            let error = (rgb(out[i]) - hit.irradiance).abs().max_element();
            assert!(error < 0.001, "{tilt}°, pixel {i}: {error}");
        }
    }
}

#[test]
fn ids_of_equal_profiles_are_one() {
    let ball = sphere(9.0, 60.0, |n| DVec3::splat(n.x.max(0.0)));
    let profiles = [Profile::SKIN; 3];
    for plan in [Plan::new(&profiles, 0.01).unwrap(), Plan::exact(&profiles).unwrap()] {
        let by = |ids: fn(DVec3) -> u32| {
            let g = View::perspective([128, 96], 40.0)
                .shoot(|origin, ray| ball(origin, ray).map(|hit| Hit { id: ids(hit.point), ..hit }));
            g.scatter_planned(&plan)
        };
        let one = by(|_| 1);
        assert_eq!(one, by(|_| 3));
        assert_eq!(one, by(|p| if p.x < 0.5 { 2 } else { 3 }));
        // An id without a profile is no skin still.
        assert_ne!(one, by(|p| if p.x < 0.5 { 2 } else { 4 }));
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
