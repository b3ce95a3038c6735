//! Subsurface scattering of skin as a post-process for wgpu renderers, after Li & Shao 2015.
//!
//! A deferred renderer hands over the diffuse light on its surfaces and their depth, and gets that light
//! back as skin spreads it:
//!
//! ```text
//! G-buffer → diffuse light E → [ subsurface ] → × albedo → + specular → transparency → TAA → tone mapping
//! ```
//!
//! # One frame
//! 1. A [`Plan`] says what is done: which blurs keep a stated error for a set of [`Profile`]s, sums of
//!    Gaussians with variances in mm². [`Plan::skin`] is there at once; [`Plan::exact`] is the sum itself.
//! 2. A [`ScreenSpace`] is that plan on a device: pipelines, made once and shared by all cameras.
//! 3. A [`View`] is what one camera needs: scratch textures. Each frame [`View::prepare`] checks a [`Frame`]
//!    and uploads a few hundred bytes; [`View::render`] records the passes. Nothing is submitted, and no
//!    pipeline is made.
//!
//! [`TextureSpace`] scatters over an atlas of a mesh, the way of the paper: the reference that the screen
//! is compared with.
//!
//! # Conventions
//! Light is linear. Lengths are millimetres; [`Frame::mm_per_unit`] says how many a scene unit has. Matrices
//! are column by column, view space is right-handed, depth runs from 0 to 1 in any direction. Errors are in
//! units of white: of the radiance that the host shows as 1. What wgpu tells of an input is checked before the device sees
//! it, and what does not fit is an [`Error`] that names it.
//!
//! Features of the device: none, and no more than WebGPU's default limits. Feature `json` of the crate:
//! profiles and plans as JSON, and serde's traits for them. Feature `physics`: profiles from layers, pigments
//! and scattering coefficients.

mod error;
mod exact;
mod frame;
mod gpu;
mod optics;
mod overlay;
#[cfg(feature = "physics")]
pub mod physics;
pub mod plan;
mod profile;
mod pyramid;
mod screen_space;
mod texture_space;
mod validate;
#[cfg(test)]
mod wgsl;

pub use error::Error;
pub use frame::{BackLayer, Frame, Output, Viewport};
pub use overlay::{Overlay, Show};
pub use plan::{DEFAULT_MAX_ERROR, Plan};
pub use profile::{Gaussian, Profile};
#[doc(hidden)] // of use to the lab alone
pub use pyramid::Tiles;
pub use screen_space::{ScreenSpace, View};
pub use texture_space::{Atlas, AtlasView, TextureSpace};
pub use wgpu;

/// The most profiles that a frame can mix.
pub const MAX_PROFILES: usize = 16;

/// The code of the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
