//! What hosts do to an effect over many frames.

use std::fs;

use glam::DVec3;

use super::STEP;
use crate::Error;
use crate::renderer::Gpu;
use crate::stability::case::{Bound, Case, Figures};
use crate::stability::inputs::{Texels, Uploaded};
use crate::stability::lab::{Lab, methods, ours};
use crate::stability::trial::merge;
use crate::synthetic::{View, apart, sphere};

pub fn cases(quick: bool) -> Vec<Case> {
    vec![resized(quick), switched(quick), interleaved(), lost(), leaks(quick)]
}

/// A ball of skin lit from one side; small, since it is drawn often.
fn ball(size: [u32; 2], gpu: &Gpu) -> Uploaded {
    let to_light = DVec3::new(0.8, 0.0, 0.6);
    let light = |n: DVec3| DVec3::splat(n.dot(to_light).max(0.0));
    let g = View::perspective(size, 8.0).shoot(sphere(15.0, 300.0, light));
    Texels::of(&g, 0.0).upload(gpu)
}

/// Pixels of a frame, alpha included.
type Pixels = Vec<[f32; 4]>;

const SAME: Bound = Bound {
    passes: 0.0,
    degrades: STEP,
    why: "the same work on the same device gives the same bits; any difference is left over from \
          another frame.",
};

/// Another size every frame.
fn resized(quick: bool) -> Case {
    let frames = if quick { 20 } else { 200 };
    let what = format!(
        "{frames} frames of a ball of skin, in turn of 33x17, 48x48 and 5x40 pixels: largest \
         difference to what a new effect makes of the same frame."
    );
    Case::new("another size every frame", what, SAME, move |lab| {
        let gpu = &lab.gpu;
        let balls = [[33, 17], [48, 48], [5, 40]].map(|size| ball(size, gpu));
        let mut anew: Vec<Vec<Pixels>> = Vec::new();
        for ball in &balls {
            let mut methods = methods(gpu, &lab.plan)?;
            let of_all = methods.iter_mut().map(|(_, method)| method.scatter(gpu, ball));
            anew.push(of_all.collect::<Result<_, _>>()?);
        }
        let mut kept = methods(gpu, &lab.plan)?;
        let mut figures = Figures::new();
        for frame in 0..frames {
            // Every fifth frame skips one, so that each size follows on different ones.
            let i = (frame + frame / 5) % balls.len();
            for ((name, method), anew) in kept.iter_mut().zip(&anew[i]) {
                merge(&mut figures, [(*name, apart(&method.scatter(gpu, &balls[i])?, anew))]);
            }
        }
        Ok(figures.into())
    })
}

/// Another method every frame, into the same texture.
fn switched(quick: bool) -> Case {
    let rounds = if quick { 3 } else { 30 };
    let what = format!(
        "{rounds} rounds over all methods, each in another order, a frame of the same size for \
         each, all into one texture that none of them clears: largest difference to what a new \
         effect makes of the frame alone."
    );
    Case::new("another method every frame", what, SAME, move |lab| {
        let gpu = &lab.gpu;
        let mut alone = Vec::new();
        for (_, method) in &mut methods(gpu, &lab.plan)? {
            alone.push(method.scatter(gpu, &ball([48, 40], gpu))?);
        }
        let shared = ball([48, 40], gpu);
        let mut kept = methods(gpu, &lab.plan)?;
        let count = kept.len();
        let mut figures = Figures::new();
        for frame in 0..rounds * count {
            // Steps that have no divisor in common with the count come by all of them.
            let i = frame * [1, 3, 5, 7][frame / count % 4] % count;
            let (name, method) = &mut kept[i];
            merge(&mut figures, [(*name, apart(&method.scatter(gpu, &shared)?, &alone[i]))]);
        }
        Ok(figures.into())
    })
}

/// Two views of each method, two frames, one submission.
fn interleaved() -> Case {
    let what = "Two frames of different sizes, each with a view of its own, both prepared and \
        then both recorded into one command buffer: largest difference to what a method makes of \
        either alone.";
    Case::new("two views, one submission", what, SAME, |lab| {
        let gpu = &lab.gpu;
        let balls = [[48, 40], [31, 57]].map(|size| ball(size, gpu));
        let mut figures = Figures::new();
        for ((name, mut a), (_, mut b)) in
            methods(gpu, &lab.plan)?.into_iter().zip(methods(gpu, &lab.plan)?)
        {
            let alone = [a.scatter(gpu, &balls[0])?, b.scatter(gpu, &balls[1])?];
            // Each now has the other's frame.
            a.prepare(gpu, &balls[1])?;
            b.prepare(gpu, &balls[0])?;
            gpu.run(|encoder| {
                a.render(encoder, &balls[1].output)?;
                b.render(encoder, &balls[0].output)
            })?;
            for (ball, alone) in balls.iter().zip(&alone) {
                merge(&mut figures, [(name, apart(&gpu.read(&ball.output), alone))]);
            }
        }
        Ok(figures.into())
    })
}

/// A device that goes away under its effects.
fn lost() -> Case {
    let what = "A device is destroyed; its effects prepare and record another frame all the \
        same, and are dropped: largest difference of what a new device with new effects makes of \
        that frame to what the first one made of it. A panic ends the run. Rivals are left out, \
        since how they take it is up to this harness.";
    Case::new("a lost device", what, SAME, |lab| {
        let before = {
            let gpu = Gpu::headless()?;
            gpu.device.on_uncaptured_error(std::sync::Arc::new(|_| {}));
            let ball = ball([48, 40], &gpu);
            let mut methods = ours(&gpu, &lab.plan)?;
            let of_all = methods.iter_mut().map(|(_, method)| method.scatter(&gpu, &ball));
            let before = of_all.collect::<Result<Vec<_>, _>>()?;
            gpu.device.destroy();
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            for (_, method) in &mut methods {
                // An error is as good an answer as none.
                let _ = method.prepare(&gpu, &ball);
                let _ = method.render(&mut encoder, &ball.output);
            }
            gpu.queue.submit([encoder.finish()]);
            before
        };
        let gpu = Gpu::headless()?;
        let ball = ball([48, 40], &gpu);
        let mut figures = Figures::new();
        for ((name, mut method), before) in ours(&gpu, &lab.plan)?.into_iter().zip(&before) {
            figures.push((name, apart(&method.scatter(&gpu, &ball)?, before)));
        }
        Ok(figures.into())
    })
}

/// Memory that frames leave behind.
fn leaks(quick: bool) -> Case {
    let frames = if quick { 150 } else { 10_000 };
    let what = format!(
        "{frames} frames, in turn ten of 32x32 and ten of 24x40 pixels: by how many KiB a frame \
         the memory of the process grows (on Linux), or that of the device's allocator, \
         whichever grows more. The half of the frames in which it grows less counts: a leak \
         shows in both, what a heap or a driver keeps for later in one. A third as many frames \
         go before, uncounted."
    );
    let bound = Bound {
        passes: 0.25,
        degrades: 2.0,
        why: "0.25 KiB a frame is 53 MiB in an hour at 60 Hz. A frame's settings take 2 KiB, its \
              textures here 8 KiB each.",
    };
    Case::new(format!("{frames} frames, what they leave"), what, bound, move |lab: &Lab| {
        let gpu = &lab.gpu;
        let balls = [[32, 32], [24, 40]].map(|size| ball(size, gpu));
        let mut figures = Figures::new();
        for (name, mut method) in methods(gpu, &lab.plan)? {
            let mut frame = 0;
            let mut go_on = |frames: usize| -> Result<[f64; 2], Error> {
                for _ in 0..frames {
                    let ball = &balls[frame / 10 % 2];
                    method.prepare(gpu, ball)?;
                    gpu.run(|encoder| method.render(encoder, &ball.output))?;
                    frame += 1;
                }
                Ok(bytes(gpu))
            };
            let [start, middle, end] = [go_on(frames / 3)?, go_on(frames / 2)?, go_on(frames / 2)?];
            let growth = |i: usize| (middle[i] - start[i]).min(end[i] - middle[i]).max(0.0);
            figures.push((name, growth(0).max(growth(1)) / 1024.0 / (frames / 2) as f64));
        }
        Ok(figures.into())
    })
}

/// Of the process, and of the device; 0 where it cannot be told.
fn bytes(gpu: &Gpu) -> [f64; 2] {
    let statm = fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages = statm.split(' ').nth(1).and_then(|pages| pages.parse::<f64>().ok());
    let report = gpu.device.generate_allocator_report();
    [
        // Where pages are larger than on all that is usual, the figure is too small by as much.
        pages.unwrap_or(0.0) * 4096.0,
        report.map_or(0.0, |r| r.total_allocated_bytes as f64),
    ]
}
