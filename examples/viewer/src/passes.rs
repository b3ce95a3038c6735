//! What each pass of an effect takes.

use std::time::Instant;

use subsurface::wgpu::CommandEncoder;
use subsurface_lab::renderer::Gpu;

/// One pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Pass {
    pub name: String,
    /// Wall clock, from recording it to the end of the wait.
    pub ms: f64,
}

/// How what an effect records is submitted.
pub enum Submission {
    AtOnce,
    /// Each pass alone, and waited for. Timestamps would tell it without, but are a feature that devices
    /// may lack, and software drivers misreport them.
    ByPass(Vec<Pass>),
}

impl Submission {
    /// Submits what `render` records and waits until it is done; `render` is to call what it is handed
    /// after each of its passes.
    pub fn run(
        &mut self,
        gpu: &Gpu,
        render: impl FnOnce(&mut CommandEncoder, &mut dyn FnMut(&str, &mut CommandEncoder)),
    ) {
        gpu.run(|encoder| match self {
            Self::AtOnce => render(encoder, &mut |_, _| ()),
            Self::ByPass(passes) => {
                let mut since = Instant::now();
                render(encoder, &mut |label, recorded| {
                    gpu.run(|empty| std::mem::swap(empty, recorded));
                    add(passes, label, since.elapsed().as_secs_f64() * 1e3);
                    since = Instant::now();
                });
            }
        });
    }
}

/// What a submission takes that has nothing to do: the least that a pass of [`Submission::ByPass`] can.
pub fn empty_ms(gpu: &Gpu) -> f64 {
    let since = Instant::now();
    gpu.run(|_| ());
    since.elapsed().as_secs_f64() * 1e3
}

/// An effect that runs several times, for the parts of an atlas, is told as one.
fn add(passes: &mut Vec<Pass>, label: &str, ms: f64) {
    // The effect's name comes first.
    let name = label.split_once(' ').map_or(label, |(_, name)| name);
    match passes.iter_mut().find(|pass| pass.name == name) {
        Some(pass) => pass.ms += ms,
        None => passes.push(Pass {
            name: name.to_owned(),
            ms,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_of_a_name_are_added_up() {
        let mut passes = Vec::new();
        for (label, ms) in [
            ("effect one", 1.0),
            ("effect two", 2.0),
            ("effect one", 4.0),
        ] {
            add(&mut passes, label, ms);
        }
        let expected = [("one", 5.0), ("two", 2.0)].map(|(name, ms)| Pass {
            name: name.into(),
            ms,
        });
        assert_eq!(passes, expected);
    }

    #[test]
    fn each_pass_is_submitted_once() {
        let gpu = Gpu::headless().unwrap();
        for mut submission in [Submission::AtOnce, Submission::ByPass(Vec::new())] {
            let size = 4;
            let buffer = |usage| {
                gpu.device
                    .create_buffer(&subsurface::wgpu::BufferDescriptor {
                        label: None,
                        size,
                        usage,
                        mapped_at_creation: false,
                    })
            };
            use subsurface::wgpu::BufferUsages as Usage;
            let [from, to] =
                [Usage::COPY_SRC, Usage::MAP_READ].map(|u| buffer(u | Usage::COPY_DST));
            gpu.queue.write_buffer(&from, 0, &[7; 4]);
            submission.run(&gpu, |encoder, after| {
                encoder.copy_buffer_to_buffer(&from, 0, &to, 0, size);
                after("effect first", encoder);
                encoder.clear_buffer(&from, 0, None);
                after("effect second", encoder);
            });
            to.map_async(subsurface::wgpu::MapMode::Read, .., |result| {
                result.unwrap();
            });
            gpu.run(|_| ());
            assert_eq!(&to.get_mapped_range(..).unwrap()[..], [7; 4]);
            if let Submission::ByPass(passes) = submission {
                assert_eq!(passes.len(), 2);
            }
        }
    }
}
