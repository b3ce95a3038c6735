//! Scattering in screen space: a post-process over a host's G-buffer. Driver of
//! `shaders/screen_space.wgsl`.

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, UVec2, Vec2};
use wgpu::{CommandEncoder, Device, TextureFormat, TextureView};

use crate::frame::{NormalSettings, Optics};
use crate::gaussian_sum::{self, GaussianSum, Inputs};
use crate::{Error, Output, ScreenFrame, input};

/// Exact scattering in screen space: each Gaussian of the profile in two passes, by the distances
/// between the surface points that the pixels show.
///
/// It borrows what the host owns and never submits. Each frame, [`prepare`](Self::prepare) checks
/// and uploads, then [`render`](Self::render) records. A change of size is a changed input; to
/// switch it off, don't call it.
///
/// Scratch memory: 80 bytes a pixel.
pub struct ScreenSpace {
    output: Output,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
    /// Bound where a frame has no ids.
    no_id: TextureView,
    positions: Option<TextureView>,
    group: Option<wgpu::BindGroup>,
    sum: GaussianSum,
}

/// `Settings` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Settings {
    inverse_projection: Mat4,
    first_pixel: UVec2,
    size: Vec2,
    far: f32,
    has_id: u32,
    pad: [u32; 2],
}

impl ScreenSpace {
    /// The effect that writes this output: a format such as Rgba16Float, or an [`Output`].
    ///
    /// # Errors
    /// A format that cannot be rendered to, or blended, on this device.
    pub fn new(device: &Device, output: impl Into<Output>) -> Result<Self, Error> {
        let output = output.into();
        input::check_output(device, output)?;
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
            output,
            pipeline: gaussian_sum::full_screen(
                device,
                &shader,
                label,
                "fs_positions",
                &layout,
                gaussian_sum::SCRATCH.into(),
            ),
            layout,
            no_id: gaussian_sum::scratch_view(device, label, [1, 1], TextureFormat::R8Uint),
            positions: None,
            group: None,
            sum: GaussianSum::new(device, output, "subsurface::ScreenSpace"),
        })
    }

    /// Checks the inputs of a frame and uploads what the shaders need; scratch textures are made
    /// anew when the size has changed.
    ///
    /// # Errors
    /// The first input that does not fit; the frame prepared before stays in place.
    pub fn prepare(&mut self, device: &Device, frame: &ScreenFrame) -> Result<(), Error> {
        frame.check(self.output)?;
        let optics = Optics::new(frame)?;
        let viewport = frame.viewport();
        let size = viewport.size();
        let settings = gaussian_sum::uniform(
            device,
            "subsurface::ScreenSpace positions",
            &Settings {
                inverse_projection: optics.inverse_projection,
                first_pixel: viewport.first(),
                size: UVec2::from(size).as_vec2(),
                far: optics.far,
                has_id: u32::from(frame.profile_id.is_some()),
                pad: [0; 2],
            },
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
                    resource: wgpu::BindingResource::TextureView(
                        frame.profile_id.unwrap_or(&self.no_id),
                    ),
                },
            ],
        }));
        self.sum.prepare(
            device,
            &Inputs {
                positions: &positions,
                irradiance: frame.irradiance,
                output: frame.output,
                strength: frame.strength,
                normal: frame.normal.map(|n| n.texture),
                viewport: frame.viewport,
                profiles: frame.profiles,
                settings: gaussian_sum::Settings {
                    spacing: optics.spacing(),
                    rays: optics.rays(),
                    normals: NormalSettings::new(frame.normal),
                    first_pixel: viewport.first(),
                    has_strength: u32::from(frame.strength.is_some()),
                    ..gaussian_sum::Settings::new(frame.profiles, 1.0)
                },
            },
        );
        self.positions = Some(positions);
        Ok(())
    }

    /// Records the frame that was last prepared; nothing before the first.
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
        if let (Some(positions), Some(group)) = (&self.positions, &self.group) {
            let label = "subsurface::ScreenSpace positions";
            let pipeline = &self.pipeline;
            gaussian_sum::draw_full_screen(encoder, label, pipeline, group, positions, 0);
            after(label, encoder);
            self.sum.render(encoder, &mut after);
        }
    }
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
            Settings {
                inverse_projection,
                first_pixel,
                size,
                far,
                has_id
            }
        );
    }
}
