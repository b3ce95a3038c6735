//! What an effect sees of a frame, drawn over the host's own picture. Drives `shaders/pyramid/overlay.wgsl`.

use wgpu::{
    BindGroupLayout, BindingResource, BlendState, CommandEncoder, Device, PrimitiveTopology,
    RenderPipeline, ShaderStages, TextureFormat, TextureView,
};

use crate::gpu::{self, Recorder};
use crate::{Error, Output, View, pyramid, validate};

/// What an [`Overlay`] shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Show {
    /// Pixels per mm of a surface that faces the camera, in bands of two octaves: blue up to 0.25, cyan up to 1,
    /// green up to 4, yellow up to 16, red beyond. A head that fills a frame of 1080p is green; blue all over
    /// says that [`Frame::mm_per_unit`](crate::Frame::mm_per_unit) is too large, red that it is too small.
    PxPerMm,
    /// The coarsest level of the pyramid that a pixel is blurred at: from dark blue, the frame itself, to red.
    Level,
    /// How tiles of 8×8 pixels are blurred: green, as planar surfaces; red, each pixel by its own sum, which is
    /// dearer.
    Class,
    /// Magenta where there is a surface whose id the plan has no profile for; such pixels do not scatter.
    /// Green where a profile is found.
    NoProfile,
}

/// Draws what an effect sees over a target of the host's, half transparent: for the day when "it does
/// nothing".
#[derive(Debug)]
pub struct Overlay {
    format: TextureFormat,
    layout: BindGroupLayout,
    pipeline: RenderPipeline,
}

impl Overlay {
    /// An overlay for targets of this format, which the device must blend, such as Rgba8UnormSrgb.
    ///
    /// # Errors
    /// A format that is not blended on this device.
    pub fn new(device: &Device, format: TextureFormat) -> Result<Self, Error> {
        let features = format.guaranteed_format_features(device.features());
        let blends = wgpu::TextureFormatFeatureFlags::BLENDABLE;
        if !features.flags.contains(blends) {
            return Err(Error::Format {
                input: "target",
                got: format,
                needs: "a format that this device blends, such as Rgba8UnormSrgb",
            });
        }
        let label = "subsurface::Overlay";
        let bindings = [
            (0, gpu::UNIFORM),
            (3, gpu::READ),
            (5, gpu::FLOATS),
            (6, gpu::UINTS),
            (9, gpu::UNIFORM),
            (10, gpu::READ),
            (13, gpu::READ),
        ];
        let layout = gpu::layout(device, label, ShaderStages::FRAGMENT, &bindings);
        let pipeline = gpu::Draw {
            label,
            module: &gpu::module(device, label, pyramid::OVERLAY),
            vertex: "vs_overlay",
            fragment: "fs_overlay",
            layout: &layout,
            topology: PrimitiveTopology::TriangleList,
            targets: &[Some(wgpu::ColorTargetState {
                format,
                blend: Some(BlendState::ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::COLOR,
            })],
            constants: &[],
        }
        .pipeline(device);
        Ok(Self { format, layout, pipeline })
    }

    /// Records `show` of the frame that `view` was last prepared for and has rendered, over `target`, which
    /// has the size of that frame.
    ///
    /// # Errors
    /// A target that does not fit; a view that was not prepared, or last by the exact sum.
    pub fn render(
        &self,
        device: &Device,
        encoder: &mut CommandEncoder,
        view: &View,
        show: Show,
        target: &TextureView,
    ) -> Result<(), Error> {
        let seen = view.seen()?;
        let output = Output::Scattered(self.format);
        validate::target(target, output, seen.size, std::iter::empty())?;
        let resources = [
            (0, seen.view.as_entire_binding()),
            (3, seen.weights.as_entire_binding()),
            (5, BindingResource::TextureView(seen.depth)),
            (6, BindingResource::TextureView(seen.profile_id)),
            (9, seen.grids.as_entire_binding()),
            (10, seen.contents.as_entire_binding()),
            (13, seen.back_tiles.as_entire_binding()),
        ];
        let group = gpu::group(device, "subsurface::Overlay", &self.layout, &resources);
        let mut recorder = Recorder::new(encoder, None);
        let mut pass = recorder.draw("subsurface::Overlay", &[target], true);
        if let Some(viewport) = seen.viewport {
            viewport.apply(&mut pass);
        }
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        // The instance says what is shown.
        pass.draw(0..3, show as u32..show as u32 + 1);
        Ok(())
    }
}
