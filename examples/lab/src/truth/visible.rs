//! The visible integral: Eq. 7 over what the camera sees.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use subsurface::Profile;

use super::Progress;
use super::cloud::{Cloud, Kernel, Patch};

/// What a pixel sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// The surface that it shows: irradiance as the frame has it, area on the tangent plane.
    pub patch: Patch,
    /// The way to the surface of the next pixel in the row, and in the column: [`even_steps`].
    pub steps_mm: [Vec3; 2],
}

/// ∂p/∂x and ∂p/∂y, the way on the tangent plane to where the next pixel in the row and in the column looks,
/// where the surface goes on evenly. Where it bends within a pixel, or ends, its lattice is not known, and that
/// of a surface facing the camera stands in, `facing_mm` between pixels. `beside` has the ways to the surface
/// of the pixels beside, by columns and rows, where they are of the same profile.
pub fn even_steps(
    tangents_mm: [Vec3; 2],
    facing_mm: f32,
    beside: impl Fn(i32, i32) -> Option<Vec3>,
) -> [Vec3; 2] {
    /// Of a step, what a neighbour may lie off the end of it.
    const EVEN: f32 = 0.25;
    let is_even = |step: Vec3, x: i32, y: i32| {
        [1, -1].into_iter().all(|side| {
            let found = beside(side * x, side * y);
            found.is_some_and(|way| way.distance(side as f32 * step) <= EVEN * step.length())
        })
    };
    match is_even(tangents_mm[0], 1, 0) && is_even(tangents_mm[1], 0, 1) {
        true => tangents_mm,
        false => [Vec3::X, Vec3::Y].map(|step| facing_mm * step),
    }
}

/// Σᵢ wᵢ ∫ E Gᵢ dA / ∫ Gᵢ dA over what the camera sees: every pixel summed for every pixel, no taps,
/// no separability. It is the best that a method can do that knows the frame alone.
///
/// `pixels` are those of one profile, `asked` are places among them; the result is theirs. Point
/// weights of Gaussians narrower than a pixel spread too little; along the lattice that the pixels form on
/// the surface, and across it, they take the variance by which light that is soft by a pixel comes out right.
pub fn visible_integral(
    pixels: &[Pixel],
    asked: &[usize],
    profile: &Profile,
    progress: Progress,
) -> Vec<Vec3> {
    let patches: Vec<Patch> = pixels.iter().map(|p| p.patch).collect();
    let cloud = Cloud::new(&patches);
    asked
        .par_iter()
        .map(|&i| {
            let pixel = &pixels[i];
            let lattice = Lattice::new(pixel.steps_mm);
            let scattered = profile.gaussians().iter().map(|g| {
                if g.variance_mm2 == 0.0 {
                    return Vec3::from(g.weight) * pixel.patch.irradiance;
                }
                let sum = cloud.sum(pixel.patch.point_mm, &lattice.kernel(g.variance_mm2));
                Vec3::from(g.weight) * (sum.light / sum.mass).as_vec3()
            });
            let sum = scattered.sum();
            progress(1.0 / asked.len() as f64);
            sum
        })
        .collect()
}

/// How the pixels around one lie on its tangent plane.
struct Lattice {
    /// Unit vectors along its shortest step, and across.
    axes: [DVec3; 2],
    /// Between points along a row, and between rows.
    spacing_mm: [f64; 2],
}

impl Lattice {
    fn new(steps_mm: [Vec3; 2]) -> Self {
        let [mut a, mut b] = steps_mm.map(|step| step.as_dvec3());
        // Lagrange's reduction: the shortest steps, which are nearest to a right angle.
        loop {
            if b.length_squared() < a.length_squared() {
                (a, b) = (b, a);
            }
            let shorter = b - (a.dot(b) / a.length_squared()).round() * a;
            // Also of no step at all, which makes it no number.
            if shorter.length_squared() < b.length_squared() {
                b = shorter;
            } else {
                break;
            }
        }
        let along = a.normalize_or_zero();
        let across = b - along * b.dot(along);
        Self { axes: [along, across.normalize_or_zero()], spacing_mm: [a.length(), across.length()] }
    }

    /// The weights of a Gaussian.
    fn kernel(&self, variance_mm2: f32) -> Kernel {
        let variances = self.spacing_mm.map(|mm| lattice_variance(variance_mm2.into(), mm * mm));
        let narrow = usize::from(variances[1] < variances[0]);
        let [narrowest, widest] = [variances[narrow], variances[1 - narrow]];
        Kernel {
            variance_mm2: widest as f32,
            narrowed: (self.axes[narrow] * (narrowest.recip() - widest.recip()).sqrt()).as_vec3(),
        }
    }
}

/// The wave, in radians a pixel, that weights pass as their Gaussian would. Edges that are soft by a
/// pixel are mostly made of it; at 1.1 they come out best, to .0005 from .5 to 12 px/mm, which is as far as
/// weights go that are not negative.
const WAVE: f64 = 1.1;

/// The variance whose point weights exp(−n²/2s), on a lattice of cells of this area, blur
/// [`WAVE`] as a Gaussian of `variance_mm2` does: by bisection.
fn lattice_variance(variance_mm2: f64, cell_mm2: f64) -> f64 {
    let wanted = variance_mm2 / cell_mm2;
    // The lattice no longer matters: 1e-6 at 1 px².
    if wanted > 1.0 || !wanted.is_finite() {
        return variance_mm2;
    }
    let passed = |s: f64| {
        let (mut mass, mut wave) = (1.0, 1.0);
        // Six pixels are six σ or more.
        for n in 1..=6 {
            let n = f64::from(n);
            let pair = 2.0 * (-n * n / (2.0 * s)).exp();
            mass += pair;
            wave += pair * (n * WAVE).cos();
        }
        wave / mass
    };
    let gaussian = (-0.5 * wanted * WAVE * WAVE).exp();
    let (mut low, mut high) = (1e-4, 2.0);
    for _ in 0..40 {
        let middle = (low + high) / 2.0;
        if passed(middle) > gaussian {
            low = middle;
        } else {
            high = middle;
        }
    }
    low * cell_mm2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::truth::closed_form::{scattered_step, step};
    use glam::DMat3;

    /// The largest error on an edge that the picture shows soft by a pixel, on a plane that is turned by
    /// `tilt`° about the image axis at `axis`°; with the lattice of the surface, or of one facing the camera.
    fn worst(px_per_mm: f64, tilt: f64, axis: f64, edge: f64, is_own: bool) -> f64 {
        let (sin, cos) = f64::to_radians(axis).sin_cos();
        let turn = DMat3::from_axis_angle(DVec3::new(cos, sin, 0.0), tilt.to_radians());
        let (u, v, normal) = (turn.x_axis, turn.y_axis, turn.z_axis);
        let px = px_per_mm.recip();
        let steps = [DVec3::X, DVec3::Y].map(|e| px * (e - DVec3::Z * (e.dot(normal) / normal.z)));
        let (sin, cos) = edge.to_radians().sin_cos();
        let across = cos * u + sin * v;
        // The mm across the edge from one pixel to the next where that is most.
        let blur_mm2 = steps.iter().map(|s| s.dot(across).powi(2)).sum::<f64>();
        let half = (14.0 * px_per_mm) as i32;
        let (mut pixels, mut asked) = (Vec::new(), Vec::new());
        for y in -half..=half {
            for x in -half..=half {
                let point = f64::from(x) * steps[0] + f64::from(y) * steps[1];
                if x.abs().max(y.abs()) <= 3 {
                    asked.push(pixels.len());
                }
                let facing = [Vec3::X, Vec3::Y].map(|e| e * px as f32);
                pixels.push(Pixel {
                    patch: Patch {
                        point_mm: point.as_vec3(),
                        area_mm2: steps[0].cross(steps[1]).length() as f32,
                        irradiance: Vec3::splat(step(point.dot(across), blur_mm2) as f32),
                    },
                    steps_mm: if is_own { steps.map(|s| s.as_vec3()) } else { facing },
                });
            }
        }
        let found = visible_integral(&pixels, &asked, &Profile::SKIN, &|_| ());
        let error = |(i, found): (&usize, &Vec3)| {
            let x = pixels[*i].patch.point_mm.as_dvec3().dot(across);
            (found.as_dvec3() - scattered_step(x, blur_mm2, &Profile::SKIN)).abs().max_element()
        };
        asked.iter().zip(&found).map(error).fold(0.0, f64::max)
    }

    #[test]
    fn a_lattice_is_known_where_the_surface_goes_on_evenly() {
        let tangents = [Vec3::X, Vec3::new(0.0, 1.0, 3.0)];
        let plane = |x: i32, y: i32| x as f32 * tangents[0] + y as f32 * tangents[1];
        let facing = [Vec3::X * 0.5, Vec3::Y * 0.5];
        assert_eq!(even_steps(tangents, 0.5, |x, y| Some(plane(x, y))), tangents);
        let bends = |x, y| Some(plane(x, y) + Vec3::Z * (x * x) as f32);
        assert_eq!(even_steps(tangents, 0.5, bends), facing);
        let ends = |x, y| (y < 1).then(|| plane(x, y));
        assert_eq!(even_steps(tangents, 0.5, ends), facing);
    }

    #[test]
    fn slopes_are_summed_on_their_own_lattice() {
        let slopes = [(3.0, 0.0), (3.0, 40.0), (3.0, 60.0), (5.0, 60.0), (3.0, 70.0)];
        let mut worst_facing: f64 = 0.0;
        for (px_per_mm, tilt) in slopes {
            for axis in [0.0, 25.0, 45.0] {
                for edge in [0.0, 45.0, 90.0] {
                    let of = |is_own| worst(px_per_mm, tilt, axis, edge, is_own);
                    let (own, facing) = (of(true), of(false));
                    println!(
                        "{px_per_mm} px/mm, {tilt}° about {axis}°, edge {edge}°: {own:.4} ({facing:.4})"
                    );
                    // On a sheared lattice rows do not lie above each other, which no width makes up for.
                    assert!(own <= 0.002, "{own}");
                    worst_facing = worst_facing.max(facing);
                }
            }
        }
        // What the lattice is for.
        assert!(worst_facing > 0.008, "{worst_facing}");
    }
}
