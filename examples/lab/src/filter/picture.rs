//! The result as files: linear floats, and a picture to look at.

use std::io::Cursor;

use glam::Vec3;
use image::error::{ParameterError, ParameterErrorKind};
use image::{ImageError, ImageFormat, ImageResult, Rgb, Rgb32FImage, RgbImage};

/// Linear pixels, row by row, as an OpenEXR file: RGB in 32-bit floats.
///
/// # Errors
/// No pixels, or another number of them than the size says.
pub fn exr([width, height]: [u32; 2], pixels: &[[f32; 3]]) -> ImageResult<Vec<u8>> {
    let mismatch = || {
        let kind = ParameterErrorKind::DimensionMismatch;
        ImageError::Parameter(ParameterError::from_kind(kind))
    };
    let floats = pixels.as_flattened().to_vec();
    let image = Rgb32FImage::from_raw(width, height, floats).ok_or_else(mismatch)?;
    let mut file = Cursor::new(Vec::new());
    image.write_to(&mut file, ImageFormat::OpenExr)?;
    Ok(file.into_inner())
}

/// Linear pixels as the renderer shows its diffuse layer: tone-mapped, in sRGB.
pub fn tone_mapped([width, height]: [u32; 2], pixels: &[[f32; 3]]) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        let pixel = pixels[y as usize * width as usize + x as usize];
        Rgb(tone_map(pixel.into()).to_array().map(srgb))
    })
}

/// Khronos PBR Neutral, 2024: keeps hue, and the colours below the shoulder. As in
/// `renderer/compose.wgsl`.
fn tone_map(color: Vec3) -> Vec3 {
    const START: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    const D: f32 = 1.0 - START;
    // Denoised light may be below 0, which has no hue.
    let color = color.max(Vec3::ZERO);
    let least = color.min_element();
    let offset = if least < 0.08 {
        least - 6.25 * least * least
    } else {
        0.04
    };
    let color = color - offset;
    let peak = color.max_element();
    if peak < START {
        return color;
    }
    let new_peak = 1.0 - D * D / (peak + D - START);
    let g = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    (color * (new_peak / peak)).lerp(Vec3::splat(new_peak), g)
}

/// IEC 61966-2-1.
fn srgb(linear: f32) -> u8 {
    let encoded = if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    };
    (255.0 * encoded).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_span_what_a_screen_shows() {
        let bytes = |e: f32| tone_mapped([1, 1], &[[e; 3]]).get_pixel(0, 0).0;
        assert_eq!(bytes(-1.0), [0; 3]);
        assert_eq!(bytes(0.0), [0; 3]);
        // Below the shoulder: .5 less the offset of .04, in sRGB.
        assert_eq!(bytes(0.5), [181; 3]);
        assert_eq!(bytes(1e30), [255; 3]);
        assert_eq!(bytes(f32::MAX), [255; 3]);
    }
}
