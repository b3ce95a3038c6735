//! Scattering in texture space, the way of Li & Shao 2015: the reference path.

use wgpu::{CommandEncoder, Device, TextureFormat, TextureView};

use crate::gaussian_sum::{GaussianSum, Inputs, Settings};
use crate::input::{self, Role};
use crate::{Error, Profile};

/// Texels to which the result is carried past the edge of an island, so that a bilinear fetch at
/// a seam finds skin on both sides.
const GUTTER: i32 = 4;

/// One surface unrolled into its UV space, as [`TextureSpace::prepare`] takes it.
///
/// A surface that shares its UVs with another (or with itself) needs an atlas for each: a texel
/// has room for one point. All textures are two-dimensional, single-sampled, and of one size; their
/// views are of two dimensions, of mip level 0 and in the texture's own format, which wgpu leaves to
/// the host to see to.
#[derive(Clone, Copy, Debug)]
pub struct Atlas<'a> {
    /// Lit diffuse irradiance E at each texel, linear and finite RGB, before albedo; three or four
    /// float channels.
    pub irradiance: &'a TextureView,
    /// Position of each texel's point in scene units, and in alpha the number of its profile in
    /// `profiles`, counted from 1; 0 where there is no surface. Rgba32Float; relative to the mesh
    /// where the world is large, since a kilometre away a float's step is .06 mm.
    pub positions: &'a TextureView,
    /// Where the scattered irradiance goes, in the format that [`TextureSpace::new`] was told;
    /// islands are dilated by 4 texels.
    pub output: &'a TextureView,
    /// Length of a scene unit in mm: 1000 where the scene is in metres.
    pub mm_per_unit: f32,
    /// The profiles, 1 to [`MAX_PROFILES`](crate::MAX_PROFILES).
    pub profiles: &'a [Profile],
}

/// Scattering over an atlas: each Gaussian in two passes along u and the sheared v, by the
/// distances between the texels' points, which corrects stretch and shear of the UVs at once.
///
/// Each frame and atlas, the host draws its mesh into the atlas with
/// [`VERTEX_WGSL`](Self::VERTEX_WGSL), [`prepare`](Self::prepare) checks and uploads,
/// [`render`](Self::render) records, and the final pass samples the output by the mesh's UVs.
///
/// Scratch memory: 64 bytes a texel.
pub struct TextureSpace {
    output_format: TextureFormat,
    sum: GaussianSum,
}

impl TextureSpace {
    /// WGSL for the host's vertex shader: `fn atlas_position(uv: vec2f) -> vec4f` gives the clip
    /// position that draws a vertex at its place in the atlas.
    pub const VERTEX_WGSL: &str = include_str!("../shaders/texture_space.wgsl");

    /// The effect for outputs of `output_format`, a renderable format of three or four float
    /// channels such as Rgba16Float.
    ///
    /// # Errors
    /// A format that cannot be rendered to on this device.
    pub fn new(device: &Device, output_format: TextureFormat) -> Result<Self, Error> {
        input::check_output(device, output_format.into())?;
        Ok(Self {
            output_format,
            sum: GaussianSum::new(device, output_format.into(), "subsurface::TextureSpace"),
        })
    }

    /// Checks the inputs and uploads what the shaders need; scratch textures are made anew when
    /// the size has changed.
    ///
    /// # Errors
    /// The first input that does not fit; the atlas prepared before stays in place.
    pub fn prepare(&mut self, device: &Device, atlas: &Atlas) -> Result<(), Error> {
        let size = input::size(atlas.irradiance);
        input::check_texture("irradiance", atlas.irradiance, Role::Color, size)?;
        input::check_texture("positions", atlas.positions, Role::Positions, size)?;
        input::check_texture(
            "output",
            atlas.output,
            Role::Target(self.output_format),
            size,
        )?;
        input::check_apart(
            atlas.output,
            &[
                ("irradiance", atlas.irradiance),
                ("positions", atlas.positions),
            ],
        )?;
        input::check_mm_per_unit(atlas.mm_per_unit)?;
        input::check_profiles(atlas.profiles)?;
        self.sum.prepare(
            device,
            &Inputs {
                positions: atlas.positions,
                irradiance: atlas.irradiance,
                output: atlas.output,
                strength: None,
                normal: None,
                viewport: None,
                profiles: atlas.profiles,
                settings: Settings {
                    gutter: GUTTER,
                    ..Settings::new(atlas.profiles, atlas.mm_per_unit)
                },
            },
        );
        Ok(())
    }

    /// Records the atlas that was last prepared; nothing before the first.
    pub fn render(&self, encoder: &mut CommandEncoder) {
        self.render_by_pass(encoder, |_, _| ());
    }

    /// Records as [`render`](Self::render), and calls `after` with the label of each pass once that is
    /// recorded. There, timestamps can be written; or what is recorded so far submitted, with a new encoder
    /// in the place of the old one.
    pub fn render_by_pass(
        &self,
        encoder: &mut CommandEncoder,
        mut after: impl FnMut(&str, &mut CommandEncoder),
    ) {
        self.sum.render(encoder, &mut after);
    }
}
