//! Diffusion profiles: how far light travels under the surface, per colour.

use crate::Error;

/// One term wᵢ·G(vᵢ, r) of a profile, with G(v, r) = exp(−r²/2v)/(2πv).
///
/// Li & Shao 2015 print Eq. 10 without the 1/v; their Eq. 12 needs it (docs/method.md).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "json", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "json", serde(deny_unknown_fields))]
pub struct Gaussian {
    /// Variance vᵢ along one axis, in mm². Zero leaves light where it fell.
    pub variance_mm2: f32,
    /// Weight wᵢ of the linear red, green and blue light, each at least 0.
    pub weight: [f32; 3],
}

/// A diffusion profile R(r) = Σ wᵢ·G(vᵢ, r) (Li & Shao 2015, Eq. 9) of 1 to 8 Gaussians.
///
/// The weights of each colour sum to 1, so that scattering neither adds nor takes energy; what
/// the skin absorbs is the business of the albedo.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "json", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "json", serde(try_from = "Terms", into = "Terms"))]
pub struct Profile {
    gaussians: [Gaussian; Self::MAX_GAUSSIANS],
    len: usize,
    fit_error: f32,
}

/// As in shaders/exact/gaussian_sum.wgsl.
const REACH_SIGMAS: f32 = 3.5;

const NONE: Gaussian = gaussian(0.0, 0.0, 0.0, 0.0);

const fn gaussian(variance_mm2: f32, red: f32, green: f32, blue: f32) -> Gaussian {
    Gaussian { variance_mm2, weight: [red, green, blue] }
}

impl Profile {
    /// The most Gaussians a profile can have.
    pub const MAX_GAUSSIANS: usize = 8;

    /// Skin, the six Gaussians of d'Eon & Luebke (GPU Gems 3, ch. 14).
    pub const SKIN: Self = Self {
        gaussians: [
            gaussian(0.0064, 0.233, 0.455, 0.649),
            gaussian(0.0484, 0.100, 0.336, 0.344),
            gaussian(0.187, 0.118, 0.198, 0.0),
            gaussian(0.567, 0.113, 0.007, 0.007),
            gaussian(1.99, 0.358, 0.004, 0.0),
            gaussian(7.41, 0.078, 0.0, 0.0),
            NONE,
            NONE,
        ],
        len: 6,
        fit_error: 0.0,
    };

    /// A profile of the given Gaussians, in any order; each colour's weights are scaled to sum
    /// to 1.
    ///
    /// # Errors
    /// None or more than 8 Gaussians; a variance or weight that is negative or not finite; a
    /// colour whose weights sum to nothing.
    pub fn new(gaussians: &[Gaussian]) -> Result<Self, Error> {
        if gaussians.is_empty() || gaussians.len() > Self::MAX_GAUSSIANS {
            return Err(Error::Count {
                input: "profile: Gaussians",
                got: gaussians.len(),
                needs: [1, Self::MAX_GAUSSIANS],
            });
        }
        let refuse = |input: String, got: f32, needs| Err(Error::Number { input, got: got.into(), needs });
        let is_valid = |x: f32| x.is_finite() && x >= 0.0;
        for (i, g) in gaussians.iter().enumerate() {
            if !is_valid(g.variance_mm2) {
                let input = format!("profile: variance_mm2 of Gaussian {i}");
                return refuse(input, g.variance_mm2, "a finite number of mm², at least 0");
            }
            if let Some(weight) = g.weight.into_iter().find(|w| !is_valid(*w)) {
                let input = format!("profile: weight of Gaussian {i}");
                return refuse(input, weight, "three finite numbers, each at least 0");
            }
        }
        let sum = [0, 1, 2].map(|c| gaussians.iter().map(|g| g.weight[c]).sum::<f32>());
        // Below the least normal number the division would overflow.
        let is_sum = |sum: f32| sum.is_finite() && sum >= f32::MIN_POSITIVE;
        if let Some((colour, sum)) =
            ["red", "green", "blue"].into_iter().zip(sum).find(|(_, s)| !is_sum(*s))
        {
            return refuse(format!("profile: sum of the {colour} weights"), sum, "a finite sum above 0");
        }
        let mut profile =
            Self { gaussians: [NONE; Self::MAX_GAUSSIANS], len: gaussians.len(), fit_error: 0.0 };
        for (to, from) in profile.gaussians.iter_mut().zip(gaussians) {
            *to = Gaussian {
                variance_mm2: from.variance_mm2,
                weight: [0, 1, 2].map(|c| from.weight[c] / sum[c]),
            };
        }
        Ok(profile)
    }

    /// The same profile, which is off by so much at the worst, 0 to 1, from the step edges of what it was
    /// fitted to. A plan adds that to its own ([`Plan::stated_error`](crate::Plan::stated_error)).
    ///
    /// # Errors
    /// A number out of its range.
    pub fn with_fit_error(self, fit_error: f32) -> Result<Self, Error> {
        if !(0.0..=1.0).contains(&fit_error) {
            let input = "profile: fit_error".into();
            return Err(Error::Number { input, got: fit_error.into(), needs: "0 to 1, in units of white" });
        }
        Ok(Self { fit_error, ..self })
    }

    /// A profile from JSON, as in
    /// `{"gaussians": [{"variance_mm2": 0.0064, "weight": [0.233, 0.455, 0.649]}]}`, beside them its
    /// `"fit_error"` if it has one.
    ///
    /// # Errors
    /// Text that is not of this form, and all that [`Profile::new`] refuses.
    #[cfg(feature = "json")]
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let terms: Terms = serde_json::from_str(text).map_err(|e| Error::Json {
            input: "profile",
            got: e.to_string(),
            needs: r#"{"gaussians": [{"variance_mm2": v, "weight": [r, g, b]}, …]}"#,
        })?;
        terms.try_into()
    }

    /// How far it is from what it was fitted to, in units of white; 0 where it stands for itself.
    pub fn fit_error(&self) -> f32 {
        self.fit_error
    }

    /// The same `width` times as wide, each variance times `width`²: for a child, a giant, or a scene whose unit
    /// is not known.
    ///
    /// # Errors
    /// A width with which a variance is negative or not finite.
    pub fn scaled(&self, width: f32) -> Result<Self, Error> {
        let wider = |g: &Gaussian| Gaussian { variance_mm2: g.variance_mm2 * width * width, ..*g };
        Self::new(&self.gaussians().iter().map(wider).collect::<Vec<_>>())?.with_fit_error(self.fit_error)
    }

    /// How far, in mm, the effects carry light: 3.5 σ of the widest Gaussian. Skin that is nearer than this
    /// to the border of a frame lacks light from beyond it.
    pub fn reach_mm(&self) -> f32 {
        let variances = self.gaussians().iter().map(|g| g.variance_mm2);
        REACH_SIGMAS * variances.fold(0.0, f32::max).sqrt()
    }

    /// The Gaussians; the weights of each colour sum to 1.
    pub fn gaussians(&self) -> &[Gaussian] {
        &self.gaussians[..self.len]
    }
}

/// A profile as it is written.
#[cfg(feature = "json")]
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Terms {
    gaussians: Vec<Gaussian>,
    #[serde(default, skip_serializing_if = "is_zero")]
    fit_error: f32,
}

#[cfg(feature = "json")]
fn is_zero(x: &f32) -> bool {
    *x == 0.0
}

#[cfg(feature = "json")]
impl TryFrom<Terms> for Profile {
    type Error = Error;

    fn try_from(terms: Terms) -> Result<Self, Error> {
        Self::new(&terms.gaussians)?.with_fit_error(terms.fit_error)
    }
}

#[cfg(feature = "json")]
impl From<Profile> for Terms {
    fn from(profile: Profile) -> Self {
        Self { gaussians: profile.gaussians().to_vec(), fit_error: profile.fit_error }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gaussian(variance_mm2: f32, weight: f32) -> Gaussian {
        Gaussian { variance_mm2, weight: [weight; 3] }
    }

    #[test]
    fn skin_keeps_energy() {
        for c in 0..3 {
            let sum: f32 = Profile::SKIN.gaussians().iter().map(|g| g.weight[c]).sum();
            // Three printed decimals, six terms.
            assert!((sum - 1.0).abs() < 1e-6, "{sum}");
        }
        assert_eq!(Profile::new(Profile::SKIN.gaussians()), Ok(Profile::SKIN));
    }

    #[test]
    fn skin_reaches_as_far_as_its_taps() {
        assert!((Profile::SKIN.reach_mm() - 9.53).abs() < 0.01);
        let shader = crate::exact::gaussian_sum::SHADER;
        let sigmas = crate::wgsl::constant(shader, "REACH_SIGMAS");
        assert_eq!(sigmas, f64::from(REACH_SIGMAS));
    }

    #[test]
    fn twice_as_wide_reaches_twice_as_far() {
        assert_eq!(Profile::SKIN.scaled(1.0), Ok(Profile::SKIN));
        let twice = Profile::SKIN.scaled(2.0).unwrap();
        assert!((twice.reach_mm() / Profile::SKIN.reach_mm() - 2.0).abs() < 1e-6);
        assert!(Profile::SKIN.scaled(f32::INFINITY).is_err());
    }

    #[test]
    fn weights_are_scaled_to_one() {
        let profile = Profile::new(&[gaussian(1.0, 3.0), gaussian(2.0, 1.0)]).unwrap();
        assert_eq!(profile.gaussians()[0].weight, [0.75; 3]);
    }

    #[test]
    fn refuses_what_cannot_scatter() {
        for (bad, says) in [
            (vec![], "got 0"),
            (vec![gaussian(1.0, 1.0); 9], "got 9"),
            (vec![gaussian(-1.0, 1.0)], "-1"),
            (vec![gaussian(f32::NAN, 1.0)], "NaN"),
            (vec![gaussian(1.0, f32::INFINITY)], "inf"),
            (vec![gaussian(1.0, -0.5), gaussian(1.0, 1.0)], "-0.5"),
            (vec![gaussian(1.0, 0.0)], "sum"),
            (vec![gaussian(1.0, f32::MAX); 2], "sum"),
        ] {
            let error = Profile::new(&bad).unwrap_err().to_string();
            assert!(error.contains(says), "{error} does not say {says}");
        }
    }

    #[cfg(feature = "json")]
    #[test]
    fn reads_json() {
        let text = r#"{"gaussians": [{"variance_mm2": 0.5, "weight": [1, 2, 4]}]}"#;
        let profile = Profile::from_json(text).unwrap();
        assert_eq!(profile.gaussians(), [gaussian(0.5, 1.0)]);
        let fitted = profile.with_fit_error(0.5).unwrap();
        let text = serde_json::to_string(&fitted).unwrap();
        assert_eq!(Profile::from_json(&text).unwrap(), fitted);
        let error = Profile::from_json(&text.replace("0.5}", "-0.5}")).unwrap_err();
        assert!(error.to_string().starts_with("profile: fit_error: got -0.5"), "{error}");
        for bad in ["", "[]", r#"{"gaussians": [{"variance": 1}]}"#, &text[..20]] {
            let error = Profile::from_json(bad).unwrap_err();
            assert!(matches!(error, Error::Json { input: "profile", .. }), "{error}");
        }
    }
}
