//! Scattered light that is known on paper.

use glam::DVec3;

use crate::Profile;

/// The step edge at x mm, blurred by a Gaussian of this variance.
pub fn step(x_mm: f64, variance_mm2: f64) -> f64 {
    if variance_mm2 == 0.0 {
        return if x_mm > 0.0 { 1.0 } else { 0.0 };
    }
    0.5 * (1.0 + libm::erf(x_mm / (2.0 * variance_mm2).sqrt()))
}

/// That edge, scattered by a profile.
pub fn scattered_step(x_mm: f64, blur_mm2: f64, profile: &Profile) -> DVec3 {
    profile
        .gaussians()
        .iter()
        .map(|g| g.weight.as_dvec3() * step(x_mm, f64::from(g.variance_mm2) + blur_mm2))
        .sum()
}

/// max(cos θ, 0) on a sphere, scattered by a profile by chord distance: Eq. 7 in closed form. A
/// Gaussian of the chord is a von Mises–Fisher kernel, which scales the l-th Legendre coefficient
/// by I_{l+½}(κ)/I_{½}(κ), κ = ρ²/v.
pub fn scattered_cosine(rho_mm: f64, profile: &Profile) -> impl Fn(f64) -> DVec3 {
    const TERMS: usize = 1500;
    let mut p_at_0 = 1.0;
    let mut coefficients = vec![0.0; TERMS];
    coefficients[0] = 0.25;
    coefficients[1] = 0.5;
    for l in (2..TERMS).step_by(2) {
        let n = l as f64;
        p_at_0 *= -(n - 1.0) / n;
        // ∫₀¹ x P_l dx = −P_l(0)/((l−1)(l+2)).
        coefficients[l] = (2.0 * n + 1.0) / 2.0 * -p_at_0 / ((n - 1.0) * (n + 2.0));
    }
    let mut scattered = vec![DVec3::ZERO; TERMS];
    for g in profile.gaussians() {
        let kappa = rho_mm * rho_mm / f64::from(g.variance_mm2);
        // The ratio I_{l+½}/I_{l−½} by its continued fraction, from far above.
        let mut ratio = 0.0;
        let mut ratios = vec![0.0; TERMS];
        for l in (1..TERMS + 20_000).rev() {
            ratio = 1.0 / ((2 * l + 1) as f64 / kappa + ratio);
            if l < TERMS {
                ratios[l] = ratio;
            }
        }
        let mut factor = 1.0;
        for l in 0..TERMS {
            if l > 0 {
                factor *= ratios[l];
            }
            scattered[l] += g.weight.as_dvec3() * factor * coefficients[l];
        }
    }
    move |cos_theta| {
        let (mut p0, mut p1) = (1.0, cos_theta);
        let mut sum = scattered[0] + scattered[1] * p1;
        for (l, s) in scattered.iter().enumerate().skip(2) {
            let n = l as f64;
            let p = ((2.0 * n - 1.0) * cos_theta * p1 - (n - 1.0) * p0) / n;
            (p0, p1) = (p1, p);
            sum += *s * p;
        }
        sum
    }
}
