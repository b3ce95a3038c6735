//! A drawing in SVG, and the same as pixels.

use std::error::Error;
use std::fmt::Write as _;
use std::sync::Arc;

use epaint_default_fonts::{HACK_REGULAR, UBUNTU_LIGHT};
use image::RgbImage;
use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb::Database};

use crate::page::escape;

/// A place on the drawing: to the right and down.
pub type Point = [f64; 2];

/// Pixels of a picture for each unit of its drawing.
const DENSITY: f32 = 2.0;

/// How a line is drawn.
#[derive(Clone, Copy)]
pub struct Stroke<'a> {
    pub color: &'a str,
    pub width: f64,
    /// Lengths of dashes and gaps; empty for a line without gaps.
    pub dashes: &'a str,
}

/// How a text is set.
#[derive(Clone, Copy)]
pub struct Type<'a> {
    pub size: f64,
    pub color: &'a str,
    /// `start`, `middle` or `end`: the part of the text that stands at its point.
    pub anchor: &'a str,
    /// Turned to read upwards.
    pub upwards: bool,
    /// Set as code, all letters equally wide.
    pub code: bool,
}

impl<'a> Stroke<'a> {
    pub const fn new(color: &'a str, width: f64) -> Self {
        Self { color, width, dashes: "" }
    }

    pub fn dashed(self, dashes: &'a str) -> Self {
        Self { dashes, ..self }
    }
}

impl<'a> Type<'a> {
    pub const fn new(color: &'a str, size: f64) -> Self {
        Self { size, color, anchor: "start", upwards: false, code: false }
    }

    pub fn anchored(self, anchor: &'a str) -> Self {
        Self { anchor, ..self }
    }
}

/// A shape that stands for a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Marker {
    Circle,
    Square,
    Diamond,
    Up,
    Down,
    Plus,
    Cross,
    Star,
    Pentagon,
}

/// A drawing, y down.
#[derive(Default)]
pub struct Svg {
    body: String,
}

impl Svg {
    /// A line through points.
    pub fn line(&mut self, points: &[Point], stroke: Stroke) {
        let Stroke { color, width, dashes } = stroke;
        let dashes = match dashes {
            "" => String::new(),
            dashes => format!(" stroke-dasharray=\"{dashes}\""),
        };
        let points = path(points);
        self.add(format_args!(
            "<path d=\"{points}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\"\
             {dashes} stroke-linejoin=\"round\"/>"
        ));
    }

    /// A text, with its baseline at a point, on a halo that keeps it legible on lines.
    pub fn text(&mut self, [x, y]: Point, text: &str, set: Type) {
        if text.is_empty() {
            return;
        }
        let Type { size, color, anchor, upwards, code } = set;
        let turn =
            if upwards { format!(" transform=\"rotate(-90 {x:.1} {y:.1})\"") } else { String::new() };
        let family = if code { " font-family=\"Hack, monospace\"" } else { "" };
        let text = escape(text);
        self.add(format_args!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" fill=\"{color}\" \
             text-anchor=\"{anchor}\"{family}{turn}>{text}</text>"
        ));
    }

    /// A point, filled or hollow; a shape of lines alone is the same either way.
    pub fn marker(&mut self, at: Point, marker: Marker, color: &str, is_hollow: bool) {
        let [x, y] = at;
        let look = match marker {
            // These have no inside.
            Marker::Plus | Marker::Cross | Marker::Star => {
                format!("fill=\"none\" stroke=\"{color}\" stroke-width=\"1.8\"")
            }
            _ if is_hollow => format!("fill=\"#fff\" stroke=\"{color}\" stroke-width=\"1.4\""),
            _ => format!("fill=\"{color}\" stroke=\"#fff\" stroke-width=\".8\""),
        };
        let around = |corners: usize, radius: f64, turn: f64| -> String {
            let corner = |i| {
                let angle = (turn + i as f64 / corners as f64) * std::f64::consts::TAU;
                [x + radius * angle.sin(), y - radius * angle.cos()]
            };
            path(&(0..corners).map(corner).collect::<Vec<_>>()) + "Z"
        };
        let across = |lines: usize, turn: f64| -> String {
            let spoke = |i| {
                let angle = turn + i as f64 / lines as f64 * std::f64::consts::PI;
                let (dx, dy) = (4.0 * angle.sin(), 4.0 * angle.cos());
                path(&[[x - dx, y - dy], [x + dx, y + dy]])
            };
            (0..lines).map(spoke).collect()
        };
        let shape = match marker {
            Marker::Circle => {
                return self.add(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" {look}/>"));
            }
            Marker::Square => around(4, 5.0, 0.125),
            Marker::Diamond => around(4, 5.2, 0.0),
            Marker::Up => around(3, 5.2, 0.0),
            Marker::Down => around(3, 5.2, 0.5),
            Marker::Pentagon => around(5, 4.8, 0.0),
            Marker::Plus => across(2, 0.0),
            Marker::Cross => across(2, 0.25 * std::f64::consts::PI),
            Marker::Star => across(3, 0.0),
        };
        self.add(format_args!("<path d=\"{shape}\" {look}/>"));
    }

    /// The drawing as a file: a white card, so that it is as legible on a dark page.
    pub fn finish(self, width: f64, height: f64, title: &str) -> String {
        let (body, title) = (self.body, escape(title));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width:.0} {height:.0}\" role=\"img\" aria-label=\"{title}\" \
             font-family=\"Ubuntu, system-ui, sans-serif\">\n\
             <style>text {{ paint-order: stroke; stroke: #fff; stroke-width: 3px; \
             stroke-linejoin: round; }}</style>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{body}</svg>\n"
        )
    }

    fn add(&mut self, element: std::fmt::Arguments) {
        writeln!(self.body, "{element}").expect("a String takes all text");
    }
}

fn path(points: &[Point]) -> String {
    let mut path = String::new();
    for (i, [x, y]) in points.iter().enumerate() {
        let step = if i == 0 { 'M' } else { 'L' };
        write!(path, "{step}{x:.1} {y:.1}").expect("a String takes all text");
    }
    path
}

/// About how wide a text is, without asking the font.
pub fn text_width(text: &str, set: Type) -> f64 {
    let letter = if set.code { 0.61 } else { 0.56 };
    letter * set.size * text.chars().count() as f64
}

/// Turns drawings into pictures, with the fonts that this takes.
pub struct Rasteriser {
    fonts: Arc<Database>,
}

impl Rasteriser {
    pub fn new() -> Self {
        let mut fonts = Database::new();
        fonts.load_font_data(UBUNTU_LIGHT.to_vec());
        fonts.load_font_data(HACK_REGULAR.to_vec());
        fonts.set_sans_serif_family("Ubuntu");
        fonts.set_monospace_family("Hack");
        Self { fonts: Arc::new(fonts) }
    }

    /// The picture of a drawing, on white.
    ///
    /// # Errors
    /// A text that is not SVG, or that has no size.
    pub fn picture(&self, svg: &str) -> Result<RgbImage, Box<dyn Error>> {
        let options = Options { fontdb: self.fonts.clone(), ..Options::default() };
        let tree = Tree::from_str(svg, &options)?;
        let size = tree.size().to_int_size().scale_by(DENSITY).ok_or("no size")?;
        let mut pixmap = Pixmap::new(size.width(), size.height()).ok_or("no size")?;
        pixmap.fill(Color::WHITE);
        let zoom = Transform::from_scale(DENSITY, DENSITY);
        resvg::render(&tree, zoom, &mut pixmap.as_mut());
        Ok(RgbImage::from_fn(size.width(), size.height(), |x, y| {
            let pixel = pixmap.pixels()[(y * size.width() + x) as usize];
            image::Rgb([pixel.red(), pixel.green(), pixel.blue()])
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(svg: Svg) -> RgbImage {
        let svg = svg.finish(80.0, 40.0, "a < b");
        Rasteriser::new().picture(&svg).unwrap()
    }

    fn ink(picture: &RgbImage) -> usize {
        let is_dark = |pixel: &&image::Rgb<u8>| pixel.0.iter().any(|&channel| channel < 128);
        picture.pixels().filter(is_dark).count()
    }

    #[test]
    fn a_drawing_is_white_and_twice_as_dense() {
        let picture = picture(Svg::default());
        assert_eq!(picture.dimensions(), (160, 80));
        assert_eq!(ink(&picture), 0);
    }

    #[test]
    fn every_letter_of_a_text_is_drawn() {
        // What a text says comes out as it is, markup too.
        let mut least = 0;
        for text in ["<", "<&", "<&σ", "<&σ×", "<&σ×Δ", "<&σ×Δ−"] {
            let mut svg = Svg::default();
            svg.text([5.0, 30.0], text, Type::new("#000", 20.0));
            let ink = ink(&picture(svg));
            assert!(ink > least, "{text}");
            least = ink;
        }
    }

    #[test]
    fn every_marker_is_seen() {
        use Marker::*;
        let shapes = [Circle, Square, Diamond, Up, Down, Plus, Cross, Star, Pentagon];
        for marker in shapes {
            for is_hollow in [false, true] {
                let mut svg = Svg::default();
                svg.marker([40.0, 20.0], marker, "#000", is_hollow);
                assert!(ink(&picture(svg)) > 40, "{marker:?}");
            }
        }
    }
}
