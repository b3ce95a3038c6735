// What the blurs of a level weigh, and how they go together with those of all coarser ones. Follows
// surface.wgsl.
//
//   L(p) = w₀ E(p) + Σ_l Σ_j w_lj(s) (E ∗ G_lj)(p),  s the scale at p
//
// On a slope a Gaussian is an ellipse in the picture; its taps lie on the lattice p + i·u + j·v, whose
// steps u and v are about as far apart in mm, so that as many do.
//
// [LS15] Li & Shao 2015, Eq. 7–12.

@group(0) @binding(3) var<storage, read> weights: array<vec4f>;
@group(0) @binding(7) var here_light: texture_2d<f32>;
@group(0) @binding(8) var here_shape: texture_2d<u32>;
// The mean of the coarser levels, and where their surface is.
@group(0) @binding(9) var coarser_mean: texture_2d<f32>;
@group(0) @binding(10) var coarser_shape: texture_2d<u32>;
@group(0) @binding(12) var linear: sampler;
// Of the host.
@group(0) @binding(6) var irradiance: texture_2d<f32>;
// How much a pixel takes of its scattered light.
@group(0) @binding(4) var strength: texture_2d<f32>;
// What multiplies what is added to a target.
@group(0) @binding(5) var albedo: texture_2d<f32>;

// How many blurs share their taps: (i, j) with i² + j² ≤ 2, or ≤ 4 where they are thirteen. One more may
// have the square of 5×5, which is summed where it has weight.
override BLURS: u32 = 1;
override THIRTEEN: bool = false;
override SQUARE: bool = false;
// Whether only what scattering changes is written.
override DIFFERENCE: bool = false;
// Whether this is the frame itself, which nothing blurred before.
override FINEST: bool = false;

// How much narrower than a level's own a blur may get in the direction of a slope.
const NARROWEST = 1.3;

fn eigenvalues(m: vec3f) -> vec2f {
    let half = 0.5 * (m.x - m.z);
    let middle = 0.5 * (m.x + m.z);
    let off = sqrt(half * half + m.y * m.y);
    return vec2f(middle + off, max(middle - off, 1e-4 * middle));
}

// Pixels to a step along the contour of a slope: more would miss what lies between.
const LONGEST_STEP = 4.0;
const HALF_LOG2_E = 0.72134752;

// Steps of the taps, in pixels.
struct Lattice {
    u: vec2i,
    v: vec2i,
}

struct Scale {
    // mm² that a variance of one square pixel stands for.
    mm2: f32,
    // Where the weights of this scale are.
    row: u32,
    next: f32,
    lattice: Lattice,
}

fn scale_of(m: vec3f, id: u32) -> Scale {
    let lambda = eigenvalues(m);
    let stretch = sqrt(lambda.x / lambda.y);
    let narrower = min(stretch, NARROWEST);
    let mm2 = lambda.x / narrower;
    // As many times further along the contour of the slope as across.
    let further = stretch / sqrt(narrower);
    var lattice = Lattice(vec2i(1, 0), vec2i(0, 1));
    if further > 1.15 {
        // The eigenvector of the smaller one.
        let a = vec2f(-m.y, m.x - lambda.y);
        let b = vec2f(m.z - lambda.y, -m.y);
        let along = normalize(select(a, b, dot(b, b) > dot(a, a)));
        // Closer on the frame, where there is detail of a pixel.
        let wanted = select(1.3 * further, max(0.65 * further, 1.0), FINEST);
        let u = vec2i(round(min(wanted, LONGEST_STEP) * along));
        lattice = Lattice(u, select(vec2i(1, 0), vec2i(0, 1), abs(u.x) >= abs(u.y)));
    }
    let octave = -0.5 * log2(mm2) + log2(level.scale);
    let row = clamp((octave - view.first_octave) * ROWS_PER_OCTAVE, 0.0, f32(view.rows - 1u));
    let i = min(u32(row), view.rows - 2u);
    return Scale(mm2, ((id - 1u) * view.rows + i) * view.stride, row - f32(i), lattice);
}

fn weight_at(scale: Scale, slot: u32) -> vec3f {
    let i = scale.row + slot;
    return mix(weights[i].rgb, weights[i + view.stride].rgb, scale.next);
}

// Of all coarser levels; where there is none their light stays.
fn rest_at(scale: Scale) -> vec3f {
    if level.coarser == 0u {
        return vec3f(0.0);
    }
    return weight_at(scale, level.rest);
}

// Inverse variance of weights that have `variance` when cut off, over its own.
fn sharpness(blur: Blur, variance: vec2f) -> vec2f {
    let c = clamp(variance, vec2f(0.01), vec2f(0.97 * blur.limit));
    let t = c / blur.limit;
    let s = blur.sharpness;
    let wide = (1.0 - t) * (s.x / t + s.y + t * (s.z + t * s.w));
    // Where all but the neighbours weigh nothing, c = 2w/(1 + 2w).
    let near = min(c, vec2f(0.66));
    let narrow = -2.0 * near * log(near / (2.0 - 2.0 * near));
    return select(wide, narrow, c < vec2f(blur.narrow));
}

// What the taps of a blur weigh is 2 to the power of −this: of i², ij and j².
fn exponents(blur: Blur, plane: Plane, mm2: f32, lattice: Lattice) -> vec3f {
    let u = vec2f(lattice.u);
    let v = vec2f(lattice.v);
    let du = plane.dx * u.x + plane.dy * u.y;
    let dv = plane.dx * v.x + plane.dy * v.y;
    let metric = vec3f(dot(du, du), dot(du, dv), dot(dv, dv));
    let det = metric.x * metric.z - metric.y * metric.y;
    // The pyramid's own blur is as wide along both axes of the picture.
    let area = u.x * v.y - u.y * v.x;
    let own = blur.own / (area * area) * vec3f(dot(v, v), -dot(u, v), dot(u, u));
    let passed = blur.variance * mm2 / max(det, 1e-30) * vec3f(metric.z, -metric.y, metric.x) - own;
    let sharp = sharpness(blur, passed.xz);
    let c = passed / vec3f(sharp.x, sqrt(sharp.x * sharp.y), sharp.y);
    return HALF_LOG2_E / (c.x * c.z - c.y * c.y) * vec3f(c.z, -2.0 * c.y, c.x);
}

// What the taps of all blurs of the level weigh at a pixel of a plane; those at (i, j) and (−i, −j) weigh the same.
struct Taps {
    // Of the blurs that share their taps together, in each color: the one in the middle, then (1, 0), (0, 1),
    // (1, 1), (1, −1), (2, 0), (0, 2).
    k00: vec3f,
    k10: vec3f,
    k01: vec3f,
    k11: vec3f,
    k1m: vec3f,
    k20: vec3f,
    k02: vec3f,
    // Of the square, over the one in the middle, as powers of 2: (1, 0), (0, 1), (1, 1), (1, −1);
    // (2, 0), (0, 2), (2, 1), (2, −1); (1, 2), (−1, 2), (2, 2), (2, −2).
    s1: vec4f,
    s2: vec4f,
    s3: vec4f,
    // What its middle weighs in each color.
    square: vec3f,
    // The sum of all weights.
    wanted: vec3f,
}

// Of the taps (1, 0), (0, 1), (1, 1), (1, −1), as powers of 2.
fn ring(k: vec3f) -> vec4f {
    return -vec4f(k.x, k.z, k.x + k.y + k.z, k.x - k.y + k.z);
}

fn taps_of(plane: Plane, scale: Scale, lattice: Lattice) -> Taps {
    var taps = Taps();
    for (var j = 0u; j < 3u; j++) {
        if j < BLURS {
            let blur = level.blurs[j];
            let k = exponents(blur, plane, scale.mm2, lattice);
            let w = exp2(ring(k));
            var far = vec2f(0.0);
            if THIRTEEN {
                far = exp2(-4.0 * k.xz);
            }
            let color = weight_at(scale, blur.slot);
            let middle = color / (1.0 + 2.0 * (dot(w, vec4f(1.0)) + far.x + far.y));
            taps.k20 += far.x * middle;
            taps.k02 += far.y * middle;
            taps.k00 += middle;
            taps.k10 += w.x * middle;
            taps.k01 += w.y * middle;
            taps.k11 += w.z * middle;
            taps.k1m += w.w * middle;
            taps.wanted += color;
        }
    }
    if SQUARE {
        let color = weight_at(scale, level.blurs[3].slot);
        if any(color > vec3f(0.0)) {
            let k = exponents(level.blurs[3], plane, scale.mm2, lattice);
            taps.s1 = ring(k);
            let far = vec2f(4.0 * k.x + k.z, k.x + 4.0 * k.z);
            let skew = vec2f(2.0, -2.0) * k.y;
            taps.s2 = -vec4f(4.0 * k.x, 4.0 * k.z, far.x + skew);
            taps.s3 = vec4f(-far.y - skew, 4.0 * taps.s1.zw);
            let all = exp2(taps.s1) + exp2(taps.s2) + exp2(taps.s3);
            taps.square = color / (1.0 + 2.0 * dot(all, vec4f(1.0)));
            taps.wanted += color;
        }
    }
    return taps;
}

// The blurs of this level and of all coarser ones at a pixel.
struct Gathered {
    light: vec3f,
    weight: vec3f,
    // The mean of this level's blurs.
    own: vec3f,
}

// What a pixel's own light weighs on top of blurs, and what these weigh on top of coarser ones. Where weights fade to
// nothing a rounding error is left of them, of either sign: about 1e-7 where they lie between those of corners, and
// more where a GPU interpolates in fixed point. Nothing may be divided by it.
const LEAST_OWN = 1e-4;
const LEAST_BLURRED = 1e-5;

// The light of a pixel that holds so much for its area.
fn in_half_floats(light: vec3f) -> vec3f {
    return clamp(light, vec3f(-65504.0), vec3f(65504.0));
}

fn light_of(here: vec4f) -> vec3f {
    return in_half_floats(here.rgb / max(here.a, 1e-6));
}

// Blurs of this mean and weight, with those of all coarser levels. On no surface of the coarser level, a < 0, this
// mean stands in for it.
fn with_coarser(mean: vec3f, wanted: vec3f, rest: vec3f, coarser: vec4f) -> Gathered {
    return Gathered(wanted * mean + rest * select(mean, coarser.rgb, coarser.a >= 0.0), wanted + rest, mean);
}

// What fs_level tells: the mean of this level and the coarser ones, so that finer pixels can weigh it by
// scales of their own.
fn mean_of(g: Gathered) -> vec4f {
    let mean = (g.light + LEAST_BLURRED * g.own) / (max(g.weight, vec3f(0.0)) + LEAST_BLURRED);
    return half_floats(vec4f(in_half_floats(mean), 1.0));
}

// What fs_frame tells of a pixel that takes so much of its scattered light: all of it, or what it differs by from
// before; where it takes none, what the host had. Alpha is the host's.
fn scattered(pixel: vec2i, g: Gathered, e: vec3f, share: f32) -> vec4f {
    let pixel_of_host = vec2i(view.first_pixel) + pixel;
    let difference = share * (g.light - e * g.weight);
    var color = vec4f(difference, 0.0);
    if !DIFFERENCE {
        let host = textureLoad(irradiance, pixel_of_host, 0);
        color = vec4f(select(host.rgb, e + difference, share > 0.0), host.a);
    }
    if view.has_albedo != 0u {
        color = vec4f(color.rgb * textureLoad(albedo, pixel_of_host, 0).rgb, color.a);
    }
    return color;
}

fn share_at(pixel: vec2i) -> f32 {
    if view.has_strength == 0u {
        return 1.0;
    }
    return saturate(textureLoad(strength, vec2i(view.first_pixel) + pixel, 0).r);
}
