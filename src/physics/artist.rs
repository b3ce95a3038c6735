//! From what artists set, an albedo and a distance, to media and profiles.
//!
//! - P. H. Christensen & B. Burley, *Approximate reflectance profiles for efficient subsurface scattering*,
//!   Pixar technical memo 15-04, 2015.
//! - C. Kulla & A. Conty, *Revisiting physically based shading at Imageworks*, SIGGRAPH course 2017, after
//!   E. d'Eon: albedo to single-scattering albedo.
//! - Blender 4, Principled BSDF; Unreal 5, subsurface profiles.
//! - KHR_materials_volume and the draft of KHR_materials_volume_scatter, Khronos.

use super::medium::G_RANGE;
use super::{Layer, Medium, Response, number};
use crate::Error;

/// How Burley's width follows from albedo and distance: l/d = s(A).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Burley {
    /// Light straight down, of a mean free path l.
    Searchlight,
    /// Light from everywhere, of a mean free path l; Blender's.
    Diffuse,
    /// Of a *diffuse* mean free path l; Unreal's.
    DiffuseMeanFreePath,
}

impl Burley {
    /// R(r) = A(e^−r/d + e^−r/3d)/(8πdr) for an albedo A, above 0 and at most 0.999, and a distance in mm.
    ///
    /// # Errors
    /// An albedo or a distance out of its range.
    pub fn response(self, albedo: f64, distance_mm: f64) -> Result<Response, Error> {
        check_albedo("albedo", albedo)?;
        check_length("distance_mm", distance_mm)?;
        let d = distance_mm / self.scale(albedo);
        // What leaves within r.
        let within = |r: f64| albedo * (1.0 - 0.25 * (-r / d).exp() - 0.75 * (-r / (3.0 * d)).exp());
        let (least, rings) = (1e-4 * d, 400);
        let ratio = (100.0 * d / least).powf(1.0 / f64::from(rings));
        let radius = |i: i32| if i == 0 { 0.0 } else { least * ratio.powi(i) };
        let ring = |i: i32| (radius(i), radius(i + 1), within(radius(i + 1)) - within(radius(i)));
        Ok(Response::rings((0..rings).map(ring)))
    }

    /// s(A).
    fn scale(self, a: f64) -> f64 {
        match self {
            Self::Searchlight => 1.85 - a + 7.0 * (a - 0.8).abs().powi(3),
            Self::Diffuse => 1.9 - a + 3.5 * (a - 0.8).powi(2),
            Self::DiffuseMeanFreePath => 3.5 + 100.0 * (a - 0.33).powi(4),
        }
    }
}

fn check_albedo(name: &str, albedo: f64) -> Result<(), Error> {
    if !(albedo > 0.0 && albedo <= 0.999) {
        return Err(number(format!("artist: {name}"), albedo, "above 0, at most 0.999"));
    }
    Ok(())
}

fn check_length(name: &str, mm: f64) -> Result<(), Error> {
    if !(mm > 0.0 && mm <= 1e12) {
        return Err(number(format!("artist: {name}"), mm, "above 0, at most 1e12 mm"));
    }
    Ok(())
}

fn check_g(g: f64) -> Result<(), Error> {
    if !G_RANGE.contains(&g) {
        return Err(number("artist: g", g, "-0.5 to 0.99"));
    }
    Ok(())
}

/// The albedo α′ of one event that gives an albedo A to light from everywhere on a medium without a
/// refracting surface: Kulla & Conty, within 0.002.
fn single_albedo(a: f64) -> f64 {
    let q = 4.09712 + 4.20863 * a - (9.59217 + 41.6808 * a + 17.7126 * a * a).sqrt();
    1.0 - q * q
}

/// The medium, without a refracting surface, of albedo A and a (reduced) mean free path in mm: Blender's
/// random walk, and what Kulla & Conty describe.
///
/// # Errors
/// An albedo out of 0 to 0.999; a length that is not above 0.
pub fn random_walk(albedo: f64, mean_free_path_mm: f64, g: f64) -> Result<Medium, Error> {
    check_albedo("albedo", albedo)?;
    check_length("mean_free_path_mm", mean_free_path_mm)?;
    check_g(g)?;
    let alpha = single_albedo(albedo);
    let layer = Layer::isotropic((1.0 - alpha) / mean_free_path_mm, alpha / mean_free_path_mm);
    Medium::homogeneous(layer.with_g(g), 1.0)
}

/// The mean free path in mm of Blender's Principled BSDF ("Random Walk", "Burley"), for one colour of its
/// radius and its scale, whose product is in metres.
pub fn blender_mean_free_path_mm(radius: f64, scale: f64) -> f64 {
    1000.0 * radius * scale / (4.0 * std::f64::consts::PI)
}

/// The medium of Blender's "Random Walk (Skin)": behind a refracting surface, α′ so that Jensen et al.'s
/// dipole has the albedo, and the radius a diffuse one.
///
/// # Errors
/// An albedo out of 0 to 0.999, a radius that is not above 0, an index out of 1 to 3.
pub fn blender_skin(albedo: f64, radius_mm: f64, eta: f64, g: f64) -> Result<Medium, Error> {
    check_albedo("albedo", albedo)?;
    check_length("radius_mm", radius_mm)?;
    check_g(g)?;
    // The dipole's albedo rises with α′.
    let (mut least, mut most) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (least + most);
        if super::diffusion::dipole_albedo(middle, eta) < albedo {
            least = middle;
        } else {
            most = middle;
        }
    }
    let alpha = 0.5 * (least + most);
    let free = radius_mm * (3.0 * (1.0 - alpha)).sqrt();
    Medium::homogeneous(Layer::isotropic((1.0 - alpha) / free, alpha / free).with_g(g), eta)
}

/// A glTF material of KHR_materials_volume and KHR_materials_volume_scatter, in one colour. Its text lets a
/// renderer use diffusion profiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeScatter {
    /// multiscatterColor, the albedo, above 0 and at most 0.999.
    pub multiscatter: f64,
    /// scatterAnisotropy, −0.5 to 0.99.
    pub anisotropy: f64,
    /// attenuationColor, above 0 and below 1.
    pub attenuation: f64,
    /// attenuationDistance, in metres.
    pub attenuation_distance_m: f64,
    /// ior of KHR_materials_ior, 1 to 3; 1.5 where the material has none.
    pub ior: f64,
}

impl VolumeScatter {
    /// Its medium.
    ///
    /// # Errors
    /// A value out of its range.
    pub fn medium(&self) -> Result<Medium, Error> {
        check_albedo("multiscatterColor", self.multiscatter)?;
        if !(self.attenuation > 0.0 && self.attenuation < 1.0) {
            let needs = "above 0 and below 1";
            return Err(number("artist: attenuationColor", self.attenuation, needs));
        }
        check_length("attenuationDistance", 1000.0 * self.attenuation_distance_m)?;
        check_g(self.anisotropy)?;
        let sigma_t = -self.attenuation.ln() / (1000.0 * self.attenuation_distance_m);
        let alpha = single_albedo(self.multiscatter);
        let layer = Layer {
            thickness_mm: f64::INFINITY,
            sigma_a_per_mm: (1.0 - alpha) * sigma_t,
            sigma_s_per_mm: alpha * sigma_t,
            g: self.anisotropy,
        };
        Medium::homogeneous(layer, self.ior)
    }
}
