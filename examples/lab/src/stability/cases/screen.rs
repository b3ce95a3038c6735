//! Where screen space fails: what is close in the picture and far apart in space, what the camera does not
//! see, and what is too steep, too wide or too small for pixels.

use glam::{DVec2, DVec3};
use subsurface::Profile;

use super::{FOUND, GRADIENT, PROMISE, REACH_MM, SEEN};
use crate::Error;
use crate::stability::case::{ATLAS, Bound, Case, EXACT, Known, Outcome, PLAN, by_nature, known};
use crate::stability::lab::Lab;
use crate::stability::scene::{Form, Scene, Surface, direction, from_camera, lambert};
use crate::stability::trial::{Crop, Trial, Truth, worst_of};
use crate::synthetic::{Hit, View, tilted_normal};
use crate::truth::closed_form::{
    scattered_cosine, scattered_cosine_around, scattered_step, step, through_slab,
};

pub fn cases(quick: bool) -> Vec<Case> {
    [
        layers(quick),
        heads(quick),
        silhouettes(quick),
        border(quick),
        slopes(quick),
        behind(quick),
        scales(quick),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// What may cross 10 mm of air or more.
const LEAK: Bound = Bound {
    passes: 0.0005,
    degrades: SEEN,
    why: "less than 0.0001 crosses 10 mm of air by the skin profile; more than 0.0005, one step of half floats, is a leak.",
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
        let run = move |lab: &Lab| {
            let view = View::orthographic([128; 2], 6.0);
            let across = direction(27.0);
            let form = || Form::facing(128.0 / 6.0);
            let near = Surface {
                light: Box::new(move |p, _| (p.dot(across) < 0.0).then_some(DVec3::ZERO)),
                ..Surface::new(form(), |_, _| DVec3::ZERO)
            };
            let far = Surface::new(form(), |_, _| DVec3::ONE).moved(DVec3::Z * -gap_mm);
            let crop = Crop::middle(&view, [if quick { 48 } else { 80 }; 2]);
            Trial {
                atlas: Some(([96; 2], Truth::Whole)),
                ..Trial::new(Scene(vec![near, far]), view, crop, Truth::Visible)
            }
            .run(lab)
        };
        let what = "A dark half-plane in front of a lit plane, its edge at 27 degrees, 6 px/mm: \
            largest difference to the visible integral; in texture space to Eq. 7 over both \
            layers. Both count what crosses the air as if it were skin.";
        let bound = if gap_mm < 10.0 { GRADIENT } else { LEAK };
        Case::new(format!("layers {gap_mm} mm apart"), what, bound, run)
    };
    vec![
        case(1.0).known([known(PLAN, 0.055, COARSE), known(ATLAS, 0.35, ISLANDS)]),
        case(2.0)
            .known([known(PLAN, 0.075, COARSE), known(ATLAS, 0.22, ISLANDS)])
            .unpictured(),
        case(5.0).known([known(ATLAS, 0.025, ISLANDS)]),
        case(10.0).unpictured(),
        case(20.0),
    ]
}

/// Two heads of one profile, one dark and one lit.
fn heads(quick: bool) -> Vec<Case> {
    let case = |name: &str, apart_mm: f64, behind_mm: f64| {
        let touch = behind_mm == 0.0;
        let run = move |lab: &Lab| {
            let view = View::orthographic([168, 96], 4.0);
            let ball = |light| {
                Surface::new(Form::Sphere { rho_mm: 10.0 }, move |_, _| {
                    DVec3::splat(light)
                })
            };
            let half = DVec3::X * apart_mm / 2.0;
            let lit = ball(1.0).moved(half - DVec3::Z * behind_mm);
            let crop = Crop::middle(&view, if quick { [40, 26] } else { [80, 53] });
            let constant = |hit: &Hit| hit.irradiance;
            let held_to = if touch {
                Truth::Whole
            } else {
                Truth::Paper(&constant)
            };
            Trial {
                atlas: Some(([128; 2], held_to)),
                ..Trial::new(
                    Scene(vec![ball(0.0).moved(-half), lit]),
                    view,
                    crop,
                    Truth::Visible,
                )
            }
            .run(lab)
        };
        let what = format!(
            "A dark ball of 10 mm radius and a lit one {apart_mm} mm to its right and \
             {behind_mm} mm behind it, 4 px/mm: largest difference to the visible integral where \
             they meet in the picture, without the pixels at their rims; in texture space to {}.",
            if touch {
                "Eq. 7 over both"
            } else {
                "each ball's own even light"
            }
        );
        Case::new(name, what, if touch { GRADIENT } else { LEAK }, run)
    };
    vec![
        case("a head in front of another", 12.0, 30.0),
        case("heads side by side, one farther away", 20.0, 30.0),
        case("heads that touch", 20.0, 0.0)
            .known([known(PLAN, 0.21, COARSE), known(ATLAS, 0.3, ISLANDS)]),
    ]
}

/// A cylinder at 27 degrees in the picture, lit at `degrees` from the camera's direction; and its scattered
/// light.
fn cylinder(rho_mm: f64, degrees: f64) -> (Scene, impl Fn(&Hit) -> DVec3) {
    let across = direction(27.0);
    let form = Form::Cylinder {
        along: DVec3::Z.cross(across),
        rho_mm,
        length_mm: 32.0,
        turned: 0.0,
    };
    let surface = Surface::new(form, lambert(from_camera(degrees, across)));
    let scattered = scattered_cosine_around(rho_mm, &Profile::SKIN);
    let paper = move |hit: &Hit| {
        scattered(hit.normal.dot(across).atan2(hit.normal.z) - degrees.to_radians())
    };
    (Scene(vec![surface]), paper)
}

/// A ball lit at `degrees` from the camera's direction; and its scattered light.
fn ball(degrees: f64, side: DVec3) -> (Surface, impl Fn(&Hit) -> DVec3) {
    let light = from_camera(degrees, side);
    let surface = Surface::new(Form::Sphere { rho_mm: 10.0 }, lambert(light));
    let scattered = scattered_cosine(10.0, &Profile::SKIN);
    (surface, move |hit: &Hit| scattered(hit.normal.dot(light)))
}

/// Thin parts before a bright background and a black one.
fn silhouettes(quick: bool) -> Vec<Case> {
    let case = |part: &str, rho_mm: f64, half: u32, texels: [u32; 2], background: f64| {
        let run = move |lab: &Lab| {
            let (scene, paper) = cylinder(rho_mm, 50.0);
            let view = View::orthographic([128; 2], 4.0);
            let crop = Crop::middle(
                &view,
                [2 * half, if quick { half / 2 } else { 3 * half / 2 }],
            );
            Trial {
                background,
                atlas: Some((texels, Truth::Paper(&paper))),
                ..Trial::new(scene, view, crop, Truth::Visible)
            }
            .run(lab)
        };
        let what = format!(
            "A cylinder of {rho_mm} mm radius, lit from 50 degrees to the side, before a \
             background of light 0 or 4, 4 px/mm: largest difference to the visible integral, \
             without the pixels at its rim, whose slopes are guesses; in texture space to the \
             closed form."
        );
        let before = if background > 0.0 { "bright" } else { "black" };
        Case::new(format!("{part} before {before}"), what, GRADIENT, run)
    };
    let finger = |background| case("a finger", 8.0, 48, [160, 64], background);
    let why = "The part is 6 px wide, and most of its area lies in the outer pixels, whose area \
        follows from a guessed slope. Use texture space.";
    let thin = [known(EXACT, 0.033, why), known(PLAN, 0.043, why)];
    let rim = |background| case("the rim of an ear", 0.75, 16, [40, 160], background).known(thin);
    vec![
        finger(0.0),
        finger(4.0).unpictured(),
        rim(0.0),
        rim(4.0).unpictured(),
    ]
}

/// The border of the frame, which cuts the kernel: `whole` is held to what lies outside, too.
fn border(quick: bool) -> Vec<Case> {
    const SIDE: u32 = 128;
    let view = View::orthographic([SIDE; 2], 4.0);
    let border_mm = DVec3::X * 16.0;
    // What lies within 8 mm of the right border, around its middle.
    let height = if quick { 20 } else { 96 };
    let band = Crop {
        first: [SIDE - 32, (SIDE - height) / 2],
        size: [32, height],
    };
    let case = |name: &str,
                what: &str,
                whole: bool,
                run: Box<dyn Fn(&Lab) -> Result<Outcome, Error>>| {
        let (against, held_to) = if whole {
            ("all that there is", "the integral over the whole surface")
        } else {
            (
                "what is seen",
                "the visible integral, which ends with the frame; texture space has no frame and is left out",
            )
        };
        let what = format!("{what}, 4 px/mm: largest difference to {held_to}.");
        Case::new(format!("{name}, against {against}"), what, GRADIENT, run)
    };
    let edge = |whole: bool| {
        let run = move |lab: &Lab| {
            let (across, blur_mm2) = (direction(27.0), 1.0 / 16.0);
            // Its atlas lies around the middle of the border.
            let surface = Surface::new(Form::facing(48.0), move |p, _| {
                DVec3::splat(step(p.dot(across), blur_mm2))
            });
            let surface = surface.moved(border_mm);
            let middle_mm = surface.middle_mm;
            let paper = |h: &Hit| {
                scattered_step((h.point - middle_mm).dot(across), blur_mm2, &Profile::SKIN)
            };
            Trial {
                atlas: whole.then_some(([192; 2], Truth::Paper(&paper))),
                ..Trial::new(Scene(vec![surface]), view, band, seen_or(whole, &paper))
            }
            .run(lab)
        };
        let what = "A soft edge of light (σ of 1 px) that leaves the frame at 27 degrees, within 8 mm of the border";
        case("an edge at the border", what, whole, Box::new(run))
    };
    let half_a_head = |whole: bool| {
        let run = move |lab: &Lab| {
            let (head, paper) = ball(60.0, DVec3::X);
            // Where a silhouette hides nothing that matters.
            let inside = |hit: &Hit| !whole || hit.normal.z > 0.5;
            Trial {
                asked: &inside,
                atlas: whole.then_some(([160; 2], Truth::Paper(&paper))),
                ..Trial::new(
                    Scene(vec![head.moved(border_mm)]),
                    view,
                    band,
                    seen_or(whole, &paper),
                )
            }
            .run(lab)
        };
        let what = "A ball of 10 mm radius whose middle lies on the border, lit at 60 degrees \
            from outside, within 8 mm of the border and without its rim";
        case("half a head", what, whole, Box::new(run))
    };
    let not_seen = |at_most| {
        let why = "Light from outside the frame is not in the frame. Draw a frame that is 8 mm \
            wider on all sides and crop it after scattering, or use texture space.";
        [EXACT, PLAN].map(|method| by_nature(method, at_most, why))
    };
    let goes_on = |at_most| {
        let why = "Beyond the frame the pyramid repeats the light at its border. Draw a frame \
            that is 8 mm wider on all sides, or use the exact sum.";
        [known(PLAN, at_most, why)]
    };
    vec![
        edge(true).known(not_seen(0.24)),
        edge(false).known(goes_on(0.014)),
        half_a_head(true).known(not_seen(0.065)),
        half_a_head(false).known(goes_on(0.015)),
    ]
}

fn seen_or<'a>(whole: bool, paper: &'a dyn Fn(&Hit) -> DVec3) -> Truth<'a> {
    if whole {
        Truth::Paper(paper)
    } else {
        Truth::Visible
    }
}

/// Skin that the camera sees at a slant: tilt, axis, and how far a plan is off at 4 px/mm and at the worst
/// of all scales.
fn slopes(quick: bool) -> Vec<Case> {
    let slopes = [
        (30.0, 0.0, [0.0053, 0.0063]),
        (30.0, 45.0, [0.0039, 0.0039]),
        (60.0, 0.0, [0.0057, 0.015]),
        (60.0, 45.0, [0.0095, 0.019]),
        (80.0, 0.0, [0.02, 0.038]),
        (80.0, 45.0, [0.023, 0.023]),
        (85.0, 0.0, [0.042, 0.088]),
        (85.0, 45.0, [0.044, 0.085]),
    ];
    let why = "On a steep slope taps lie further apart along its contour, and detail of a pixel \
        falls between them. Use the exact sum, or light that is soft by 2 px.";
    let case = |(tilt, axis, [at_4, at_all]): (f64, f64, [f64; 2])| {
        let scales: &[f64] = if quick { &[4.0] } else { &[4.0, 2.0, 8.0] };
        let run = move |lab: &Lab| {
            let frames = scales
                .iter()
                .flat_map(|s| [0.0, 45.0, 90.0].map(|edge| (*s, edge)));
            worst_of(frames.map(|(px_per_mm, edge)| slope(lab, [tilt, axis, edge], px_per_mm)))
        };
        let diagonal = if axis > 0.0 { ", diagonal" } else { "" };
        let what = "A plane tilted about a row of the picture, or (diagonal) about an axis at 45 \
            degrees. A soft edge of light (σ of 1 px) runs across the slope, down it, and \
            between, at 4 px/mm (2, 4 and 8 in full): largest difference to the closed form \
            within 6 mm. Texture space does not depend on the tilt and is left out.";
        let case = Case::new(
            format!("slope of {tilt} degrees{diagonal}"),
            what,
            PROMISE,
            run,
        );
        let at_most = if quick { at_4 } else { at_all };
        let case = match at_most > PROMISE.passes {
            true => case.known([known(PLAN, at_most, why)]),
            false => case,
        };
        match (tilt, axis) {
            (60.0, 45.0) | (85.0, 0.0) => case,
            _ => case.unpictured(),
        }
    };
    slopes.map(case).into()
}

/// A plane at angles in degrees: its tilt, about which axis, and the edge on it.
fn slope(lab: &Lab, [tilt, axis, edge]: [f64; 3], px_per_mm: f64) -> Result<Outcome, Error> {
    /// Where an edge scatters anything that counts.
    const NEAR_MM: f64 = 6.0;
    let along = direction(axis);
    let down = tilted_normal(tilt, axis).cross(along);
    let (sin, cos) = edge.to_radians().sin_cos();
    let across = along * cos + down * sin;
    // A pixel is 1/cos(tilt) long down the slope.
    let pixel_mm = DVec2::new(cos, sin / tilt.to_radians().cos()).length() / px_per_mm;
    let blur_mm2 = pixel_mm * pixel_mm;
    let light = move |point: DVec3, _| DVec3::splat(step(point.dot(across), blur_mm2));
    let surface = Surface::new(Form::tilted(tilt, axis, 1.0), light);
    let middle_mm = surface.middle_mm;
    let paper =
        |h: &Hit| scattered_step((h.point - middle_mm).dot(across), blur_mm2, &Profile::SKIN);
    let near = |h: &Hit| {
        [along, down]
            .iter()
            .all(|side| (h.point - middle_mm).dot(*side).abs() < NEAR_MM)
    };
    // All that is near, and what kernels reach from there.
    let reach_mm = along.truncate().abs() + down.truncate().abs();
    let crop_px = reach_mm * 2.0 * NEAR_MM * px_per_mm;
    let side_px = 2.0 * (NEAR_MM * reach_mm.max_element() + REACH_MM) * px_per_mm;
    let view = View::orthographic([side_px as u32; 2], px_per_mm);
    let crop = Crop::middle(&view, crop_px.ceil().as_uvec2().into());
    Trial {
        asked: &near,
        ..Trial::new(Scene(vec![surface]), view, crop, Truth::Paper(&paper))
    }
    .run(lab)
}

const UNSEEN: &str = "The frame holds no light of what it does not show. Use texture space where \
    light comes around a rim, and add transmission by thickness where it comes through.";

fn unseen([exact, plan]: [f64; 2]) -> [Known; 2] {
    [
        by_nature(EXACT, exact, UNSEEN),
        by_nature(PLAN, plan, UNSEEN),
    ]
}

/// Light that falls on what the camera does not see.
fn behind(quick: bool) -> Vec<Case> {
    let slab = |thickness_mm: f64| {
        let through = through_slab(thickness_mm, &Profile::SKIN);
        let run = move |lab: &Lab| {
            let view = View::orthographic([96; 2], 4.0);
            let face = |light| Surface::new(Form::facing(24.0), move |_, _| DVec3::splat(light));
            let scene = Scene(vec![
                face(0.0),
                face(1.0).moved(DVec3::NEG_Z * thickness_mm),
            ]);
            let paper = |_: &Hit| through;
            Trial {
                atlas: Some(([64; 2], Truth::Paper(&paper))),
                ..Trial::new(
                    scene,
                    view,
                    Crop::middle(&view, [16; 2]),
                    Truth::Paper(&paper),
                )
            }
            .run(lab)
        };
        let what = "Two faces this far apart, the hidden one lit by 1 and the visible one not, 4 \
            px/mm: difference to what Eq. 7 as printed passes. In texture space each face has an \
            island.";
        let at_most = through.max_element() * 1.01;
        let why = "Texture space knows the hidden face, but sums along the atlas, where the two \
            faces of an ear lie apart: light gets around a rim, not through the middle. Add \
            transmission by thickness.";
        Case::new(
            format!("an ear {thickness_mm} mm thick, lit from behind"),
            what,
            GRADIENT,
            run,
        )
        .known(unseen([at_most; 2]))
        .known([known(ATLAS, at_most, why)])
    };
    let named = |part: &str, rho_mm: f64, degrees: f64, form: &str, run| {
        let (from, within) = if degrees > 90.0 {
            ("from behind", "without its rim")
        } else {
            (
                "from the side",
                "where it is turned by less than 60 degrees from the camera",
            )
        };
        let what = format!(
            "A {form} of {rho_mm} mm radius, lit at {degrees} degrees from the camera's \
             direction, 4 px/mm: largest difference to the closed form, {within}."
        );
        let run: Box<dyn Fn(&Lab) -> Result<Outcome, Error>> = run;
        Case::new(format!("{part} lit {from}"), what, GRADIENT, run)
    };
    let part = |name, rho_mm: f64, degrees: f64, texels: [u32; 2], crop: [u32; 2]| {
        let run = move |lab: &Lab| {
            let view = View::orthographic([128; 2], 4.0);
            let (scene, paper) = cylinder(rho_mm, degrees);
            Trial {
                asked: &|hit| degrees > 90.0 || hit.normal.z > 0.5,
                atlas: Some((texels, Truth::Paper(&paper))),
                ..Trial::new(scene, view, Crop::middle(&view, crop), Truth::Paper(&paper))
            }
            .run(lab)
        };
        named(name, rho_mm, degrees, "cylinder", Box::new(run))
    };
    let head = |degrees: f64| {
        let run = move |lab: &Lab| {
            let view = View::orthographic([96; 2], 4.0);
            let (head, paper) = ball(degrees, direction(27.0));
            let crop = Crop::middle(&view, [88, if quick { 44 } else { 88 }]);
            Trial {
                asked: &|hit| degrees > 90.0 || hit.normal.z > 0.5,
                atlas: Some(([160; 2], Truth::Paper(&paper))),
                ..Trial::new(Scene(vec![head]), view, crop, Truth::Paper(&paper))
            }
            .run(lab)
        };
        named("a head", 10.0, degrees, "ball", Box::new(run))
    };
    let finger = |degrees| part("a finger", 8.0, degrees, [160, 64], [104, 40]);
    vec![
        slab(1.5),
        slab(4.0).unpictured(),
        part("the rim of an ear", 0.75, 150.0, [40, 160], [31, 16]).known(unseen([0.17; 2])),
        finger(90.0),
        finger(130.0).known(unseen([0.018, FOUND])),
        head(90.0),
        head(130.0).known(unseen([0.015, 0.014])),
    ]
}

/// Kernels from less than a pixel to more than a frame, and light smaller than a pixel.
fn scales(quick: bool) -> Vec<Case> {
    // A plane that fills the frame, a texel a pixel.
    let flat = |view: &View, px_per_mm: f64, light: Box<dyn Fn(DVec3, DVec3) -> DVec3>| {
        Scene(vec![Surface::new(
            Form::facing(f64::from(view.size[0]) / px_per_mm),
            light,
        )])
    };
    let kernel = |width_px: f64| {
        // σ of skin's red in mm.
        let px_per_mm = width_px / 1.176;
        let side = if quick { 128 } else { 256 };
        // Where the middle of the frame sees all that scatters to it, there is a closed form.
        let is_cut = f64::from(side) / px_per_mm / 2.0 < REACH_MM + 12.0 / px_per_mm;
        let run = move |lab: &Lab| {
            let view = View::orthographic([side; 2], px_per_mm);
            let (across, blur_mm2) = (direction(27.0), px_per_mm.powi(-2));
            let paper = |h: &Hit| scattered_step(h.point.dot(across), blur_mm2, &Profile::SKIN);
            let light = move |p: DVec3, _| DVec3::splat(step(p.dot(across), blur_mm2));
            let crop = Crop::middle(&view, [24, 12]);
            Trial {
                atlas: Some(([side; 2], seen_or(!is_cut, &paper))),
                ..Trial::new(
                    flat(&view, px_per_mm, Box::new(light)),
                    view,
                    crop,
                    seen_or(!is_cut, &paper),
                )
            }
            .run(lab)
        };
        let what = format!(
            "A soft edge of light (σ of 1 px) at 27 degrees on skin that faces the camera, so \
             far away that the red of the profile has this σ: largest difference in the middle \
             24x12 pixels to {}.",
            if is_cut {
                "the visible integral, since the frame cuts the kernel"
            } else {
                "the closed form"
            }
        );
        Case::new(format!("kernel of {width_px} px"), what, PROMISE, run)
    };
    let small = |name: &str, what: &str, px_per_mm: f64, light: fn(DVec3) -> bool| {
        let run = move |lab: &Lab| {
            let view = View::orthographic([96; 2], px_per_mm);
            let light = move |p: DVec3, _| DVec3::splat(f64::from(u8::from(light(p))));
            let crop = Crop::middle(&view, [48, 24]);
            Trial {
                atlas: Some(([96; 2], Truth::Visible)),
                ..Trial::new(
                    flat(&view, px_per_mm, Box::new(light)),
                    view,
                    crop,
                    Truth::Visible,
                )
            }
            .run(lab)
        };
        let what = format!(
            "{what} Pixels hit or miss it, which is no method's error: largest difference to the \
             visible integral of the frame as it is, which is itself known to 0.0026."
        );
        Case::new(name, what, GRADIENT, run)
    };
    let line = |p: DVec3| p.dot(direction(100.0)).abs() < 0.05;
    let freckles = |p: DVec3| {
        let at = DVec2::from_angle(0.3).rotate(p.truncate()) / 5.3;
        5.3 * (at - at.floor() - 0.5).length() > 0.5
    };
    vec![
        kernel(0.1),
        kernel(0.5),
        kernel(2.0),
        kernel(10.0),
        kernel(50.0).unpictured(),
        kernel(200.0),
        small(
            "a line of light 0.1 mm wide",
            "A lit line at 10 degrees on dark skin, 0.1 mm wide, 2 px/mm.",
            2.0,
            line,
        ),
        small(
            "freckles of 1 mm",
            "Dark discs of 1 mm, one in 5.3 mm, on lit skin, 0.3 px/mm.",
            0.3,
            freckles,
        ),
    ]
}
