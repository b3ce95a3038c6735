//! What lies close in the picture and far apart in space.

use glam::{DVec2, DVec3};

use super::scene::{Form, Scene, Surface};
use super::trial::{Trial, Truth, middle};
use super::{FOUND, SEEN, known};
use crate::stability::case::{Case, Group, Known};
use crate::stability::cases::unpictured;
use crate::synthetic::View;

/// What may cross 10 mm of air or more.
const LEAK: f64 = 0.0005;

const WHY_LEAK: &str = "by the skin profile less than .0001 crosses 10 mm of air, so that more than .0005, a half float's \
     step below white, is a leak.";

const COARSE: &str = "A coarse pixel keeps one surface, and the light of the other is missing nearby. Take `ScreenSpace` where layers \
     lie close together in the picture, or give each head a profile of its own.";

const ISLANDS: &str = "It sums along the surface, one island at a time, while Eq. 7 also counts what crosses the gap. Across air that is \
     no fault: no skin carries that light. Where layers touch, take `ScreenSpace`.";

pub fn cases(quick: bool) -> Vec<Case> {
    let gaps = [1.0, 2.0, 5.0, 10.0, 20.0].map(|gap_mm| layers(gap_mm, quick));
    // Gaps of 2 and 10 mm look as those of 1 and 20.
    let [one, two, five, ten, twenty] = gaps;
    let gaps = [one, unpictured(two), five, unpictured(ten), twenty];
    gaps.into_iter().chain(heads(quick)).collect()
}

/// Two layers of skin: a dark one in front of a lit one, as a nose over a cheek.
fn layers(gap_mm: f64, quick: bool) -> Case {
    const PX_PER_MM: f64 = 6.0;
    let is_far = gap_mm >= 10.0;
    Case {
        group: Group::Screen,
        name: format!("layers {gap_mm} mm apart"),
        what: "A dark half-plane before a lit plane, its edge at 27 degrees, 6 px/mm: the largest difference to the \
               visible integral on either. In texture space it is that to Eq. 7 over both layers, hidden parts \
               included. Both count what crosses the air between the layers as if it were skin."
            .into(),
        passes: if is_far { LEAK } else { FOUND },
        degrades: SEEN,
        why: if is_far {
            WHY_LEAK.into()
        } else {
            "by Eq. 7 near layers exchange light; .01 is what an eye may find in a gradient.".into()
        },
        known: leaks(gap_mm),
        run: Box::new(move |lab| {
            let view = View::orthographic([128; 2], PX_PER_MM);
            let across = DVec2::from_angle(27f64.to_radians()).extend(0.0);
            let form = || Form::facing(128.0 / PX_PER_MM);
            let near = Surface {
                light: Box::new(move |point, _| (point.dot(across) < 0.0).then_some(DVec3::ZERO)),
                ..Surface::new(form(), |_, _| DVec3::ZERO)
            };
            let far = Surface::new(form(), |_, _| DVec3::ONE).moved(DVec3::Z * -gap_mm);
            Trial {
                scene: Scene(vec![near, far]),
                view,
                background: 0.0,
                crop: middle(&view, [if quick { 48 } else { 80 }; 2]),
                asked: &|_| true,
                screen: Truth::Visible,
                texture: Some(([96; 2], Truth::Whole)),
            }
            .run(lab)
        }),
    }
}

/// Two heads of one profile, one dark and one lit.
fn heads(quick: bool) -> Vec<Case> {
    let case = |name: &str, apart_mm: f64, behind_mm: f64, known: Vec<Known>| {
        let side = if quick { 40 } else { 80 };
        let touch = behind_mm == 0.0;
        Case {
            group: Group::Screen,
            name: name.into(),
            what: format!(
                "A dark ball of 10 mm radius, and a lit one {apart_mm} mm to its right and {behind_mm} mm behind it, 4 px/mm: \
                 the largest difference to the visible integral {}, without a rim of one pixel.",
                if touch {
                    "around where they touch, in texture space to Eq. 7 over all of both"
                } else {
                    "where they meet in the picture, in texture space to each ball's own even light"
                }
            ),
            passes: if touch { FOUND } else { LEAK },
            degrades: SEEN,
            why: if touch {
                "by Eq. 7 near layers exchange light; .01 is what an eye may find in a gradient."
                    .into()
            } else {
                WHY_LEAK.into()
            },
            known,
            run: Box::new(move |lab| {
                const RHO_MM: f64 = 10.0;
                let view = View::orthographic([168, 96], 4.0);
                let ball = |light: f64| {
                    Surface::new(Form::Sphere { rho_mm: RHO_MM }, move |_, _| {
                        DVec3::splat(light)
                    })
                };
                let half = DVec3::X * apart_mm / 2.0;
                let constant = |hit: &crate::synthetic::Hit| hit.irradiance;
                Trial {
                    scene: Scene(vec![
                        ball(0.0).moved(-half),
                        ball(1.0).moved(half - DVec3::Z * behind_mm),
                    ]),
                    view,
                    background: 0.0,
                    crop: middle(&view, [side, side * 2 / 3]),
                    asked: &|_| true,
                    screen: Truth::Visible,
                    texture: Some((
                        [128; 2],
                        if touch {
                            Truth::Whole
                        } else {
                            Truth::Paper(&constant)
                        },
                    )),
                }
                .run(lab)
            }),
        }
    };
    vec![
        case("a head before another", 12.0, 30.0, vec![]),
        case("heads side by side, one farther away", 20.0, 30.0, vec![]),
        case(
            "heads that touch",
            20.0,
            0.0,
            vec![
                known("screen_planned", 0.21, COARSE),
                known("texture_separable", 0.3, ISLANDS),
            ],
        ),
    ]
}

fn leaks(gap_mm: f64) -> Vec<Known> {
    let [planned, texture] = match gap_mm as u32 {
        1 => [Some(0.055), Some(0.35)],
        2 => [Some(0.075), Some(0.22)],
        5 => [None, Some(0.025)],
        _ => [None, None],
    };
    let planned = planned.map(|at_most| known("screen_planned", at_most, COARSE));
    let texture = texture.map(|at_most| known("texture_separable", at_most, ISLANDS));
    planned.into_iter().chain(texture).collect()
}
