//! The command line.

use std::path::PathBuf;

use subsurface_lab::Error;
use subsurface_lab::renderer::Environment;

const HELP: &str = "\
A head in a window: scattered by each mode, or by two of them on the sides of a divider.

Usage: cargo run --release -p subsurface-viewer -- [OPTIONS] [FILE]

  FILE                a .glb or .gltf file that faces +Z         [the built-in head]
  --mm-per-unit X     length of the model's unit in mm           [1000: metres]
  --size WxH          of the window, in pixels                   [1280x800]
  --texture-size N    of the atlas of texture space, in texels   [1024]
  --environment FILE  light from an .hdr or .exr picture of all  [three lights]
                      directions; studio: a built-in one
  --out DIR           where screenshots go                       [out/viewer]

Mouse, over the picture:
  left drag           turns the view; over the divider, moves it
  middle drag         shifts the view
  right drag          moves the key light; turns an environment
  wheel               zooms

Keys:
  1 to 7              no scattering, texture space, screen space by a plan, screen space exact,
                      split, width of the kernel, level of the plan
  H                   half resolution
  T                   takes the time of each pass of what is shown
  M                   measures the error against the exact sum
  R                   goes back to the first view and light
  S                   saves the picture, without the panel, as viewer-NNN.png
  Escape              quits
";

/// What is asked for.
pub struct Options {
    pub model: Option<PathBuf>,
    pub mm_per_unit: f32,
    pub size: [u32; 2],
    pub texture_size: u32,
    pub environment: Option<Environment>,
    pub out: PathBuf,
}

impl Options {
    /// The command line; `None` when it asked for help.
    pub fn parse() -> Result<Option<Self>, Error> {
        use lexopt::prelude::*;

        let mut options = Self {
            model: None,
            mm_per_unit: 1000.0,
            size: [1280, 800],
            texture_size: 1024,
            environment: None,
            out: "out/viewer".into(),
        };
        let refused = |e: lexopt::Error| {
            let got = format!("\"{e}\"");
            Error::new("command line", got, "options as --help lists them")
        };
        let mut parser = lexopt::Parser::from_env();
        while let Some(arg) = parser.next().map_err(refused)? {
            let name = match arg {
                Long(name) => name.to_string(),
                Short('h') => "help".into(),
                Value(file) if options.model.is_none() => {
                    options.model = Some(file.into());
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
                "mm-per-unit" => options.mm_per_unit = mm_per_unit(&text()?)?,
                "size" => options.size = size(&text()?)?,
                "texture-size" => options.texture_size = texture_size(&text()?)?,
                "environment" => options.environment = Some(Environment::named(&text()?)?),
                "out" => options.out = text()?.into(),
                _ => return Err(refused(Long(name.as_str()).unexpected())),
            }
        }
        Ok(Some(options))
    }
}

fn mm_per_unit(text: &str) -> Result<f32, Error> {
    text.parse()
        .ok()
        .filter(|x: &f32| x.is_finite() && *x > 0.0)
        .ok_or_else(|| Error::new("--mm-per-unit", text, "a number above 0"))
}

fn size(text: &str) -> Result<[u32; 2], Error> {
    let needs = "WIDTHxHEIGHT in pixels, such as 1280x800, from 64x64 to 8192x8192";
    text.split_once('x')
        .and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]))
        .filter(|size: &[u32; 2]| size.iter().all(|s| (64..=8192).contains(s)))
        .ok_or_else(|| Error::new("--size", text, needs))
}

fn texture_size(text: &str) -> Result<u32, Error> {
    text.parse()
        .ok()
        .filter(|n| (16..=8192).contains(n))
        .ok_or_else(|| Error::new("--texture-size", text, "a number of texels, 16 to 8192"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_checked() {
        assert_eq!(size("640x480"), Ok([640, 480]));
        for bad in ["640", "0x480", "640x-1", "9000x9000", "axb"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert_eq!(mm_per_unit("10"), Ok(10.0));
        for bad in ["0", "-1", "NaN", "inf", ""] {
            assert!(mm_per_unit(bad).is_err(), "{bad}");
        }
        assert_eq!(texture_size("512"), Ok(512));
        assert!(texture_size("0").is_err());
    }
}
