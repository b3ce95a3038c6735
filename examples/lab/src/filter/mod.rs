//! Scatters a frame that another program dumped: irradiance and depth as EXR files, with the camera
//! beside them. docs/dumps.md says how to write one.
//!
//! ```sh
//! cargo run --release --example filter -- CASE_DIR --out FILE.exr
//! ```

mod channels;
mod dump;
#[cfg(test)]
mod fixture;
mod options;
mod picture;
#[cfg(test)]
mod refusals;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use crate::Error;
use indicatif::{ProgressBar, ProgressStyle};
use subsurface::wgpu::{self, TextureFormat};
use subsurface::{Frame, Plan};

use crate::method::{self, Ours};

use crate::output;
use crate::renderer::Gpu;
use dump::{Camera, Dump};
use options::Options;

/// The largest half float: between its passes, the planned effect holds light at it.
const LARGEST_HALF: f32 = 65504.0;

pub fn main() -> ExitCode {
    match Options::parse(lexopt::Parser::from_env())
        .and_then(|options| options.map_or(Ok(()), |o| filter(&o)))
    {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Names of files and keys may hold line breaks.
            eprintln!("error: {}", error.to_string().replace(['\n', '\r'], " "));
            ExitCode::FAILURE
        }
    }
}

fn filter(options: &Options) -> Result<(), Error> {
    let started = Instant::now();
    let progress = ProgressBar::new(4).with_style(
        ProgressStyle::with_template("{bar:24} {msg}").expect("the template is a constant"),
    );
    let step = |message: &str| {
        progress.inc(1);
        progress.set_message(message.to_owned());
    };

    step("reading the dump");
    let camera = Camera::read(&options.case)?;
    let gpu = Gpu::headless()?;
    gpu.check_size(camera.size).map_err(|e| camera.error(e))?;
    let dump = Dump::read(camera, options.profiles.len())?;

    step("planning");
    let plan = match options.max_error {
        None => Plan::exact(&options.profiles)?,
        Some(max_error) => Plan::new(&options.profiles, max_error)?,
    };

    step("scattering");
    let scattered = scatter(&gpu, &dump, &plan)?;

    step("writing");
    let files = files(options, &dump, &scattered)?;
    let directory = match options.out.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    output::write(directory, &files).map_err(|e| {
        let needs = "a file that can be written";
        Error::new("--out", format!("\"{e}\""), needs)
    })?;
    progress.finish_and_clear();
    for note in notes(&dump, &plan) {
        eprintln!("note: {note}");
    }
    if options.plan {
        print!("{plan}");
    }
    let [width, height] = dump.camera.size;
    println!(
        "{}: {} of {width}x{height} pixels scattered, depth kept to {:.1e} mm, {:.1} s on {}",
        options.out.display(),
        dump.profile_id.iter().filter(|id| **id > 0).count(),
        dump.depth_error_mm,
        started.elapsed().as_secs_f64(),
        gpu.adapter,
    );
    Ok(())
}

/// The scattered irradiance; what lay there where nothing scatters.
fn scatter(gpu: &Gpu, dump: &Dump, plan: &Plan) -> Result<Vec<[f32; 3]>, Error> {
    // As wide as the files, so that what does not scatter comes out bit for bit.
    let format = TextureFormat::Rgba32Float;
    let size = dump.camera.size;
    let device = &gpu.device;
    // Nothing else tells of a frame that the device has no memory for; what uses a texture that could
    // not be made is then invalid, too.
    let invalid = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let output = gpu.target("scattered", size, format);
    let irradiance = gpu.upload("irradiance", size, format, &dump.irradiance);
    let depth = gpu.upload("depth", size, TextureFormat::R32Float, &dump.depth);
    let profile_id = gpu.upload("profile id", size, TextureFormat::R8Uint, &dump.profile_id);
    let projection = dump.camera.projection.to_cols_array_2d();
    let mut frame = Frame::new(&irradiance, &depth, projection);
    frame.profile_id = Some(&profile_id);
    frame.mm_per_unit = dump.camera.mm_per_unit;
    let mut ours = Ours::new(device, format, plan)?;
    method::scatter(gpu, &mut ours, &frame, &output).map_err(|e| dump.camera.error(e))?;
    // Innermost first.
    let failed = pollster::block_on(memory.pop());
    let failed = failed.or(pollster::block_on(invalid.pop()));
    if let Some(error) = failed {
        let [width, height] = size;
        let got = format!("{width}x{height}, where the device says \"{error}\"");
        let needs = "a frame that the device has memory for";
        return Err(dump.camera.error(Error::new("size", got, needs)));
    }
    let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_bytes(output.texture()));
    Ok(texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect())
}

/// The files asked for, under the names that they get.
fn files(
    options: &Options,
    dump: &Dump,
    scattered: &[[f32; 3]],
) -> Result<Vec<(String, Vec<u8>)>, Error> {
    let size = dump.camera.size;
    let name = |extension| {
        let path = options.out.with_extension(extension);
        let name = path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    let failed = |e: image::ImageError| {
        Error::new("--out", format!("\"{e}\""), "a picture that can be encoded")
    };
    let mut files = vec![(name("exr"), picture::exr(size, scattered).map_err(failed)?)];
    if options.png {
        let picture = picture::tone_mapped(size, scattered);
        files.push((name("png"), output::png(&picture).map_err(failed)?));
    }
    Ok(files)
}

/// What is in the way of a good result, but not of a result.
fn notes(dump: &Dump, plan: &Plan) -> Vec<String> {
    let mut notes = Vec::new();
    if dump.depth_is_half {
        notes.push(
            "depth is in half floats, whose steps are up to a thousandth of the distance and show \
             in the result; write floats"
                .into(),
        );
    }
    let skin = dump.irradiance.iter().zip(&dump.profile_id);
    let brightest = skin
        .filter(|(_, id)| **id > 0)
        .flat_map(|(e, _)| &e[..3])
        .fold(0.0, |a: f32, b| a.max(*b));
    if brightest > LARGEST_HALF && !plan.is_exact() {
        notes.push(format!(
            "irradiance of {brightest} is held at {LARGEST_HALF}; scale it, or use --exact"
        ));
    }
    notes
}
