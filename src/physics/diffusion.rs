//! The approximations that transport replaces, to be compared with: of one layer without end, in closed
//! form.
//!
//! - H. W. Jensen et al., *A practical model for subsurface light transport*, SIGGRAPH 2001.
//! - E. d'Eon & G. Irving, *A quantized-diffusion model for rendering translucent materials*, SIGGRAPH 2011;
//!   E. d'Eon, *A better dipole*, 2012.
//! - R. Habel, P. H. Christensen & W. Jarosz, *Photon beam diffusion*, EGSR 2013; M. Pharr, W. Jakob &
//!   G. Humphreys, *Physically based rendering*, 3rd ed., ch. 15.5.

use std::f64::consts::{FRAC_PI_2, PI};

use super::quadrature::{directions, fresnel_inside, gauss, henyey_greenstein};
use super::{Layer, Medium, Response};
use crate::Error;

/// A diffusion approximation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Diffusion {
    /// The dipole of Jensen et al. 2001. It takes all light to be scattered often.
    Dipole,
    /// Grosjean's diffusion coefficient, the boundary of d'Eon & Irving and light both from fluence and
    /// flux, with one source a mean free path deep; single scattering apart.
    BetterDipole,
    /// The same with sources along the beam of light that comes in.
    PhotonBeam,
}

impl Diffusion {
    /// What leaves around a point, single scattering included but for the dipole.
    ///
    /// # Errors
    /// A medium of more than one layer.
    pub fn response(self, medium: &Medium) -> Result<Response, Error> {
        let [layer] = medium.layers() else {
            return Err(Error::Count {
                input: "diffusion: layers",
                got: medium.layers().len(),
                needs: [1, 1],
            });
        };
        let free = 1.0 / layer.sigma_t_reduced();
        let boundary = Boundary::new(medium.eta());
        let once = Once::new(layer, medium.eta());
        let ms = |r: f64| self.multiple(layer, &boundary, r);
        let ss = |r: f64| {
            if self == Self::Dipole { 0.0 } else { once.radial(r) }
        };
        let reach = (20.0 * free).max(40.0 / layer.sigma_tr()).min(1e5 * free);
        Ok(Response::sample(1e-4 * free, reach, |r| ms(r) + ss(r)))
    }

    /// R(r) in 1/mm² of the light that was scattered more than once; of all light for the dipole.
    pub fn radial(self, layer: &Layer, eta: f64, r_mm: f64) -> f64 {
        self.multiple(layer, &Boundary::new(eta), r_mm)
    }

    fn multiple(self, layer: &Layer, boundary: &Boundary, r: f64) -> f64 {
        let sigma_t = layer.sigma_t_reduced();
        let sigma_a = layer.sigma_a_per_mm;
        let alpha = layer.albedo_reduced();
        if self == Self::Dipole {
            let d = 1.0 / (3.0 * sigma_t);
            let z = 1.0 / sigma_t;
            let k = (sigma_a / d).sqrt();
            return alpha * (flux(z, r, k) + flux(z + 4.0 * boundary.a_classical * d, r, k));
        }
        let d = (2.0 * sigma_a + layer.sigma_s_reduced()) / (3.0 * sigma_t * sigma_t);
        let k = (sigma_a / d).sqrt();
        // Light from a source at depth z and its mirror image.
        let dipole = |z: f64| {
            let image = z + 4.0 * boundary.a * d;
            let [near, far] = [z.hypot(r), image.hypot(r)];
            let fluence = ((-k * near).exp() / near - (-k * far).exp() / far) / (4.0 * PI * d);
            let flux = flux(z, r, k) + flux(image, r, k);
            (boundary.c_phi * fluence + boundary.c_e * flux, near)
        };
        if self == Self::BetterDipole {
            return alpha * alpha * dipole(1.0 / sigma_t).0;
        }
        // Over the share of the beam that is above z, closest where r is small.
        let at = |(t, weight): (f64, f64)| {
            let above = t * t * (3.0 - 2.0 * t);
            let z = -(-above).ln_1p() / sigma_t;
            let (light, near) = dipole(z);
            // Habel et al.'s correction near the beam.
            let kappa = 1.0 - (-2.0 * sigma_t * (near + z)).exp();
            6.0 * t * (1.0 - t) * weight * kappa * light
        };
        alpha * alpha * boundary.depths.iter().copied().map(at).sum::<f64>()
    }
}

/// What leaves of light that entered, by the dipole of Jensen et al. (their Eq. 15), for an albedo α′.
pub(super) fn dipole_albedo(alpha: f64, eta: f64) -> f64 {
    let q = (3.0 * (1.0 - alpha)).sqrt();
    0.5 * alpha * (1.0 + (-4.0 / 3.0 * Boundary::new(eta).a_classical * q).exp()) * (-q).exp()
}

/// Flux through the surface by a source at depth z: z(1 + kd)e^−kd/(4πd³).
fn flux(z: f64, r: f64, k: f64) -> f64 {
    let d = z.hypot(r);
    z * (1.0 + k * d) * (-k * d).exp() / (4.0 * PI * d * d * d)
}

/// What a boundary of relative index η sends back inside.
struct Boundary {
    /// A of Jensen et al.
    a_classical: f64,
    /// A of d'Eon & Irving, and the shares of fluence and flux that leave.
    a: f64,
    c_phi: f64,
    c_e: f64,
    /// Where along a beam its sources are, and what they weigh.
    depths: Vec<(f64, f64)>,
}

impl Boundary {
    fn new(eta: f64) -> Self {
        let moment = |power: i32| {
            let nodes = directions(16, eta).into_iter();
            nodes.map(|d| d.weight * d.fresnel * d.mu.powi(power)).sum::<f64>()
        };
        let [c1, c2] = [moment(1), moment(2)];
        let f_dr = if eta == 1.0 { 0.0 } else { -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta };
        Self {
            a_classical: (1.0 + f_dr) / (1.0 - f_dr),
            a: (1.0 + 3.0 * c2) / (1.0 - 2.0 * c1),
            c_phi: 0.25 * (1.0 - 2.0 * c1),
            c_e: 0.5 * (1.0 - 3.0 * c2),
            depths: gauss(64),
        }
    }
}

/// R(r) in 1/mm² of light that was scattered once, without approximation: Habel et al. 2013, over the angle
/// ψ under which a point of the beam is seen from the surface, t = r·tan ψ.
pub fn single_scattering(layer: &Layer, eta: f64, r_mm: f64) -> f64 {
    Once::new(layer, eta).radial(r_mm)
}

/// Single scattering by angle: what fades as e^−ar, and a.
struct Once(Vec<(f64, f64)>);

impl Once {
    fn new(layer: &Layer, eta: f64) -> Self {
        let sigma_t = layer.sigma_a_per_mm + layer.sigma_s_per_mm;
        let critical = (1.0 - 1.0 / (eta * eta)).sqrt().asin();
        let range = FRAC_PI_2 - critical;
        let at = |(t, weight): (f64, f64)| {
            let psi = critical + range * t * t * (3.0 - 2.0 * t);
            let (mu, cos) = psi.sin_cos();
            let leaves = henyey_greenstein(layer.g, -mu) * (1.0 - fresnel_inside(mu, eta)) * mu;
            let share = range * 6.0 * t * (1.0 - t) * weight;
            (share * layer.sigma_s_per_mm * leaves, sigma_t * (mu + 1.0) / cos)
        };
        Self(gauss(64).into_iter().map(at).collect())
    }

    fn radial(&self, r_mm: f64) -> f64 {
        self.0.iter().map(|(light, fade)| light * (-fade * r_mm).exp()).sum::<f64>() / r_mm
    }
}
