//! The atlas as files.

use std::fmt::Write as _;
use std::path::Path;

use image::codecs::jpeg::JpegEncoder;

use crate::Error;
use crate::output;
use crate::stability::case::{
    ATLAS, Bound, Case, EXACT, GROUPS, INPUT, Judged, Known, METHODS, PLAN, Verdict, short,
};
use crate::stability::strip::strip;
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
        let rasteriser = Rasteriser::new();
        let mut images = Vec::new();
        for judged in self.judged.iter().filter(|j| j.is_shown()) {
            if let Some(picture) = strip(judged, &rasteriser)? {
                let mut jpeg = Vec::new();
                let made = JpegEncoder::new_with_quality(&mut jpeg, 80).encode_image(&picture);
                made.map_err(|e| Error::new(picture_name(judged), e, "a picture that can be encoded"))?;
                images.push((picture_name(judged), jpeg));
            }
        }
        let unwritable = |e| Error::new("--out", format!("\"{e}\""), "a directory to write to");
        output::write(&out.join("images"), &images).map_err(unwritable)?;
        let page = self.page().into_bytes();
        output::write(out, &[("failures.md".to_owned(), page)]).map_err(unwritable)
    }

    fn page(&self) -> String {
        let options = match self.command {
            "" => String::new(),
            options => format!(" -- {options}"),
        };
        let mut page = INTRODUCTION.replace("OPTIONS", &options).replace("ADAPTER", self.adapter);
        for group in GROUPS {
            let rows: Vec<&Judged> = self.judged.iter().filter(|j| j.case.group == group).collect();
            if rows.is_empty() {
                continue;
            }
            let _ = write!(page, "\n## {}{}\n\n", group[..1].to_uppercase(), &group[1..]);
            page += &table(&rows);
            for family in rows.chunk_by(|a, b| a.case.what == b.case.what) {
                let names: Vec<&str> = family.iter().map(|j| j.case.name.as_str()).collect();
                let names = match names[..] {
                    [first, _, .., last] => format!("{first} to {last}"),
                    _ => names.join("; "),
                };
                page += &wrapped(&format!("**{names}.** {}", family[0].case.what));
                for judged in family.iter().filter(|j| j.is_shown()) {
                    let (name, picture) = (&judged.case.name, picture_name(judged));
                    let _ = write!(page, "\n![{name}: truth and methods](images/{picture})\n");
                }
            }
            page += &reasons(&rows);
        }
        page
    }
}

fn picture_name(judged: &Judged) -> String {
    let title = judged.case.title();
    let words = title.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
    format!("failures-{}.jpg", words.collect::<Vec<_>>().join("-"))
}

/// A method, in the head of a table.
fn label(method: &str) -> &str {
    match method {
        EXACT => "exact",
        PLAN => "plan",
        ATLAS => "texture space",
        "jimenez_2009" => "Jimenez 2009",
        "jimenez_separable" => "separable",
        "fitted_separable" => "fitted",
        "burley_disk" => "Burley",
        "texture_cascade" => "cascade",
        "jimenez_2010" => "+ 2010",
        "jimenez_2010_derived" => "+ derived",
        "burley_2015" => "+ Burley",
        other => other,
    }
}

fn table(rows: &[&Judged]) -> String {
    let mut used: Vec<&str> = METHODS.into_iter().chain([INPUT]).collect();
    used.retain(|m| rows.iter().any(|row| row.figure(m).is_some()));
    let labels: Vec<&str> = used.iter().map(|method| label(method)).collect();
    let mut text = format!("||passes/degraded|{}|\n|---|---|", labels.join("|"));
    text += &"---|".repeat(used.len());
    for Judged { case, outcome, .. } in rows {
        let [passes, degrades] = [case.bound.passes, case.bound.degrades].map(short);
        let _ = write!(text, "\n|{}|{passes}/{degrades}|", case.name);
        for method in &used {
            let figure = outcome.figures.iter().find(|(m, _)| m == method);
            let cell = figure.map_or(String::new(), |(_, figure)| match case.verdict(*figure) {
                Verdict::Passes => short(*figure),
                Verdict::Degraded => format!("*{}*", short(*figure)),
                Verdict::Fails => format!("**{}**", short(*figure)),
            });
            let _ = write!(text, "{cell}|");
        }
    }
    text + "\n"
}

/// Why thresholds are where they are, and why ours does not pass: each reason once.
fn reasons(rows: &[&Judged]) -> String {
    let mut bounds: Vec<Bound> = Vec::new();
    // With the methods and the cases that each is of.
    let mut reasons: Vec<(Known, Vec<String>, Vec<&str>)> = Vec::new();
    for judged in rows {
        let Case { bound, name, .. } = &judged.case;
        if !bounds.contains(bound) {
            bounds.push(*bound);
        }
        for known in judged.shortcomings() {
            let method = format!("`{}`", known.method);
            match reasons.iter_mut().find(|(of, ..)| of.why == known.why) {
                Some((_, methods, names)) => {
                    methods.extend((!methods.contains(&method)).then_some(method));
                    names.extend((!names.contains(&name.as_str())).then_some(name.as_str()));
                }
                None => reasons.push((*known, vec![method], vec![name])),
            }
        }
    }
    let mut text = String::new();
    for Bound { passes, degrades, why } in bounds {
        text += &wrapped(&format!("- ≤ {}, ≤ {}: {why}", short(passes), short(degrades)));
    }
    for (Known { by_nature, why, .. }, methods, names) in reasons {
        let nature = if by_nature { ", by nature" } else { "" };
        let (methods, names) = (methods.join(", "), names.join("; "));
        text += &wrapped(&format!("- {methods}{nature} ({names}): {why}"));
    }
    text
}

/// A paragraph, in lines of less than 110 columns.
fn wrapped(text: &str) -> String {
    let mut lines = String::new();
    let mut column = 0;
    for word in text.split(' ') {
        let length = word.chars().count() + 1;
        column = if column + length < 110 { column + length } else { length };
        lines += if column == length { "\n" } else { " " };
        lines += word;
    }
    lines + "\n"
}

const INTRODUCTION: &str = "\
# The failure atlas

Written by

    cargo run --release --example stabilityOPTIONS

on ADAPTER.

The quick form of it runs before every change, and fails where a method of this crate is worse than this page
says. Which plan and settings a scene needs, [choosing.md](choosing.md) draws from it.

In the tables, figures in *italics* are degraded, those in **bold** fail. Irradiance is linear, and white is
1. \"The visible integral\" is Eq. 7 over what the camera sees, \"the closed form\" is Eq. 7 solved on paper,
both divided by the kernel's mass. `screen_exact` is the exact sum, `screen_planned` a plan for an error of
1/255. Below each table: what the cases are, why the thresholds are where they are, and why a method of ours
does not pass. In pictures the upper row shows the truth and the methods, the lower row their errors, ten
times as bright.
";
