//! The camera comes closer.

use glam::{DVec2, DVec3};
use subsurface::{Plan, Profile};

use super::atlas::Sheet;
use super::track::{Track, errors, taps};
use super::{FOUND, STEP, WHY_STEP};
use crate::stability::case::{Case, Group, Outcome};
use crate::stability::frame::Texels;
use crate::stability::unwrapped::{Texel, Unwrapped};
use crate::synthetic::{View, plane};
use crate::truth::closed_form::{scattered_step, step};

/// Frames of a zoom from .3 to 30 px/mm.
const ZOOM: u32 = 200;

fn zoomed(frame: f64) -> f64 {
    0.3 * f64::powf(100.0, frame / f64::from(ZOOM))
}

/// The frames of the zoom that lie around a change of the plan's blurs.
fn around_switches(plan: &Plan) -> Vec<u32> {
    let rows = plan.rows(0);
    let blurs = |i: usize| {
        rows[i]
            .weights
            .iter()
            .rposition(|w| w.iter().any(|c| *c > 0.0))
    };
    // Weights are mixed from row to row: what is new fades in from the one to the other.
    let switches = (1..rows.len()).filter(|i| blurs(*i) != blurs(i - 1));
    let at: Vec<f64> = switches
        .flat_map(|i| [i - 1, i])
        .map(|i| (f64::from(rows[i].px_per_mm) / 0.3).log(100.0) * f64::from(ZOOM))
        .collect();
    let near = |frame: &u32| at.iter().any(|a| (a - f64::from(*frame)).abs() < 1.5);
    (0..=ZOOM).filter(near).collect()
}

/// An edge that comes closer.
pub fn case(quick: bool) -> Case {
    Case {
        group: Group::Time,
        name: "zoom by 100 times".into(),
        what: "An edge that a camera zooms in on, from .3 to 30 px/mm in 200 frames (in the quick form those around each switch of \
               the plan's levels), with a σ of 2 px in each frame, as a filtered shadow has: the most that the error at a \
               point, against the closed form, changes by from one frame to the next. The atlas has 12.8 texels/mm. \
               Frames have 8 rows; `burley_disk`, which needs as many rows as columns, is left out."
            .into(),
        passes: STEP,
        degrades: FOUND,
        why: WHY_STEP.into(),
        known: vec![],
        run: Box::new(move |lab| {
            let sheet = Sheet {
                middle: DVec3::new(0.0, 0.0, -300.0),
                along: DVec3::X,
                across: DVec3::Y,
                side_mm: 40.0,
            };
            let frames = if quick {
                around_switches(&lab.plan)
            } else {
                (0..=ZOOM).collect()
            };
            let places: Vec<f64> = (-40..=40).map(|i| 0.1 * f64::from(i)).collect();
            let mut track = Track::default();
            for frame in frames {
                let px_per_mm = zoomed(frame.into());
                let blur_mm2 = (2.0 / px_per_mm).powi(2);
                let light = |x_mm: f64| DVec3::splat(step(x_mm, blur_mm2));
                let truth = |x_mm: f64| scattered_step(x_mm, blur_mm2, &Profile::SKIN);
                let view = View::orthographic([832, 8], px_per_mm);
                let g = view.shoot(plane(DVec3::Z, 300.0, |p| light(p.x)));
                let taps = taps(&g, places.iter().map(|x| DVec3::new(*x, 0.0, -300.0)));
                let truths: Vec<DVec3> = taps.iter().map(|t| truth(t.point.x)).collect();
                let uploaded = Texels::of(&g, DVec3::ZERO).upload(&lab.gpu);
                let mut of_methods = Vec::new();
                for (method, r) in lab.scatter(&uploaded.inputs(), &uploaded.output)? {
                    if method != "burley_disk" {
                        let read = taps.iter().map(|t| r[t.pixel]);
                        of_methods.push((method, errors(&taps, &truths, read)));
                    }
                }
                let atlas = Unwrapped::new([512, 8], |uv| {
                    let x_mm = (uv.x - 0.5) * sheet.side_mm;
                    let y_mm = (uv.y - 0.5) * 8.0 / 512.0 * sheet.side_mm;
                    Some(Texel {
                        point_mm: DVec3::new(x_mm, y_mm, -300.0),
                        irradiance: light(x_mm),
                        area_mm2: (sheet.side_mm / 512.0).powi(2),
                    })
                });
                let uvs = taps.iter().map(|t| DVec2::new(t.point.x / sheet.side_mm + 0.5, 0.5));
                for (method, fetched) in atlas.scatter(lab, &uvs.collect::<Vec<_>>())? {
                    of_methods.push((method, errors(&taps, &truths, fetched)));
                }
                track.push(frame, places.iter().map(|x| truth(*x)).collect(), of_methods);
            }
            Ok(Outcome {
                figures: track.step(),
                shown: Some(track.show(0..places.len())),
            })
        }),
    }
}
