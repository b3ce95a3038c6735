//! `report.html`: the charts, every number behind them, and the pictures that they are taken from.

use std::fmt::Write as _;

use image::{ImageResult, RgbImage};
use serde_json::Value;

use crate::chart::files::Chart;
use crate::chart::plot::scale::rounded;
use crate::chart::plot::style::{distinct, styles};
use crate::chart::row::Row;
use crate::page::{address, escape, head, line};

/// The pictures of a scene.
pub struct SceneImages {
    pub scene: String,
    /// What the methods should come to.
    pub truth: RgbImage,
    /// Of each method: what it is called, what it came to, and how far off that is.
    pub entries: Vec<(String, RgbImage, RgbImage)>,
}

/// A column of the table: its heading, its unit, what it is of a row, and the text of that.
type Column = (&'static str, &'static str, fn(&Row) -> Option<f64>, fn(f64) -> String);

const COLUMNS: [Column; 13] = [
    ("Time", "ms", |row| Some(row.ms), rounded),
    ("Time", "copies", |row| Some(row.x_copy), rounded),
    ("Fetches", "per pixel", |row| row.fetches, rounded),
    ("RMSE, visible", "%", |row| row.rel_rmse_visible, percent),
    ("Largest, visible", "linear", |row| row.max_error_visible, rounded),
    ("RMSE, Eq.\u{a0}7", "%", |row| row.rel_rmse_eq7, percent),
    ("Largest, Eq.\u{a0}7", "linear", |row| row.max_error_eq7, rounded),
    ("RMSE, Eq.\u{a0}7, normalised", "%", |row| row.rel_rmse_eq7_normalised, percent),
    ("Colour, 99 %", "ΔE2000", |row| row.delta_e2000_p99, rounded),
    ("Mean FLIP", "0 to 1", |row| row.flip_mean, rounded),
    ("Energy", "ratio", |row| row.energy_ratio, |ratio| format!("{ratio:.4}")),
    ("Scratch", "bytes/px", |row| row.scratch_bytes_per_pixel, rounded),
    ("Skin", "px", |row| Some(row.skin_pixels as f64), |count| format!("{count:.0}")),
];

fn percent(fraction: f64) -> String {
    rounded(100.0 * fraction)
}

/// One file that needs no other, neither beside it nor from the network.
///
/// # Errors
/// A picture without pixels.
pub fn html<'a>(chart: &Chart, drawings: impl Iterator<Item = &'a str>) -> ImageResult<String> {
    let title = "Scattering: error against time";
    let mut page = head(title, STYLE);
    line(&mut page, &format!("<h1>{title}</h1>"));
    let notes = chart.about["notes"].as_array().into_iter().flatten();
    for note in notes.filter_map(Value::as_str) {
        line(&mut page, &format!("<p class=note>{}</p>", escape(note)));
    }
    for drawing in drawings {
        line(&mut page, &format!("<div class=card>{drawing}</div>"));
    }
    tables(&mut page, chart.rows);
    for images in chart.images {
        pictures(&mut page, images)?;
    }
    line(&mut page, "<h2>What was measured</h2>\n<dl>");
    for (name, fact) in chart.about.as_object().into_iter().flatten() {
        let fact = match fact {
            Value::String(text) => text.clone(),
            // Long lists are for programs.
            Value::Array(_) | Value::Object(_) => continue,
            other => other.to_string(),
        };
        let (name, fact) = (escape(name), escape(&fact));
        line(&mut page, &format!("<dt>{name}</dt><dd>{fact}</dd>"));
    }
    line(&mut page, "</dl>\n</main>\n</html>");
    Ok(page)
}

/// All rows, a table for each scene.
fn tables(page: &mut String, rows: &[Row]) {
    line(page, "<h2>Numbers</h2>");
    let styles = styles(rows.iter().map(|row| row.method.as_str()));
    for scene in distinct(rows.iter().map(|row| row.scene.as_str())) {
        let rows: Vec<&Row> = rows.iter().filter(|row| row.scene == scene).collect();
        let Row { width, height, px_per_mm, .. } = rows[0];
        let (scene, px_per_mm) = (escape(scene), rounded(*px_per_mm));
        line(
            page,
            &format!(
                "<h3>{scene}</h3>\n<p>{width} × {height} px, {px_per_mm} px a millimetre</p>\n\
                 <div class=wide><table>\n<thead><tr><th></th>"
            ),
        );
        for (name, unit, ..) in COLUMNS {
            line(page, &format!("<th scope=col>{name} <span>{unit}</span></th>"));
        }
        line(page, "</tr></thead>\n<tbody>");
        for row in rows {
            let style = styles.iter().find(|style| style.method == row.method);
            let name = style.map_or(String::new(), |style| style.name(&row.setting));
            let mut cells = format!("<tr><th scope=row>{}</th>", escape(&name));
            for (_, _, value, text) in COLUMNS {
                let value = value(row).filter(|value| value.is_finite());
                let text = value.map_or("–".into(), text);
                write!(cells, "<td>{text}</td>").expect("a String takes all text");
            }
            line(page, &(cells + "</tr>"));
        }
        line(page, "</tbody>\n</table></div>");
    }
}

/// Each method's picture beside the truth, which is in the file once, and its error.
fn pictures(page: &mut String, images: &SceneImages) -> ImageResult<()> {
    let scene = escape(&images.scene);
    let (width, height) = images.truth.dimensions();
    let truth = address(&images.truth)?;
    line(
        page,
        &format!(
            "<section style=\"--truth:url({truth});--w:{width};--h:{height}\">\n\
             <h2>Pictures: {scene}</h2>"
        ),
    );
    for (name, picture, error) in &images.entries {
        let name = escape(name);
        let (picture, error) = (address(picture)?, address(error)?);
        line(
            page,
            &format!(
                "<h3>{name}</h3>\n<div class=\"mat strip\">\n\
                 <figure><img alt=\"{scene}: {name}\" src=\"{picture}\"><figcaption>{name}</figcaption></figure>\n\
                 <figure><div class=truth role=img aria-label=\"{scene}: truth\"></div><figcaption>Truth</figcaption></figure>\n\
                 <figure><img alt=\"{scene}: error of {name}\" src=\"{error}\"><figcaption>Error</figcaption></figure>\n\
                 </div>"
            ),
        );
    }
    line(page, "</section>");
    Ok(())
}

const STYLE: &str = "
main { max-width: 84rem; }
.card { max-width: 68rem; margin: 0 auto 2rem; border-radius: 6px; overflow: hidden; background: #fff; }
.card svg { display: block; width: 100%; height: auto; }
.wide { overflow-x: auto; }
.wide td, .wide th { padding: .2rem 0 .2rem 1rem; font-size: .85rem; white-space: nowrap; }
.wide thead th { min-width: 4.5rem; white-space: normal; }
.wide thead span { display: block; font-weight: 400; }
.wide th[scope=row] { padding-left: 0; }
.truth { background: var(--truth) 0 0 / 100% 100% no-repeat; aspect-ratio: var(--w) / var(--h); }
";
