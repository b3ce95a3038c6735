//! What the examples compare: a way to scatter a frame, or an atlas. Each takes what a host hands over
//! and gives what a host gets back.

use subsurface::wgpu::{CommandEncoder, Device, Queue};
use subsurface::{
    Atlas, Error, Plan, PlannedScreenSpace, Profile, ScreenFrame, ScreenSpace, TextureSpace,
};

/// A method over a frame of a deferred renderer.
pub trait ScreenMethod {
    /// Checks and uploads; the chart does not time it.
    fn prepare(&mut self, device: &Device, frame: &ScreenFrame) -> Result<(), Error>;
    /// Records the frame that was last prepared; the chart times it.
    fn render(&self, encoder: &mut CommandEncoder);
    /// Texel fetches for a pixel of skin that faces the camera at `px_per_mm`, where they can be
    /// counted.
    fn fetches(&self, px_per_mm: f64) -> Option<f64>;
    /// Textures of its own, in bytes a pixel of the frame.
    fn scratch_bytes_per_pixel(&self) -> f64;
}

/// A method over an atlas.
pub trait AtlasMethod {
    /// Checks and uploads; the chart does not time it.
    fn prepare(&mut self, device: &Device, atlas: &Atlas) -> Result<(), Error>;
    /// Records the atlas that was last prepared; the chart times it.
    fn render(&self, encoder: &mut CommandEncoder);
    /// Textures of its own, in bytes a texel of the atlas.
    fn scratch_bytes_per_texel(&self) -> f64;
}

/// Full floats between passes; scratch as documented.
impl ScreenMethod for ScreenSpace {
    fn prepare(&mut self, device: &Device, frame: &ScreenFrame) -> Result<(), Error> {
        self.prepare(device, frame)
    }

    fn render(&self, encoder: &mut CommandEncoder) {
        self.render(encoder);
    }

    /// What the shaders load by `Profile::SKIN` facing the camera, where no row strays: positions, areas and
    /// the metric of each pass included.
    fn fetches(&self, px_per_mm: f64) -> Option<f64> {
        // A point and its four neighbours.
        const METRIC: f64 = 5.0;
        // Depth and id; the area and E; the sum, the id and the alpha that is kept.
        let mut fetches = 2.0 + (METRIC + 1.0) + 3.0;
        for (i, g) in Profile::SKIN.gaussians().iter().enumerate() {
            let reach = (3.5 * f64::from(g.variance_mm2).sqrt() * px_per_mm).ceil();
            let row = 2.0 * reach + 1.0;
            // Two loads a tap: its point, and its light or its row's sum.
            let is_small = f64::from(g.variance_mm2) * px_per_mm * px_per_mm <= 0.4;
            let second = if is_small { 9.0 } else { row };
            fetches += 2.0 * METRIC + 2.0 * row + 2.0 * second;
            // The sum so far.
            fetches += if i > 0 { 1.0 } else { 0.0 };
        }
        Some(fetches)
    }

    fn scratch_bytes_per_pixel(&self) -> f64 {
        80.0
    }
}

/// Scattering in screen space at a stated error.
pub struct Planned {
    pub effect: PlannedScreenSpace,
    pub queue: Queue,
    pub plan: Plan,
}

impl ScreenMethod for Planned {
    fn prepare(&mut self, device: &Device, frame: &ScreenFrame) -> Result<(), Error> {
        self.effect.prepare(device, &self.queue, frame, &self.plan)
    }

    fn render(&self, encoder: &mut CommandEncoder) {
        self.effect.render(encoder);
    }

    /// Of a pixel on a simple tile; the others read where each tap lies, too.
    fn fetches(&self, px_per_mm: f64) -> Option<f64> {
        self.plan.fetches(0, px_per_mm as f32).map(f64::from)
    }

    fn scratch_bytes_per_pixel(&self) -> f64 {
        23.9
    }
}

impl AtlasMethod for TextureSpace {
    fn prepare(&mut self, device: &Device, atlas: &Atlas) -> Result<(), Error> {
        self.prepare(device, atlas)
    }

    fn render(&self, encoder: &mut CommandEncoder) {
        self.render(encoder);
    }

    fn scratch_bytes_per_texel(&self) -> f64 {
        64.0
    }
}
