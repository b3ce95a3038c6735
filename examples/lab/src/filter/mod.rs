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
#[cfg(test)]
mod tests;

use std::io::Cursor;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use image::{ImageFormat, ImageResult, Rgb, Rgb32FImage, RgbImage};
use subsurface::wgpu::{self, TextureFormat};
use subsurface::{BackLayer, Frame, Plan};

use crate::Error;
use crate::method::{self, Ours};
use crate::renderer::Gpu;
use crate::{cli, output};
use dump::{Camera, Dump};
use options::Options;

/// The largest half float: a plan holds light at it between its passes.
const LARGEST_HALF: f32 = 65504.0;

pub fn main() -> ExitCode {
    cli::main(options::HELP, Options::parse, |options| filter(&options))
}

fn filter(options: &Options) -> Result<(), Error> {
    let started = Instant::now();
    let camera = Camera::read(&options.case)?;
    let unknown = camera.unknown();
    if !unknown.is_empty() {
        note(&format!("gbuffer.json: not read: {}", unknown.join(", ")));
    }
    let gpu = Gpu::headless()?;
    gpu.check_size(camera.size()).map_err(|e| camera.error(e))?;
    let dump = Dump::read(camera, options.profiles.len())?;
    if dump.depth_is_half {
        note(
            "depth is in half floats, whose steps are up to a thousandth of the distance and show in \
             the result; write full floats",
        );
    }

    if dump.profile_id.iter().all(|id| *id == 0) {
        note("nothing scatters: depth is empty everywhere, or profile_id 0");
    }

    let plan = match options.max_error {
        None => Plan::exact(&options.profiles)?,
        Some(max_error) => {
            Plan::new(&options.profiles, max_error).map_err(|e| Error::from(e).within("--max-error"))?
        }
    };
    let brightest = dump.brightest();
    if brightest > LARGEST_HALF && !plan.is_exact() {
        note(&format!("irradiance of {brightest} is held at {LARGEST_HALF}; scale it, or use --exact"));
    }
    let scattered = scatter(&gpu, &dump, &plan)?;
    write(options, dump.camera.size(), scattered)?;
    if options.plan {
        print!("{plan}");
    }
    let [width, height] = dump.camera.size();
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

/// What is in the way of a good result, but not of a result.
fn note(text: &str) {
    eprintln!("note: {}", text.replace(['\n', '\r'], " "));
}

/// A text, without the byte order mark that PowerShell and others write before it.
///
/// # Errors
/// A file that cannot be read, or is not in UTF-8.
fn read_text(path: &Path) -> Result<String, Error> {
    let text = std::fs::read_to_string(path)
        .map_err(|e| Error::new(path.display(), format!("\"{e}\""), "a file of UTF-8 text"))?;
    Ok(text.trim_start_matches('\u{feff}').to_owned())
}

/// The scattered irradiance; the irradiance as it was where nothing scatters.
fn scatter(gpu: &Gpu, dump: &Dump, plan: &Plan) -> Result<Vec<[f32; 3]>, Error> {
    // As wide as the files, so that what does not scatter comes out bit for bit.
    let format = TextureFormat::Rgba32Float;
    let size = dump.camera.size();
    let device = &gpu.device;
    // Nothing else tells of a frame that the device has no memory for; what uses a texture that could
    // not be made is then invalid, too.
    let invalid = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let output = gpu.target("scattered", size, format);
    let irradiance = gpu.upload("irradiance", size, format, &dump.irradiance);
    let depth = gpu.upload("depth", size, TextureFormat::R32Float, &dump.depth);
    let profile_id = gpu.upload("profile id", size, TextureFormat::R8Uint, &dump.profile_id);
    let projection = dump.camera.projection().to_cols_array_2d();
    let mut frame = Frame::new(&irradiance, &depth, projection);
    frame.profile_id = Some(&profile_id);
    frame.mm_per_unit = dump.camera.mm_per_unit;
    let back = dump.back.as_ref().map(|back| {
        let light = gpu.upload("back irradiance", size, format, &back.irradiance);
        (light, gpu.upload("back depth", size, TextureFormat::R32Float, &back.depth))
    });
    frame.back = back.as_ref().map(|(irradiance, depth)| BackLayer::new(irradiance, depth));
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

/// Writes the files that were asked for, all or none.
fn write(options: &Options, size: [u32; 2], pixels: Vec<[f32; 3]>) -> Result<(), Error> {
    let refuse = |error: &dyn std::error::Error| {
        let got = format!("\"{error}\"");
        Error::new("--out", got, "a file that can be written")
    };
    let name = |extension| {
        let path = options.out.with_extension(extension);
        let name = path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    let mut files = Vec::new();
    if options.png {
        let png = output::png(&picture(size, &pixels)).map_err(|e| refuse(&e))?;
        files.push((name("png"), png));
    }
    files.push((name("exr"), exr(size, pixels).map_err(|e| refuse(&e))?));
    let directory = match options.out.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    output::write(directory, &files).map_err(|e| refuse(&e))
}

/// Linear pixels, row by row, as an OpenEXR file of full floats.
fn exr([width, height]: [u32; 2], pixels: Vec<[f32; 3]>) -> ImageResult<Vec<u8>> {
    let image = Rgb32FImage::from_raw(width, height, pixels.into_flattened())
        .expect("there is a pixel for each of the frame");
    let mut file = Cursor::new(Vec::new());
    image.write_to(&mut file, ImageFormat::OpenExr)?;
    Ok(file.into_inner())
}

/// Linear pixels in sRGB (IEC 61966-2-1): below 0 is black, above 1 is white.
fn picture([width, height]: [u32; 2], pixels: &[[f32; 3]]) -> RgbImage {
    let srgb = |linear: f32| match linear.clamp(0.0, 1.0) {
        dark if dark <= 0.003_130_8 => 12.92 * dark,
        light => 1.055 * light.powf(1.0 / 2.4) - 0.055,
    };
    RgbImage::from_fn(width, height, |x, y| {
        let pixel = pixels[y as usize * width as usize + x as usize];
        Rgb(pixel.map(|c| (255.0 * srgb(c)).round() as u8))
    })
}
