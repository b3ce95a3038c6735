//! What the comparison found, told four ways: `report.json` for programs, `report.html` and the
//! pictures for people, a table for the terminal.

use std::io::Cursor;

use image::error::{ParameterError, ParameterErrorKind};
use image::{ImageError, ImageFormat, ImageResult, Rgb32FImage, RgbImage};
use serde_json::{Map, Value, json};

use crate::metrics::{Layer, PIXELS_PER_DEGREE};
use crate::page::{address, escape, head, line};

/// How much the difference pictures are amplified.
pub const DIFFERENCE_GAIN: f32 = 10.0;

/// One comparison: what was rendered, on what, and how each mode came out.
pub struct Report {
    /// The GPU, or the software renderer, and its driver.
    pub adapter: String,
    /// Width and height of the pictures, in pixels.
    pub size: [u32; 2],
    /// The model's file, or what the embedded one is called.
    pub model: String,
    /// Whom the model's licence asks to name.
    pub attribution: Option<String>,
    /// The camera, such as `front`.
    pub view: String,
    /// Pixels that the figures are taken over.
    pub skin_pixels: usize,
    /// Width of a pixel on the skin, in millimetres.
    pub mm_per_px: f64,
    /// Width of a texel on the skin in the texture-space path, in millimetres.
    pub mm_per_texel: f64,
    /// Width and height of the texture-space path's atlas, in texels.
    pub texture_size: u32,
    /// The error that the plan was fitted for, in units of white.
    pub max_error: f32,
    /// The Gaussians that are too narrow for the atlas, one text each.
    pub unresolved: Vec<String>,
    /// Anything else that the reader should know, one sentence each.
    pub notes: Vec<String>,
    /// The command line that made this report.
    pub command: String,
    /// The modes that were rendered, in the order in which to show them.
    pub modes: Vec<ModeReport>,
    /// The modes that could not be: title and reason.
    pub unavailable: Vec<(String, String)>,
}

/// One mode: its cost, its distance from the texture-space path, its pictures.
///
/// A figure is `None` where it has no value: there is no texture-space path to compare with, or no
/// skin in view.
pub struct ModeReport {
    /// The mode in `report.json`: `none`, `texture_space`, `screen_planned` for a plan, or `screen_space` for
    /// the exact sum.
    pub name: &'static str,
    /// The mode for people.
    pub title: String,
    /// Median wall time of the scattering alone, in milliseconds.
    pub ms: f64,
    /// The part of `ms` that draws the mesh into the atlas; texture space alone has one.
    pub ms_raster: Option<f64>,
    /// The part of `ms` that blurs the atlas; texture space alone has one.
    pub ms_blur: Option<f64>,
    /// Relative RMSE of the irradiance, a fraction.
    pub rel_rmse: Option<f64>,
    /// The same over the pixels where scattering changes the irradiance by more than .01.
    pub rel_rmse_scattered: Option<f64>,
    /// As `rel_rmse`, to Eq. 7 over the whole mesh, where that is a mode.
    pub rel_rmse_eq7: Option<f64>,
    /// Largest error of any channel of the irradiance, in linear light.
    pub max_error: Option<f64>,
    /// CIEDE2000 difference of irradiance times albedo that 99 % of the pixels stay within.
    pub delta_e2000_p99: Option<f64>,
    /// Mean FLIP of the picture, 0 to 1.
    pub flip_mean: Option<f64>,
    /// Scattered over unscattered irradiance, both weighted by surface area and summed over skin.
    pub energy_ratio: Option<f64>,
    /// The finished picture, sRGB; anti-aliased, which what is measured is not.
    pub picture: RgbImage,
    /// The irradiance as a picture, without albedo and highlights, sRGB.
    pub diffuse: RgbImage,
    /// The irradiance's difference from texture space, times [`DIFFERENCE_GAIN`].
    pub difference: Option<RgbImage>,
    /// FLIP of the picture against texture space, in the magma colours.
    pub flip: Option<RgbImage>,
}

/// A row of the table and a key of `report.json`.
struct Figure {
    key: &'static str,
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
    /// With so many it is shown.
    decimals: usize,
    /// A part of the figure above it.
    part: bool,
    /// Left out of `report.json` where a mode has none, rather than null.
    optional: bool,
    value: fn(&ModeReport) -> Option<f64>,
}

const FIGURE: Figure = Figure {
    key: "",
    name: "",
    unit: "",
    meaning: "",
    decimals: 2,
    part: false,
    optional: false,
    value: |_| None,
};

const FIGURES: [Figure; 10] = [
    Figure {
        key: "ms",
        name: "Time",
        unit: "ms",
        meaning: "Median wall time of the scattering alone, from submitting to done.",
        value: |mode| Some(mode.ms),
        ..FIGURE
    },
    Figure {
        key: "ms_raster",
        name: "of which raster",
        unit: "ms",
        meaning: "Drawing the mesh into the atlas.",
        part: true,
        optional: true,
        value: |mode| mode.ms_raster,
        ..FIGURE
    },
    Figure {
        key: "ms_blur",
        name: "of which blur",
        unit: "ms",
        meaning: "Blurring the atlas, Gaussian by Gaussian.",
        part: true,
        optional: true,
        value: |mode| mode.ms_blur,
        ..FIGURE
    },
    Figure {
        key: "rel_rmse_vs_texture",
        name: "Relative RMSE",
        unit: "%",
        meaning: "Distance of the irradiance from texture space, over skin but for its rim.",
        value: |mode| mode.rel_rmse,
        ..FIGURE
    },
    Figure {
        key: "rel_rmse_scattered_vs_texture",
        name: "where scattered",
        unit: "%",
        meaning: "The same over the pixels where scattering changes the irradiance by more than .01.",
        part: true,
        value: |mode| mode.rel_rmse_scattered,
        ..FIGURE
    },
    Figure {
        key: "rel_rmse_vs_eq7",
        name: "to Eq. 7",
        unit: "%",
        meaning: "The same distance from Eq. 7 over the whole mesh, each Gaussian divided by its mass.",
        part: true,
        optional: true,
        value: |mode| mode.rel_rmse_eq7,
        ..FIGURE
    },
    Figure {
        key: "max_error_vs_texture",
        name: "Largest error",
        unit: "linear",
        meaning: "Of any channel of the irradiance, on a linear scale where white is 1.",
        decimals: 4,
        value: |mode| mode.max_error,
        ..FIGURE
    },
    Figure {
        key: "delta_e2000_p99_vs_texture",
        name: "Colour difference",
        unit: "ΔE2000",
        meaning: "99 % of the pixels are closer than this, before highlights. About 1 is just noticeable.",
        value: |mode| mode.delta_e2000_p99,
        ..FIGURE
    },
    Figure {
        key: "flip_mean_vs_texture",
        name: "Mean FLIP",
        unit: "0 to 1",
        meaning: "Visible difference of the finished pictures when one flips between them.",
        decimals: 4,
        value: |mode| mode.flip_mean,
        ..FIGURE
    },
    Figure {
        key: "energy_ratio",
        name: "Energy",
        unit: "ratio",
        meaning: "Scattered over unscattered light, summed over the skin in view. \
                  Skin that moved light without loss shows 1.",
        decimals: 4,
        value: |mode| mode.energy_ratio,
        ..FIGURE
    },
];

impl Figure {
    fn value(&self, mode: &ModeReport) -> Option<f64> {
        (self.value)(mode).filter(|value| value.is_finite())
    }

    fn text(&self, mode: &ModeReport) -> String {
        let scale = if self.unit == "%" { 100.0 } else { 1.0 };
        let text = |value| format!("{:.*}", self.decimals, value * scale);
        self.value(mode).map_or("–".into(), text)
    }
}

/// One of the pictures that each mode comes with.
struct View {
    name: &'static str,
    title: &'static str,
    meaning: &'static str,
    picture: fn(&ModeReport) -> Option<&RgbImage>,
}

const VIEWS: [View; 4] = [
    View {
        name: "picture",
        title: "Picture",
        meaning: "As it is shown, with highlights and tone mapping.",
        picture: |mode| Some(&mode.picture),
    },
    View {
        name: "diffuse",
        title: "Diffuse light",
        meaning: "The irradiance that scattering works on, without albedo and highlights.",
        picture: |mode| Some(&mode.diffuse),
    },
    View {
        name: "difference",
        title: "Difference × 10",
        meaning: "Irradiance against texture space, per channel: black is none, full is .1 or more.",
        picture: |mode| mode.difference.as_ref(),
    },
    View {
        name: "flip",
        title: "FLIP",
        meaning: "How visible the picture's difference from texture space is:",
        picture: |mode| mode.flip.as_ref(),
    },
];

/// `report.json`. A figure without a value is null.
pub fn json(report: &Report) -> String {
    let figures = |mode: &ModeReport| -> Map<String, Value> {
        FIGURES
            .iter()
            .map(|figure| (figure, figure.value(mode)))
            .filter(|(figure, value)| !figure.optional || value.is_some())
            .map(|(figure, value)| (figure.key.to_string(), json!(value)))
            .collect()
    };
    let modes: Map<String, Value> =
        report.modes.iter().map(|mode| (mode.name.to_string(), figures(mode).into())).collect();
    let report = json!({
        "adapter": report.adapter,
        "size": report.size,
        "model": report.model,
        "attribution": report.attribution,
        "view": report.view,
        "command": report.command,
        "skin_pixels": report.skin_pixels,
        "mm_per_px": report.mm_per_px,
        "mm_per_texel": report.mm_per_texel,
        "texture_size": report.texture_size,
        "max_error": report.max_error,
        "unresolved": report.unresolved,
        "flip_pixels_per_degree": PIXELS_PER_DEGREE,
        "modes": modes,
        "notes": notes(report),
    });
    format!("{report:#}\n")
}

/// The figures as plain text, a column for each mode, with what they were taken on.
pub fn table(report: &Report) -> String {
    let mut text = String::new();
    let facts = facts(report);
    let width = facts.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    for (name, fact) in facts {
        line(&mut text, &format!("{name:<width$}  {fact}"));
    }

    let name_width = FIGURES.iter().map(|f| indented(f).chars().count()).max().unwrap_or(0);
    let unit_width = FIGURES.iter().map(|f| f.unit.chars().count()).max().unwrap_or(0);
    let row = |name: &str, unit: &str, cell: &dyn Fn(&ModeReport) -> String| {
        let mut row = format!("{name:<name_width$}  {unit:<unit_width$}");
        for mode in &report.modes {
            let column = mode.title.chars().count().max(8);
            row += &format!("  {:>column$}", cell(mode));
        }
        row
    };
    line(&mut text, "");
    line(&mut text, &row("", "", &|mode| mode.title.clone()));
    for figure in shown(report) {
        line(&mut text, &row(&indented(figure), figure.unit, &|mode| figure.text(mode)));
    }

    line(&mut text, "");
    for note in headline(report).into_iter().chain(notes(report)) {
        line(&mut text, &note);
    }
    text
}

/// `report.html`: one file that needs no other, neither beside it nor from the network. The
/// fragment can set the slider, as in `report.html#left=none&right=screen_planned&layer=flip&at=30`.
///
/// # Errors
/// A picture that cannot be encoded as PNG.
pub fn html(report: &Report) -> ImageResult<String> {
    let title = format!("{}: skin with and without scattering", report.model);
    let mut page = head(&title, STYLE);
    line(&mut page, "<h1>Skin with and without scattering</h1>");
    if let Some(headline) = headline(report) {
        line(&mut page, &format!("<p class=lead>{}</p>", escape(&headline)));
    }
    for note in notes(report) {
        line(&mut page, &format!("<p class=note>{}</p>", escape(&note)));
    }
    // A view that some mode lacks could not be compared.
    let views: Vec<&View> = VIEWS
        .iter()
        .filter(|view| report.modes.iter().all(|mode| (view.picture)(mode).is_some()))
        .collect();
    if report.modes.len() > 1 {
        slider(&mut page, report, &views);
    }
    figures(&mut page, report);
    pictures(&mut page, report, &views)?;
    line(&mut page, "<h2>What was compared</h2>\n<dl>");
    for (name, fact) in facts(report) {
        line(&mut page, &format!("<dt>{name}</dt><dd>{}</dd>", escape(&fact)));
    }
    line(&mut page, &format!("</dl>\n</main>\n<script>{SCRIPT}</script>\n</html>"));
    Ok(page)
}

/// The before/after slider. It holds no pictures: the script takes them from the page below.
fn slider(page: &mut String, report: &Report, views: &[&View]) {
    let select = |id: &str, label: &str, chosen: usize, options: &[(&str, &str)]| {
        let mut select = format!("<label>{label} <select id={id} autocomplete=off>");
        for (i, (name, title)) in options.iter().enumerate() {
            let selected = if i == chosen { " selected" } else { "" };
            select += &format!("<option value={name}{selected}>{}</option>", escape(title));
        }
        select + "</select></label>"
    };
    let modes: Vec<_> = report.modes.iter().map(|mode| (mode.name, mode.title.as_str())).collect();
    let layers: Vec<_> = views.iter().map(|view| (view.name, view.title)).collect();
    let [width, height] = report.size;
    let is_plan = |mode: &ModeReport| mode.name == "screen_planned";
    let recommended = report.modes.iter().position(is_plan).unwrap_or(modes.len() - 1);
    let controls = [
        select("left", "Left", 0, &modes),
        select("layer", "Show", 0, &layers),
        select("right", "Right", recommended, &modes),
    ];
    line(
        page,
        &format!(
            "<div class=controls>{}</div>\n\
             <div class=mat><div id=frame style=\"--w:{width};--h:{height}\">\n\
             <img id=right-picture alt draggable=false>\
             <img id=left-picture alt draggable=false>\n\
             <input id=at type=range min=0 max=100 value=50 autocomplete=off \
             aria-label=\"Divider between the left and the right picture, in percent\">\n\
             <i class=divider></i><b id=left-tag></b><b id=right-tag></b>\n</div></div>\n\
             <noscript><p class=note>The slider needs JavaScript; all else does not.</p></noscript>",
            controls.concat()
        ),
    );
}

/// The table of figures.
fn figures(page: &mut String, report: &Report) {
    line(page, "<h2>Numbers</h2>\n<table>\n<thead><tr><th></th>");
    for mode in &report.modes {
        line(page, &format!("<th scope=col>{}</th>", escape(&mode.title)));
    }
    line(page, "</tr></thead>\n<tbody>");
    for figure in shown(report) {
        let part = if figure.part { " class=part" } else { "" };
        let (name, unit, meaning) = (figure.name, figure.unit, figure.meaning);
        line(
            page,
            &format!("<tr{part}><th scope=row>{name} <span>{unit}</span><small>{meaning}</small></th>"),
        );
        for mode in &report.modes {
            line(page, &format!("<td>{}</td>", figure.text(mode)));
        }
        line(page, "</tr>");
    }
    line(page, "</tbody>\n</table>");
}

/// All pictures side by side: a strip for each view, each picture once in the file.
fn pictures(page: &mut String, report: &Report, views: &[&View]) -> ImageResult<()> {
    line(page, "<h2>Pictures</h2>");
    for view in views {
        let scale = if view.name == "flip" { " 0 <i class=magma></i> 1" } else { "" };
        let (title, meaning) = (view.title, view.meaning);
        line(page, &format!("<h3>{title}</h3>\n<p>{meaning}{scale}</p>\n<div class=\"mat strip\">"));
        for mode in &report.modes {
            let Some(picture) = (view.picture)(mode) else {
                continue;
            };
            let (id, caption) = (mode.name, escape(&mode.title));
            let address = address(picture)?;
            line(
                page,
                &format!(
                    "<figure><img data-mode={id} data-layer={} alt=\"{title}: {caption}\" \
                     src=\"{address}\"><figcaption>{caption}</figcaption></figure>",
                    view.name
                ),
            );
        }
        line(page, "</div>");
    }
    Ok(())
}

/// The figures for people: all but the optional ones that no mode has.
fn shown(report: &Report) -> impl Iterator<Item = &'static Figure> {
    FIGURES
        .iter()
        .filter(|figure| !figure.optional || report.modes.iter().any(|mode| figure.value(mode).is_some()))
}

/// The result in two sentences, where there is one.
fn headline(report: &Report) -> Option<String> {
    let error = |name| report.modes.iter().find(|mode| mode.name == name)?.rel_rmse;
    let (exact, none) = (error("screen_space")?, error("none")?);
    let plan = error("screen_planned").map(|plan| format!(", the plan by {:.2} %", 100.0 * plan));
    Some(format!(
        "Over skin, the exact sum in screen space differs from texture space by {:.2} %{} (relative RMSE \
         of the irradiance). Without scattering it is {:.2} %.",
        100.0 * exact,
        plan.unwrap_or_default(),
        100.0 * none,
    ))
}

/// The modes that are missing, then the notes.
fn notes(report: &Report) -> Vec<String> {
    let missing = report.unavailable.iter().map(|(mode, reason)| format!("No {mode}: {reason}"));
    missing.chain(report.notes.iter().cloned()).collect()
}

/// What was rendered and on what, as names and texts.
fn facts(report: &Report) -> Vec<(&'static str, String)> {
    let [width, height] = report.size;
    let mut facts = vec![("Model", report.model.clone())];
    facts.extend(report.attribution.iter().map(|names| ("Attribution", names.clone())));
    facts.push(("View", report.view.clone()));
    facts.push((
        "Picture",
        format!(
            "{width} × {height} px, {:.3} mm per px, {} px of skin",
            report.mm_per_px, report.skin_pixels
        ),
    ));
    let atlas = report.texture_size;
    facts.push(("Atlas", format!("{atlas} × {atlas} texels, {:.3} mm per texel", report.mm_per_texel)));
    facts.extend(report.unresolved.iter().map(|gaussian| ("Unresolved", gaussian.clone())));
    facts.push(("FLIP", format!("at {PIXELS_PER_DEGREE} pixels per degree of visual angle")));
    facts.push(("Adapter", report.adapter.clone()));
    facts.push(("Command", report.command.clone()));
    facts
}

fn indented(figure: &Figure) -> String {
    format!("{}{}", if figure.part { "  " } else { "" }, figure.name)
}

/// A linear layer as an OpenEXR file, RGB in 32-bit floats.
///
/// # Errors
/// A layer without pixels, or with another number of them than its size says.
pub fn exr(layer: &Layer) -> ImageResult<Vec<u8>> {
    let floats = layer.pixels.as_flattened().to_vec();
    let mismatch =
        || ImageError::Parameter(ParameterError::from_kind(ParameterErrorKind::DimensionMismatch));
    let image = Rgb32FImage::from_raw(layer.width, layer.height, floats).ok_or_else(mismatch)?;
    let mut file = Cursor::new(Vec::new());
    image.write_to(&mut file, ImageFormat::OpenExr)?;
    Ok(file.into_inner())
}

const STYLE: &str = "
.controls { display: flex; flex-wrap: wrap; justify-content: space-between; gap: .5rem 1rem; margin-bottom: .75rem; }
.controls label { color: var(--dim); font-size: .9rem; }
select { font: inherit; color: var(--text); background: #3a3a3a; border: 1px solid #5a5a5a; border-radius: 4px; padding: .3rem .4rem; }
#frame { --at: 50%; position: relative; overflow: hidden; margin: auto; aspect-ratio: var(--w) / var(--h);
  width: min(100%, 84vh * var(--w) / var(--h), max(1px * var(--w), 48rem));
  cursor: ew-resize; user-select: none; -webkit-user-select: none; touch-action: pan-y; }
#frame > * { position: absolute; pointer-events: none; }
#frame img { inset: 0; height: 100%; }
#left-picture { clip-path: inset(0 calc(100% - var(--at)) 0 0); }
#at { opacity: 0; inset: 0; width: 100%; margin: 0; }
.divider { top: 0; bottom: 0; left: calc(var(--at) - 1px); width: 2px; background: #fff; box-shadow: 0 0 4px #000a; }
.divider::after { content: '\\2039\\2009\\203a'; position: absolute; top: 50%; left: 50%; width: 2.2rem; height: 2.2rem;
  transform: translate(-50%, -50%); border-radius: 50%; background: #fff; color: #222; box-shadow: 0 1px 5px #0009;
  font: 600 1.3rem/2.1rem system-ui, sans-serif; text-align: center; }
#at:focus-visible ~ .divider::after { outline: 3px solid #6ab0ff; outline-offset: 2px; }
#frame b { bottom: .6rem; padding: .15rem .55rem; border-radius: 3px; background: #000b; color: #fff; font-size: .85rem; font-weight: 500; }
#left-tag { left: .6rem; }
#right-tag { right: .6rem; }
.part th[scope=row] { padding-left: 1.25rem; }
.magma { display: inline-block; width: 6rem; height: .8em; vertical-align: -.05em; border-radius: 2px;
  background: linear-gradient(90deg, #000004, #3b0f70, #8c2981, #de4968, #fe9f6d, #fcfdbf); }
@media (max-width: 34rem) { .part th[scope=row] { padding-left: .6rem; } }
";

// The range input is the divider for the keyboard and for screen readers, whole percents; the
// pointer drags anywhere on the picture, to the pixel.
const SCRIPT: &str = "
'use strict';
const $ = id => document.getElementById(id);
const frame = $('frame'), at = $('at');
function move(percent) {
  at.value = percent;
  frame.style.setProperty('--at', Math.min(100, Math.max(0, percent)) + '%');
}
function show() {
  for (const side of ['left', 'right']) {
    const mode = $(side).selectedOptions[0];
    const picture = document.querySelector(`[data-mode=${mode.value}][data-layer=${$('layer').value}]`);
    $(side + '-picture').src = picture.src;
    $(side + '-picture').alt = picture.alt;
    $(side + '-tag').textContent = mode.text;
  }
}
function drag(event) {
  const box = frame.getBoundingClientRect();
  move(100 * (event.clientX - box.left) / box.width);
}
if (frame) {
  frame.addEventListener('pointerdown', event => {
    if (event.button !== 0) return;
    event.preventDefault();
    frame.setPointerCapture(event.pointerId);
    at.focus({ preventScroll: true, focusVisible: false });
    drag(event);
  });
  frame.addEventListener('pointermove', event => {
    if (frame.hasPointerCapture(event.pointerId)) drag(event);
  });
  at.addEventListener('input', () => move(+at.value));
  for (const [id, value] of new URLSearchParams(location.hash.slice(1))) {
    if (id === 'at') at.value = value;
    const select = ['left', 'right', 'layer'].includes(id) ? $(id) : null;
    if (select && [...select.options].some(option => option.value === value)) select.value = value;
  }
  for (const id of ['left', 'right', 'layer']) $(id).addEventListener('change', show);
  show();
  move(+at.value);
}
";

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(name: &'static str, title: &'static str, shade: u8, error: Option<f64>) -> ModeReport {
        let picture = RgbImage::from_pixel(3, 2, image::Rgb([shade, 80, 60]));
        let is_texture = name == "texture_space";
        ModeReport {
            name,
            title: title.into(),
            ms: 12.5,
            ms_raster: is_texture.then_some(2.5),
            ms_blur: is_texture.then_some(10.0),
            rel_rmse: error,
            rel_rmse_scattered: error,
            rel_rmse_eq7: None,
            max_error: error,
            delta_e2000_p99: error,
            flip_mean: error,
            energy_ratio: Some(1.0),
            diffuse: picture.clone(),
            difference: error.map(|_| picture.clone()),
            flip: error.map(|_| picture.clone()),
            picture,
        }
    }

    fn report() -> Report {
        Report {
            adapter: "llvmpipe".into(),
            size: [3, 2],
            model: "<script>alert('head')</script>".into(),
            attribution: Some("Name & Co".into()),
            view: "front".into(),
            skin_pixels: 5,
            mm_per_px: 0.5,
            mm_per_texel: 0.25,
            texture_size: 2048,
            max_error: 0.004,
            unresolved: vec!["variance .0064 mm²".into()],
            notes: vec!["a < b".into()],
            command: "compare --model \"<x>\"".into(),
            modes: vec![
                mode("none", "No scattering", 10, Some(0.08)),
                mode("texture_space", "Texture space", 20, Some(0.0)),
                mode("screen_planned", "A plan", 40, Some(0.03)),
                mode("screen_space", "Screen space", 30, Some(0.02)),
            ],
            unavailable: vec![],
        }
    }

    /// A mesh without UVs: no texture space, and nothing to compare with.
    fn without_texture_space() -> Report {
        Report {
            modes: vec![
                mode("none", "No scattering", 10, None),
                mode("screen_space", "Screen space", 30, None),
            ],
            unavailable: vec![("Texture space".into(), "the mesh has no UVs.".into())],
            ..report()
        }
    }

    #[test]
    fn json_has_the_promised_keys() {
        let json: Value = serde_json::from_str(&json(&report())).unwrap();
        assert_eq!(json["adapter"], "llvmpipe");
        assert_eq!(json["size"], json!([3, 2]));
        assert_eq!(json["model"], "<script>alert('head')</script>");
        assert_eq!(json["skin_pixels"], 5);
        assert_eq!(json["flip_pixels_per_degree"], 67.0);
        for name in ["none", "texture_space", "screen_planned", "screen_space"] {
            let mode = json["modes"][name].as_object().unwrap();
            for figure in FIGURES.iter().filter(|figure| !figure.optional) {
                assert!(mode[figure.key].is_number(), "{name} {}", figure.key);
            }
            for part in ["ms_raster", "ms_blur"] {
                assert_eq!(mode.contains_key(part), name == "texture_space", "{name} {part}");
            }
        }
        assert_eq!(json["modes"]["screen_space"]["rel_rmse_vs_texture"], 0.02);
    }

    #[test]
    fn figures_without_a_value_are_null() {
        let mut report = without_texture_space();
        report.modes[1].energy_ratio = Some(f64::NAN);
        let json: Value = serde_json::from_str(&json(&report)).unwrap();
        assert!(json["modes"].get("texture_space").is_none());
        for key in ["rel_rmse_vs_texture", "flip_mean_vs_texture", "energy_ratio"] {
            assert!(json["modes"]["screen_space"][key].is_null(), "{key}");
        }
        assert_eq!(json["notes"][0], "No Texture space: the mesh has no UVs.");
    }

    #[test]
    fn html_needs_no_other_file() {
        let report = report();
        let html = html(&report).unwrap();
        assert!(!html.contains("http:") && !html.contains("https:") && !html.contains("url("));
        for mode in &report.modes {
            let address = address(&mode.picture).unwrap();
            assert!(html.contains(&format!("src=\"{address}\"")), "{}", mode.name);
        }
        // Every picture is there once: four modes, four views. The slider opens on what is recommended.
        assert_eq!(html.matches("data:image/png").count(), 16);
        assert!(html.contains("<option value=screen_planned selected>"));
    }

    #[test]
    fn html_shows_text_from_outside_as_text() {
        let html = html(&report()).unwrap();
        assert!(html.contains("&lt;script&gt;alert(&#39;head&#39;)&lt;/script&gt;"));
        assert!(html.contains("Name &amp; Co") && html.contains("a &lt; b"));
        assert!(html.contains("&quot;&lt;x&gt;&quot;"));
        assert!(!html.contains("<script>alert") && !html.contains("<x>"));
    }

    #[test]
    fn html_without_texture_space_says_so_and_offers_no_difference() {
        let html = html(&without_texture_space()).unwrap();
        assert!(html.contains("No Texture space: the mesh has no UVs."));
        assert!(!html.contains("data-layer=flip") && !html.contains("value=flip"));
        assert_eq!(html.matches("data:image/png").count(), 4);
    }

    #[test]
    fn the_table_is_aligned() {
        for report in [report(), without_texture_space()] {
            let table = table(&report);
            let rows: Vec<&str> = table.lines().skip_while(|line| !line.is_empty()).collect();
            let width = |row: &str| row.chars().count();
            for row in &rows[1..=1 + shown(&report).count()] {
                assert_eq!(width(row), width(rows[1]), "{row}");
            }
        }
    }

    #[test]
    fn layers_survive_their_files() {
        let layer = Layer { width: 2, height: 1, pixels: vec![[0.1, 2.5, -0.3], [1e-6, 0.0, 4.0]] };
        let read = image::load_from_memory(&exr(&layer).unwrap()).unwrap().into_rgb32f();
        assert_eq!(read.as_raw(), layer.pixels.as_flattened());
        assert!(exr(&Layer { width: 3, ..layer }).is_err());
    }
}
