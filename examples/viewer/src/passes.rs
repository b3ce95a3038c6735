//! What each pass of an effect takes on the device.

use subsurface::View;
use subsurface::wgpu::{CommandEncoder, QuerySet};
use subsurface_lab::Error;
use subsurface_lab::renderer::{Gpu, Timestamps};

/// One pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Pass {
    pub name: String,
    pub ms: f64,
}

/// Submits what `record` records and waits until it is done; where `times` are asked for, adds those of its
/// passes. `record` is handed the queries for them, and returns the passes' labels.
pub fn run(
    gpu: &Gpu,
    times: Option<(&Timestamps, &mut Vec<Pass>)>,
    record: impl FnOnce(&mut CommandEncoder, Option<&QuerySet>) -> Result<Vec<String>, subsurface::Error>,
) -> Result<(), Error> {
    let Some((timestamps, passes)) = times else {
        gpu.run(|encoder| record(encoder, None))?;
        return Ok(());
    };
    let (labels, times) = timestamps.run(gpu, |encoder| {
        let labels = record(encoder, Some(&timestamps.queries));
        let count = labels.as_ref().map_or(0, |labels| 2 * labels.len() as u32);
        (labels, count)
    });
    for (label, time) in labels?.iter().zip(times.chunks_exact(2)) {
        add(passes, label, time[1] - time[0]);
    }
    Ok(())
}

/// Enough queries for any effect; none where the device has no timestamps.
pub fn timestamps(gpu: &Gpu) -> Option<Timestamps> {
    Timestamps::new(gpu, 2 * View::MAX_PASSES)
}

/// An effect that runs several times, for the parts of an atlas, is told as one.
fn add(passes: &mut Vec<Pass>, label: &str, ms: f64) {
    // The effect's name comes first.
    let name = label.split_once(' ').map_or(label, |(_, name)| name);
    match passes.iter_mut().find(|pass| pass.name == name) {
        Some(pass) => pass.ms += ms,
        None => passes.push(Pass { name: name.to_owned(), ms }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use subsurface::wgpu::Features;

    #[test]
    fn passes_of_a_name_are_added_up() {
        let mut passes = Vec::new();
        for (label, ms) in [("effect one", 1.0), ("effect two", 2.0), ("effect one", 4.0)] {
            add(&mut passes, label, ms);
        }
        let expected = [("one", 5.0), ("two", 2.0)].map(|(name, ms)| Pass { name: name.into(), ms });
        assert_eq!(passes, expected);
    }

    #[test]
    fn the_device_is_asked_for_the_times_of_what_is_recorded() {
        let gpu = Gpu::with(Features::TIMESTAMP_QUERY).unwrap();
        let Some(timestamps) = timestamps(&gpu) else {
            return; // A device without them is not asked.
        };
        let mut passes = Vec::new();
        run(&gpu, Some((&timestamps, &mut passes)), |encoder, queries| {
            assert!(queries.is_some());
            for query in 0..4 {
                timestamps.mark(encoder, query);
            }
            Ok(vec!["effect first".into(), "effect second".into()])
        })
        .unwrap();
        assert_eq!([&passes[0].name, &passes[1].name], ["first", "second"]);
        assert!(passes.iter().all(|pass| pass.ms >= 0.0 && pass.ms < 1000.0));
    }
}
