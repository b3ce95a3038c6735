//! Timing: methods one after the other in rounds, there and back, so that a drift of the machine hits all
//! alike.

use std::time::Instant;

use serde::{Deserialize, Serialize};
use subsurface::wgpu::TextureView;

use crate::Error;
use crate::method::ScreenMethod;
use crate::metrics;
use crate::renderer::{Gpu, Timestamps};

/// On a GPU a method takes less than its submission; it is repeated within one until that lasts so long.
const LONG_ENOUGH_MS: f64 = 20.0;
/// What is faster than a millionth of that does nothing.
const MOST_REPEATS: u32 = 1 << 20;

/// How time is taken.
pub struct Clock {
    /// Of software drivers some report half of what passes of a chain take.
    timestamps: Option<Timestamps>,
    long_enough_ms: f64,
}

impl Clock {
    pub fn new(gpu: &Gpu) -> Self {
        match gpu.is_cpu {
            true => Self { timestamps: None, long_enough_ms: 0.0 },
            false => Self { timestamps: Timestamps::new(gpu, 2), long_enough_ms: LONG_ENOUGH_MS },
        }
    }

    /// For people.
    pub fn name(&self) -> String {
        let what = match self.timestamps {
            Some(_) => "GPU timestamps",
            None => "wall clock around submit and wait",
        };
        match self.long_enough_ms {
            0.0 => format!("{what}, a method once a submission"),
            ms => format!("{what}, a method repeated within a submission until that lasts {ms} ms"),
        }
    }

    /// How often a method, prepared before, is to be repeated within a submission.
    ///
    /// # Errors
    /// An output that the method refuses.
    pub fn repeats(
        &self,
        gpu: &Gpu,
        method: &dyn ScreenMethod,
        output: &TextureView,
    ) -> Result<u32, Error> {
        let mut repeats = 1;
        while self.long_enough_ms > 0.0 && repeats < MOST_REPEATS {
            // The first run of anything takes longer.
            let first = self.ms(gpu, method, output, repeats)?;
            let ms = first.min(self.ms(gpu, method, output, repeats)?);
            if f64::from(repeats) * ms >= self.long_enough_ms {
                break;
            }
            repeats *= 2;
        }
        Ok(repeats)
    }

    /// Milliseconds of a method, the mean of so many within a submission.
    ///
    /// # Errors
    /// An output that the method refuses.
    pub fn ms(
        &self,
        gpu: &Gpu,
        method: &dyn ScreenMethod,
        output: &TextureView,
        repeats: u32,
    ) -> Result<f64, Error> {
        let render = |encoder: &mut _| (0..repeats).try_for_each(|_| method.render(encoder, output));
        let ms = match &self.timestamps {
            Some(timestamps) => {
                let (rendered, times) = timestamps.run(gpu, |encoder| {
                    timestamps.mark(encoder, 0);
                    let rendered = render(encoder);
                    timestamps.mark(encoder, 1);
                    (rendered, 2)
                });
                rendered?;
                times[1] - times[0]
            }
            None => {
                let start = Instant::now();
                gpu.run(render)?;
                start.elapsed().as_secs_f64() * 1e3
            }
        };
        Ok(ms / f64::from(repeats))
    }
}

/// What a frame takes of a host's CPU.
#[derive(Deserialize, Serialize)]
pub struct HostCost {
    /// Checking and uploading, in µs.
    pub prepare_us: f64,
    /// Recording, until the commands are ready to be submitted, in µs.
    pub render_us: f64,
    /// Memory that the uploads of a frame are staged in, in bytes.
    pub upload_bytes: isize,
}

/// The medians of `frames` frames like the one that a method was prepared for.
///
/// # Errors
/// A frame or an output that the method refuses.
pub fn host_cost(
    gpu: &Gpu,
    method: &mut dyn ScreenMethod,
    frame: &subsurface::Frame,
    output: &TextureView,
    frames: usize,
) -> Result<HostCost, Error> {
    let (mut prepare, mut render, mut upload_bytes) = (Vec::new(), Vec::new(), 0);
    let us = |since: Instant| since.elapsed().as_secs_f64() * 1e6;
    for _ in 0..frames {
        let staged = || gpu.device.get_internal_counters().hal.buffer_memory.read();
        let before = staged();
        let since = Instant::now();
        method.prepare(&gpu.device, &gpu.queue, frame)?;
        prepare.push(us(since));
        upload_bytes = staged() - before;
        let since = Instant::now();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        method.render(&mut encoder, output)?;
        let commands = encoder.finish();
        render.push(us(since));
        // What was staged goes; what was recorded is not drawn.
        drop(commands);
        gpu.run(|_| ());
    }
    Ok(HostCost {
        prepare_us: metrics::median(&prepare),
        render_us: metrics::median(&render),
        upload_bytes,
    })
}

/// Rounds that a method takes part in.
#[derive(Clone, Copy)]
pub struct Rounds {
    pub all: usize,
    /// Of the methods that are compared by their ratio, as long as those after `all` take no longer
    /// than `seconds`.
    pub compared: usize,
    pub seconds: f64,
}

/// Milliseconds of each method, one a round; prepared before, and warmed up. `compared` tells which
/// go on after the others are done.
///
/// # Errors
/// An output that a method refuses.
pub fn rounds(
    gpu: &Gpu,
    clock: &Clock,
    methods: &[(&dyn ScreenMethod, &TextureView, bool)],
    rounds: Rounds,
    mut tick: impl FnMut(),
) -> Result<Vec<Vec<f64>>, Error> {
    let mut times = vec![Vec::new(); methods.len()];
    let mut repeats = Vec::new();
    for (method, output, _) in methods {
        repeats.push(clock.repeats(gpu, *method, output)?);
    }
    let mut since = Instant::now();
    for round in 0..rounds.compared.max(rounds.all) {
        if round == rounds.all {
            since = Instant::now();
        }
        if round > rounds.all && since.elapsed().as_secs_f64() > rounds.seconds {
            break;
        }
        for i in 0..methods.len() {
            let i = if round % 2 == 0 { i } else { methods.len() - 1 - i };
            let (method, output, compared) = methods[i];
            if round < rounds.all || compared && round < rounds.compared {
                times[i].push(clock.ms(gpu, method, output, repeats[i])?);
            }
        }
        tick();
    }
    Ok(times)
}

/// Median of the ratios within rounds, and the interval that holds 95 % of the medians of as many
/// rounds drawn with repetition.
pub fn ratio(times: &[f64], base: &[f64]) -> (f64, [f64; 2]) {
    const DRAWS: usize = 2000;
    let ratios: Vec<f64> = times.iter().zip(base).map(|(t, b)| t / b).collect();
    if ratios.is_empty() {
        return (f64::NAN, [f64::NAN; 2]);
    }
    // Marsaglia's xorshift, from the same seed each time: a figure is the same when asked for twice.
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut draw = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        ratios[(state % ratios.len() as u64) as usize]
    };
    let mut medians: Vec<f64> = (0..DRAWS)
        .map(|_| metrics::median(&(0..ratios.len()).map(|_| draw()).collect::<Vec<_>>()))
        .collect();
    medians.sort_unstable_by(f64::total_cmp);
    let interval = [0.025, 0.975].map(|share| medians[(share * DRAWS as f64) as usize]);
    (metrics::median(&ratios), interval)
}

#[cfg(test)]
mod tests {
    use subsurface::Frame;
    use subsurface::wgpu::{
        Buffer, BufferDescriptor, BufferUsages, CommandEncoder, Device, Features, Queue, TextureFormat,
    };

    use super::*;

    /// Clears a buffer.
    struct Clear(Buffer);

    impl ScreenMethod for Clear {
        fn prepare(&mut self, _: &Device, _: &Queue, _: &Frame) -> Result<(), Error> {
            Ok(())
        }

        fn render(&self, encoder: &mut CommandEncoder, _: &TextureView) -> Result<(), Error> {
            encoder.clear_buffer(&self.0, 0, None);
            Ok(())
        }

        fn fetches(&self, _: f64) -> Option<f64> {
            None
        }

        fn scratch_bytes_per_pixel(&self) -> f64 {
            0.0
        }
    }

    #[test]
    fn what_is_short_is_repeated_until_it_is_long_enough() {
        let gpu = Gpu::with(Features::TIMESTAMP_QUERY).unwrap();
        let output = gpu.target("output", [1, 1], TextureFormat::Rgba16Float);
        let clear = Clear(gpu.device.create_buffer(&BufferDescriptor {
            label: None,
            size: 1 << 20,
            usage: BufferUsages::COPY_DST,
            mapped_at_creation: false,
        }));
        for timestamps in [None, Timestamps::new(&gpu, 2)] {
            let clock = Clock { timestamps, long_enough_ms: 50.0 };
            let repeats = clock.repeats(&gpu, &clear, &output).unwrap();
            let ms = clock.ms(&gpu, &clear, &output, repeats).unwrap();
            println!("{}: {repeats} times {ms} ms", clock.name());
            // A megabyte is cleared in well under that, by a busy machine, too.
            assert!(repeats > 1 && ms > 0.0 && ms < 50.0, "{repeats}, {ms}");
        }
    }

    #[test]
    fn a_ratio_ignores_drift_and_its_interval_holds_it() {
        // A machine that slows down to a third, and a method that takes twice the base's time, ±10 %.
        let drift = (0..31).map(|i| 1.0 + f64::from(i) / 15.0);
        let base: Vec<f64> = drift.collect();
        let noise = |i: usize| 1.0 + 0.1 * (7.3 * i as f64).sin();
        let times: Vec<f64> = base.iter().enumerate().map(|(i, b)| 2.0 * b * noise(i)).collect();
        let (ratio, [low, high]) = ratio(&times, &base);
        assert!((ratio - 2.0).abs() < 0.1, "{ratio}");
        assert!(low <= ratio && ratio <= high && low > 1.8 && high < 2.2, "{low} {high}");
    }
}
