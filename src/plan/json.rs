//! Plans as text, and what is checked of one that is read.

use super::weights::Mixture;
use super::{KERNELS, Plan, Weights, check_max_error};
use crate::{Error, Profile, validate};

/// More than any profiles ask for: 8 levels and the 150 octaves that widths of f32 have.
const MAX_ROWS: usize = 1024;

/// Octaves of px/mm that are normal numbers in f32, as are their reciprocals.
const OCTAVES: f64 = 120.0;

/// A plan as it is written.
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Form {
    profiles: Vec<Profile>,
    /// None: the exact effect.
    pyramid: Option<Pyramid>,
}

#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Pyramid {
    max_error: f32,
    /// Which set, by its name.
    blurs: String,
    /// log₂ of the px/mm of the first row.
    first_octave: f64,
    /// Of each profile.
    rows: Vec<Vec<Mixture>>,
}

impl From<Plan> for Form {
    fn from(plan: Plan) -> Self {
        let pyramid = |weights: &Weights| {
            let mixture = |row: &super::Row| Mixture {
                weights: row.weights.clone(),
                predicted_error: row.predicted_error,
                unscattered_error: row.unscattered_error,
            };
            Pyramid {
                max_error: plan.max_error,
                blurs: weights.kernels.to_string(),
                first_octave: weights.first_octave,
                rows: weights.profiles.iter().map(|rows| rows.iter().map(mixture).collect()).collect(),
            }
        };
        Self { profiles: plan.profiles.to_vec(), pyramid: plan.weights().map(pyramid) }
    }
}

impl TryFrom<Form> for Plan {
    type Error = Error;

    fn try_from(form: Form) -> Result<Self, Error> {
        let Form { profiles, pyramid } = form;
        match pyramid {
            Some(pyramid) => pyramid.plan(&profiles),
            None => Self::exact(&profiles),
        }
    }
}

impl Pyramid {
    fn plan(self, profiles: &[Profile]) -> Result<Plan, Error> {
        validate::profiles(profiles)?;
        check_max_error(self.max_error)?;
        let known = KERNELS.into_iter().find(|k| k.to_string() == self.blurs);
        let Some(kernels) = known else {
            return Err(Error::Json {
                input: "plan: blurs",
                got: self.blurs,
                needs: "a set of blurs of this version; fit the plan anew",
            });
        };
        let count = |input, got, needs: [usize; 2]| match (needs[0]..=needs[1]).contains(&got) {
            true => Ok(()),
            false => Err(Error::Count { input, got, needs }),
        };
        count("plan: profiles with rows", self.rows.len(), [profiles.len(); 2])?;
        let rows = self.rows[0].len();
        count("plan: rows of a profile", rows, [2, MAX_ROWS])?;
        number("plan: first_octave", self.first_octave, -OCTAVES, OCTAVES / 2.0, "-120 to 60")?;
        for (profile, of_profile) in self.rows.iter().enumerate() {
            count("plan: rows of a profile", of_profile.len(), [rows; 2])?;
            for (i, row) in of_profile.iter().enumerate() {
                let slots = Weights::slots(&kernels);
                count("plan: weights of a row", row.weights.len(), [slots; 2])?;
                let input = |what: &str| format!("plan: {what} of row {i} of profile {profile}");
                let (predicted, max) = (row.predicted_error.into(), self.max_error.into());
                number(&input("predicted_error"), predicted, 0.0, max, "0 to max_error")?;
                let unscattered = row.unscattered_error.into();
                number(&input("unscattered_error"), unscattered, 0.0, 1.0, "0 to 1")?;
                let mut sum = [0.0; 3];
                for weight in &row.weights {
                    for (sum, weight) in sum.iter_mut().zip(weight) {
                        number(&input("weight"), (*weight).into(), 0.0, 1.0, "0 to 1")?;
                        *sum += f64::from(*weight);
                    }
                }
                for sum in sum {
                    number(&input("sum of the weights"), sum, 1.0 - 1e-5, 1.0 + 1e-5, "1 in every colour")?;
                }
            }
        }
        let weights = Weights::new(kernels, self.first_octave, self.rows);
        Ok(Plan::of(profiles, self.max_error, weights))
    }
}

fn number(input: &str, got: f64, least: f64, most: f64, needs: &'static str) -> Result<(), Error> {
    if (least..=most).contains(&got) {
        return Ok(());
    }
    Err(Error::Number { input: input.into(), got, needs })
}

impl Plan {
    /// A plan from the JSON that [`to_json`](Self::to_json) writes.
    ///
    /// # Errors
    /// Text that is not of this form; profiles that [`Profile::new`] refuses; blurs of another version;
    /// counts that do not fit together; numbers out of their range, such as weights that are not 1 in all.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let form: Form = serde_json::from_str(text).map_err(|e| Error::Json {
            input: "plan",
            got: e.to_string(),
            needs: "a text that Plan::to_json has written",
        })?;
        form.try_into()
    }

    /// The plan as JSON, for [`from_json`](Self::from_json): to fit it once, not wherever a program starts.
    pub fn to_json(&self) -> String {
        serde_json::json!(self).to_string()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::{Value, json};

    use super::*;

    #[test]
    fn plans_are_read_as_they_were_written() {
        let exact = Plan::exact(&[Profile::SKIN; 2]).unwrap();
        for plan in [Plan::skin(), Plan::skin_fast(), exact] {
            let text = plan.to_json();
            assert_eq!(Plan::from_json(&text), Ok(plan));
            assert!(text.len() < 100_000, "{}", text.len());
        }
    }

    /// The text of a plan, changed at a place.
    fn changed(at: &str, to: Value) -> Result<Plan, Error> {
        let mut value: Value = serde_json::from_str(&Plan::skin_fast().to_json()).unwrap();
        *value.pointer_mut(at).unwrap() = to;
        Plan::from_json(&value.to_string())
    }

    #[test]
    fn a_text_that_lies_is_refused_by_name() {
        for (at, to, says) in [
            ("", json!([]), "plan: got"),
            ("/profiles", json!([]), "profiles: got 0"),
            ("/profiles/0/gaussians/0/variance_mm2", json!(-1), "variance_mm2"),
            ("/pyramid/max_error", json!(0), "max_error: got 0"),
            ("/pyramid/blurs", json!("none"), "plan: blurs: got \"none\""),
            ("/pyramid/first_octave", json!(1e300), "first_octave"),
            ("/pyramid/rows", json!([]), "plan: profiles with rows: got 0"),
            ("/pyramid/rows/0", json!([]), "plan: rows of a profile: got 0"),
            ("/pyramid/rows/0/3/weights", json!([]), "plan: weights of a row: got 0"),
            ("/pyramid/rows/0/3/weights/2/1", json!(-0.1), "weight of row 3 of profile 0: got -0.1"),
            ("/pyramid/rows/0/3/weights/2/1", json!(1e39), "weight of row 3 of profile 0"),
            ("/pyramid/rows/0/3/weights/2/1", json!(0.5), "sum of the weights of row 3 of profile 0"),
            ("/pyramid/rows/0/3/predicted_error", json!(0.5), "predicted_error of row 3"),
            ("/pyramid/rows/0/3/unscattered_error", json!(2), "unscattered_error of row 3"),
            ("/pyramid/rows/0/3/unscattered_error", json!(null), "plan: got"),
        ] {
            let error = changed(at, to).unwrap_err().to_string();
            assert!(error.contains(says), "{error} does not say {says}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]

        /// A damaged text is refused, or it is a plan that can be used.
        #[test]
        fn damage_does_no_harm(
            cuts in prop::collection::vec((0.0..1.0f64, 0..40usize, "[-0-9.,eE\\[\\]{}:\"a-z]{0,4}"), 1..4),
        ) {
            let mut text = Plan::skin_fast().to_json();
            for (at, length, by) in cuts {
                let at = (at * text.len() as f64) as usize;
                let first = (0..=at).rev().find(|i| text.is_char_boundary(*i)).unwrap_or(0);
                let after = (first + length..=text.len()).find(|i| text.is_char_boundary(*i));
                text.replace_range(first..after.unwrap_or(text.len()), &by);
            }
            if let Ok(plan) = Plan::from_json(&text) {
                let rows = plan.rows(0);
                prop_assert!(rows.iter().all(|row| row.px_per_mm.is_normal()));
                if let Some(weights) = plan.weights() {
                    prop_assert!(weights.table().iter().all(|w| w.is_finite()));
                    for px_per_mm in [1e-30, 1.0, 1e30] {
                        prop_assert!(plan.fetches(0, px_per_mm).is_some_and(f32::is_finite));
                    }
                }
            }
        }
    }
}
