// Light on a surface: directional lights with soft shadows, a sky in spherical harmonics, the surface
// reflection of both. Screen and atlas are lit by the same functions of the point alone. Behind brdf.wgsl.
//
// [RH01] Ramamoorthi & Hanrahan 2001, "An efficient representation for irradiance environment maps".
// [F05]  Fernando 2005, "Percentage-closer soft shadows".
// [K13]  Karis 2013, "Real shading in Unreal Engine 4": reflection of an environment in two parts.

struct Light {
    // From the surface towards the light, of length 1.
    direction: vec3f,
    // Tangent of half the angle under which the light is seen.
    tan_radius: f32,
    // Radiance of a white diffuse surface that faces the light.
    color: vec3f,
    pad: f32,
    // World to shadow map: x, y in 0..1, z in 0..1 away from the light.
    to_map: mat4x4f,
}

struct Lighting {
    lights: array<Light, 4>,
    // Irradiance / π as nine coefficients over the unit normal.
    sky: array<vec4f, 9>,
    // World units across the shadow maps and along their depth.
    map_extent: f32,
    count: u32,
    // As brdf.wgsl names them.
    specular_model: u32,
    // Of skin: intensity ρ_s and reflectance F₀ at normal incidence.
    specular_intensity: f32,
    f0: f32,
    // Of skin: Beckmann's RMS slope m.
    slope: f32,
    // Cosine and sine of how far the environment has turned about y; zeros without one.
    turn: vec2f,
}

@group(2) @binding(0) var<uniform> lighting: Lighting;
@group(2) @binding(1) var shadow_maps: texture_depth_2d_array;
@group(2) @binding(2) var shadow_sampler: sampler_comparison;
// Radiance of the environment by direction, blurred by facets of a slope in each layer.
@group(2) @binding(3) var environment: texture_2d_array<f32>;
// What a surface reflects of a uniform environment, a layer for each model: at F₀ = 1, and in Schlick's term.
@group(2) @binding(4) var reflectance: texture_2d_array<f32>;
@group(2) @binding(5) var environment_sampler: sampler;

const BLOCKER_TAPS = 24;
const FILTER_TAPS = 40;
// The gap between occluder and receiver beyond which a penumbra grows no wider, as a share of the
// map's extent: bounds the search.
const WIDEST_GAP = 0.25;

fn vogel(i: i32, count: i32) -> vec2f {
    let r = sqrt((f32(i) + 0.5) / f32(count));
    let a = 2.399963 * f32(i);
    return r * vec2f(cos(a), sin(a));
}

// How much of light i reaches the point, 0..1. [F05], with the receiver's own plane as the depth
// to compare with, so that a wide filter does not shade the slope it lies on.
fn visibility(i: u32, world: vec3f, normal: vec3f) -> f32 {
    let light = lighting.lights[i];
    let texel = lighting.map_extent / f32(textureDimensions(shadow_maps).x);
    let lifted = world + normal * (1.5 * texel);
    let at = (light.to_map * vec4f(lifted, 1.0)).xyz;
    // Depth of the receiver's plane per step in the map; grazing planes are cut off.
    let n = normalize((light.to_map * vec4f(normal, 0.0)).xyz);
    let slope = clamp(-n.xy / min(n.z, -0.2), vec2f(-4.0), vec2f(4.0));
    let extent = vec2f(textureDimensions(shadow_maps));
    let bias = 1.5 / extent.x;

    let search = light.tan_radius * WIDEST_GAP;
    var blockers = 0.0;
    var depth = 0.0;
    for (var tap = 0; tap < BLOCKER_TAPS; tap++) {
        let offset = vogel(tap, BLOCKER_TAPS) * search;
        let texel_at = clamp(vec2i((at.xy + offset) * extent), vec2i(0), vec2i(extent) - 1);
        let occluder = textureLoad(shadow_maps, texel_at, i, 0);
        if occluder < at.z + dot(slope, offset) - bias {
            blockers += 1.0;
            depth += occluder;
        }
    }
    if blockers == 0.0 {
        return 1.0;
    }
    let gap = clamp(at.z - depth / blockers, 0.0, WIDEST_GAP);
    let radius = max(light.tan_radius * gap, 1.5 / extent.x);
    var lit = 0.0;
    for (var tap = 0; tap < FILTER_TAPS; tap++) {
        let offset = vogel(tap, FILTER_TAPS) * radius;
        lit += textureSampleCompareLevel(
            shadow_maps,
            shadow_sampler,
            at.xy + offset,
            i,
            at.z + dot(slope, offset) - bias,
        );
    }
    return lit / f32(FILTER_TAPS);
}

// [RH01]
fn sky(n: vec3f) -> vec3f {
    let s = lighting.sky;
    return max(vec3f(0.0), (s[0] + s[1] * n.y + s[2] * n.z + s[3] * n.x
        + s[4] * n.x * n.y + s[5] * n.y * n.z + s[6] * (3.0 * n.z * n.z - 1.0)
        + s[7] * n.x * n.z + s[8] * (n.x * n.x - n.y * n.y)).rgb);
}

struct Lit {
    // E/π: the radiance of a white diffuse surface.
    irradiance: vec3f,
    specular: vec3f,
}

// Reflection of one light of color 1, times cos θᵢ.
fn reflection(n: vec3f, l: vec3f, v: vec3f, m: f32, intensity: f32) -> f32 {
    let f = facets(lighting.specular_model, n, l, v, m);
    // π, since a light's color is radiance reflected by white, not irradiance.
    return PI * f.x * fresnel(lighting.specular_model, lighting.f0, intensity, f.y);
}

// The slope of layer 0 of the environment; each has twice that of the one before.
const FIRST_SLOPE: f32 = 0.05;

// Radiance of the environment from a direction, over facets of a slope; 0 without one.
fn from_environment(direction: vec3f, m: f32) -> vec3f {
    let turn = lighting.turn;
    let d = vec3f(turn.x * direction.x - turn.y * direction.z, direction.y, turn.y * direction.x + turn.x * direction.z);
    let uv = vec2f(atan2(d.x, -d.z) / (2.0 * PI) + 0.5, acos(clamp(d.y, -1.0, 1.0)) / PI);
    let last = f32(textureNumLayers(environment)) - 1.0;
    let layer = clamp(log2(m / FIRST_SLOPE), 0.0, last);
    let sharp = textureSampleLevel(environment, environment_sampler, uv, u32(layer), 0.0).rgb;
    let blurred = textureSampleLevel(environment, environment_sampler, uv, u32(min(ceil(layer), last)), 0.0).rgb;
    return mix(sharp, blurred, fract(layer));
}

// [K13]: the environment around the mirror direction, times what the surface reflects of a uniform one.
fn environment_reflection(n: vec3f, v: vec3f, m: f32, intensity: f32) -> vec3f {
    let model = lighting.specular_model;
    // Not beyond the middles of the outer texels: the sampler goes around.
    let texel = 1.0 / vec2f(textureDimensions(reflectance));
    let at = clamp(vec2f(dot(n, v), m), 0.5 * texel, 1.0 - 0.5 * texel);
    let parts = textureSampleLevel(reflectance, environment_sampler, at, model, 0.0).xy;
    // The table has Schlick's part apart.
    let share = fresnel(model, lighting.f0, intensity, 0.0) * parts.x + fresnel(model, lighting.f0, intensity, 1.0) * parts.y;
    return share * from_environment(reflect(-v, n), m);
}

fn lit(world: vec3f, normal: vec3f, to_eye: vec3f, m: f32, intensity: f32) -> Lit {
    var out = Lit(sky(normal), vec3f(0.0));
    if any(lighting.turn != vec2f(0.0)) {
        out.specular = environment_reflection(normal, to_eye, m, intensity);
    }
    for (var i = 0u; i < lighting.count; i++) {
        let light = lighting.lights[i];
        let n_l = dot(normal, light.direction);
        if n_l <= 0.0 {
            continue;
        }
        let color = light.color * visibility(i, world, normal);
        out.irradiance += color * n_l;
        out.specular += color * reflection(normal, light.direction, to_eye, m, intensity);
    }
    return out;
}
