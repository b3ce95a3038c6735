//! A material and its profile, as a drawing.

use image::imageops::{FilterType, overlay, resize};
use image::{Rgb, RgbImage};
use subsurface::Profile;
use subsurface::physics::Response;

use super::strip::{Strip, WIDTH};
use super::{Description, strip};
use crate::Error;
use crate::chart::plot::label::Area;
use crate::chart::plot::panel::{DIM, LEGEND, Panel, SMALL, TITLE};
use crate::chart::plot::scale::Scale;
use crate::srgb;
use crate::svg::{Rasteriser, Stroke, Svg, Type};

pub const COLORS: [(&str, &str); 3] = [("red", "#d62728"), ("green", "#2a9d3a"), ("blue", "#2f6fd0")];
/// Of the drawing, whose pixels are twice as many.
const SIZE: [f64; 2] = [960.0, 640.0];
/// Where the strips are: left, tops, height.
const STRIP: (f64, [f64; 2], u32) = (20.0, [462.0, 540.0], 52);
/// A picture's white for light of 1 on a surface of albedo 1: faces are rendered about so bright.
const EXPOSURE: f32 = 1.3;

/// # Errors
/// A drawing that cannot be made.
pub fn picture(material: &Description, profile: &Profile, strip: &Strip) -> Result<RgbImage, Error> {
    let mut svg = Svg::default();
    svg.text([20.0, 34.0], &material.title, TITLE);
    let count = profile.gaussians().len();
    let about = format!(
        "Lines: the material. Dots: its profile of {count} Gaussians, whose edges are within \
                         {:.4}.",
        profile.fit_error()
    );
    svg.text([20.0, 55.0], &about, Type::new(DIM, 13.0));

    panels(&mut svg, material, profile);
    let (left, tops, height) = STRIP;
    for (top, text) in tops.into_iter().zip([
        "A strip of it, 46 mm, lit to the left and by lines of 4, 2, 1 and ½ mm",
        "The same by a plan of the profile",
    ]) {
        svg.text([left, top - 7.0], text, LEGEND);
    }
    let error = format!(
        "Largest difference of the two: {:.4} of white, at {} px/mm.",
        strip.error,
        strip::PX_PER_MM
    );
    svg.text([left, tops[1] + f64::from(height) + 20.0], &error, SMALL);
    let drawing = svg.finish(SIZE[0], SIZE[1], &material.title);
    let refused =
        |e: Box<dyn std::error::Error>| Error::new("profile.png", format!("\"{e}\""), "a drawing");
    let mut picture = Rasteriser::new().picture(&drawing).map_err(refused)?;
    let albedo = material.albedo.unwrap_or([1.0; 3]).map(|a| a as f32);
    for (light, top) in [&strip.material, &strip.plan].into_iter().zip(tops) {
        let strip = RgbImage::from_fn(WIDTH, height, |x, _| {
            let light = light[x as usize].to_array();
            Rgb([0, 1, 2].map(|c| srgb::encode(EXPOSURE * albedo[c] * light[c])))
        });
        let strip = resize(&strip, 2 * WIDTH, 2 * height, FilterType::Triangle);
        overlay(&mut picture, &strip, 2 * left as i64, 2 * top as i64);
    }
    Ok(picture)
}

/// R(r) and E(x).
fn panels(svg: &mut Svg, material: &Description, profile: &Profile) {
    let own = [0, 1, 2].map(|c| {
        let gaussians = profile.gaussians().iter();
        Response::gaussians(gaussians.map(|g| (g.variance_mm2.into(), g.weight[c].into())))
    });
    let radii: Vec<f64> = (0..=120).map(|i| 0.01 * 10f64.powf(f64::from(i) / 120.0 * 3.3)).collect();
    let mass = |r: &Response| 1.0 / r.albedo();
    // Down to where nothing is seen.
    let radial = |r: &Response| -> Vec<(f64, f64)> {
        let points = radii.iter().map(|mm| (*mm, mass(r) * r.radial(*mm)));
        points.filter(|(_, value)| *value > 1e-6).collect()
    };
    let edge = |r: &Response| radii.iter().map(|mm| (*mm, r.edge(*mm))).collect::<Vec<_>>();
    let x = Scale::over(radii.iter().copied());
    let lines: Vec<_> = material.responses.iter().map(radial).collect();
    let values = lines.iter().flatten().map(|(_, value)| *value);
    let panels = [
        ("what leaves a point of light", "R(r)/R, 1/mm²", "r, mm", Scale::over(values)),
        ("the edge of light", "E(x)", "x, mm inside light", Scale::linear(0.5, 1.02)),
    ];
    for (i, (title, name_y, name_x, y)) in panels.into_iter().enumerate() {
        let left = 76.0 + 470.0 * i as f64;
        let area = Area { left, top: 96.0, right: left + 390.0, bottom: 390.0 };
        let panel = Panel::new(area, x, y);
        panel.grid(svg, &x.ticks(), true);
        panel.name_x(svg, name_x);
        panel.name_y(svg, name_y);
        svg.text([left, 88.0], title, LEGEND);
        for (c, (_, color)) in COLORS.iter().enumerate() {
            let of = |r: &Response| if i == 0 { radial(r) } else { edge(r) };
            panel.line(svg, &of(&material.responses[c]), Stroke::new(color, 1.6));
            let dots = Stroke::new(color, 3.2).dashed("0.1 6\" stroke-linecap=\"round");
            panel.line(svg, &of(&own[c]), dots);
        }
    }
}
