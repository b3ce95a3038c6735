//! What measures `subsurface`: a small deferred renderer that plays the host, the integrals that all is held
//! against, the methods of others, and the programs that put them side by side.

#[cfg(feature = "programs")]
pub mod chart;
#[cfg(feature = "programs")]
pub mod cli;
#[cfg(feature = "programs")]
pub mod compare;
#[cfg(feature = "programs")]
pub mod damage;
mod error;
#[cfg(feature = "programs")]
pub mod filter;
pub mod method;
pub mod metrics;
#[cfg(feature = "programs")]
pub mod model;
#[cfg(feature = "programs")]
pub mod output;
#[cfg(feature = "programs")]
mod page;
mod passes;
#[cfg(feature = "programs")]
pub mod profile;
pub mod renderer;
pub mod rivals;
#[cfg(feature = "programs")]
pub mod specular;
#[cfg(feature = "programs")]
mod srgb;
#[cfg(feature = "programs")]
pub mod stability;
#[cfg(feature = "programs")]
mod svg;
#[cfg(feature = "programs")]
pub mod synthetic;
#[cfg(feature = "programs")]
pub mod truth;
#[cfg(feature = "programs")]
pub mod uses;
#[cfg(test)]
#[path = "../../../src/wgsl/structs.rs"]
mod wgsl;

pub use error::Error;

/// The built-in head: made from the MakeHuman base mesh (CC0) by `compare/make_head.py`.
pub const HEAD: &[u8] = include_bytes!("compare/head.glb");
