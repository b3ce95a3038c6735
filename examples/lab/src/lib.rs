//! What measures `subsurface`: a small deferred renderer that plays the host, the integrals that all is held
//! against, the methods of others, and the programs that put them side by side.

pub mod chart;
pub mod compare;
pub mod damage;
mod error;
pub mod filter;
pub mod method;
pub mod metrics;
pub mod model;
pub mod output;
mod page;
pub mod renderer;
mod rivals;
mod srgb;
pub mod stability;
mod svg;
pub mod synthetic;
pub mod truth;
#[cfg(test)]
mod wgsl;

pub use error::Error;

/// The built-in head: made from the MakeHuman base mesh (CC0) by `compare/make_head.py`.
pub const HEAD: &[u8] = include_bytes!("compare/head.glb");
