//! A picture of a case: the truth and every method side by side, and below each its error.

use crate::Error;
use glam::Vec3;
use image::{Rgb, RgbImage, imageops};

use crate::stability::case::{Judged, Shown, short};
use crate::svg::{Rasteriser, Svg, Type};

/// How much errors are amplified.
pub const GAIN: f32 = 10.0;

/// Side of a panel, at most, in units of the drawing; pictures have twice as many pixels.
const PANEL: u32 = 116;
const GAP: u32 = 6;
const LABEL: u32 = 30;

/// Truth and methods in a row, errors in the next; `None` for a case that shows nothing.
///
/// # Errors
/// A drawing that cannot be made.
pub fn strip(judged: &Judged, rasteriser: &Rasteriser) -> Result<Option<RgbImage>, Error> {
    let Some(Shown {
        size,
        truth,
        results,
    }) = &judged.outcome.shown
    else {
        return Ok(None);
    };
    let zoom = (2 * PANEL / size[0].max(size[1])).max(1);
    let [width, height] = size.map(|s| (s * zoom).min(2 * PANEL));
    let columns = results.len() as u32 + 1;
    let step = PANEL + GAP;
    let mut drawing = Svg::default();
    let mut label = |column: u32, name: &str, figure: &str| {
        let x = f64::from(GAP + column * step);
        let set = Type::new("#222", 11.0);
        drawing.text([x, 12.0], name, set);
        drawing.text([x, 25.0], figure, Type::new("#666", 10.0));
    };
    label(0, "truth", &format!("below: errors ×{GAIN:.0}"));
    for (column, (method, _)) in (1..).zip(results) {
        let figure = judged.figure(method);
        let verdict = figure.map_or(String::new(), |f| {
            format!("{} {}", short(f), judged.case.verdict(f).word())
        });
        label(column, &method.replace('_', " "), &verdict);
    }
    let drawing = drawing.finish(
        f64::from(GAP + columns * step),
        f64::from(LABEL + 2 * GAP + height),
        &judged.case.title(),
    );
    let mut picture = rasteriser.picture(&drawing).map_err(|e| {
        Error::new(
            judged.case.title(),
            format!("\"{e}\""),
            "a picture that can be drawn",
        )
    })?;
    let mut put = |column: u32, row: u32, values: Vec<Vec3>| {
        let panel = RgbImage::from_fn(size[0], size[1], |x, y| {
            Rgb(srgb(values[(y * size[0] + x) as usize]))
        });
        let panel = imageops::resize(&panel, width, height, imageops::FilterType::Nearest);
        let x = 2 * (GAP + column * step);
        let y = 2 * LABEL + row * (height + 2 * GAP);
        imageops::replace(&mut picture, &panel, x.into(), y.into());
    };
    put(0, 0, truth.clone());
    for (column, (_, result)) in (1..).zip(results) {
        put(column, 0, result.clone());
        let error = result.iter().zip(truth).map(|(r, t)| (r - t).abs() * GAIN);
        put(column, 1, error.collect());
    }
    Ok(Some(picture))
}

/// Linear light as sRGB (IEC 61966-2-1); brighter than white is white, what is no number is magenta.
fn srgb(light: Vec3) -> [u8; 3] {
    if light.is_nan() {
        return [255, 0, 255];
    }
    light.to_array().map(|c| {
        let encoded = if c <= 0.0031308 {
            12.92 * c
        } else {
            1.055 * c.powf(1.0 / 2.4) - 0.055
        };
        (255.0 * encoded).round() as u8
    })
}
