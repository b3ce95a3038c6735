//! The one error of the crate: which input, what it was, what is needed.

use std::fmt;

use wgpu::{TextureFormat, TextureUsages};

use crate::Viewport;

/// An input that cannot be used. Its `Display` is a sentence that names the field, such as "depth: size: got
/// 8x8, needs 16x8 as the irradiance has"; print it with `{}`.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A texture of a format that cannot be read, or written, as this input is.
    Format {
        /// The field.
        input: &'static str,
        /// The texture's format.
        got: TextureFormat,
        /// The formats that can be used.
        needs: &'static str,
    },
    /// An output in another format than the effect was made for.
    OutputFormat {
        /// The format of the output.
        got: TextureFormat,
        /// The format that the effect was made for.
        needs: TextureFormat,
    },
    /// A texture that is not two-dimensional, or that is multisampled.
    Texture {
        /// The field.
        input: &'static str,
        /// The texture's dimension.
        dimension: wgpu::TextureDimension,
        /// Its samples a pixel.
        samples: u32,
    },
    /// A texture made without the usage that this input needs.
    Usage {
        /// The field.
        input: &'static str,
        /// The texture's usages.
        got: TextureUsages,
        /// The one that is missing.
        needs: TextureUsages,
    },
    /// A texture of another size than the irradiance.
    Size {
        /// The field.
        input: &'static str,
        /// Width and height in pixels.
        got: [u32; 2],
        /// Width and height of the irradiance.
        needs: [u32; 2],
    },
    /// An output that is an input, too.
    OutputIsInput {
        /// The field of the input.
        input: &'static str,
    },
    /// A viewport without pixels, or one that leaves the textures.
    Viewport {
        /// What was handed in.
        got: Viewport,
        /// Width and height of the textures.
        size: [u32; 2],
    },
    /// A projection that cannot be undone, or that has another form than the effect knows.
    Projection {
        /// Columns of the matrix.
        got: [[f32; 4]; 4],
        /// What is missing.
        needs: &'static str,
    },
    /// A number out of its range.
    Number {
        /// The field, or which number of a list.
        input: String,
        /// What was handed in.
        got: f64,
        /// The range.
        needs: &'static str,
    },
    /// More or fewer of something than can be used.
    Count {
        /// What was counted.
        input: &'static str,
        /// How many there were.
        got: usize,
        /// The fewest and the most.
        needs: [usize; 2],
    },
    /// An error that no set of blurs keeps for these profiles. [`Plan::exact`](crate::Plan::exact) does.
    MaxError {
        /// The error that was asked for, in units of white.
        got: f32,
        /// The least that can be kept.
        reachable: f32,
    },
    /// Albedo handed to an effect whose output holds none.
    AlbedoUnused,
    /// A device that allows less than WebGPU's default limits.
    Limit {
        /// The name of the limit, as wgpu has it.
        limit: &'static str,
        /// What the device allows.
        got: u32,
        /// What the effect needs.
        needs: u32,
    },
    /// A view that was rendered before it was prepared.
    NotPrepared,
    /// An [`Overlay`](crate::Overlay) of a view that was last prepared by the exact sum, which has no pyramid
    /// to show.
    NoPyramid,
    /// A text that is not of the form that it should have.
    #[cfg(feature = "json")]
    Json {
        /// What was read.
        input: &'static str,
        /// What the parser says, with line and column.
        got: String,
        /// The form.
        needs: &'static str,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Format { input, got, needs } => {
                write!(f, "{input}: format: got {got:?}, needs {needs}")
            }
            Self::OutputFormat { got, needs } => {
                write!(f, "output: format: got {got:?}, needs {needs:?} as the effect was made for")
            }
            Self::Texture { input, dimension, samples } => write!(
                f,
                "{input}: got a {dimension:?} texture with {samples} samples, needs a D2 texture with 1 sample"
            ),
            Self::Usage { input, got, needs } => {
                write!(f, "{input}: usage: got {got:?}, needs {needs:?}")
            }
            Self::Size { input, got, needs } => write!(
                f,
                "{input}: size: got {}x{}, needs {}x{} as the irradiance has",
                got[0], got[1], needs[0], needs[1]
            ),
            Self::OutputIsInput { input } => {
                write!(f, "output: got the texture of {input}, needs a texture of its own")
            }
            Self::Viewport { got, size } => write!(
                f,
                "viewport: got {}x{} at {}, {}, needs a rectangle of 1x1 or more within {}x{}",
                got.width, got.height, got.x, got.y, size[0], size[1]
            ),
            Self::Projection { got, needs } => {
                write!(f, "projection: got {got:?}, needs {needs}")
            }
            // Most came as single floats; in double precision -0.1 would read -0.10000000149011612.
            Self::Number { input, got, needs } => match *got as f32 {
                single if f64::from(single) == *got => write!(f, "{input}: got {single}, needs {needs}"),
                _ => write!(f, "{input}: got {got}, needs {needs}"),
            },
            Self::Count { input, got, needs: [least, most] } if least == most => {
                write!(f, "{input}: got {got}, needs {least}")
            }
            Self::Count { input, got, needs: [least, most] } => {
                write!(f, "{input}: got {got}, needs {least} to {most}")
            }
            Self::MaxError { got, reachable } => write!(
                f,
                "max_error: got {got}, needs {:.4} or more for these profiles; Plan::exact keeps less, \
                 at many times the cost",
                // rounded up, so that what is named can be had
                (f64::from(*reachable) * 1e4).ceil() / 1e4
            ),
            Self::AlbedoUnused => write!(
                f,
                "albedo: got a texture, needs none for Output::Scattered, which is multiplied by albedo after it"
            ),
            Self::Limit { limit, got, needs } => {
                write!(f, "device: {limit}: got {got}, needs {needs}, a default of WebGPU")
            }
            Self::NotPrepared => write!(f, "view: got render, needs prepare before it"),
            Self::NoPyramid => write!(f, "view: got the exact sum, needs a plan to show what it does"),
            #[cfg(feature = "json")]
            Self::Json { input, got, needs } => write!(f, "{input}: got \"{got}\", needs {needs}"),
        }
    }
}

impl std::error::Error for Error {}
