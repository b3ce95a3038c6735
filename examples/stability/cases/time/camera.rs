//! The camera moves, the light does not: points of the surface are followed through the picture.

use std::f64::consts::FRAC_PI_2;

use glam::{DAffine3, DVec2, DVec3};
use subsurface::truth::closed_form::{
    legendre, passed_harmonics, passed_wave, scattered_cosine, scattered_spot, scattered_step, step,
};
use subsurface::{Error, Plan, Profile};

use super::atlas::{Sheet, sphere_uv, unwrapped_sphere};
use super::track::{TAPS, Track, errors, read, taps};
use super::{REACH_MM, SEEN, STEP};
use crate::case::{Case, Group, Known, Outcome};
use crate::common::{Hit, View, plane, sphere, tilted_normal};
use crate::frame::Texels;
use crate::lab::Lab;
use crate::unwrapped::Unwrapped;

const PX_PER_MM: f64 = 4.0;

/// Points that are followed: rows and columns of a grid, one row of which is shown.
const GRID: [usize; 2] = [9, 32];

pub fn cases(quick: bool) -> Vec<Case> {
    vec![
        pan_over_a_plane(0.0, quick),
        pan_over_a_plane(40.0, quick),
        pan_over_a_sphere(quick),
        pan_past_a_layer(quick),
        roll(quick),
        zoom(quick),
        noise(),
    ]
}

/// What stands still.
struct Scene<'a> {
    /// What a ray finds of it.
    surface: &'a dyn Fn(DVec3, DVec3) -> Option<Hit>,
    /// The scattered light at a point of it.
    scattered: &'a dyn Fn(DVec3) -> DVec3,
    atlas: Unwrapped,
    uv: &'a dyn Fn(DVec3) -> DVec2,
    /// Those that are followed.
    points: Vec<DVec3>,
}

impl Scene<'_> {
    /// Every method's errors at the points, as cameras see them that turn the scene to their view
    /// space. Texture space scatters once, and every frame fetches from that.
    fn follow(&self, lab: &Lab, view: View, cameras: &[DAffine3]) -> Result<Track, Error> {
        let mut frames = Vec::new();
        let mut uvs = Vec::new();
        for to_view in cameras {
            let from_view = to_view.inverse();
            let g = view.shoot(|origin, ray| {
                let origin = from_view.transform_point3(origin);
                let found = (self.surface)(origin, from_view.transform_vector3(ray))?;
                Some(Hit {
                    point: to_view.transform_point3(found.point),
                    normal: to_view.transform_vector3(found.normal),
                    ..found
                })
            });
            let frame = Texels::of(&g, DVec3::ZERO).upload(&lab.gpu);
            let results = lab.scatter(&frame.inputs())?;
            let taps = taps(&g, self.points.iter().map(|p| to_view.transform_point3(*p)));
            let places = taps.iter().map(|t| from_view.transform_point3(t.point));
            let places: Vec<DVec3> = places.collect();
            let truths: Vec<DVec3> = places.iter().map(|p| (self.scattered)(*p)).collect();
            let of_methods: Vec<_> = results
                .iter()
                .map(|(m, r)| (*m, errors(&taps, &truths, taps.iter().map(|t| r[t.pixel]))))
                .collect();
            uvs.extend(places.into_iter().map(self.uv));
            frames.push((taps, truths, of_methods));
        }
        let textured = self.atlas.scatter(lab, &uvs)?;
        let mut track = Track::default();
        let count = self.points.len() * TAPS;
        for (number, (taps, truths, mut of_methods)) in (0..).zip(frames) {
            for (method, fetched) in &textured {
                let fetched = fetched[number as usize * count..][..count].iter().copied();
                of_methods.push((*method, errors(&taps, &truths, fetched)));
            }
            let truth = self.points.iter().map(|p| (self.scattered)(*p)).collect();
            track.push(number, truth, of_methods);
        }
        Ok(track)
    }
}

/// Places up to `half_mm` from a middle, row by row.
fn grid(half_mm: f64) -> impl Iterator<Item = DVec2> {
    let [rows, columns] = GRID;
    let place = move |i: usize, count: usize| half_mm * ((2 * i + 1) as f64 / count as f64 - 1.0);
    (0..rows)
        .flat_map(move |j| (0..columns).map(move |i| DVec2::new(place(i, columns), place(j, rows))))
}

/// The swing of a track, and its middle row as a picture.
fn swing(track: &Track) -> Outcome {
    let [rows, columns] = GRID;
    // Few enough for a small picture.
    let middle = rows / 2 * columns + 4;
    Outcome {
        figures: track.swing(),
        shown: Some(track.show(middle..middle + columns - 8)),
    }
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

const WHY_SWING: &str = "1/255 is a step of eight bits, which an eye sees where it comes and goes; .01 is what it \
                         sees without looking for it.";

const FOLLOWED: &str = "Points of the surface are followed and read by Catmull-Rom; the figure is the most that \
                        the error at one of them swings, from peak to peak, against the closed form. Texture space scatters \
                        once, and every frame fetches from its atlas, which has 2 texels a pixel. In the picture a frame is a row.";

/// A plane under waves of all directions.
fn pan_over_a_plane(tilt_degrees: f64, quick: bool) -> Case {
    let lattices = Known {
        method: "screen_planned",
        at_most: 0.0095,
        by_nature: false,
        why: "A plan's taps lie on lattices of whole pixels, of which each slope takes one, and a simple tile takes one for \
              all of it: where two of them meet, a point goes from the one to the other as tiles pass over it, and on waves this fine \
              they differ. Without simple tiles it is .0025 (and .0054 at 50 degrees either way; 20, 30 and \
              60 degrees pass; measured once). `ScreenSpace` does not swing."
            .into(),
    };
    Case {
        group: Group::Time,
        name: format!("pan over a plane at {tilt_degrees}°"),
        what: format!(
            "A plane tilted by {tilt_degrees} degrees in perspective, lit by waves of 8 px and longer at 4 px/mm, under a camera that pans \
             by fractions of a pixel. {FOLLOWED}"
        ),
        passes: STEP,
        degrades: SEEN,
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
fn pan_over_a_sphere(quick: bool) -> Case {
    Case {
        group: Group::Time,
        name: "pan over a sphere".into(),
        what: format!(
            "A sphere of 10 mm at 4 px/mm, lit from the side and by two sets of rings 10 px wide, where n_z is above \
             .6. {FOLLOWED}"
        ),
        passes: STEP,
        degrades: SEEN,
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
fn pan_past_a_layer(quick: bool) -> Case {
    Case {
        group: Group::Time,
        name: "pan past a layer".into(),
        what: "A dark half-plane 5 mm before a lit one, its edge at 27 degrees, 4 px/mm, under a camera that pans \
               by fractions of a pixel. Points of the lit one, .75 to 4.4 mm beside the edge, are followed and read \
               by Catmull-Rom; the figure is the most that the error at one of them swings, from peak to peak, against the visible \
               integral of each frame, read likewise. In the picture a frame is a row. In texture space layers lie apart and nothing moves: see the pan over a plane."
            .into(),
        passes: STEP,
        degrades: SEEN,
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
                let results = lab.scatter(&frame.inputs())?;
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

/// A spot of light, and a camera that turns about its own axis.
fn roll(quick: bool) -> Case {
    Case {
        group: Group::Time,
        name: "camera rolls over a spot".into(),
        what: format!(
            "A spot of light on a plane, sigma 2 px at 4 px/mm, under a camera that turns by 90 degrees about \
             its own axis. {FOLLOWED}"
        ),
        passes: STEP,
        degrades: SEEN,
        why: format!("{WHY_SWING} A kernel that is not round turns with the camera."),
        known: vec![Known {
            method: "texture_separable",
            at_most: 0.0095,
            by_nature: false,
            why: "The final pass fetches bilinearly, which flattens the tip of the spot between texels, two to a pixel, \
                  and pixels come to lie there. A finer atlas, or a cubic fetch."
                .into(),
        }],
        run: Box::new(move |lab| {
            let sheet = Sheet {
                middle: DVec3::new(0.0, 0.0, -300.0),
                along: DVec3::X,
                across: DVec3::Y,
                side_mm: 32.0,
            };
            let (spot, spot_mm2) = (DVec2::new(0.13, 0.21), (2.0 / PX_PER_MM).powi(2));
            let irradiance = |place: DVec2| {
                DVec3::splat((-place.distance_squared(spot) / (2.0 * spot_mm2)).exp())
            };
            let surface = plane(DVec3::Z, 300.0, |p| irradiance(p.truncate()));
            let scene = Scene {
                surface: &surface,
                scattered: &|point| {
                    let r_mm = sheet.place(point).distance(spot);
                    scattered_spot(r_mm, spot_mm2, &Profile::SKIN)
                },
                atlas: sheet.unwrap(256, irradiance),
                uv: &|point| sheet.uv(point),
                points: grid(3.0).map(|place| sheet.point(spot + place)).collect(),
            };
            let turns = if quick { 15 } else { 90 };
            let turned = |i: u32| FRAC_PI_2 * f64::from(i) / f64::from(turns);
            let cameras: Vec<DAffine3> = (0..=turns)
                .map(|i| DAffine3::from_rotation_z(turned(i)))
                .collect();
            let view = View::orthographic([128; 2], PX_PER_MM);
            Ok(swing(&scene.follow(lab, view, &cameras)?))
        }),
    }
}

/// Frames of a zoom from .3 to 30 px/mm.
const ZOOM: u32 = 200;

fn zoomed(frame: f64) -> f64 {
    0.3 * f64::powf(100.0, frame / f64::from(ZOOM))
}

/// The frames of the zoom that lie around a change of the plan's blurs.
fn around_switches(plan: &Plan) -> Vec<u32> {
    let rows = plan.rows(0);
    let blurs = |i: usize| rows[i].weights.iter().rposition(|w| w.max_element() > 0.0);
    // Weights are mixed from row to row: what is new fades in from the one to the other.
    let switches = (1..rows.len()).filter(|i| blurs(*i) != blurs(i - 1));
    let at: Vec<f64> = switches
        .flat_map(|i| [i - 1, i])
        .map(|i| (f64::from(rows[i].px_per_mm) / 0.3).log(100.0) * f64::from(ZOOM))
        .collect();
    let near = |frame: &u32| at.iter().any(|a| (a - f64::from(*frame)).abs() < 1.5);
    (0..=ZOOM).filter(near).collect()
}

/// An edge that comes closer.
fn zoom(quick: bool) -> Case {
    Case {
        group: Group::Time,
        name: "zoom by 100 times".into(),
        what: "An edge that a camera zooms in on, from .3 to 30 px/mm in 200 frames (the quick form: those around \
               each switch of the plan's levels), soft by 2 px of each frame as a filtered shadow is: the most that \
               the error at a point changes by from one frame to the next, against the closed form. Texture space fetches from an \
               atlas of 12.8 texels/mm. Frames are strips, of 8 rows; burley_disk, which needs as many rows as columns, is \
               left out."
            .into(),
        passes: STEP,
        degrades: SEEN,
        why: "A step of eight bits from one frame to the next is a pop that an eye may see; .01 is one that it does."
            .into(),
        known: vec![],
        run: Box::new(move |lab| {
            let sheet = Sheet {
                middle: DVec3::new(0.0, 0.0, -300.0),
                along: DVec3::X,
                across: DVec3::Y,
                side_mm: 40.0,
            };
            let frames = if quick {
                around_switches(&lab.plan)
            } else {
                (0..=ZOOM).collect()
            };
            let places: Vec<f64> = (-40..=40).map(|i| 0.1 * f64::from(i)).collect();
            let mut track = Track::default();
            for frame in frames {
                let px_per_mm = zoomed(frame.into());
                let blur_mm2 = (2.0 / px_per_mm).powi(2);
                let light = |x_mm: f64| DVec3::splat(step(x_mm, blur_mm2));
                let truth = |x_mm: f64| scattered_step(x_mm, blur_mm2, &Profile::SKIN);
                let view = View::orthographic([832, 8], px_per_mm);
                let g = view.shoot(plane(DVec3::Z, 300.0, |p| light(p.x)));
                let taps = taps(&g, places.iter().map(|x| DVec3::new(*x, 0.0, -300.0)));
                let truths: Vec<DVec3> = taps.iter().map(|t| truth(t.point.x)).collect();
                let uploaded = Texels::of(&g, DVec3::ZERO).upload(&lab.gpu);
                let mut of_methods = Vec::new();
                for (method, r) in lab.scatter(&uploaded.inputs())? {
                    if method != "burley_disk" {
                        let read = taps.iter().map(|t| r[t.pixel]);
                        of_methods.push((method, errors(&taps, &truths, read)));
                    }
                }
                let atlas = Unwrapped::new([512, 8], |uv| {
                    let x_mm = (uv.x - 0.5) * sheet.side_mm;
                    let y_mm = (uv.y - 0.5) * 8.0 / 512.0 * sheet.side_mm;
                    Some(crate::unwrapped::Texel {
                        point_mm: DVec3::new(x_mm, y_mm, -300.0),
                        irradiance: light(x_mm),
                        area_mm2: (sheet.side_mm / 512.0).powi(2),
                    })
                });
                let uvs = taps.iter().map(|t| DVec2::new(t.point.x / sheet.side_mm + 0.5, 0.5));
                for (method, fetched) in atlas.scatter(lab, &uvs.collect::<Vec<_>>())? {
                    of_methods.push((method, errors(&taps, &truths, fetched)));
                }
                track.push(frame, places.iter().map(|x| truth(*x)).collect(), of_methods);
            }
            Ok(Outcome {
                figures: track.step(),
                shown: Some(track.show(0..places.len())),
            })
        }),
    }
}

/// An edge along a column, and a camera that pans along it by whole pixels.
fn noise() -> Case {
    Case {
        group: Group::Time,
        name: "pan by whole pixels".into(),
        what: "An edge along the columns of pixels, soft by a pixel at 4 px/mm, and a camera that pans along it by whole \
               pixels. The frame stays the same, and so do the results; a point of the surface moves up \
               through them. The figure is the most that it swings, from peak to peak."
            .into(),
        passes: STEP,
        degrades: SEEN,
        why: format!("{WHY_SWING} Noise that is drawn for each pixel of the frame does not move with the skin."),
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
            let mut results = lab.scatter(&frame.inputs())?;
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
