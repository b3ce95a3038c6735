//! Light: none, hardly any, the most that half floats hold, and what is no number.

use glam::{DVec2, DVec3, Vec3};
use half::f16;
use subsurface::Error;

use super::{EVEN, SEEN};
use crate::case::{Case, Group, Known, Outcome};
use crate::cases::surface::Surface;
use crate::cases::{Crop, Results, apart, worst};
use crate::common::{View, plane, sphere};
use crate::lab::Lab;

pub fn cases(quick: bool) -> Vec<Case> {
    let side = if quick { 96 } else { 192 };
    let bad = [
        ("NaN", f32::NAN),
        ("infinity", f32::INFINITY),
        ("minus infinity", f32::NEG_INFINITY),
    ];
    let mut cases: Vec<Case> = [0.0, 1e-6, 1e4, 65504.0].map(|e| constant(e, side)).into();
    cases.push(saturated(side));
    for (name, value) in bad {
        cases.push(lost_pixels(name, value, side));
        cases.push(change(name, value, side));
    }
    cases.push(negative(side));
    cases
}

/// A ball of skin under light that is the same everywhere.
fn constant(light: f32, side: u32) -> Case {
    let (passes, degrades, why) = match light {
        0.0 => (
            0.0,
            f64::from(f16::MIN_POSITIVE_SUBNORMAL),
            "Nothing comes of nothing; a step of a half float is what a host might never find.",
        ),
        1e-6 => (
            0.06,
            0.5,
            "So close to 0 a step of a half float is 6 %; who loses half of the light loses it in every pass.",
        ),
        _ => (
            EVEN,
            SEEN,
            "Skin neither adds nor takes energy; .2 % is what flat skin may be off by, and four steps of the half \
             floats that results are stored in.",
        ),
    };
    Case {
        group: Group::Numbers,
        name: format!("light of {light:?} throughout"),
        what: "A ball of 12 mm before a background of the same light, 3 px/mm: the largest difference to that light, \
               as a share of it (where there is any)."
            .into(),
        passes,
        degrades,
        why: why.into(),
        known: vec![],
        run: Box::new(move |lab| {
            let view = View::perspective([side; 2], 0.0625 * f64::from(side));
            let e = DVec3::splat(f16::from_f32(light).into());
            let g = view.shoot(sphere(12.0, 300.0, |_| e));
            let surface = Surface::of(&g, e);
            let truth: Vec<_> = surface.skin().into_iter().map(|i| (i, e)).collect();
            let results = surface.upload(&lab.gpu).scatter(lab)?;
            let whole = if light == 0.0 { 1.0 } else { e.x };
            let figures = worst(&results, &truth).into_iter();
            Ok(Outcome {
                figures: figures.map(|(m, f)| (m, f / whole)).collect(),
                shown: None,
            })
        }),
    }
}

/// A flat face of skin, `side` pixels at 6 px/mm; no skin on the last sixth of each row.
fn face(side: u32, light: impl Fn(DVec3) -> f64) -> Surface {
    let view = View::orthographic([side; 2], 6.0);
    let g = view.shoot(plane(DVec3::Z, 300.0, |p| DVec3::splat(light(p))));
    let mut surface = Surface::of(&g, DVec3::ZERO);
    for i in (0..side * side).filter(|i| i % side >= side / 6 * 5) {
        surface.clear(i as usize);
    }
    surface
}

/// The most that half floats hold, beside nothing.
fn saturated(side: u32) -> Case {
    Case {
        group: Group::Numbers,
        name: "65504 beside black".into(),
        what: "A hard edge at 27 degrees between the largest half float and no light: the largest difference to the \
               same method's own result of light of 1, times 65504, as a share of 65504. Scattering is linear."
            .into(),
        passes: EVEN,
        degrades: SEEN,
        why: "Half floats round both alike, to a step of .0005 each; beyond .01 an eye may find it.".into(),
        known: vec![Known {
            method: "screen_planned",
            at_most: 0.0025,
            by_nature: false,
            why: "Along the frame's border light goes on as between the last two pixels, and is cut off where that is \
                  more than half floats hold. It has no such border in texture space, nor the exact effect."
                .into(),
        }],
        run: Box::new(move |lab| {
            let across = DVec2::from_angle(27f64.to_radians()).extend(0.0);
            let edge = |light: f64| face(side, |p| if p.dot(across) < 0.0 { light } else { 0.0 });
            let (dim, bright) = (edge(1.0), edge(65504.0));
            let skin = dim.skin();
            let dim = dim.upload(&lab.gpu).scatter(lab)?;
            let bright = bright.upload(&lab.gpu).scatter(lab)?;
            let scaled: Results = scaled(bright, 1.0 / 65504.0);
            Ok(Outcome {
                figures: apart(&scaled, &dim, &skin),
                shown: None,
            })
        }),
    }
}

fn scaled(results: Results, by: f32) -> Results {
    let scaled = results.into_iter();
    scaled
        .map(|(m, r)| (m, r.into_iter().map(|e| e * by).collect()))
        .collect()
}

/// Within a tile of 8×8, at the corner of one, at the corner of the frame, and beside the background.
fn places(side: u32) -> [usize; 4] {
    let at = |x: u32, y: u32| (y * side + x) as usize;
    [at(44, 44), at(24, 63), 0, at(side / 6 * 5 - 1, 20)]
}

/// A face under light of 1 with a few pixels of another.
fn dotted(light: f32, side: u32) -> Surface {
    let mut surface = face(side, |_| 1.0);
    for i in places(side) {
        surface.light(i, light);
    }
    surface
}

fn lost_pixels(name: &str, value: f32, side: u32) -> Case {
    Case {
        group: Group::Numbers,
        name: format!("{name} in 4 pixels, pixels lost"),
        what: format!(
            "Flat skin under light of 1, {name} in four pixels far from each other: the number of pixels that are no \
             finite number in the result."
        ),
        passes: 0.0,
        degrades: 4.0,
        why: "One lost pixel becomes a patch in bloom and a whole black frame in the exposure. Four are those that the \
              host lost itself; more, and scattering spread them."
            .into(),
        known: vec![],
        run: Box::new(move |lab| {
            let surface = dotted(value, side);
            let results = surface.upload(&lab.gpu).scatter(lab)?;
            let lost = |r: &[Vec3]| r.iter().filter(|e| !e.is_finite()).count() as f64;
            Ok(Outcome {
                figures: results.iter().map(|(m, r)| (*m, lost(r))).collect(),
                shown: None,
            })
        }),
    }
}

fn change(name: &str, value: f32, side: u32) -> Case {
    Case {
        group: Group::Numbers,
        name: format!("{name} in 4 pixels, what changes"),
        what: "The same frame: the largest difference to 1, which is the mean of all light that there is, on all of \
               the skin. Such a pixel should give nothing, and take what is around it."
            .into(),
        passes: EVEN,
        degrades: SEEN,
        why: "All that is known of the light is the same; .2 % is what even light may be off by.".into(),
        known: vec![],
        run: Box::new(move |lab| {
            let surface = dotted(value, side);
            let truth: Vec<_> = surface.skin().into_iter().map(|i| (i, DVec3::ONE)).collect();
            let results = surface.upload(&lab.gpu).scatter(lab)?;
            let crop = Crop {
                first: [20, 20],
                size: [56; 2],
            };
            Ok(Outcome {
                figures: worst(&results, &truth),
                shown: Some(crop.show(side, &results, &truth)),
            })
        }),
    }
}

/// Light below 0, which is finite, and which linear sums have no quarrel with.
fn negative(side: u32) -> Case {
    Case {
        group: Group::Numbers,
        name: "-1 in 4 pixels".into(),
        what: "Flat skin under light of 1, -1 in four pixels, and again with 3 in them: the largest difference of the \
               mean of both results to 1, which is what the integral gives. Light below 0 is not cut off: what it \
               takes, it takes as far as light would have gone, and no further."
            .into(),
        passes: EVEN,
        degrades: SEEN,
        why: "Steps of half floats are .002 at 3 and .0005 at 1; their mean is .0012.".into(),
        known: vec![],
        run: Box::new(move |lab: &Lab| -> Result<Outcome, Error> {
            let [below, above] = [-1.0, 3.0].map(|e| dotted(e, side));
            let skin = below.skin();
            let below = below.upload(&lab.gpu).scatter(lab)?;
            let above = above.upload(&lab.gpu).scatter(lab)?;
            let mean = below.into_iter().zip(above).map(|((m, a), (_, b))| {
                let mean = a.iter().zip(&b).map(|(a, b)| 0.5 * (*a + *b));
                (m, mean.collect())
            });
            let truth: Vec<_> = skin.into_iter().map(|i| (i, DVec3::ONE)).collect();
            Ok(Outcome {
                figures: worst(&mean.collect(), &truth),
                shown: None,
            })
        }),
    }
}
