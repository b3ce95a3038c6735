//! Media that were measured, from the papers that say so.

use super::{Layer, Medium};
use crate::Error;

/// One layer without end, of which reduced coefficients are known for red, green and blue light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// What it is.
    pub name: &'static str,
    /// Absorption σa in 1/mm.
    pub sigma_a_per_mm: [f64; 3],
    /// Reduced scattering σs′ in 1/mm.
    pub sigma_s_reduced_per_mm: [f64; 3],
    /// The index of refraction.
    pub eta: f64,
}

/// H. W. Jensen, S. R. Marschner, M. Levoy & P. Hanrahan, *A practical model for subsurface light transport*,
/// SIGGRAPH 2001, Fig. 5. Its skins were measured on the arms of two people.
pub const JENSEN_2001: [Measured; 4] = [
    Measured {
        name: "skin1",
        sigma_a_per_mm: [0.032, 0.17, 0.48],
        sigma_s_reduced_per_mm: [0.74, 0.88, 1.01],
        eta: 1.3,
    },
    Measured {
        name: "skin2",
        sigma_a_per_mm: [0.013, 0.070, 0.145],
        sigma_s_reduced_per_mm: [1.09, 1.59, 1.79],
        eta: 1.3,
    },
    Measured {
        name: "marble",
        sigma_a_per_mm: [0.0021, 0.0041, 0.0071],
        sigma_s_reduced_per_mm: [2.19, 2.62, 3.00],
        eta: 1.5,
    },
    Measured {
        name: "whole milk",
        sigma_a_per_mm: [0.0011, 0.0024, 0.014],
        sigma_s_reduced_per_mm: [2.55, 3.21, 3.77],
        eta: 1.3,
    },
];

impl Measured {
    /// The medium for red, green and blue light, scattering all ways alike.
    ///
    /// # Errors
    /// As [`Medium::new`].
    pub fn media(&self) -> Result<[Medium; 3], Error> {
        let medium = |c: usize| {
            let layer = Layer::isotropic(self.sigma_a_per_mm[c], self.sigma_s_reduced_per_mm[c]);
            Medium::homogeneous(layer, self.eta)
        };
        Ok([medium(0)?, medium(1)?, medium(2)?])
    }
}

/// Epidermis, upper dermis and bloody dermis for red, green and blue light: the skin of C. Donner & H. W.
/// Jensen, *Light diffusion in multi-layered translucent materials*, SIGGRAPH 2005, scattering with mean
/// cosine `g` by their reduced coefficients. Its blood goes on without end.
///
/// # Errors
/// As [`Medium::new`].
pub fn donner_jensen_2005(g: f64) -> Result<[Medium; 3], Error> {
    const LAYERS: [([f64; 3], [f64; 3], f64); 3] = [
        ([0.21, 0.21, 0.50], [4.8, 6.0, 6.5], 0.25),
        ([0.016, 0.019, 0.030], [3.2, 4.0, 4.6], 1.0),
        ([0.0085, 0.1, 2.5], [0.45, 0.47, 0.48], f64::INFINITY),
    ];
    let medium = |c: usize| {
        let layer =
            |(a, s, mm): ([f64; 3], [f64; 3], f64)| Layer::isotropic(a[c], s[c]).thick(mm).with_g(g);
        Medium::new(&LAYERS.map(layer), 1.4)
    };
    Ok([medium(0)?, medium(1)?, medium(2)?])
}
