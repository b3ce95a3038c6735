//! A cylinder lit from the side, and unwrapped.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use subsurface::Profile;

use super::super::{Crop, worst};
use crate::stability::case::{Outcome, Run};
use crate::stability::frame::Texels;
use crate::stability::unwrapped::{Texel, Unwrapped};
use crate::synthetic::{Hit, View};
use crate::truth::closed_form::scattered_cosine_around;

const RHO_MM: f64 = 8.0;
const LENGTH_MM: f64 = 20.0;
/// Where light comes from; angles are from the camera.
const LIGHT_DEGREES: f64 = 60.0;
/// Around the island, in texels.
const GUTTER: f64 = 6.0;

/// With the seam at this angle.
pub fn run(seam_degrees: f64, quick: bool) -> Run {
    let (pixels, px_per_mm, texel_mm) = if quick {
        (128, 5.0, 0.19)
    } else {
        (224, 8.0, 0.12)
    };
    Box::new(move |lab| {
        let light = |phi: f64| DVec3::splat((phi - LIGHT_DEGREES.to_radians()).cos().max(0.0));
        let view = View::orthographic([pixels; 2], px_per_mm);
        let g = view.shoot(|origin, _| {
            let normal = DVec2::new(origin.x, (RHO_MM.powi(2) - origin.x.powi(2)).sqrt()) / RHO_MM;
            let is_hit = normal.is_finite() && origin.y.abs() < LENGTH_MM / 2.0;
            is_hit.then(|| Hit {
                point: DVec3::new(origin.x, origin.y, normal.y * RHO_MM - 300.0),
                normal: DVec3::new(normal.x, 0.0, normal.y),
                irradiance: light(normal.x.atan2(normal.y)),
                id: 1,
            })
        });
        // All around but for the rims; along it everything is alike.
        let crop = Crop {
            first: [0.1, 0.35].map(|share| (share * f64::from(pixels)) as u32),
            size: [0.8, 0.3].map(|share| (share * f64::from(pixels)) as u32),
        };
        let asked: Vec<(usize, Hit)> = crop
            .pixels(pixels)
            .into_iter()
            .filter_map(|i| g.hits[i].map(|h| (i, h)))
            .filter(|(_, h)| h.normal.z > 0.3)
            .collect();
        let places: Vec<usize> = asked.iter().map(|(i, _)| *i).collect();
        let angles: Vec<f64> = asked
            .iter()
            .map(|(_, h)| h.normal.x.atan2(h.normal.z))
            .collect();
        let frame = Texels::of(&g, DVec3::ZERO).upload(&lab.gpu);
        let mut results = lab.scatter(&frame.inputs(), &frame.output)?;
        let visible = g.visible_integral(&places, &Profile::SKIN);
        let visible: Vec<_> = places.iter().copied().zip(visible).collect();

        let texels = DVec2::new(TAU * RHO_MM, LENGTH_MM) / texel_mm;
        let size = (texels + 2.0 * GUTTER).ceil();
        let seam = seam_degrees.to_radians();
        let unwrapped = Unwrapped::new(size.as_uvec2().to_array(), |uv| {
            let at = (uv * size - GUTTER) / texels;
            let is_skin = at.cmpge(DVec2::ZERO).all() && at.cmplt(DVec2::ONE).all();
            let phi = at.x * TAU + seam;
            is_skin.then(|| Texel {
                point_mm: DVec3::new(
                    RHO_MM * phi.sin(),
                    LENGTH_MM * (at.y - 0.5),
                    RHO_MM * phi.cos(),
                ),
                irradiance: light(phi),
                area_mm2: texel_mm * texel_mm,
            })
        });
        let uvs: Vec<DVec2> = asked
            .iter()
            .zip(&angles)
            .map(|((_, h), phi)| {
                let at = DVec2::new(
                    (phi - seam).rem_euclid(TAU) / TAU,
                    h.point.y / LENGTH_MM + 0.5,
                );
                (at * texels + GUTTER) / size
            })
            .collect();
        let scattered = scattered_cosine_around(RHO_MM, &Profile::SKIN);
        let around: Vec<_> = angles
            .iter()
            .map(|phi| scattered(phi - LIGHT_DEGREES.to_radians()))
            .collect();
        let around: Vec<_> = places.iter().copied().zip(around).collect();

        let mut figures = worst(&results, &visible);
        for (name, values) in unwrapped.scatter(lab, &uvs)? {
            // As pixels of the frame, as the others are.
            let mut pixels = vec![Default::default(); g.hits.len()];
            for (i, value) in places.iter().zip(values) {
                pixels[*i] = value;
            }
            let of_texture = vec![(name, pixels)];
            figures.extend(worst(&of_texture, &around));
            results.extend(of_texture);
        }
        Ok(Outcome {
            shown: Some(crop.show(pixels, &results, &around)),
            figures,
        })
    })
}
