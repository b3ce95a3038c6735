//! Subsurface scattering of skin as a post-process for wgpu renderers, after Li & Shao 2015.
//!
//! A deferred renderer hands its lit diffuse irradiance and its depth to [`ScreenSpace`] and gets
//! the scattered irradiance back, to be multiplied by albedo. [`TextureSpace`] does the same over
//! an atlas of a mesh, the way of the paper; it is the reference that the screen is compared with.
//! Both blur by a [`Profile`], a sum of Gaussians with variances in mm².
//!
//! Features: `json` reads profiles from files; `renderer` is a small deferred renderer that plays
//! the host in the examples and tests; `truth` sums the integrals that all is measured against.

mod error;
mod exact;
mod frame;
mod gpu;
mod optics;
pub mod plan;
mod profile;
mod pyramid;
mod screen_space;
mod texture_space;
mod validate;
#[cfg(test)]
mod wgsl;

pub use error::Error;
pub use frame::{Frame, Output, Viewport};
pub use plan::{DEFAULT_MAX_ERROR, Plan};
pub use profile::{Gaussian, Profile};
pub use screen_space::{ScreenSpace, View};
pub use texture_space::{Atlas, TextureSpace};
pub use wgpu;

/// The most profiles that a frame can mix.
pub const MAX_PROFILES: usize = 16;
