//! What the chart times: a way to scatter a frame, or an atlas. Each takes what a host hands over
//! and gives what a host gets back.

use subsurface::wgpu::{CommandEncoder, Device};
use subsurface::{Atlas, Error, ScreenFrame, ScreenSpace, TextureSpace};

/// A method over a frame of a deferred renderer.
pub trait ScreenMethod {
    /// Checks and uploads; not timed.
    fn prepare(&mut self, device: &Device, frame: &ScreenFrame) -> Result<(), Error>;
    /// Records the frame that was last prepared; timed.
    fn render(&self, encoder: &mut CommandEncoder);
    /// Texel fetches for a pixel of skin that faces the camera at `px_per_mm`, where they can be
    /// counted.
    fn fetches(&self, px_per_mm: f64) -> Option<f64>;
    /// Textures of its own, in bytes a pixel of the frame.
    fn scratch_bytes_per_pixel(&self) -> f64;
}

/// A method over an atlas.
pub trait AtlasMethod {
    /// Checks and uploads; not timed.
    fn prepare(&mut self, device: &Device, atlas: &Atlas) -> Result<(), Error>;
    /// Records the atlas that was last prepared; timed.
    fn render(&self, encoder: &mut CommandEncoder);
    /// Textures of its own, in bytes a texel of the atlas.
    fn scratch_bytes_per_texel(&self) -> f64;
}
