//! The chart of speed against accuracy: every method on every scene, timed and held to the integral
//! that it approximates.
//!
//! ```sh
//! cargo run --release --example chart
//! ```

mod clock;
mod costs;
mod files;
#[cfg(test)]
mod fixture;
mod heads;
mod lab;
mod options;
pub(crate) mod plot;
mod progress;
mod report;
mod row;
pub(crate) mod scene;
mod score;
pub(crate) mod truths;
mod turning;

use std::hash::{DefaultHasher, Hasher};
use std::process::ExitCode;
use std::time::Instant;

use crate::Error;
use serde_json::json;

use crate::renderer::Scene as Model;
use crate::{cli, metrics, output};
use files::Chart;
use lab::{Lab, METHODS};
use options::{Options, Plan};
use plot::Series;
use progress::{Done, Host, Interval, Progress, Visibility};
use report::SceneImages;
use row::Row;

/// A head is no taller than this; one that is has another unit, and would take all memory.
const TALLEST_MM: f32 = 3000.0;

pub fn main() -> ExitCode {
    cli::main(options::HELP, Options::parse, |options| chart(&options))
}

fn chart(options: &Options) -> Result<(), Error> {
    let started = Instant::now();
    let (model_name, model) = load(options)?;
    let mut scenes = scene::names();
    scenes.extend(["turning".into(), "costs".into(), "heads".into()]);
    let scenes = chosen("--scenes", options.scenes.as_ref(), scenes)?;
    chosen("--methods", options.methods.as_ref(), METHODS.map(String::from).to_vec())?;

    let mut model_hash = DefaultHasher::new();
    truths::hash_model(&model, &mut model_hash);
    let lab = Lab::new(model, options)?;
    let progress = Progress::new(
        &options.cache,
        (
            &lab.gpu.adapter,
            model_hash.finish(),
            options.mm_per_unit.to_bits(),
            lab.plan.size,
            options.quick,
            &options.methods,
        ),
    )?;
    let mut done = Vec::new();
    for name in &scenes {
        done.push(match progress.read(name) {
            Some(kept) => kept,
            None => {
                let new = match name.as_str() {
                    "costs" => lab.costs()?,
                    "heads" => lab.heads()?,
                    "turning" => lab.turning()?,
                    _ => lab.scene(name)?,
                };
                progress.keep(name, &new)?;
                new
            }
        });
    }
    let rows: Vec<Row> = done.iter().flat_map(|d| d.rows.clone()).collect();
    write(options, &lab, &model_name, &done, &rows)?;
    progress.forget();
    lab.bar.finish_and_clear();
    println!("{}", table(&rows));
    println!("{} in {:.0} s", options.out.join("report.html").display(), started.elapsed().as_secs_f64());
    Ok(())
}

/// The model and its name.
fn load(options: &Options) -> Result<(String, Model), Error> {
    let (name, model) = match &options.model {
        Some(path) => (path.display().to_string(), Model::load(path)?),
        None => ("the built-in head (MakeHuman base mesh, CC0)".to_owned(), Model::from_glb(crate::HEAD)?),
    };
    let (least, greatest) = model.skin_bounds();
    let extent_mm = (greatest - least).max_element() * options.mm_per_unit;
    if extent_mm > TALLEST_MM {
        let got = format!("a model of {extent_mm} mm");
        return Err(Error::new("--mm-per-unit", got, format!("at most {TALLEST_MM} mm")));
    }
    Ok((name, model))
}

fn write(options: &Options, lab: &Lab, model: &str, done: &[Done], rows: &[Row]) -> Result<(), Error> {
    let mut images: Vec<SceneImages> = Vec::new();
    for scene in done {
        images.extend(scene.images()?);
    }
    let heads: Vec<Series> = done.iter().flat_map(|d| d.heads.clone()).collect();
    let intervals: Vec<&Interval> = done.iter().flat_map(|d| &d.intervals).collect();
    let visibility: Vec<&Visibility> = done.iter().flat_map(|d| &d.visibility).collect();
    let host: Vec<&Host> = done.iter().flat_map(|d| &d.host).collect();
    let mut notes = notes(&lab.plan);
    notes.extend(host_note(&host));
    notes.extend(done.iter().flat_map(|d| d.notes.clone()));
    let command: Vec<String> = std::env::args().skip(1).collect();
    let command = match command.as_slice() {
        [] => "cargo run --release --example chart".into(),
        options => format!("cargo run --release --example chart -- {}", options.join(" ")),
    };
    let [width, height] = lab.plan.size;
    let (commit, clock, adapter) = (commit(), lab.clock.name(), &lab.gpu.adapter);
    let about = json!({
        "adapter": adapter,
        "clock": clock,
        "commit": commit,
        "host": host,
        "model": model,
        "size": format!("{width}x{height}"),
        "command": command,
        "visibility_error": visibility,
        "x_copy_intervals_95": intervals,
        "notes": notes,
    });
    let caption = format!("{adapter}, {width}×{height}, {model}\n{clock}, commit {commit}\n`{command}`");
    let chart = Chart { rows, about: &about, caption: &caption, heads: &heads, images: &images };
    let files = files::files(&chart)
        .map_err(|e| Error::new("chart", format!("\"{e}\""), "files that can be made"))?;
    output::write(&options.out, &files)
        .map_err(|e| Error::new("--out", format!("\"{e}\""), "a directory to write to"))
}

/// What was asked for of `known`, or all of it.
fn chosen(option: &str, asked: Option<&Vec<String>>, known: Vec<String>) -> Result<Vec<String>, Error> {
    let Some(asked) = asked else {
        return Ok(known);
    };
    match asked.iter().find(|name| !known.contains(name)) {
        Some(unknown) => Err(Error::new(option, unknown, known.join(", "))),
        None => Ok(asked.clone()),
    }
}

/// What the reader of any chart should know.
fn notes(plan: &Plan) -> Vec<String> {
    let stride = plan.stride;
    vec![
        "Errors are of irradiance/π over skin, a rim of one pixel left out.".into(),
        format!(
            "Truths are summed at one pixel in {stride} each way, one in {} of wide frames and on edges from 8 px \
             on; errors, ΔE2000 and FLIP are of these pixels, so that FLIP sees a picture that much smaller.",
            scene::SPARSE * stride
        ),
        "Screen-space methods are compared with the visible integral, in colour differences and energy, \
         too; texture-space methods with the surface integral, each Gaussian divided by its mass. \
         visibility_error is what lies between the two.".into(),
        "rel_rmse_eq7 is Eq. 7 as printed; error_time_eq7 draws rel_rmse_eq7_normalised.".into(),
        "jimenez_separable is the published construction with falloff, strength and width fitted to the \
         skin profile, fitted_separable a sum of Gaussians cut into taps, burley_disk has its three shapes \
         fitted; all fits minimise the worst error on a step edge. jimenez_2009 has its authors' own fit.".into(),
        "Rivals keep half floats between passes, as published, screen_exact and texture_separable full \
         ones; a software driver that truncates half floats costs the former up to .001 relative.".into(),
        "Texture-space times are wall clock and hold the drawing and lighting of the atlas, which screen \
         space has from the frame; they are not interleaved with the others. texture_2d is run at one atlas and one view.".into(),
        "Rivals draw over skin alone, by a stencil that their first pass marks, and keep the light as it was \
         elsewhere; ours find their tiles of skin themselves. All of that is in the times.".into(),
    ]
}

/// What was measured: the commit, and whether the tree was changed since.
fn commit() -> String {
    let git = std::process::Command::new("git")
        .args(["describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output();
    let text = git.ok().filter(|git| git.status.success());
    text.and_then(|git| String::from_utf8(git.stdout).ok())
        .map_or("unknown".into(), |text| text.trim().to_owned())
}

/// What a host's CPU spends on a frame, over all scenes.
fn host_note(host: &[&Host]) -> Option<String> {
    let names: Vec<String> = host.iter().map(|h| format!("{} {}", h.method, h.setting)).collect();
    let of_method = |name: &str| {
        let of = |value: fn(&Host) -> f64| {
            let mine = names.iter().zip(host).filter(|(n, _)| *n == name);
            metrics::median(&mine.map(|(_, h)| value(h)).collect::<Vec<_>>())
        };
        format!(
            "{} prepares in {:.0} µs, staging {} bytes, and records in {:.0} µs",
            name.trim_end(),
            of(|h| h.cost.prepare_us),
            of(|h| h.cost.upload_bytes as f64),
            of(|h| h.cost.render_us),
        )
    };
    let methods = plot::style::distinct(names.iter().map(String::as_str));
    let parts: Vec<String> = methods.into_iter().map(of_method).collect();
    (!parts.is_empty()).then(|| format!("CPU time of a host, a frame: {}.", parts.join("; ")))
}

fn table(rows: &[Row]) -> String {
    let percent = |v: Option<f64>| v.map_or("-".into(), |v| format!("{:.3} %", 100.0 * v));
    let mut lines = vec![format!(
        "{:<14} {:<26} {:>10} {:>8} {:>12} {:>12}",
        "scene", "method", "ms", "x copy", "to visible", "to Eq. 7"
    )];
    lines.extend(rows.iter().map(|row| {
        format!(
            "{:<14} {:<26} {:>10.2} {:>8.1} {:>12} {:>12}",
            row.scene,
            format!("{} {}", row.method, row.setting),
            row.ms,
            row.x_copy,
            percent(row.rel_rmse_visible),
            percent(row.rel_rmse_eq7_normalised),
        )
    }));
    lines.join("\n")
}
