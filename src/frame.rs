//! What a host hands over each frame, and what the effects hand back.

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, Mat3, Mat4, Vec2, Vec4};
use wgpu::{BlendComponent, BlendState, ColorTargetState, ColorWrites, TextureFormat, TextureView};

use crate::input::{self, Role};
use crate::{Error, Profile};

/// One frame of a deferred renderer, as [`ScreenSpace::prepare`](crate::ScreenSpace::prepare) and
/// [`PlannedScreenSpace::prepare`](crate::PlannedScreenSpace::prepare) take it.
///
/// All textures are two-dimensional, single-sampled, and of one size, that of the irradiance; what is
/// read has the usage `TEXTURE_BINDING`, the output `RENDER_ATTACHMENT`. Their views are of two
/// dimensions, of mip level 0 and in the texture's own format, which wgpu leaves to the host to see
/// to. It is `Copy`: `ScreenFrame { output: &other, ..frame }` is another of the same.
#[derive(Clone, Copy, Debug)]
pub struct ScreenFrame<'a> {
    /// Lit diffuse irradiance E, linear and finite RGB, *before* specular and tone mapping; three or
    /// four float channels. Before albedo, which multiplies the result; a host whose albedo holds no
    /// scattering of its own may multiply E by it instead. Alpha is kept.
    pub irradiance: &'a TextureView,
    /// Depth as `projection` wrote it: a depth format of 24 bits or more, or R32Float. Of a format
    /// that has stencil, too, the view must be depth-only. At the far plane there is no surface.
    pub depth: &'a TextureView,
    /// Which of `profiles` a pixel scatters by, counted from 1; 0 where nothing scatters. One
    /// unsigned integer channel, such as R8Uint. `None`: all that is nearer than the far plane
    /// scatters by the first.
    pub profile_id: Option<&'a TextureView>,
    /// Which way the surface faces. `None`, and where a texel has none: as the depth of the four
    /// pixels around says, which is the surface itself; take that unless depth is coarse.
    pub normal: Option<Normals<'a>>,
    /// How much a pixel takes of its scattered light, 0 to 1 in the first of one or more float
    /// channels, such as R8Unorm: less on lips, brows and where hair begins. Its own light scatters
    /// to others all the same. Where it is 0 the pixel stays bit for bit. `None`: 1.
    pub strength: Option<&'a TextureView>,
    /// Where the result goes, in the format that the effect was made for; what is written there says
    /// [`Output`].
    pub output: &'a TextureView,
    /// The rectangle of all of these textures that `projection` fills; nothing outside of it is read
    /// or written. `None`: all.
    pub viewport: Option<Viewport>,
    /// View space to clip space, as wgpu has it: depth from 0 to 1, y up. Perspective or
    /// orthographic, forward, reversed or infinite; off-centre and jittered ones, too. With glam one of
    /// `camera::rh::proj::directx`; those of `vulkan`, y down, and `opengl`, depth from -1, cannot be
    /// told from others and go wrong.
    pub projection: Mat4,
    /// Length of a scene unit in mm: 1000 where the scene is in metres.
    pub mm_per_unit: f32,
    /// The profiles of this frame, 1 to [`MAX_PROFILES`](crate::MAX_PROFILES).
    pub profiles: &'a [Profile],
}

/// Normals of the surface, not of a normal map: the area of skin that a pixel shows follows from them.
#[derive(Clone, Copy, Debug)]
pub struct Normals<'a> {
    /// X, y and z in a float, snorm or unorm format of four channels; of unorm ones, 0 to 1
    /// stands for -1 to 1, so that .5 in all is none: as what is less than .1 long.
    pub texture: &'a TextureView,
    /// Rotates them to view space: the identity where they are there already, the upper 3×3 of the view
    /// matrix where they are in world space. It mirrors z where the projection was made to.
    pub to_view: Mat3,
}

/// A rectangle of pixels, counted from the left and from above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Viewport {
    /// Its first column.
    pub x: u32,
    /// Its first row.
    pub y: u32,
    /// In pixels, 1 or more.
    pub width: u32,
    /// In pixels, 1 or more.
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
    /// The same, added to what is there: for a target that lacks the diffuse light. The irradiance must be
    /// that light with its albedo, which then is scattered, too. Rgba16Float, or Rgba32Float on devices
    /// that blend it.
    AddScattered(TextureFormat),
    /// What scattering changes, added to what is there: for a target that has the diffuse light
    /// already, so that a frame without the effect is right, too. The irradiance must be that light as it is
    /// in the target, albedo included, in a texture of its own. Red, green and blue; what does not scatter is
    /// not touched. Formats as for `AddScattered`.
    AddDifference(TextureFormat),
}

impl From<TextureFormat> for Output {
    fn from(format: TextureFormat) -> Self {
        Self::Scattered(format)
    }
}

impl Output {
    /// Of the target.
    pub fn format(self) -> TextureFormat {
        match self {
            Self::Scattered(format) | Self::AddScattered(format) | Self::AddDifference(format) => {
                format
            }
        }
    }

    /// Whether what is in the target stays and is added to.
    pub(crate) fn adds(self) -> bool {
        !matches!(self, Self::Scattered(_))
    }

    pub(crate) fn is_difference(self) -> bool {
        matches!(self, Self::AddDifference(_))
    }

    /// A target to which `channels` are written or added; alpha is the host's where anything is added.
    pub(crate) fn target(self, channels: ColorWrites) -> ColorTargetState {
        let sum = BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        ColorTargetState {
            format: self.format(),
            blend: self.adds().then_some(BlendState {
                color: sum,
                alpha: sum,
            }),
            write_mask: if self.adds() {
                ColorWrites::COLOR
            } else {
                channels
            },
        }
    }
}

impl ScreenFrame<'_> {
    /// Checks all of a frame but its projection.
    pub(crate) fn check(&self, output: Output) -> Result<(), Error> {
        let size = input::size(self.irradiance);
        input::check_texture("irradiance", self.irradiance, Role::Color, size)?;
        input::check_texture("depth", self.depth, Role::Depth, size)?;
        let mut read = vec![("irradiance", self.irradiance), ("depth", self.depth)];
        let optional = [
            ("profile_id", self.profile_id, Role::Id),
            ("normal", self.normal.map(|n| n.texture), Role::Normal),
            ("strength", self.strength, Role::Strength),
        ];
        for (name, view, role) in optional {
            if let Some(view) = view {
                input::check_texture(name, view, role, size)?;
                read.push((name, view));
            }
        }
        input::check_texture("output", self.output, Role::Target(output.format()), size)?;
        input::check_apart(self.output, &read)?;
        if let Some(normal) = self.normal
            && !(normal.to_view.is_finite() && normal.to_view.determinant() != 0.0)
        {
            return Err(Error::new(
                "normal: to_view",
                format!("{}", normal.to_view),
                "a finite rotation",
            ));
        }
        let Viewport {
            x,
            y,
            width,
            height,
        } = self.viewport();
        let fits = |first: u32, length: u32, size: u32| {
            length > 0 && first.checked_add(length).is_some_and(|end| end <= size)
        };
        if !fits(x, width, size[0]) || !fits(y, height, size[1]) {
            return Err(Error::new(
                "viewport",
                format!("{width}x{height} at {x}, {y}"),
                format!("a rectangle within {}x{}", size[0], size[1]),
            ));
        }
        input::check_mm_per_unit(self.mm_per_unit)?;
        input::check_profiles(self.profiles)?;
        Ok(())
    }

    /// The rectangle that is looked at.
    pub(crate) fn viewport(&self) -> Viewport {
        let [width, height] = input::size(self.irradiance);
        self.viewport.unwrap_or(Viewport {
            x: 0,
            y: 0,
            width,
            height,
        })
    }
}

/// Normals as the shaders have them.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct NormalSettings {
    pub has: u32,
    pub pad: u32,
    /// x·n + y has -1 to 1.
    pub decode: Vec2,
    /// Columns.
    pub to_view: [Vec4; 3],
}

impl NormalSettings {
    pub fn new(normals: Option<Normals>) -> Self {
        let Some(Normals { texture, to_view }) = normals else {
            return Self::zeroed();
        };
        let [x, y, z] = to_view.to_cols_array_2d();
        let unorm = input::is_unorm(texture.texture().format());
        Self {
            has: 1,
            pad: 0,
            decode: if unorm {
                Vec2::new(2.0, -1.0)
            } else {
                Vec2::new(1.0, 0.0)
            },
            to_view: [x, y, z].map(|[a, b, c]| Vec4::new(a, b, c, 0.0)),
        }
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

/// Where a frame's pixels are, in mm.
pub(crate) struct Optics {
    /// Normalised device coordinates to view space.
    pub inverse_projection: Mat4,
    /// The depth at which there is no surface.
    pub far: f32,
    /// x and y over z of the surface at the corner of the viewport, then the part that is not over z.
    pub origin: Vec4,
    /// The same for a step of one pixel.
    pub step: Vec4,
}

impl Optics {
    /// With clip x = P₀₀·X + P₀₂·z + P₀₃ and clip w = P₃₂·z + P₃₃, all in units of the scene,
    /// X = (x′·w − P₀₂·z − P₀₃)/P₀₀ at the device coordinate x′, which is linear over the pixels.
    pub fn new(frame: &ScreenFrame) -> Result<Self, Error> {
        let projection = frame.projection;
        // In double precision, since the inverse of a projection with a near plane of a millimetre loses
        // half of a float's digits.
        let mm = DMat4::from_scale(DVec3::splat(frame.mm_per_unit.into()));
        let inverse = (mm * projection.as_dmat4().inverse()).as_mat4();
        let [x, y, w] = [0, 1, 3].map(|i| projection.row(i));
        if !projection.is_finite() || !inverse.is_finite() || x.y != 0.0 || y.x != 0.0 {
            return Err(Error::new(
                "projection",
                format!("{projection}"),
                "a finite, invertible projection whose x and y stay apart",
            ));
        }
        let distance = |depth: f32| {
            let z = inverse.z_axis.z * depth + inverse.w_axis.z;
            let z = z / (inverse.z_axis.w * depth + inverse.w_axis.w);
            // An orthographic camera may see what is behind it, farther than what is before it.
            if w.z == 0.0 { -z } else { z.abs() }
        };
        let far = if distance(0.0) > distance(1.0) {
            0.0
        } else {
            1.0
        };
        let size = frame.viewport().size();
        let mm = frame.mm_per_unit;
        let at = |ndc: f32, row: Vec4, scale: f32| {
            [
                (ndc * w.z - row.z) / scale,
                (ndc * w.w - row.w) / scale * mm,
            ]
        };
        let step = |ndc: f32, scale: f32| [ndc * w.z / scale, ndc * w.w / scale * mm];
        let [ux, vx] = at(-1.0, x, x.x);
        let [uy, vy] = at(1.0, y, y.y);
        let [dux, dvx] = step(2.0 / size[0] as f32, x.x);
        let [duy, dvy] = step(-2.0 / size[1] as f32, y.y);
        Ok(Self {
            inverse_projection: inverse,
            far,
            origin: Vec4::new(ux, uy, vx, vy),
            step: Vec4::new(dux, duy, dvx, dvy),
        })
    }

    /// z = (x·depth + y)/(z·depth + w), in mm.
    pub fn depth_to_mm(&self) -> Vec4 {
        let m = self.inverse_projection;
        Vec4::new(m.z_axis.z, m.w_axis.z, m.z_axis.w, m.w_axis.w)
    }

    /// x and y over z at the corner of the viewport, and what a pixel adds.
    pub fn rays(&self) -> Vec4 {
        Vec4::new(self.origin.x, self.origin.y, self.step.x, self.step.y)
    }

    /// The mm between pixels of a surface that faces the camera, at z mm in view space: along a row
    /// |x + y·z|, along a column |z + w·z|; signed as the axes of the picture are.
    pub fn spacing(&self) -> Vec4 {
        let s = self.step;
        Vec4::new(s.z, s.x, s.w, s.y)
    }
}
