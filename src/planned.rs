//! Scattering in screen space at a stated error.

use wgpu::{CommandEncoder, Device, Queue};

use crate::frame::Optics;
use crate::pyramid::{Inputs, Pyramid};
use crate::{Error, Output, Plan, ScreenFrame, ScreenSpace};

/// Scattering in screen space by a [`Plan`]: the error that a host accepts, and no more work than that.
///
/// It takes what [`ScreenSpace`](crate::ScreenSpace) takes. The plan's error holds for flat surfaces; on
/// heads it is measured (docs/results.md), and where layers lie within millimetres of each other, at
/// silhouettes and on steep slopes under detail of a pixel it is larger (a shadow edge as sharp as a
/// pixel that runs down a slope of 60° is off by up to .022): there, use the exact effect.
///
/// Blurs run over the tiles that hold skin and their neighbours alone, which the GPU finds; marking,
/// clearing and the copy of what does not scatter go over the frame. Between passes light is half
/// floats, and held at their largest, 65504. View space is right-handed. Views that share a
/// submission need an effect each, since the numbers of a frame are uploaded when it is prepared. A
/// frame of the same size, views and plan as the one before makes nothing anew; the views are kept until
/// the next is prepared.
///
/// Scratch memory: 23.9 bytes a pixel; 80 where the plan is exact.
pub struct PlannedScreenSpace {
    output: Output,
    pyramid: Pyramid,
    /// Only while the plan is exact.
    exact: Option<ScreenSpace>,
}

impl PlannedScreenSpace {
    /// The effect that writes this output: a format such as Rgba16Float, or an [`Output`].
    ///
    /// # Errors
    /// A format that cannot be rendered to, or blended, on this device; a device that allows fewer than
    /// 4 storage buffers a stage or 64 threads a workgroup, less than WebGPU's default limits.
    pub fn new(device: &Device, output: impl Into<Output>) -> Result<Self, Error> {
        let output = output.into();
        crate::input::check_output(device, output)?;
        let limits = device.limits();
        let (buffers, threads) = (
            limits.max_storage_buffers_per_shader_stage,
            limits
                .max_compute_invocations_per_workgroup
                .min(limits.max_compute_workgroup_size_x),
        );
        if buffers < 4 || threads < 64 {
            return Err(Error::new(
                "device: limits",
                format!("{buffers} storage buffers a stage, {threads} threads a workgroup"),
                "4 and 64; WebGPU's defaults are 8 and 256",
            ));
        }
        Ok(Self {
            output,
            pyramid: Pyramid::new(device, output),
            exact: None,
        })
    }

    /// Checks the inputs of a frame and uploads what the shaders need; `plan` is for the profiles of
    /// the frame, as many and in their order.
    ///
    /// # Errors
    /// The first input that does not fit; the frame prepared before stays in place.
    pub fn prepare(
        &mut self,
        device: &Device,
        queue: &Queue,
        frame: &ScreenFrame,
        plan: &Plan,
    ) -> Result<(), Error> {
        frame.check(self.output)?;
        if plan.profiles() != frame.profiles {
            return Err(Error::new(
                "plan",
                format!("a plan for other profiles ({})", plan.profiles().len()),
                format!("one for the {} of the frame", frame.profiles.len()),
            ));
        }
        let Some(plan) = plan.weights() else {
            match &mut self.exact {
                Some(exact) => exact.prepare(device, frame)?,
                None => {
                    let mut exact = ScreenSpace::new(device, self.output)?;
                    exact.prepare(device, frame)?;
                    self.exact = Some(exact);
                    self.pyramid.forget();
                }
            }
            return Ok(());
        };
        let optics = Optics::new(frame)?;
        let [z, w] = [2, 3].map(|i| frame.projection.row(i));
        if [z.x, z.y, w.x, w.y].iter().any(|c| *c != 0.0) {
            return Err(Error::new(
                "projection",
                format!("{}", frame.projection),
                "depth that does not depend on x and y",
            ));
        }
        if w.z > 0.0 {
            return Err(Error::new(
                "projection",
                format!("{}", frame.projection),
                "a right-handed view space, in front of the camera along -Z",
            ));
        }
        let inputs = Inputs {
            frame,
            optics,
            plan,
        };
        self.pyramid.prepare(device, queue, &inputs);
        self.exact = None;
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
        match &self.exact {
            Some(exact) => exact.render_by_pass(encoder, after),
            None => self.pyramid.render(encoder, &mut after),
        }
    }
}
