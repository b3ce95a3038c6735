//! Scattering in screen space: a post-process over a host's G-buffer. Driver of
//! `shaders/screen_space.wgsl`.

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, Mat4, Vec4};
use wgpu::{CommandEncoder, Device, TextureFormat, TextureView};

use crate::gaussian_sum::{self, GaussianSum, Inputs};
use crate::input::{self, Role};
use crate::{Error, Profile};

/// One frame of a deferred renderer, as [`ScreenSpace::prepare`] takes it.
///
/// All textures are two-dimensional, single-sampled, and of one size; their views are of two
/// dimensions, of mip level 0 and in the texture's own format, which wgpu leaves to the host to see
/// to.
#[derive(Clone, Copy, Debug)]
pub struct ScreenFrame<'a> {
    /// Lit diffuse irradiance E, linear and finite RGB, *before* albedo, specular and tone
    /// mapping; three or four float channels. Alpha is kept.
    pub irradiance: &'a TextureView,
    /// Depth as `projection` wrote it: a depth format of 24 bits or more, or R32Float. Of a format
    /// that has stencil, too, the view must be depth-only.
    pub depth: &'a TextureView,
    /// Which of `profiles` a pixel scatters by, counted from 1; 0 where nothing scatters. One
    /// unsigned integer channel, such as R8Uint.
    pub profile_id: &'a TextureView,
    /// Where the result goes, in the format that [`ScreenSpace::new`] was told: the scattered
    /// irradiance, and the irradiance as it was where nothing scatters.
    pub output: &'a TextureView,
    /// View space to clip space, as wgpu has it: depth from 0 to 1, y up. Perspective or
    /// orthographic, forward, reversed or infinite; off-centre and jittered ones, too.
    pub projection: Mat4,
    /// Length of a scene unit in mm: 1000 where the scene is in metres.
    pub mm_per_unit: f32,
    /// The profiles of this frame, 1 to [`MAX_PROFILES`](crate::MAX_PROFILES).
    pub profiles: &'a [Profile],
}

/// Exact scattering in screen space: each Gaussian of the profile in two passes, by the distances
/// between the surface points that the pixels show.
///
/// It borrows what the host owns and never submits. Each frame, [`prepare`](Self::prepare) checks
/// and uploads, then [`render`](Self::render) records. A change of size is a changed input; to
/// switch it off, don't call it.
///
/// Scratch memory: 80 bytes a pixel.
pub struct ScreenSpace {
    output_format: TextureFormat,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
    positions: Option<TextureView>,
    group: Option<wgpu::BindGroup>,
    sum: GaussianSum,
}

/// `Settings` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Settings {
    inverse_projection: Mat4,
}

impl ScreenSpace {
    /// The effect for outputs of `output_format`, a renderable format of three or four float
    /// channels such as Rgba16Float.
    ///
    /// # Errors
    /// A format that cannot be rendered to on this device.
    pub fn new(device: &Device, output_format: TextureFormat) -> Result<Self, Error> {
        input::check_output_format(device, output_format)?;
        let label = "subsurface::ScreenSpace positions";
        let shader =
            device.create_shader_module(wgpu::include_wgsl!("../shaders/screen_space.wgsl"));
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(label),
            entries: &[
                gaussian_sum::UNIFORM,
                gaussian_sum::float_texture(1),
                gaussian_sum::uint_texture(2),
            ],
        });
        Ok(Self {
            output_format,
            pipeline: gaussian_sum::full_screen(
                device,
                &shader,
                label,
                "fs_positions",
                &layout,
                gaussian_sum::SCRATCH,
            ),
            layout,
            positions: None,
            group: None,
            sum: GaussianSum::new(device, output_format, "subsurface::ScreenSpace"),
        })
    }

    /// Checks the inputs of a frame and uploads what the shaders need; scratch textures are made
    /// anew when the size has changed.
    ///
    /// # Errors
    /// The first input that does not fit; the frame prepared before stays in place.
    pub fn prepare(&mut self, device: &Device, frame: &ScreenFrame) -> Result<(), Error> {
        check(frame, self.output_format)?;
        let size = input::size(frame.irradiance);
        let inverse_projection = inverse_mm(frame.projection, frame.mm_per_unit)?;

        let settings = gaussian_sum::uniform(
            device,
            "subsurface::ScreenSpace positions",
            &Settings { inverse_projection },
        );
        let positions = match self.positions.take() {
            Some(view) if input::size(&view) == size => view,
            _ => gaussian_sum::scratch_view(
                device,
                "subsurface::ScreenSpace positions",
                size,
                gaussian_sum::SCRATCH,
            ),
        };
        self.group = Some(device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("subsurface::ScreenSpace positions"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: settings.as_entire_binding(),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::TextureView(frame.depth),
                },
                wgpu::BindGroupEntry {
                    binding: 2,
                    resource: wgpu::BindingResource::TextureView(frame.profile_id),
                },
            ],
        }));
        self.sum.prepare(
            device,
            &Inputs {
                positions: &positions,
                irradiance: frame.irradiance,
                output: frame.output,
                profiles: frame.profiles,
                settings: gaussian_sum::Settings {
                    spacing: spacing(frame.projection, size, frame.mm_per_unit),
                    ..gaussian_sum::Settings::new(frame.profiles, 1.0)
                },
            },
        );
        self.positions = Some(positions);
        Ok(())
    }

    /// Records the frame that was last prepared; nothing before the first.
    pub fn render(&self, encoder: &mut CommandEncoder) {
        if let (Some(positions), Some(group)) = (&self.positions, &self.group) {
            gaussian_sum::draw_full_screen(
                encoder,
                "subsurface::ScreenSpace positions",
                &self.pipeline,
                group,
                positions,
                0,
            );
            self.sum.render(encoder);
        }
    }
}

/// Checks all of a frame but its projection.
pub(crate) fn check(frame: &ScreenFrame, output_format: TextureFormat) -> Result<(), Error> {
    let size = input::size(frame.irradiance);
    input::check_texture("irradiance", frame.irradiance, Role::Color, size)?;
    input::check_texture("depth", frame.depth, Role::Depth, size)?;
    input::check_texture("profile_id", frame.profile_id, Role::Id, size)?;
    input::check_texture("output", frame.output, Role::Target(output_format), size)?;
    input::check_apart(
        frame.output,
        &[
            ("irradiance", frame.irradiance),
            ("depth", frame.depth),
            ("profile_id", frame.profile_id),
        ],
    )?;
    input::check_mm_per_unit(frame.mm_per_unit)?;
    input::check_profiles(frame.profiles)?;
    Ok(())
}

/// Normalised device coordinates to view space in mm. In double precision, since the inverse of a
/// projection with a near plane of a millimetre loses half of a float's digits.
pub(crate) fn inverse_mm(projection: Mat4, mm_per_unit: f32) -> Result<Mat4, Error> {
    let m = projection.as_dmat4();
    let (x, y) = (projection.row(0), projection.row(1));
    let inverse = DMat4::from_scale(DVec3::splat(mm_per_unit.into())) * m.inverse();
    let inverse = inverse.as_mat4();
    if !projection.is_finite() || !inverse.is_finite() || x.y != 0.0 || y.x != 0.0 {
        return Err(Error::new(
            "projection",
            format!("{projection}"),
            "a finite, invertible projection whose x and y stay apart",
        ));
    }
    Ok(inverse)
}

/// The mm between pixels of a surface that faces the camera, at z mm in view space: along a row
/// |x + y·z|, along a column |z + w·z|. With clip w = P₃₂·z + P₃₃ a pixel is 2w/(W·P₀₀) wide.
fn spacing(projection: Mat4, size: [u32; 2], mm_per_unit: f32) -> Vec4 {
    let w = projection.row(3);
    let x = 2.0 / (size[0] as f32 * projection.x_axis.x);
    let y = 2.0 / (size[1] as f32 * projection.y_axis.y);
    Vec4::new(
        x * w.w * mm_per_unit,
        x * w.z,
        y * w.w * mm_per_unit,
        y * w.z,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wgsl::assert_layout;

    #[test]
    fn settings_lie_as_the_shader_has_them() {
        assert_layout!(
            include_str!("../shaders/screen_space.wgsl"),
            "Settings",
            Settings { inverse_projection }
        );
    }
}
