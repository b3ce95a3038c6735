//! Light: none, hardly any, the most that half floats hold, and what is no number.

use crate::Error;
use glam::{DVec2, DVec3, Vec3};
use half::f16;

use super::EVEN;
use crate::stability::case::{Case, Group, Known, Outcome};
use crate::stability::cases::surface::Surface;
use crate::stability::cases::{Crop, FOUND, Results, apart, unpictured, worst};
use crate::stability::lab::Lab;
use crate::synthetic::{View, plane, sphere};

pub fn cases(quick: bool) -> Vec<Case> {
    let side = if quick { 96 } else { 192 };
    let bad = [
        ("NaN", f32::NAN),
        ("infinity", f32::INFINITY),
        ("minus infinity", f32::NEG_INFINITY),
    ];
    let mut cases: Vec<Case> = [0.0, 1e-6, 1e4, 65504.0].map(|e| constant(e, side)).into();
    cases.push(saturated(side));
    cases.extend(bad.map(|(name, value)| lost_pixels(name, value, side)));
    // Infinity looks as NaN does.
    let changes = bad.map(|(name, value)| match value {
        f32::INFINITY | f32::NEG_INFINITY => unpictured(change(name, value, side)),
        _ => change(name, value, side),
    });
    cases.extend(changes);
    cases.push(negative(side));
    cases
}

/// A ball of skin under light that is the same everywhere.
fn constant(light: f32, side: u32) -> Case {
    let (passes, degrades, why) = match light {
        0.0 => (
            0.0,
            f64::from(f16::MIN_POSITIVE_SUBNORMAL),
            "nothing comes of nothing; 6e-8 is the smallest half float.",
        ),
        1e-6 => (
            0.06,
            0.5,
            "so close to 0 a step of half floats is 6 %; half of the light is eight steps, one or more in every pass.",
        ),
        _ => (
            EVEN,
            FOUND,
            "even light stays as it is; .2 % is two to four steps of half floats, which results are stored in, .01 what \
             an eye may find.",
        ),
    };
    Case {
        group: Group::Numbers,
        name: format!("light of {light} throughout"),
        what: "A ball of 12 mm before a background of the same light, 3 px/mm: the largest difference to that light, \
               as a share of it unless it is 0."
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
               same method's result of light of 1, times 65504, as a share of 65504, since scattering is linear."
            .into(),
        passes: EVEN,
        degrades: FOUND,
        why: "half floats round both to .0005; .01 is what an eye may find.".into(),
        known: vec![Known {
            method: "screen_planned",
            at_most: 0.0035,
            by_nature: false,
            why: "Along the frame's border coarse levels are extrapolated from the last two pixels, and cut off where that \
                  is more than half floats hold. `ScreenSpace` does not extrapolate."
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
        what: "Flat skin under light of 1, but for four pixels far from each other, which are NaN or infinite: how many pixels \
               of the result are."
            .into(),
        passes: 0.0,
        degrades: 4.0,
        why: "one lost pixel becomes a patch in bloom, and can turn the whole frame black by automatic exposure. Four were lost \
              before; if there are more, scattering has spread them."
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
        what: "The same frames: the largest difference to 1 on all of the skin. Such a pixel should give nothing, and take the \
               light around it."
            .into(),
        passes: EVEN,
        degrades: FOUND,
        why: "all light that is known is 1; .2 % is what even light may be off by.".into(),
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
        what: "Flat skin under light of 1, with -1 in four pixels, and again with 3 in them: the largest difference of the mean \
               of both results to 1. Scattering is linear, so that light below 0 is not to be cut off."
            .into(),
        passes: EVEN,
        degrades: FOUND,
        why: "half floats have steps of .002 at 3 and of .0005 at 1, of which the mean is .0012.".into(),
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
