//! What light meets under a surface: layers that absorb and scatter, under one Fresnel boundary.

use std::ops::RangeInclusive;

use super::number;
use crate::Error;

/// Scattering that is more backward than this is more than [`Transport`](super::Transport) resolves.
pub(super) const G_RANGE: RangeInclusive<f64> = -0.5..=0.99;

/// A layer, as one colour or one wavelength sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Thickness in mm, at least 0; `f64::INFINITY` for the last layer.
    pub thickness_mm: f64,
    /// Absorption σa in 1/mm, at least 0.
    pub sigma_a_per_mm: f64,
    /// Scattering σs in 1/mm, at least 0: that of single events, (1 − g) of which is σs′.
    pub sigma_s_per_mm: f64,
    /// The mean cosine g of a scattering event (Henyey–Greenstein), −0.5 to 0.99: 0 scatters all ways
    /// alike, skin about 0.8.
    pub g: f64,
}

impl Layer {
    /// A layer without end that scatters all ways alike by σs′, as tables of reduced coefficients want it.
    pub const fn isotropic(sigma_a_per_mm: f64, sigma_s_per_mm: f64) -> Self {
        Self { thickness_mm: f64::INFINITY, sigma_a_per_mm, sigma_s_per_mm, g: 0.0 }
    }

    /// The same layer, this thick.
    pub const fn thick(self, thickness_mm: f64) -> Self {
        Self { thickness_mm, ..self }
    }

    /// The same absorption and σs′ by scattering of this mean cosine.
    pub fn with_g(self, g: f64) -> Self {
        let sigma_s_per_mm = self.sigma_s_reduced() / (1.0 - g);
        Self { sigma_s_per_mm, g, ..self }
    }

    /// σs′ = σs(1 − g).
    pub fn sigma_s_reduced(&self) -> f64 {
        self.sigma_s_per_mm * (1.0 - self.g)
    }

    /// σt′ = σa + σs′.
    pub fn sigma_t_reduced(&self) -> f64 {
        self.sigma_a_per_mm + self.sigma_s_reduced()
    }

    /// α′ = σs′/σt′.
    pub fn albedo_reduced(&self) -> f64 {
        self.sigma_s_reduced() / self.sigma_t_reduced()
    }

    /// How fast diffuse light fades: √(3σa σt′).
    pub(super) fn sigma_tr(&self) -> f64 {
        (3.0 * self.sigma_a_per_mm * self.sigma_t_reduced()).sqrt()
    }
}

/// Layers under a smooth boundary, the last of them without end.
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    layers: Vec<Layer>,
    eta: f64,
}

/// The least 1 − α′ of a last layer: below it light wanders further than any profile reaches.
const LEAST_LOSS: f64 = 1e-6;

impl Medium {
    /// The most layers: the time to solve them grows with the cube of their number.
    pub const MAX_LAYERS: usize = 8;

    /// One to eight layers from the surface down, and the index of refraction of them all against air, 1 to 3. Layers
    /// of no thickness are left out.
    ///
    /// # Errors
    /// A number that is not finite or out of its range; a last layer with an end, or that absorbs less
    /// than 10⁻⁶ of what it scatters; no layer that scatters.
    pub fn new(layers: &[Layer], eta: f64) -> Result<Self, Error> {
        if !(1.0..=3.0).contains(&eta) {
            return Err(number("medium: eta", eta, "1 to 3"));
        }
        if !(1..=Self::MAX_LAYERS).contains(&layers.len()) {
            return Err(Error::Count {
                input: "medium: layers",
                got: layers.len(),
                needs: [1, Self::MAX_LAYERS],
            });
        }
        let last = layers.len() - 1;
        for (i, layer) in layers.iter().enumerate() {
            let refuse = |field: &str, got: f64, needs: &'static str| {
                Err(number(format!("medium: {field} of layer {i}"), got, needs))
            };
            // What sums and squares of these stay far within a float.
            const RANGE: RangeInclusive<f64> = 0.0..=1e12;
            let Layer { thickness_mm, sigma_a_per_mm, sigma_s_per_mm, g } = *layer;
            if !G_RANGE.contains(&g) {
                return refuse("g", g, "-0.5 to 0.99");
            }
            if i == last && thickness_mm != f64::INFINITY {
                return refuse("thickness_mm", thickness_mm, "infinity, since it is the last");
            }
            if i != last && !RANGE.contains(&thickness_mm) {
                return refuse("thickness_mm", thickness_mm, "a number of mm, 0 to 1e12");
            }
            for (field, sigma) in [("sigma_a_per_mm", sigma_a_per_mm), ("sigma_s_per_mm", sigma_s_per_mm)] {
                if !RANGE.contains(&sigma) {
                    return refuse(field, sigma, "a number, 0 to 1e12");
                }
            }
            if i == last && sigma_a_per_mm < LEAST_LOSS * layer.sigma_s_reduced() {
                return refuse(
                    "sigma_a_per_mm",
                    sigma_a_per_mm,
                    "at least 1e-6 of its scattering, or light spreads without end",
                );
            }
        }
        let layers: Vec<_> = layers.iter().copied().filter(|l| l.thickness_mm > 0.0).collect();
        if layers.iter().all(|l| l.sigma_s_per_mm == 0.0) {
            let needs = "a number above 0 in one of them";
            return Err(number("medium: sigma_s_per_mm of all layers", 0.0, needs));
        }
        Ok(Self { layers, eta })
    }

    /// One layer without end.
    ///
    /// # Errors
    /// As [`Medium::new`].
    pub fn homogeneous(layer: Layer, eta: f64) -> Result<Self, Error> {
        Self::new(&[layer], eta)
    }

    /// The layers, from the surface down.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The index of refraction.
    pub fn eta(&self) -> f64 {
        self.eta
    }
}
