//! The visible integral: Eq. 7 over what the camera sees.

use glam::Vec3;
use rayon::prelude::*;
use subsurface::Profile;

use super::Progress;
use super::cloud::{Cloud, Patch};

/// What a pixel sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// The surface that it shows: irradiance as the frame has it, area on the tangent plane.
    pub patch: Patch,
    /// The area that it would show of a surface facing the camera, in mm².
    pub facing_mm2: f32,
}

/// Σᵢ wᵢ ∫ E Gᵢ dA / ∫ Gᵢ dA over what the camera sees: every pixel summed for every pixel, no taps,
/// no separability. It is the best that a method can do that knows the frame alone.
///
/// `pixels` are those of one profile, `asked` are places among them; the result is theirs. Point
/// weights of Gaussians narrower than a pixel spread too little; they take the variance by which
/// light that is soft by a pixel comes out right.
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
            let scattered = profile.gaussians().iter().map(|g| {
                if g.variance_mm2 == 0.0 {
                    return Vec3::from(g.weight) * pixel.patch.irradiance;
                }
                let v = lattice_variance(g.variance_mm2.into(), pixel.facing_mm2.into());
                let sum = cloud.sum(pixel.patch.point_mm, v as f32);
                Vec3::from(g.weight) * (sum.light / sum.mass).as_vec3()
            });
            let sum = scattered.sum();
            progress(1.0 / asked.len() as f64);
            sum
        })
        .collect()
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
