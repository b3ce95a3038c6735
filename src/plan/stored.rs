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

    use crate::plan::{KERNELS, Row, fit, skin};
    use crate::{Plan, Profile};

    /// Name, 1 over the error, what is stored and what is fitted.
    type Plans = [(&'static str, u32, Plan, Plan); 2];

    /// Where two plans differ by more than machines do: another one's exp may differ in its last digit, and move
    /// a weight by a step.
    fn difference(stored: &Plan, refit: &Plan) -> Option<String> {
        let set = |plan: &Plan| (plan.max_error(), plan.weights().map(|w| (w.kernels, w.row_count())));
        if set(stored) != set(refit) {
            return Some(format!("{:?} for {:?}", set(stored), set(refit)));
        }
        let is_near = |a: f32, b: f32| (a - b).abs() < 2e-5;
        let differs = |(a, b): &(&Row, &Row)| {
            let mut weights = a.weights.iter().flatten().zip(b.weights.iter().flatten());
            !is_near(a.predicted_error, b.predicted_error)
                || !is_near(a.unscattered_error, b.unscattered_error)
                || !weights.all(|(a, b)| is_near(*a, *b))
        };
        let (row, _) = stored.rows(0).iter().zip(refit.rows(0)).find(differs)?;
        Some(format!("the row of {} px/mm", row.px_per_mm))
    }

    #[test]
    fn stored_plans_are_what_is_fitted() {
        let fitted = |(name, white, stored)| {
            (name, white, stored, Plan::new(&[Profile::SKIN], 1.0 / white as f32).unwrap())
        };
        let plans: Plans = [("SKIN", 255, Plan::skin()), ("SKIN_FAST", 100, Plan::skin_fast())].map(fitted);
        let different =
            plans.iter().find_map(|(name, _, stored, refit)| Some((name, difference(stored, refit)?)));
        if let Some((name, difference)) = different {
            let path = std::env::temp_dir().join("skin.rs");
            std::fs::write(&path, written(&plans)).unwrap();
            panic!("{name}: {difference}. What is fitted is {}, for src/plan/skin.rs", path.display());
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

    /// The file of what is fitted.
    fn written(plans: &Plans) -> String {
        let mut text = String::from(
            "//! Weights of skin, as they were fitted. Written by `stored_plans_are_what_is_fitted` of stored.rs, which\n\
             //! says where, when they differ.\n\nuse super::stored::Stored;\n",
        );
        for (name, white, _, refit) in plans {
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
                text += &written_row(row);
            }
            text += "    ],\n};\n";
        }
        text
    }

    /// A row, in lines that are not too long.
    fn written_row(row: &Row) -> String {
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
