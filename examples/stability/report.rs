//! The atlas as files.

use std::fmt::Write as _;
use std::path::Path;

use image::codecs::jpeg::JpegEncoder;
use subsurface::Error;

use crate::case::{Group, INPUT, Judged, METHODS, Verdict, short};
use crate::output;
use crate::strip::strip;
use crate::svg::Rasteriser;
use crate::table::table;

pub struct Report<'a> {
    pub judged: &'a [Judged],
    pub adapter: &'a str,
    /// Options that it was run with.
    pub command: &'a str,
}

impl Report<'_> {
    /// Pictures first, then the page that shows them.
    ///
    /// # Errors
    /// A picture that cannot be made, a directory that cannot be written to.
    pub fn write(&self, out: &Path) -> Result<(), Error> {
        let failed = |e: &dyn std::fmt::Display| {
            Error::new("the atlas", format!("\"{e}\""), "files that can be made")
        };
        let rasteriser = Rasteriser::new();
        let drawing = table(self.judged, &self.caption());
        let drawn = rasteriser.picture(&drawing).map_err(|e| failed(&e))?;
        let mut images = vec![
            ("failures.svg".to_owned(), drawing.into_bytes()),
            (
                "failures.png".to_owned(),
                output::png(&drawn).map_err(|e| failed(&e))?,
            ),
        ];
        for judged in self.judged.iter().filter(|j| is_shown(j)) {
            if let Some(picture) = strip(judged, &rasteriser)? {
                let mut jpeg = Vec::new();
                JpegEncoder::new_with_quality(&mut jpeg, 85)
                    .encode_image(&picture)
                    .map_err(|e| failed(&e))?;
                images.push((picture_name(judged), jpeg));
            }
        }
        let unwritable =
            |e: std::io::Error| Error::new("--out", format!("\"{e}\""), "a directory to write to");
        output::write(&out.join("images"), &images).map_err(unwritable)?;
        let page = self.page().into_bytes();
        output::write(out, &[("failures.md".to_owned(), page)]).map_err(unwritable)
    }

    fn caption(&self) -> String {
        format!(
            "Green passes, yellow is degraded, red fails; * by nature. What the figures are of, and why the \
             thresholds are where they are: docs/failures.md.\n{}; {}",
            self.adapter,
            self.run_by()
        )
    }

    fn run_by(&self) -> String {
        let options = match self.command {
            "" => String::new(),
            options => format!(" -- {options}"),
        };
        format!("cargo run --release --example stability{options}")
    }

    fn page(&self) -> String {
        let mut page = String::new();
        let text = INTRODUCTION
            .replace("COMMAND", &self.run_by())
            .replace("ADAPTER", self.adapter);
        page += &text;
        for group in Group::ALL {
            let rows: Vec<&Judged> = self
                .judged
                .iter()
                .filter(|j| j.case.group == group)
                .collect();
            if rows.is_empty() {
                continue;
            }
            let title = group.title();
            let _ = writeln!(page, "\n## {}{}\n", title[..1].to_uppercase(), &title[1..]);
            page += &rows_of(&rows);
            for judged in rows {
                page += &details(judged);
            }
        }
        page
    }
}

/// What a picture is worth: where verdicts differ, or ours do not pass.
fn is_shown(judged: &Judged) -> bool {
    judged.rivals_fail_alone() || !judged.case.known.is_empty()
}

fn picture_name(judged: &Judged) -> String {
    let words = judged
        .case
        .title()
        .replace(|c: char| !c.is_alphanumeric(), "-");
    let words: Vec<&str> = words.split('-').filter(|w| !w.is_empty()).collect();
    format!("failures-{}.jpg", words.join("-"))
}

fn rows_of(rows: &[&Judged]) -> String {
    let used: Vec<&str> = METHODS
        .into_iter()
        .chain([INPUT])
        .filter(|m| rows.iter().any(|row| row.figure(m).is_some()))
        .collect();
    let mut text = format!("| | passes | {} |\n|---|---|", used.join(" | "));
    text += &"---|".repeat(used.len());
    text += "\n";
    for row in rows {
        let cells = used.iter().map(|method| match row.figure(method) {
            None => String::new(),
            Some(figure) => match row.case.verdict(figure) {
                Verdict::Passes => short(figure),
                Verdict::Degraded => format!("*{}*", short(figure)),
                Verdict::Fails => format!("**{}**", short(figure)),
            },
        });
        let cells = cells.collect::<Vec<_>>().join(" | ");
        let passes = short(row.case.passes);
        let _ = writeln!(text, "| {} | ≤ {passes} | {cells} |", row.case.name);
    }
    text
}

fn details(judged: &Judged) -> String {
    let case = &judged.case;
    let mut text = format!("\n**{}.** {}", case.name, case.what);
    let _ = writeln!(
        text,
        " Passes at {}, degraded up to {}. {}",
        short(case.passes),
        short(case.degrades),
        case.why
    );
    for known in &case.known {
        let nature = if known.by_nature { ", by nature" } else { "" };
        let _ = writeln!(text, "\n- `{}`{nature}: {}", known.method, known.why);
    }
    if is_shown(judged) && judged.outcome.shown.is_some() {
        let _ = writeln!(
            text,
            "\n![{}: truth and methods](images/{})",
            case.name,
            picture_name(judged)
        );
    }
    text
}

const INTRODUCTION: &str = "\
# The failure atlas

![Cases against methods](images/failures.png)

Written by

    COMMAND

on ADAPTER. The quick form of it runs before every change, and fails where a mode of this crate is worse
than this page says. Which mode and settings a scene needs, [choosing.md](choosing.md) draws from it.

In the tables, figures in *italics* are degraded, in **bold** fail. Irradiance is linear, white is 1.
";
