//! What hosts do to an effect over many frames.

mod memory;

use crate::Error;
use glam::{DVec3, Vec3};
use subsurface::Profile;

use super::surface::{Methods, Surface, Uploaded, methods, ours};
use super::{STEP, larger, worst};
use crate::renderer::Gpu;
use crate::stability::case::{Case, Group, METHODS, Outcome};
use crate::stability::lab::Lab;
use crate::synthetic::{View, sphere};

pub fn cases(quick: bool) -> Vec<Case> {
    vec![
        resized(quick),
        switched(quick),
        interleaved(),
        lost(),
        memory::case(quick),
    ]
}

/// A ball of skin lit from one side; small, since it is drawn often.
fn ball(size: [u32; 2], gpu: &Gpu) -> Uploaded {
    let view = View::perspective(size, 8.0);
    let to_light = DVec3::new(0.8, 0.0, 0.6);
    let light = |n: DVec3| DVec3::splat(n.dot(to_light).max(0.0));
    let g = view.shoot(sphere(15.0, 300.0, light));
    Surface::of(&g, DVec3::ZERO).upload(gpu)
}

/// Pixels of a frame, alpha included.
type Pixels = Vec<[f32; 4]>;

/// The largest difference between two frames; not a number where one is none.
fn apart(a: &Pixels, b: &Pixels) -> f64 {
    let light =
        |p: &Pixels| -> Vec<Vec3> { p.iter().map(|p| Vec3::new(p[0], p[1], p[2])).collect() };
    let truth: Vec<_> = light(b).iter().map(|e| e.as_dvec3()).enumerate().collect();
    worst(&vec![("", light(a))], &truth)[0].1
}

/// Each method's largest difference over all frames.
#[derive(Default)]
struct Worst(Vec<(&'static str, f64)>);

impl Worst {
    fn add(&mut self, method: &'static str, figure: f64) {
        match self.0.iter_mut().find(|(m, _)| *m == method) {
            Some((_, worst)) => *worst = larger(*worst, figure),
            None => self.0.push((method, figure)),
        }
    }

    fn outcome(mut self) -> Outcome {
        self.0
            .sort_by_key(|(m, _)| METHODS.iter().position(|n| n == m));
        Outcome {
            figures: self.0,
            shown: None,
        }
    }
}

fn new_methods(lab: &Lab, gpu: &Gpu) -> Result<Methods, Error> {
    methods(gpu, &Profile::SKIN, &lab.plan)
}

/// Bit for bit: `passes` and the reason for it.
const SAME: f64 = 0.0;
const WHY_SAME: &str = "The same work on the same device gives the same bits, so that any difference is left over from another \
                        frame; one of up to 1/255 is no more than a step of eight bits.";

/// Another size every frame.
fn resized(quick: bool) -> Case {
    let frames = if quick { 20 } else { 200 };
    Case {
        group: Group::Hosts,
        name: "another size every frame".into(),
        what: format!(
            "{frames} frames of a ball of skin, in turn of 33x17, 48x48 and 5x40 pixels: the largest difference \
             to what a new effect makes of the same frame."
        ),
        passes: SAME,
        degrades: STEP,
        why: WHY_SAME.into(),
        known: vec![],
        run: Box::new(move |lab| {
            let gpu = &lab.gpu;
            let surfaces = [[33, 17], [48, 48], [5, 40]].map(|size| ball(size, gpu));
            let mut anew: Vec<Vec<Pixels>> = Vec::new();
            for surface in &surfaces {
                let mut methods = new_methods(lab, gpu)?;
                let of_all = methods
                    .iter_mut()
                    .map(|(_, method)| surface.by(gpu, method));
                anew.push(of_all.collect::<Result<_, _>>()?);
            }
            let mut kept = new_methods(lab, gpu)?;
            let mut figures = Worst::default();
            for frame in 0..frames {
                // Every fifth frame skips one, so that each size follows on different ones.
                let i = (frame + frame / 5) % surfaces.len();
                for ((name, method), anew) in kept.iter_mut().zip(&anew[i]) {
                    let scattered = surfaces[i].by(gpu, method)?;
                    figures.add(name, apart(&scattered, anew));
                }
            }
            Ok(figures.outcome())
        }),
    }
}

/// Another method every frame, into the same texture.
fn switched(quick: bool) -> Case {
    let rounds = if quick { 3 } else { 30 };
    Case {
        group: Group::Hosts,
        name: "another method every frame".into(),
        what: format!(
            "{rounds} rounds over all methods, each in another order, a frame of the same size for each method, all into one \
             texture that none of them clears: the largest difference to what a new effect makes of the frame alone."
        ),
        passes: SAME,
        degrades: STEP,
        why: WHY_SAME.into(),
        known: vec![],
        run: Box::new(move |lab| {
            let gpu = &lab.gpu;
            let mut alone = Vec::new();
            for (_, method) in &mut new_methods(lab, gpu)? {
                alone.push(ball([48, 40], gpu).by(gpu, method)?);
            }
            let shared = ball([48, 40], gpu);
            let mut kept = new_methods(lab, gpu)?;
            let count = kept.len();
            let mut figures = Worst::default();
            for frame in 0..rounds * count {
                // Steps that have no divisor in common with the count come by all of them.
                let step = [1, 3, 5, 7][frame / count % 4];
                let (name, method) = &mut kept[frame * step % count];
                let scattered = shared.by(gpu, method)?;
                figures.add(name, apart(&scattered, &alone[frame * step % count]));
            }
            Ok(figures.outcome())
        }),
    }
}

/// Two effects of each method, two frames, one submission.
fn interleaved() -> Case {
    Case {
        group: Group::Hosts,
        name: "two effects, one submission".into(),
        what: "Two frames of different sizes, each with an effect of its own, both prepared and then both recorded into one \
               command buffer: the largest difference to what an effect makes of either alone."
            .into(),
        passes: SAME,
        degrades: STEP,
        why: WHY_SAME.into(),
        known: vec![],
        run: Box::new(|lab| {
            let gpu = &lab.gpu;
            let surfaces = [[48, 40], [31, 57]].map(|size| ball(size, gpu));
            let [first, second] = [new_methods(lab, gpu)?, new_methods(lab, gpu)?];
            let mut figures = Worst::default();
            for ((name, a), (_, b)) in first.into_iter().zip(second) {
                let mut effects = [a, b];
                let mut alone = Vec::new();
                for (surface, effect) in surfaces.iter().zip(&mut effects) {
                    alone.push(surface.by(gpu, effect)?);
                }
                // Each now has the other's frame.
                let [a, b] = &mut effects;
                a.prepare(gpu, &surfaces[1])?;
                b.prepare(gpu, &surfaces[0])?;
                gpu.run(|encoder| {
                    a.render(encoder, surfaces[1].output())?;
                    b.render(encoder, surfaces[0].output())
                })?;
                for (surface, alone) in surfaces.iter().zip(&alone) {
                    figures.add(name, apart(&surface.read(gpu), alone));
                }
            }
            Ok(figures.outcome())
        }),
    }
}

/// A device that goes away under its effects.
fn lost() -> Case {
    Case {
        group: Group::Hosts,
        name: "a lost device".into(),
        what: "A device is destroyed; its effects prepare and record another frame all the same, and are dropped. The figure \
               is the largest difference of what a new device with new effects makes of that frame to what the first \
               one made of it. A panic ends the run; what the lost device complains of does not count. Rivals are left \
               out, since how they take it is up to this harness."
            .into(),
        passes: SAME,
        degrades: STEP,
        why: WHY_SAME.into(),
        known: vec![],
        run: Box::new(|lab| {
            let before = {
                let gpu = Gpu::headless()?;
                gpu.device.on_uncaptured_error(std::sync::Arc::new(|_| {}));
                let surface = ball([48, 40], &gpu);
                let mut methods = ours(&gpu, &lab.plan)?;
                let of_all = methods.iter_mut().map(|(_, method)| surface.by(&gpu, method));
                let before = of_all.collect::<Result<Vec<_>, _>>()?;
                gpu.device.destroy();
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                for (_, method) in &mut methods {
                    // An error is as good an answer as none.
                    let _ = method.prepare(&gpu, &surface);
                    let _ = method.render(&mut encoder, surface.output());
                }
                gpu.queue.submit([encoder.finish()]);
                before
            };
            let gpu = Gpu::headless()?;
            let surface = ball([48, 40], &gpu);
            let mut figures = Worst::default();
            for ((name, mut method), before) in ours(&gpu, &lab.plan)?.into_iter().zip(&before) {
                figures.add(name, apart(&surface.by(&gpu, &mut method)?, before));
            }
            Ok(figures.outcome())
        }),
    }
}
