//! The plugin within Bevy, on any adapter, headless.

mod cameras;
mod filter;
mod life;
mod lighting;
mod picture;
mod pictures;
mod scene;
#[path = "../../examples/head/smooth.rs"]
mod smooth;
mod stage;
mod width;
