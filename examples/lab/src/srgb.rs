//! Between linear light and the bytes of a picture. \[IEC 61966-2-1\]

use image::{Rgb, RgbImage};

/// The byte that shows linear light; brighter than white is white.
pub fn encode(light: f32) -> u8 {
    let encoded = if light <= 0.0031308 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    // A float-to-byte cast saturates.
    (255.0 * encoded).round() as u8
}

/// The linear light that a byte shows.
pub fn decode(byte: u8) -> f32 {
    let encoded = f32::from(byte) / 255.0;
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Half as wide and high, each pixel the mean light of four.
pub fn halved(picture: &RgbImage) -> RgbImage {
    let light: Vec<f32> = (0..=255).map(decode).collect();
    RgbImage::from_fn(picture.width() / 2, picture.height() / 2, |x, y| {
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)];
        let four = four.map(|(u, v)| picture.get_pixel(2 * x + u, 2 * y + v).0);
        let mean = |c: usize| four.iter().map(|p| light[usize::from(p[c])]).sum::<f32>() / 4.0;
        Rgb([0, 1, 2].map(|c| encode(mean(c))))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_survive_and_the_mean_of_black_and_white_is_half_their_light() {
        for byte in 0..=255 {
            assert_eq!(encode(decode(byte)), byte);
        }
        assert_eq!([encode(-1.0), encode(9.0), encode(f32::NAN)], [0, 255, 0]);
        let stripes = RgbImage::from_fn(4, 2, |x, _| Rgb([if x % 2 == 0 { 255 } else { 0 }; 3]));
        // .5 of linear light is 188, as is known of checkerboards.
        assert_eq!(halved(&stripes), RgbImage::from_pixel(2, 1, Rgb([188; 3])));
    }
}
