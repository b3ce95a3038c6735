//! What a host hands over each frame, and what it gets back.

use wgpu::{BlendComponent, BlendState, ColorTargetState, ColorWrites, TextureFormat, TextureView};

/// One frame of a deferred renderer, seen by one camera.
///
/// All textures are two-dimensional, single-sampled, of one size (that of the irradiance), and have the
/// usage `TEXTURE_BINDING`. Views are two-dimensional, of mip level 0 and of any one layer, in the texture's
/// own format; wgpu does not tell, so this is not checked. Start from [`Frame::new`] and set what you have:
///
/// ```
/// # fn frame(irradiance: &wgpu::TextureView, depth: &wgpu::TextureView, id: &wgpu::TextureView) {
/// # let projection = [[0.0; 4]; 4];
/// let mut frame = subsurface::Frame::new(irradiance, depth, projection);
/// frame.profile_id = Some(id);
/// # }
/// ```
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Frame<'a> {
    /// Lit diffuse irradiance E: linear and finite RGB, *before* specular and tone mapping. Three or four
    /// float or normalised channels. Without albedo, which multiplies the result; a host whose albedo
    /// shows no scattering of its own may hand in E × albedo. Alpha is kept.
    pub irradiance: &'a TextureView,
    /// Depth as `projection` wrote it: any depth format, or R32Float; 16 bits need a near plane that is not too
    /// near (docs/integration.md). Of a format that has stencil, too, the view must be depth-only. There is no
    /// surface at the far plane.
    pub depth: &'a TextureView,
    /// View space to clip space, column by column (`to_cols_array_2d` in glam): right-handed, y up, depth
    /// from 0 to 1, as wgpu has it. Perspective or orthographic; forward, reversed or infinite depth;
    /// off-centre and jittered. In glam 0.34 these are the functions of `camera::rh::proj::directx`. Those of
    /// `opengl` (depth from −1) and `vulkan` (y down) cannot be told from others and give wrong results.
    pub projection: [[f32; 4]; 4],
    /// Length of a scene unit in mm. Default: 1000, a scene in metres.
    pub mm_per_unit: f32,
    /// The distance of the nearest skin along the camera's axis, in units of the scene, or less: the nearest point
    /// of all bounding spheres. A plan leaves out the passes that only nearer skin needs: 11 are left of 23 for a
    /// head that fills a third of 1920×1080. Skin that is nearer all the same scatters too little. Default,
    /// `None`: the near plane. Orthographic cameras do not need it.
    pub nearest: Option<f32>,
    /// Which of the plan's profiles a pixel scatters by, counted from 1; 0 where nothing scatters. One
    /// unsigned integer channel, such as R8Uint. Default, `None`: all that is nearer than the far plane
    /// scatters by the first. Ids of equal profiles are one: light crosses from the one to the other.
    pub profile_id: Option<&'a TextureView>,
    /// The share of its scattered light that a pixel takes, 0 to 1, in the first of one or more float
    /// channels, such as R8Unorm: less on lips, on brows and where hair begins. Its own light scatters to
    /// others all the same. Where it is 0 the pixel stays bit for bit. Default, `None`: 1.
    pub strength: Option<&'a TextureView>,
    /// Albedo, linear RGB, that multiplies what is added by [`Output::AddScattered`] and
    /// [`Output::AddDifference`], so that paint stays sharp: three or four float or normalised channels, such as
    /// Rgba8UnormSrgb. The irradiance is then without albedo.
    /// [`Output::Scattered`] refuses it, since its result is multiplied by albedo after the effect. Default,
    /// `None`: 1, for an irradiance that has the albedo in it.
    pub albedo: Option<&'a TextureView>,
    /// The rectangle of all these textures that `projection` fills. Nothing outside is read or written.
    /// Default, `None`: all.
    pub viewport: Option<Viewport>,
    /// The surface right behind the visible one, for light that comes through thin parts and around rims.
    /// Default, `None`: what the camera does not see scatters nothing.
    pub back: Option<BackLayer<'a>>,
}

/// The surface right behind the visible one: the far side of an ear, a nostril or a finger.
///
/// Draw the skin again with the faces that look away from the camera, keep of each pixel the nearest one behind
/// the visible depth, and light it as the visible one is: with its own normal and its own shadows. An ear
/// shadows its own back, so without them it glows on the wrong side. A mesh that is closed is needed; of an open
/// one, or of a card, the back is another part or none.
///
/// Textures are of the frame's size and projection, and follow [`Frame::viewport`]. Only what lies near behind
/// visible skin counts, elsewhere they may hold anything: within 3.5 σ of the widest Gaussian by the exact sum,
/// 9.5 mm for skin; by a plan as far as its error can tell, 6.7 mm at 1/255 where the light of both differs by 1.
/// Each Gaussian is summed over both layers by distance in space and divided by its mass over both, so that even
/// light stays even.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct BackLayer<'a> {
    /// Lit diffuse irradiance of the back, as [`Frame::irradiance`] is. Alpha is not read.
    pub irradiance: &'a TextureView,
    /// Its depth, as [`Frame::depth`] is; that of the far plane where there is no back.
    pub depth: &'a TextureView,
    /// Its profiles, as [`Frame::profile_id`] has them; a layer scatters to pixels of its own profile alone.
    /// Default, `None`: those of the visible surface in the same pixel.
    pub profile_id: Option<&'a TextureView>,
}

impl<'a> BackLayer<'a> {
    /// A layer of these two, of the profiles of the visible surface.
    pub fn new(irradiance: &'a TextureView, depth: &'a TextureView) -> Self {
        Self { irradiance, depth, profile_id: None }
    }
}

/// A rectangle of pixels, counted from the left and from above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Viewport {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
}

/// What an effect writes, and in which format.
///
/// A texture format alone stands for [`Output::Scattered`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// The scattered light, and the light as it was where nothing scatters: for a texture of its own,
    /// which a final pass multiplies by albedo. Three or four float channels.
    Scattered(TextureFormat),
    /// The same, times [`Frame::albedo`], added to the target on every pixel of the viewport: for one that
    /// lacks all diffuse light, that of cloth and sky, too. Alpha stays. Rgba16Float, or Rgba32Float on devices
    /// that blend it.
    AddScattered(TextureFormat),
    /// What scattering changes, times [`Frame::albedo`], added to the target: for one that has the diffuse
    /// light already, so that a frame without the effect is right, too. What is added may be negative.
    /// The target cannot be the irradiance itself: the host draws its diffuse light twice, once alone and
    /// once with all else. Red, green and blue alone; what does not scatter is not touched. Formats as for
    /// `AddScattered`.
    AddDifference(TextureFormat),
}

impl From<TextureFormat> for Output {
    fn from(format: TextureFormat) -> Self {
        Self::Scattered(format)
    }
}

impl Output {
    /// The format of the target.
    pub fn format(self) -> TextureFormat {
        match self {
            Self::Scattered(format) | Self::AddScattered(format) | Self::AddDifference(format) => format,
        }
    }

    /// Whether what is in the target stays and is added to.
    pub(crate) fn adds(self) -> bool {
        !matches!(self, Self::Scattered(_))
    }

    pub(crate) fn is_difference(self) -> bool {
        matches!(self, Self::AddDifference(_))
    }

    /// A target to which `channels` are written or added. Alpha is the host's where anything is added.
    pub(crate) fn target(self, channels: ColorWrites) -> ColorTargetState {
        let sum = BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        ColorTargetState {
            format: self.format(),
            blend: self.adds().then_some(BlendState { color: sum, alpha: sum }),
            write_mask: if self.adds() { ColorWrites::COLOR } else { channels },
        }
    }
}

impl<'a> Frame<'a> {
    /// A frame of these three, all else at its default.
    pub fn new(irradiance: &'a TextureView, depth: &'a TextureView, projection: [[f32; 4]; 4]) -> Self {
        Self {
            irradiance,
            depth,
            projection,
            mm_per_unit: 1000.0,
            nearest: None,
            profile_id: None,
            strength: None,
            albedo: None,
            viewport: None,
            back: None,
        }
    }

    /// The textures that are read, by the names of their fields.
    pub(crate) fn textures(&self) -> impl Iterator<Item = (&'static str, &'a TextureView)> {
        [
            ("irradiance", Some(self.irradiance)),
            ("depth", Some(self.depth)),
            ("profile_id", self.profile_id),
            ("strength", self.strength),
            ("albedo", self.albedo),
            ("back.irradiance", self.back.map(|back| back.irradiance)),
            ("back.depth", self.back.map(|back| back.depth)),
            ("back.profile_id", self.back.and_then(|back| back.profile_id)),
        ]
        .into_iter()
        .filter_map(|(name, view)| Some((name, view?)))
    }

    /// Width and height of the textures.
    pub(crate) fn size(&self) -> [u32; 2] {
        let texture = self.irradiance.texture();
        [texture.width(), texture.height()]
    }

    /// The rectangle that is looked at.
    pub(crate) fn rectangle(&self) -> Viewport {
        let [width, height] = self.size();
        self.viewport.unwrap_or(Viewport { x: 0, y: 0, width, height })
    }
}

impl Viewport {
    pub(crate) fn size(self) -> [u32; 2] {
        [self.width, self.height]
    }

    pub(crate) fn first(self) -> glam::UVec2 {
        glam::UVec2::new(self.x, self.y)
    }

    /// Keeps a pass within the rectangle, and its clip space in it.
    pub(crate) fn apply(self, pass: &mut wgpu::RenderPass) {
        let [x, y, width, height] = [self.x, self.y, self.width, self.height];
        pass.set_viewport(x as f32, y as f32, width as f32, height as f32, 0.0, 1.0);
        pass.set_scissor_rect(x, y, width, height);
    }
}
