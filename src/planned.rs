//! Scattering in screen space at a stated error.

use glam::Vec4;
use wgpu::{CommandEncoder, Device, Queue, TextureFormat};

use crate::pyramid::{Inputs, Optics, Pyramid};
use crate::screen_space::{check, inverse_mm};
use crate::{Error, Plan, ScreenFrame, ScreenSpace};

/// Scattering in screen space by a [`Plan`]: the error that a host accepts, and no more work than that.
///
/// It takes what [`ScreenSpace`](crate::ScreenSpace) takes. The plan's error holds for flat surfaces; on
/// heads it is measured (docs/results.md), and where layers lie within millimetres of each other, at
/// silhouettes and on steep slopes under detail of a pixel it is larger: there, use the exact effect.
///
/// Blurs run over the tiles that hold skin and their neighbours alone, which the GPU finds; marking,
/// clearing and the copy of what does not scatter go over the frame. Between passes light is half
/// floats, and held at their largest, 65504. The projection is right-handed. Views that share a
/// submission need an effect each, since the numbers of a frame are uploaded when it is prepared. A
/// frame of the same size, textures and plan as the one before makes nothing anew.
///
/// Scratch memory: 23.9 bytes a pixel; 80 where the plan is exact.
pub struct PlannedScreenSpace {
    output_format: TextureFormat,
    pyramid: Pyramid,
    /// Only while the plan is exact.
    exact: Option<ScreenSpace>,
}

impl PlannedScreenSpace {
    /// The effect for outputs of `output_format`.
    ///
    /// # Errors
    /// A format that cannot be rendered to on this device; a device with less than WebGPU's default
    /// limits.
    pub fn new(device: &Device, output_format: TextureFormat) -> Result<Self, Error> {
        crate::input::check_output_format(device, output_format)?;
        let limits = device.limits();
        let (buffers, threads) = (
            limits.max_storage_buffers_per_shader_stage,
            limits.max_compute_invocations_per_workgroup,
        );
        if buffers < 6 || threads < 256 {
            return Err(Error::new(
                "device: limits",
                format!("{buffers} storage buffers a stage, {threads} threads a workgroup"),
                "6 and 256; WebGPU's defaults are 8 and 256",
            ));
        }
        Ok(Self {
            output_format,
            pyramid: Pyramid::new(device, output_format),
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
        check(frame, self.output_format)?;
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
                    let mut exact = ScreenSpace::new(device, self.output_format)?;
                    exact.prepare(device, frame)?;
                    self.exact = Some(exact);
                    self.pyramid.forget();
                }
            }
            return Ok(());
        };
        let optics = optics(frame)?;
        self.pyramid.prepare(
            device,
            queue,
            &Inputs {
                irradiance: frame.irradiance,
                depth: frame.depth,
                profile_id: frame.profile_id,
                output: frame.output,
                optics,
                plan,
            },
        );
        self.exact = None;
        Ok(())
    }

    #[cfg(all(test, feature = "renderer"))]
    pub(crate) fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    /// Records the frame that was last prepared; nothing before the first.
    pub fn render(&self, encoder: &mut CommandEncoder) {
        match &self.exact {
            Some(exact) => exact.render(encoder),
            None => self.pyramid.render(encoder),
        }
    }
}

/// With clip x = P₀₀·X + P₀₂·z + P₀₃ and clip w = P₃₂·z + P₃₃, all in units of the scene,
/// X = (x′·w − P₀₂·z − P₀₃)/P₀₀ at the device coordinate x′, which is linear over the pixels.
fn optics(frame: &ScreenFrame) -> Result<Optics, Error> {
    let inverse = inverse_mm(frame.projection, frame.mm_per_unit)?;
    let size = crate::input::size(frame.irradiance);
    let [x, y, z, w] = [0, 1, 2, 3].map(|i| frame.projection.row(i));
    if [z.x, z.y, w.x, w.y].iter().any(|c| *c != 0.0) {
        return Err(Error::new(
            "projection",
            format!("{}", frame.projection),
            "depth that does not depend on x and y",
        ));
    }
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
    Ok(Optics {
        origin: Vec4::new(ux, uy, vx, vy),
        step: Vec4::new(dux, duy, dvx, dvy),
        depth_to_mm: Vec4::new(
            inverse.z_axis.z,
            inverse.w_axis.z,
            inverse.z_axis.w,
            inverse.w_axis.w,
        ),
    })
}
