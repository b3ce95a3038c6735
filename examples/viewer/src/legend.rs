//! What false colours stand for.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Vec2};
use subsurface::Profile;

use crate::width;

/// Of false colours.
pub enum Legend {
    /// Pixels at the ends of the colours.
    Width([f32; 2]),
    /// As `Overlay` draws them.
    Levels,
}

/// In points.
pub const WIDTH: f32 = 270.0;
const BAR: f32 = 12.0;

/// Draws a legend from a lower left corner upwards.
pub fn show(painter: &Painter, corner: Pos2, legend: &Legend, profile: &Profile, half_resolution: bool) {
    let at = |x: f32, up: f32| corner + Vec2::new(x, -up);
    match legend {
        Legend::Width(range) => {
            let sigma_mm = width::widest_mm(profile);
            let scale = match half_resolution {
                true => ", of half resolution",
                false => "",
            };
            let text = format!("σ of the widest Gaussian ({sigma_mm:.2} mm) in pixels{scale}");
            label(painter, at(0.0, 38.0), Align2::LEFT_BOTTOM, &text, WIDTH);
            let steps = 64;
            let colors = (0..steps).map(|i| width::color((i as f32 + 0.5) / steps as f32));
            bar(painter, at(0.0, 34.0), WIDTH, colors);
            let anchors = [Align2::LEFT_TOP, Align2::CENTER_TOP, Align2::RIGHT_TOP];
            for (place, anchor) in [0.0, 0.5, 1.0].into_iter().zip(anchors) {
                let width = range[0] * (range[1] / range[0]).powf(place);
                let text = format!("{width:.2}");
                label(painter, at(place * WIDTH, 20.0), anchor, &text, WIDTH);
            }
        }
        Legend::Levels => {
            let text = "coarsest level that a pixel is blurred at, from dark blue, the frame itself, \
                to red, level 8";
            label(painter, at(0.0, 0.0), Align2::LEFT_BOTTOM, text, WIDTH);
        }
    }
}

/// Text that is read on any picture.
pub fn label(painter: &Painter, at: Pos2, anchor: Align2, text: &str, wrap: f32) {
    for (offset, color) in [(1.0, Color32::from_black_alpha(200)), (0.0, Color32::WHITE)] {
        let text = painter.layout(text.to_owned(), FontId::proportional(14.0), color, wrap);
        let corner = anchor.anchor_size(at + Vec2::splat(offset), text.size());
        painter.galley(corner.min, text, color);
    }
}

/// Colours in a row.
fn bar(painter: &Painter, corner: Pos2, width: f32, colors: impl ExactSizeIterator<Item = [u8; 3]>) {
    let step = width / colors.len() as f32;
    for (i, [r, g, b]) in colors.enumerate() {
        let corner = corner + Vec2::new(i as f32 * step, 0.0);
        let rect = Rect::from_min_size(corner, Vec2::new(step, BAR));
        painter.rect_filled(rect, 0.0, Color32::from_rgb(r, g, b));
    }
}
