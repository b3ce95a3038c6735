//! Silhouettes and thin parts, before a bright background and a black one.

use glam::{DVec2, DVec3};
use subsurface::Profile;
use subsurface::truth::closed_form::scattered_cosine_around;

use super::scene::{Form, Scene, Surface, from_camera, lambert};
use super::trial::{Trial, Truth, middle};
use super::{FOUND, SEEN, known};
use crate::case::{Case, Group, Known};
use crate::common::{Hit, View};

/// Where the light comes from, off the camera's own direction and across the part.
const LIGHT_DEGREES: f64 = 50.0;

pub fn cases(quick: bool) -> Vec<Case> {
    let finger = ("a finger", 8.0, 48, [160, 64]);
    let rim = ("the rim of an ear", 0.75, 16, [40, 160]);
    let backgrounds = [("black", 0.0), ("bright", 4.0)];
    let part = |part| backgrounds.map(|background| case(part, background, quick));
    [part(finger), part(rim)].into_iter().flatten().collect()
}

/// A cylinder's name, radius, half the side of the crop and texels.
fn case(
    (part, rho_mm, half, texels): (&str, f64, u32, [u32; 2]),
    (behind, background): (&str, f64),
    quick: bool,
) -> Case {
    Case {
        group: Group::Screen,
        name: format!("{part} before {behind}"),
        what: format!(
            "A cylinder of {rho_mm} mm at 27 degrees, lit from {LIGHT_DEGREES} degrees aside, before a background of \
             {background}, 4 px/mm: the largest difference to the visible integral, a rim of a pixel left out, in \
             texture space to the integral around the whole of it."
        ),
        passes: FOUND,
        degrades: SEEN,
        why: "A halo or a dark line of .01 is what an eye may find; the rim's own pixels are a guess.".into(),
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
            Trial {
                scene: Scene(vec![Surface::new(form, lambert(light))]),
                view,
                background,
                crop: middle(&view, [2 * half, if quick { half / 2 } else { 3 * half / 2 }]),
                asked: &|_| true,
                screen: Truth::Visible,
                texture: Some((texels, Truth::Paper(&paper))),
            }
            .run(lab)
        }),
    }
}

/// Where a part is six pixels wide.
fn thin() -> Vec<Known> {
    vec![
        known(
            "screen_exact",
            0.045,
            "The outer pixels stand for most of its area, and how much they do follows from their slope, a guess where it \
             comes from the depth of neighbours. With normals handed in it is .0052 where it was .021 without. The truth, too, takes \
             the slope at a pixel's middle for all of the pixel. TextureSpace knows all of it.",
        ),
        known(
            "screen_planned",
            0.043,
            "The same, and what a coarse pixel keeps of a part that is narrower than itself; with normals handed in it is .021 where it was .030. \
             Take ScreenSpace with normals, or TextureSpace.",
        ),
    ]
}
