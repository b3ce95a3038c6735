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

// Half the inverse covariance of a blur's weights over i and j: of i², ij and j².
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
    return 0.5 / (c.x * c.z - c.y * c.y) * vec3f(c.z, -2.0 * c.y, c.x);
}

// All blurs of the level at a pixel.
struct Blurs {
    // Of each, half the inverse covariance over i and j: of i², ij and j².
    kii: vec4f,
    kij: vec4f,
    kjj: vec4f,
    // Of each, the color of its weight over the mass of its taps.
    colors: mat4x3f,
    // The sum of the weights.
    wanted: vec3f,
    has_square: bool,
}

fn blurs_at(plane: Plane, scale: Scale, lattice: Lattice) -> Blurs {
    var blurs = Blurs();
    for (var j = 0u; j < 4u; j++) {
        if j < BLURS || (SQUARE && j == 3u) {
            let k = exponents(level.blurs[j], plane, scale.mm2, lattice);
            blurs.kii[j] = k.x;
            blurs.kij[j] = k.y;
            blurs.kjj[j] = k.z;
            blurs.colors[j] = weight_at(scale, level.blurs[j].slot);
            blurs.wanted += blurs.colors[j];
        }
    }
    blurs.has_square = SQUARE && any(blurs.colors[3] > vec3f(0.0));
    let mass = mass_of_taps(blurs);
    blurs.colors[0] /= mass.x;
    blurs.colors[1] /= mass.y;
    blurs.colors[2] /= mass.z;
    blurs.colors[3] /= mass.w;
    return blurs;
}

// What the taps (i, j) and (−i, −j) weigh in each blur is exp(−this), the one in the middle being 1.
fn exponents_at(blurs: Blurs, i: i32, j: i32) -> vec4f {
    let d = vec2f(f32(i), f32(j));
    return blurs.kii * (d.x * d.x) + blurs.kij * (d.x * d.y) + blurs.kjj * (d.y * d.y);
}

fn weights_at(blurs: Blurs, i: i32, j: i32) -> vec4f {
    return weights_of(-exponents_at(blurs, i, j));
}

// Of those that there are.
fn weights_of(exponents: vec4f) -> vec4f {
    var weights = vec4f(exp(exponents.x), 0.0, 0.0, 0.0);
    if BLURS > 1u {
        weights.y = exp(exponents.y);
    }
    if BLURS > 2u {
        weights.z = exp(exponents.z);
    }
    if SQUARE {
        weights.w = exp(exponents.w);
    }
    return weights;
}

// Of the square alone, whose taps the others do not have.
fn square_weight_at(blurs: Blurs, i: i32, j: i32) -> f32 {
    return exp(-exponents_at(blurs, i, j).w);
}

// What all taps of a blur weigh.
fn mass_of_taps(blurs: Blurs) -> vec4f {
    var w = weights_at(blurs, 1, 0) + weights_at(blurs, 0, 1) + weights_at(blurs, 1, 1)
        + weights_at(blurs, 1, -1);
    if THIRTEEN {
        w += weights_at(blurs, 2, 0) + weights_at(blurs, 0, 2);
    }
    if SQUARE {
        w.w += square_weight_at(blurs, 2, 1) + square_weight_at(blurs, 2, -1)
            + square_weight_at(blurs, 1, 2) + square_weight_at(blurs, -1, 2)
            + square_weight_at(blurs, 2, 2) + square_weight_at(blurs, 2, -2);
    }
    return 1.0 + 2.0 * w;
}

// The blurs of this level and of all coarser ones at a pixel.
struct Gathered {
    light: vec3f,
    weight: vec3f,
    // The mean of this level's blurs; or what the pixel has, where none is asked for.
    own: vec3f,
}

// Weights lie between those of two rows, and on simple tiles between those of the corners. Where one fades
// to nothing what is left of it is a rounding error, of either sign: about 1e-7 on this side of 1, and more
// where a GPU interpolates in fixed point. Nothing may be divided by it.
const NEGLIGIBLE_WEIGHT = 1e-4;

// The light of a pixel that holds so much for its area.
fn in_half_floats(light: vec3f) -> vec3f {
    return clamp(light, vec3f(-65504.0), vec3f(65504.0));
}

fn light_of(here: vec4f) -> vec3f {
    return in_half_floats(here.rgb / max(here.a, 1e-6));
}

// The part that blurs have of the light, from what their taps found and what these weigh; of a weight that
// is negligible the pixel's own light takes the place.
fn blurred_by(light: vec3f, mass: vec3f, wanted: vec3f, e: vec3f) -> vec3f {
    let mean = light / max(mass, vec3f(1e-20));
    return wanted * select(e, mean, wanted > vec3f(NEGLIGIBLE_WEIGHT));
}

// On no surface of the coarser level, a < 0, this level's own light stands in for it.
fn with_coarser(blurred: vec3f, wanted: vec3f, e: vec3f, rest: vec3f, coarser: vec4f) -> Gathered {
    let own = select(e, blurred / max(wanted, vec3f(1e-6)), wanted > vec3f(1e-3));
    return Gathered(blurred + rest * select(own, coarser.rgb, coarser.a >= 0.0), wanted + rest, own);
}

// What fs_level tells: the mean of this level and the coarser ones, so that finer pixels can weigh it by
// scales of their own.
fn mean_of(g: Gathered) -> vec4f {
    let mean = select(g.own, g.light / max(g.weight, vec3f(1e-6)), g.weight > vec3f(1e-3));
    return half_floats(vec4f(in_half_floats(mean), 1.0));
}

// What fs_frame tells of a pixel that takes so much of its scattered light: all of it, or, to be added, what
// it differs by from before. Writes no alpha: it is the host's.
fn scattered(pixel: vec2i, g: Gathered, e: vec3f, share: f32) -> vec4f {
    let difference = share * (g.light - e * g.weight);
    if !DIFFERENCE {
        return vec4f(e + difference, 1.0);
    }
    if view.has_albedo == 0u {
        return vec4f(difference, 1.0);
    }
    return vec4f(difference * textureLoad(albedo, vec2i(view.first_pixel) + pixel, 0).rgb, 1.0);
}

fn share_at(pixel: vec2i) -> f32 {
    if view.has_strength == 0u {
        return 1.0;
    }
    return saturate(textureLoad(strength, vec2i(view.first_pixel) + pixel, 0).r);
}
