//! Silhouettes and thin parts, before a bright background and a black one.

use glam::{DVec2, DVec3};
use subsurface::Profile;

use super::scene::{Form, Scene, Surface, from_camera, lambert};
use super::trial::{Trial, Truth, middle};
use super::{FOUND, SEEN, known};
use crate::stability::case::{Case, Group, Known};
use crate::stability::cases::unpictured;
use crate::synthetic::{Hit, View};
use crate::truth::closed_form::scattered_cosine_around;

/// Where the light comes from, off the camera's own direction and across the part.
const LIGHT_DEGREES: f64 = 50.0;

pub fn cases(quick: bool) -> Vec<Case> {
    let finger = ("a finger", 8.0, 48, [160, 64]);
    let rim = ("the rim of an ear", 0.75, 16, [40, 160]);
    let part = |part| {
        let [black, bright] =
            [Before::Black, Before::Bright].map(|before| case(part, before, quick));
        // Of the background nothing is shown.
        [black, unpictured(bright)]
    };
    [part(finger), part(rim)].into_iter().flatten().collect()
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Before {
    Black,
    Bright,
}

/// A cylinder's name, radius, half the side of the crop and texels.
fn case(
    (part, rho_mm, half, texels): (&str, f64, u32, [u32; 2]),
    before: Before,
    quick: bool,
) -> Case {
    let background = if before == Before::Bright { 4.0 } else { 0.0 };
    Case {
        group: Group::Screen,
        name: match before {
            Before::Black => format!("{part} before black"),
            Before::Bright => format!("{part} before bright"),
        },
        what: format!(
            "A cylinder of {rho_mm} mm radius at 27 degrees in the picture, lit from {LIGHT_DEGREES} degrees to the side, \
             before a background of light 0 or 4, 4 px/mm: the largest difference to the visible integral, without a \
             rim of one pixel; in texture space to the closed form of all of it.",
        ),
        passes: FOUND,
        degrades: SEEN,
        why: "a halo or a dark line of .01 is what an eye may find; the slopes of the rim's own pixels are a guess, so \
              that they do not count.".into(),
        known: if rho_mm < 1.0 { thin() } else { vec![] },
        run: Box::new(move |lab| {
            let view = View::orthographic([128; 2], 4.0);
            let across = DVec2::from_angle(27f64.to_radians()).extend(0.0);
            let along = DVec3::Z.cross(across);
            let light = from_camera(LIGHT_DEGREES, across);
            let form = Form::Cylinder {
                along,
                rho_mm,
                length_mm: 32.0,
            };
            let scattered = scattered_cosine_around(rho_mm, &Profile::SKIN);
            let paper = |hit: &Hit| {
                let angle = hit.normal.dot(across).atan2(hit.normal.z);
                scattered(angle - LIGHT_DEGREES.to_radians())
            };
            let trial = Trial {
                scene: Scene(vec![Surface::new(form, lambert(light))]),
                view,
                background,
                crop: middle(&view, [2 * half, if quick { half / 2 } else { 3 * half / 2 }]),
                asked: &|_| true,
                screen: Truth::Visible,
                texture: Some((texels, Truth::Paper(&paper))),
            };
            trial.run(lab)
        }),
    }
}

/// Where a part is six pixels wide.
fn thin() -> Vec<Known> {
    let why = "Most of its area lies in the outer pixels, and a pixel's area follows from its slope, which is a guess at a \
               rim. Take `TextureSpace`.";
    vec![
        known("screen_exact", 0.033, why),
        known("screen_planned", 0.043, why),
    ]
}
