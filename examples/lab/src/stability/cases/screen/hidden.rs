//! Light that falls on what the camera does not see.

use glam::{DVec2, DVec3};
use subsurface::Profile;

use super::scene::{Form, Scene, Surface, from_camera, lambert};
use super::trial::{Trial, Truth, middle};
use super::{FOUND, SEEN, by_nature, known};
use crate::stability::case::{Case, Group, Known, Run};
use crate::stability::cases::unpictured;
use crate::synthetic::{Hit, View};
use crate::truth::closed_form::{scattered_cosine, scattered_cosine_around, through_slab};

pub fn cases(quick: bool) -> Vec<Case> {
    vec![
        slab(1.5),
        unpictured(slab(4.0)),
        cylinder("the rim of an ear", 0.75, 150.0, [40, 160]),
        cylinder("a finger", 8.0, 90.0, [160, 64]),
        cylinder("a finger", 8.0, 130.0, [160, 64]),
        head(90.0, quick),
        head(130.0, quick),
    ]
}

fn case(name: String, what: String, known: Vec<Known>, run: Run) -> Case {
    Case {
        group: Group::Screen,
        name,
        what,
        passes: FOUND,
        degrades: SEEN,
        why: ".01 is what an eye may find in a gradient.".into(),
        known,
        run,
    }
}

/// A lit face behind a dark one, as of an ear.
fn slab(thickness_mm: f64) -> Case {
    let what = "Two faces this far apart, the hidden one lit by 1 and the visible one not at all, 4 px/mm: the difference to what \
                Eq. 7 as printed passes (divided by the kernel's mass it would pass less). In texture space each face has an \
                island.";
    let run = Box::new(move |lab: &_| {
        const SIDE_MM: f64 = 24.0;
        let view = View::orthographic([96; 2], 4.0);
        let face =
            |light: f64| Surface::new(Form::facing(SIDE_MM), move |_, _| DVec3::splat(light));
        let through = through_slab(thickness_mm, &Profile::SKIN);
        let paper = |_: &Hit| through;
        Trial {
            scene: Scene(vec![
                face(0.0),
                face(1.0).moved(DVec3::NEG_Z * thickness_mm),
            ]),
            view,
            background: 0.0,
            crop: middle(&view, [16; 2]),
            asked: &|_| true,
            screen: Truth::Paper(&paper),
            texture: Some(([64; 2], Truth::Paper(&paper))),
        }
        .run(lab)
    });
    let at_most = through_slab(thickness_mm, &Profile::SKIN).max_element() * 1.01;
    let mut known = unseen([at_most; 2]);
    known.push(self::known(
        "texture_separable",
        at_most,
        "It knows the hidden face, but sums along the atlas, where the two faces of an ear lie apart: light gets around a \
         rim, not through the middle. Add transmission by thickness.",
    ));
    case(
        format!("an ear {thickness_mm} mm thick, lit from behind"),
        what.into(),
        known,
        run,
    )
}

/// Lit from so many degrees off the camera's direction.
fn cylinder(part: &'static str, rho_mm: f64, degrees: f64, texels: [u32; 2]) -> Case {
    let what = format!(
        "A cylinder of {rho_mm} mm radius, lit at {degrees} degrees from the camera's direction, 4 px/mm: the largest \
         difference to the closed form of all of it{}.",
        within(degrees)
    );
    let run = Box::new(move |lab: &_| {
        let view = View::orthographic([128; 2], 4.0);
        let across = DVec2::from_angle(27f64.to_radians()).extend(0.0);
        let form = Form::Cylinder {
            along: DVec3::Z.cross(across),
            rho_mm,
            length_mm: 32.0,
        };
        let scattered = scattered_cosine_around(rho_mm, &Profile::SKIN);
        let paper = |hit: &Hit| {
            let angle = hit.normal.dot(across).atan2(hit.normal.z);
            scattered(angle - degrees.to_radians())
        };
        let width = (10.0 * rho_mm) as u32 + 24;
        Trial {
            scene: Scene(vec![Surface::new(
                form,
                lambert(from_camera(degrees, across)),
            )]),
            view,
            background: 0.0,
            crop: middle(&view, [width, if rho_mm < 1.0 { 16 } else { 40 }]),
            asked: &|hit| degrees > 90.0 || hit.normal.z > 0.5,
            screen: Truth::Paper(&paper),
            texture: Some((texels, Truth::Paper(&paper))),
        }
        .run(lab)
    });
    let known = match (degrees > 90.0, rho_mm < 1.0) {
        (false, _) => vec![],
        (true, true) => unseen([0.17; 2]),
        (true, false) => unseen([0.018, 0.01]),
    };
    case(name(part, degrees), what, known, run)
}

fn head(degrees: f64, quick: bool) -> Case {
    const RHO_MM: f64 = 10.0;
    let what = format!(
        "A ball of {RHO_MM} mm radius, lit at {degrees} degrees from the camera's direction, 4 px/mm: the largest difference \
         to the closed form of all of it{}.",
        within(degrees)
    );
    let run = Box::new(move |lab: &_| {
        let view = View::orthographic([96; 2], 4.0);
        let light = from_camera(degrees, DVec2::from_angle(27f64.to_radians()).extend(0.0));
        let scattered = scattered_cosine(RHO_MM, &Profile::SKIN);
        let paper = |hit: &Hit| scattered(hit.normal.dot(light));
        Trial {
            scene: Scene(vec![Surface::new(
                Form::Sphere { rho_mm: RHO_MM },
                lambert(light),
            )]),
            view,
            background: 0.0,
            crop: middle(&view, [88, if quick { 44 } else { 88 }]),
            asked: &|hit| degrees > 90.0 || hit.normal.z > 0.5,
            screen: Truth::Paper(&paper),
            texture: Some(([160; 2], Truth::Paper(&paper))),
        }
        .run(lab)
    });
    let known = if degrees > 90.0 {
        unseen([0.015, 0.014])
    } else {
        vec![]
    };
    case(name("a head", degrees), what, known, run)
}

fn name(part: &str, degrees: f64) -> String {
    let light = if degrees > 90.0 {
        "from behind"
    } else {
        "from the side"
    };
    format!("{part} lit {light}")
}

/// From the side both sides of the terminator are seen.
fn within(degrees: f64) -> &'static str {
    if degrees > 90.0 {
        ", without a rim of one pixel"
    } else {
        ", where it is turned by less than 60 degrees from the camera"
    }
}

/// What the exact effect and a plan miss of light that the camera does not see.
fn unseen([exact, planned]: [f64; 2]) -> Vec<Known> {
    let why = "The frame holds no light of what it does not show. Take `TextureSpace` where light comes around a rim, and add \
               transmission by thickness where it comes through.";
    vec![
        by_nature("screen_exact", exact, why),
        by_nature("screen_planned", planned, why),
    ]
}
