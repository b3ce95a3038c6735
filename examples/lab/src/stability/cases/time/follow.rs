//! Points of a surface that are followed through the picture while the camera moves.

use crate::Error;
use glam::{DAffine3, DVec2, DVec3};

use super::track::{TAPS, Track, errors, taps};
use crate::stability::case::Outcome;
use crate::stability::frame::Texels;
use crate::stability::lab::Lab;
use crate::stability::unwrapped::Unwrapped;
use crate::synthetic::{Hit, View};

/// What [`Scene::follow`] and [`swing`] are, for a case's text.
pub const FOLLOWED: &str = "Points of the surface are followed and read by Catmull-Rom; the figure is the most that the \
                        error at one of them, against the closed form, swings from peak to peak. Texture space \
                        scatters once, and each frame fetches from its atlas. In the picture a frame is a row.";

/// Points that are followed: rows and columns of a grid, one row of which is shown.
const GRID: [usize; 2] = [9, 32];

/// What stands still.
pub struct Scene<'a> {
    /// What a ray finds of it.
    pub surface: &'a dyn Fn(DVec3, DVec3) -> Option<Hit>,
    /// The scattered light at a point of it.
    pub scattered: &'a dyn Fn(DVec3) -> DVec3,
    pub atlas: Unwrapped,
    pub uv: &'a dyn Fn(DVec3) -> DVec2,
    /// Those that are followed.
    pub points: Vec<DVec3>,
}

impl Scene<'_> {
    /// Every method's errors at the points, as cameras see them that turn the scene to their view
    /// space. Texture space scatters once, and every frame fetches from that.
    pub fn follow(&self, lab: &Lab, view: View, cameras: &[DAffine3]) -> Result<Track, Error> {
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
            let results = lab.scatter(&frame.inputs(), &frame.output)?;
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
pub fn grid(half_mm: f64) -> impl Iterator<Item = DVec2> {
    let [rows, columns] = GRID;
    let place = move |i: usize, count: usize| half_mm * ((2 * i + 1) as f64 / count as f64 - 1.0);
    (0..rows)
        .flat_map(move |j| (0..columns).map(move |i| DVec2::new(place(i, columns), place(j, rows))))
}

/// The swing of a track, and its middle row as a picture.
pub fn swing(track: &Track) -> Outcome {
    let [rows, columns] = GRID;
    // Few enough for a small picture.
    let middle = rows / 2 * columns + 4;
    Outcome {
        figures: track.swing(),
        shown: Some(track.show(middle..middle + columns - 8)),
    }
}
