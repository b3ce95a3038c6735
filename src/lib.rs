//! Subsurface scattering of skin as a post-process for wgpu renderers, after Li & Shao 2015.
//!
//! A deferred renderer hands its lit diffuse irradiance and its depth to [`ScreenSpace`] and gets
//! the scattered irradiance back, to be multiplied by albedo. [`TextureSpace`] does the same over
//! an atlas of a mesh, the way of the paper; it is the reference that the screen is compared with.
//! Both blur by a [`Profile`], a sum of Gaussians with variances in mm².
//!
//! Features: `json` reads profiles from files; `physics` makes them from layers, pigments and scattering
//! coefficients; `renderer` is a small deferred renderer that plays
//! the host in the examples and tests; `truth` sums the integrals that all is measured against.

mod error;
mod frame;
mod gaussian_sum;
mod input;
#[cfg(feature = "physics")]
pub mod physics;
mod plan;
mod planned;
mod profile;
mod pyramid;
#[cfg(feature = "renderer")]
pub mod renderer;
mod screen_space;
mod texture_space;
#[cfg(feature = "truth")]
pub mod truth;
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
