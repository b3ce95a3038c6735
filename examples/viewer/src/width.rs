//! How wide a profile is on the screen, in false colours.

use subsurface::Profile;
use subsurface_lab::renderer::Camera;

/// Of what does not scatter.
pub const NOT_SKIN: [u8; 3] = [28, 29, 32];
/// Viridis, at equal steps: its lightness grows evenly.
const COLORS: [[f32; 3]; 6] = [
    [68.0, 1.0, 84.0],
    [65.0, 68.0, 135.0],
    [42.0, 120.0, 142.0],
    [34.0, 168.0, 132.0],
    [122.0, 209.0, 81.0],
    [253.0, 231.0, 37.0],
];

/// σ of the widest Gaussian, in mm.
pub fn widest_mm(profile: &Profile) -> f32 {
    let variances = profile.gaussians().iter().map(|g| g.variance_mm2);
    variances.fold(0.0, f32::max).sqrt()
}

/// How many pixels `length_mm` spans at each pixel, on a surface that faces the camera; 0 where
/// `is_skin` says so. `depth` is as `camera` writes it.
pub fn in_pixels(
    length_mm: f32,
    depth: &[f32],
    is_skin: &[bool],
    camera: &Camera,
    size: [u32; 2],
    mm_per_unit: f32,
) -> Vec<f32> {
    let projection = camera.projection(size);
    // Depth is near/w, and w the distance from the plane of the camera.
    let near = projection.w_axis.z;
    let px_at_unit = 0.5 * size[1] as f32 * projection.y_axis.y / mm_per_unit;
    let pixels = depth.iter().zip(is_skin);
    pixels
        .map(|(depth, is_skin)| match is_skin {
            true => length_mm * px_at_unit * depth / near,
            false => 0.0,
        })
        .collect()
}

/// The least and greatest width, rounded outwards to a quarter of an octave; none without skin.
pub fn range(widths: &[f32]) -> Option<[f32; 2]> {
    let skin = || widths.iter().copied().filter(|w| *w > 0.0);
    let (min, max) = (skin().reduce(f32::min)?, skin().reduce(f32::max)?);
    let quarters = [(4.0 * min.log2()).floor(), (4.0 * max.log2()).ceil()];
    // A width on a quarter has a colour, too.
    let end = quarters[1].max(quarters[0] + 1.0);
    Some([quarters[0], end].map(|q| (q / 4.0).exp2()))
}

/// A width's place in a range, on a logarithmic scale.
pub fn place(width: f32, range: [f32; 2]) -> f32 {
    (width / range[0]).ln() / (range[1] / range[0]).ln()
}

/// The colour of a place from 0 to 1.
pub fn color(place: f32) -> [u8; 3] {
    let last = COLORS.len() - 1;
    let at = place.clamp(0.0, 1.0) * last as f32;
    let i = (at as usize).min(last - 1);
    let blend = |c: usize| COLORS[i][c] + (at - i as f32) * (COLORS[i + 1][c] - COLORS[i][c]);
    [0, 1, 2].map(|c| blend(c).round() as u8)
}

/// The widths as a picture.
pub fn picture(widths: &[f32], range: Option<[f32; 2]>) -> Vec<[u8; 3]> {
    let shown = |w: &f32| match range {
        Some(range) if *w > 0.0 => color(place(*w, range)),
        _ => NOT_SKIN,
    };
    widths.iter().map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn widths_are_those_of_the_camera() {
        let camera = Camera { eye: Vec3::new(0.0, 0.0, 0.7), target: Vec3::ZERO, fov_y: 0.4 };
        let size = [300, 200];
        let depth_at = |z: f32| camera.projection(size).project_point3(Vec3::Z * -z).z;
        let depth = [depth_at(0.7), depth_at(1.4), depth_at(0.7)];
        let widths = in_pixels(3.0, &depth, &[true, true, false], &camera, size, 1000.0);
        let expected = 3.0 * camera.px_per_unit(size) / 1000.0;
        assert!((widths[0] / expected - 1.0).abs() < 1e-5, "{widths:?} {expected}");
        assert!((widths[1] / expected - 0.5).abs() < 1e-5, "{widths:?} {expected}");
        assert_eq!(widths[2], 0.0);
    }

    #[test]
    fn ranges_hold_their_widths() {
        for widths in [vec![0.0, 3.0, 5.1], vec![4.0], vec![0.01, 900.0]] {
            let range = range(&widths).unwrap();
            for width in widths.into_iter().filter(|w| *w > 0.0) {
                assert!((0.0..=1.0).contains(&place(width, range)), "{width} {range:?}");
            }
        }
        assert_eq!(range(&[0.0]), None);
    }

    #[test]
    fn colors_run_from_dark_to_light() {
        let lightness = |place| color(place).map(u32::from).iter().sum::<u32>();
        for i in 0..64 {
            let [a, b] = [i, i + 1].map(|i| lightness(i as f32 / 64.0));
            assert!(a <= b, "{i}");
        }
        assert_eq!(color(-1.0), [68, 1, 84]);
        assert_eq!([color(2.0), color(1.0)], [[253, 231, 37]; 2]);
        assert_eq!(color(f32::NAN).len(), 3);
        let picture = picture(&[0.0, 1.0, 2.0], Some([1.0, 2.0]));
        assert_eq!(picture, [NOT_SKIN, color(0.0), color(1.0)]);
    }

    #[test]
    fn skin_is_as_wide_as_its_widest_gaussian() {
        assert!((widest_mm(&Profile::SKIN) - 7.41f32.sqrt()).abs() < 1e-6);
    }
}
