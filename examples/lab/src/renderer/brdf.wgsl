// Reflection at the surface, by five models of the same width: all take the RMS slope m of the facets.
// Nothing here depends on the renderer.
//
// [LS15] Li & Shao 2015, Eq. 4–6: Beckmann's distribution as printed, without Fresnel and shadowing.
// [B77]  Blinn 1977, "Models of light reflection for computer synthesized pictures"; its exponent by the slope,
//        Walter et al. 2007, and normalised, Akenine-Möller et al., "Real-time rendering", 4th ed., ch. 9.
// [CT82] Cook & Torrance 1982, "A reflectance model for computer graphics": Beckmann, V-shaped grooves.
// [KS01] Kelemen & Szirmay-Kalos 2001, "A microfacet based coupled specular-matte BRDF model", as d'Eon &
//        Luebke 2007 use it.
// [W07]  Walter et al. 2007, "Microfacet models for refraction through rough surfaces": GGX; its shadowing as
//        Heitz 2014, "Understanding the masking-shadowing function", has it.
// [S94]  Schlick 1994, "An inexpensive BRDF model for physically-based rendering".

const PI: f32 = 3.14159265;

const KELEMEN = 0u;
const PRINTED = 1u;
const BLINN_PHONG = 2u;
const BECKMANN = 3u;
const GGX = 4u;

// [LS15] Eq. 4 and 5.
fn beckmann(n_h: f32, m: f32) -> f32 {
    let c2 = max(n_h * n_h, 1e-4);
    let tan2 = (1.0 - c2) / c2;
    return exp(-tan2 / (m * m)) / (PI * m * m * c2 * c2);
}

fn blinn_phong(n_h: f32, m: f32) -> f32 {
    let e = max(2.0 / (m * m) - 2.0, 0.0);
    // As much as makes it reflect all that comes from above.
    let size = (e + 2.0) * (e + 4.0) / (8.0 * PI * (e + exp2(-0.5 * e)));
    return size * pow(n_h, e);
}

// [W07] Eq. 33, α = m.
fn ggx(n_h: f32, m: f32) -> f32 {
    let t = 1.0 - n_h * n_h * (1.0 - m * m);
    return m * m / (PI * t * t);
}

// Shadowing and masking over 4·(n·l)·(n·v), of facets with GGX's distribution: Smith's, correlated in height.
fn smith(n_l: f32, n_v: f32, m: f32) -> f32 {
    let m2 = m * m;
    let l = n_v * sqrt(n_l * n_l * (1.0 - m2) + m2);
    let v = n_l * sqrt(n_v * n_v * (1.0 - m2) + m2);
    return 0.5 / max(l + v, 1e-6);
}

// f_r·cos θᵢ without Fresnel, and Schlick's (1 − v·h)⁵.
fn facets(model: u32, n: vec3f, l: vec3f, v: vec3f, m: f32) -> vec2f {
    let n_l = max(dot(n, l), 0.0);
    let n_v = max(dot(n, v), 1e-4);
    let half = l + v;
    let h = normalize(half);
    let n_h = clamp(dot(n, h), 0.0, 1.0);
    let v_h = clamp(dot(v, h), 0.0, 1.0);
    let schlick = pow(1.0 - v_h, 5.0);
    switch model {
        case PRINTED {
            return vec2f(beckmann(n_h, m) * n_l / PI, 0.0); // [LS15] Eq. 6
        }
        case BLINN_PHONG {
            return vec2f(blinn_phong(n_h, m) * n_l, schlick);
        }
        case BECKMANN {
            let grooves = min(1.0, 2.0 * n_h * min(n_v, n_l) / max(v_h, 1e-4));
            return vec2f(beckmann(n_h, m) * grooves / (4.0 * n_v), schlick);
        }
        case GGX {
            return vec2f(ggx(n_h, m) * smith(n_l, n_v, m) * n_l, schlick);
        }
        default {
            return vec2f(beckmann(n_h, m) * n_l / max(dot(half, half), 1e-4), schlick);
        }
    }
}

// Reflectance that goes with facets(): [S94] by the one at normal incidence, and the intensity. The printed
// model has neither.
fn fresnel(model: u32, f0: f32, intensity: f32, schlick: f32) -> f32 {
    if model == PRINTED {
        return 1.0;
    }
    return intensity * (f0 + (1.0 - f0) * schlick);
}
