//! Where screen space fails: what is close in the picture and far apart in space, what the camera does not
//! see, and what is too steep, too wide or too small for pixels.

use glam::{DVec2, DVec3};
use subsurface::Profile;

use super::{GRADIENT, PROMISE, REACH_MM, SEEN, trial};
use crate::stability::case::{ATLAS, Bound, Case, EXACT, Known, PLAN, by_nature, known};
use crate::stability::scene::{Form, Scene, Surface, direction, from_camera};
use crate::stability::trial::{Crop, Trial, Truth, worst_of};
use crate::synthetic::{View, tilted_normal};
use crate::truth::closed_form::through_slab;

pub fn cases(quick: bool) -> Vec<Case> {
    let groups = [layers, heads, silhouettes, border, slopes, scales];
    groups.iter().flat_map(|cases| cases(quick)).collect()
}

/// What may cross 10 mm of air or more.
const LEAK: Bound = Bound {
    passes: 0.0005,
    degrades: SEEN,
    why: "less than 0.0001 crosses 10 mm of air by the skin profile; more than 0.0005, a step of \
        half floats, is a leak.",
};

const COARSE: &str = "A coarse pixel of the pyramid holds one surface, so the light of the other \
    is missing nearby. Use the exact sum where layers are close in the picture, or give each \
    head a profile of its own.";
const ISLANDS: &str = "Texture space sums along the surface, island by island, while Eq. 7 also \
    counts what crosses the gap. Across air this is no error: no skin carries that light. Where \
    layers touch, use the exact sum.";

/// A dark layer in front of a lit one, as a nose over a cheek.
fn layers(quick: bool) -> Vec<Case> {
    let case = |gap_mm: f64| {
        let make = move || {
            let view = View::orthographic([128; 2], 6.0);
            let across = direction(27.0);
            let form = || Form::facing(128.0 / 6.0);
            let dark = move |p: DVec3, _| (p.dot(across) < 0.0).then_some(DVec3::ZERO);
            let lit = Surface::even(form(), 1.0).moved(DVec3::Z * -gap_mm);
            let scene = Scene(vec![Surface::new(form(), dark), lit]);
            let crop = Crop::middle(&view, [if quick { 48 } else { 80 }; 2]);
            Trial::new(scene, view, crop, Truth::Visible).atlas([96; 2], Truth::Whole)
        };
        let what = "A dark half-plane in front of a lit plane, its edge at 27 degrees, 6 px/mm: \
            largest difference to the visible integral; in texture space to Eq. 7 over both \
            layers. Both count what crosses the air as if it were skin.";
        let bound = if gap_mm < 10.0 { GRADIENT } else { LEAK };
        trial(format!("layers {gap_mm} mm apart"), what, bound, make)
    };
    let known = |plan, atlas| [known(PLAN, plan, COARSE), known(ATLAS, atlas, ISLANDS)];
    vec![
        case(1.0).known(known(0.034, 0.35)),
        case(2.0).known(known(0.042, 0.22)).pictured(false),
        case(5.0).known(known(0.0125, 0.025)),
        case(10.0).pictured(false),
        case(20.0),
    ]
}

fn ball() -> Form {
    Form::Sphere { rho_mm: 10.0 }
}

/// Two heads of one profile, one dark and one lit.
fn heads(quick: bool) -> Vec<Case> {
    let case = |name: &str, apart_mm: f64, behind_mm: f64, bound, truth| {
        let make = move || {
            let view = View::orthographic([168, 96], 4.0);
            let half = DVec3::X * apart_mm / 2.0;
            let dark = Surface::even(ball(), 0.0).moved(-half);
            let lit = Surface::even(ball(), 1.0).moved(half - DVec3::Z * behind_mm);
            let crop = Crop::middle(&view, if quick { [40, 26] } else { [80, 53] });
            let scene = Scene(vec![dark, lit]);
            Trial::new(scene, view, crop, Truth::Visible).atlas([128; 2], truth)
        };
        let what = "A dark ball of 10 mm radius, and a lit one 12 mm to its right and 30 mm \
            behind it; 20 mm and 30 mm; or 20 mm and 0; 4 px/mm: largest difference to the \
            visible integral where they meet in the picture, without the pixels at their rims; \
            in texture space to each ball's own even light, where they touch to Eq. 7 over both.";
        trial(name, what, bound, make)
    };
    let near = "Rows of one head that lie near the other's tangent plane count as of both.";
    let touch = [known(EXACT, 0.0105, near), known(PLAN, 0.1, COARSE), known(ATLAS, 0.3, ISLANDS)];
    vec![
        case("a head in front of another", 12.0, 30.0, LEAK, Truth::Closed),
        case("heads side by side, one farther away", 20.0, 30.0, LEAK, Truth::Closed),
        case("heads that touch", 20.0, 0.0, GRADIENT, Truth::Whole).known(touch),
    ]
}

/// A cylinder at 27 degrees in the picture, lit at `degrees` from the camera's direction.
fn cylinder(rho_mm: f64, degrees: f64) -> Scene {
    let across = direction(27.0);
    let form = Form::Cylinder { along: DVec3::Z.cross(across), rho_mm, length_mm: 32.0, turned: 0.0 };
    Scene(vec![Surface::lit(form, from_camera(degrees, across))])
}

/// Thin parts before a bright background and a black one.
fn silhouettes(quick: bool) -> Vec<Case> {
    let case = |part: &str, rho_mm: f64, texels, crop: [u32; 2], background: f64| {
        let make = move || {
            let view = View::orthographic([128; 2], 4.0);
            let [width, height] = crop;
            let crop = Crop::middle(&view, [width, if quick { height / 3 } else { height }]);
            Trial::new(cylinder(rho_mm, 50.0), view, crop, Truth::Visible)
                .before(background)
                .atlas(texels, Truth::Closed)
        };
        let what = "A cylinder of 8 mm radius (the rim of an ear: 0.75 mm), lit from 50 degrees \
            to the side, before a background of light 0 or 4, 4 px/mm: largest difference to the \
            visible integral, without the pixels at its rim, whose slopes are guesses; in \
            texture space to the closed form.";
        let before = if background > 0.0 { "bright" } else { "black" };
        trial(format!("{part} before {before}"), what, GRADIENT, make)
    };
    let why = "The part is 6 px wide, and most of its area lies in the outer pixels, whose area \
        follows from a guessed slope. Use texture space.";
    let thin = [known(EXACT, 0.033, why), known(PLAN, 0.046, why)];
    let finger = |light| case("a finger", 8.0, [160, 64], [96, 72], light);
    let rim = |light| case("the rim of an ear", 0.75, [40, 160], [32, 24], light).known(thin);
    vec![finger(0.0), finger(4.0).pictured(false), rim(0.0), rim(4.0).pictured(false)]
}

/// The border of the frame, which cuts the kernel.
fn border(quick: bool) -> Vec<Case> {
    let case = |name: &str, held_to: &str, truth, texels, surface: fn() -> Surface| {
        let make = move || {
            let view = View::orthographic([128; 2], 4.0);
            // What lies within 8 mm of the right border, around its middle.
            let height = if quick { 20 } else { 96 };
            let crop = Crop { first: [96, (128 - height) / 2], size: [32, height] };
            let scene = Scene(vec![surface().moved(DVec3::X * 16.0)]);
            let trial = Trial::new(scene, view, crop, truth);
            match truth {
                // Where a silhouette hides nothing that matters.
                Truth::Closed => trial.only_where(|hit| hit.normal.z > 0.5).atlas(texels, truth),
                _ => trial,
            }
        };
        let what = "A soft edge of light (σ of 1 px) that leaves the frame at 27 degrees; or a \
            ball of 10 mm radius whose middle lies on the border, lit at 60 degrees from \
            outside, without its rim; 4 px/mm: largest difference within 8 mm of the border to \
            the closed form of all of it, or to the visible integral, which ends with the frame. \
            Texture space has no frame and is left out of the latter.";
        trial(format!("{name}, against {held_to}"), what, GRADIENT, make)
    };
    let edge = || Surface::edge(Form::facing(48.0), direction(27.0), 0.0, 1.0 / 16.0);
    let head = || Surface::lit(ball(), from_camera(60.0, DVec3::X));
    let whole = |name, texels, surface, at_most| {
        let why = "Light from outside the frame is not in the frame. Draw a frame that is 8 mm \
            wider on all sides and crop it after scattering, or use texture space.";
        case(name, "all that there is", Truth::Closed, texels, surface)
            .known([EXACT, PLAN].map(|method| by_nature(method, at_most, why)))
    };
    let seen = |name, surface, at_most| {
        let why = "Beyond the frame the pyramid repeats the light at its border. Draw a frame \
            that is 8 mm wider on all sides, or use the exact sum.";
        case(name, "what is seen", Truth::Visible, [1; 2], surface).known([known(PLAN, at_most, why)])
    };
    vec![
        whole("an edge at the border", [192; 2], edge, 0.24),
        seen("an edge at the border", edge, 0.014),
        whole("half a head", [160; 2], head, 0.066),
        seen("half a head", head, 0.015),
    ]
}

/// Skin that the camera sees at a slant: tilt, axis, and how far a plan is off at 4 px/mm and at the worst
/// of all scales.
fn slopes(quick: bool) -> Vec<Case> {
    let slopes = [
        (30.0, 0.0, [0.0053, 0.0063]),
        (30.0, 45.0, [PROMISE.passes; 2]),
        (60.0, 0.0, [0.0057, 0.015]),
        (60.0, 45.0, [0.0095, 0.019]),
        (80.0, 0.0, [0.02, 0.038]),
        (80.0, 45.0, [0.023, 0.023]),
        (85.0, 0.0, [0.042, 0.088]),
        (85.0, 45.0, [0.044, 0.085]),
    ];
    let what = "A plane tilted about a row of the picture, or (diagonal) about an axis at 45 \
        degrees. A soft edge of light (σ of 1 px) runs across the slope, down it, and between, \
        at 4 px/mm (2, 4 and 8 in full): largest difference to the closed form within 6 mm. \
        Texture space does not depend on the tilt and is left out.";
    let why = "On a steep slope taps lie further apart along its contour, and detail of a pixel \
        falls between them. Use the exact sum, or light that is soft by 2 px.";
    let case = |(tilt, axis, [at_4, at_all]): (f64, f64, [f64; 2])| {
        let scales: &[f64] = if quick { &[4.0] } else { &[4.0, 2.0, 8.0] };
        let frames = scales.iter().flat_map(|s| [0.0, 45.0, 90.0].map(|edge| (*s, edge)));
        let diagonal = if axis > 0.0 { ", diagonal" } else { "" };
        let name = format!("slope of {tilt} degrees{diagonal}");
        let case = Case::new(name, what, PROMISE, move |lab| {
            let frames = frames.clone();
            worst_of(frames.map(|(scale, edge)| slope([tilt, axis, edge], scale).run(lab)))
        });
        let case = case.known([known(PLAN, if quick { at_4 } else { at_all }, why)]);
        case.pictured([(60.0, 45.0), (85.0, 0.0)].contains(&(tilt, axis)))
    };
    slopes.map(case).into()
}

/// A plane at angles in degrees: its tilt, about which axis, and the edge on it.
fn slope([tilt, axis, edge]: [f64; 3], px_per_mm: f64) -> Trial {
    /// Where an edge scatters anything that counts.
    const NEAR_MM: f64 = 6.0;
    let along = direction(axis);
    let down = tilted_normal(tilt, axis).cross(along);
    let (sin, cos) = edge.to_radians().sin_cos();
    // A pixel is 1/cos(tilt) long down the slope.
    let pixel_mm = DVec2::new(cos, sin / tilt.to_radians().cos()).length() / px_per_mm;
    let form = Form::tilted(tilt, axis, 1.0);
    let surface = Surface::edge(form, along * cos + down * sin, 0.0, pixel_mm * pixel_mm);
    // All that is near, and what kernels reach from there.
    let reach_mm = along.truncate().abs() + down.truncate().abs();
    let crop_px = reach_mm * 2.0 * NEAR_MM * px_per_mm;
    let side_px = 2.0 * (NEAR_MM * reach_mm.max_element() + REACH_MM) * px_per_mm;
    let view = View::orthographic([side_px as u32; 2], px_per_mm);
    let crop = Crop::middle(&view, crop_px.ceil().as_uvec2().into());
    Trial::new(Scene(vec![surface]), view, crop, Truth::Closed).only_where(move |hit| {
        let from_middle = hit.point + DVec3::Z * 300.0;
        [along, down].iter().all(|side| from_middle.dot(*side).abs() < NEAR_MM)
    })
}

/// Light that falls on what the camera does not see.
pub fn behind(quick: bool) -> Vec<Case> {
    let unseen = |[exact, plan]: [f64; 2]| -> [Known; 2] {
        let why = "The frame holds no light of what it does not show. Use texture space where \
            light comes around a rim, and add transmission by thickness where it comes through.";
        [by_nature(EXACT, exact, why), by_nature(PLAN, plan, why)]
    };
    let slab = |thickness_mm: f64| {
        let [through, _] = through_slab(thickness_mm, &Profile::SKIN);
        let make = move || {
            let view = View::orthographic([96; 2], 4.0);
            let face = || Form::facing(24.0);
            let near = Surface::solved(face(), |_, _| DVec3::ZERO, move |_, _| through);
            let far = Surface::even(face(), 1.0).moved(DVec3::NEG_Z * thickness_mm);
            let crop = Crop::middle(&view, [16; 2]);
            Trial::new(Scene(vec![near, far]), view, crop, Truth::Closed).atlas([64; 2], Truth::Closed)
        };
        let what = "Two faces this far apart, the hidden one lit by 1 and the visible one not, 4 \
            px/mm: difference to what Eq. 7 as printed passes. In texture space each face has an \
            island.";
        let why = "Texture space knows the hidden face, but sums along the atlas, where the two \
            faces of an ear lie apart: light gets around a rim, not through the middle. Add \
            transmission by thickness.";
        let at_most = through.max_element() * 1.01;
        let name = format!("an ear {thickness_mm} mm thick, lit from behind");
        trial(name, what, GRADIENT, make).known(unseen([at_most; 2])).known([known(ATLAS, at_most, why)])
    };
    let case = |part: &str, degrees: f64, size: u32, crop, texels, scene: fn(f64) -> Scene| {
        let make = move || {
            let view = View::orthographic([size; 2], 4.0);
            Trial::new(scene(degrees), view, Crop::middle(&view, crop), Truth::Closed)
                .only_where(move |hit| degrees > 90.0 || hit.normal.z > 0.5)
                .atlas(texels, Truth::Closed)
        };
        let what = "A cylinder of 8 mm radius (the rim of an ear: 0.75 mm) or a ball of 10 mm, \
            lit at 90 degrees from the camera's direction (from the side) or 130 (from behind; \
            the rim: 150), 4 px/mm: largest difference to the closed form, from the side where \
            it is turned by less than 60 degrees from the camera, from behind without its rim.";
        let from = if degrees > 90.0 { "from behind" } else { "from the side" };
        trial(format!("{part} lit {from}"), what, GRADIENT, make)
    };
    let rim = case("the rim of an ear", 150.0, 128, [31, 16], [40, 160], |d| cylinder(0.75, d));
    let finger = |d| case("a finger", d, 128, [104, 40], [160, 64], |d| cylinder(8.0, d));
    let lit = |d| Scene(vec![Surface::lit(ball(), from_camera(d, direction(27.0)))]);
    let head = |d| case("a head", d, 96, [88, if quick { 44 } else { 88 }], [160; 2], lit);
    let mut cases = vec![
        slab(1.5),
        slab(4.0).pictured(false),
        rim.known(unseen([0.17; 2])),
        finger(90.0),
        finger(130.0).known(unseen([0.018, 0.0125])),
        head(90.0),
        head(130.0).known(unseen([0.015, 0.014])),
    ];
    cases.extend(two_layers(quick));
    cases
}

/// The same with the layer behind what the camera sees, which holds the light that is missing.
fn two_layers(quick: bool) -> Vec<Case> {
    let slab = |thickness_mm: f64, is_printed: bool| {
        let [printed, normalised] = through_slab(thickness_mm, &Profile::SKIN);
        let through = if is_printed { printed } else { normalised };
        let make = move || {
            let view = View::orthographic([96; 2], 4.0);
            let face = || Form::facing(24.0);
            let near = Surface::solved(face(), |_, _| DVec3::ZERO, move |_, _| through);
            let far = Surface::even(face(), 1.0).moved(DVec3::NEG_Z * thickness_mm).turned_away();
            let crop = Crop::middle(&view, [16; 2]);
            Trial::new(Scene(vec![near, far]), view, crop, Truth::Closed).with_back()
        };
        let what = "The same two faces with the hidden one handed in: difference to what Eq. 7 passes with each \
            Gaussian divided by its mass on both faces, or as printed.";
        let printed = if is_printed { ", as printed" } else { "" };
        trial(format!("an ear {thickness_mm} mm thick, two layers{printed}"), what, GRADIENT, make)
    };
    let divided = "Each Gaussian is divided by its mass over both faces, so that even light stays even.";
    let case = |part: &str, size: u32, crop, scene: fn() -> Scene| {
        let make = move || {
            let view = View::orthographic([size; 2], 4.0);
            Trial::new(scene(), view, Crop::middle(&view, crop), Truth::Closed).with_back()
        };
        let what = "Rim, finger and ball lit from behind as above, with their far sides handed in: largest \
            difference to the closed form, without the pixels at their rims.";
        trial(format!("{part} lit from behind, two layers"), what, GRADIENT, make)
    };
    // Where the back is dark, to the integral over both layers.
    let front = |part: &str, rho_mm: f64, crop| {
        let make = move || {
            let view = View::orthographic([128; 2], 4.0);
            Trial::new(cylinder(rho_mm, 50.0), view, Crop::middle(&view, crop), Truth::Layers).with_back()
        };
        let what = "Rim and finger lit from 50 degrees to the side, with their far sides handed in: largest \
            difference to Eq. 7 over both layers, without the pixels at their rims.";
        trial(format!("{part} before black, two layers"), what, GRADIENT, make).pictured(false)
    };
    let half = if quick { 44 } else { 88 };
    let steep = "Of the steep pixels at a rim a coarse pixel keeps the less steep ones. Use the exact sum.";
    let planned = |at_most| known(PLAN, at_most, steep);
    let guess = "Most of a rim's area lies in the outer pixels and follows from a guessed slope.";
    vec![
        front("the rim of an ear", 0.75, [32, 24]).known([planned(0.045), known(EXACT, 0.03, guess)]),
        front("a finger", 8.0, [96, 24]).known([planned(0.015)]),
        slab(1.5, false),
        slab(2.0, false).pictured(false),
        slab(4.0, false).pictured(false),
        slab(1.5, true)
            .known([EXACT, PLAN].map(|method| by_nature(method, 0.115, divided)))
            .pictured(false),
        case("the rim of an ear", 128, [31, 16], || cylinder(0.75, 150.0))
            .known([planned(0.035), known(EXACT, 0.013, guess)]),
        case("a finger", 128, [104, 40], || cylinder(8.0, 130.0)).known([planned(0.021)]),
        case("a head", 96, [88, half], || {
            Scene(vec![Surface::lit(ball(), from_camera(130.0, direction(27.0)))])
        })
        .known([planned(0.0125)]),
    ]
}

/// Kernels from less than a pixel to more than a frame, and light smaller than a pixel.
fn scales(quick: bool) -> Vec<Case> {
    let kernel = |width_px: f64| {
        // σ of skin's red in mm.
        let px_per_mm = width_px / 1.176;
        let side = if quick { 128 } else { 256 };
        // Where the middle of the frame sees all that scatters to it, there is a closed form.
        let is_cut = f64::from(side) / px_per_mm / 2.0 < REACH_MM + 12.0 / px_per_mm;
        let truth = if is_cut { Truth::Visible } else { Truth::Closed };
        let make = move || {
            let view = View::orthographic([side; 2], px_per_mm);
            let form = Form::facing(f64::from(side) / px_per_mm);
            let edge = Surface::edge(form, direction(27.0), 0.0, px_per_mm.powi(-2));
            let crop = Crop::middle(&view, [24, 12]);
            Trial::new(Scene(vec![edge]), view, crop, truth).atlas([side; 2], truth)
        };
        let what = "A soft edge of light (σ of 1 px) at 27 degrees on skin that faces the \
            camera, so far away that the red of the profile has this σ: largest difference in \
            the middle 24x12 pixels to the closed form, or to the visible integral where the \
            frame cuts the kernel.";
        trial(format!("kernel of {width_px} px"), what, PROMISE, make)
    };
    let small = |name: &str, px_per_mm: f64, is_lit: fn(DVec3) -> bool| {
        let make = move || {
            let view = View::orthographic([96; 2], px_per_mm);
            let light = move |p, _| Some(DVec3::splat(f64::from(u8::from(is_lit(p)))));
            let scene = Scene(vec![Surface::new(Form::facing(96.0 / px_per_mm), light)]);
            let crop = Crop::middle(&view, [48, 24]);
            Trial::new(scene, view, crop, Truth::Visible).atlas([96; 2], Truth::Visible)
        };
        let what = "A lit line at 10 degrees on dark skin, 0.1 mm wide, 2 px/mm; or dark discs \
            of 1 mm, one in 5.3 mm, on lit skin, 0.3 px/mm. Pixels hit or miss them, which is no \
            method's error: largest difference to the visible integral of the frame as it is, \
            itself known to 0.0026.";
        trial(name, what, GRADIENT, make)
    };
    vec![
        kernel(0.1),
        kernel(0.5),
        kernel(2.0),
        kernel(10.0),
        kernel(50.0).pictured(false),
        kernel(200.0),
        small("a line of light 0.1 mm wide", 2.0, |p| p.dot(direction(100.0)).abs() < 0.05),
        small("freckles of 1 mm", 0.3, |p| {
            let at = DVec2::from_angle(0.3).rotate(p.truncate()) / 5.3;
            5.3 * (at - at.floor() - 0.5).length() > 0.5
        }),
    ]
}
