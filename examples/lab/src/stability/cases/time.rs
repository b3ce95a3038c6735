//! What moves: every method's errors, its result less the truth, from frame to frame, so that nothing counts
//! that the truth does, too. In the pictures a frame is a row: what swings shows as unrest down the columns.

use std::f64::consts::FRAC_PI_2;

use glam::{DAffine3, DVec2, DVec3, Vec3};
use subsurface::{Plan, Profile};

use super::{FLICKER, FOUND, GRADIENT, REACH_MM, STEP, Shared};
use crate::Error;
use crate::stability::case::{ATLAS, Bound, Case, Figures, PLAN, known};
use crate::stability::inputs::Texels;
use crate::stability::lab::Lab;
use crate::stability::scene::{Form, Scene, Surface, direction};
use crate::stability::track::{FOLLOWED, Followed, Track, errors, grid, read, taps};
use crate::stability::trial::{Crop, merge};
use crate::synthetic::{Hit, View, largest, plane, tilted_normal};
use crate::truth::closed_form::{
    legendre, passed_harmonics, passed_wave, scattered_cosine, scattered_spot,
};

const PX_PER_MM: f64 = 4.0;
const MIDDLE: DVec3 = DVec3::new(0.0, 0.0, -300.0);

pub fn cases(quick: bool) -> Vec<Case> {
    let mut cases = vec![
        // Seen from ahead it looks as at 40 degrees.
        over_a_plane(0.0, quick).pictured(false),
        over_a_plane(40.0, quick),
        over_a_sphere(quick),
        past_a_layer(quick),
        by_whole_pixels(),
        roll(quick),
        zoom(quick),
    ];
    cases.extend(turning_light(quick));
    cases.push(off_and_on());
    cases.extend(moving_shadow(quick));
    cases
}

/// Cameras that pan over 10 px, which is what levels up to the third repeat after: in steps of an
/// eighth, or of five, which find the same fractions in another order.
fn pan(quick: bool) -> Vec<DAffine3> {
    let (count, step_px) = if quick { (17, 0.625) } else { (81, 0.125) };
    let moved = |i: u32| DVec3::new(1.0, 0.6, 0.0) * (step_px * f64::from(i) / PX_PER_MM);
    (0..count).map(|i| DAffine3::from_translation(-moved(i))).collect()
}

/// A plane under waves of all directions.
fn over_a_plane(tilt: f64, quick: bool) -> Case {
    let what = format!(
        "A plane tilted by 0 or 40 degrees in perspective, lit by waves of 8 px and longer at 4 \
         px/mm, under a camera that pans by fractions of a pixel; 2 texels a pixel. {FOLLOWED}"
    );
    let why = "Taps of the pyramid lie on lattices of whole pixels, each slope has one of its \
        own, and a simple tile one for all its pixels: a point changes from one to another as \
        tiles pass over it. Use the exact sum.";
    let case = Case::new(format!("pan over a plane at {tilt}°"), what, FLICKER, move |lab| {
        let fov_degrees = 20f64;
        let distance_mm = 64.0 / (fov_degrees / 2.0).to_radians().tan() / PX_PER_MM;
        // Radians a mm, direction, share: 2.6 is 8 px where the plane is farthest.
        let waves = [(2.6, 0.0, 0.12), (2.0, 80.0, 0.12), (1.6, 140.0, 0.12), (0.6, 35.0, 0.14)];
        let normal = tilted_normal(tilt, 15.0);
        let along = DVec3::X.reject_from_normalized(normal).normalize();
        let down = along.cross(normal);
        let light = move |point: DVec3, passed: fn(f64) -> DVec3| {
            let place = DVec3::new(point.dot(along), -point.dot(down), 0.0);
            let wave = |(rad_per_mm, degrees, share): (f64, f64, f64)| {
                let phase = rad_per_mm * direction(degrees).dot(place);
                share * phase.sin() * passed(rad_per_mm)
            };
            DVec3::splat(0.5) + waves.into_iter().map(wave).sum::<DVec3>()
        };
        let form = Form::Plane { along, down, size_mm: DVec2::splat(28.0) };
        let all = move |point, _| light(point, |_| DVec3::ONE);
        let scattered = move |point, _| light(point, |k| passed_wave(k, &Profile::SKIN));
        let moved = DVec3::Z * (300.0 - distance_mm);
        let points = grid(3.0).map(|at| MIDDLE + moved + at.x * along - at.y * down);
        let followed = Followed {
            scene: Scene(vec![Surface::solved(form, all, scattered).moved(moved)]),
            texels: [224; 2],
            points: points.collect(),
        };
        followed.swing(lab, View::perspective([128; 2], fov_degrees), &pan(quick))
    });
    case.known((tilt > 0.0).then(|| known(PLAN, 0.0095, why)))
}

const CLASSES_CHANGE: &str = "Tiles are planar or summed directly by what they hold: as light or the surface moves \
    they change their class, and with it their error. Use the exact sum.";

/// A ball with a terminator, and rings of light.
fn over_a_sphere(quick: bool) -> Case {
    const RINGS: usize = 24;
    let what = format!(
        "A ball of 10 mm radius at 4 px/mm, lit from the side and by two sets of rings 10 px \
         wide, where n_z is above 0.6; 1.5 texels a pixel. {FOLLOWED}"
    );
    Case::new("pan over a sphere", what, FLICKER, move |lab| {
        let rho_mm = 10.0;
        let sun = DVec3::new(-0.9, 0.3, 0.45).normalize();
        let poles = [DVec3::new(0.2, 0.1, 0.97), DVec3::new(-0.3, -0.2, 0.93)].map(DVec3::normalize);
        let rings = move |normal: DVec3| -> f64 {
            let at = |pole: &DVec3| legendre(normal.dot(*pole)).nth(RINGS).unwrap_or(0.0);
            poles.iter().map(at).sum()
        };
        let light = move |_, n: DVec3| DVec3::splat(0.6 * n.dot(sun).max(0.0) + 0.2 + 0.1 * rings(n));
        let scattered_sun = scattered_cosine(rho_mm, &Profile::SKIN);
        let passed = passed_harmonics(rho_mm, RINGS + 1, &Profile::SKIN)[RINGS];
        let scattered = move |_, n: DVec3| 0.6 * scattered_sun(n.dot(sun)) + 0.2 + 0.1 * passed * rings(n);
        let on_sphere = |place: DVec2| {
            let depth = (rho_mm * rho_mm - place.length_squared()).sqrt();
            MIDDLE + place.extend(depth)
        };
        let followed = Followed {
            scene: Scene(vec![Surface::solved(Form::Sphere { rho_mm }, light, scattered)]),
            texels: [304; 2],
            points: grid(5.5).map(on_sphere).collect(),
        };
        followed.swing(lab, View::orthographic([112; 2], PX_PER_MM), &pan(quick))
    })
    .known([known(PLAN, 0.0058, CLASSES_CHANGE)])
}

/// A dark layer before a lit one, and points beside its edge.
fn past_a_layer(quick: bool) -> Case {
    const COLUMNS: usize = 24;
    let what = "A dark half-plane 5 mm before a lit one, its edge at 27 degrees, 4 px/mm, under \
        a camera that pans by fractions of a pixel. Points of the lit one, 0.75 to 4.4 mm beside \
        the edge, are followed and read by Catmull-Rom: the most that the error at one of them, \
        against the visible integral of each frame, swings from peak to peak. In texture space \
        nothing moves here.";
    Case::new("pan past a layer", what, FLICKER, move |lab| {
        let across = DVec2::from_angle(27f64.to_radians());
        // The edge lies beside the middle of the frame, the points to both sides of it.
        let from_edge = |point: DVec3| point.truncate().dot(across) + 2.6;
        let near = plane(DVec3::Z, 295.0, |_| DVec3::ZERO);
        let far = plane(DVec3::Z, 300.0, |_| DVec3::ONE);
        let point = |y_mm, i| across.rotate(DVec2::new(0.75 + 0.16 * i as f64 - 2.6, y_mm)).extend(-300.0);
        let rows = [-0.7, 0.9].into_iter();
        let points: Vec<DVec3> = rows.flat_map(|y| (0..COLUMNS).map(move |i| point(y, i))).collect();
        let view = View::orthographic([128; 2], PX_PER_MM);
        let mut track = Track::default();
        for (number, to_view) in (0..).zip(pan(quick)) {
            let moved = to_view.translation;
            let g = view.shoot(|origin, ray| {
                let origin = origin - moved;
                let edge = near(origin, ray).filter(|h| from_edge(h.point) < 0.0);
                let hit = edge.or_else(|| far(origin, ray))?;
                let point = hit.point + moved;
                Some(Hit { point, ..hit })
            });
            let frame = Texels::of(&g, 0.0).upload(&lab.gpu);
            let results = lab.scatter(&frame.frame(), &frame.output)?.into_iter();
            let taps = taps(&g, points.iter().map(|p| *p + moved));
            let asked: Vec<usize> = taps.iter().map(|t| t.pixel).collect();
            let truths = g.visible_integral(&asked, &Profile::SKIN);
            let results = results.map(|(m, r)| (m, errors(&taps, &truths, asked.iter().map(|i| r[*i]))));
            track.push(number, read(&taps, truths.iter().copied()), results);
        }
        Ok(track.outcome(Track::swing, 0..COLUMNS))
    })
    .known([known(PLAN, if quick { 0.0155 } else { 0.024 }, CLASSES_CHANGE)])
}

/// An edge along a column, and a camera that pans along it by whole pixels.
fn by_whole_pixels() -> Case {
    let what = "A soft edge of light (σ of 1 px) along the columns, 4 px/mm, and a camera that \
        pans along it by whole pixels. The frame stays the same, and so do the results, while \
        points of the surface move up through them: the most that the error at one of them \
        swings. Noise that is drawn for each pixel of the frame does not move with the skin.";
    Case::new("pan by whole pixels", what, FLICKER, |lab| {
        let border = (REACH_MM * PX_PER_MM).ceil() as u32;
        let side = 112 - 2 * border;
        let (truth, errors) = still(lab, edge(28.0, DVec3::X, 0.0), 112, side, 112)?;
        let mut track = Track::default();
        for number in 0..side {
            let row = (number * side) as usize..((number + 1) * side) as usize;
            let errors = errors.iter().map(|(m, e)| (*m, e[row.clone()].to_vec()));
            track.push(number, truth[row.clone()].to_vec(), errors);
        }
        Ok(track.outcome(Track::swing, 0..side as usize))
    })
}

/// A spot of light, and a camera that turns about its own axis.
fn roll(quick: bool) -> Case {
    let what = format!(
        "A spot of light on a plane, σ of 2 px at 4 px/mm, under a camera that turns by 90 \
         degrees about its axis; 2 texels a pixel. A kernel that is not round turns with the \
         camera. {FOLLOWED}"
    );
    let why = "The final pass fetches bilinearly, which flattens the tip of the spot wherever a \
        pixel falls between texels. Use a finer atlas, or a cubic fetch.";
    Case::new("camera rolls over a spot", what, FLICKER, move |lab| {
        let (spot, spot_mm2) = (DVec3::new(0.13, 0.21, 0.0), (2.0 / PX_PER_MM).powi(2));
        let light = move |p: DVec3, _| DVec3::splat((-p.distance_squared(spot) / (2.0 * spot_mm2)).exp());
        let scattered = move |p: DVec3, _| scattered_spot(p.distance(spot), spot_mm2, &Profile::SKIN);
        let turns = if quick { 15 } else { 90 };
        let turned = |i| DAffine3::from_rotation_z(FRAC_PI_2 * f64::from(i) / f64::from(turns));
        let cameras: Vec<DAffine3> = (0..=turns).map(turned).collect();
        let followed = Followed {
            scene: Scene(vec![Surface::solved(Form::facing(32.0), light, scattered)]),
            texels: [256; 2],
            points: grid(3.0).map(|place| MIDDLE + spot + place.extend(0.0)).collect(),
        };
        followed.swing(lab, View::orthographic([128; 2], PX_PER_MM), &cameras)
    })
    .known([known(ATLAS, 0.0095, why)])
}

/// An edge that comes closer.
fn zoom(quick: bool) -> Case {
    /// Frames of a zoom from 0.3 to 30 px/mm.
    const ZOOM: u32 = 200;
    // The frames around a change of the plan's blurs.
    let around_switches = |plan: &Plan| -> Vec<u32> {
        let rows = plan.rows(0);
        let blurs = |i: usize| {
            let mut weights = rows[i].weights.iter();
            weights.rposition(|w| w.iter().any(|c| *c > 0.0))
        };
        // Weights are mixed from row to row: what is new fades in from the one to the other.
        let switches = (1..rows.len()).filter(|i| blurs(*i) != blurs(i - 1));
        let frame = |i: usize| (f64::from(rows[i].px_per_mm) / 0.3).log(100.0) * f64::from(ZOOM);
        let at: Vec<f64> = switches.flat_map(|i| [i - 1, i]).map(frame).collect();
        let near = |frame: &u32| at.iter().any(|a| (a - f64::from(*frame)).abs() < 1.5);
        (0..=ZOOM).filter(near).collect()
    };
    let what = "An edge that a camera zooms in on, from 0.3 to 30 px/mm in 200 frames (in the \
        quick form those around each switch of the plan's levels), with a σ of 2 px in each \
        frame, as a filtered shadow has: the most that the error at a point, against the closed \
        form, changes by from one frame to the next. The atlas has 12.8 texels/mm. Frames have 8 \
        rows; `burley_disk`, which needs as many rows as columns, is left out.";
    Case::new("zoom by 100 times", what, FLICKER, move |lab| {
        let frames = if quick { around_switches(&lab.plan) } else { (0..=ZOOM).collect() };
        let places: Vec<f64> = (-40..=40).map(|i| 0.1 * f64::from(i)).collect();
        let mut track = Track::default();
        for frame in frames {
            let px_per_mm = 0.3 * f64::powf(100.0, f64::from(frame) / f64::from(ZOOM));
            let form =
                Form::Plane { along: DVec3::X, down: DVec3::NEG_Y, size_mm: DVec2::new(40.0, 0.625) };
            let scene = Scene(vec![Surface::edge(form, DVec3::X, 0.0, (2.0 / px_per_mm).powi(2))]);
            let g = scene.shoot(&View::orthographic([832, 8], px_per_mm));
            let points = places.iter().map(|x| MIDDLE + DVec3::X * *x);
            let taps = taps(&g, points.clone());
            let truths: Vec<DVec3> = taps.iter().map(|t| scene.scattered(0, t.point)).collect();
            let inputs = Texels::of(&g, 0.0).upload(&lab.gpu);
            let mut results = lab.scatter(&inputs.frame(), &inputs.output)?;
            results.retain(|(m, _)| *m != "burley_disk");
            for (_, r) in &mut results {
                *r = taps.iter().map(|t| r[t.pixel]).collect();
            }
            // All rows of the atlas are the same.
            let uvs = taps.iter().map(|t| DVec2::new(scene.uv(0, t.point).x, 0.5));
            results.extend(scene.unwrap([512, 8]).scatter(lab, &uvs.collect::<Vec<_>>())?);
            let results = results.into_iter().map(|(m, r)| (m, errors(&taps, &truths, r)));
            track.push(frame, points.map(|p| scene.scattered(0, p)).collect(), results);
        }
        Ok(track.outcome(Track::step, 0..places.len()))
    })
}

/// A plane with an edge of light, σ of 1 px.
fn edge(side_mm: f64, across: DVec3, at_mm: f64) -> Surface {
    Surface::edge(Form::facing(side_mm), across, at_mm, PX_PER_MM.powi(-2))
}

/// The truth in the middle of a frame, and every method's errors there.
type Errors = (Vec<DVec3>, Vec<(&'static str, Vec<DVec3>)>);

/// One frame of a surface, `size` pixels, of which the middle `side` are looked at.
fn still(lab: &Lab, surface: Surface, size: u32, side: u32, texels: u32) -> Result<Errors, Error> {
    let scene = Scene(vec![surface]);
    let view = View::orthographic([size; 2], PX_PER_MM);
    let g = scene.shoot(&view);
    let pixels = Crop::middle(&view, [side; 2]).pixels(size).into_iter();
    let pixels: Vec<(usize, Hit)> = pixels.filter_map(|i| g.hits[i].map(|h| (i, h))).collect();
    let truth: Vec<DVec3> = pixels.iter().map(|(_, h)| scene.scattered(0, h.point)).collect();
    let inputs = Texels::of(&g, 0.0).upload(&lab.gpu);
    let mut results = lab.scatter(&inputs.frame(), &inputs.output)?;
    for (_, r) in &mut results {
        *r = pixels.iter().map(|(i, _)| r[*i]).collect();
    }
    let uvs: Vec<DVec2> = pixels.iter().map(|(_, h)| scene.uv(0, h.point)).collect();
    results.extend(scene.unwrap([texels; 2]).scatter(lab, &uvs)?);
    let off = |r: Vec<Vec3>| r.iter().zip(&truth).map(|(r, t)| r.as_dvec3() - t).collect();
    let errors = results.into_iter().map(|(m, r)| (m, off(r))).collect();
    Ok((truth, errors))
}

/// A ball under light from afar, where n_z is above 0.5.
fn lit_ball(lab: &Lab, light: DVec3) -> Result<Errors, Error> {
    still(lab, Surface::lit(BALL, light), 88, 48, 160)
}

const BALL: Form = Form::Sphere { rho_mm: 10.0 };

type Figure = fn(&Track) -> Figures;

/// Cases that take their figures from one track, and show its middle row of `width` points.
fn of_track<const N: usize>(
    make: impl Fn(&Lab) -> Result<Track, Error> + Clone + 'static,
    width: usize,
    what: &str,
    cases: [(&str, Bound, Figure); N],
) -> [Case; N] {
    let track = Shared::new();
    cases.map(|(name, bound, figures)| {
        let (make, track) = (make.clone(), track.clone());
        let first = width / 2 * width;
        let run = move |lab: &Lab| Ok(track.get(|| make(lab))?.outcome(figures, first..first + width));
        Case::new(name, what, bound, run)
    })
}

fn turning_light(quick: bool) -> [Case; 2] {
    // The terminator crosses what is counted from 30 to 150 degrees.
    let degrees = if quick { 70..=86 } else { 0..=150 };
    let make = move |lab: &Lab| {
        let mut track = Track::default();
        for degree in degrees.clone() {
            let (sin, cos) = f64::from(degree).to_radians().sin_cos();
            let (truth, errors) = lit_ball(lab, DVec3::new(sin, 0.3, cos).normalize())?;
            track.push(degree, truth, errors);
        }
        Ok(track)
    };
    let what = "A ball of 10 mm radius at 4 px/mm under a light that turns by a degree a frame, \
        its terminator crossing what is seen; where n_z is above 0.5, against the closed form. \
        Step: the most that the error at a pixel changes by from one frame to the next. Error: \
        the largest of all frames.";
    let why = "In the full form alone: the pyramid's own blur does not know \
        that the ball is bent, and its taps make up for that in part. The exact sum passes.";
    let cases: [(_, _, Figure); 2] =
        [("light turns: step", FLICKER, Track::step), ("light turns: error", GRADIENT, Track::worst)];
    let [step, error] = of_track(make, 48, what, cases);
    let step = step.known([known(PLAN, if quick { 0.0025 } else { 0.0085 }, CLASSES_CHANGE)]);
    [step, error.known([known(PLAN, 0.0125, why)])]
}

fn off_and_on() -> Case {
    let what = "The same ball in three frames, lit, black, and lit as before: the largest value \
        of the black frame's result, or the largest difference between those of the others.";
    let bound = Bound {
        passes: 0.0,
        degrades: STEP,
        why: "a method without memory makes black of black, and the same of the same to the last bit.",
    };
    Case::new("light switched off and on", what, bound, |lab| {
        let sun = DVec3::new(-0.6, 0.3, 0.7).normalize();
        let (_, lit) = lit_ball(lab, sun)?;
        let (_, black) = still(lab, Surface::even(BALL, 0.0), 88, 48, 160)?;
        let (_, again) = lit_ball(lab, sun)?;
        let mut figures = vec![];
        for ((method, lit), ((_, black), (_, again))) in lit.into_iter().zip(black.iter().zip(&again)) {
            let changes = lit.iter().zip(again).map(|(a, b)| *b - *a);
            let all = changes.chain(black.iter().copied());
            merge(&mut figures, [(method, largest(all.flat_map(|c| c.abs().to_array())))]);
        }
        Ok(figures.into())
    })
}

fn moving_shadow(quick: bool) -> [Case; 3] {
    let frames = if quick { 17 } else { 81 };
    let make = move |lab: &Lab| {
        let mut track = Track::default();
        for frame in 0..frames {
            // An eighth of a pixel a frame, so that ever more is lit.
            let moved_mm = (f64::from(frame) - f64::from(frames) / 2.0) / 8.0 / PX_PER_MM;
            let shadow = edge(26.0, direction(27.0), -moved_mm);
            let (truth, errors) = still(lab, shadow, 104, 26, 104)?;
            track.push(frame, truth, errors);
        }
        Ok(track)
    };
    let what = "A shadow's edge at 27 degrees, σ of 1 px at 4 px/mm, draws back over a plane by \
        an eighth of a pixel a frame; within 3 mm of its middle, against the closed form. A \
        texel is a pixel. Error: the largest of all frames. Swing: the most that the error at a \
        pixel swings. Never darker: the most that a pixel falls by from one frame to the next, \
        where all light rises.";
    let never = Bound {
        passes: 1.0 / 2048.0,
        degrades: STEP,
        why: "half floats have steps of 0.0005 below white, so that a result may fall by one \
              where it hardly moves.",
    };
    let error = Bound { degrades: FOUND, ..super::PROMISE };
    let cases: [(_, _, Figure); 3] = [
        ("shadow moves: error", error, Track::worst),
        ("shadow moves: swing", FLICKER, Track::swing),
        ("shadow moves: never darker", never, Track::fall),
    ];
    let [error, swing, never] = of_track(make, 26, what, cases);
    // The picture of the error shows it.
    [error, swing.pictured(false), never]
}
