//! How far one picture is from another, over the pixels that show skin.
//!
//! Masks are row-major, one `bool` per pixel, and as long as the pictures they go with. A figure
//! is `None` where it has no value: nothing is masked, or a pixel is not finite.
//!
//! - \[CIE\] Sharma, Wu, Dalal 2005, "The CIEDE2000 color-difference formula: implementation
//!   notes, supplementary test data, and mathematical observations".
//! - \[FLIP\] Andersson et al. 2020, "FLIP: a difference evaluator for alternating images".

use glam::{DVec3, Vec3};
use image::{Rgb, RgbImage};

/// The viewing distance that FLIP assumes, in pixels per degree of visual angle. FLIP's default:
/// a 0.7 m wide screen of 3840 pixels seen from 0.7 m.
#[cfg(feature = "programs")]
pub const PIXELS_PER_DEGREE: f32 = nv_flip::DEFAULT_PIXELS_PER_DEGREE;

/// A picture of linear light: RGB with sRGB primaries, row-major from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Columns, in pixels.
    pub width: u32,
    /// Rows, in pixels.
    pub height: u32,
    /// `width · height` linear RGB values.
    pub pixels: Vec<[f32; 3]>,
}

/// Root of the summed squared error over the summed squared reference, √(Σ|a−r|² / Σ|r|²), over
/// masked pixels and all three channels. `None` also where the reference is black.
pub fn relative_rmse(a: &Layer, reference: &Layer, mask: &[bool]) -> Option<f64> {
    let (error, signal) = masked(a, reference, mask).fold((0.0, 0.0), |(error, signal), (a, r)| {
        (error + a.distance_squared(r), signal + r.length_squared())
    });
    finite((error / signal).sqrt())
}

/// Largest absolute error of any channel of any masked pixel.
pub fn max_error(a: &Layer, reference: &Layer, mask: &[bool]) -> Option<f64> {
    masked(a, reference, mask)
        .flat_map(|(a, r)| (a - r).abs().to_array())
        // `f64::max` would drop a NaN; here it stays, and the figure has no value.
        .reduce(|max, e| if e > max || e.is_nan() { e } else { max })
        .and_then(finite)
}

/// Drops the masked pixels that lie within `pixels` of an unmasked one, diagonals counting as one
/// step (Chebyshev distance). What lies beyond the picture's border does not count as unmasked.
pub fn erode(mask: &[bool], width: u32, height: u32, pixels: u32) -> Vec<bool> {
    let window =
        |at: u32, end: u32| at.saturating_sub(pixels)..at.saturating_add(pixels).saturating_add(1).min(end);
    let is_skin = |x: u32, y: u32| mask[y as usize * width as usize + x as usize];
    let is_inner = |x, y| window(y, height).all(|v| window(x, width).all(|u| is_skin(u, v)));
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| is_inner(x, y)).collect()
}

/// CIEDE2000 colour difference of two linear RGB colours with sRGB primaries, under D65, with
/// k_L = k_C = k_H = 1 (\[CIE\]). About 1 is just noticeable.
#[cfg(feature = "programs")]
fn delta_e2000(a: DVec3, b: DVec3) -> f64 {
    use palette::color_difference::Ciede2000;
    use palette::convert::FromColorUnclamped;
    use palette::white_point::D65;
    use palette::{Lab, LinSrgb};

    // Light brighter than white is not cut off.
    let lab = |e: DVec3| Lab::<D65, f64>::from_color_unclamped(LinSrgb::new(e.x, e.y, e.z));
    lab(a).difference(lab(b))
}

/// The CIEDE2000 difference that `fraction` (0 to 1) of the masked pixels stay within, by nearest
/// rank: the smallest difference with at least that share at or below it.
#[cfg(feature = "programs")]
pub fn delta_e2000_percentile(a: &Layer, reference: &Layer, mask: &[bool], fraction: f64) -> Option<f64> {
    let mut differences: Vec<f64> = masked(a, reference, mask).map(|(a, r)| delta_e2000(a, r)).collect();
    if differences.iter().any(|e| !e.is_finite()) {
        return None;
    }
    differences.sort_unstable_by(f64::total_cmp);
    let rank = (fraction * differences.len() as f64).ceil() as usize;
    differences.get(rank.saturating_sub(1)).copied()
}

/// \[FLIP\] at [`PIXELS_PER_DEGREE`]: the mean over the mask, 0 (same) to 1 (black beside white),
/// and the whole error map in the magma colours (black 0, yellowish white 1).
///
/// Both pictures are sRGB-encoded, as they are shown, and of one size.
#[cfg(feature = "programs")]
pub fn flip_mean(
    test_srgb: &RgbImage,
    reference_srgb: &RgbImage,
    mask: &[bool],
) -> (Option<f64>, RgbImage) {
    let copy = |i: &RgbImage| nv_flip::FlipImageRgb8::with_data(i.width(), i.height(), i.as_raw());
    let errors = nv_flip::flip(copy(reference_srgb), copy(test_srgb), PIXELS_PER_DEGREE);

    let (sum, count) = errors
        .to_vec()
        .iter()
        .zip(mask)
        .filter(|(_, masked)| **masked)
        .fold((0.0, 0), |(sum, count), (&error, _)| (sum + f64::from(error), count + 1));

    let colours = errors.apply_color_lut(&nv_flip::magma_lut()).to_vec();
    let heat = RgbImage::from_raw(test_srgb.width(), test_srgb.height(), colours)
        .expect("the error map is as large as the picture");
    (finite(sum / f64::from(count)), heat)
}

/// A picture of the absolute difference of two layers, per channel, times `gain`, on black.
///
/// The amplified difference goes to the bytes as it is, without an sRGB curve, so that a byte
/// reads back as a number: 0 is no difference, 255 is `1 / gain` or more.
pub fn difference(a: &Layer, b: &Layer, gain: f32) -> RgbImage {
    RgbImage::from_fn(a.width, a.height, |x, y| {
        let i = y as usize * a.width as usize + x as usize;
        let amplified = (Vec3::from(a.pixels[i]) - Vec3::from(b.pixels[i])).abs() * gain;
        // A float-to-byte cast saturates.
        Rgb((amplified * 255.0).round().to_array().map(|byte| byte as u8))
    })
}

/// The masked pixels of both layers.
fn masked<'a>(
    a: &'a Layer,
    reference: &'a Layer,
    mask: &'a [bool],
) -> impl Iterator<Item = (DVec3, DVec3)> + 'a {
    let wide = |pixel: &[f32; 3]| Vec3::from(*pixel).as_dvec3();
    let pairs = a.pixels.iter().zip(&reference.pixels).zip(mask);
    pairs.filter(|(_, masked)| **masked).map(move |((a, r), _)| (wide(a), wide(r)))
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// The middle of the values, or the mean of the two there; NaN of none.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() % 2 {
        _ if sorted.is_empty() => f64::NAN,
        0 => (sorted[middle - 1] + sorted[middle]) / 2.0,
        _ => sorted[middle],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(pixels: &[[f32; 3]]) -> Layer {
        Layer { width: pixels.len() as u32, height: 1, pixels: pixels.to_vec() }
    }

    fn greys(values: &[f32]) -> Layer {
        row(&values.iter().map(|&v| [v; 3]).collect::<Vec<_>>())
    }

    #[test]
    fn errors_are_taken_over_the_mask_alone() {
        let reference = greys(&[1.0, 0.5, 0.5]);
        let a = greys(&[9.0, 0.6, 0.5]);
        let mask = [false, true, true];
        // √(.1² / (.5² + .5²)); the tolerance is that of 0.6 as an f32.
        let expected = (0.01_f64 / 0.5).sqrt();
        assert!((relative_rmse(&a, &reference, &mask).unwrap() - expected).abs() < 1e-6);
        assert!((max_error(&a, &reference, &mask).unwrap() - 0.1).abs() < 1e-6);
    }

    #[test]
    fn identical_pictures_do_not_differ() {
        let a = greys(&[0.2, 0.7]);
        let mask = [true, true];
        assert_eq!(relative_rmse(&a, &a, &mask), Some(0.0));
        assert_eq!(max_error(&a, &a, &mask), Some(0.0));
        assert_eq!(delta_e2000_percentile(&a, &a, &mask, 0.99), Some(0.0));
        assert!(difference(&a, &a, 10.0).iter().all(|&byte| byte == 0));

        let picture = RgbImage::from_fn(8, 8, |x, y| Rgb([x as u8 * 30, y as u8 * 30, 90]));
        let (mean, heat) = flip_mean(&picture, &picture, &[true; 64]);
        assert_eq!(mean, Some(0.0));
        assert_eq!(heat.dimensions(), (8, 8));
    }

    #[test]
    fn an_empty_mask_has_no_figures() {
        let a = greys(&[0.2, 0.7]);
        let mask = [false, false];
        assert_eq!(relative_rmse(&a, &a, &mask), None);
        assert_eq!(max_error(&a, &a, &mask), None);
        assert_eq!(delta_e2000_percentile(&a, &a, &mask, 0.99), None);
        assert_eq!(flip_mean(&RgbImage::new(2, 1), &RgbImage::new(2, 1), &mask).0, None);
    }

    #[test]
    fn a_pixel_that_is_not_finite_is_never_a_small_error() {
        let reference = greys(&[0.5, 0.5, 0.5]);
        for bad in [f32::NAN, f32::INFINITY] {
            let a = greys(&[0.5, bad, 0.6]);
            assert_eq!(relative_rmse(&a, &reference, &[true; 3]), None);
            assert_eq!(max_error(&a, &reference, &[true; 3]), None);
            assert_eq!(delta_e2000_percentile(&a, &reference, &[true; 3], 0.5), None);
        }
    }

    #[test]
    fn erosion_takes_a_square_rim_but_not_at_the_border() {
        // A 6×5 mask, all set but for (1, 1).
        let mut mask = [true; 30];
        mask[7] = false;
        let eroded = erode(&mask, 6, 5, 2);
        for (i, &kept) in eroded.iter().enumerate() {
            let (x, y) = (i % 6, i / 6);
            assert_eq!(kept, x.abs_diff(1).max(y.abs_diff(1)) > 2, "at {x}, {y}");
        }
        assert_eq!(erode(&mask, 6, 5, 0), mask);
        assert!(erode(&[true; 30], 6, 5, 9).into_iter().all(|kept| kept));
    }

    #[test]
    fn flip_tells_black_from_white_and_one_side_from_the_other() {
        let black = RgbImage::new(64, 64);
        let half = RgbImage::from_fn(64, 64, |x, _| Rgb([if x < 32 { 255 } else { 0 }; 3]));
        let side = |left: bool| (0..64 * 64).map(|i| (i % 64 < 24) == left).collect::<Vec<_>>();
        let changed = flip_mean(&half, &black, &side(true)).0.unwrap();
        let (all, heat) = flip_mean(&half, &black, &[true; 64 * 64]);
        assert!(changed > 0.9, "{changed}");
        assert!(all.unwrap() < changed);
        assert!(heat.get_pixel(8, 32).0[0] > 200 && heat.get_pixel(60, 32).0[0] < 20);
    }

    #[test]
    fn a_difference_byte_reads_back_as_a_number() {
        let a = row(&[[0.0, 0.04, 1.0]]);
        let b = row(&[[0.02, 0.0, 0.0]]);
        assert_eq!(difference(&a, &b, 10.0).get_pixel(0, 0).0, [51, 102, 255]);
    }

    #[test]
    fn the_percentile_is_by_nearest_rank() {
        let reference = greys(&[0.5; 100]);
        // 99 pixels differ by 1 step, one by many: the 99th of 100 is a small difference.
        let mut values = [0.51; 100];
        values[17] = 5.0;
        let a = greys(&values);
        let small = delta_e2000(DVec3::splat(0.51f32.into()), DVec3::splat(0.5));
        let at = |fraction| delta_e2000_percentile(&a, &reference, &[true; 100], fraction).unwrap();
        assert_eq!(at(0.99), small);
        assert_eq!(at(0.0), small);
        assert!(at(1.0) > 10.0 * small);
    }

    /// The published formula at L*a*b* (100, 0, 0), (49.496, 0, 0) and (53.24, 80.09, 67.20), which are white,
    /// 18 % grey and sRGB's red; the crate tests all published pairs.
    #[test]
    fn colours_differ_by_as_much_as_the_formula_says() {
        let [white, grey, red] = [DVec3::ONE, DVec3::splat(0.18), DVec3::X];
        for (a, b, expected) in [(white, grey, 36.991), (white, red, 45.811), (grey, red, 31.416)] {
            // Four-digit primaries move red by .02.
            assert!((delta_e2000(a, b) - expected).abs() < 0.02, "{a} {b}");
        }
        assert!(delta_e2000(2.0 * white, white) > 10.0, "brighter than white is not cut off");
    }

    #[test]
    fn medians_are_in_the_middle() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(&[]).is_nan());
    }
}
