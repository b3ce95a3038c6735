//! Kernels from less than a pixel to more than a frame, and light smaller than a pixel.

use glam::{DVec2, DVec3};
use subsurface::Profile;

use super::scene::{Form, Scene, Surface};
use super::trial::{Trial, Truth, middle};
use super::{FOUND, REACH_MM, SEEN, STEP};
use crate::stability::case::{Case, Group};
use crate::stability::cases::unpictured;
use crate::synthetic::{Hit, View};
use crate::truth::closed_form::{scattered_step, step};

/// σ of skin's red, in mm.
const SIGMA_MM: f64 = 1.176;

pub fn cases(quick: bool) -> Vec<Case> {
    let widths = [0.1, 0.5, 2.0, 10.0, 50.0, 200.0].map(|width_px| match width_px {
        // As 10 and 200 px.
        50.0 => unpictured(kernel(width_px, quick)),
        _ => kernel(width_px, quick),
    });
    let small = [line(), freckles()];
    widths.into_iter().chain(small).collect()
}

/// Skin whose red has this σ in the picture, with an edge of light.
fn kernel(width_px: f64, quick: bool) -> Case {
    let px_per_mm = width_px / SIGMA_MM;
    let side = if quick { 128 } else { 256 };
    // Where the middle of the frame sees all that scatters to it, there is an answer on paper.
    let is_cut = f64::from(side) / px_per_mm / 2.0 < REACH_MM + 12.0 / px_per_mm;
    Case {
        group: Group::Screen,
        name: format!("kernel of {width_px} px"),
        what: format!(
            "An edge of light at 27 degrees, with a σ of a pixel, on skin that faces the camera, at such a distance that the \
             profile's red has this σ in the picture (1.18 mm): the largest difference in the middle 24 by 12 pixels to {}.",
            if is_cut {
                "the visible integral, since the frame cuts the kernel on all sides, as it does the atlas of texture space"
            } else {
                "the closed form"
            }
        ),
        passes: STEP,
        degrades: SEEN,
        why: "a step of eight bits, which flat skin is to keep at any distance.".into(),
        known: vec![],
        run: Box::new(move |lab| {
            let view = View::orthographic([side; 2], px_per_mm);
            let across = DVec2::from_angle(27f64.to_radians()).extend(0.0);
            let blur_mm2 = px_per_mm.powi(-2);
            let paper = |hit: &Hit| scattered_step(hit.point.dot(across), blur_mm2, &Profile::SKIN);
            let held_to = || {
                if is_cut {
                    Truth::Visible
                } else {
                    Truth::Paper(&paper)
                }
            };
            let light = move |point: DVec3, _| DVec3::splat(step(point.dot(across), blur_mm2));
            Trial {
                scene: flat(&view, px_per_mm, light),
                view,
                background: 0.0,
                crop: middle(&view, [24, 12]),
                asked: &|_| true,
                screen: held_to(),
                texture: Some(([side; 2], held_to())),
            }
            .run(lab)
        }),
    }
}

/// A plane that fills the frame, a texel a pixel.
fn flat(view: &View, px_per_mm: f64, light: impl Fn(DVec3, DVec3) -> DVec3 + 'static) -> Scene {
    let side_mm = f64::from(view.size[0]) / px_per_mm;
    Scene(vec![Surface::new(Form::facing(side_mm), light)])
}

/// Light that pixels hit or miss.
fn small(name: &str, what: &str, px_per_mm: f64, light: fn(DVec3) -> f64) -> Case {
    Case {
        group: Group::Screen,
        name: name.into(),
        what: format!(
            "{what} Pixels hit or miss it, which is no method's fault; the figure is the largest \
             difference to the visible integral of the frame as it is, and of an atlas of the same values."
        ),
        passes: FOUND,
        degrades: SEEN,
        why: ".01 is what an eye may find. Light by the pixel is not known between pixels: the truth itself is good to .0026."
            .into(),
        known: vec![],
        run: Box::new(move |lab| {
            let view = View::orthographic([96; 2], px_per_mm);
            Trial {
                scene: flat(&view, px_per_mm, move |point, _| DVec3::splat(light(point))),
                view,
                background: 0.0,
                crop: middle(&view, [48, 24]),
                asked: &|_| true,
                screen: Truth::Visible,
                texture: Some(([96; 2], Truth::Visible)),
            }
            .run(lab)
        }),
    }
}

fn line() -> Case {
    small(
        "a line of light .1 mm wide",
        "A lit line at 10 degrees on dark skin, .1 mm wide at 2 px/mm.",
        2.0,
        |point| {
            let across = DVec2::from_angle(100f64.to_radians());
            f64::from(u8::from(point.truncate().dot(across).abs() < 0.05))
        },
    )
}

fn freckles() -> Case {
    small(
        "freckles of 1 mm",
        "Dark discs of 1 mm, every 5.3 mm on lit skin, at .3 px/mm.",
        0.3,
        |point| {
            let at = DVec2::from_angle(0.3).rotate(point.truncate()) / 5.3;
            let from_middle = (at - at.floor() - 0.5) * 5.3;
            f64::from(u8::from(from_middle.length() > 0.5))
        },
    )
}
