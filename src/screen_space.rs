//! Scattering in screen space: the effect, which holds a plan's pipelines, and a view of it, which holds
//! what one camera needs.

use std::sync::Arc;

use wgpu::{CommandEncoder, Device, QuerySet, Queue, TextureView};

use crate::exact::{self, Exact, ExactView};
use crate::gpu::Recorder;
use crate::optics::Optics;
use crate::pyramid::{Pyramid, PyramidView, Seen, Tiles};
use crate::{Error, Frame, Output, Plan, validate};

/// Scattering as a post-process: a [`Plan`] made ready for a device and an [`Output`].
///
/// [`new`](Self::new) makes all pipelines, so call it where you load, on any thread. A clone shares them.
/// Nothing that follows makes another: not a change of size, of the plan or of the camera. One effect
/// serves any number of [`View`]s.
#[derive(Clone, Debug)]
pub struct ScreenSpace {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    output: Output,
    plan: Plan,
    passes: Passes,
}

#[derive(Debug)]
enum Passes {
    Pyramid(Pyramid),
    Exact(Exact),
}

impl ScreenSpace {
    /// The effect that scatters by `plan` and writes `output`: a texture format such as Rgba16Float, or an
    /// [`Output`].
    ///
    /// # Errors
    /// A format that cannot be rendered to, or blended, on this device; a device that allows less than
    /// WebGPU's default limits.
    pub fn new(device: &Device, output: impl Into<Output>, plan: &Plan) -> Result<Self, Error> {
        let output = output.into();
        validate::output(device, output)?;
        let passes = match plan.weights() {
            Some(weights) => Passes::Pyramid(Pyramid::new(device, output, weights, plan.profiles())?),
            None => Passes::Exact(Exact::new(device, output)),
        };
        Ok(Self { shared: Arc::new(Shared { output, plan: plan.clone(), passes }) })
    }

    /// The plan that it was made for.
    pub fn plan(&self) -> &Plan {
        &self.shared.plan
    }

    /// The output that it was made for.
    pub fn output(&self) -> Output {
        self.shared.output
    }

    /// Bytes of scratch memory on the device that a [`View`] of a frame, or viewport, of `size` pixels takes.
    pub fn scratch_bytes(&self, size: [u32; 2]) -> u64 {
        match &self.shared.passes {
            Passes::Pyramid(pyramid) => pyramid.scratch_bytes(size),
            Passes::Exact(_) => exact::scratch_bytes(size),
        }
    }

    /// Bytes that it takes on top where frames have a [`BackLayer`](crate::BackLayer).
    pub fn back_scratch_bytes(&self, size: [u32; 2]) -> u64 {
        match &self.shared.passes {
            Passes::Pyramid(pyramid) => pyramid.back_scratch_bytes(size),
            Passes::Exact(_) => exact::back_scratch_bytes(size),
        }
    }
}

/// What one camera needs to scatter its frames: scratch textures, and the numbers of its last frame.
///
/// Two calls a frame. [`prepare`](Self::prepare) checks the inputs and uploads; [`render`](Self::render)
/// records. Take a view for each such pair in a submission: a second `prepare` before the submit replaces the
/// numbers of the first, and one camera is then blurred at the scale of another, without an error.
///
/// A view may change its effect from frame to frame, to toggle plans. It keeps the scratch of a pyramid and
/// that of the exact sum once it was prepared for each; drop it to free them. What was recorded stays valid
/// when a view is dropped, or prepared anew after the submit.
#[derive(Debug, Default)]
pub struct View {
    pyramid: Option<PyramidView>,
    exact: Option<ExactView>,
    prepared: Option<Prepared>,
}

/// The frame that was last prepared.
#[derive(Debug)]
struct Prepared {
    effect: ScreenSpace,
    size: [u32; 2],
    read: Vec<(&'static str, TextureView)>,
}

impl View {
    /// The most passes that a frame records: twice as many queries are enough for
    /// [`render_timed`](Self::render_timed).
    pub const MAX_PASSES: u32 = 64;

    /// A view that was not prepared yet. It takes no memory on the device.
    pub fn new() -> Self {
        Self::default()
    }

    /// Checks a frame and uploads what the shaders need. Scratch textures are made anew when the size of
    /// the frame, or of its viewport, has changed. Views of the host's textures are kept until the next
    /// call.
    ///
    /// # Errors
    /// The first input that does not fit. The frame prepared before then stays in place.
    pub fn prepare(
        &mut self,
        device: &Device,
        queue: &Queue,
        effect: &ScreenSpace,
        frame: &Frame,
    ) -> Result<(), Error> {
        let Shared { output, plan, passes } = &*effect.shared;
        validate::frame(frame, *output)?;
        let optics = Optics::new(frame)?;
        match passes {
            Passes::Pyramid(pyramid) => {
                Optics::check_depth_alone(frame)?;
                pyramid.prepare(device, queue, &mut self.pyramid, frame, &optics);
            }
            Passes::Exact(exact) => {
                let profiles = plan.profiles();
                exact.prepare(device, queue, &mut self.exact, frame, &optics, profiles);
            }
        }
        let read = frame.textures().map(|(name, view)| (name, view.clone()));
        self.prepared = Some(Prepared { effect: effect.clone(), size: frame.size(), read: read.collect() });
        Ok(())
    }

    /// Records the frame that was last prepared. The result goes to `output`, a texture of the format that
    /// the effect was made for and of the frame's size, with the usage `RENDER_ATTACHMENT`; [`Output`] says
    /// what is written there.
    ///
    /// # Errors
    /// An output that does not fit; a call before the first [`prepare`](Self::prepare). Nothing is recorded
    /// then.
    pub fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error> {
        self.record(encoder, output, None).map(|_| ())
    }

    /// Records as [`render`](Self::render), and has the device write the time before and after pass *i* to
    /// the queries `first_query` + 2*i* and + 2*i* + 1 of a set of timestamps, which must have
    /// `first_query` + 2·[`MAX_PASSES`](Self::MAX_PASSES) queries or more: wgpu checks that, not this. Needs
    /// the feature `TIMESTAMP_QUERY`. Returns the labels of the passes.
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

    /// By what the frame that was last rendered was drawn; `None` before the first one by a plan.
    #[doc(hidden)] // of use to the lab alone, which counts tiles
    pub fn tiles(&self) -> Option<Tiles<'_>> {
        self.pyramid.as_ref().map(Pyramid::tiles)
    }

    /// What an overlay shows of the frame that was last prepared.
    pub(crate) fn seen(&self) -> Result<Seen<'_>, Error> {
        let Prepared { effect, size, .. } = self.prepared.as_ref().ok_or(Error::NotPrepared)?;
        match (&effect.shared.passes, &self.pyramid) {
            (Passes::Pyramid(pyramid), Some(view)) => pyramid.seen(view, *size),
            _ => None,
        }
        .ok_or(Error::NoPyramid)
    }

    fn record(
        &self,
        encoder: &mut CommandEncoder,
        output: &TextureView,
        times: Option<(&QuerySet, u32)>,
    ) -> Result<Vec<String>, Error> {
        let Prepared { effect, size, read } = self.prepared.as_ref().ok_or(Error::NotPrepared)?;
        let inputs = read.iter().map(|(name, view)| (*name, view));
        validate::target(output, effect.output(), *size, inputs)?;
        encoder.push_debug_group("subsurface::View");
        let mut recorder = Recorder::new(encoder, times);
        match (&effect.shared.passes, &self.pyramid, &self.exact) {
            (Passes::Pyramid(pyramid), Some(view), _) => {
                pyramid.render(&mut recorder, view, output);
            }
            (Passes::Exact(exact), _, Some(view)) => exact.render(&mut recorder, view, output),
            _ => {}
        }
        let labels = recorder.finish();
        encoder.pop_debug_group();
        Ok(labels)
    }
}
