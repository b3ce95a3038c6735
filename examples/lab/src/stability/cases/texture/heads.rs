//! Many heads: balls of skin, each with an atlas of its own.

use crate::Error;
use crate::method;
use glam::{DVec2, DVec3, Vec3};

use super::super::{larger, largest};
use crate::stability::case::{Outcome, Run};
use crate::stability::frame::Texels;
use crate::stability::lab::Lab;
use crate::stability::unwrapped::{Texel, Unwrapped};
use crate::synthetic::{GBuffer, Hit, View};

const RHO_MM: f64 = 8.0;
/// Balls along a side of the picture.
const SIDE: u32 = 3;
/// From one ball's middle to the next.
const PITCH_MM: f64 = 17.5;
const PX_PER_MM: f64 = 3.0;

/// Each method's largest difference between heads alone and all of them together.
pub fn run() -> Run {
    Box::new(move |lab| {
        let mut figures = screen(lab)?;
        figures.extend(texture(lab)?);
        Ok(Outcome {
            figures,
            shown: None,
        })
    })
}

/// Every ball is lit from a side of its own.
fn light(head: u32, normal: DVec3) -> DVec3 {
    let around = DVec2::from_angle(f64::from(head) * 2.4);
    let direction = around.extend(1.0).normalize();
    DVec3::splat(normal.dot(direction).max(0.0))
}

/// The frame with these heads; neighbours stand 40 mm or more behind each other.
fn look(heads: &[u32]) -> GBuffer {
    let pixels = (f64::from(SIDE) * PITCH_MM * PX_PER_MM).ceil() as u32;
    View::orthographic([pixels; 2], PX_PER_MM).shoot(|origin, _| {
        heads.iter().find_map(|&head| {
            let (column, row) = (head % SIDE, head / SIDE);
            let middle = DVec2::new(column.into(), row.into()) - 0.5 * f64::from(SIDE - 1);
            let depth = 200.0 + 40.0 * f64::from((column + 2 * row) % 4);
            let off = (origin.truncate() - middle * PITCH_MM) / RHO_MM;
            let z2 = 1.0 - off.length_squared();
            (z2 > 0.0).then(|| {
                let normal = off.extend(z2.sqrt());
                Hit {
                    point: (middle * PITCH_MM).extend(-depth) + normal * RHO_MM,
                    normal,
                    irradiance: light(head, normal),
                    id: 1,
                }
            })
        })
    })
}

fn screen(lab: &Lab) -> Result<Vec<(&'static str, f64)>, Error> {
    let scatter = |g: &GBuffer| {
        let frame = Texels::of(g, DVec3::ZERO).upload(&lab.gpu);
        lab.scatter(&frame.inputs(), &frame.output)
    };
    let heads: Vec<u32> = (0..SIDE * SIDE).collect();
    let together = scatter(&look(&heads))?;
    let mut figures: Vec<_> = together.iter().map(|(m, _)| (*m, 0.0)).collect();
    for head in heads {
        let g = look(&[head]);
        let alone = scatter(&g)?;
        let pixels = g.pixels(|_| true);
        for ((_, figure), (a, b)) in figures.iter_mut().zip(together.iter().zip(&alone)) {
            let pairs = pixels.iter().map(|(i, _)| (a.1[*i], b.1[*i]));
            *figure = larger(*figure, apart(pairs));
        }
    }
    Ok(figures)
}

fn texture(lab: &Lab) -> Result<Vec<(&'static str, f64)>, Error> {
    let heads: Vec<Unwrapped> = (0..SIDE * SIDE).map(unwrap).collect();
    let mut figures = Vec::new();
    for (name, method) in lab.texture.borrow_mut().iter_mut() {
        let upload = || heads.iter().map(|h| h.upload(&lab.gpu)).collect::<Vec<_>>();
        let (alone, together) = (upload(), upload());
        for head in &alone {
            method::scatter_atlas(&lab.gpu, &mut **method, &head.atlas(), &head.output)?;
        }
        // All in one submission, as a host would.
        lab.gpu.run(|encoder| {
            together.iter().try_for_each(|head| {
                method.prepare(&lab.gpu.device, &lab.gpu.queue, &head.atlas())?;
                method.render(encoder, &head.output)
            })
        })?;
        let pairs = alone.iter().zip(&together).flat_map(|(a, b)| {
            let [a, b] = [a, b].map(|head| lab.read(&head.output));
            a.into_iter().zip(b)
        });
        figures.push((*name, apart(pairs)));
    }
    Ok(figures)
}

/// The half of a ball that faces the camera, unrolled by its polar angle. Atlases of two sizes take turns,
/// so that scratch memory is made anew between them.
fn unwrap(head: u32) -> Unwrapped {
    let size = if head.is_multiple_of(2) { 64 } else { 48 };
    let texel_mm = 2.0 * RHO_MM * 1.7 / f64::from(size);
    Unwrapped::new([size; 2], |uv| {
        let off = 2.2 * (uv - 0.5);
        let theta = 1.6 * off.length();
        let around = off.normalize_or(DVec2::X);
        let normal = (around * theta.sin()).extend(theta.cos());
        (off.length() < 1.0).then(|| Texel {
            point_mm: normal * RHO_MM,
            irradiance: light(head, normal),
            area_mm2: texel_mm * texel_mm,
        })
    })
}

/// The largest difference; not a number where one is none.
fn apart(pairs: impl Iterator<Item = (Vec3, Vec3)>) -> f64 {
    let differences = pairs.flat_map(|(a, b)| (a - b).abs().to_array());
    largest(differences.map(f64::from))
}
