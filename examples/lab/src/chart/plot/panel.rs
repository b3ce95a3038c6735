//! A pair of axes, and what is drawn between them.

use crate::chart::plot::label::{Area, beside, spread};
use crate::chart::plot::scale::{Scale, Tick, rounded};
use crate::chart::plot::style::{COPY, NONE, Style};
use crate::chart::row::Row;
use crate::svg::{Point, Stroke, Svg, Type, text_width};

pub const INK: &str = "#222";
pub const DIM: &str = "#4a4a4a";
pub const TEXT: Type = Type::new(INK, 13.0);
pub const TITLE: Type = Type::new(INK, 19.0);
pub const LEGEND: Type = Type::new(INK, 12.0);
pub const SMALL: Type = Type::new(DIM, 11.5);
const GRID: Stroke = Stroke::new("#d9d9d9", 1.0);
const MINOR: Stroke = Stroke::new("#f0f0f0", 1.0);
pub const FRONT: Stroke = Stroke::new("#999", 1.6);
const REFERENCE: Stroke = Stroke::new("#777", 1.2);

/// Height of the letters of a setting.
const LABEL: f64 = 11.0;
/// From the end of a panel to the names of its curves.
pub const LEADER: f64 = 24.0;

/// A line through the points of a method at a setting.
pub struct Curve<'a> {
    pub name: String,
    pub style: &'a Style<'a>,
    pub dashes: &'a str,
    pub points: Vec<(f64, f64)>,
    /// Points before the extrapolated ones.
    pub measured: usize,
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
pub struct Panel {
    area: Area,
    x: Scale,
    y: Scale,
}

impl Panel {
    pub fn new(area: Area, x: Scale, y: Scale) -> Self {
        Self { area, x: x.between(area.left, area.right), y: y.between(area.bottom, area.top) }
    }

    fn place(&self, (x, y): (f64, f64)) -> Point {
        [self.x.place(x), self.y.place(y)]
    }

    pub fn grid(&self, svg: &mut Svg, x_ticks: &[Tick], is_y_labelled: bool) {
        let Area { left, top, right, bottom } = self.area;
        let y_ticks = self.y.ticks();
        // Minor lines lie below major ones.
        for (stroke, is_major) in [(MINOR, false), (GRID, true)] {
            for tick in x_ticks.iter().filter(|tick| tick.label.is_some() == is_major) {
                let x = self.x.place(tick.value);
                svg.line(&[[x, top], [x, bottom]], stroke);
            }
            for tick in y_ticks.iter().filter(|tick| tick.label.is_some() == is_major) {
                let y = self.y.place(tick.value);
                svg.line(&[[left, y], [right, y]], stroke);
            }
        }
        let frame = [[left, top], [right, top], [right, bottom], [left, bottom], [left, top]];
        svg.line(&frame, Stroke::new("#bbb", 1.0));
        for tick in x_ticks {
            let at = [self.x.place(tick.value), bottom + 16.0];
            let set = SMALL.anchored("middle");
            svg.text(at, tick.label.as_deref().unwrap_or_default(), set);
        }
        for tick in y_ticks.iter().filter(|_| is_y_labelled) {
            let at = [left - 6.0, self.y.place(tick.value) + 4.0];
            let set = SMALL.anchored("end");
            svg.text(at, tick.label.as_deref().unwrap_or_default(), set);
        }
    }

    pub fn name_x(&self, svg: &mut Svg, name: &str) {
        let at = [self.area.centre()[0], self.area.bottom + 35.0];
        svg.text(at, name, TEXT.anchored("middle"));
    }

    pub fn name_y(&self, svg: &mut Svg, name: &str) {
        let at = [self.area.left - 50.0, self.area.centre()[1]];
        svg.text(at, name, Type { anchor: "middle", upwards: true, ..TEXT });
    }

    /// The scene, and how large a millimetre is in it.
    pub fn title(&self, svg: &mut Svg, scene: &str, rows: &[&Row]) {
        let y = self.area.top - 7.0;
        let scene = scene.replace('_', " ");
        svg.text([self.area.left, y], &scene, Type::new(INK, 14.5));
        if let Some(row) = rows.first() {
            let text = format!("{} px/mm", rounded(row.px_per_mm));
            svg.text([self.area.right, y], &text, SMALL.anchored("end"));
        }
    }

    /// A line through points; what is beyond an end of an axis lies on that end.
    pub fn line(&self, svg: &mut Svg, points: &[(f64, f64)], stroke: Stroke) {
        let places: Vec<Point> = points.iter().map(|&point| self.place(point)).collect();
        svg.line(&places, stroke);
    }

    /// A level, named at its left (`start`) or right (`end`).
    pub fn across(&self, svg: &mut Svg, value: f64, name: &str, anchor: &str) {
        let Area { left, right, .. } = self.area;
        let y = self.y.place(value);
        svg.line(&[[left, y], [right, y]], REFERENCE);
        let x = if anchor == "start" { left + 5.0 } else { right - 5.0 };
        svg.text([x, y - 4.0], name, SMALL.anchored(anchor));
    }

    /// Rows as points of time and error, with the front that none of them beats.
    pub fn points(
        &self,
        svg: &mut Svg,
        rows: &[&Row],
        styles: &[Style],
        error: impl Fn(&Row) -> Option<f64>,
    ) {
        let Area { top, right, bottom, .. } = self.area;
        for row in rows.iter().filter(|row| row.method == COPY) {
            let x = self.x.place(row.ms);
            svg.line(&[[x, top], [x, bottom]], REFERENCE.dashed("3 3"));
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
            .map(|(row, _, place)| (*place, text_width(&row.setting, Type::new(INK, LABEL)), LABEL))
            .collect();
        // What labels should not lie on.
        let markers = points.iter().map(|(.., place)| Area::around(*place, 11.0, 11.0));
        let front = steps.windows(2).map(|step| Area::between(step[0], step[1]).grown(2.0));
        let level = levels.iter().map(|(_, (_, error))| {
            let y = self.y.place(*error);
            Area::between([right - 80.0, y - 14.0], [right, y])
        });
        let drawn: Vec<Area> = markers.chain(front).chain(level).collect();
        let areas = beside(&labels, &drawn, self.area);
        for ((row, style, [x, y]), area) in points.iter().zip(areas) {
            // A line to its point, where the label is not right beside it.
            let near = [x.clamp(area.left, area.right), y.clamp(area.top, area.bottom)];
            if !row.setting.is_empty() && (near[0] - x).hypot(near[1] - y) > 10.0 {
                svg.line(&[[*x, *y], near], Stroke::new(style.color, 0.6));
            }
            let at = [area.centre()[0], area.centre()[1] + 0.36 * LABEL];
            svg.text(at, &row.setting, Type::new(style.color, LABEL).anchored("middle"));
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
    pub fn curves(&self, svg: &mut Svg, curves: &[Curve]) {
        let ends: Vec<f64> = curves
            .iter()
            .filter_map(|curve| curve.points.last())
            .map(|point| self.y.place(point.1))
            .collect();
        let names = spread(&ends, 15.5, self.area.top, self.area.bottom);
        for (curve, name_y) in curves.iter().zip(names) {
            let color = curve.style.color;
            let stroke = Stroke::new(color, 1.6).dashed(curve.dashes);
            let places: Vec<Point> = curve.points.iter().map(|&point| self.place(point)).collect();
            svg.line(&places[..curve.measured], stroke);
            if curve.measured < places.len() {
                let from = curve.measured.saturating_sub(1);
                svg.line(&places[from..], stroke.dashed("5 4"));
            }
            for (i, &place) in places.iter().enumerate() {
                svg.marker(place, curve.style.marker, color, i >= curve.measured);
            }
            if let Some([x, y]) = places.get(curve.measured) {
                let set = SMALL.anchored("middle");
                svg.text([*x, y - 10.0], "extrapolated", set);
            }
            if let Some(&[x, y]) = places.last() {
                let right = self.area.right;
                let leader = [[x + 6.0, y], [right + 8.0, y], [right + LEADER - 4.0, name_y]];
                svg.line(&leader, Stroke::new(color, 0.7));
                svg.text([right + LEADER, name_y + 4.0], &curve.name, LEGEND);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_point_of_the_front_is_beaten() {
        let points = vec![(3.0, 1.0), (0.0, 9.0), (2.0, 4.0), (2.0, 3.0), (2.5, 3.0), (4.0, 2.0)];
        assert_eq!(front(points), [(0.0, 9.0), (2.0, 3.0), (3.0, 1.0)]);
        assert!(front(vec![]).is_empty());
    }
}
