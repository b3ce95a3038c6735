//! Timing: wall clock around submit-and-wait, methods one after the other in rounds, there and back,
//! so that a drift of the machine hits all alike.

use std::time::Instant;

use subsurface::wgpu::TextureView;

use crate::Error;
use crate::method::ScreenMethod;
use crate::renderer::Gpu;

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
    methods: &[(&dyn ScreenMethod, &TextureView, bool)],
    rounds: Rounds,
    mut tick: impl FnMut(),
) -> Result<Vec<Vec<f64>>, Error> {
    let mut times = vec![Vec::new(); methods.len()];
    let mut since = Instant::now();
    for round in 0..rounds.compared.max(rounds.all) {
        if round == rounds.all {
            since = Instant::now();
        }
        if round > rounds.all && since.elapsed().as_secs_f64() > rounds.seconds {
            break;
        }
        for i in 0..methods.len() {
            let i = if round % 2 == 0 {
                i
            } else {
                methods.len() - 1 - i
            };
            let (method, output, compared) = methods[i];
            if round < rounds.all || compared && round < rounds.compared {
                let start = Instant::now();
                gpu.run(|encoder| method.render(encoder, output))?;
                times[i].push(start.elapsed().as_secs_f64() * 1e3);
            }
        }
        tick();
    }
    Ok(times)
}

pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() % 2 {
        _ if sorted.is_empty() => f64::NAN,
        0 => (sorted[middle - 1] + sorted[middle]) / 2.0,
        _ => sorted[middle],
    }
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
        .map(|_| median(&(0..ratios.len()).map(|_| draw()).collect::<Vec<_>>()))
        .collect();
    medians.sort_unstable_by(f64::total_cmp);
    let interval = [0.025, 0.975].map(|share| medians[(share * DRAWS as f64) as usize]);
    (median(&ratios), interval)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_in_the_middle() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(&[]).is_nan());
    }

    #[test]
    fn a_ratio_ignores_drift_and_its_interval_holds_it() {
        // A machine that slows down to a third, and a method that takes twice the base's time, ±10 %.
        let drift = (0..31).map(|i| 1.0 + f64::from(i) / 15.0);
        let base: Vec<f64> = drift.collect();
        let noise = |i: usize| 1.0 + 0.1 * (7.3 * i as f64).sin();
        let times: Vec<f64> = base
            .iter()
            .enumerate()
            .map(|(i, b)| 2.0 * b * noise(i))
            .collect();
        let (ratio, [low, high]) = ratio(&times, &base);
        assert!((ratio - 2.0).abs() < 0.1, "{ratio}");
        assert!(
            low <= ratio && ratio <= high && low > 1.8 && high < 2.2,
            "{low} {high}"
        );
    }
}
