//! Depth and normals that say nothing, or the wrong thing.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3, Mat3};
use subsurface::wgpu::TextureFormat;
use subsurface::{Normals, Profile, ScreenFrame};

use super::EVEN;
use crate::stability::case::{Case, Group, Known, OURS, Outcome};
use crate::stability::cases::surface::Surface;
use crate::stability::cases::{Crop, FOUND, SEEN, unpictured, worst};
use crate::synthetic::{Hit, View, plane, tilted_normal};

pub fn cases(quick: bool) -> Vec<Case> {
    let side = if quick { 96 } else { 192 };
    let depths = [
        ("0, infinitely far", 0.0),
        ("1, the near plane", 1.0),
        ("NaN", f32::NAN),
        ("infinity", f32::INFINITY),
        ("-1, behind the camera", -1.0),
    ];
    let normals = [
        ("of no length", BadNormal::None),
        ("turned over", BadNormal::TurnedOver),
        ("across the view", BadNormal::Across),
        ("NaN", BadNormal::NotANumber),
    ];
    let depths = depths.map(|(name, value)| match value {
        // As of NaN, and as of 1.
        f32::INFINITY | -1.0 => unpictured(depth(name, value, side)),
        _ => depth(name, value, side),
    });
    let normals = normals.map(|(name, bad)| normal(name, bad, side));
    depths.into_iter().chain(normals).collect()
}

/// A row and a pixel of a frame that lie nowhere, or somewhere else.
fn depth(name: &str, value: f32, side: u32) -> Case {
    Case {
        group: Group::Numbers,
        name: format!("depth of {name}"),
        what: "Flat skin 300 mm away under light of 1, with reversed infinite depth, 3 px/mm. One pixel and one row are black \
               and have this depth, which puts them 290 mm or more from the rest, or nowhere: the largest difference to \
               1 on other pixels, and to black on these. Positions in the atlas follow from the depth; texels infinitely \
               far away hold no skin and do not count."
            .into(),
        passes: EVEN,
        degrades: FOUND,
        why: "nothing crosses 290 mm; .2 % is what even light may be off by.".into(),
        known: if value.is_nan() {
            vec![lost_position()]
        } else {
            vec![]
        },
        run: Box::new(move |lab| {
            let view = View::perspective([side; 2], 0.0625 * f64::from(side));
            let g = view.shoot(plane(DVec3::Z, 300.0, |_| DVec3::ONE));
            let mut surface = Surface::of(&g, DVec3::ZERO);
            let row = (0..side).map(|x| 70 * side + x);
            let bad: Vec<usize> = row.chain([40 * side + 40]).map(|i| i as usize).collect();
            for &i in &bad {
                surface.light(i, 0.0);
                surface.texels.depth[i] = value;
                let at = DVec2::new(i as f64 % f64::from(side), (i as u32 / side).into());
                surface.positions_mm[i] = position(view, at + 0.5, value);
            }
            let truth = surface.skin().into_iter();
            let light = |i| if bad.contains(&i) { DVec3::ZERO } else { DVec3::ONE };
            let truth: Vec<_> = truth.map(|i| (i, light(i))).collect();
            let uploaded = surface.upload(&lab.gpu);
            let mut results = lab.scatter(&uploaded.frame())?;
            let mut figures = worst(&results, &truth);
            // Texels without skin take what is around them, which the final pass never asks for.
            let textured = lab.scatter_atlas(&uploaded.atlas())?;
            let in_atlas = truth.iter().filter(|(i, _)| surface.positions_mm[*i][3] != 0.0);
            figures.extend(worst(&textured, &in_atlas.copied().collect::<Vec<_>>()));
            results.extend(textured);
            let crop = Crop {
                first: [24, 24],
                size: [56; 2],
            };
            Ok(Outcome {
                figures,
                shown: Some(crop.show(side, &results, &truth)),
            })
        }),
    }
}

fn lost_position() -> Known {
    Known {
        method: "texture_separable",
        at_most: f64::INFINITY,
        by_nature: false,
        why: "A position that is NaN spreads as far as the kernel reaches; to test for it would cost every tap. A rasteriser \
              does not draw a triangle with such a vertex. A host that writes positions by a shader of its own should \
              leave such texels without skin."
            .into(),
    }
}

/// What a texel of an atlas has where the pixel `at` has this reversed, infinite depth.
fn position(view: View, at: DVec2, depth: f32) -> [f32; 4] {
    if depth == 0.0 {
        return [0.0; 4];
    }
    let (_, ray) = view.ray(at);
    let distance_mm = view.projection.w_axis.z / f64::from(depth);
    (ray * distance_mm).as_vec3().extend(1.0).to_array()
}

#[derive(Clone, Copy)]
enum BadNormal {
    None,
    TurnedOver,
    Across,
    NotANumber,
}

impl BadNormal {
    fn of(self, normal: DVec3) -> DVec3 {
        match self {
            Self::None => DVec3::ZERO,
            Self::TurnedOver => -normal,
            Self::Across => DVec3::X,
            Self::NotANumber => DVec3::NAN,
        }
    }
}

/// A slope, on which every second pixel has such a normal, and the others their own.
fn normal(name: &str, bad: BadNormal, side: u32) -> Case {
    Case {
        group: Group::Numbers,
        name: format!("normals {name}"),
        what: "A slope of 30 degrees under waves of light 4 mm long, 6 px/mm; every second pixel has such a \
               normal, the others their own: the largest difference to the visible integral. Neither rivals nor atlases \
               take normals."
            .into(),
        passes: FOUND,
        degrades: SEEN,
        why: "depth tells which way the surface faces, so that impossible normals can be ignored; .01 is what an eye may find."
            .into(),
        known: vec![],
        run: Box::new(move |lab| {
            let view = View::orthographic([side; 2], 6.0);
            let slope = tilted_normal(30.0, 40.0);
            let wave = |p: DVec3| DVec3::splat(0.5 + 0.5 * (p.x * TAU / 4.0).sin());
            let g = view.shoot(plane(slope, 300.0, wave));
            let width = side as usize;
            let texels: Vec<[f32; 4]> = g
                .hits
                .iter()
                .enumerate()
                .map(|(i, hit)| {
                    let own = hit.map_or(DVec3::Z, |h: Hit| h.normal);
                    let is_bad = (i % width + i / width).is_multiple_of(2);
                    let normal = if is_bad { bad.of(own) } else { own };
                    normal.as_vec3().extend(0.0).to_array()
                })
                .collect();
            let normals = lab.gpu.upload("normal", view.size, TextureFormat::Rgba32Float, &texels);
            let surface = Surface::of(&g, DVec3::ZERO).upload(&lab.gpu);
            let frame = ScreenFrame {
                normal: Some(Normals {
                    texture: &normals,
                    to_view: Mat3::IDENTITY,
                }),
                ..surface.frame()
            };
            let mut results = lab.scatter(&frame)?;
            results.retain(|(m, _)| OURS.contains(m));
            let crop = Crop {
                first: [24, 24],
                size: [48; 2],
            };
            let asked: Vec<usize> = crop.pixels(side).into_iter().step_by(7).collect();
            let truth = g.visible_integral(&asked, &Profile::SKIN);
            let truth: Vec<_> = asked.into_iter().zip(truth).collect();
            Ok(Outcome {
                figures: worst(&results, &truth),
                shown: None,
            })
        }),
    }
}
