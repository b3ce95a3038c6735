//! The command line.

use std::path::PathBuf;

use crate::Error;
use subsurface::{DEFAULT_MAX_ERROR, Gaussian, MAX_PROFILES, Profile};

const HELP: &str = "\
Scatters a frame that another program dumped; docs/dumps.md says how to write one.

Usage: cargo run --release --example filter -- CASE_DIR --out FILE.exr [OPTIONS]

  --out FILE.exr        where the scattered irradiance goes
  --profile NAME        skin, or a diffusion profile in JSON; given again, of the next id  [skin]
  --variance-scale X    multiplies all variances                                           [1]
  --max-error X         that is accepted, in units of white                                [1/255]
  --exact               the exact effect, whatever it takes
  --png                 a tone-mapped picture beside the EXR, too
  --plan                prints what is done at every scale
";

/// What is asked for.
#[derive(Debug)]
pub struct Options {
    pub case: PathBuf,
    pub out: PathBuf,
    /// Of the ids, from 1 on.
    pub profiles: Vec<Profile>,
    /// None: the exact effect.
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
        let (mut case, mut out) = (None, None);
        let mut profiles = Vec::new();
        let mut variance_scale = 1.0;
        let mut max_error = None;
        let (mut exact, mut png, mut plan) = (false, false, false);
        while let Some(arg) = parser.next().map_err(refused)? {
            let name = match arg {
                Long(name) => name.to_string(),
                Short('h') => "help".into(),
                Value(path) if case.is_none() => {
                    case = Some(PathBuf::from(path));
                    continue;
                }
                other => return Err(refused(other.unexpected())),
            };
            let mut text = || parser.value().and_then(|v| v.string()).map_err(refused);
            match name.as_str() {
                "help" => {
                    print!("{HELP}");
                    return Ok(None);
                }
                "out" => out = Some(exr_path(text()?)?),
                "profile" => profiles.push(profile(&text()?)?),
                "variance-scale" => variance_scale = positive("--variance-scale", &text()?)?,
                "max-error" => max_error = Some(positive("--max-error", &text()?)?),
                "exact" => exact = true,
                "png" => png = true,
                "plan" => plan = true,
                _ => return Err(refused(Long(name.as_str()).unexpected())),
            }
        }
        let missing = |what: &str| {
            let needs = format!("{what}, as --help says");
            Error::new("command line", format!("no {what}"), needs)
        };
        if exact && max_error.is_some() {
            let needs = "either; the exact effect asks for no error";
            return Err(Error::new("--exact", "--max-error, too", needs));
        }
        if profiles.len() > MAX_PROFILES {
            let got = format!("{} of them", profiles.len());
            return Err(Error::new(
                "--profile",
                got,
                format!("at most {MAX_PROFILES}"),
            ));
        }
        if profiles.is_empty() {
            profiles.push(Profile::SKIN);
        }
        for profile in &mut profiles {
            *profile = scaled(profile, variance_scale)?;
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
        .ok_or_else(|| Error::new(input, text, "a number above 0"))
}

fn profile(name: &str) -> Result<Profile, Error> {
    if name == "skin" {
        return Ok(Profile::SKIN);
    }
    let text = std::fs::read_to_string(name)
        .map_err(|e| Error::new(name, format!("\"{e}\""), "skin, or a file that can be read"))?;
    Profile::from_json(&text).map_err(|e| Error::from(e).within(name))
}

fn scaled(profile: &Profile, variance_scale: f32) -> Result<Profile, Error> {
    let gaussians = profile.gaussians().iter().map(|g| Gaussian {
        variance_mm2: g.variance_mm2 * variance_scale,
        ..*g
    });
    Profile::new(&gaussians.collect::<Vec<_>>())
        .map_err(|e| Error::from(e).within("--variance-scale"))
}
