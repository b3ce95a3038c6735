//! The camera pans.

use glam::{DAffine3, DVec2, DVec3};
use subsurface::Profile;

use super::atlas::{Sheet, sphere_uv, unwrapped_sphere};
use super::follow::{FOLLOWED, Scene, grid, swing};
use super::track::{Track, errors, read, taps};
use super::{FOUND, PX_PER_MM, REACH_MM, STEP, WHY_SWING};
use crate::stability::case::{Case, Group, Known, Outcome};
use crate::stability::cases::unpictured;
use crate::stability::frame::Texels;
use crate::synthetic::{Hit, View, plane, sphere, tilted_normal};
use crate::truth::closed_form::{
    legendre, passed_harmonics, passed_wave, scattered_cosine, scattered_step, step,
};

pub fn cases(quick: bool) -> Vec<Case> {
    vec![
        // Seen from ahead it looks as at 40 degrees.
        unpictured(over_a_plane(0.0, quick)),
        over_a_plane(40.0, quick),
        over_a_sphere(quick),
        past_a_layer(quick),
        by_whole_pixels(),
    ]
}

/// Cameras that pan over 10 px, which is what levels up to the third repeat after: in steps of an
/// eighth, or of five, which find the same fractions in another order.
fn pan(quick: bool) -> Vec<DAffine3> {
    let (count, step_px) = if quick { (17, 0.625) } else { (81, 0.125) };
    let direction = DVec3::new(1.0, 0.6, 0.0);
    let moved = |i: u32| direction * (step_px * f64::from(i) / PX_PER_MM);
    (0..count)
        .map(|i| DAffine3::from_translation(-moved(i)))
        .collect()
}

/// A plane under waves of all directions.
fn over_a_plane(tilt_degrees: f64, quick: bool) -> Case {
    let lattices = Known {
        method: "screen_planned",
        at_most: 0.0095,
        by_nature: false,
        why: "A plan's taps lie on lattices of whole pixels. Each slope has one of its own, and a simple tile one for all its \
              pixels, so that a point changes from one to another as tiles pass over it, and on waves this fine they \
              differ. Without simple tiles the swing is .0025 (.0054 at 50 degrees; at 20, 30 and 60 degrees both pass). \
              `ScreenSpace` does not swing."
            .into(),
    };
    Case {
        group: Group::Time,
        name: format!("pan over a plane at {tilt_degrees}°"),
        what: format!(
            "A plane tilted by 0 or 40 degrees in perspective, lit by waves of 8 px and longer at 4 px/mm, under a camera \
             that pans by fractions of a pixel; 2 texels a pixel. {FOLLOWED}"
        ),
        passes: STEP,
        degrades: FOUND,
        why: WHY_SWING.into(),
        known: (tilt_degrees > 0.0)
            .then_some(lattices)
            .into_iter()
            .collect(),
        run: Box::new(move |lab| {
            let size = 128u32;
            let fov_degrees = 20f64;
            let focal_px = f64::from(size) / 2.0 / (fov_degrees / 2.0).to_radians().tan();
            let distance_mm = focal_px / PX_PER_MM;
            let normal = tilted_normal(tilt_degrees, 15.0);
            let along = DVec3::X.reject_from_normalized(normal).normalize();
            let sheet = Sheet {
                middle: DVec3::new(0.0, 0.0, -distance_mm),
                along,
                across: normal.cross(along),
                side_mm: 28.0,
            };
            // Radians a mm, direction, share: 2.6 is 8 px where the plane is farthest.
            let waves = [
                (2.6, 0.0f64, 0.12),
                (2.0, 80.0, 0.12),
                (1.6, 140.0, 0.12),
                (0.6, 35.0, 0.14),
            ];
            let light = |place: DVec2, passed: &dyn Fn(f64) -> DVec3| -> DVec3 {
                let wave = |(rad_per_mm, degrees, share): (f64, f64, f64)| {
                    let phase = rad_per_mm * DVec2::from_angle(degrees.to_radians()).dot(place);
                    share * phase.sin() * passed(rad_per_mm)
                };
                DVec3::splat(0.5) + waves.into_iter().map(wave).sum::<DVec3>()
            };
            let irradiance = |place: DVec2| light(place, &|_| DVec3::ONE);
            let passed = |rad_per_mm: f64| passed_wave(rad_per_mm, &Profile::SKIN);
            let surface = plane(normal, distance_mm, |p| {
                irradiance(sheet.place(sheet.middle + p))
            });
            let scene = Scene {
                surface: &surface,
                scattered: &|point| light(sheet.place(point), &passed),
                atlas: sheet.unwrap(224, irradiance),
                uv: &|point| sheet.uv(point),
                points: grid(3.0).map(|place| sheet.point(place)).collect(),
            };
            let view = View::perspective([size; 2], fov_degrees);
            Ok(swing(&scene.follow(lab, view, &pan(quick))?))
        }),
    }
}

/// A ball with a terminator, and rings of light.
fn over_a_sphere(quick: bool) -> Case {
    Case {
        group: Group::Time,
        name: "pan over a sphere".into(),
        what: format!(
            "A sphere of 10 mm radius at 4 px/mm, lit from the side and by two sets of rings 10 px wide, where n_z is above .6; \
             1.5 texels a pixel. {FOLLOWED}"
        ),
        passes: STEP,
        degrades: FOUND,
        why: WHY_SWING.into(),
        known: vec![],
        run: Box::new(move |lab| {
            const RINGS: usize = 24;
            let (rho_mm, middle) = (10.0, DVec3::new(0.0, 0.0, -300.0));
            let sun = DVec3::new(-0.9, 0.3, 0.45).normalize();
            let poles = [DVec3::new(0.2, 0.1, 0.97), DVec3::new(-0.3, -0.2, 0.93)];
            let poles = poles.map(DVec3::normalize);
            let rings = |normal: DVec3| -> f64 {
                let at = |pole: &DVec3| legendre(normal.dot(*pole)).nth(RINGS).unwrap_or(0.0);
                poles.iter().map(at).sum()
            };
            let light = |cosine: DVec3, rings: DVec3| 0.6 * cosine + 0.2 + 0.1 * rings;
            let irradiance = |normal: DVec3| {
                let cosine = DVec3::splat(normal.dot(sun).max(0.0));
                light(cosine, DVec3::splat(rings(normal)))
            };
            let scattered_sun = scattered_cosine(rho_mm, &Profile::SKIN);
            let passed = passed_harmonics(rho_mm, RINGS + 1, &Profile::SKIN)[RINGS];
            let normal = |point: DVec3| (point - middle) / rho_mm;
            let surface = sphere(rho_mm, -middle.z, irradiance);
            let on_sphere = |place: DVec2| {
                let depth = (rho_mm * rho_mm - place.length_squared()).sqrt();
                middle + place.extend(depth)
            };
            let scene = Scene {
                surface: &surface,
                scattered: &|point| {
                    let n = normal(point);
                    light(scattered_sun(n.dot(sun)), passed * rings(n))
                },
                atlas: unwrapped_sphere(rho_mm, middle, 192, irradiance),
                uv: &|point| sphere_uv(normal(point)),
                points: grid(5.5).map(on_sphere).collect(),
            };
            let view = View::orthographic([112; 2], PX_PER_MM);
            Ok(swing(&scene.follow(lab, view, &pan(quick))?))
        }),
    }
}

/// A dark layer before a lit one, and points beside its edge.
fn past_a_layer(quick: bool) -> Case {
    Case {
        group: Group::Time,
        name: "pan past a layer".into(),
        what: "A dark half-plane 5 mm before a lit one, its edge at 27 degrees, 4 px/mm, under a camera that pans by fractions \
               of a pixel. Points of the lit one, .75 to 4.4 mm beside the edge, are followed and read by Catmull-Rom; the \
               figure is the most that the error at one of them, against the visible integral of each frame, swings from \
               peak to peak. In the picture a frame is a row. In texture space nothing moves here; see the pan over a plane."
            .into(),
        passes: STEP,
        degrades: FOUND,
        why: WHY_SWING.into(),
        known: vec![],
        run: Box::new(move |lab| {
            const COLUMNS: usize = 24;
            let (gap_mm, far_mm) = (5.0, 300.0);
            let across = DVec2::from_angle(27f64.to_radians());
            // The edge lies beside the middle of the frame, the points to both sides of it.
            let from_edge = |point: DVec3| point.truncate().dot(across) + 2.6;
            let near = plane(DVec3::Z, far_mm - gap_mm, |_| DVec3::ZERO);
            let far = plane(DVec3::Z, far_mm, |_| DVec3::ONE);
            let points = [-0.7, 0.9].into_iter().flat_map(|y_mm| {
                (0..COLUMNS).map(move |i| {
                    let place = DVec2::new(0.75 + 0.16 * i as f64 - 2.6, y_mm);
                    across.rotate(place).extend(-far_mm)
                })
            });
            let points: Vec<DVec3> = points.collect();
            let view = View::orthographic([128; 2], PX_PER_MM);
            let mut track = Track::default();
            for (number, to_view) in (0..).zip(pan(quick)) {
                let moved = to_view.translation;
                let g = view.shoot(|origin, ray| {
                    let origin = origin - moved;
                    let edge = near(origin, ray).filter(|h| from_edge(h.point) < 0.0);
                    let found = edge.or_else(|| far(origin, ray))?;
                    Some(Hit {
                        point: found.point + moved,
                        ..found
                    })
                });
                let frame = Texels::of(&g, DVec3::ZERO).upload(&lab.gpu);
                let results = lab.scatter(&frame.inputs(), &frame.output)?;
                let taps = taps(&g, points.iter().map(|p| *p + moved));
                let asked: Vec<usize> = taps.iter().map(|t| t.pixel).collect();
                let truths = g.visible_integral(&asked, &Profile::SKIN);
                let of_methods: Vec<_> = results
                    .iter()
                    .map(|(m, r)| (*m, errors(&taps, &truths, asked.iter().map(|i| r[*i]))))
                    .collect();
                track.push(number, read(&taps, truths.iter().copied()), of_methods);
            }
            Ok(Outcome {
                figures: track.swing(),
                shown: Some(track.show(0..COLUMNS)),
            })
        }),
    }
}

/// An edge along a column, and a camera that pans along it by whole pixels.
fn by_whole_pixels() -> Case {
    Case {
        group: Group::Time,
        name: "pan by whole pixels".into(),
        what: "An edge along the columns of pixels, with a σ of a pixel at 4 px/mm, and a camera that pans along it by whole \
               pixels. The frame stays the same, and so do the results, while points of the surface move up through them: \
               the most that the error at one of them swings from peak to peak. Noise that is drawn for each pixel of the \
               frame does not move with the skin."
            .into(),
        passes: STEP,
        degrades: FOUND,
        why: WHY_SWING.into(),
        known: vec![],
        run: Box::new(move |lab| {
            let size = 112usize;
            let blur_mm2 = PX_PER_MM.powi(-2);
            let light = |x_mm: f64| DVec3::splat(step(x_mm, blur_mm2));
            let view = View::orthographic([size as u32; 2], PX_PER_MM);
            let g = view.shoot(plane(DVec3::Z, 300.0, |p| light(p.x)));
            let frame = Texels::of(&g, DVec3::ZERO).upload(&lab.gpu);
            let sheet = Sheet {
                middle: DVec3::new(0.0, 0.0, -300.0),
                along: DVec3::X,
                across: DVec3::Y,
                side_mm: 28.0,
            };
            let mut results = lab.scatter(&frame.inputs(), &frame.output)?;
            let everywhere = g.pixels(|_| true);
            let uvs: Vec<DVec2> = everywhere.iter().map(|(_, h)| sheet.uv(h.point)).collect();
            let atlas = sheet.unwrap(120, |place| light(place.x));
            results.extend(atlas.scatter(lab, &uvs)?);
            let border = (REACH_MM * PX_PER_MM).ceil() as usize;
            let inner = border..size - border;
            let mut track = Track::default();
            for (number, y) in (0..).zip(inner.clone()) {
                let row = inner.clone().map(|x| y * size + x);
                let place = |i: &usize| everywhere[*i].1.point.x;
                let truths: Vec<DVec3> = row
                    .clone()
                    .map(|i| scattered_step(place(&i), blur_mm2, &Profile::SKIN))
                    .collect();
                let of_methods: Vec<_> = results
                    .iter()
                    .map(|(m, r)| {
                        let errors = row.clone().zip(&truths);
                        (*m, errors.map(|(i, t)| r[i].as_dvec3() - t).collect())
                    })
                    .collect();
                track.push(number, truths, of_methods);
            }
            Ok(Outcome {
                figures: track.swing(),
                shown: Some(track.show(0..inner.len())),
            })
        }),
    }
}
