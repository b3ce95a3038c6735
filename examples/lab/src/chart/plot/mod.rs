//! The charts, as drawings.

pub mod label;
pub mod panel;
pub mod scale;
pub mod style;

use serde::{Deserialize, Serialize};
use subsurface::Profile;

use crate::chart::plot::label::Area;
use crate::chart::plot::panel::{Curve, DIM, FRONT, LEADER, LEGEND, Panel, SMALL, TITLE};
use crate::chart::plot::scale::{Scale, Tick};
use crate::chart::plot::style::{COPY, NONE, Style, distinct, styles};
use crate::chart::row::Row;
use crate::svg::{Svg, Type, text_width};

/// Frames a second against the number of heads.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Series {
    /// A method and its setting, as in `screen_planned 1/255`, or any other text.
    pub name: String,
    /// Number of heads, frames a second.
    pub points: Vec<(f64, f64)>,
    /// The first point that was not measured.
    pub extrapolated_from: Option<usize>,
}

/// What the error is of in a chart of error against time.
pub struct Measure {
    pub title: &'static str,
    pub meaning: &'static str,
    /// A fraction; drawn in percent.
    pub value: fn(&Row) -> Option<f64>,
}

/// Against the integral over what the camera sees.
pub const VISIBLE: Measure = Measure {
    title: "Error against time",
    meaning: "Of the irradiance, against the exact integral over what the camera sees. \
              Lower left is better; beside a point stands its setting.",
    value: |row| row.rel_rmse_visible,
};

/// Against the integral over the whole surface.
pub const EQ7: Measure = Measure {
    title: "Error against time, light from out of view included",
    meaning: "Of the irradiance, against the exact integral over the whole surface. \
              Lower left is better; beside a point stands its setting.",
    value: |row| row.rel_rmse_eq7_normalised,
};

/// Width of every drawing, and the margins to the left and right of it.
const WIDTH: f64 = 960.0;
const LEFT: f64 = 72.0;
const RIGHT: f64 = 20.0;
/// Error against time, a panel for each scene that has figures; `None` where no scene has.
pub fn error_time(rows: &[Row], measure: &Measure, caption: &str) -> Option<String> {
    // An error in percent, where there is one.
    let error = |row: &Row| {
        (measure.value)(row)
            .filter(|error| error.is_finite() && row.ms.is_finite())
            .map(|error| 100.0 * error)
    };
    let with_error = rows.iter().filter(|row| error(row).is_some());
    let scenes = distinct(with_error.map(|row| row.scene.as_str()));
    if scenes.is_empty() {
        return None;
    }
    let rows: Vec<&Row> = rows
        .iter()
        .filter(|row| scenes.contains(&row.scene.as_str()))
        .filter(|row| row.method == COPY || error(row).is_some())
        .collect();
    // One pair of axes for all, so that panels can be compared.
    let x = Scale::over(rows.iter().map(|row| row.ms));
    let y = Scale::over(rows.iter().filter_map(|row| error(row)));

    let mut svg = Svg::default();
    let mut top = heading(&mut svg, measure.title, measure.meaning);
    let styles = styles(rows.iter().map(|row| row.method.as_str()));
    top = legend(&mut svg, &styles, top);

    let columns = scenes.len().min(3);
    let gap = 18.0;
    let width = (WIDTH - LEFT - RIGHT + gap) / columns as f64 - gap;
    let height = [420.0, 300.0, 236.0][columns - 1];
    for (i, scene) in scenes.iter().enumerate() {
        let (column, line) = (i % columns, i / columns);
        let left = LEFT + column as f64 * (width + gap);
        let panel_top = top + line as f64 * (height + 56.0) + 22.0;
        let area = Area { left, top: panel_top, right: left + width, bottom: panel_top + height };
        let panel = Panel::new(area, x, y);
        let of_scene: Vec<&Row> = rows.iter().copied().filter(|row| row.scene == *scene).collect();
        panel.grid(&mut svg, &x.ticks(), column == 0);
        panel.title(&mut svg, scene, &of_scene);
        if column == 0 {
            panel.name_y(&mut svg, "relative RMSE, %");
        }
        if i + columns >= scenes.len() {
            panel.name_x(&mut svg, "time, ms");
        }
        panel.points(&mut svg, &of_scene, &styles, error);
    }
    let lines = scenes.len().div_ceil(columns);
    let bottom = top + lines as f64 * (height + 56.0) + 8.0;
    Some(finish(svg, bottom, measure.title, caption))
}

/// Error and cost against the width of the profile on the screen; `None` without `edge_*` scenes.
pub fn width(rows: &[Row], caption: &str) -> Option<String> {
    let edges: Vec<&Row> = rows
        .iter()
        .filter(|row| row.scene.starts_with("edge_"))
        .filter(|row| row.px_per_mm.is_finite() && row.px_per_mm > 0.0)
        .collect();
    if edges.is_empty() {
        return None;
    }
    let title = "Error and time against the width of the profile";
    let mut svg = Svg::default();
    let mut top = heading(
        &mut svg,
        title,
        "An edge of light, from afar to close up. Dashes and dots: further settings of a method.",
    );
    let sigma_mm = red_sigma_mm();
    let x = Scale::over(edges.iter().map(|row| sigma_mm * row.px_per_mm));
    let styles = styles(edges.iter().map(|row| row.method.as_str()));
    let against_width = |value: fn(&Row) -> Option<f64>| {
        curves(&edges, &styles, |row| Some((sigma_mm * row.px_per_mm, value(row)?)))
    };
    let errors = against_width(|row| row.max_error_visible);
    let times = against_width(|row| Some(row.x_copy));
    let names = names_width(&errors).max(names_width(&times));
    let limit = [(1.0 / 255.0, "1/255")];
    for (name, curves, levels) in
        [("largest error, linear", errors, limit.as_slice()), ("time, in plain copies", times, &[])]
    {
        let values = curves.iter().flat_map(|curve| &curve.points);
        let values = values.map(|point| point.1);
        let y = Scale::over(values.chain(levels.iter().map(|level| level.0)));
        let area = Area { left: LEFT, top: top + 10.0, right: WIDTH - names, bottom: top + 370.0 };
        let panel = Panel::new(area, x, y);
        panel.grid(&mut svg, &x.ticks(), true);
        panel.name_y(&mut svg, name);
        for (value, name) in levels {
            panel.across(&mut svg, *value, name, "start");
        }
        panel.curves(&mut svg, &curves);
        panel.name_x(&mut svg, "σ of the profile's red on the screen, px");
        top = area.bottom + 46.0;
    }
    Some(finish(svg, top, title, caption))
}

/// Frames a second against the number of heads, as in Li & Shao's Fig. 8; `None` without points.
pub fn heads(series: &[Series], caption: &str) -> Option<String> {
    let methods = series.iter().map(|series| method_of(&series.name).0);
    let styles = styles(methods);
    let curves: Vec<Curve> = series
        .iter()
        .filter_map(|series| {
            let (method, setting) = method_of(&series.name);
            let style = styles.iter().find(|style| style.method == method)?;
            let measured = series.extrapolated_from.unwrap_or(series.points.len());
            let is_drawn = |(x, y): (f64, f64)| x.is_finite() && y.is_finite();
            let points = series.points.iter().copied();
            Some(Curve {
                name: style.name(setting),
                style,
                dashes: "",
                measured: points.clone().take(measured).filter(|&p| is_drawn(p)).count(),
                points: points.filter(|&p| is_drawn(p)).collect(),
            })
        })
        .filter(|curve| !curve.points.is_empty())
        .collect();
    if curves.is_empty() {
        return None;
    }
    let title = "Many heads";
    let mut svg = Svg::default();
    let top =
        heading(&mut svg, title, "Frames a second against heads in view, as in Li & Shao 2015, Fig. 8.");
    let area =
        Area { left: LEFT, top: top + 10.0, right: WIDTH - names_width(&curves), bottom: top + 420.0 };
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let x = Scale::over(points().map(|point| point.0));
    let y = Scale::over(points().map(|point| point.1));
    let panel = Panel::new(area, x, y);
    // Heads come in whole numbers: a tick for each that was drawn.
    let mut counts: Vec<f64> = points().map(|point| point.0).collect();
    counts.sort_by(f64::total_cmp);
    counts.dedup();
    let ticks: Vec<Tick> =
        counts.into_iter().map(|value| Tick { value, label: Some(value.to_string()) }).collect();
    panel.grid(&mut svg, &ticks, true);
    panel.name_x(&mut svg, "number of heads");
    panel.name_y(&mut svg, "frames a second");
    panel.curves(&mut svg, &curves);
    Some(finish(svg, area.bottom + 48.0, title, caption))
}

/// A series' name apart: method and setting.
fn method_of(name: &str) -> (&str, &str) {
    name.split_once(' ').unwrap_or((name, ""))
}

/// Width of the red light's profile: the square root of its mean variance.
fn red_sigma_mm() -> f64 {
    let gaussians = Profile::SKIN.gaussians().iter();
    let variance: f32 = gaussians.map(|g| g.weight[0] * g.variance_mm2).sum();
    f64::from(variance).sqrt()
}

/// A curve for each method and setting that has figures, by x.
fn curves<'a>(
    rows: &[&Row],
    styles: &'a [Style],
    point: impl Fn(&Row) -> Option<(f64, f64)>,
) -> Vec<Curve<'a>> {
    const DASHES: [&str; 4] = ["", "7 3", "2 3", "9 3 2 3"];
    let mut curves = Vec::new();
    for style in styles {
        let of_method = rows.iter().filter(|row| row.method == style.method);
        let settings = distinct(of_method.map(|row| row.setting.as_str()));
        for (setting, dashes) in settings.into_iter().zip(DASHES.into_iter().cycle()) {
            let mut points: Vec<(f64, f64)> = rows
                .iter()
                .filter(|row| row.method == style.method && row.setting == setting)
                .filter_map(|row| point(row))
                .filter(|(x, y)| x.is_finite() && y.is_finite())
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            if !points.is_empty() {
                curves.push(Curve {
                    name: style.name(setting),
                    style,
                    dashes,
                    measured: points.len(),
                    points,
                });
            }
        }
    }
    curves
}

/// What the names of curves need to the right of a panel.
fn names_width(curves: &[Curve]) -> f64 {
    let widths = curves.iter().map(|curve| text_width(&curve.name, LEGEND));
    // However long a name is, most of the drawing is the panel's.
    LEADER + widths.fold(0.0, f64::max).min(0.35 * WIDTH) + RIGHT
}

/// The title, with what is drawn below it; returns where that ends.
fn heading(svg: &mut Svg, title: &str, meaning: &str) -> f64 {
    svg.text([20.0, 34.0], title, TITLE);
    svg.text([20.0, 55.0], meaning, Type::new(DIM, 13.0));
    66.0
}

/// What the points stand for, in columns; returns where that ends.
fn legend(svg: &mut Svg, styles: &[Style], top: f64) -> f64 {
    let methods = styles
        .iter()
        .filter(|style| ![NONE, COPY].contains(&style.method))
        .map(|style| (style.title, Some(style)));
    let entries: Vec<_> = methods.chain([("Pareto front", None)]).collect();
    let widths = entries.iter().map(|(name, _)| text_width(name, LEGEND));
    let width = 36.0 + widths.fold(0.0, f64::max);
    let columns = ((WIDTH - 2.0 * RIGHT) / width).floor().max(1.0) as usize;
    for (i, (name, style)) in entries.iter().enumerate() {
        let x = RIGHT + 6.0 + width * (i % columns) as f64;
        let y = top + 18.0 + 21.0 * (i / columns) as f64;
        match style {
            Some(style) => svg.marker([x, y - 4.0], style.marker, style.color, false),
            None => svg.line(&[[x - 6.0, y - 4.0], [x + 6.0, y - 4.0]], FRONT),
        }
        svg.text([x + 12.0, y], name, LEGEND);
    }
    top + 11.0 + 21.0 * entries.len().div_ceil(columns) as f64
}

/// The drawing with its caption below `top`.
fn finish(mut svg: Svg, top: f64, title: &str, caption: &str) -> String {
    let mut y = top + 14.0;
    for paragraph in caption.lines() {
        let code = paragraph.strip_prefix('`').and_then(|rest| rest.strip_suffix('`'));
        let set = Type { code: code.is_some(), ..SMALL };
        let mut line = String::new();
        for word in code.unwrap_or(paragraph).split_whitespace() {
            let longer = format!("{line} {word}");
            if text_width(&longer, set) > WIDTH - 2.0 * RIGHT && !line.is_empty() {
                svg.text([RIGHT, y], &line, set);
                y += 16.0;
                line = word.into();
            } else {
                line = longer.trim_start().into();
            }
        }
        svg.text([RIGHT, y], &line, set);
        y += 16.0;
    }
    svg.finish(WIDTH, y + 4.0, title)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_profile_is_as_wide_as_the_papers_say() {
        assert!((red_sigma_mm() - 1.176).abs() < 5e-4);
    }

    #[test]
    fn a_long_caption_is_broken_and_a_command_is_set_as_code() {
        let caption = format!("{}\n`cargo run -- --size 1x1`", "many words ".repeat(40));
        let svg = finish(Svg::default(), 0.0, "", &caption);
        assert_eq!(svg.matches("<text").count(), 5, "{svg}");
        assert_eq!(svg.matches("many").count(), 40);
        assert!(svg.contains("monospace\">cargo run -- --size 1x1<"));
    }
}
