//! From what a material is described by to its profile, with what each step is off by.
//!
//! ```sh
//! cargo run --release --example profile -- light
//! ```

mod description;
mod heads;
mod picture;
mod skins;
mod strip;

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use subsurface::physics::{Fit, Response};
use subsurface::{DEFAULT_MAX_ERROR, Plan, Profile};

use crate::cli::{self, Arguments};
use crate::renderer::Gpu;
use crate::{Error, output};

pub use description::{Description, NAMES};
use strip::Strip;

const HELP: &str = "\
Makes a diffusion profile of what a material is described by, and says what it is off by.

Usage: cargo run --release --example profile -- [OPTIONS] MATERIAL

MATERIAL is a name: skin, light, medium, dark, layers, skin1, skin2, marble, whole-milk; or a file: JSON
(docs/physics.md has the forms), or glTF with KHR_materials_volume_scatter (FILE#MATERIAL for one of many).

  --max-error X    largest error of the fit, and of a plan of it, of white   [1/255]
  --gaussians N    of the profile, 1 to 8                    [as few as keep it]
  --three-skins    instead: what others' profiles make of light, medium and dark skin, and ours, held to a
                   random walk; a head of each
  --paths N        of that walk, for each of 16 wavelengths  [200000]
  --out DIR        where profile.json and profile.png go     [out/profile]
";

struct Options {
    material: String,
    max_error: f32,
    gaussians: Option<usize>,
    three_skins: bool,
    paths: u64,
    out: PathBuf,
}

pub fn main() -> ExitCode {
    cli::main(HELP, options, |options| match options.three_skins {
        true => three_skins(&options),
        false => describe(&options),
    })
}

fn options(arguments: &mut Arguments) -> Result<Options, Error> {
    let mut options = Options {
        material: String::new(),
        max_error: DEFAULT_MAX_ERROR,
        gaussians: None,
        three_skins: false,
        paths: 200_000,
        out: "out/profile".into(),
    };
    while let Some(name) = arguments.next_word()? {
        match name.as_str() {
            "--three-skins" => options.three_skins = true,
            "--max-error" => options.max_error = arguments.max_error()?,
            "--gaussians" => {
                options.gaussians = Some(arguments.number("a whole number, 1 to 8", |_| true)?);
            }
            "--paths" => options.paths = arguments.number("a whole number", |n| *n > 0)?,
            "--out" => options.out = arguments.value()?.into(),
            _ if options.material.is_empty() && !name.starts_with('-') => options.material = name,
            _ => return Err(arguments.unknown()),
        }
    }
    if options.material.is_empty() && !options.three_skins {
        let needs = format!("one of {}, or a file", NAMES.join(", "));
        return Err(Error::new("command line", "no material", needs));
    }
    Ok(options)
}

fn describe(options: &Options) -> Result<(), Error> {
    let material = Description::load(&options.material)?;
    let profile = material.profile(options.gaussians, options.max_error)?;
    let plan = plan_near(profile, options.max_error)?;
    let gpu = Gpu::headless()?;
    let strip = Strip::new(&gpu, &material.responses, &plan)?;
    let table = table(&material, &profile, &plan, &strip)?;
    let picture = picture::picture(&material, &profile, &strip)?;
    let json = serde_json::to_string_pretty(&profile)
        .map_err(|e| Error::new("profile.json", format!("\"{e}\""), "numbers that JSON has"))?;
    let png = output::png(&picture)
        .map_err(|e| Error::new("profile.png", format!("\"{e}\""), "a picture that can be encoded"))?;
    let files = [
        ("profile.json".into(), (json + "\n").into_bytes()),
        ("profile.txt".into(), table.clone().into_bytes()),
        ("profile.png".into(), png),
    ];
    write(options, &files)?;
    print!("{table}");
    println!("{}", options.out.join("profile.json").display());
    Ok(())
}

/// The plan of an error or, where no pyramid keeps that, of the least that one keeps.
fn plan_near(profile: Profile, max_error: f32) -> Result<Plan, Error> {
    Ok(match Plan::new(&[profile], max_error) {
        Err(subsurface::Error::MaxError { reachable, .. }) => Plan::new(&[profile], reachable)?,
        plan => plan?,
    })
}

fn three_skins(options: &Options) -> Result<(), Error> {
    let heads = heads::picture(&Gpu::headless()?)?;
    let (table, picture) = skins::compare(options.paths)?;
    let encode = |name: &str, picture: &image::RgbImage| {
        let refused = |e| Error::new(name, format!("\"{e}\""), "a picture that can be encoded");
        Ok::<_, Error>((name.to_owned(), output::png(picture).map_err(refused)?))
    };
    let files = [
        ("three-skins.txt".into(), table.clone().into_bytes()),
        encode("three-skins.png", &picture)?,
        encode("heads.png", &heads)?,
    ];
    write(options, &files)?;
    print!("{table}");
    println!("{}", options.out.join("three-skins.png").display());
    Ok(())
}

fn write(options: &Options, files: &[(String, Vec<u8>)]) -> Result<(), Error> {
    output::write(&options.out, files)
        .map_err(|e| Error::new("--out", format!("\"{e}\""), "a directory that can be written to"))
}

/// What a material does, and what is lost on the way to pixels.
fn table(material: &Description, profile: &Profile, plan: &Plan, strip: &Strip) -> Result<String, Error> {
    let mut text = format!("{}\n{:26}{:>10}{:>10}{:>10}\n", material.title, "", "red", "green", "blue");
    let mut row = |name: &str, values: [f64; 3], decimals: usize| {
        let [r, g, b] = values.map(|v| format!("{v:10.decimals$}"));
        writeln!(text, "{name:26}{r}{g}{b}").expect("a String takes all text");
    };
    let responses = &material.responses;
    if let Some(albedo) = material.albedo {
        row("R, of what enters", responses.each_ref().map(Response::albedo), 4);
        row("R, of what arrives", albedo, 4);
    }
    for share in [0.5, 0.9, 0.99] {
        let name = format!("half-width of {:.0} %, mm", 100.0 * share);
        row(&name, responses.each_ref().map(|r| r.half_width(share)), 3);
    }
    for k in 1..=Profile::MAX_GAUSSIANS {
        let fit = Fit::new(responses, k)?;
        row(&format!("worst edge, {k} Gaussian{}", if k > 1 { "s" } else { "" }), fit.edge_error, 4);
        if k == 1 && fit.floor.iter().any(|floor| *floor > 1e-3) {
            row("worst edge, any number", fit.floor, 4);
        }
    }
    let states = |text: &mut String| {
        let count = profile.gaussians().len();
        writeln!(text, "profile: {count} Gaussians, off by {:.4}", profile.fit_error())?;
        let [max, own, all] = [plan.max_error(), plan.predicted_error(), plan.stated_error()];
        writeln!(text, "plan at {max:.4}: off by {own:.4}, by {all:.4} with the profile's")?;
        let px = strip::PX_PER_MM;
        writeln!(
            text,
            "the strip by that plan at {px} px/mm: off by {:.4}; a line is two edges",
            strip.error
        )
    };
    states(&mut text).expect("a String takes all text");
    Ok(text)
}
