//! Skin that the camera sees at a slant.

use crate::Error;
use glam::{DVec2, DVec3};
use subsurface::Profile;

use super::scene::{Form, Scene, Surface};
use super::trial::{Trial, Truth, middle, worst_of};
use super::{REACH_MM, SEEN, STEP, known};
use crate::stability::case::{Case, Group, Known, Outcome};
use crate::stability::cases::unpictured;
use crate::stability::lab::Lab;
use crate::synthetic::{Hit, View, tilted_normal};
use crate::truth::closed_form::{scattered_step, step};

/// Where an edge scatters anything that counts.
const NEAR_MM: f64 = 6.0;

pub fn cases(quick: bool) -> Vec<Case> {
    let tilts = [30.0, 60.0, 80.0, 85.0];
    let slopes = tilts.map(|tilt| [0.0, 45.0].map(|axis| slope(tilt, axis, quick)));
    let shown = ["slope of 60 degrees, diagonal", "slope of 85 degrees"];
    let slopes = slopes.into_iter().flatten();
    slopes
        .map(|case| {
            if shown.contains(&case.name.as_str()) {
                case
            } else {
                unpictured(case)
            }
        })
        .collect()
}

fn slope(tilt: f64, axis: f64, quick: bool) -> Case {
    let is_diagonal = axis != 0.0;
    Case {
        group: Group::Screen,
        name: format!(
            "slope of {tilt} degrees{}",
            if is_diagonal { ", diagonal" } else { "" }
        ),
        what: format!(
            "A plane tilted by so many degrees about a row of the picture, or (diagonal) about an axis at 45 degrees to the \
             rows. An edge of light on it, with a σ of a pixel, runs across the slope, down it, and between; {}. The figure \
             is the largest difference to the closed form within 6 mm. Texture space does not depend on the tilt and is \
             left out.",
            if quick { "4 px/mm" } else { "2, 4 and 8 px/mm" }
        ),
        passes: STEP,
        degrades: SEEN,
        why: "a step of eight bits, the error that a plan is made for and keeps on skin that faces the camera.".into(),
        known: misses(tilt, is_diagonal, quick),
        run: Box::new(move |lab| {
            let scales: &[f64] = if quick { &[4.0] } else { &[4.0, 2.0, 8.0] };
            let frames = scales
                .iter()
                .flat_map(|s| [0.0, 45.0, 90.0].map(|edge| (*s, edge)));
            worst_of(frames.map(|(px_per_mm, edge)| frame(lab, [tilt, axis, edge], px_per_mm)))
        }),
    }
}

/// A plane at angles in degrees: its tilt, about which axis, and the edge on it.
fn frame(lab: &Lab, [tilt, axis, edge]: [f64; 3], px_per_mm: f64) -> Result<Outcome, Error> {
    let along = DVec2::from_angle(axis.to_radians()).extend(0.0);
    let normal = tilted_normal(tilt, axis);
    let down = normal.cross(along);
    let (sin, cos) = edge.to_radians().sin_cos();
    let across = along * cos + down * sin;
    // A pixel is 1/cos(tilt) long down the slope.
    let pixel_mm = DVec2::new(cos, sin / tilt.to_radians().cos()).length() / px_per_mm;
    let blur_mm2 = pixel_mm * pixel_mm;
    let form = Form::Plane {
        along,
        down: -down,
        side_mm: 1.0,
    };
    let light = move |point: DVec3, _| DVec3::splat(step(point.dot(across), blur_mm2));
    let surface = Surface::new(form, light);
    let middle_mm = surface.middle_mm;
    let from_middle = |hit: &Hit| hit.point - middle_mm;
    let paper = |hit: &Hit| scattered_step(from_middle(hit).dot(across), blur_mm2, &Profile::SKIN);
    let near = |hit: &Hit| {
        let sides = [along, down].map(|side| from_middle(hit).dot(side));
        sides.iter().all(|mm| mm.abs() < NEAR_MM)
    };
    // All that is near, and what kernels reach from there.
    let reach_mm = along.truncate().abs() + down.truncate().abs();
    let crop_px = reach_mm * 2.0 * NEAR_MM * px_per_mm;
    let side_px = 2.0 * (NEAR_MM * reach_mm.max_element() + REACH_MM) * px_per_mm;
    let view = View::orthographic([side_px as u32; 2], px_per_mm);
    let crop = middle(&view, crop_px.ceil().as_uvec2().into());
    Trial {
        view,
        background: 0.0,
        crop,
        asked: &near,
        screen: Truth::Paper(&paper),
        texture: None,
        scene: Scene(vec![surface]),
    }
    .run(lab)
}

/// Where a plan does not keep a step, and by how much: at 4 px/mm, and at the worst of all scales.
fn misses(tilt: f64, is_diagonal: bool, quick: bool) -> Vec<Known> {
    let why = "On a steep slope taps lie further apart along its contour, and what varies there from pixel to pixel falls between \
               them. Take `ScreenSpace`, or light with a σ of two pixels.";
    let [at_4, at_all] = match (tilt as u32, is_diagonal) {
        (30, false) => [0.0053, 0.0063],
        (30, true) => return vec![],
        (60, false) => [0.0057, 0.015],
        (60, true) => [0.0095, 0.019],
        (80, false) => [0.02, 0.038],
        (80, true) => [0.023; 2],
        (_, false) => [0.042, 0.088],
        (_, true) => [0.044, 0.085],
    };
    vec![known(
        "screen_planned",
        if quick { at_4 } else { at_all },
        why,
    )]
}
