//! Subsurface scattering of skin as a post-process for wgpu renderers, after Li & Shao 2015.

mod error;
mod gaussian_sum;
mod input;
mod profile;
#[cfg(feature = "renderer")]
pub mod renderer;
mod screen_space;
mod texture_space;
#[cfg(test)]
mod wgsl;

pub use error::Error;
pub use profile::{Gaussian, Profile};
pub use screen_space::{ScreenFrame, ScreenSpace};
pub use texture_space::{Atlas, TextureSpace};
pub use wgpu;

/// The most profiles that a frame can mix.
pub const MAX_PROFILES: usize = 16;
