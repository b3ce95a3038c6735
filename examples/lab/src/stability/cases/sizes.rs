//! Plans beside the exact sum on a head, over sizes of the frame, views, widths of skin and errors: what one
//! size hides, another shows. The full atlas runs all of it, tests/sweep.rs the short form.

use subsurface::{Plan, Profile};

use crate::Error;
use crate::method::{Ours, scatter};
use crate::renderer::{Camera, Gpu, Lighting, Renderer, Scene, View};
use crate::stability::case::{Bound, Case, PLAN, known};
use crate::stability::lab::Lab;
use crate::synthetic::{apart, largest};

/// The most that a plan may differ by from the exact sum, in units of white: at the worst crease of the
/// head, the line of the lips, coarse pixels hold light from both sides.
pub const WORST_CREASE: f64 = 0.3;

/// One view of the built-in head.
#[derive(Clone, Copy, Debug)]
pub struct Sweep {
    /// How many times as wide as skin's the profile is.
    pub widening: f32,
    pub view: View,
    /// Sizes of the frame in pixels.
    pub sizes: &'static [[u32; 2]],
}

/// From 256 to 1920 pixels, many of them not multiples of 8.
const SIZES: [[u32; 2]; 12] = [
    [256, 256],
    [389, 517],
    [512, 512],
    [1366, 768],
    [1920, 1080],
    [1920, 1920],
    [768, 768],
    [893, 611],
    [896, 896],
    [960, 960],
    [1000, 1000],
    [1024, 1024],
];

/// All views and widths; `short` has two sizes of two views.
pub fn sweeps(short: bool) -> Vec<Sweep> {
    let sweep = |widening, view, sizes| Sweep { widening, view, sizes };
    if short {
        return [View::Front, View::ThreeQuarter]
            .map(|view| sweep(1.0, view, &[[389, 517], [768, 768]]))
            .into();
    }
    let views = [View::Front, View::ThreeQuarter, View::Profile, View::CloseUp];
    let of =
        |view| [sweep(1.0, view, &SIZES), sweep(0.4, view, &SIZES[6..]), sweep(2.5, view, &SIZES[6..])];
    views.into_iter().flat_map(of).collect()
}

impl Sweep {
    /// The largest difference between a plan and the exact sum at any size and error; NaN where a pixel is.
    ///
    /// # Errors
    /// No plan for the profile, or a frame that the device cannot hold.
    pub fn worst(&self, gpu: &Gpu) -> Result<f64, Error> {
        let scene = Scene::from_glb(crate::HEAD)?;
        let profiles = [Profile::SKIN.scaled(self.widening)?];
        let exact = Plan::exact(&profiles)?;
        let plans = [100.0, 255.0].map(|e: f32| Plan::new(&profiles, e.recip()));
        let mut worst = Vec::new();
        for size in self.sizes {
            let renderer = Renderer::new(gpu, &scene, *size)?;
            let camera = Camera::framing(&scene, self.view, *size);
            renderer.render(gpu, &camera, &Lighting::default(), 1000.0)?;
            let output = renderer.scattered_target(gpu);
            let frame = renderer.gbuffer.frame(camera.projection(*size), 1000.0);
            let by = |plan: &Plan| -> Result<Vec<[f32; 4]>, Error> {
                let mut ours = Ours::new(&gpu.device, output.texture().format(), plan)?;
                scatter(gpu, &mut ours, &frame, &output)?;
                Ok(gpu.read(&output))
            };
            let truth = by(&exact)?;
            for plan in &plans {
                let found = by(plan.as_ref().map_err(Clone::clone)?)?;
                worst.push(apart(&found, &truth));
            }
        }
        Ok(largest(worst))
    }
}

pub(super) fn cases(quick: bool) -> Vec<Case> {
    let bound = Bound {
        passes: WORST_CREASE,
        degrades: WORST_CREASE,
        why: "at the line of the lips, the worst crease of the head, coarse pixels hold light \
              from both sides.",
    };
    let what = "The built-in head in frames of 256 to 1920 pixels, many not multiples of 8 \
        (other widths from 611 to 1024), by plans for errors of 1/100 and 1/255 and profiles as \
        wide as skin, 0.4 and 2.5 times: largest difference to the exact sum at any pixel. The \
        quick form is tests/sweep.rs.";
    let sweeps = if quick { vec![] } else { sweeps(false) };
    let why = "A crease, by skin 2.5 times as wide: 0.32. Use the exact sum for stills.";
    let case = |sweep: Sweep| {
        let name = format!("{:?}, {} times as wide", sweep.view, sweep.widening);
        let run = move |lab: &Lab| Ok(vec![(PLAN, sweep.worst(&lab.gpu)?)].into());
        let known = (sweep.view == View::Front && sweep.widening > 1.0).then(|| known(PLAN, 0.34, why));
        Case::new(name, what, bound, run).known(known)
    };
    sweeps.into_iter().map(case).collect()
}
