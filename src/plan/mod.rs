//! The plan: what work keeps a stated error.

mod edge_response;
mod kernels;
mod minimax;
mod weights;

use std::fmt;
use std::ops::RangeInclusive;

use glam::Vec3;

use crate::{Error, Profile, validate};
use kernels::KERNELS;
pub(crate) use kernels::{Kinds, Shape, own_blur};
#[cfg(test)]
pub(crate) use weights::ROWS_PER_OCTAVE;
pub(crate) use weights::{MAX_LEVELS, Weights};

/// 1/255, the error that a result of eight bits a channel can show, in units of white.
pub const DEFAULT_MAX_ERROR: f32 = 1.0 / 255.0;

/// The largest error of the exact effect on edges that are soft by a pixel (`tests/screen_space.rs`).
const EXACT_ERROR: f32 = 0.0005;

/// How profiles are scattered at a stated error: which blurs, how much of each at every scale, or the
/// exact effect where nothing less will do.
///
/// It is made once for a set of profiles, not for each frame: fitting a profile takes seconds. Every
/// blur is a Gaussian of a fixed width *in pixels*, those of a level twice as wide as those of the level
/// before; what changes with the scale is how much of each is taken. The weights are fitted so that
/// the largest error on straight edges is the least, along the axes of the pixels, at 45° and at 27°:
/// edges soft by σ = 1 px against the closed form, hard ones against the visible integral. It holds up
/// to the px/mm of the last of [`rows`](Self::rows), where a profile is as wide as the last level;
/// beyond, blurs stay as wide as there. Layers, and detail of a pixel on steep slopes, may be off by
/// more (docs/method.md).
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    max_error: f32,
    profiles: Vec<Profile>,
    /// None: the exact effect.
    weights: Option<Weights>,
}

/// What is done at one scale.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Pixels per mm along the direction in which a surface is foreshortened most.
    pub px_per_mm: f32,
    /// Light that stays, then each blur of the frame, then each of level 1 and so on.
    pub weights: Vec<Vec3>,
    /// The coarsest level that has weight in any row up to here; 0 is the frame. Small frames have fewer.
    pub level: usize,
    /// The largest error on straight edges, up to the next row; in units of white.
    pub predicted_error: f32,
    /// The same, were the light left as it fell.
    pub unscattered_error: f32,
}

impl Plan {
    /// The cheapest plan whose error on flat edges is at most `max_error`, in units of the radiance
    /// that the host shows as white ([`DEFAULT_MAX_ERROR`] where nobody knows better); ids count
    /// `profiles` from 1.
    ///
    /// # Errors
    /// No profile, or more than [`MAX_PROFILES`](crate::MAX_PROFILES); a `max_error` that is not a
    /// number above 0, or less than the exact effect has.
    pub fn new(profiles: &[Profile], max_error: f32) -> Result<Self, Error> {
        validate::profiles(profiles)?;
        if !max_error.is_finite() || max_error <= 0.0 {
            return Err(Error::Number {
                input: "max_error".into(),
                got: max_error.into(),
                needs: "a finite number above 0, in units of white",
            });
        }
        let mut reachable = f32::INFINITY;
        for kernels in KERNELS {
            match Weights::new(profiles, max_error, kernels) {
                Ok(weights) => {
                    return Ok(Self {
                        max_error,
                        profiles: profiles.to_vec(),
                        weights: Some(weights),
                    });
                }
                Err(error) => reachable = reachable.min(error),
            }
        }
        Err(Error::MaxError {
            got: max_error,
            reachable,
        })
    }

    /// The exact effect, whatever it takes.
    ///
    /// # Errors
    /// No profile, or more than [`MAX_PROFILES`](crate::MAX_PROFILES).
    pub fn exact(profiles: &[Profile]) -> Result<Self, Error> {
        validate::profiles(profiles)?;
        Ok(Self {
            max_error: EXACT_ERROR,
            profiles: profiles.to_vec(),
            weights: None,
        })
    }

    /// What it was made for.
    pub fn profiles(&self) -> &[Profile] {
        &self.profiles
    }

    pub(crate) fn weights(&self) -> Option<&Weights> {
        self.weights.as_ref()
    }

    /// Whether only the exact effect keeps the error.
    pub fn is_exact(&self) -> bool {
        self.weights.is_none()
    }

    /// The error that was asked for.
    pub fn max_error(&self) -> f32 {
        self.max_error
    }

    /// The largest error on straight edges, of any profile at any scale.
    pub fn predicted_error(&self) -> f32 {
        let weights = self.weights.as_ref();
        weights.map_or(EXACT_ERROR, Weights::predicted_error)
    }

    /// Texel fetches for a pixel of skin of a profile, counted from 0, on flat skin that faces the camera;
    /// `None` for the exact effect, and for a profile that the plan was not made for.
    pub fn fetches(&self, profile: usize, px_per_mm: f32) -> Option<f32> {
        let weights = self.weights.as_ref()?;
        let rows = weights.profiles.get(profile)?;
        (px_per_mm > 0.0).then(|| weights.fetches(rows, px_per_mm))
    }

    /// Which of [`rows`](Self::rows) tells a tile of skin up to which level it is blurred, by the most
    /// px/mm that any pixel of its 8×8 has, as if it faced the camera. It is beyond those that weigh the
    /// blurs there by two to three rows. None for the exact effect, which has no levels.
    pub fn tile_row(&self, px_per_mm: f32) -> Option<usize> {
        let weights = self.weights.as_ref()?;
        (px_per_mm > 0.0).then(|| weights.tile_row(px_per_mm))
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

    /// The rows of a profile, counted from 0, from the smallest scale to the largest; none of one
    /// that the plan was not made for, or of the exact effect.
    pub fn rows(&self, profile: usize) -> &[Row] {
        let weights = self.weights.as_ref();
        weights
            .and_then(|w| w.profiles.get(profile))
            .map_or(&[], |rows| rows)
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(
            f,
            "error {} asked for, {:.5} predicted",
            self.max_error,
            self.predicted_error()
        )?;
        let Some(Weights {
            kernels, profiles, ..
        }) = &self.weights
        else {
            return writeln!(f, "the exact effect");
        };
        for (what, kinds) in [("the frame", kernels.fine), ("each level", kernels.coarse)] {
            write!(f, "{what}:")?;
            for blur in kinds.blurs() {
                let taps = blur.shape.count();
                write!(f, "  {} px² by {taps} taps", blur.variance_px2)?;
            }
            writeln!(f)?;
        }
        for (rows, id) in profiles.iter().zip(1..) {
            writeln!(f, "profile {id}:  px/mm   error    level  weights")?;
            for row in rows {
                let Row {
                    px_per_mm,
                    predicted_error,
                    level,
                    ..
                } = row;
                write!(f, "  {px_per_mm:14.4}  {predicted_error:.5}  {level:5} ")?;
                for w in &row.weights {
                    let [r, g, b] = w.to_array().map(|c| (100.0 * c).round());
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

    #[test]
    fn plans_keep_what_they_state() {
        for max_error in [1.0 / 100.0, 1.0 / 255.0, 1.0 / 1000.0] {
            let since = std::time::Instant::now();
            let plan = Plan::new(&[Profile::SKIN], max_error).unwrap();
            println!("{plan}{:?}", since.elapsed());
            assert!(plan.predicted_error() <= max_error);
            assert_eq!(plan.is_exact(), max_error < 0.002);
            if let Some(useful) = plan.useful_px_per_mm(0) {
                // The widest Gaussian of skin, 7.41 mm², holds 7.8 % of red: it is seen from a twentieth of a
                // pixel on, and ten levels are as wide as it at 376 px/mm.
                println!("useful: {useful:?}");
                assert!((0.02..0.3).contains(useful.start()) && *useful.end() > 376.0);
            }
        }
    }

    #[test]
    fn profiles_of_any_width_have_a_plan() {
        let of = |variance_mm2| crate::Gaussian {
            variance_mm2,
            weight: Vec3::ONE,
        };
        for gaussians in [
            vec![of(0.0)],
            vec![of(1e-12)],
            vec![of(1e6)],
            vec![of(1e-12), of(1.0), of(1e6)],
        ] {
            let profile = Profile::new(&gaussians).unwrap();
            let plan = Plan::new(&[profile], 0.1).unwrap();
            assert!(!plan.is_exact());
            for row in plan.rows(0) {
                // Light that is moved between blurs is neither made nor lost.
                let sum: Vec3 = row.weights.iter().sum();
                assert!((sum - 1.0).abs().max_element() < 1e-5, "{sum}");
            }
        }
    }
}
