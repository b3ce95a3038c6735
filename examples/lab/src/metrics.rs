//! How far one picture is from another, over the pixels that show skin.
//!
//! Masks are row-major, one `bool` per pixel, and as long as the pictures they go with. A figure
//! is `None` where it has no value: nothing is masked, or a pixel is not finite.
//!
//! - \[CIE\] Sharma, Wu, Dalal 2005, "The CIEDE2000 color-difference formula: implementation
//!   notes, supplementary test data, and mathematical observations".
//! - \[FLIP\] Andersson et al. 2020, "FLIP: a difference evaluator for alternating images".

use glam::{DVec2, DVec3, Vec3};
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

/// CIE L\*a\*b\* of a linear RGB colour with sRGB primaries, relative to the D65 white (1, 1, 1).
pub fn lab(linear_srgb: [f32; 3]) -> [f64; 3] {
    // IEC 61966-2-1. White is each row's sum, so that (1, 1, 1) is L* = 100 without a tint.
    const TO_XYZ: [DVec3; 3] = [
        DVec3::new(0.4124, 0.3576, 0.1805),
        DVec3::new(0.2126, 0.7152, 0.0722),
        DVec3::new(0.0193, 0.1192, 0.9505),
    ];
    let rgb = Vec3::from(linear_srgb).as_dvec3();
    let [x, y, z] = TO_XYZ.map(|row| {
        let t = row.dot(rgb) / row.element_sum();
        let delta: f64 = 6.0 / 29.0;
        if t > delta.powi(3) { t.cbrt() } else { t / (3.0 * delta * delta) + 4.0 / 29.0 }
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// CIEDE2000 colour difference of two L\*a\*b\* colours, with k_L = k_C = k_H = 1 (\[CIE\] Eq. 2–22).
/// About 1 is just noticeable.
pub fn delta_e2000(lab1: [f64; 3], lab2: [f64; 3]) -> f64 {
    let ([l1, a1, b1], [l2, a2, b2]) = (lab1, lab2);
    let saturation = |c: f64| (c.powi(7) / (c.powi(7) + 25.0_f64.powi(7))).sqrt();

    // Eq. 2–7: stretch a*, so that greys weigh more; then chroma C′ and hue h′ in degrees.
    let c_mean = (a1.hypot(b1) + a2.hypot(b2)) / 2.0;
    let stretch = 1.5 - 0.5 * saturation(c_mean);
    let polar = |a: f64, b: f64| {
        let ab = DVec2::new(a * stretch, b);
        (ab.length(), ab.y.atan2(ab.x).to_degrees().rem_euclid(360.0))
    };
    let ((c1, h1), (c2, h2)) = (polar(a1, b1), polar(a2, b2));

    // Eq. 8–14: differences and means; hues go the short way round, a grey has none.
    let grey = c1 * c2 == 0.0;
    let wraps = (h2 - h1).abs() > 180.0;
    let turn = match h2 - h1 {
        _ if grey => 0.0,
        turn if !wraps => turn,
        turn => turn - 360.0_f64.copysign(turn),
    };
    let dl = l2 - l1;
    let dc = c2 - c1;
    let dh = 2.0 * (c1 * c2).sqrt() * (turn / 2.0).to_radians().sin();
    let l = (l1 + l2) / 2.0;
    let c = (c1 + c2) / 2.0;
    let h = match h1 + h2 {
        sum if grey => sum,
        sum if !wraps => sum / 2.0,
        sum if sum < 360.0 => (sum + 360.0) / 2.0,
        sum => (sum - 360.0) / 2.0,
    };

    // Eq. 15–22: weights of lightness, chroma and hue, and the rotation that ties the blues.
    let cos = |degrees: f64| degrees.to_radians().cos();
    let t = 1.0 - 0.17 * cos(h - 30.0) + 0.24 * cos(2.0 * h) + 0.32 * cos(3.0 * h + 6.0)
        - 0.20 * cos(4.0 * h - 63.0);
    let l50 = (l - 50.0).powi(2);
    let sl = 1.0 + 0.015 * l50 / (20.0 + l50).sqrt();
    let sc = 1.0 + 0.045 * c;
    let sh = 1.0 + 0.015 * c * t;
    let blue = 30.0 * (-((h - 275.0) / 25.0).powi(2)).exp();
    let rt = -2.0 * saturation(c) * (2.0 * blue).to_radians().sin();

    let (l, c, h) = (dl / sl, dc / sc, dh / sh);
    (l * l + c * c + h * h + rt * c * h).sqrt()
}

/// The CIEDE2000 difference that `fraction` (0 to 1) of the masked pixels stay within, by nearest
/// rank: the smallest difference with at least that share at or below it.
pub fn delta_e2000_percentile(a: &Layer, reference: &Layer, mask: &[bool], fraction: f64) -> Option<f64> {
    let mut differences: Vec<f64> = masked(a, reference, mask)
        .map(|(a, r)| delta_e2000(lab(a.as_vec3().to_array()), lab(r.as_vec3().to_array())))
        .collect();
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
    fn white_and_mid_grey_are_neutral() {
        let [l, a, b] = lab([1.0; 3]);
        assert!((l - 100.0).abs() < 1e-9 && a.abs() < 1e-9 && b.abs() < 1e-9);
        // 18 % grey is L* = 49.496 by the definition of L*.
        let [l, a, b] = lab([0.18; 3]);
        assert!((l - 49.496).abs() < 1e-3 && a.abs() < 1e-9 && b.abs() < 1e-9);
        // sRGB red as usually printed; the standard's four-digit primaries move it by .02.
        let [l, a, b] = lab([1.0, 0.0, 0.0]);
        assert!((l - 53.24).abs() < 0.03 && (a - 80.09).abs() < 0.03 && (b - 67.20).abs() < 0.03);
    }

    #[test]
    fn the_percentile_is_by_nearest_rank() {
        let reference = greys(&[0.5; 100]);
        // 99 pixels differ by 1 step, one by many: the 99th of 100 is a small difference.
        let mut values = [0.51; 100];
        values[17] = 5.0;
        let a = greys(&values);
        let small = delta_e2000(lab([0.51; 3]), lab([0.5; 3]));
        let at = |fraction| delta_e2000_percentile(&a, &reference, &[true; 100], fraction).unwrap();
        assert_eq!(at(0.99), small);
        assert_eq!(at(0.0), small);
        assert!(at(1.0) > 10.0 * small);
    }

    /// All of Table 1 of \[CIE\]. Pairs 1–6 test the blue rotation, 7–8 greys, 9–16 the wraparound
    /// of hue differences and mean hues, 17–20 large and 21–24 unit differences.
    #[rustfmt::skip]
    const SHARMA: [([f64; 3], [f64; 3], f64); 34] = [
        ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
        ([50.0, 3.1571, -77.2803], [50.0, 0.0, -82.7485], 2.8615),
        ([50.0, 2.8361, -74.0200], [50.0, 0.0, -82.7485], 3.4412),
        ([50.0, -1.3802, -84.2814], [50.0, 0.0, -82.7485], 1.0000),
        ([50.0, -1.1848, -84.8006], [50.0, 0.0, -82.7485], 1.0000),
        ([50.0, -0.9009, -85.5211], [50.0, 0.0, -82.7485], 1.0000),
        ([50.0, 0.0, 0.0], [50.0, -1.0, 2.0], 2.3669),
        ([50.0, -1.0, 2.0], [50.0, 0.0, 0.0], 2.3669),
        ([50.0, 2.4900, -0.0010], [50.0, -2.4900, 0.0009], 7.1792),
        ([50.0, 2.4900, -0.0010], [50.0, -2.4900, 0.0010], 7.1792),
        ([50.0, 2.4900, -0.0010], [50.0, -2.4900, 0.0011], 7.2195),
        ([50.0, 2.4900, -0.0010], [50.0, -2.4900, 0.0012], 7.2195),
        ([50.0, -0.0010, 2.4900], [50.0, 0.0009, -2.4900], 4.8045),
        ([50.0, -0.0010, 2.4900], [50.0, 0.0010, -2.4900], 4.8045),
        ([50.0, -0.0010, 2.4900], [50.0, 0.0011, -2.4900], 4.7461),
        ([50.0, 2.5, 0.0], [50.0, 0.0, -2.5], 4.3065),
        ([50.0, 2.5, 0.0], [73.0, 25.0, -18.0], 27.1492),
        ([50.0, 2.5, 0.0], [61.0, -5.0, 29.0], 22.8977),
        ([50.0, 2.5, 0.0], [56.0, -27.0, -3.0], 31.9030),
        ([50.0, 2.5, 0.0], [58.0, 24.0, 15.0], 19.4535),
        ([50.0, 2.5, 0.0], [50.0, 3.1736, 0.5854], 1.0000),
        ([50.0, 2.5, 0.0], [50.0, 3.2972, 0.0], 1.0000),
        ([50.0, 2.5, 0.0], [50.0, 1.8634, 0.5757], 1.0000),
        ([50.0, 2.5, 0.0], [50.0, 3.2592, 0.3350], 1.0000),
        ([60.2574, -34.0099, 36.2677], [60.4626, -34.1751, 39.4387], 1.2644),
        ([63.0109, -31.0961, -5.8663], [62.8187, -29.7946, -4.0864], 1.2630),
        ([61.2901, 3.7196, -5.3901], [61.4292, 2.2480, -4.9620], 1.8731),
        ([35.0831, -44.1164, 3.7933], [35.0232, -40.0716, 1.5901], 1.8645),
        ([22.7233, 20.0904, -46.6940], [23.0331, 14.9730, -42.5619], 2.0373),
        ([36.4612, 47.8580, 18.3852], [36.2715, 50.5065, 21.2231], 1.4146),
        ([90.8027, -2.0831, 1.4410], [91.1528, -1.6435, 0.0447], 1.4441),
        ([90.9257, -0.5406, -0.9208], [88.6381, -0.8985, -0.7239], 1.5381),
        ([6.7747, -0.2908, -2.4247], [5.8714, -0.0985, -2.2286], 0.6377),
        ([2.0776, 0.0795, -1.1350], [0.9033, -0.0636, -0.5514], 0.9082),
    ];

    #[test]
    fn ciede2000_matches_the_published_pairs() {
        for (i, (lab1, lab2, expected)) in SHARMA.into_iter().enumerate() {
            // The table is printed to four digits.
            let delta = delta_e2000(lab1, lab2);
            assert!((delta - expected).abs() < 1e-4, "pair {}: {delta}, not {expected}", i + 1);
            assert!((delta_e2000(lab2, lab1) - expected).abs() < 1e-4, "pair {} reversed", i + 1);
            assert_eq!(delta_e2000(lab1, lab1), 0.0);
        }
    }
}
