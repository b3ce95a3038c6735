//! Memory that frames leave behind.

use std::fs;

use crate::renderer::Gpu;

use super::{ball, new_methods};
use crate::stability::case::{Case, Group, METHODS, Outcome};

/// Bytes of a page of /proc/self/statm on all that is usual; where pages are larger the figure is too small by
/// as much.
const PAGE_BYTES: f64 = 4096.0;

pub fn case(quick: bool) -> Case {
    let frames = if quick { 150 } else { 10_000 };
    Case {
        group: Group::Hosts,
        name: format!("{frames} frames, what they leave"),
        what: format!(
            "{frames} frames, in turn ten of 32x32 and ten of 24x40 pixels: by how many KiB a frame the memory of the \
             process grows (on Linux), or that of the device's allocator, whichever grows more. The half of the frames \
             in which it grows less counts: a leak shows in both, what a heap or a driver keeps for later in one. A \
             third as many frames go before, uncounted."
        ),
        passes: 0.25,
        degrades: 2.0,
        why: "a quarter of a KiB a frame is 53 MiB in an hour at 60 Hz. A frame's settings take 2 KiB, so that a method \
              which keeps those is degraded; one that keeps textures, of 8 KiB each here, fails."
            .into(),
        known: vec![],
        run: Box::new(move |lab| {
            let gpu = &lab.gpu;
            let surfaces = [[32, 32], [24, 40]].map(|size| ball(size, gpu));
            let mut figures = Vec::new();
            for (name, mut method) in new_methods(lab, gpu)? {
                let mut frame = 0;
                let mut go_on = |frames: usize| {
                    for _ in 0..frames {
                        let surface = &surfaces[frame / 10 % 2];
                        method.prepare(gpu, surface)?;
                        gpu.run(|encoder| method.render(encoder, surface.output()))?;
                        frame += 1;
                    }
                    Ok::<_, crate::Error>(bytes(gpu))
                };
                let start = go_on(frames / 3)?;
                let middle = go_on(frames / 2)?;
                let end = go_on(frames / 2)?;
                let growth = (0..2).map(|i| {
                    let halves = [middle[i] - start[i], end[i] - middle[i]];
                    halves[0].min(halves[1]).max(0.0)
                });
                let bytes = growth.fold(0.0, f64::max);
                figures.push((name, bytes / 1024.0 / (frames / 2) as f64));
            }
            figures.sort_by_key(|(m, _)| METHODS.iter().position(|n| n == m));
            Ok(Outcome {
                figures,
                shown: None,
            })
        }),
    }
}

/// Of the process, and of the device; 0 where it cannot be told.
fn bytes(gpu: &Gpu) -> [f64; 2] {
    let statm = fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages = statm
        .split(' ')
        .nth(1)
        .and_then(|pages| pages.parse::<f64>().ok());
    let report = gpu.device.generate_allocator_report();
    [
        pages.unwrap_or(0.0) * PAGE_BYTES,
        report.map_or(0.0, |r| r.total_allocated_bytes as f64),
    ]
}
