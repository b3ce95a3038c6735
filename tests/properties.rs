//! What holds of any input: readers refuse it or keep their word, profiles keep energy, plans their error.
//!
//! Inputs are the same on every run; `PROPTEST_CASES` and `PROPTEST_RNG_SEED` look further.

use glam::Vec3;
use image::ImageFormat;
use proptest::collection::vec;
use proptest::num::f32::ANY;
use proptest::prelude::*;
use subsurface::{DEFAULT_MAX_ERROR, Gaussian, Plan, Profile};
use subsurface_lab::renderer::Scene;

use subsurface_lab::damage::{Damage, Lie, config};
use subsurface_lab::model::{Model, flaw_of_profile, flaw_of_scene, glb, picture};

/// A picture's size is known before its pixels are, and so is that it does not fit.
#[test]
fn images_are_refused_before_they_are_decoded() {
    let mut jpeg = picture(ImageFormat::Jpeg);
    let frame = jpeg.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    jpeg[frame + 5..frame + 9].fill(255);
    let mut model = Model::default();
    model.set_picture(&jpeg);
    let error = Scene::from_glb(&model.glb()).unwrap_err();
    assert_eq!(error.input, "glTF, image 0");
    assert_eq!(error.got, "65535x65535 pixels after 0 MiB of others");
    assert_eq!(error.needs, "2048 MiB at most together");
}

/// That what is taken is as its documentation says, and what is not has a reason.
fn scene(bytes: &[u8]) -> Result<(), TestCaseError> {
    match Scene::from_glb(bytes) {
        Ok(scene) => prop_assert_eq!(flaw_of_scene(&scene), None),
        Err(error) => prop_assert!(!error.got.is_empty() && !error.needs.is_empty()),
    }
    Ok(())
}

fn profile(text: &str) -> Result<(), TestCaseError> {
    match Profile::from_json(text) {
        Ok(profile) => prop_assert_eq!(flaw_of_profile(&profile), None),
        Err(error) => prop_assert!(!error.got.is_empty() && !error.needs.is_empty()),
    }
    Ok(())
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
        lies in vec(any::<Lie>(), 1..4),
        damage in vec(any::<Damage>(), 0..3),
    ) {
        let mut model = Model::default();
        lies.iter().for_each(|lie| lie.tell(&mut model.json));
        damage.iter().for_each(|damage| damage.apply(&mut model.bytes));
        scene(&model.glb())?;
    }

    #[test]
    fn a_damaged_model_is_a_scene_or_an_error(damage in vec(any::<Damage>(), 1..6)) {
        let mut bytes = Model::default().glb();
        damage.iter().for_each(|damage| damage.apply(&mut bytes));
        scene(&bytes)?;
    }

    #[test]
    fn any_text_is_a_profile_or_an_error(text in any::<String>()) {
        profile(&text)?;
    }

    #[test]
    fn a_damaged_profile_is_a_profile_or_an_error(
        lies in vec(any::<Lie>(), 0..3),
        damage in vec(any::<Damage>(), 0..3),
    ) {
        let gaussians = Profile::SKIN.gaussians().iter();
        let terms = gaussians.map(|g| {
            serde_json::json!({"variance_mm2": g.variance_mm2, "weight": g.weight.to_array()})
        });
        let mut json = serde_json::json!({"gaussians": terms.collect::<Vec<_>>()});
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
            .map(|[v, r, g, b]| Gaussian { variance_mm2: *v, weight: Vec3::new(*r, *g, *b) })
            .collect();
        if let Ok(profile) = Profile::new(&gaussians) {
            prop_assert_eq!(flaw_of_profile(&profile), None);
        }
        let right = |x: &f32| x.is_finite() && *x >= 0.0;
        let sum: Vec3 = gaussians.iter().map(|g| g.weight).sum();
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
        let gaussians: Vec<_> = terms
            .iter()
            .map(|(power, weight)| Gaussian {
                variance_mm2: 10f32.powf(2.0 * power),
                weight: Vec3::from(*weight),
            })
            .collect();
        Profile::new(&gaussians).ok()
    })
}

proptest! {
    // Fitting takes seconds.
    #![proptest_config(config(6))]

    #[test]
    fn plans_keep_their_error_or_are_exact(
        profiles in vec(profiles(-6.0..6.0), 1..=2),
        power in prop_oneof![1 => -6.0f32..-3.3, 5 => -3.3f32..=0.0],
    ) {
        let max_error = 10f32.powf(power);
        let plan = match Plan::new(&profiles, max_error) {
            Ok(plan) => plan,
            Err(error) => {
                prop_assert!(error.input == "max_error" && max_error < 0.0005, "{}", error);
                return Ok(());
            }
        };
        prop_assert!(plan.predicted_error() <= max_error, "{}", plan);
        for i in 0..profiles.len() {
            let rows = plan.rows(i);
            prop_assert_eq!(rows.is_empty(), plan.is_exact());
            for row in rows {
                prop_assert!(row.predicted_error <= max_error);
                prop_assert!(row.px_per_mm.is_finite() && row.px_per_mm > 0.0);
                // Light that moves between blurs is neither made nor lost.
                let sum: Vec3 = row.weights.iter().sum();
                prop_assert!((sum - 1.0).abs().max_element() < 1e-5, "{}", sum);
                prop_assert!(row.weights.iter().all(|w| w.is_finite() && w.min_element() >= 0.0));
                let fetches = plan.fetches(i, row.px_per_mm);
                prop_assert!(fetches.is_some_and(|f| f.is_finite() && f > 0.0), "{:?}", fetches);
            }
            prop_assert!(rows.is_sorted_by(|a, b| a.px_per_mm < b.px_per_mm));
        }
    }

    /// Who accepts more never gets the exact effect where who accepts less gets a plan.
    #[test]
    fn looser_plans_are_not_exact_where_stricter_ones_are_not(profile in profiles(-2.0..1.0)) {
        let [strict, loose] = [DEFAULT_MAX_ERROR, 4.0 * DEFAULT_MAX_ERROR]
            .map(|max_error| Plan::new(&[profile], max_error).expect("an error that can be asked for"));
        prop_assert!(strict.is_exact() || !loose.is_exact());
    }
}
