//! The command line.

use std::path::PathBuf;

use crate::Error;
use crate::cli::Arguments;
use crate::filter::read_text;
use subsurface::{DEFAULT_MAX_ERROR, MAX_PROFILES, Profile};

pub const HELP: &str = "\
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
    /// # Errors
    /// An option that is not known, or a value that does not fit.
    pub fn parse(arguments: &mut Arguments) -> Result<Self, Error> {
        let (mut case, mut out, mut max_error) = (None, None, None);
        let mut profiles = Vec::new();
        let mut variance_scale = 1.0;
        let (mut exact, mut png, mut plan) = (false, false, false);
        while let Some(name) = arguments.next_word()? {
            match name.as_str() {
                "--out" => {
                    let exr = |text: &str| {
                        let path = PathBuf::from(text);
                        path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")).then_some(path)
                    };
                    out = Some(arguments.value_by("a file that ends in .exr", exr)?);
                }
                "--profile" => profiles.push(profile(&arguments.value()?)?),
                "--variance-scale" => variance_scale = arguments.positive()?,
                "--max-error" => max_error = Some(arguments.max_error()?),
                "--exact" => exact = true,
                "--png" => png = true,
                "--plan" => plan = true,
                _ if case.is_none() && !name.starts_with('-') => case = Some(PathBuf::from(name)),
                _ => return Err(arguments.unknown()),
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
        Ok(Self {
            case: case.ok_or_else(|| missing("CASE_DIR"))?,
            out: out.ok_or_else(|| missing("--out FILE.exr"))?,
            profiles,
            max_error: (!exact).then_some(max_error.unwrap_or(DEFAULT_MAX_ERROR)),
            png,
            plan,
        })
    }
}

fn profile(name: &str) -> Result<Profile, Error> {
    if name == "skin" {
        return Ok(Profile::SKIN);
    }
    let text = read_text(name.as_ref()).map_err(|e| e.within("--profile"))?;
    Profile::from_json(&text).map_err(|e| Error::from(e).within(name))
}
