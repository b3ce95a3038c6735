//! The command line.

use std::path::PathBuf;

use crate::Error;
use crate::filter::read_text;
use subsurface::{DEFAULT_MAX_ERROR, MAX_PROFILES, Profile};

const HELP: &str = "\
Scatters a frame that another program dumped; docs/dumps.md says how to write one.

Usage: cargo run --release --example filter -- CASE_DIR --out FILE.exr [OPTIONS]

  --out FILE.exr        where the scattered irradiance goes
  --profile NAME        skin, or a JSON file; the first is of id 1, the next of id 2       [skin]
  --variance-scale X    multiplies all variances                                           [1]
  --max-error X         largest error of the plan, in units of white                       [1/255]
  --exact               the exact sum instead of a plan
  --png                 writes a picture beside the EXR, too: sRGB, cut off at 1
  --plan                prints the plan
";

/// What is asked for.
#[derive(Debug)]
pub struct Options {
    pub case: PathBuf,
    pub out: PathBuf,
    /// Of the ids from 1 on.
    pub profiles: Vec<Profile>,
    /// None: the exact sum.
    pub max_error: Option<f32>,
    pub png: bool,
    pub plan: bool,
}

impl Options {
    /// The command line; `None` when it asked for help.
    pub fn parse(mut parser: lexopt::Parser) -> Result<Option<Self>, Error> {
        use lexopt::prelude::*;

        let refused = |e: lexopt::Error| {
            let got = format!("\"{e}\"");
            Error::new("command line", got, "options as --help lists them")
        };
        let value = |parser: &mut lexopt::Parser| {
            let value = parser.value().and_then(|v| v.string());
            value.map_err(refused)
        };
        let (mut case, mut out, mut max_error) = (None, None, None);
        let mut profiles = Vec::new();
        let mut variance_scale = 1.0;
        let (mut exact, mut png, mut plan) = (false, false, false);
        while let Some(arg) = parser.next().map_err(refused)? {
            match arg {
                Short('h') | Long("help") => {
                    print!("{HELP}");
                    return Ok(None);
                }
                Long("out") => out = Some(exr_path(value(&mut parser)?)?),
                Long("profile") => profiles.push(profile(&value(&mut parser)?)?),
                Long("variance-scale") => {
                    variance_scale = positive("--variance-scale", &value(&mut parser)?)?;
                }
                Long("max-error") => {
                    max_error = Some(crate::compare::max_error(&value(&mut parser)?)?);
                }
                Long("exact") => exact = true,
                Long("png") => png = true,
                Long("plan") => plan = true,
                Value(path) if case.is_none() => case = Some(PathBuf::from(path)),
                other => return Err(refused(other.unexpected())),
            }
        }
        let missing = |what: &str| {
            let needs = format!("{what}, as --help says");
            Error::new("command line", format!("no {what}"), needs)
        };
        if exact && max_error.is_some() {
            return Err(Error::new("--exact", "--max-error, too", "one of the two"));
        }
        if profiles.len() > MAX_PROFILES {
            let needs = format!("at most {MAX_PROFILES}");
            return Err(Error::new("--profile", profiles.len(), needs));
        }
        if profiles.is_empty() {
            profiles.push(Profile::SKIN);
        }
        for profile in &mut profiles {
            let scaled = profile.scaled(variance_scale.sqrt());
            *profile = scaled.map_err(|e| Error::from(e).within("--variance-scale"))?;
        }
        Ok(Some(Self {
            case: case.ok_or_else(|| missing("CASE_DIR"))?,
            out: out.ok_or_else(|| missing("--out FILE.exr"))?,
            profiles,
            max_error: (!exact).then_some(max_error.unwrap_or(DEFAULT_MAX_ERROR)),
            png,
            plan,
        }))
    }
}

fn exr_path(text: String) -> Result<PathBuf, Error> {
    let path = PathBuf::from(&text);
    match path.extension() {
        Some(extension) if extension.eq_ignore_ascii_case("exr") => Ok(path),
        _ => Err(Error::new("--out", text, "a file that ends in .exr")),
    }
}

fn positive(input: &str, text: &str) -> Result<f32, Error> {
    text.parse()
        .ok()
        .filter(|x: &f32| x.is_finite() && *x > 0.0)
        .ok_or_else(|| Error::new(input, text, "a number above 0 and below 3.4e38"))
}

fn profile(name: &str) -> Result<Profile, Error> {
    if name == "skin" {
        return Ok(Profile::SKIN);
    }
    let text = read_text(name.as_ref()).map_err(|e| e.within("--profile"))?;
    Profile::from_json(&text).map_err(|e| Error::from(e).within(name))
}
