//! Profiles of no width and of a metre's, and scenes in units of a micrometre and of a metre.

use glam::{DVec2, DVec3, Vec3};
use subsurface::{DEFAULT_MAX_ERROR, Gaussian, Plan, Profile};

use super::EVEN;
use crate::stability::case::{Case, Group, Outcome};
use crate::stability::cases::surface::{Surface, methods, ours};
use crate::stability::cases::{FOUND, Results, SEEN, apart, worst};
use crate::synthetic::{GBuffer, View, plane, sphere};

pub fn cases(quick: bool) -> Vec<Case> {
    let side = if quick { 96 } else { 192 };
    vec![
        width("of no width", 0.0, side),
        width("of a nanometre", 1e-6, side),
        width("of a metre", 1e3, side),
        unit("micrometres", 1e-3, side),
        unit("metres", 1e3, side),
    ]
}

/// Flat skin, lit on one side of an edge at 27 degrees; a third of the frame has none.
fn edge(side: u32) -> GBuffer {
    let view = View::orthographic([side; 2], 6.0);
    let across = DVec2::from_angle(27f64.to_radians()).extend(0.0);
    let light = move |p: DVec3| if p.dot(across) < 0.0 { 1.0 } else { 0.0 };
    let face = plane(DVec3::Z, 300.0, move |p| DVec3::splat(light(p)));
    let end_mm = f64::from(side) / 6.0 / 6.0;
    view.shoot(move |origin, ray| face(origin, ray).filter(|hit| hit.point.x < end_mm))
}

/// A profile of one Gaussian.
fn width(name: &str, sigma_mm: f32, side: u32) -> Case {
    let narrow = sigma_mm < 1.0;
    Case {
        group: Group::Numbers,
        name: format!("a profile {name}"),
        what: if narrow {
            "One Gaussian, a hard edge at 27 degrees on flat skin, 6 px/mm: the largest difference to the light as it \
             was. No kernel of a rival can be fitted to no width, and `jimenez_2009` is made for skin alone."
        } else {
            "One Gaussian, a hard edge at 27 degrees on flat skin, 6 px/mm: the largest difference to the visible \
             integral, which is the mean of all light in the frame. Rivals have their kernels fitted to this profile; \
             `jimenez_2009` is made for skin alone."
        }
        .into(),
        passes: if narrow { EVEN } else { FOUND },
        degrades: if narrow { FOUND } else { SEEN },
        why: if narrow {
            "light that goes nowhere stays as it is; .002 is four steps of a half float, .01 what an eye may find."
        } else {
            ".01 is what an eye may find."
        }
        .into(),
        known: vec![],
        run: Box::new(move |lab| {
            let profile = Profile::new(&[Gaussian {
                variance_mm2: sigma_mm * sigma_mm,
                weight: [1.0; 3],
            }])?;
            let plan = Plan::new(&[profile], DEFAULT_MAX_ERROR)?;
            let g = edge(side);
            let surface = Surface {
                profile,
                ..Surface::of(&g, DVec3::ZERO)
            };
            let uploaded = surface.upload(&lab.gpu);
            let mut results: Results = vec![("none", lab.read(uploaded.frame().irradiance))];
            let methods = if sigma_mm == 0.0 {
                ours(&lab.gpu, &plan)?
            } else {
                methods(&lab.gpu, &profile, &plan)?
            };
            for (name, mut method) in methods {
                let scattered = uploaded.by(&lab.gpu, &mut method)?.into_iter();
                let light = scattered.map(|[r, g, b, _]| Vec3::new(r, g, b));
                results.push((name, light.collect()));
            }
            let asked: Vec<usize> = surface.skin().into_iter().step_by(7).collect();
            let truth = if narrow {
                asked.iter().map(|i| results[0].1[*i].as_dvec3()).collect()
            } else {
                g.visible_integral(&asked, &profile)
            };
            let truth: Vec<_> = asked.into_iter().zip(truth).collect();
            Ok(Outcome {
                figures: worst(&results, &truth),
                shown: None,
            })
        }),
    }
}

/// The same scene in other units.
fn unit(name: &str, mm_per_unit: f32, side: u32) -> Case {
    Case {
        group: Group::Numbers,
        name: format!("a scene in {name}"),
        what: "A ball of 12 mm lit from one side, in perspective, 3 px/mm, the scene in these units: the largest difference to \
               the same method's result in millimetres."
            .into(),
        passes: EVEN,
        degrades: FOUND,
        why: "the picture is the same but for the rounding of half floats; .002 is four steps of them.".into(),
        known: vec![],
        run: Box::new(move |lab| {
            let view = View::perspective([side; 2], 0.0625 * f64::from(side));
            let to_light = DVec3::new(0.8, 0.0, 0.6);
            let g = view.shoot(sphere(12.0, 300.0, |n| DVec3::splat(n.dot(to_light).max(0.0))));
            let in_mm = Surface::of(&g, DVec3::ZERO);
            let in_units = Surface {
                mm_per_unit,
                ..in_mm.clone()
            };
            let before = in_mm.upload(&lab.gpu).scatter(lab)?;
            let after = in_units.upload(&lab.gpu).scatter(lab)?;
            Ok(Outcome {
                figures: apart(&after, &before, &in_mm.skin()),
                shown: None,
            })
        }),
    }
}
