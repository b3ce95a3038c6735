//! The command line.

use std::path::PathBuf;

use subsurface_lab::Error;
use subsurface_lab::cli::Arguments;
use subsurface_lab::renderer::Environment;

pub const HELP: &str = "\
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
    /// # Errors
    /// An option that is not known, or a value that does not fit.
    pub fn parse(arguments: &mut Arguments) -> Result<Self, Error> {
        let mut options = Self {
            model: None,
            mm_per_unit: 1000.0,
            size: [1280, 800],
            texture_size: 1024,
            environment: None,
            out: "out/viewer".into(),
        };
        while let Some(name) = arguments.next_word()? {
            match name.as_str() {
                "--mm-per-unit" => options.mm_per_unit = arguments.positive()?,
                "--size" => {
                    let fits = |side| (64..=8192).contains(&side);
                    options.size = arguments.size(", from 64x64 to 8192x8192", fits)?;
                }
                "--texture-size" => {
                    let needs = "a number of texels, 16 to 8192";
                    options.texture_size = arguments.number(needs, |n| (16..=8192).contains(n))?;
                }
                "--environment" => options.environment = Some(Environment::named(&arguments.value()?)?),
                "--out" => options.out = arguments.value()?.into(),
                _ if options.model.is_none() && !name.starts_with('-') => options.model = Some(name.into()),
                _ => return Err(arguments.unknown()),
            }
        }
        Ok(options)
    }
}
