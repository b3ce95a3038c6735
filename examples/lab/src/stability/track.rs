//! What becomes of points of a surface from frame to frame.

use glam::{DAffine3, DVec2, DVec3, Vec3};

use crate::Error;
use crate::stability::case::{Figures, Outcome, Shown};
use crate::stability::inputs::Texels;
use crate::stability::lab::Lab;
use crate::stability::scene::Scene;
use crate::synthetic::{GBuffer, Hit, View, largest};

/// Errors at the same points in each frame of a sequence.
#[derive(Default)]
pub struct Track {
    /// Which frames these are: neighbours have numbers that follow each other.
    frames: Vec<u32>,
    /// By frame, then by point, as all of these.
    truth: Vec<Vec<DVec3>>,
    errors: Vec<(&'static str, Vec<Vec<DVec3>>)>,
}

impl Track {
    /// The truth of the next frame at each point, and every method's difference to it.
    pub fn push(
        &mut self,
        frame: u32,
        truth: Vec<DVec3>,
        errors: impl IntoIterator<Item = (&'static str, Vec<DVec3>)>,
    ) {
        self.frames.push(frame);
        self.truth.push(truth);
        for (method, of_points) in errors {
            match self.errors.iter_mut().find(|(m, _)| *m == method) {
                Some((_, of_frames)) => of_frames.push(of_points),
                None => self.errors.push((method, vec![of_points])),
            }
        }
    }

    /// The largest error of all.
    pub fn worst(&self) -> Figures {
        self.figures(|frames| {
            let errors = frames.iter().flatten();
            largest(errors.flat_map(|e| e.abs().to_array()))
        })
    }

    /// The most that an error at a point swings over all frames, from peak to peak.
    pub fn swing(&self) -> Figures {
        self.figures(|frames| {
            let swing = |point: usize, channel: usize| {
                let errors = frames.iter().map(|f| f[point][channel]);
                largest(errors.clone()) + largest(errors.map(|e| -e))
            };
            let points = 0..frames[0].len();
            largest(points.flat_map(|p| [0, 1, 2].map(|c| swing(p, c))))
        })
    }

    /// The most that an error at a point changes by from one frame to the next.
    pub fn step(&self) -> Figures {
        self.figures(|frames| {
            let steps = self.neighbours().flat_map(|i| {
                let pairs = frames[i].iter().zip(&frames[i + 1]);
                pairs.flat_map(|(a, b)| (*b - *a).abs().to_array())
            });
            largest(steps)
        })
    }

    /// The most that a result at a point falls by from one frame to the next; 0 where it never does.
    pub fn fall(&self) -> Figures {
        self.figures(|frames| {
            let result = |frame: usize, point: usize| self.truth[frame][point] + frames[frame][point];
            let falls = self.neighbours().flat_map(|i| {
                let points = 0..frames[i].len();
                points.flat_map(move |p| (result(i, p) - result(i + 1, p)).to_array())
            });
            largest(falls.chain([0.0]))
        })
    }

    /// A figure of it, and a picture of `points`.
    pub fn outcome(&self, figures: fn(&Self) -> Figures, points: std::ops::Range<usize>) -> Outcome {
        Outcome { figures: figures(self), shown: Some(self.show(points)) }
    }

    /// A picture of `points`, side by side, a frame a row from the first on.
    fn show(&self, points: std::ops::Range<usize>) -> Shown {
        // No more rows than a small picture has room for.
        let frames = || (0..self.frames.len()).step_by(self.frames.len().div_ceil(12));
        let places = || frames().flat_map(|f| points.clone().map(move |p| (f, p)));
        let result = |errors: &[Vec<DVec3>]| -> Vec<Vec3> {
            let result = |(f, p): (usize, usize)| (self.truth[f][p] + errors[f][p]).as_vec3();
            places().map(result).collect()
        };
        Shown {
            size: [points.len() as u32, frames().count() as u32],
            truth: places().map(|(f, p)| self.truth[f][p].as_vec3()).collect(),
            results: self.errors.iter().map(|(m, e)| (*m, result(e))).collect(),
        }
    }

    /// The first of each two frames that follow each other.
    fn neighbours(&self) -> impl Iterator<Item = usize> + '_ {
        (1..self.frames.len()).filter(|i| self.frames[*i] == self.frames[i - 1] + 1).map(|i| i - 1)
    }

    fn figures(&self, of: impl Fn(&[Vec<DVec3>]) -> f64) -> Figures {
        let methods = self.errors.iter();
        methods.map(|(method, frames)| (*method, of(frames))).collect()
    }
}

/// A pixel that a point between pixels is read from.
pub struct Tap {
    pub pixel: usize,
    /// Of its surface, in view space.
    pub point: DVec3,
    weight: f64,
}

/// How many pixels a point is read from: a cubic each way.
pub const TAPS: usize = 16;

/// Where these points of view space are read in the picture: by Catmull–Rom, `TAPS` for each.
pub fn taps(g: &GBuffer, points: impl IntoIterator<Item = DVec3>) -> Vec<Tap> {
    let width = g.view.size[0] as usize;
    let mut taps = Vec::new();
    for point in points {
        let at = project(&g.view, point) - 0.5;
        let first = at.floor();
        let [x, y] = (at - first).to_array().map(cubic);
        let first = (first - 1.0).as_usizevec2();
        for (j, row) in y.into_iter().enumerate() {
            for (i, column) in x.into_iter().enumerate() {
                let pixel = (first.y + j) * width + first.x + i;
                let hit = g.hits[pixel].expect("what is followed stays in the picture");
                taps.push(Tap { pixel, point: hit.point, weight: row * column });
            }
        }
    }
    taps
}

/// Values at the points that were read, from those at their taps.
pub fn read(taps: &[Tap], values: impl IntoIterator<Item = DVec3>) -> Vec<DVec3> {
    let weighed = values.into_iter().zip(taps).map(|(v, tap)| v * tap.weight);
    let weighed: Vec<DVec3> = weighed.collect();
    weighed.chunks(TAPS).map(|of_point| of_point.iter().sum()).collect()
}

/// Errors at the points that were read, from results and truths at their taps.
pub fn errors(taps: &[Tap], truths: &[DVec3], results: impl IntoIterator<Item = Vec3>) -> Vec<DVec3> {
    let pairs = results.into_iter().zip(truths);
    read(taps, pairs.map(|(r, truth)| r.as_dvec3() - truth))
}

/// One surface that stands still, and points of it that are followed through the picture.
pub struct Followed {
    pub scene: Scene,
    /// Of its atlas.
    pub texels: [u32; 2],
    pub points: Vec<DVec3>,
}

/// What [`Followed::swing`] measures, for a case's text.
pub const FOLLOWED: &str = "Points of the surface are followed and read by Catmull-Rom; the \
    figure is the most that the error at one of them, against the closed form, swings from peak \
    to peak. Texture space scatters once. In the picture a frame is a row.";

/// Points that are followed: rows and columns of a grid, the middle of which is shown.
const GRID: [usize; 2] = [9, 32];

/// Places up to `half_mm` from a middle, row by row.
pub fn grid(half_mm: f64) -> impl Iterator<Item = DVec2> {
    let [rows, columns] = GRID;
    let place = move |i: usize, count: usize| half_mm * ((2 * i + 1) as f64 / count as f64 - 1.0);
    let row = move |j| (0..columns).map(move |i| DVec2::new(place(i, columns), place(j, rows)));
    (0..rows).flat_map(row)
}

impl Followed {
    /// How far every method's errors at the points swing, as cameras see them that turn the scene to their
    /// view space.
    ///
    /// # Errors
    /// Inputs that a method refuses.
    pub fn swing(&self, lab: &Lab, view: View, cameras: &[DAffine3]) -> Result<Outcome, Error> {
        let (mut frames, mut uvs) = (Vec::new(), Vec::new());
        for to_view in cameras {
            let from_view = to_view.inverse();
            let g = view.shoot(|origin, ray| {
                let origin = from_view.transform_point3(origin);
                let (_, hit) = self.scene.hit(origin, from_view.transform_vector3(ray))?;
                Some(Hit {
                    point: to_view.transform_point3(hit.point),
                    normal: to_view.transform_vector3(hit.normal),
                    ..hit
                })
            });
            let frame = Texels::of(&g, 0.0).upload(&lab.gpu);
            let results = lab.scatter(&frame.frame(), &frame.output)?.into_iter();
            let taps = taps(&g, self.points.iter().map(|p| to_view.transform_point3(*p)));
            let places = taps.iter().map(|t| from_view.transform_point3(t.point));
            let places: Vec<DVec3> = places.collect();
            let truths: Vec<DVec3> = places.iter().map(|p| self.scene.scattered(0, *p)).collect();
            let at_taps = |r: Vec<Vec3>| errors(&taps, &truths, taps.iter().map(|t| r[t.pixel]));
            let errors: Vec<_> = results.map(|(m, r)| (m, at_taps(r))).collect();
            uvs.extend(places.into_iter().map(|p| self.scene.uv(0, p)));
            frames.push((taps, truths, errors));
        }
        let textured = self.scene.unwrap(self.texels).scatter(lab, &uvs)?;
        let mut track = Track::default();
        let count = self.points.len() * TAPS;
        for (number, (taps, truths, mut of_methods)) in (0..).zip(frames) {
            for (method, fetched) in &textured {
                let fetched = fetched[number as usize * count..][..count].iter().copied();
                of_methods.push((*method, errors(&taps, &truths, fetched)));
            }
            let truth = self.points.iter().map(|p| self.scene.scattered(0, *p)).collect();
            track.push(number, truth, of_methods);
        }
        // Few enough points for a small picture.
        let [rows, columns] = GRID;
        let first = rows / 2 * columns + 4;
        Ok(track.outcome(Track::swing, first..first + columns - 8))
    }
}

/// A place in the picture, in pixels from its upper left.
fn project(view: &View, point: DVec3) -> DVec2 {
    let clip = view.projection * point.extend(1.0);
    let ndc = clip.truncate().truncate() / clip.w;
    let size = DVec2::new(view.size[0].into(), view.size[1].into());
    DVec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * size
}

/// Weights of four pixels in a row, for a place this far from the second to the third.
fn cubic(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        -0.5 * t + t2 - 0.5 * t3,
        1.0 - 2.5 * t2 + 1.5 * t3,
        0.5 * t + 2.0 * t2 - 1.5 * t3,
        -0.5 * t2 + 0.5 * t3,
    ]
}
