//! The camera turns about its own axis.

use std::f64::consts::FRAC_PI_2;

use glam::{DAffine3, DVec2, DVec3};
use subsurface::Profile;

use super::atlas::Sheet;
use super::follow::{FOLLOWED, Scene, grid, swing};
use super::{FOUND, PX_PER_MM, STEP, WHY_SWING};
use crate::stability::case::{Case, Group, Known};
use crate::synthetic::{View, plane};
use crate::truth::closed_form::scattered_spot;

/// A spot of light, and a camera that turns about its own axis.
pub fn case(quick: bool) -> Case {
    Case {
        group: Group::Time,
        name: "camera rolls over a spot".into(),
        what: format!(
            "A spot of light on a plane, with a σ of 2 px at 4 px/mm, under a camera that turns by 90 degrees about its axis; 2 \
             texels a pixel. A kernel that is not round turns with the camera. {FOLLOWED}"
        ),
        passes: STEP,
        degrades: FOUND,
        why: WHY_SWING.into(),
        known: vec![Known {
            method: "texture_separable",
            at_most: 0.0095,
            by_nature: false,
            why: "The final pass fetches bilinearly, which flattens the tip of the spot wherever a pixel falls between texels. Take a \
                  finer atlas, or a cubic fetch."
                .into(),
        }],
        run: Box::new(move |lab| {
            let sheet = Sheet {
                middle: DVec3::new(0.0, 0.0, -300.0),
                along: DVec3::X,
                across: DVec3::Y,
                side_mm: 32.0,
            };
            let (spot, spot_mm2) = (DVec2::new(0.13, 0.21), (2.0 / PX_PER_MM).powi(2));
            let irradiance = |place: DVec2| {
                DVec3::splat((-place.distance_squared(spot) / (2.0 * spot_mm2)).exp())
            };
            let surface = plane(DVec3::Z, 300.0, |p| irradiance(p.truncate()));
            let scene = Scene {
                surface: &surface,
                scattered: &|point| {
                    let r_mm = sheet.place(point).distance(spot);
                    scattered_spot(r_mm, spot_mm2, &Profile::SKIN)
                },
                atlas: sheet.unwrap(256, irradiance),
                uv: &|point| sheet.uv(point),
                points: grid(3.0).map(|place| sheet.point(spot + place)).collect(),
            };
            let turns = if quick { 15 } else { 90 };
            let turned = |i: u32| FRAC_PI_2 * f64::from(i) / f64::from(turns);
            let cameras: Vec<DAffine3> = (0..=turns)
                .map(|i| DAffine3::from_rotation_z(turned(i)))
                .collect();
            let view = View::orthographic([128; 2], PX_PER_MM);
            Ok(swing(&scene.follow(lab, view, &cameras)?))
        }),
    }
}
