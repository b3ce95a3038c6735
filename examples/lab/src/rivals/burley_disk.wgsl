// Burley's normalised diffusion, summed over a disk of samples.
// Golubev 2018, "Efficient screen-space subsurface scattering using Burley's normalized diffusion
// in real-time", SIGGRAPH Advances in Real-Time Rendering; and 2019, "Sampling Burley's normalized
// diffusion profiles".
// Burley 2015, "Extending the Disney BRDF to a BSDF with integrated subsurface scattering".
//
// Behind this text stand `S_PER_MM`, `WIDEST_PER_MM`, `SAMPLES` and `all_samples`, which has the
// samples written out.

@group(0) @binding(1) var color: texture_2d<f32>;
@group(0) @binding(2) var surfaces: texture_2d<u32>;
@group(0) @binding(3) var irradiance: texture_2d<f32>;

// The disk holds 99.7 % of the light: 16.6/s.
const REACH = 16.6;
const PX_PER_SAMPLE = 4.0;
const PI = 3.14159265;
const GOLDEN_ANGLE = 2.39996323;

struct Center {
    pixel: vec2i,
    px_per_mm: vec2f,
    // Turns the disk of this pixel.
    turn: mat2x2f,
    surface: u32,
}

struct Sums {
    light: vec3f,
    mass: vec3f,
}

// R(r) = s (e^(−sr) + e^(−sr/3))/(8πr), without the 1/8π that cancels.
fn diffusion(r_mm: f32) -> vec3f {
    let e = exp(-S_PER_MM * (r_mm / 3.0));
    return S_PER_MM * (e * e * e + e) / r_mm;
}

// A sample at r mm, in a direction of unit length, with one over its density on the disk. Weighed
// by its distance in space: √(r² + Δz²).
fn sample(center: Center, r_mm: f32, over_pdf: f32, direction: vec2f, sums: ptr<function, Sums>) {
    let offset = round(r_mm * center.px_per_mm * (center.turn * direction));
    let q = center.pixel + vec2i(offset);
    let surface = textureLoad(surfaces, clamp(q, vec2i(0), size() - 1), 0).r;
    let inside = all(q >= vec2i(0)) && all(q < size());
    if inside && (surface & ID) == (center.surface & ID) {
        let dz_mm = depth_mm(surface) - depth_mm(center.surface);
        let weight = diffusion(sqrt(r_mm * r_mm + dz_mm * dz_mm)) * over_pdf;
        (*sums).light += weight * textureLoad(color, q, 0).rgb;
        (*sums).mass += weight;
    }
}

fn size() -> vec2i {
    return vec2i(textureDimensions(surfaces));
}

// Fewer samples than are written out: the same, computed.
fn some_samples(center: Center, count: f32) -> Sums {
    var sums: Sums;
    for (var i = 0.5; i < count; i += 1.0) {
        let u = 1.0 - i / count;
        let g = pow(1.0 + 4.0 * u * (2.0 * u + sqrt(1.0 + 4.0 * u * u)), 1.0 / 3.0);
        let sr = 3.0 * log((1.0 + 1.0 / g + g) / (4.0 * u));
        let e = exp(-sr / 3.0);
        let over_pdf = sr / (WIDEST_PER_MM * WIDEST_PER_MM * (e * e * e + e));
        let angle = (i - 0.5) * GOLDEN_ANGLE;
        sample(center, sr / WIDEST_PER_MM, over_pdf, vec2f(cos(angle), sin(angle)), &sums);
    }
    return sums;
}

// A turn of each pixel's own, 0 to 1: the PCG hash.
fn hash(pixel: vec2i) -> f32 {
    let seed = u32(pixel.x) + (u32(pixel.y) << 16u);
    let state = seed * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return f32(((word >> 22u) ^ word) >> 8u) / 16777216.0;
}

@fragment
fn fs_disk(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let before = textureLoad(irradiance, pixel, 0);
    let surface = textureLoad(surfaces, pixel, 0).r;
    let px_per_mm = 1.0 / mm_per_px(surface);
    let reach_px = REACH / WIDEST_PER_MM * px_per_mm;
    if max(reach_px.x, reach_px.y) < 1.0 {
        return before;
    }
    let angle = 2.0 * PI * hash(pixel);
    let turn = mat2x2f(cos(angle), sin(angle), -sin(angle), cos(angle));
    let center = Center(pixel, px_per_mm, turn, surface);
    let count = ceil(PI * reach_px.x * reach_px.y / PX_PER_SAMPLE);
    var sums: Sums;
    if count < SAMPLES {
        sums = some_samples(center, count);
    } else {
        sums = all_samples(center);
    }
    let none = sums.mass <= vec3f(0.0);
    return vec4f(select(sums.light / sums.mass, before.rgb, none), before.a);
}

