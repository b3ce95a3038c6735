//! Where screen space fails: what lies close in the picture and far apart in space, and what the
//! camera does not see.

use glam::{DVec2, DVec3};
use subsurface::Profile;

use super::{Crop, worst};
use crate::case::{Case, Group, Outcome};
use crate::common::{GBuffer, Hit, View};
use crate::frame::Texels;
use crate::unwrapped::{Texel, Unwrapped};

pub fn cases(quick: bool) -> Vec<Case> {
    [1.0, 2.0, 5.0, 10.0, 20.0]
        .map(|gap_mm| layers(gap_mm, quick))
        .into()
}

/// Two layers of skin: a dark one in front of a lit one, as a nose over a cheek.
fn layers(gap_mm: f64, quick: bool) -> Case {
    let passes = if gap_mm >= 10.0 { 0.0005 } else { 0.01 };
    let size = [if quick { 128 } else { 256 }; 2];
    let px_per_mm = 6.0;
    Case {
        group: Group::Screen,
        name: format!("layers {gap_mm} mm apart"),
        what: "A dark half-plane before a lit one, the edge at 27 degrees, 6 px/mm: the largest \
               difference to the visible integral on either, in texture space to what both layers, hidden parts included, \
               scatter."
            .into(),
        passes,
        degrades: 0.03,
        why: "What crosses 10 mm of air is under .0001 by the skin profile, so that .0005 is a leak; \
              nearer layers do exchange light by Eq. 7, and .01 is what an eye may find in a gradient."
            .into(),
        known: vec![],
        run: Box::new(move |lab| {
            let view = View::orthographic(size, px_per_mm);
            let across = DVec2::from_angle(27f64.to_radians()).extend(0.0);
            let hit = |depth_mm: f64, origin: DVec3, light: f64| Hit {
                point: DVec3::new(origin.x, origin.y, -depth_mm),
                normal: DVec3::Z,
                irradiance: DVec3::splat(light),
                id: 1,
            };
            let g: GBuffer = view.shoot(|origin, _| {
                Some(if origin.dot(across) < 0.0 {
                    hit(300.0, origin, 0.0)
                } else {
                    hit(300.0 + gap_mm, origin, 1.0)
                })
            });
            let frame = Texels::of(&g, DVec3::ZERO).upload(&lab.gpu);
            let results = lab.scatter(&frame.inputs())?;
            let crop = Crop {
                first: [size[0] / 2 - 32, size[1] / 2 - 32],
                size: [64; 2],
            };
            let asked = crop.pixels(size[0]);
            let truth = g.visible_integral(&asked, &Profile::SKIN);
            let truth: Vec<_> = asked.iter().copied().zip(truth).collect();
            // Both layers whole, beside each other in the atlas.
            let side_mm = f64::from(size[0]) / px_per_mm;
            let layer = |uv: DVec2| (uv.x >= 0.5, DVec2::new((2.0 * uv.x).fract(), uv.y));
            let texel_mm2 = 2.0 * (side_mm / 256.0).powi(2);
            let unwrapped = Unwrapped::new([512, 256], |uv| {
                let (is_far, at) = layer(uv);
                let place = ((at - 0.5) * side_mm).extend(0.0);
                let h = hit(if is_far { 300.0 + gap_mm } else { 300.0 }, place, if is_far { 1.0 } else { 0.0 });
                (is_far || place.dot(across) < 0.0).then_some(Texel {
                    point_mm: h.point,
                    irradiance: h.irradiance,
                    area_mm2: texel_mm2 / 2.0,
                })
            });
            let hits = || asked.iter().filter_map(|i| g.hits[*i]);
            let uv = |h: Hit| {
                let at = h.point.truncate() / side_mm + 0.5;
                let column = if h.point.z < -300.0 { 0.5 } else { 0.0 };
                DVec2::new(0.5 * at.x + column, at.y)
            };
            let whole = unwrapped.truth(&hits().map(|h| (h.point, h.irradiance)).collect::<Vec<_>>());
            let whole: Vec<_> = whole.into_iter().enumerate().collect();
            let textured = unwrapped.scatter(lab, &hits().map(uv).collect::<Vec<_>>())?;
            let mut figures = worst(&results, &truth);
            figures.extend(worst(&textured, &whole));
            Ok(Outcome {
                shown: Some(crop.show(size[0], &results, &truth)),
                figures,
            })
        }),
    }
}
