//! Everything that the chart writes: its rows for programs, its pictures and a report for people.

use std::error::Error;

use serde::Serialize;
use serde_json::{Map, Value};

use crate::chart::plot::{EQ7, Series, VISIBLE, error_time, heads, width};
use crate::chart::report::{self, SceneImages};
use crate::chart::row::Row;
use crate::output::png;
use crate::svg::Rasteriser;

/// What was measured.
pub struct Chart<'a> {
    pub rows: &'a [Row],
    /// What else `chart.json` holds: an object of adapter, command, notes and the like.
    pub about: &'a Value,
    /// What stands below each picture: adapter, resolution, command. A line in backquotes is set as
    /// code.
    pub caption: &'a str,
    pub heads: &'a [Series],
    pub images: &'a [SceneImages],
}

/// A file: its name and what it holds.
pub type File = (String, Vec<u8>);

/// All files. A picture without anything to show is not among them.
///
/// # Errors
/// `about` is no object, or has a key that the rows or heads take; a picture that cannot be made.
pub fn files(chart: &Chart) -> Result<Vec<File>, Box<dyn Error>> {
    let drawings: Vec<(&str, String)> = [
        ("error_time", error_time(chart.rows, &VISIBLE, chart.caption)),
        ("error_time_eq7", error_time(chart.rows, &EQ7, chart.caption)),
        ("width", width(chart.rows, chart.caption)),
        ("heads", heads(chart.heads, chart.caption)),
    ]
    .into_iter()
    .filter_map(|(name, drawing)| Some((name, drawing?)))
    .collect();

    let mut files = vec![
        ("chart.csv".to_string(), csv(chart.rows).into_bytes()),
        ("chart.json".to_string(), json(chart)?.into_bytes()),
    ];
    let rasteriser = Rasteriser::new();
    for (name, drawing) in &drawings {
        let picture = rasteriser.picture(drawing)?;
        files.push((format!("{name}.svg"), drawing.clone().into_bytes()));
        files.push((format!("{name}.png"), png(&picture)?));
    }
    let report = report::html(chart, drawings.iter().map(|(_, drawing)| drawing.as_str()))?;
    files.push(("report.html".into(), report.into_bytes()));
    Ok(files)
}

/// A column of `chart.csv`: its name, and what it holds of a row.
type Column = (&'static str, fn(&Row) -> String);

const COLUMNS: [Column; 19] = [
    ("scene", |row| row.scene.clone()),
    ("method", |row| row.method.clone()),
    ("setting", |row| row.setting.clone()),
    ("width", |row| row.width.to_string()),
    ("height", |row| row.height.to_string()),
    ("skin_pixels", |row| row.skin_pixels.to_string()),
    ("px_per_mm", |row| number(Some(row.px_per_mm))),
    ("ms", |row| number(Some(row.ms))),
    ("x_copy", |row| number(Some(row.x_copy))),
    ("fetches", |row| number(row.fetches)),
    ("rel_rmse_visible", |row| number(row.rel_rmse_visible)),
    ("max_error_visible", |row| number(row.max_error_visible)),
    ("rel_rmse_eq7", |row| number(row.rel_rmse_eq7)),
    ("max_error_eq7", |row| number(row.max_error_eq7)),
    ("rel_rmse_eq7_normalised", |row| number(row.rel_rmse_eq7_normalised)),
    ("delta_e2000_p99", |row| number(row.delta_e2000_p99)),
    ("flip_mean", |row| number(row.flip_mean)),
    ("energy_ratio", |row| number(row.energy_ratio)),
    ("scratch_bytes_per_pixel", |row| number(row.scratch_bytes_per_pixel)),
];

/// As many digits as it takes to read the same number back; nothing where there is no figure.
fn number(value: Option<f64>) -> String {
    value.filter(|value| value.is_finite()).map_or(String::new(), |value| value.to_string())
}

/// `chart.csv`. Names and settings are the chart's own and hold no commas.
fn csv(rows: &[Row]) -> String {
    let header = COLUMNS.map(|(name, _)| name.to_string());
    let lines = rows.iter().map(|row| COLUMNS.map(|(_, cell)| cell(row)));
    std::iter::once(header).chain(lines).map(|cells| cells.join(",") + "\n").collect()
}

/// `chart.json`. A figure without a value is null.
fn json(chart: &Chart) -> Result<String, Box<dyn Error>> {
    /// Not a [`Value`], which would sort the columns of a row.
    #[derive(Serialize)]
    struct File<'a> {
        #[serde(flatten)]
        about: &'a Map<String, Value>,
        rows: &'a [Row],
        heads: &'a [Series],
    }
    let about = chart.about.as_object().ok_or("about: not an object")?;
    for key in ["rows", "heads"] {
        if about.contains_key(key) {
            return Err(format!("about: {key} is taken").into());
        }
    }
    let file = File { about, rows: chart.rows, heads: chart.heads };
    Ok(serde_json::to_string_pretty(&file)? + "\n")
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::chart::fixture;

    /// A chart of rows alone.
    fn chart_of(rows: &[Row]) -> Vec<File> {
        let chart = Chart { rows, about: &json!({}), caption: "", heads: &[], images: &[] };
        files(&chart).unwrap()
    }

    fn names(files: &[File]) -> Vec<&str> {
        files.iter().map(|(name, _)| name.as_str()).collect()
    }

    fn text<'a>(files: &'a [File], wanted: &str) -> &'a str {
        let (_, bytes) = files.iter().find(|(name, _)| name == wanted).unwrap();
        std::str::from_utf8(bytes).unwrap()
    }

    #[test]
    fn the_csv_reads_back_as_the_rows() {
        let rows = fixture::rows();
        let csv = csv(&rows);
        let mut lines = csv.lines();
        let header: Vec<&str> = lines.next().unwrap().split(',').collect();
        for (row, line) in rows.iter().zip(lines.by_ref()) {
            let cells = line.split(',').zip(&header).map(|(cell, &name)| {
                let value = match name {
                    "scene" | "method" | "setting" => json!(cell),
                    _ if cell.is_empty() => Value::Null,
                    _ if cell.contains('.') => json!(cell.parse::<f64>().unwrap()),
                    _ => json!(cell.parse::<u64>().unwrap()),
                };
                (name.to_string(), value)
            });
            let read: Row = serde_json::from_value(cells.collect::<Map<_, _>>().into()).unwrap();
            assert_eq!(&read, row);
        }
        assert_eq!(lines.next(), None);
    }

    #[test]
    fn the_csv_has_the_columns_of_a_row_in_their_order() {
        let row = serde_json::to_string(&fixture::rows()[0]).unwrap();
        let places = COLUMNS.map(|(name, _)| row.find(&format!("\"{name}\":")).unwrap());
        assert!(places.is_sorted());
        assert_eq!(row.matches("\":").count(), COLUMNS.len());
    }

    #[test]
    fn the_json_holds_rows_and_what_it_is_told() {
        let rows = fixture::rows();
        let about = json!({"adapter": "llvmpipe", "notes": ["a"], "intervals": [[0.1, 0.2]]});
        let chart = Chart { rows: &rows, about: &about, caption: "", heads: &[], images: &[] };
        let read: Value = serde_json::from_str(&json(&chart).unwrap()).unwrap();
        assert_eq!(read["adapter"], "llvmpipe");
        assert_eq!(read["intervals"], about["intervals"]);
        let written: Value = serde_json::from_str(&serde_json::to_string(&rows).unwrap()).unwrap();
        assert_eq!(read["rows"], written);

        for about in [json!([]), json!({"rows": 1})] {
            assert!(json(&Chart { about: &about, ..chart }).is_err());
        }
    }

    #[test]
    fn nothing_measured_is_nothing_to_draw() {
        let files = chart_of(&[]);
        assert_eq!(names(&files), ["chart.csv", "chart.json", "report.html"]);
    }

    #[test]
    fn every_row_with_a_figure_is_drawn() {
        // A drawing has as many markers as rows, beside those of the legend.
        let markers = |svg: &str| svg.matches("stroke-width=\".8\"").count();
        let rows = fixture::rows();
        let with_all = chart_of(&rows);
        let is_last = |row: &Row| row.scene == "front" && row.method == "screen_planned";
        let without: Vec<Row> = rows.iter().filter(|row| !is_last(row)).cloned().collect();
        for name in ["error_time.svg", "error_time_eq7.svg"] {
            let [all, fewer] = [&with_all, &chart_of(&without)].map(|f| markers(text(f, name)));
            assert_eq!(all, fewer + 3, "{name}");
        }
    }

    #[test]
    fn odd_figures_and_names_break_no_picture() {
        let mut rows = fixture::rows();
        let odd = [None, Some(0.0), Some(-1.0), Some(f64::NAN), Some(f64::INFINITY), Some(1e-300)];
        for (i, row) in rows.iter_mut().enumerate().filter(|(i, _)| i % 2 == 0) {
            let figure = odd[i / 2 % odd.len()];
            row.rel_rmse_visible = figure;
            row.rel_rmse_eq7_normalised = figure;
            row.max_error_visible = figure;
            row.ms = figure.unwrap_or(0.0);
            row.x_copy = row.ms;
            row.px_per_mm = if i % 3 == 0 { row.ms } else { row.px_per_mm };
            row.method = "<odd> & \"new\"".into();
        }
        let heads = [Series {
            name: "<one>".into(),
            points: vec![(1.0, f64::NAN), (0.0, 0.0), (4.0, f64::INFINITY)],
            extrapolated_from: Some(7),
        }];
        let chart =
            Chart { rows: &rows, about: &json!({}), caption: "a < b & c", heads: &heads, images: &[] };
        let files = files(&chart).unwrap();
        assert_eq!(files.len(), 11);
        for (name, bytes) in &files {
            let is_text = !name.ends_with(".png");
            let text = if is_text { std::str::from_utf8(bytes).unwrap() } else { "" };
            assert!(!text.contains("NaN") && !text.contains("=\"inf"), "{name}");
            assert!(!text.contains("<odd>") || name.starts_with("chart."), "{name}");
        }
    }

    /// Leaves the whole chart where `CHART_OUT` says, to be looked at.
    #[test]
    fn the_whole_chart_is_written() {
        let (rows, heads, images) = (fixture::rows(), fixture::heads(), fixture::images());
        let chart = Chart {
            rows: &rows,
            about: &json!({
                "adapter": "a made-up adapter",
                "command": "chart --made-up",
                "notes": ["Made-up numbers."],
            }),
            caption: "Made-up numbers on a made-up adapter (driver 1.2.3), 1920×1080, median of 41 rounds.\n\
                      `cargo run --release --example chart -- --size 1920x1080`",
            heads: &heads,
            images: &images,
        };
        let files = files(&chart).unwrap();
        assert_eq!(files.len(), 11);
        let html = text(&files, "report.html");
        assert!(!html.contains("src=\"http") && !html.contains("url(http"));
        assert_eq!(html.matches("<svg ").count(), 4);
        if let Some(out) = std::env::var_os("CHART_OUT") {
            crate::output::write(out.as_ref(), &files).unwrap();
        }
    }
}
