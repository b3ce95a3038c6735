//! The charts, as drawings.

use serde::Serialize;
use subsurface::Profile;

use crate::label::{Area, beside, spread};
use crate::row::Row;
use crate::scale::{Scale, Tick};
use crate::style::{COPY, NONE, Style, styles};
use crate::svg::{Point, Stroke, Svg, Type, text_width};

/// Frames a second against the number of heads.
#[derive(Clone, Debug, Serialize)]
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

const INK: &str = "#222";
const DIM: &str = "#4a4a4a";
const TEXT: Type = Type {
    size: 13.0,
    color: INK,
    anchor: "start",
    upwards: false,
    code: false,
};
const TITLE: Type = Type { size: 19.0, ..TEXT };
const SMALL: Type = Type {
    size: 11.5,
    color: DIM,
    ..TEXT
};
const GRID: Stroke = Stroke {
    color: "#d9d9d9",
    width: 1.0,
    dashes: "",
};
const MINOR: Stroke = Stroke {
    color: "#f0f0f0",
    ..GRID
};
const REFERENCE: Stroke = Stroke {
    color: "#777",
    width: 1.2,
    dashes: "",
};

/// Width of every drawing, and the margins to the left and right of it.
const WIDTH: f64 = 960.0;
const LEFT: f64 = 72.0;
const RIGHT: f64 = 20.0;
/// From the end of a panel to the names of its curves.
const LEADER: f64 = 24.0;

/// Error against time, a panel for each scene that has figures; `None` where no scene has.
pub fn error_time(rows: &[Row], measure: &Measure, caption: &str) -> Option<String> {
    // An error in percent, where there is one.
    let error = |row: &Row| {
        (measure.value)(row)
            .filter(|error| error.is_finite() && row.ms.is_finite())
            .map(|error| 100.0 * error)
    };
    let mut scenes: Vec<&str> = Vec::new();
    for row in rows.iter().filter(|row| error(row).is_some()) {
        if !scenes.contains(&row.scene.as_str()) {
            scenes.push(&row.scene);
        }
    }
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
        let area = Area {
            left,
            top: panel_top,
            right: left + width,
            bottom: panel_top + height,
        };
        let panel = Panel {
            area,
            x: x.between(area.left, area.right),
            y: y.between(area.bottom, area.top),
        };
        let of_scene: Vec<&Row> = rows
            .iter()
            .copied()
            .filter(|row| row.scene == *scene)
            .collect();
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
        curves(&edges, &styles, |row| {
            Some((sigma_mm * row.px_per_mm, value(row)?))
        })
    };
    let errors = against_width(|row| row.max_error_visible);
    let times = against_width(|row| Some(row.x_copy));
    let names = names_width(&errors).max(names_width(&times));
    let limit = [(1.0 / 255.0, "1/255")];
    for (name, curves, levels) in [
        ("largest error, linear", errors, limit.as_slice()),
        ("time, in plain copies", times, &[]),
    ] {
        let values = curves.iter().flat_map(|curve| &curve.points);
        let values = values.map(|point| point.1);
        let y = Scale::over(values.chain(levels.iter().map(|level| level.0)));
        let area = Area {
            left: LEFT,
            top: top + 10.0,
            right: WIDTH - names,
            bottom: top + 370.0,
        };
        let panel = Panel {
            area,
            x: x.between(area.left, area.right),
            y: y.between(area.bottom, area.top),
        };
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
                measured: points
                    .clone()
                    .take(measured)
                    .filter(|&p| is_drawn(p))
                    .count(),
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
    let top = heading(
        &mut svg,
        title,
        "Frames a second against heads in view, as in Li & Shao 2015, Fig. 8.",
    );
    let area = Area {
        left: LEFT,
        top: top + 10.0,
        right: WIDTH - names_width(&curves),
        bottom: top + 420.0,
    };
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let x = Scale::over(points().map(|point| point.0));
    let y = Scale::over(points().map(|point| point.1));
    let panel = Panel {
        area,
        x: x.between(area.left, area.right),
        y: y.between(area.bottom, area.top),
    };
    // Heads come in whole numbers: a tick for each that was drawn.
    let mut counts: Vec<f64> = points().map(|point| point.0).collect();
    counts.sort_by(f64::total_cmp);
    counts.dedup();
    let ticks: Vec<Tick> = counts
        .into_iter()
        .map(|value| Tick {
            value,
            label: Some(value.to_string()),
        })
        .collect();
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
    let variance: f32 = gaussians.map(|g| g.weight.x * g.variance_mm2).sum();
    f64::from(variance).sqrt()
}

/// A line through the points of a method at a setting.
struct Curve<'a> {
    name: String,
    style: &'a Style<'a>,
    dashes: &'a str,
    points: Vec<(f64, f64)>,
    /// Points before the extrapolated ones.
    measured: usize,
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
        let mut settings: Vec<&str> = Vec::new();
        for row in rows.iter().filter(|row| row.method == style.method) {
            if !settings.contains(&row.setting.as_str()) {
                settings.push(&row.setting);
            }
        }
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

/// The points that no other beats in both figures, from the left.
fn front(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut best = f64::INFINITY;
    points.retain(|&(_, error)| {
        let is_better = error < best;
        best = best.min(error);
        is_better
    });
    points
}

/// A pair of axes and where they are drawn.
struct Panel {
    area: Area,
    x: Scale,
    y: Scale,
}

impl Panel {
    fn place(&self, (x, y): (f64, f64)) -> Point {
        [self.x.place(x), self.y.place(y)]
    }

    fn grid(&self, svg: &mut Svg, x_ticks: &[Tick], is_y_labelled: bool) {
        let Area {
            left,
            top,
            right,
            bottom,
        } = self.area;
        let y_ticks = self.y.ticks();
        // Minor lines lie below major ones.
        for (stroke, is_major) in [(MINOR, false), (GRID, true)] {
            for tick in x_ticks
                .iter()
                .filter(|tick| tick.label.is_some() == is_major)
            {
                let x = self.x.place(tick.value);
                svg.line(&[[x, top], [x, bottom]], stroke);
            }
            for tick in y_ticks
                .iter()
                .filter(|tick| tick.label.is_some() == is_major)
            {
                let y = self.y.place(tick.value);
                svg.line(&[[left, y], [right, y]], stroke);
            }
        }
        let frame = [
            [left, top],
            [right, top],
            [right, bottom],
            [left, bottom],
            [left, top],
        ];
        svg.line(
            &frame,
            Stroke {
                color: "#bbb",
                ..GRID
            },
        );
        for tick in x_ticks {
            let at = [self.x.place(tick.value), bottom + 16.0];
            let set = Type {
                anchor: "middle",
                ..SMALL
            };
            svg.text(at, tick.label.as_deref().unwrap_or_default(), set);
        }
        for tick in y_ticks.iter().filter(|_| is_y_labelled) {
            let at = [left - 6.0, self.y.place(tick.value) + 4.0];
            let set = Type {
                anchor: "end",
                ..SMALL
            };
            svg.text(at, tick.label.as_deref().unwrap_or_default(), set);
        }
    }

    fn name_x(&self, svg: &mut Svg, name: &str) {
        let at = [self.area.centre()[0], self.area.bottom + 35.0];
        svg.text(
            at,
            name,
            Type {
                anchor: "middle",
                ..TEXT
            },
        );
    }

    fn name_y(&self, svg: &mut Svg, name: &str) {
        let at = [self.area.left - 50.0, self.area.centre()[1]];
        svg.text(
            at,
            name,
            Type {
                anchor: "middle",
                upwards: true,
                ..TEXT
            },
        );
    }

    /// The scene, and how large a millimetre is in it.
    fn title(&self, svg: &mut Svg, scene: &str, rows: &[&Row]) {
        let y = self.area.top - 7.0;
        let scene = scene.replace('_', " ");
        svg.text([self.area.left, y], &scene, Type { size: 14.5, ..TEXT });
        if let Some(row) = rows.first() {
            let text = format!("{} px/mm", crate::scale::rounded(row.px_per_mm));
            svg.text(
                [self.area.right, y],
                &text,
                Type {
                    anchor: "end",
                    ..SMALL
                },
            );
        }
    }

    /// A level, named at its left (`start`) or right (`end`).
    fn across(&self, svg: &mut Svg, value: f64, name: &str, anchor: &str) {
        let Area { left, right, .. } = self.area;
        let y = self.y.place(value);
        svg.line(&[[left, y], [right, y]], REFERENCE);
        let x = if anchor == "start" {
            left + 5.0
        } else {
            right - 5.0
        };
        svg.text([x, y - 4.0], name, Type { anchor, ..SMALL });
    }

    /// Rows as points of time and error, with the front that none of them beats.
    fn points(
        &self,
        svg: &mut Svg,
        rows: &[&Row],
        styles: &[Style],
        error: impl Fn(&Row) -> Option<f64>,
    ) {
        let Area {
            top, right, bottom, ..
        } = self.area;
        for row in rows.iter().filter(|row| row.method == COPY) {
            let x = self.x.place(row.ms);
            svg.line(
                &[[x, top], [x, bottom]],
                Stroke {
                    dashes: "3 3",
                    ..REFERENCE
                },
            );
            svg.text([x + 4.0, bottom - 6.0], "copy", SMALL);
        }
        let (levels, measured): (Vec<_>, Vec<_>) = rows
            .iter()
            .filter(|row| row.method != COPY)
            .filter_map(|row| Some((*row, (row.ms, error(row)?))))
            .partition(|(row, _)| row.method == NONE);
        for (_, (_, error)) in &levels {
            self.across(svg, *error, "no scattering", "end");
        }
        let all = levels.iter().chain(&measured).map(|(_, point)| *point);
        let steps = self.steps(&front(all.collect()));
        svg.line(&steps, FRONT);

        let points: Vec<(&Row, &Style, Point)> = measured
            .iter()
            .filter_map(|(row, point)| {
                let style = styles.iter().find(|style| style.method == row.method)?;
                Some((*row, style, self.place(*point)))
            })
            .collect();
        let labels: Vec<_> = points
            .iter()
            .map(|(row, _, place)| (*place, text_width(&row.setting, LABEL), LABEL.size))
            .collect();
        // What labels should not lie on.
        let markers = points
            .iter()
            .map(|(.., place)| Area::around(*place, 11.0, 11.0));
        let front = steps
            .windows(2)
            .map(|step| Area::between(step[0], step[1]).grown(2.0));
        let level = levels.iter().map(|(_, (_, error))| {
            let y = self.y.place(*error);
            Area::between([right - 80.0, y - 14.0], [right, y])
        });
        let drawn: Vec<Area> = markers.chain(front).chain(level).collect();
        let areas = beside(&labels, &drawn, self.area);
        for ((row, style, [x, y]), area) in points.iter().zip(areas) {
            // A line to its point, where the label is not right beside it.
            let near = [
                x.clamp(area.left, area.right),
                y.clamp(area.top, area.bottom),
            ];
            if !row.setting.is_empty() && (near[0] - x).hypot(near[1] - y) > 10.0 {
                svg.line(
                    &[[*x, *y], near],
                    Stroke {
                        color: style.color,
                        width: 0.6,
                        dashes: "",
                    },
                );
            }
            let at = [area.centre()[0], area.centre()[1] + 0.36 * LABEL.size];
            svg.text(
                at,
                &row.setting,
                Type {
                    color: style.color,
                    ..LABEL
                },
            );
        }
        for (_, style, place) in points {
            svg.marker(place, style.marker, style.color, false);
        }
    }

    /// A front as stairs: the error stays until more time makes it less.
    fn steps(&self, front: &[(f64, f64)]) -> Vec<Point> {
        let mut steps: Vec<Point> = Vec::new();
        for &point in front {
            let [x, y] = self.place(point);
            steps.extend(steps.last().map(|last| [x, last[1]]));
            steps.push([x, y]);
        }
        steps.extend(steps.last().map(|last| [self.area.right, last[1]]));
        steps
    }

    /// Curves, each named at its right end.
    fn curves(&self, svg: &mut Svg, curves: &[Curve]) {
        let ends: Vec<f64> = curves
            .iter()
            .filter_map(|curve| curve.points.last())
            .map(|point| self.y.place(point.1))
            .collect();
        let names = spread(&ends, 15.5, self.area.top, self.area.bottom);
        for (curve, name_y) in curves.iter().zip(names) {
            let color = curve.style.color;
            let stroke = Stroke {
                color,
                width: 1.6,
                dashes: curve.dashes,
            };
            let places: Vec<Point> = curve
                .points
                .iter()
                .map(|&point| self.place(point))
                .collect();
            svg.line(&places[..curve.measured], stroke);
            if curve.measured < places.len() {
                let from = curve.measured.saturating_sub(1);
                svg.line(
                    &places[from..],
                    Stroke {
                        dashes: "5 4",
                        ..stroke
                    },
                );
            }
            for (i, &place) in places.iter().enumerate() {
                svg.marker(place, curve.style.marker, color, i >= curve.measured);
            }
            if let Some([x, y]) = places.get(curve.measured) {
                let set = Type {
                    anchor: "middle",
                    ..SMALL
                };
                svg.text([*x, y - 10.0], "extrapolated", set);
            }
            if let Some(&[x, y]) = places.last() {
                let right = self.area.right;
                let leader = [
                    [x + 6.0, y],
                    [right + 8.0, y],
                    [right + LEADER - 4.0, name_y],
                ];
                svg.line(
                    &leader,
                    Stroke {
                        width: 0.7,
                        dashes: "",
                        ..stroke
                    },
                );
                svg.text([right + LEADER, name_y + 4.0], &curve.name, LEGEND);
            }
        }
    }
}

/// What the names of curves need to the right of a panel.
fn names_width(curves: &[Curve]) -> f64 {
    let widths = curves.iter().map(|curve| text_width(&curve.name, LEGEND));
    // However long a name is, most of the drawing is the panel's.
    LEADER + widths.fold(0.0, f64::max).min(0.35 * WIDTH) + RIGHT
}

const FRONT: Stroke = Stroke {
    color: "#999",
    width: 1.6,
    dashes: "",
};
const LABEL: Type = Type {
    size: 11.0,
    color: "#333",
    anchor: "middle",
    upwards: false,
    code: false,
};
const LEGEND: Type = Type { size: 12.0, ..TEXT };

/// The title, with what is drawn below it; returns where that ends.
fn heading(svg: &mut Svg, title: &str, meaning: &str) -> f64 {
    svg.text([20.0, 34.0], title, TITLE);
    svg.text([20.0, 55.0], meaning, Type { color: DIM, ..TEXT });
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
        let code = paragraph
            .strip_prefix('`')
            .and_then(|rest| rest.strip_suffix('`'));
        let set = Type {
            code: code.is_some(),
            ..SMALL
        };
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
    fn no_point_of_the_front_is_beaten() {
        let points = vec![
            (3.0, 1.0),
            (0.0, 9.0),
            (2.0, 4.0),
            (2.0, 3.0),
            (2.5, 3.0),
            (4.0, 2.0),
        ];
        assert_eq!(front(points), [(0.0, 9.0), (2.0, 3.0), (3.0, 1.0)]);
        assert!(front(vec![]).is_empty());
    }

    #[test]
    fn a_long_caption_is_broken_and_a_command_is_set_as_code() {
        let caption = format!("{}\n`cargo run -- --size 1x1`", "many words ".repeat(40));
        let svg = finish(Svg::default(), 0.0, "", &caption);
        assert_eq!(svg.matches("<text").count(), 4, "{svg}");
        assert_eq!(svg.matches("many").count(), 40);
        assert!(svg.contains("monospace\">cargo run -- --size 1x1<"));
    }
}
