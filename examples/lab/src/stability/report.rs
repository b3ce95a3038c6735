//! The atlas as files.

use std::fmt::Write as _;
use std::path::Path;

use crate::Error;
use image::codecs::jpeg::JpegEncoder;

use crate::output;
use crate::stability::case::{Case, Group, INPUT, Judged, METHODS, Verdict, short};
use crate::stability::strip::strip;
use crate::stability::table::table;
use crate::svg::Rasteriser;

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
            let mut told = Told::default();
            for family in rows.chunk_by(|a, b| a.case.what == b.case.what) {
                page += &told.details(family);
            }
        }
        page
    }
}

/// What a picture is worth: where verdicts differ, or ours do not pass.
fn is_shown(judged: &Judged) -> bool {
    judged.outcome.shown.is_some()
        && (judged.rivals_fail_alone() || judged.shortcomings().next().is_some())
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
    let mut text = format!(
        "| | passes | degraded | {} |\n|---|---|---|",
        used.join(" | ")
    );
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
        let Case { name, .. } = &row.case;
        let [passes, degrades] = [row.case.passes, row.case.degrades].map(short);
        let _ = writeln!(text, "| {name} | ≤ {passes} | ≤ {degrades} | {cells} |");
    }
    text
}

/// What has been said of a group, so that it is said once.
#[derive(Default)]
struct Told {
    bounds: Vec<[String; 3]>,
    /// Why a mode does not pass, and of which cases that was said.
    reasons: Vec<(String, String)>,
}

impl Told {
    /// Cases that are described in the same words, together.
    fn details(&mut self, family: &[&Judged]) -> String {
        let names: Vec<&str> = family.iter().map(|j| j.case.name.as_str()).collect();
        let names = names.join("; ");
        let mut text = format!("\n**{names}.** {}", family[0].case.what);
        for Judged { case, .. } in family {
            let bounds = [short(case.passes), short(case.degrades), case.why.clone()];
            if !self.bounds.contains(&bounds) {
                let [passes, degrades, why] = &bounds;
                let _ = write!(text, " Passes to {passes}, degraded to {degrades}: {why}");
                self.bounds.push(bounds);
            }
        }
        text += "\n";
        let mut reasons: Vec<(&str, bool, Vec<&str>)> = Vec::new();
        for known in family.iter().flat_map(|j| j.shortcomings()) {
            let said = reasons
                .iter_mut()
                .find(|(why, nature, _)| *why == known.why && *nature == known.by_nature);
            match said {
                Some((.., methods)) if methods.contains(&known.method) => (),
                Some((.., methods)) => methods.push(known.method),
                None => reasons.push((&known.why, known.by_nature, vec![known.method])),
            }
        }
        for (why, by_nature, methods) in reasons {
            let methods = methods.join("`, `");
            let nature = if by_nature { ", by nature" } else { "" };
            let said = self.reasons.iter().find(|(reason, _)| reason == why);
            let reason = match said {
                Some((_, of)) => format!("as for *{of}*."),
                None => why.to_owned(),
            };
            let _ = writeln!(text, "\n- `{methods}`{nature}: {reason}");
            if said.is_none() {
                self.reasons.push((why.to_owned(), names.clone()));
            }
        }
        for judged in family.iter().filter(|j| is_shown(j)) {
            let name = &judged.case.name;
            if family.len() > 1 {
                let _ = writeln!(text, "\n*{name}:*");
            }
            let picture = picture_name(judged);
            let _ = writeln!(text, "\n![{name}: truth and methods](images/{picture})");
        }
        text
    }
}

const INTRODUCTION: &str = "\
# The failure atlas

![Cases against methods](images/failures.svg)

Written by

    COMMAND

on ADAPTER. The quick form of it runs before every change, and fails where a mode of this crate is worse
than this page says. Which mode and settings a scene needs, [choosing.md](choosing.md) draws from it.

In the tables, figures in *italics* are degraded, those in **bold** fail. Irradiance is linear, and white is 1.
\"The visible integral\" is Eq. 7 over what the camera sees, \"the closed form\" is Eq. 7 solved on paper, both divided by
the kernel's mass. Below each table, cases that differ in a number or two are described together; a reason, for a
threshold or for a mode that does not pass, is given where a group first needs it. In pictures the upper row shows
the truth and the methods, the lower row their errors, ten times as bright.
";
