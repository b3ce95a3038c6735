//! Where ids meet on flat skin, and pixels that are not square: no step in depth tells of either.

use glam::{DVec2, DVec3};
use subsurface::{DEFAULT_MAX_ERROR, Plan, Profile};

use super::{EVEN, GRADIENT, PROMISE, REACH_MM, noise};
use crate::Error;
use crate::stability::case::{ATLAS, Case, Outcome, PLAN, known};
use crate::stability::inputs::Texels;
use crate::stability::lab::{Lab, ours};
use crate::stability::scene::{Form, Scene, Surface, direction};
use crate::stability::trial::{Crop, Known, Trial, Truth, apart, worst, worst_of};
use crate::synthetic::{GBuffer, Hit, View, plane};
use crate::truth::closed_form::step;

const PX_PER_MM: f64 = 4.0;

pub fn cases(quick: bool) -> Vec<Case> {
    let mut cases = masks(quick);
    let odd_pixels = |ratio, at_most: [f64; 2]| odd_pixels(ratio, quick, at_most);
    cases.extend([
        odd_pixels(1.2, [0.0062, 0.008]),
        odd_pixels(1.33, [0.0172, 0.0172]),
        odd_pixels(2.0, [0.0088, 0.0088]),
        odd_pixels(3.0, [0.0141, 0.018]),
    ]);
    cases.push(same_profile());
    cases
}

/// Flat skin with a hard edge of light at 27 degrees; `id` by place in mm, across the edge and along it.
fn flat(side: u32, id: impl Fn(DVec2) -> u32) -> GBuffer {
    let view = View::orthographic([side; 2], PX_PER_MM);
    let to_edge = DVec2::from_angle(-27f64.to_radians());
    let skin = plane(DVec3::Z, 300.0, |p| DVec3::splat(step(to_edge.rotate(p.truncate()).x, 0.0)));
    view.shoot(|origin, ray| {
        let hit = skin(origin, ray)?;
        let id = id(to_edge.rotate(hit.point.truncate()));
        Some(Hit { id, ..hit })
    })
}

/// Half of all pixels, at random, by the pixel that a place lies in.
fn at_random(place_mm: DVec2) -> bool {
    let pixel = (place_mm * PX_PER_MM).floor().as_ivec2();
    noise([pixel.x as u32, pixel.y as u32]) < 0.5
}

/// Cloth, which has the id 0, on the skin, at the same depth.
fn masks(quick: bool) -> Vec<Case> {
    let case = |name: &str, bound, [of_quick, of_full]: [f64; 2], is_skin: fn(DVec2) -> bool| {
        let run = move |lab: &Lab| {
            let side: u32 = if quick { 128 } else { 176 };
            let g = flat(side, |place| u32::from(is_skin(place)));
            let frame = Texels::of(&g, 0.0).upload(&lab.gpu);
            let results = lab.scatter(&frame.frame(), &frame.output)?;
            // Farther from the border than most light goes.
            let crop = Crop::middle(&g.view, [side - 80; 2]);
            let asked = crop.pixels(side).into_iter();
            let asked = asked.filter(|i| g.hits[*i].is_some_and(|hit| hit.id == 1));
            let asked: Vec<usize> = asked.step_by(if quick { 5 } else { 1 }).collect();
            let truth = g.visible_integral(&asked, &Profile::SKIN);
            let truth: Known = asked.into_iter().zip(truth).collect();
            Ok(Outcome {
                figures: worst(&results, &truth),
                shown: (!quick).then(|| crop.show(side, &results, &truth)),
            })
        };
        let what = "Flat skin that faces the camera, 4 px/mm, under a hard edge of light, and \
            cloth (id 0) on it without a step in depth: beyond a line at right angles to the \
            edge; on half of all pixels, at random; as a net with threads of 0.25 mm, 1 mm \
            apart; as straps of 3 mm, 5 mm apart; around a hole of 3 mm radius on the edge; as \
            patches of 2 mm. Largest difference to the visible integral over the skin. An atlas \
            has no ids and is left out.";
        let why = "Coarse pixels of the pyramid that hold little skin spread its light too far. \
            Use the exact sum.";
        let case = Case::new(name, what, bound, run);
        case.known([known(PLAN, if quick { of_quick } else { of_full }, why)])
    };
    let threads = |p: DVec2| p.x.rem_euclid(1.0) >= 0.25 && p.y.rem_euclid(1.0) >= 0.25;
    let straps = |p: DVec2| p.y.rem_euclid(5.0) >= 3.0;
    let patches = |p: DVec2| {
        let [x, y] = (p / 2.0).floor().as_ivec2().to_array();
        (x + y).rem_euclid(2) == 0
    };
    vec![
        case("ids meet in a line", PROMISE, [0.015, 0.018], |p| p.y < 0.0),
        case("half of the ids, at random", GRADIENT, [0.034, 0.044], at_random).pictured(false),
        case("a net of ids", GRADIENT, [0.022, 0.027], threads),
        case("straps of ids", GRADIENT, [0.027, 0.03], straps).pictured(false),
        case("a hole of ids", GRADIENT, [0.0195, 0.0195], |p| p.length() < 3.0).pictured(false),
        case("patches of ids", GRADIENT, [0.02, 0.045], patches).pictured(false),
    ]
}

/// `ratio` times as many pixels a mm across as down, as of dynamic resolution in one axis.
fn odd_pixels(ratio: f64, quick: bool, [of_quick, of_full]: [f64; 2]) -> Case {
    const NEAR_MM: f64 = 6.0;
    let frame = move |px_per_mm: f64, edge: f64| {
        let across = direction(edge);
        let px = DVec2::new(ratio, 1.0) * px_per_mm;
        // σ of a pixel, as long as it is across the edge.
        let blur_mm2 = (across.truncate() / px).length_squared();
        let size = (2.0 * (NEAR_MM + REACH_MM) * px).as_uvec2().to_array();
        let mut view = View::orthographic(size, px_per_mm);
        view.projection.x_axis.x *= ratio;
        let scene = Scene(vec![Surface::edge(Form::facing(1.0), across, 0.0, blur_mm2)]);
        let crop = Crop::middle(&view, (2.0 * NEAR_MM * px).as_uvec2().to_array());
        Trial::new(scene, view, crop, Truth::Closed)
    };
    let what = "Flat skin that faces the camera, with so many pixels a mm across for each down, \
        4 px/mm down (1.5, 3, 4 and 6 in full), under soft edges of light (σ of 1 px) across, down \
        and between: largest difference to the closed form within 6 mm. An atlas is not in the \
        frame's pixels and is left out.";
    let why = "The blurs of the pyramid are round in pixels. Use the exact sum, or scatter \
        before the frame is stretched.";
    let scales: &[f64] = if quick { &[4.0] } else { &[4.0, 1.5, 3.0, 6.0] };
    Case::new(format!("pixels {ratio} : 1"), what, PROMISE, move |lab| {
        let frames = scales.iter().flat_map(|s| [0.0, 45.0, 90.0].map(|edge| (*s, edge)));
        worst_of(frames.map(|(scale, edge)| frame(scale, edge).run(lab)))
    })
    .known([known(PLAN, if quick { of_quick } else { of_full }, why)])
    .pictured(false)
}

/// A face and a neck of two ids and one profile.
fn same_profile() -> Case {
    let run = |lab: &Lab| -> Result<Outcome, Error> {
        let gpu = &lab.gpu;
        let plan = Plan::new(&[Profile::SKIN; 2], DEFAULT_MAX_ERROR)?;
        let ids: [fn(DVec2) -> u32; 2] = [|_| 1, |p| if p.x + p.y < 0.0 { 1 } else { 2 }];
        let frames = ids.map(|id| Texels::of(&flat(96, id), 0.0).upload(gpu));
        let mut methods = ours(gpu, &plan)?;
        methods.retain(|(name, _)| *name != ATLAS);
        let mut both = Vec::new();
        for frame in &frames {
            let mut results = Vec::new();
            for (name, method) in &mut methods {
                method.scatter(gpu, frame)?;
                results.push((*name, lab.read(&frame.output)));
            }
            both.push(results);
        }
        let pixels: Vec<usize> = (0..96 * 96).collect();
        Ok(apart(&both[0], &both[1], &pixels).into())
    };
    let what = "Flat skin under a hard edge of light, 4 px/mm, of one id; and with another id of \
        the same profile beyond a line that crosses it: largest difference of a method to \
        itself. Rivals take one profile.";
    Case::new("two ids of one profile", what, EVEN, run)
}
