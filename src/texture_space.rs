//! Scattering in texture space, the way of Li & Shao 2015: the reference path.

use std::sync::Arc;

use wgpu::{CommandEncoder, Device, QuerySet, Queue, TextureFormat, TextureView};

use crate::exact::gaussian_sum::{GaussianSum, Inputs, Settings, Sums, Textures};
use crate::gpu::Recorder;
use crate::validate::{self, Role};
use crate::{Error, Output, Profile};

/// Texels to which the result is carried past the edge of an island, so that a bilinear fetch at
/// a seam finds skin on both sides.
const GUTTER: i32 = 4;

/// One surface unrolled into its UV space, as [`AtlasView::prepare`] takes it.
///
/// A surface that shares its UVs with another, or with itself, needs an atlas for each: a texel has room
/// for one point. All textures are two-dimensional, single-sampled, of one size, and have the usage
/// `TEXTURE_BINDING`.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Atlas<'a> {
    /// Lit diffuse irradiance E at each texel, linear and finite RGB, before albedo. Three or four float
    /// channels.
    pub irradiance: &'a TextureView,
    /// Position of each texel's point in scene units, and in alpha the number of its profile, counted from
    /// 1; 0 where there is no surface. Rgba32Float. Relative to the mesh where the world is large: a
    /// kilometre away a float's step is 0.06 mm.
    pub positions: &'a TextureView,
    /// Length of a scene unit in mm. Default: 1000, a scene in metres.
    pub mm_per_unit: f32,
}

impl<'a> Atlas<'a> {
    /// An atlas of these two, in metres.
    pub fn new(irradiance: &'a TextureView, positions: &'a TextureView) -> Self {
        Self { irradiance, positions, mm_per_unit: 1000.0 }
    }
}

/// Scattering over an atlas (Li & Shao 2015, Eq. 7 to 12): each Gaussian in two passes along u and the
/// sheared v, by the distances between the texels' points, which corrects stretch and shear of the UVs.
///
/// As a [`ScreenSpace`](crate::ScreenSpace) it holds all pipelines: make it where you load. A clone shares
/// them, and one effect serves any number of [`AtlasView`]s. Each frame and atlas, the host draws its mesh into
/// the atlas with [`VERTEX_WGSL`](Self::VERTEX_WGSL), a view scatters it, and the final pass samples the output
/// by the mesh's UVs.
#[derive(Clone, Debug)]
pub struct TextureSpace {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    output: Output,
    profiles: Vec<Profile>,
    sum: GaussianSum,
}

impl TextureSpace {
    /// WGSL for the host's vertex shader: `fn atlas_position(uv: vec2f) -> vec4f` gives the clip
    /// position that draws a vertex at its place in the atlas.
    pub const VERTEX_WGSL: &str = include_str!("../shaders/texture_space.wgsl");

    /// The effect for these profiles and outputs of this format, one of three or four float channels such
    /// as Rgba16Float. Makes all pipelines.
    ///
    /// # Errors
    /// A format that cannot be rendered to on this device; no profile, or more than
    /// [`MAX_PROFILES`](crate::MAX_PROFILES).
    pub fn new(device: &Device, output_format: TextureFormat, profiles: &[Profile]) -> Result<Self, Error> {
        let output = Output::Scattered(output_format);
        validate::output(device, output)?;
        validate::profiles(profiles)?;
        let sum = GaussianSum::new(device, output, "subsurface::TextureSpace", false);
        Ok(Self { shared: Arc::new(Shared { output, profiles: profiles.to_vec(), sum }) })
    }
}

/// What one atlas of a submission needs: scratch textures, 64 bytes a texel, and the numbers of its last frame.
///
/// [`prepare`](Self::prepare) checks and uploads, [`render`](Self::render) records, as a [`View`](crate::View)
/// does. Several atlases may take turns in one view if each is submitted before the next is prepared.
#[derive(Debug, Default)]
pub struct AtlasView {
    prepared: Option<(TextureSpace, Sums)>,
}

impl AtlasView {
    /// A view that was not prepared yet. It takes no memory on the device.
    pub fn new() -> Self {
        Self::default()
    }

    /// Checks an atlas and uploads what the shaders need. Scratch textures are made anew when its size
    /// has changed.
    ///
    /// # Errors
    /// The first input that does not fit; the atlas prepared before stays in place.
    pub fn prepare(
        &mut self,
        device: &Device,
        queue: &Queue,
        effect: &TextureSpace,
        atlas: &Atlas,
    ) -> Result<(), Error> {
        let texture = atlas.irradiance.texture();
        let size = [texture.width(), texture.height()];
        validate::texture("irradiance", atlas.irradiance, Role::Color, size)?;
        validate::texture("positions", atlas.positions, Role::Positions, size)?;
        validate::positive("mm_per_unit", atlas.mm_per_unit)?;
        let Shared { profiles, sum, .. } = &*effect.shared;
        // Scratch of another size goes before the new one comes.
        let kept = self.prepared.take().map(|(_, sums)| sums).filter(|sums| sums.size() == size);
        let mut sums = kept.unwrap_or_else(|| sum.sums(device, size));
        let textures = Textures {
            positions: atlas.positions.clone(),
            irradiance: atlas.irradiance.clone(),
            strength: atlas.irradiance.clone(),
            albedo: atlas.irradiance.clone(),
            back: None,
        };
        let settings = Settings { gutter: GUTTER, ..Settings::new(profiles, atlas.mm_per_unit) };
        sum.prepare(device, queue, &mut sums, Inputs::new(profiles, textures, settings, None));
        self.prepared = Some((effect.clone(), sums));
        Ok(())
    }

    /// Records the atlas that was last prepared. The result goes to `output`, of the format that the effect
    /// was made for and of the atlas's size; islands are dilated by 4 texels.
    ///
    /// # Errors
    /// An output that does not fit; a call before the first [`prepare`](Self::prepare).
    pub fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error> {
        self.record(encoder, output, None).map(|_| ())
    }

    /// Records as [`render`](Self::render), with times as [`View::render_timed`](crate::View::render_timed)
    /// takes them.
    ///
    /// # Errors
    /// As [`render`](Self::render).
    pub fn render_timed(
        &self,
        encoder: &mut CommandEncoder,
        output: &TextureView,
        queries: &QuerySet,
        first_query: u32,
    ) -> Result<Vec<String>, Error> {
        self.record(encoder, output, Some((queries, first_query)))
    }

    fn record(
        &self,
        encoder: &mut CommandEncoder,
        output: &TextureView,
        times: Option<(&QuerySet, u32)>,
    ) -> Result<Vec<String>, Error> {
        let (effect, sums) = self.prepared.as_ref().ok_or(Error::NotPrepared)?;
        let Shared { output: format, sum, .. } = &*effect.shared;
        let read = sums.read().into_iter();
        let inputs = read.flat_map(|t| [("irradiance", &t.irradiance), ("positions", &t.positions)]);
        validate::target(output, *format, sums.size(), inputs)?;
        let mut recorder = Recorder::new(encoder, times);
        sum.render(&mut recorder, sums, output);
        Ok(recorder.finish())
    }
}
