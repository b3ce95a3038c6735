//! Subsurface scattering of skin as a post-process for wgpu renderers, after Li & Shao 2015.
//!
//! A deferred renderer hands its lit diffuse irradiance and its depth to [`ScreenSpace`] and gets
//! the scattered irradiance back, to be multiplied by albedo. [`TextureSpace`] does the same over
//! an atlas of a mesh, the way of the paper; it is the reference that the screen is compared with.
//! Both blur by a [`Profile`], a sum of Gaussians with variances in mm².
//!
//! The feature `json` reads profiles from files.

mod error;
mod frame;
mod gaussian_sum;
mod input;
mod plan;
mod planned;
mod profile;
mod pyramid;
mod screen_space;
mod texture_space;
#[cfg(test)]
mod wgsl;

pub use error::Error;
pub use frame::{Normals, Output, ScreenFrame, Viewport};
pub use plan::{DEFAULT_MAX_ERROR, Plan, Row};
pub use planned::PlannedScreenSpace;
pub use profile::{Gaussian, Profile};
pub use screen_space::ScreenSpace;
pub use texture_space::{Atlas, TextureSpace};
pub use wgpu;

/// The most profiles that a frame can mix.
pub const MAX_PROFILES: usize = 16;

/// The code of the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
