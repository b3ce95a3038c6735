//! The border of the frame, which cuts the kernel.

use glam::{DVec2, DVec3};
use subsurface::Profile;

use super::scene::{Form, Scene, Surface, from_camera, lambert};
use super::trial::{Trial, Truth};
use super::{FOUND, SEEN, by_nature, known};
use crate::stability::case::{Case, Group, Known};
use crate::stability::cases::Crop;
use crate::synthetic::{Hit, View};
use crate::truth::closed_form::{scattered_cosine, scattered_step, step};

const SIDE: u32 = 128;
const PX_PER_MM: f64 = 4.0;

/// What lies within 8 mm of the right border, around its middle.
fn band(quick: bool) -> Crop {
    let height = if quick { 20 } else { 96 };
    Crop {
        first: [SIDE - 32, (SIDE - height) / 2],
        size: [32, height],
    }
}

/// The middle of the right border.
fn border_mm() -> DVec3 {
    DVec3::X * f64::from(SIDE) / PX_PER_MM / 2.0
}

pub fn cases(quick: bool) -> Vec<Case> {
    vec![
        edge(true, quick),
        edge(false, quick),
        half_a_head(true, quick),
        half_a_head(false, quick),
    ]
}

/// `is_whole`: held to what lies outside of the frame, too.
fn case(
    name: &str,
    what: &str,
    is_whole: bool,
    known: Vec<Known>,
    run: crate::stability::case::Run,
) -> Case {
    let (against, held_to) = if is_whole {
        ("all that there is", "the integral over the whole surface")
    } else {
        (
            "what is seen",
            "the visible integral, which ends with the frame; texture space knows no frame, and is left out",
        )
    };
    Case {
        group: Group::Screen,
        name: format!("{name}, against {against}"),
        what: format!("{what}, 4 px/mm: the largest difference within 8 mm of the border to {held_to}."),
        passes: FOUND,
        degrades: SEEN,
        why: ".01 is what an eye may find in a gradient, and what jumps when something enters the picture.".into(),
        known,
        run,
    }
}

/// A soft edge that leaves the frame.
fn edge(is_whole: bool, quick: bool) -> Case {
    let known = if is_whole {
        not_seen(0.24)
    } else {
        goes_on(0.014)
    };
    let run = Box::new(move |lab: &_| {
        let blur_mm2 = PX_PER_MM.powi(-2);
        let across = DVec2::from_angle(27f64.to_radians()).extend(0.0);
        let place = move |from_border: DVec3| from_border.dot(across);
        // Its atlas lies around the middle of the border.
        let surface = Surface::new(Form::facing(48.0), move |point, _| {
            DVec3::splat(step(place(point), blur_mm2))
        });
        let surface = surface.moved(border_mm());
        let middle_mm = surface.middle_mm;
        let paper =
            |hit: &Hit| scattered_step(place(hit.point - middle_mm), blur_mm2, &Profile::SKIN);
        Trial {
            scene: Scene(vec![surface]),
            view: View::orthographic([SIDE; 2], PX_PER_MM),
            background: 0.0,
            crop: band(quick),
            asked: &|_| true,
            screen: if is_whole {
                Truth::Paper(&paper)
            } else {
                Truth::Visible
            },
            texture: is_whole.then_some(([192; 2], Truth::Paper(&paper))),
        }
        .run(lab)
    });
    let what = "An edge of light with a σ of a pixel that leaves the frame at 27 degrees";
    case("an edge at the border", what, is_whole, known, run)
}

/// What a plan makes of the border.
fn goes_on(at_most: f64) -> Vec<Known> {
    let why = "Beyond the frame its pyramid continues the light at the border. Where the light itself goes on so, that is \
               nearer to the whole truth, but it is not what is seen. Draw a frame that is 8 mm wider on all sides, or take \
               `ScreenSpace`.";
    vec![known("screen_planned", at_most, why)]
}

/// What no method in screen space is spared.
fn not_seen(at_most: f64) -> Vec<Known> {
    let why = "Light from outside the frame reaches its inside, and the frame does not hold it. Draw a frame that is 8 mm \
               wider on all sides and crop it after scattering, or take `TextureSpace`.";
    ["screen_exact", "screen_planned"]
        .map(|method| by_nature(method, at_most, why))
        .into()
}

/// A head of which the frame shows the darker half.
fn half_a_head(is_whole: bool, quick: bool) -> Case {
    let known = if is_whole {
        not_seen(0.065)
    } else {
        goes_on(0.015)
    };
    let run = Box::new(move |lab: &_| {
        const RHO_MM: f64 = 10.0;
        let light = from_camera(60.0, DVec3::X);
        let head = Surface::new(Form::Sphere { rho_mm: RHO_MM }, lambert(light));
        let scattered = scattered_cosine(RHO_MM, &Profile::SKIN);
        let paper = |hit: &Hit| scattered(hit.normal.dot(light));
        // Where a silhouette hides nothing that matters.
        let inside = |hit: &Hit| hit.normal.z > 0.5;
        Trial {
            scene: Scene(vec![head.moved(border_mm())]),
            view: View::orthographic([SIDE; 2], PX_PER_MM),
            background: 0.0,
            crop: band(quick),
            asked: if is_whole { &inside } else { &|_| true },
            screen: if is_whole {
                Truth::Paper(&paper)
            } else {
                Truth::Visible
            },
            texture: is_whole.then_some(([160; 2], Truth::Paper(&paper))),
        }
        .run(lab)
    });
    let what = if is_whole {
        "A ball of 10 mm radius whose middle lies on the border, lit at 60 degrees from outside the frame, where it is \
         turned by less than 60 degrees from the camera"
    } else {
        "A ball of 10 mm radius whose middle lies on the border, lit at 60 degrees from outside the frame, without a rim \
         of one pixel"
    };
    case("half a head", what, is_whole, known, run)
}
