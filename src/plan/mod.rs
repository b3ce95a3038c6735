//! The plan: what work keeps a stated error.
//!
//! A host needs [`Plan`] alone.

mod edge_response;
mod fit;
#[cfg(feature = "json")]
mod json;
mod kernels;
pub(crate) mod minimax;
#[rustfmt::skip] // as it was written by a program
mod skin;
mod stored;
mod weights;

use std::fmt;
use std::ops::RangeInclusive;
use std::sync::Arc;

use crate::{Error, Profile, validate};
use fit::Limits;
use kernels::{KERNELS, Kernels};
pub(crate) use kernels::{Kinds, Shape, own_blur};
use stored::Stored;
#[cfg(test)]
pub(crate) use weights::ROWS_PER_OCTAVE;
pub(crate) use weights::{MAX_LEVELS, Weights};

/// 1/255, the error that a result of eight bits a channel can show, in units of white.
pub const DEFAULT_MAX_ERROR: f32 = 1.0 / 255.0;

/// The largest error of the exact effect on edges that are soft by a pixel (`tests/screen_space.rs`).
const EXACT_ERROR: f32 = 0.0005;

/// How profiles are scattered at a stated error: by which blurs and how much of each at every scale, or by
/// the exact effect.
///
/// A plan is made once for a set of profiles, not for each frame, and a clone shares its weights.
/// [`skin`](Self::skin) is there at once; another profile takes some tenths of a second to
/// [fit](Self::new). Every blur is a Gaussian of a fixed width *in pixels*, those of a level twice as wide
/// as those of the level before; what changes with the scale is how much of each is taken. The weights are
/// fitted so that the largest error on straight edges is the least, along the axes of the pixels, at 45° and
/// at 27°:
/// edges soft by σ = 1 px against the closed form, hard ones against the visible integral. It holds up
/// to the last of [`useful_px_per_mm`](Self::useful_px_per_mm), where a profile is as wide as the last level;
/// beyond, blurs stay as wide as there. Layers, and detail of a pixel on steep slopes, may be off by
/// more (docs/method.md).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "json", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "json", serde(try_from = "json::Form", into = "json::Form"))]
pub struct Plan {
    max_error: f32,
    profiles: Arc<[Profile]>,
    /// None: the exact effect.
    weights: Option<Arc<Weights>>,
}

/// What is done at one scale; between two rows weights are interpolated, linearly in log₂ of the px/mm.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[doc(hidden)] // of use to the lab alone, as what is made of it below
pub struct Row {
    /// Pixels per mm along the direction in which a surface is foreshortened most.
    pub px_per_mm: f32,
    /// How much red, green and blue light stays, then how much each blur of the frame takes, then each of
    /// level 1 and so on; 1 in all.
    pub weights: Vec<[f32; 3]>,
    /// The coarsest level that has weight in any row up to here; 0 is the frame. Small frames have fewer.
    pub level: usize,
    /// The largest error on straight edges, up to the next row; in units of white.
    pub predicted_error: f32,
    /// The same, were the light left as it fell.
    pub unscattered_error: f32,
}

impl Plan {
    /// [`Profile::SKIN`] at 1/255, the error that a result of eight bits a channel can show.
    pub fn skin() -> Self {
        Self::stored(&skin::SKIN)
    }

    /// [`Profile::SKIN`] at 1/100: cheaper, and hardly seen in motion.
    pub fn skin_fast() -> Self {
        Self::stored(&skin::SKIN_FAST)
    }

    fn stored(stored: &Stored) -> Self {
        Self::of(&[Profile::SKIN], stored.max_error, stored.weights())
    }

    fn of(profiles: &[Profile], max_error: f32, weights: Weights) -> Self {
        Self { max_error, profiles: profiles.into(), weights: Some(Arc::new(weights)) }
    }

    /// Fits the cheapest plan whose error on flat edges is at most `max_error`, in units of the radiance
    /// that the host shows as white ([`DEFAULT_MAX_ERROR`] where nobody knows better); ids count
    /// `profiles` from 1.
    ///
    /// # Errors
    /// No profile, or more than [`MAX_PROFILES`](crate::MAX_PROFILES); a `max_error` that is not a
    /// number above 0; [`Error::MaxError`] where no set of blurs keeps it.
    pub fn new(profiles: &[Profile], max_error: f32) -> Result<Self, Error> {
        validate::profiles(profiles)?;
        check_max_error(max_error)?;
        // Blurs that an error does not ask for are left out, which may cost a little more than it allows
        // between two scales. How far the most exact set is off with all of its blurs is the least that can
        // be kept.
        let fit = |kernels: Kernels, spare: f32, hopeless: f32| {
            let limits = Limits { max_error, spare, hopeless };
            fit::fit(profiles, kernels, limits)
        };
        let [.., most_exact] = KERNELS;
        let weights = KERNELS
            .into_iter()
            .find_map(|kernels| fit(kernels, max_error, max_error))
            .or_else(|| fit(most_exact, 0.0, f32::INFINITY));
        match weights {
            Some(weights) if weights.predicted_error() <= max_error => {
                Ok(Self::of(profiles, max_error, weights))
            }
            weights => Err(Error::MaxError {
                got: max_error,
                reachable: weights.map_or(f32::INFINITY, |w| w.predicted_error()),
            }),
        }
    }

    /// The exact effect, whatever it takes.
    ///
    /// # Errors
    /// No profile, or more than [`MAX_PROFILES`](crate::MAX_PROFILES).
    pub fn exact(profiles: &[Profile]) -> Result<Self, Error> {
        validate::profiles(profiles)?;
        Ok(Self { max_error: EXACT_ERROR, profiles: profiles.into(), weights: None })
    }

    /// What it was made for.
    pub fn profiles(&self) -> &[Profile] {
        &self.profiles
    }

    pub(crate) fn weights(&self) -> Option<&Weights> {
        self.weights.as_deref()
    }

    /// Whether it is the exact effect.
    pub fn is_exact(&self) -> bool {
        self.weights.is_none()
    }

    /// The error that was asked for.
    pub fn max_error(&self) -> f32 {
        self.max_error
    }

    /// The largest error on straight edges, of any profile at any scale.
    pub fn predicted_error(&self) -> f32 {
        self.weights().map_or(EXACT_ERROR, Weights::predicted_error)
    }

    /// The largest error on straight edges to what the profiles were fitted to: what the blurs are off by and,
    /// on top of it, [`Profile::fit_error`].
    pub fn stated_error(&self) -> f32 {
        let of = |(i, profile): (usize, &Profile)| {
            let rows = self.rows(i).iter().map(|row| row.predicted_error);
            let blurs = if self.is_exact() { EXACT_ERROR } else { rows.fold(0.0, f32::max) };
            blurs + profile.fit_error()
        };
        self.profiles.iter().enumerate().map(of).fold(0.0, f32::max)
    }

    /// The pixels per mm between which the plan is of use to a profile, counted from 0: at fewer, leaving the
    /// light as it fell is within the error, too, and a host may skip the skin; at more, blurs no longer
    /// grow with the profile. None of a profile that the plan was not made for or that never blurs by more
    /// than the error, and for the exact effect.
    pub fn useful_px_per_mm(&self, profile: usize) -> Option<RangeInclusive<f32>> {
        let rows = self.rows(profile);
        let first = rows.iter().find(|r| r.unscattered_error > self.max_error)?;
        Some(first.px_per_mm..=rows.last()?.px_per_mm)
    }
}

/// What it does at each scale, for tools that show it.
#[doc(hidden)] // of use to the lab alone
impl Plan {
    /// The rows of a profile, counted from 0, from the smallest scale to the largest; none of one
    /// that the plan was not made for, or of the exact effect.
    pub fn rows(&self, profile: usize) -> &[Row] {
        self.weights().and_then(|w| w.profiles.get(profile)).map_or(&[], |rows| rows)
    }

    /// What each of a row's [`weights`](Row::weights) weighs: the level that is blurred, 0 for the frame, and
    /// the variance in square pixels of that level, what downsampling blurs by included. The light that stays
    /// comes first. Empty for the exact effect.
    pub fn blurs(&self) -> Vec<(usize, f64)> {
        self.weights().map_or(Vec::new(), |w| w.kernels.blurs(w.levels))
    }

    /// Texel fetches for a pixel of skin of a profile, counted from 0, on flat skin that faces the camera;
    /// `None` for the exact effect, and for a profile that the plan was not made for.
    pub fn fetches(&self, profile: usize, px_per_mm: f32) -> Option<f32> {
        let weights = self.weights()?;
        let rows = weights.profiles.get(profile)?;
        (px_per_mm > 0.0).then(|| weights.fetches(rows, px_per_mm))
    }
}

fn check_max_error(max_error: f32) -> Result<(), Error> {
    if !max_error.is_finite() || max_error <= 0.0 {
        return Err(Error::Number {
            input: "max_error".into(),
            got: max_error.into(),
            needs: "a finite number above 0, in units of white",
        });
    }
    Ok(())
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [predicted, stated] = [self.predicted_error(), self.stated_error()];
        write!(f, "error {} asked for, {predicted:.5} predicted", self.max_error)?;
        if stated > predicted {
            write!(f, ", {stated:.5} with the profiles' own")?;
        }
        writeln!(f)?;
        let Some(weights) = self.weights() else {
            return writeln!(f, "the exact effect");
        };
        writeln!(f, "{}", weights.kernels)?;
        for (rows, id) in weights.profiles.iter().zip(1..) {
            writeln!(f, "profile {id}:  px/mm   error    level  weights")?;
            for row in rows {
                let Row { px_per_mm, predicted_error, level, .. } = row;
                write!(f, "  {px_per_mm:14.4}  {predicted_error:.5}  {level:5} ")?;
                for w in &row.weights {
                    let [r, g, b] = w.map(|c| (100.0 * c).round());
                    write!(f, " {r:.0}/{g:.0}/{b:.0}")?;
                }
                writeln!(f)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn plans_keep_what_they_state() {
        for max_error in [1.0 / 100.0, 1.0 / 255.0] {
            let since = std::time::Instant::now();
            let plan = Plan::new(&[Profile::SKIN], max_error).unwrap();
            println!("{plan}{:?}", since.elapsed());
            assert!(plan.predicted_error() <= max_error);
            assert!(!plan.is_exact());
            if let Some(useful) = plan.useful_px_per_mm(0) {
                // The widest Gaussian of skin, 7.41 mm², holds 7.8 % of red: it is seen from a twentieth of a
                // pixel on, and ten levels are as wide as it at 376 px/mm.
                println!("useful: {useful:?}");
                assert!((0.02..0.3).contains(useful.start()) && *useful.end() > 376.0);
            }
        }
    }

    #[test]
    fn what_a_profile_is_off_by_is_added() {
        let one = crate::Gaussian { variance_mm2: 1.0, weight: [1.0; 3] };
        let skin = Profile::SKIN.with_fit_error(0.01).unwrap();
        let profiles = [Profile::new(&[one]).unwrap(), skin];
        let plan = Plan::new(&profiles, 0.03).unwrap();
        let worst = |i: usize| plan.rows(i).iter().map(|row| row.predicted_error).fold(0.0, f32::max);
        assert_eq!(plan.stated_error(), worst(0).max(worst(1) + 0.01));
        assert_eq!(Plan::exact(&profiles).unwrap().stated_error(), EXACT_ERROR + 0.01);
        assert_eq!(Plan::skin().stated_error(), Plan::skin().predicted_error());
    }

    #[test]
    fn skin_is_there_at_once() {
        let since = std::time::Instant::now();
        let plans = [Plan::skin(), Plan::skin_fast()];
        let took = since.elapsed();
        println!("{took:?}");
        // Some tens of microseconds, on a machine that may be busy.
        assert!(took.as_millis() < 5);
        let error = plans.map(|plan| (plan.predicted_error() / plan.max_error()) as f64);
        assert!(error.into_iter().all(|e| (0.5..=1.0).contains(&e)));
    }

    #[test]
    fn what_is_said_to_be_reachable_is() {
        let one = crate::Gaussian { variance_mm2: 1.0, weight: [1.0; 3] };
        for profile in [Profile::SKIN, Profile::new(&[one]).unwrap()] {
            let since = std::time::Instant::now();
            let refused = Plan::new(&[profile], 1e-4);
            println!("{refused:?} {:?}", since.elapsed());
            let Err(Error::MaxError { got, reachable }) = refused else {
                panic!("{refused:?}");
            };
            assert!(got == 1e-4 && reachable < 0.01);
            Plan::new(&[profile], reachable).unwrap();
        }
    }

    #[test]
    fn profiles_of_any_width_have_a_plan() {
        let of = |variance_mm2| crate::Gaussian { variance_mm2, weight: [1.0; 3] };
        for gaussians in [vec![of(0.0)], vec![of(1e-12)], vec![of(1e6)], vec![of(1e-12), of(1.0), of(1e6)]]
        {
            let profile = Profile::new(&gaussians).unwrap();
            let plan = Plan::new(&[profile], 0.1).unwrap();
            assert!(!plan.is_exact());
            for row in plan.rows(0) {
                // Light that is moved between blurs is neither made nor lost.
                let sum: Vec3 = row.weights.iter().map(|w| Vec3::from(*w)).sum();
                assert!((sum - 1.0).abs().max_element() < 1e-5, "{sum}");
            }
        }
    }
}
