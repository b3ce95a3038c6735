//! Plans that lie in the source: their weights, and how these become a plan.

use super::kernels::KERNELS;
use super::weights::{Mixture, Weights};

/// The weights of one profile.
pub(super) struct Stored {
    /// Which of [`KERNELS`].
    pub set: usize,
    pub max_error: f32,
    /// log₂ of the px/mm of the first row.
    pub first_octave: f64,
    pub rows: &'static [Row],
}

/// The predicted error, the unscattered one, and the weights that are not 0: for each slot those of red,
/// green and blue, in 1/[`STEPS`](super::fit::STEPS).
pub(super) type Row = (f32, f32, &'static [(usize, [u32; 3])]);

impl Stored {
    pub(super) fn weights(&self) -> Weights {
        let kernels = KERNELS[self.set];
        let slots = Weights::slots(&kernels);
        let mixture = |(predicted_error, unscattered_error, stored): &Row| {
            let mut weights = vec![[0.0; 3]; slots];
            for (slot, steps) in *stored {
                weights[*slot] = steps.map(|s| (f64::from(s) / super::fit::STEPS) as f32);
            }
            Mixture { weights, predicted_error: *predicted_error, unscattered_error: *unscattered_error }
        };
        let rows = self.rows.iter().map(mixture).collect();
        Weights::new(kernels, self.first_octave, vec![rows])
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;

    use crate::plan::{KERNELS, fit, skin};
    use crate::{Plan, Profile};

    const COMMAND: &str = "cargo test --release --lib write_skin -- --ignored";

    fn refit(max_error: f32) -> Plan {
        Plan::new(&[Profile::SKIN], max_error).unwrap()
    }

    #[test]
    fn stored_plans_are_what_is_fitted() {
        for (name, stored) in [("SKIN", Plan::skin()), ("SKIN_FAST", Plan::skin_fast())] {
            let refit = refit(stored.max_error());
            let fitted =
                |plan: &Plan| (plan.max_error(), plan.weights().map(|w| (w.kernels, w.row_count())));
            assert_eq!(fitted(&stored), fitted(&refit), "{name}: {COMMAND}");
            for (stored, refit) in stored.rows(0).iter().zip(refit.rows(0)) {
                // Another machine's exp may differ in its last digit, and move a weight by a step.
                let is_near = |a: f32, b: f32| (a - b).abs() < 2e-5;
                let at = stored.px_per_mm;
                assert!(
                    is_near(stored.predicted_error, refit.predicted_error),
                    "{name} at {at}: {COMMAND}"
                );
                assert!(
                    is_near(stored.unscattered_error, refit.unscattered_error),
                    "{name} at {at}: {COMMAND}"
                );
                for (stored, refit) in stored.weights.iter().zip(&refit.weights) {
                    let near = [0, 1, 2].map(|c| is_near(stored[c], refit[c]));
                    assert_eq!(near, [true; 3], "{name} at {at}: {COMMAND}");
                }
            }
        }
    }

    #[test]
    fn stored_weights_are_one_in_all() {
        for stored in [skin::SKIN, skin::SKIN_FAST] {
            for (predicted_error, _, weights) in stored.rows {
                assert!(*predicted_error <= stored.max_error);
                let sum = [0, 1, 2].map(|c| weights.iter().map(|(_, steps)| steps[c]).sum::<u32>());
                assert_eq!(sum, [fit::STEPS as u32; 3]);
            }
        }
    }

    #[test]
    #[ignore = "no check, but what writes src/plan/skin.rs, which stored_plans_are_what_is_fitted holds"]
    fn write_skin() {
        let mut text = format!(
            "//! Weights of skin, as they were fitted. Written by\n//!\n\
             //! ```text\n//! {COMMAND}\n//! ```\n\n\
             use super::stored::Stored;\n"
        );
        for (name, white) in [("SKIN", 255), ("SKIN_FAST", 100)] {
            let refit = refit(1.0 / white as f32);
            let weights = refit.weights().unwrap();
            let set = KERNELS.iter().position(|k| *k == weights.kernels).unwrap();
            let octave = weights.first_octave;
            write!(
                text,
                "\npub(super) const {name}: Stored = Stored {{\n    set: {set},\n    \
                 max_error: 1.0 / {white}.0,\n    first_octave: {octave:?},\n    rows: &[\n"
            )
            .unwrap();
            for row in refit.rows(0) {
                text += &written(row);
            }
            text += "    ],\n};\n";
        }
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/src/plan/skin.rs"), text).unwrap();
    }

    /// A row, in lines that are not too long.
    fn written(row: &crate::plan::Row) -> String {
        // Errors are rounded up.
        let up = |error: f32| (f64::from(error) * 1e6).ceil() / 1e6;
        let [predicted, unscattered] = [row.predicted_error, row.unscattered_error].map(up);
        let mut text = format!("        ({predicted:.6}, {unscattered:.6}, &[");
        let mut column = text.len();
        for (slot, weight) in row.weights.iter().enumerate().filter(|(_, w)| **w != [0.0; 3]) {
            let steps = weight.map(|w| (f64::from(w) * fit::STEPS).round() as u32);
            let entry = format!("({slot}, {steps:?}), ");
            if column + entry.len() > 106 {
                text.truncate(text.trim_end().len());
                text += "\n            ";
                column = 12;
            }
            column += entry.len();
            text += &entry;
        }
        text.truncate(text.len() - 2);
        text + "]),\n"
    }
}
