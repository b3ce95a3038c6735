//! What is compared: a way to scatter a frame, or an atlas. Each takes what a host hands over and gives
//! what a host gets back.

use subsurface::wgpu::{CommandEncoder, Device, Queue, TextureFormat, TextureView};
use subsurface::{Atlas, AtlasView, Frame, Plan, Profile, ScreenSpace, TextureSpace, View};

use crate::Error;
use crate::renderer::Gpu;

/// A method over a frame of a deferred renderer.
pub trait ScreenMethod {
    /// Checks and uploads; the chart does not time it.
    fn prepare(&mut self, device: &Device, queue: &Queue, frame: &Frame) -> Result<(), Error>;
    /// Records the frame that was last prepared; the chart times it.
    fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error>;
    /// Texel fetches for a pixel of skin that faces the camera at `px_per_mm`, where they can be
    /// counted.
    fn fetches(&self, px_per_mm: f64) -> Option<f64>;
    /// Textures of its own, in bytes a pixel of a frame of 1920×1080.
    fn scratch_bytes_per_pixel(&self) -> f64;
}

/// A method over an atlas.
pub trait AtlasMethod {
    /// Checks and uploads; the chart does not time it.
    fn prepare(&mut self, device: &Device, queue: &Queue, atlas: &Atlas) -> Result<(), Error>;
    /// Records the atlas that was last prepared; the chart times it.
    fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error>;
    /// Textures of its own, in bytes a texel of the atlas.
    fn scratch_bytes_per_texel(&self) -> f64;
}

/// Has a method scatter a frame, and waits for it.
pub fn scatter(
    gpu: &Gpu,
    method: &mut dyn ScreenMethod,
    frame: &Frame,
    output: &TextureView,
) -> Result<(), Error> {
    method.prepare(&gpu.device, &gpu.queue, frame)?;
    gpu.run(|encoder| method.render(encoder, output))
}

/// Has a method scatter an atlas, and waits for it.
pub fn scatter_atlas(
    gpu: &Gpu,
    method: &mut dyn AtlasMethod,
    atlas: &Atlas,
    output: &TextureView,
) -> Result<(), Error> {
    method.prepare(&gpu.device, &gpu.queue, atlas)?;
    gpu.run(|encoder| method.render(encoder, output))
}

/// This crate's effect, of one view.
pub struct Ours {
    pub effect: ScreenSpace,
    pub view: View,
    /// Whether the frame that was last prepared has a layer behind.
    has_back: bool,
}

impl Ours {
    /// # Errors
    /// A format or a device that the effect refuses.
    pub fn new(device: &Device, output: TextureFormat, plan: &Plan) -> Result<Self, Error> {
        Ok(Self { effect: ScreenSpace::new(device, output, plan)?, view: View::new(), has_back: false })
    }
}

impl ScreenMethod for Ours {
    fn prepare(&mut self, device: &Device, queue: &Queue, frame: &Frame) -> Result<(), Error> {
        self.has_back = frame.back.is_some();
        Ok(self.view.prepare(device, queue, &self.effect, frame)?)
    }

    fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error> {
        Ok(self.view.render(encoder, output)?)
    }

    fn fetches(&self, px_per_mm: f64) -> Option<f64> {
        let plan = self.effect.plan();
        if self.has_back {
            return None;
        }
        match plan.is_exact() {
            true => Some(exact_fetches(px_per_mm)),
            // Of a pixel on a simple tile; the others read where each tap lies, too.
            false => plan.fetches(0, px_per_mm as f32).map(f64::from),
        }
    }

    fn scratch_bytes_per_pixel(&self) -> f64 {
        let size = [1920, 1080];
        let back = if self.has_back { self.effect.back_scratch_bytes(size) } else { 0 };
        (self.effect.scratch_bytes(size) + back) as f64 / (1920.0 * 1080.0)
    }
}

/// What the exact sum loads by `Profile::SKIN` facing the camera, where no row strays: positions, areas and
/// the metric of each pass included.
fn exact_fetches(px_per_mm: f64) -> f64 {
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
    fetches
}

/// This crate's effect over an atlas, of one view.
pub struct OursUnrolled {
    pub effect: TextureSpace,
    pub view: AtlasView,
}

impl OursUnrolled {
    /// # Errors
    /// A format that the effect refuses.
    pub fn new(device: &Device, output: TextureFormat, profiles: &[Profile]) -> Result<Self, Error> {
        Ok(Self { effect: TextureSpace::new(device, output, profiles)?, view: AtlasView::new() })
    }
}

impl AtlasMethod for OursUnrolled {
    fn prepare(&mut self, device: &Device, queue: &Queue, atlas: &Atlas) -> Result<(), Error> {
        Ok(self.view.prepare(device, queue, &self.effect, atlas)?)
    }

    fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error> {
        Ok(self.view.render(encoder, output)?)
    }

    fn scratch_bytes_per_texel(&self) -> f64 {
        64.0
    }
}
