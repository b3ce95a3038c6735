//! The surface integral: Eq. 7 over a whole mesh.

use std::f32::consts::TAU;

use glam::Vec3;
use rayon::prelude::*;
use subsurface::{Gaussian, Profile};

use super::Progress;
use super::cloud::{Cloud, Kernel, Patch, REACH_SIGMAS};
use super::tree::Tree;

/// A mesh, its hidden side included.
#[derive(Clone, Copy, Debug)]
pub struct Triangles<'a> {
    /// Corners, in mm, finite.
    pub vertices_mm: &'a [Vec3],
    /// Three a triangle.
    pub indices: &'a [u32],
}

/// A place on a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Number of the triangle.
    pub triangle: usize,
    /// Shares of the triangle's corners; they sum to 1.
    pub barycentric: Vec3,
}

/// What [`surface_integral`] gives for each point that it is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceIntegral {
    /// L_d = Σᵢ wᵢ ∫ E Gᵢ dA, Eq. 7 as printed, with the 1/v that Eq. 10 lacks.
    pub printed: Vec<Vec3>,
    /// Σᵢ wᵢ ∫ E Gᵢ dA / ∫ Gᵢ dA: each Gaussian divided by its mass over the mesh.
    pub normalised: Vec<Vec3>,
    /// Places that light was asked for.
    pub samples: usize,
}

/// Side of a sample's area over σ, at a density of 1, and at most so many mm, which is what light
/// itself asks for: pores, and the edges of shadows.
const SPACING_SIGMAS: f32 = 0.47;
const SPACING_MM: f32 = 0.2;

/// Places that light is asked for at once.
const BATCH: usize = 1 << 20;

/// Eq. 7, L_d(p) = ∫ E(q) R(|q − p|) dA over the whole mesh, at the points `asked` for; of these only
/// the place counts, and for Gaussians of no width their irradiance.
///
/// The mesh is cut into pieces half a σ wide for narrow Gaussians, near the points alone, and .2 mm
/// for others, `density` times as many. `light` gives the irradiance at each place that it is handed.
///
/// # Errors
/// Those of `light`.
pub fn surface_integral<E>(
    mesh: Triangles,
    asked: &[Patch],
    profile: &Profile,
    density: f32,
    mut light: impl FnMut(&[Place]) -> Result<Vec<Vec3>, E>,
    progress: Progress,
) -> Result<SurfaceIntegral, E> {
    let points: Vec<Vec3> = asked.iter().map(|p| p.point_mm).collect();
    let points = Points { tree: Tree::new(&points), points };
    let mut result = SurfaceIntegral {
        printed: vec![Vec3::ZERO; asked.len()],
        normalised: vec![Vec3::ZERO; asked.len()],
        samples: 0,
    };
    for g in profile.gaussians().iter().filter(|g| g.variance_mm2 == 0.0) {
        for (i, p) in asked.iter().enumerate() {
            result.printed[i] += Vec3::from(g.weight) * p.irradiance;
            result.normalised[i] += Vec3::from(g.weight) * p.irradiance;
        }
    }
    let groups = by_spacing(profile, density);
    for (spacing_mm, gaussians) in &groups {
        let widest = gaussians.iter().map(|g| g.variance_mm2).fold(0.0, f32::max);
        let reach_mm = REACH_SIGMAS * widest.sqrt();
        let pieces = cut(mesh, &points, reach_mm, *spacing_mm);
        let share = 0.5 / groups.len() as f64;
        let mut lit = Vec::with_capacity(pieces.len());
        for batch in pieces.chunks(BATCH) {
            let places: Vec<Place> = batch.iter().map(|p| p.place).collect();
            for (piece, irradiance) in batch.iter().zip(light(&places)?) {
                lit.push(piece.middle(irradiance));
            }
            progress(share * batch.len() as f64 / pieces.len() as f64);
        }
        result.samples += pieces.len();
        let lit = Cloud::new(&lit);
        let surface = Cloud::new(&pieces.iter().flat_map(Piece::thirds).collect::<Vec<_>>());
        drop(pieces);
        let sums = |p: &Patch| {
            let mut sums = [Vec3::ZERO; 2];
            for g in gaussians {
                let kernel = Kernel::round(g.variance_mm2);
                let lit = lit.sum(p.point_mm, &kernel);
                let mean = Vec3::from(g.weight) * (lit.light / lit.mass).as_vec3();
                let mass = surface.sum(p.point_mm, &kernel).mass as f32;
                sums[0] += mean * mass / (TAU * g.variance_mm2);
                sums[1] += mean;
            }
            progress(share / asked.len() as f64);
            sums
        };
        let sums: Vec<_> = asked.par_iter().map(sums).collect();
        for (i, [printed, normalised]) in sums.into_iter().enumerate() {
            result.printed[i] += printed;
            result.normalised[i] += normalised;
        }
    }
    Ok(result)
}

/// The Gaussians that have a width, with those together that ask for patches of one size.
fn by_spacing(profile: &Profile, density: f32) -> Vec<(f32, Vec<Gaussian>)> {
    let mut groups: Vec<(f32, Vec<Gaussian>)> = Vec::new();
    for g in profile.gaussians().iter().filter(|g| g.variance_mm2 > 0.0) {
        let spacing = (SPACING_SIGMAS * g.variance_mm2.sqrt()).min(SPACING_MM) / density.sqrt();
        match groups.iter_mut().find(|(s, _)| *s == spacing) {
            Some((_, gaussians)) => gaussians.push(*g),
            None => groups.push((spacing, vec![*g])),
        }
    }
    groups
}

/// The points that are asked for, to find out what lies near them.
struct Points {
    tree: Tree,
    points: Vec<Vec3>,
}

impl Points {
    fn any_within(&self, center: Vec3, radius: f32) -> bool {
        self.tree.any_leaf(center, radius, |places| {
            let mut points = self.tree.order[places].iter();
            points.any(|&i| self.points[i as usize].distance_squared(center) <= radius * radius)
        })
    }
}

/// A small triangle, lit at its middle.
struct Piece {
    place: Place,
    corners_mm: [Vec3; 3],
}

impl Piece {
    fn area_mm2(&self) -> f32 {
        let [a, b, c] = self.corners_mm;
        (b - a).cross(c - a).length() / 2.0
    }

    /// The point where it is lit. Light that the whole piece held would be blurred by its width; from
    /// one point it is not, and what the point misses of the mass divides out of the mean of E.
    fn middle(&self, irradiance: Vec3) -> Patch {
        Patch {
            point_mm: self.corners_mm.iter().sum::<Vec3>() / 3.0,
            area_mm2: self.area_mm2(),
            irradiance,
        }
    }

    /// Three points that stand for its area: a sum over them is right for all that is quadratic
    /// across it, so that the mass does not depend on how a mesh is cut.
    fn thirds(&self) -> [Patch; 3] {
        let sum_mm = self.corners_mm.iter().sum::<Vec3>();
        self.corners_mm.map(|corner| Patch {
            point_mm: (sum_mm + 3.0 * corner) / 6.0,
            area_mm2: self.area_mm2() / 3.0,
            irradiance: Vec3::ZERO,
        })
    }
}

/// Cuts what lies within `reach_mm` of the points into pieces.
fn cut(mesh: Triangles, points: &Points, reach_mm: f32, spacing_mm: f32) -> Vec<Piece> {
    let cutter = Cutter {
        points,
        reach_mm,
        // Halves of squares come out, of which this is the diagonal.
        longest_mm: 2.0 * spacing_mm,
    };
    let triangles = mesh.indices.par_chunks_exact(3).enumerate();
    triangles
        .flat_map_iter(|(triangle, corners)| {
            let corner = |i: usize| Corner {
                point_mm: mesh.vertices_mm[corners[i] as usize],
                barycentric: Vec3::AXES[i],
            };
            let mut pieces = Vec::new();
            cutter.cut(triangle, [0, 1, 2].map(corner), false, &mut pieces);
            pieces
        })
        .collect()
}

struct Cutter<'a> {
    points: &'a Points,
    reach_mm: f32,
    longest_mm: f32,
}

#[derive(Clone, Copy)]
struct Corner {
    point_mm: Vec3,
    barycentric: Vec3,
}

impl Cutter<'_> {
    /// Halves a triangle across its longest edge until it is small enough, and drops what is out of
    /// reach; `is_near` spares the search where all of it is known to be within.
    fn cut(&self, triangle: usize, corners: [Corner; 3], mut is_near: bool, pieces: &mut Vec<Piece>) {
        let [a, b, c] = corners.map(|c| c.point_mm);
        let center = (a + b + c) / 3.0;
        let radius = [a, b, c].map(|p| p.distance(center));
        let radius = radius.into_iter().fold(0.0, f32::max);
        if !is_near {
            if !self.points.any_within(center, self.reach_mm + radius) {
                return;
            }
            is_near = radius < self.reach_mm && self.points.any_within(center, self.reach_mm - radius);
        }
        let edges = [a.distance(b), b.distance(c), c.distance(a)];
        let longest = (0..3).max_by(|&i, &j| edges[i].total_cmp(&edges[j])).unwrap_or(0);
        // What is not finite would never become small.
        if edges[longest] <= self.longest_mm || !edges[longest].is_finite() {
            let barycentric = corners.iter().map(|c| c.barycentric).sum::<Vec3>() / 3.0;
            pieces.push(Piece { place: Place { triangle, barycentric }, corners_mm: [a, b, c] });
            return;
        }
        let [start, end] = [longest, (longest + 1) % 3];
        let middle = Corner {
            point_mm: (corners[start].point_mm + corners[end].point_mm) / 2.0,
            barycentric: (corners[start].barycentric + corners[end].barycentric) / 2.0,
        };
        for replaced in [start, end] {
            let mut half = corners;
            half[replaced] = middle;
            self.cut(triangle, half, is_near, pieces);
        }
    }
}
