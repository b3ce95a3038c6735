//! Scattered light that is known on paper.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::DVec3;

use subsurface::Profile;

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
        .map(|g| {
            glam::DVec3::from(g.weight.map(f64::from)) * step(x_mm, f64::from(g.variance_mm2) + blur_mm2)
        })
        .sum()
}

/// An edge E of any response, E(x) for x ≥ 0 and ½ at 0, blurred by a Gaussian: by sums over ±5 σ, which
/// are off by less than 10⁻⁵ of what a straight line across a step would be.
pub fn softened(edge: impl Fn(f64) -> f64, x_mm: f64, sigma_mm: f64) -> f64 {
    const STEPS: i32 = 60;
    let (mut mass, mut sum) = (0.0, 0.0);
    for i in -STEPS..=STEPS {
        let t = 5.0 * f64::from(i) / f64::from(STEPS);
        let weight = (-0.5 * t * t).exp();
        let x = x_mm - t * sigma_mm;
        mass += weight;
        sum += weight * if x < 0.0 { 1.0 - edge(-x) } else { edge(x) };
    }
    sum / mass
}

/// How much of a wave on a plane, of this many radians a mm, a profile lets pass.
pub fn passed_wave(rad_per_mm: f64, profile: &Profile) -> DVec3 {
    let passed = |v: f32| (-0.5 * f64::from(v) * rad_per_mm * rad_per_mm).exp();
    let gaussians = profile.gaussians().iter();
    gaussians.map(|g| glam::DVec3::from(g.weight.map(f64::from)) * passed(g.variance_mm2)).sum()
}

/// A spot exp(−r²/2s) on a plane, scattered by a profile, r mm from its middle.
pub fn scattered_spot(r_mm: f64, spot_mm2: f64, profile: &Profile) -> DVec3 {
    let spread = |v: f32| {
        let sum_mm2 = spot_mm2 + f64::from(v);
        spot_mm2 / sum_mm2 * (-r_mm * r_mm / (2.0 * sum_mm2)).exp()
    };
    let gaussians = profile.gaussians().iter();
    gaussians.map(|g| glam::DVec3::from(g.weight.map(f64::from)) * spread(g.variance_mm2)).sum()
}

/// The Legendre polynomials P₀(x), P₁(x) and so on.
pub fn legendre(x: f64) -> impl Iterator<Item = f64> {
    let (mut p0, mut p1) = (1.0, x);
    (1..).map(move |l| {
        let l = f64::from(l);
        let p = p0;
        (p0, p1) = (p1, ((2.0 * l + 1.0) * x * p1 - l * p0) / (l + 1.0));
        p
    })
}

/// How much of the spherical harmonics of degrees 0, 1, and so on a profile lets pass by chord
/// distance. A Gaussian of the chord is a von Mises–Fisher kernel, which scales those of degree l by
/// I_{l+½}(κ)/I_{½}(κ), κ = ρ²/v.
pub fn passed_harmonics(rho_mm: f64, degrees: usize, profile: &Profile) -> Vec<DVec3> {
    let mut passed = vec![DVec3::ZERO; degrees];
    for g in profile.gaussians() {
        let kappa = rho_mm * rho_mm / f64::from(g.variance_mm2);
        // The ratio I_{l+½}/I_{l−½} by its continued fraction, from far above.
        let mut ratio = 0.0;
        let mut ratios = vec![0.0; degrees];
        for l in (1..degrees + 20_000).rev() {
            ratio = 1.0 / ((2 * l + 1) as f64 / kappa + ratio);
            if l < degrees {
                ratios[l] = ratio;
            }
        }
        let mut factor = 1.0;
        for (l, sum) in passed.iter_mut().enumerate() {
            if l > 0 {
                factor *= ratios[l];
            }
            *sum += glam::DVec3::from(g.weight.map(f64::from)) * factor;
        }
    }
    passed
}

/// max(cos θ, 0) on a sphere, scattered by a profile by chord distance: Eq. 7 in closed form, divided by
/// the kernel's mass.
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
    let passed = passed_harmonics(rho_mm, TERMS, profile).into_iter();
    let scattered: Vec<DVec3> = passed.zip(coefficients).map(|(p, c)| p * c).collect();
    move |cos_theta| {
        let terms = scattered.iter().zip(legendre(cos_theta));
        terms.map(|(s, p)| *s * p).sum()
    }
}

/// max(cos φ, 0) around an endless cylinder, scattered by a profile by chord distance, at an angle φ:
/// a Gaussian of the chord scales the n-th Fourier coefficient by Iₙ(q)/I₀(q), q = ρ²/v, divided by its mass.
pub fn scattered_cosine_around(rho_mm: f64, profile: &Profile) -> impl Fn(f64) -> DVec3 {
    const TERMS: usize = 1500;
    let coefficient = |n: usize| match n {
        0 => FRAC_1_PI,
        1 => 0.5,
        _ if n % 2 == 1 => 0.0,
        _ => {
            let sign = if n.is_multiple_of(4) { -1.0 } else { 1.0 };
            sign * 2.0 / (PI * ((n * n) as f64 - 1.0))
        }
    };
    let mut scattered = vec![DVec3::ZERO; TERMS];
    for g in profile.gaussians() {
        let q = rho_mm * rho_mm / f64::from(g.variance_mm2);
        // The ratio Iₙ/Iₙ₋₁ by its continued fraction, from far above.
        let mut ratios = vec![1.0; TERMS];
        let mut ratio = 0.0;
        for n in (1..TERMS + 20_000).rev() {
            ratio = 1.0 / (2.0 * n as f64 / q + ratio);
            if n < TERMS {
                ratios[n] = ratio;
            }
        }
        let mut factor = 1.0;
        for (n, sum) in scattered.iter_mut().enumerate() {
            factor *= ratios[n];
            *sum += glam::DVec3::from(g.weight.map(f64::from)) * factor * coefficient(n);
        }
    }
    move |phi| {
        let terms = scattered.iter().enumerate();
        terms.map(|(n, s)| *s * (n as f64 * phi).cos()).sum()
    }
}

/// What an endless slab passes that is lit by 1 from behind: Eq. 7 as printed, over its two faces, and with each
/// Gaussian divided by its mass on both, as the other closed forms are.
pub fn through_slab(thickness_mm: f64, profile: &Profile) -> [DVec3; 2] {
    let mut passed = [DVec3::ZERO; 2];
    for g in profile.gaussians() {
        let weight = glam::DVec3::from(g.weight.map(f64::from));
        let share = (-thickness_mm * thickness_mm / (2.0 * f64::from(g.variance_mm2))).exp();
        passed[0] += weight * share;
        passed[1] += weight * share / (1.0 + share);
    }
    passed
}
