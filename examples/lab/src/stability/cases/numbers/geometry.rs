//! Depth that says nothing, or the wrong thing.

use glam::{DVec2, DVec3};

use super::EVEN;
use crate::stability::case::{Case, Group, Known, Outcome};
use crate::stability::cases::surface::Surface;
use crate::stability::cases::{Crop, FOUND, unpictured, worst};
use crate::synthetic::{View, plane};

pub fn cases(quick: bool) -> Vec<Case> {
    let side = if quick { 96 } else { 192 };
    let depths = [
        ("0, infinitely far", 0.0),
        ("1, the near plane", 1.0),
        ("NaN", f32::NAN),
        ("infinity", f32::INFINITY),
        ("-1, behind the camera", -1.0),
    ];
    let depths = depths.map(|(name, value)| match value {
        // As of NaN, and as of 1.
        f32::INFINITY | -1.0 => unpictured(depth(name, value, side)),
        _ => depth(name, value, side),
    });
    depths.into()
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
            let mut results = lab.scatter(&uploaded.frame(), uploaded.output())?;
            let mut figures = worst(&results, &truth);
            // Texels without skin take what is around them, which the final pass never asks for.
            let textured = lab.scatter_atlas(&uploaded.atlas(), uploaded.output())?;
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
