//! The light moves, the camera does not: every pixel shows the same point of the surface in each frame.

use std::cell::OnceCell;
use std::rc::Rc;

use crate::Error;
use glam::{DVec2, DVec3, Vec3};
use subsurface::Profile;

use super::super::{Crop, Results, largest, unpictured};
use super::atlas::{Sheet, sphere_uv, unwrapped_sphere};
use super::track::Track;
use super::{FOUND, PX_PER_MM, SEEN, STEP, WHY_STEP, WHY_SWING};
use crate::stability::case::{Case, Group, Known, Outcome, Run};
use crate::stability::frame::Texels;
use crate::stability::lab::Lab;
use crate::stability::unwrapped::Unwrapped;
use crate::synthetic::{GBuffer, Hit, View, plane, sphere};
use crate::truth::closed_form::{scattered_cosine, scattered_step, step};

pub fn cases(quick: bool) -> Vec<Case> {
    let mut cases = turning_light(quick);
    cases.push(off_and_on());
    cases.extend(moving_edge(quick));
    cases
}

/// A track that several cases look at, made by the first of them.
type Shared = Rc<OnceCell<Result<Track, Error>>>;

/// A case that takes its figures from a shared track, and shows `points` of it.
fn looks_at(
    shared: &Shared,
    make: impl Fn(&Lab) -> Result<Track, Error> + 'static,
    figures: fn(&Track) -> Vec<(&'static str, f64)>,
    points: std::ops::Range<usize>,
) -> Run {
    let shared = shared.clone();
    Box::new(move |lab| {
        let track = shared.get_or_init(|| make(lab)).as_ref();
        let track = track.map_err(Clone::clone)?;
        Ok(Outcome {
            figures: figures(track),
            shown: Some(track.show(points.clone())),
        })
    })
}

/// What every method makes of a frame, and of an atlas of the same surface, at some pixels.
fn at_pixels(
    lab: &Lab,
    g: &GBuffer,
    pixels: &[(usize, Hit)],
    atlas: &Unwrapped,
    uv: impl Fn(&Hit) -> DVec2,
) -> Result<Results, Error> {
    let frame = Texels::of(g, DVec3::ZERO).upload(&lab.gpu);
    let results = lab.scatter(&frame.inputs(), &frame.output)?.into_iter();
    let mut results: Results = results
        .map(|(m, r)| (m, pixels.iter().map(|(i, _)| r[*i]).collect()))
        .collect();
    let uvs: Vec<DVec2> = pixels.iter().map(|(_, h)| uv(h)).collect();
    results.extend(atlas.scatter(lab, &uvs)?);
    Ok(results)
}

/// The pixels of a crop that see skin, with what they see.
fn seen(g: &GBuffer, crop: Crop) -> Vec<(usize, Hit)> {
    let pixels = crop.pixels(g.view.size[0]).into_iter();
    pixels.filter_map(|i| g.hits[i].map(|h| (i, h))).collect()
}

/// The middle row of a crop, all of which sees skin.
fn middle_row(crop: Crop) -> std::ops::Range<usize> {
    let [width, height] = crop.size.map(|s| s as usize);
    height / 2 * width..(height / 2 + 1) * width
}

/// Every method's errors.
fn errors<'a>(
    results: &'a Results,
    truth: &'a [DVec3],
) -> impl Iterator<Item = (&'static str, Vec<DVec3>)> + 'a {
    results.iter().map(move |(method, r)| {
        let pairs = r.iter().zip(truth);
        (*method, pairs.map(|(r, t)| r.as_dvec3() - t).collect())
    })
}

/// A ball of 10 mm at 4 px/mm.
const RHO_MM: f64 = 10.0;
const BALL: DVec3 = DVec3::new(0.0, 0.0, -300.0);
const BALL_PX: u32 = 88;

/// Where n_z is above .5 in all of it.
const ON_BALL: Crop = Crop {
    first: [20; 2],
    size: [48; 2],
};

fn ball(light: impl Fn(DVec3) -> DVec3) -> GBuffer {
    View::orthographic([BALL_PX; 2], PX_PER_MM).shoot(sphere(RHO_MM, -BALL.z, light))
}

fn turning_light(quick: bool) -> Vec<Case> {
    // The terminator crosses what is counted from 30 to 150 degrees.
    let degrees = if quick { 70..=86 } else { 0..=150 };
    let turn = move |lab: &Lab| {
        let scattered = scattered_cosine(RHO_MM, &Profile::SKIN);
        let mut track = Track::default();
        for degree in degrees.clone() {
            let (sin, cos) = f64::from(degree).to_radians().sin_cos();
            let sun = DVec3::new(sin, 0.3, cos).normalize();
            let light = |n: DVec3| DVec3::splat(n.dot(sun).max(0.0));
            let g = ball(light);
            let pixels = seen(&g, ON_BALL);
            let atlas = unwrapped_sphere(RHO_MM, BALL, 96, light);
            let results = at_pixels(lab, &g, &pixels, &atlas, |h| sphere_uv(h.normal))?;
            let truth = pixels.iter().map(|(_, h)| scattered(h.normal.dot(sun)));
            let truth: Vec<DVec3> = truth.collect();
            track.push(degree, truth.clone(), errors(&results, &truth));
        }
        Ok(track)
    };
    let what = "A sphere of 10 mm radius at 4 px/mm under a light that turns by a degree a frame, its terminator crossing what is \
                seen; where n_z is above .5, against the closed form. Step: the most that the error at a pixel changes by from \
                one frame to the next. Error: the largest of all frames.";
    let shared = Shared::default();
    vec![
        Case {
            group: Group::Time,
            name: "light turns: step".into(),
            what: what.into(),
            passes: STEP,
            degrades: FOUND,
            why: WHY_STEP.into(),
            known: vec![],
            run: looks_at(&shared, turn.clone(), Track::step, middle_row(ON_BALL)),
        },
        Case {
            group: Group::Time,
            name: "light turns: error".into(),
            what: what.into(),
            passes: FOUND,
            degrades: SEEN,
            why: "as for a picture that stands still, .01 is what an eye may find in a gradient, .03 what is seen at a \
                  glance."
                .into(),
            known: vec![Known {
                method: "screen_planned",
                at_most: 0.0115,
                by_nature: false,
                why: "By less than .0005, in the full form alone: on a ball the pyramid's own blur does not know of the bend, and its \
                      taps make up for that in part (docs/method.md). `ScreenSpace` passes."
                    .into(),
            }],
            run: looks_at(&shared, turn, Track::worst, middle_row(ON_BALL)),
        },
    ]
}

fn off_and_on() -> Case {
    Case {
        group: Group::Time,
        name: "light switched off and on".into(),
        what: "The same sphere in three frames, lit, black, and lit as before: the largest value of the black frame's result, or \
               the largest difference between those of the others, whichever is more."
            .into(),
        passes: 0.0,
        degrades: STEP,
        why: "a method without memory makes black of black, and the same of the same to the last bit; an afterglow is \
              seen from a step of eight bits on."
            .into(),
        known: vec![],
        run: Box::new(|lab| {
            let sun = DVec3::new(-0.6, 0.3, 0.7).normalize();
            let shown = |brightness: f64| {
                let light = |n: DVec3| DVec3::splat(brightness * n.dot(sun).max(0.0));
                let g = ball(light);
                let pixels = g.pixels(|_| true);
                let atlas = unwrapped_sphere(RHO_MM, BALL, 96, light);
                at_pixels(lab, &g, &pixels, &atlas, |h| sphere_uv(h.normal))
            };
            let (lit, black, again) = (shown(1.0)?, shown(0.0)?, shown(1.0)?);
            let figure = |i: usize| {
                let changes = lit[i].1.iter().zip(&again[i].1).map(|(a, b)| *b - *a);
                let all = changes.chain(black[i].1.iter().copied());
                largest(all.flat_map(|c: Vec3| c.abs().as_dvec3().to_array()))
            };
            let methods = lit.iter().enumerate();
            Ok(Outcome {
                figures: methods.map(|(i, (m, _))| (*m, figure(i))).collect(),
                shown: None,
            })
        }),
    }
}

/// Of the frames of the moving edge, ± 3.25 mm: what is farther than 9.6 mm from the frame's border.
const EDGE_PX: u32 = 104;
const AT_EDGE: Crop = Crop {
    first: [39; 2],
    size: [26; 2],
};

fn moving_edge(quick: bool) -> Vec<Case> {
    let frames = if quick { 17 } else { 81 };
    let sweep = move |lab: &Lab| {
        let sheet = Sheet {
            middle: DVec3::new(0.0, 0.0, -300.0),
            along: DVec3::X,
            across: DVec3::Y,
            side_mm: f64::from(EDGE_PX) / PX_PER_MM,
        };
        let across = DVec2::from_angle(27f64.to_radians());
        let blur_mm2 = PX_PER_MM.powi(-2);
        let mut track = Track::default();
        for frame in 0..frames {
            // An eighth of a pixel a frame, so that ever more is lit.
            let moved_mm = (f64::from(frame) - f64::from(frames) / 2.0) / 8.0 / PX_PER_MM;
            let light = |place: DVec2| DVec3::splat(step(place.dot(across) + moved_mm, blur_mm2));
            let view = View::orthographic([EDGE_PX; 2], PX_PER_MM);
            let g = view.shoot(plane(DVec3::Z, 300.0, |p| light(p.truncate())));
            let pixels = seen(&g, AT_EDGE);
            let atlas = sheet.unwrap(EDGE_PX, light);
            let results = at_pixels(lab, &g, &pixels, &atlas, |h| sheet.uv(h.point))?;
            let place_mm = |h: &Hit| h.point.truncate().dot(across) + moved_mm;
            let truth = pixels
                .iter()
                .map(|(_, h)| scattered_step(place_mm(h), blur_mm2, &Profile::SKIN));
            let truth: Vec<DVec3> = truth.collect();
            track.push(frame, truth.clone(), errors(&results, &truth));
        }
        Ok(track)
    };
    let what = "A shadow's edge at 27 degrees, with a σ of a pixel at 4 px/mm, draws back over a plane by an eighth of a pixel a \
                frame; within 3 mm of its middle, against the closed form. A texel is a pixel, so that fetches change nothing. \
                Error: the largest of all frames. Swing: the most that the error at a pixel swings, from peak to peak. Never \
                darker: the most that a pixel falls by from one frame to the next, where all light rises. In the picture a \
                frame is a row.";
    let shared = Shared::default();
    let case = |name: &str, passes, degrades, why: &str, figures| Case {
        group: Group::Time,
        name: format!("shadow moves: {name}"),
        what: what.into(),
        passes,
        degrades,
        why: why.into(),
        known: vec![],
        run: looks_at(&shared, sweep, figures, middle_row(AT_EDGE)),
    };
    vec![
        case(
            "error",
            STEP,
            FOUND,
            "1/255 is a step of eight bits; .01 is what an eye may find in a gradient.",
            Track::worst,
        ),
        // The picture of the error shows it.
        unpictured(case("swing", STEP, FOUND, WHY_SWING, Track::swing)),
        case(
            "never darker",
            HALF_STEP,
            STEP,
            "half floats have steps of .0005 below white, so that a result may fall by one where it hardly moves; 1/255 is a \
             step of eight bits.",
            Track::fall,
        ),
    ]
}

/// What half floats differ by below white.
const HALF_STEP: f64 = 1.0 / 2048.0;
