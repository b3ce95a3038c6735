//! Profiles from what skin and other materials are made of.

pub mod artist;
mod complex;
mod diffusion;
mod fit;
mod kernel;
mod linear;
mod medium;
mod pigments;
pub mod presets;
mod quadrature;
mod response;
mod transport;

use crate::Error;

pub use diffusion::{Diffusion, single_scattering};
pub use fit::Fit;
pub use medium::{Layer, Medium};
pub use pigments::Skin;
pub use quadrature::fresnel_inside;
pub use response::Response;
pub use transport::{Incidence, Transport};

/// The error of a number out of its range.
fn number(input: impl Into<String>, got: f64, needs: &'static str) -> Error {
    Error::Number { input: input.into(), got, needs }
}
