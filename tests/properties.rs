//! What holds of any input: readers refuse it or keep their word, profiles keep energy, plans their error.
//!
//! Inputs are the same on every run; `PROPTEST_CASES` and `PROPTEST_RNG_SEED` look further.

use glam::Vec3;
use proptest::collection::vec;
use proptest::num::f32::ANY;
use proptest::prelude::*;
use subsurface::{DEFAULT_MAX_ERROR, Error, Gaussian, Plan, Profile};
use subsurface_lab::damage::{Damage, Lie, config};
use subsurface_lab::model::{Model, flaw_of_profile, flaw_of_scene, glb};
use subsurface_lab::renderer::Scene;

/// That what is taken is as its documentation says, and what is not has a reason.
fn is_sound<T, E: std::fmt::Display>(
    read: Result<T, E>,
    flaw: fn(&T) -> Option<String>,
) -> Result<(), TestCaseError> {
    match read {
        Ok(taken) => prop_assert_eq!(flaw(&taken), None),
        Err(error) => {
            let said = error.to_string();
            prop_assert!(said.contains(": got ") && said.contains(", needs "), "{}", said);
        }
    }
    Ok(())
}

fn scene(bytes: &[u8]) -> Result<(), TestCaseError> {
    is_sound(Scene::from_glb(bytes), flaw_of_scene)
}

fn profile(text: &str) -> Result<(), TestCaseError> {
    is_sound(Profile::from_json(text), flaw_of_profile)
}

proptest! {
    #![proptest_config(config(512))]

    #[test]
    fn any_bytes_are_a_scene_or_an_error(bytes in vec(any::<u8>(), 0..256), magic in any::<bool>()) {
        let start: &[u8] = if magic { b"glTF\x02\0\0\0" } else { b"" };
        scene(&[start, &bytes].concat())?;
        scene(&glb(&bytes, &bytes))?;
    }

    #[test]
    fn a_model_that_lies_is_a_scene_or_an_error(
        lies in vec(any::<Lie>(), 0..4),
        inside in vec(any::<Damage>(), 0..3),
        outside in vec(any::<Damage>(), 0..3),
    ) {
        let mut model = Model::default();
        lies.iter().for_each(|lie| lie.tell(&mut model.json));
        inside.iter().for_each(|damage| damage.apply(&mut model.bytes));
        let mut bytes = model.glb();
        outside.iter().for_each(|damage| damage.apply(&mut bytes));
        scene(&bytes)?;
    }

    #[test]
    fn a_damaged_profile_is_a_profile_or_an_error(
        lies in vec(any::<Lie>(), 0..3),
        damage in vec(any::<Damage>(), 0..3),
        text in any::<String>(),
    ) {
        profile(&text)?;
        let mut json = serde_json::to_value(Profile::SKIN).unwrap();
        lies.iter().for_each(|lie| lie.tell(&mut json));
        let mut bytes = json.to_string().into_bytes();
        damage.iter().for_each(|damage| damage.apply(&mut bytes));
        profile(&String::from_utf8_lossy(&bytes))?;
    }

    /// What is refused is that which the documentation says, and nothing else.
    #[test]
    fn any_gaussians_are_a_profile_or_an_error(numbers in vec([ANY; 4], 0..10)) {
        let gaussians: Vec<_> = numbers
            .iter()
            .map(|[variance_mm2, weight @ ..]| Gaussian { variance_mm2: *variance_mm2, weight: *weight })
            .collect();
        is_sound(Profile::new(&gaussians), flaw_of_profile)?;
        let right = |x: &f32| x.is_finite() && *x >= 0.0;
        let sum: Vec3 = gaussians.iter().map(|g| Vec3::from(g.weight)).sum();
        let fits = (1..=Profile::MAX_GAUSSIANS).contains(&gaussians.len())
            && numbers.iter().flatten().all(right)
            && sum.is_finite()
            && sum.min_element() >= f32::MIN_POSITIVE;
        prop_assert_eq!(Profile::new(&gaussians).is_ok(), fits);
    }

    /// The same, of numbers that fit more often than not.
    #[test]
    fn gaussians_that_fit_are_a_profile(profile in profiles(-19.0..19.0)) {
        prop_assert_eq!(flaw_of_profile(&profile), None);
        let again = Profile::new(profile.gaussians());
        prop_assert_eq!(again.map(|p| flaw_of_profile(&p)), Ok(None));
    }
}

proptest! {
    #![proptest_config(config(32))]

    #[test]
    fn a_damaged_head_is_a_scene_or_an_error(
        near in vec(any::<Damage>(), 0..3),
        far in vec(any::<Damage>(), 0..3),
    ) {
        let mut bytes = subsurface_lab::HEAD.to_vec();
        // Headers and JSON are a small part of it, and the more delicate.
        let mut first = bytes[..4096].to_vec();
        near.iter().for_each(|damage| damage.apply(&mut first));
        bytes.splice(..4096, first);
        far.iter().for_each(|damage| damage.apply(&mut bytes));
        scene(&bytes)?;
    }
}

/// Of Gaussians whose widths are such powers of 10 in mm.
fn profiles(powers: std::ops::Range<f32>) -> impl Strategy<Value = Profile> {
    let channel = prop_oneof![1 => Just(0.0f32), 4 => 0.0f32..1.0];
    let gaussian = (powers, [channel.clone(), channel.clone(), channel]);
    vec(gaussian, 1..=Profile::MAX_GAUSSIANS).prop_filter_map("a colour without light", |terms| {
        let gaussian = |(power, weight): &(f32, _)| Gaussian {
            variance_mm2: 10f32.powf(2.0 * power),
            weight: *weight,
        };
        Profile::new(&terms.iter().map(gaussian).collect::<Vec<_>>()).ok()
    })
}

proptest! {
    // A fit takes a tenth of a second or more.
    #![proptest_config(config(6))]

    #[test]
    fn plans_keep_their_error_or_say_what_can_be_kept(
        profiles in vec(profiles(-6.0..6.0), 1..=2),
        power in prop_oneof![1 => -6.0f32..-3.3, 5 => -3.3f32..=0.0],
    ) {
        let max_error = 10f32.powf(power);
        let plan = match Plan::new(&profiles, max_error) {
            Ok(plan) => plan,
            Err(Error::MaxError { got, reachable }) => {
                prop_assert!(got == max_error && reachable > max_error, "{}, {}", got, reachable);
                prop_assert!(Plan::new(&profiles, 1.001 * reachable).is_ok(), "{}", reachable);
                return Ok(());
            }
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        };
        prop_assert!(!plan.is_exact() && plan.predicted_error() <= max_error, "{}", plan);
        for i in 0..profiles.len() {
            let rows = plan.rows(i);
            prop_assert!(!rows.is_empty() && rows.is_sorted_by(|a, b| a.px_per_mm < b.px_per_mm));
            for row in rows {
                prop_assert!(row.predicted_error <= max_error);
                prop_assert!(row.px_per_mm.is_finite() && row.px_per_mm > 0.0);
                // Light that moves between blurs is neither made nor lost.
                let sum: Vec3 = row.weights.iter().map(|w| Vec3::from(*w)).sum();
                prop_assert!((sum - 1.0).abs().max_element() < 1e-5, "{}", sum);
                let mut weights = row.weights.iter().flatten();
                prop_assert!(weights.all(|w| w.is_finite() && *w >= 0.0));
                let fetches = plan.fetches(i, row.px_per_mm);
                prop_assert!(fetches.is_some_and(|f| f.is_finite() && f > 0.0), "{:?}", fetches);
            }
        }
    }

    /// Who accepts more gets a plan where who accepts less does.
    #[test]
    fn a_looser_plan_is_there_where_a_stricter_one_is(profile in profiles(-2.0..1.0)) {
        let [strict, loose] = [1.0, 4.0].map(|by| Plan::new(&[profile], by * DEFAULT_MAX_ERROR));
        prop_assert!(strict.is_err() || loose.is_ok());
    }
}
