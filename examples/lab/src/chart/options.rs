//! The command line.

use std::path::PathBuf;

use crate::Error;
use crate::chart::clock::Rounds;
use crate::cli::Arguments;

pub const HELP: &str = "\
Times every method on every scene, measures how far it is from the exact integrals, and draws one
against the other.

Usage: cargo run --release --example chart -- [OPTIONS]

  --scenes LIST     of front, three-quarter, close-up, far, profile, ear, wide, sphere,
                    edge_0.5 to edge_64, turning, costs and heads, separated by
                    commas                                              [all]
  --methods LIST    such as screen_exact,burley_disk                    [all]
  --size WxH        of the frames, in pixels, but for wide, a third of   [512x512; quick: 256x256]
                    which is skin: 1920x1080; quick: 960x540
  --quick           fewer runs, smaller atlases, truths at every fourth pixel, not every second
  --model FILE      a .glb or .gltf file                                [the built-in head]
  --mm-per-unit X   length of the model's unit in mm                    [1000: metres]
  --cache DIR       where truths and finished scenes are kept           [out/chart-cache]
  --out DIR         where the chart goes                                [out/chart]

A run that was stopped goes on with the scene that it was at.
";

/// What is asked for.
pub struct Options {
    pub scenes: Option<Vec<String>>,
    pub methods: Option<Vec<String>>,
    pub size: Option<[u32; 2]>,
    pub quick: bool,
    pub model: Option<PathBuf>,
    pub mm_per_unit: f32,
    pub cache: PathBuf,
    pub out: PathBuf,
}

impl Options {
    /// # Errors
    /// An option that is not known, or a value that does not fit.
    pub fn parse(arguments: &mut Arguments) -> Result<Self, Error> {
        let mut options = Self {
            scenes: None,
            methods: None,
            size: None,
            quick: false,
            model: None,
            mm_per_unit: 1000.0,
            cache: "out/chart-cache".into(),
            out: "out/chart".into(),
        };
        while let Some(name) = arguments.next_word()? {
            match name.as_str() {
                "--quick" => options.quick = true,
                "--scenes" => options.scenes = Some(arguments.names()?),
                "--methods" => options.methods = Some(arguments.names()?),
                "--model" => options.model = Some(arguments.value()?.into()),
                "--cache" => options.cache = arguments.value()?.into(),
                "--out" => options.out = arguments.value()?.into(),
                // A pixel less would leave nothing once rims are taken off.
                "--size" => options.size = Some(arguments.size(", at least 16x16", |side| side >= 16)?),
                "--mm-per-unit" => options.mm_per_unit = arguments.positive()?,
                _ => return Err(arguments.unknown()),
            }
        }
        Ok(options)
    }
}

/// What `--quick` cuts, and nothing else does.
pub struct Plan {
    pub size: [u32; 2],
    /// Of the frame as games have it.
    pub wide: [u32; 2],
    pub rounds: Rounds,
    /// The truth is asked for at every so many pixels, each way.
    pub stride: u32,
    /// Sides of the atlases, in texels.
    pub atlases: &'static [u32],
    /// Numbers of heads at which each is timed for Fig. 8; the others are extrapolated.
    pub heads: &'static [usize],
    /// A full convolution takes a minute at 512².
    pub atlas_2d: u32,
    /// Runs of an atlas, or as many as fit into this time.
    pub atlas_runs: usize,
    pub atlas_seconds: f64,
}

impl Plan {
    pub fn new(options: &Options) -> Self {
        let size = |default| options.size.unwrap_or([default; 2]);
        if options.quick {
            return Self {
                size: size(256),
                wide: [960, 540],
                rounds: Rounds { all: 3, compared: 3, seconds: 2.0 },
                stride: 4,
                atlases: &[256, 512],
                heads: &[5, 3],
                atlas_2d: 256,
                atlas_runs: 1,
                atlas_seconds: 0.0,
            };
        }
        Self {
            size: size(512),
            wide: [1920, 1080],
            rounds: Rounds { all: 9, compared: 31, seconds: 30.0 },
            stride: 2,
            atlases: &[512, 1024],
            heads: &[5, 5],
            atlas_2d: 512,
            atlas_runs: 9,
            atlas_seconds: 10.0,
        }
    }
}
