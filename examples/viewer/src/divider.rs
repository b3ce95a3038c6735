//! The line between two pictures of one size.

use egui::{Pos2, Rect};
use image::RgbImage;

/// Where the divider is over a picture, 0 at its left and 1 at its right.
pub fn fraction(x: f32, picture: Rect) -> f32 {
    let width = picture.width().max(1.0);
    ((x - picture.left()) / width).clamp(0.0, 1.0)
}

/// Left and right of the divider: where each goes, and which part of its picture is seen there.
pub fn halves(picture: Rect, fraction: f32) -> [(Rect, Rect); 2] {
    let x = picture.left() + fraction * picture.width();
    let cut = |rect: Rect, at: f32| {
        let left = Rect::from_min_max(rect.min, Pos2::new(at, rect.bottom()));
        let right = Rect::from_min_max(Pos2::new(at, rect.top()), rect.max);
        [left, right]
    };
    let unit = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
    let ([left, right], [left_uv, right_uv]) = (cut(picture, x), cut(unit, fraction));
    [(left, left_uv), (right, right_uv)]
}

/// The columns of `left` up to the divider, then those of `right`, which is of the same size.
pub fn join(left: &RgbImage, right: &RgbImage, fraction: f32) -> RgbImage {
    let column = (fraction * left.width() as f32).round() as u32;
    RgbImage::from_fn(left.width(), left.height(), |x, y| {
        let side = if x < column { left } else { right };
        *side.get_pixel(x, y)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const PICTURE: Rect = Rect { min: Pos2::new(300.0, 10.0), max: Pos2::new(700.0, 210.0) };

    #[test]
    fn the_divider_stays_in_the_picture() {
        for (x, expected) in [(0.0, 0.0), (300.0, 0.0), (400.0, 0.25), (9e9, 1.0)] {
            assert_eq!(fraction(x, PICTURE), expected);
        }
        let nothing = Rect::from_min_max(Pos2::ZERO, Pos2::ZERO);
        assert_eq!(fraction(0.0, nothing), 0.0);
    }

    #[test]
    fn halves_meet_and_show_what_lies_there() {
        for at in [0.0, 0.25, 1.0] {
            let [(left, left_uv), (right, right_uv)] = halves(PICTURE, at);
            assert_eq!((left.min, right.max), (PICTURE.min, PICTURE.max));
            assert_eq!((left.right(), left_uv.right()), (right.left(), right_uv.left()));
            assert_eq!((left_uv.right(), left_uv.height()), (at, 1.0));
            assert_eq!(fraction(left.right(), PICTURE), at);
        }
    }

    #[test]
    fn joined_pictures_change_at_the_divider() {
        let of = |value| RgbImage::from_pixel(8, 2, image::Rgb([value; 3]));
        let columns = |fraction| {
            let joined = join(&of(1), &of(2), fraction);
            joined.pixels().filter(|p| p[0] == 1).count() / 2
        };
        assert_eq!([0.0, 0.25, 1.0].map(columns), [0, 2, 8]);
    }
}
