//! A picture of a case: the truth and every method side by side, and below each its error.

use glam::Vec3;
use image::{Rgb, RgbImage, imageops};

use crate::Error;
use crate::stability::case::{Judged, Shown, Verdict, short};
use crate::svg::{Rasteriser, Svg, Type};

/// How much errors are amplified.
pub const GAIN: f32 = 10.0;

/// Side of a panel, at most, in pixels of the picture.
const PANEL: u32 = 116;
const GAP: u32 = 6;
const LABEL: u32 = 30;

/// Truth and methods in a row, errors in the next; `None` for a case that shows nothing.
///
/// # Errors
/// A drawing that cannot be made.
pub fn strip(judged: &Judged, rasteriser: &Rasteriser) -> Result<Option<RgbImage>, Error> {
    let Some(Shown { size, truth, results }) = &judged.outcome.shown else {
        return Ok(None);
    };
    let zoom = (PANEL / size[0].max(size[1])).max(1);
    let [width, height] = size.map(|s| (s * zoom).min(PANEL));
    let step = PANEL + GAP;
    let mut drawing = Svg::default();
    let mut label = |column: usize, name: &str, figure: &str| {
        let x = f64::from(GAP + column as u32 * step);
        drawing.text([x, 12.0], name, Type::new("#222", 11.0));
        drawing.text([x, 25.0], figure, Type::new("#666", 10.0));
    };
    label(0, "truth", &format!("below: errors ×{GAIN:.0}"));
    for (i, (method, _)) in results.iter().enumerate() {
        let verdict = judged.figure(method).map_or(String::new(), |f| {
            let word = match judged.case.verdict(f) {
                Verdict::Passes => "passes",
                Verdict::Degraded => "degraded",
                Verdict::Fails => "fails",
            };
            format!("{} {word}", short(f))
        });
        label(i + 1, &method.replace('_', " "), &verdict);
    }
    let picture_size = [GAP + (results.len() as u32 + 1) * step, LABEL + 2 * (GAP + height)];
    let [columns, rows] = picture_size.map(f64::from);
    let title = judged.case.title();
    let drawing = rasteriser.picture(&drawing.finish(columns, rows, &title));
    let drawing =
        drawing.map_err(|e| Error::new(title, format!("\"{e}\""), "a picture that can be drawn"))?;
    let [columns, rows] = picture_size;
    let mut picture = imageops::thumbnail(&drawing, columns, rows);
    let mut put = |column: usize, row: u32, light: &dyn Fn(usize) -> Vec3| {
        let pixel = |x, y| Rgb(srgb(light((y * size[0] + x) as usize)));
        let panel = RgbImage::from_fn(size[0], size[1], pixel);
        let panel = imageops::resize(&panel, width, height, imageops::FilterType::Nearest);
        let [x, y] = [GAP + column as u32 * step, LABEL + row * (height + GAP)];
        imageops::replace(&mut picture, &panel, x.into(), y.into());
    };
    put(0, 0, &|i| truth[i]);
    for (column, (_, result)) in results.iter().enumerate() {
        put(column + 1, 0, &|i| result[i]);
        put(column + 1, 1, &|i| (result[i] - truth[i]).abs() * GAIN);
    }
    Ok(Some(picture))
}

/// Linear light as sRGB (IEC 61966-2-1); brighter than white is white, what is no number is magenta.
fn srgb(light: Vec3) -> [u8; 3] {
    if light.is_nan() {
        return [255, 0, 255];
    }
    light.to_array().map(|c| {
        let encoded = if c <= 0.0031308 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
        (255.0 * encoded).round() as u8
    })
}
