//! The table of cases against methods, on one page.

use crate::stability::case::{Group, INPUT, Judged, METHODS, Verdict, short};
use crate::svg::{Stroke, Svg, Type};

const ROW: f64 = 17.0;
const NAME: f64 = 250.0;
const COLUMN: f64 = 74.0;
const HEAD: f64 = 46.0;
const MARGIN: f64 = 12.0;

impl Verdict {
    pub fn word(self) -> &'static str {
        match self {
            Self::Passes => "passes",
            Self::Degraded => "degraded",
            Self::Fails => "fails",
        }
    }

    /// Green, yellow and red that the colour-blind can tell apart, after Okabe & Ito; light, to be
    /// written on.
    fn color(self) -> &'static str {
        match self {
            Self::Passes => "#a6dcc9",
            Self::Degraded => "#f5e39b",
            Self::Fails => "#eda48a",
        }
    }
}

/// As SVG.
pub fn table(judged: &[Judged], caption: &str) -> String {
    let mut svg = Svg::default();
    let column = |i: usize| MARGIN + NAME + COLUMN * i as f64;
    for (i, method) in METHODS.iter().enumerate() {
        let x = column(i) + COLUMN / 2.0;
        for (line, word) in method.splitn(2, '_').enumerate() {
            let set = Type::new("#222", 11.5).anchored("middle");
            svg.text([x, MARGIN + 14.0 + 14.0 * line as f64], word, set);
        }
    }
    let mut y = MARGIN + HEAD;
    for group in Group::ALL {
        let rows: Vec<&Judged> = judged.iter().filter(|j| j.case.group == group).collect();
        if rows.is_empty() {
            continue;
        }
        svg.text([MARGIN, y + 4.0], group.title(), Type::new("#222", 13.0));
        y += 10.0;
        for row in rows {
            svg.text(
                [MARGIN + 8.0, y + 12.5],
                &row.case.name,
                Type::new("#333", 11.5),
            );
            // What is read before any method runs stands for all of them.
            let input = row
                .figure(INPUT)
                .map(|figure| (INPUT, 0..METHODS.len(), figure));
            let methods = METHODS.iter().enumerate().filter_map(|(i, method)| {
                row.figure(method).map(|figure| (*method, i..i + 1, figure))
            });
            for (method, columns, figure) in methods.chain(input) {
                let verdict = row.case.verdict(figure);
                let (left, right) = (column(columns.start) + 1.0, column(columns.end) - 1.0);
                let middle = y + ROW / 2.0;
                let line = Stroke::new(verdict.color(), ROW - 2.0);
                svg.line(&[[left, middle], [right, middle]], line);
                let known = row
                    .case
                    .known
                    .iter()
                    .any(|k| k.method == method && k.by_nature);
                let text = format!("{}{}", short(figure), if known { " *" } else { "" });
                let set = Type::new("#222", 11.0).anchored("middle");
                svg.text([(left + right) / 2.0, y + 12.5], &text, set);
            }
            y += ROW;
        }
        y += 20.0;
    }
    for line in caption.lines() {
        svg.text([MARGIN, y + 6.0], line, Type::new("#666", 10.5));
        y += 14.0;
    }
    let width = column(METHODS.len()) + MARGIN;
    svg.finish(width, y + MARGIN, "cases against methods")
}
