// The blurs of a level, and those of all coarser ones. Follows surface.wgsl.
//
//   L(p) = w₀ E(p) + Σ_l Σ_j w_lj(s) (E ∗ G_lj)(p),  s the scale at p
//
// Weighing is by the plane through the pixel where its neighbours lie on that plane, and by their
// distance in space where they do not. On a slope a Gaussian is an ellipse in the picture; its taps lie
// on the lattice p + i·u + j·v, whose steps u and v are about as far apart in mm, so that as many do.
//
// [LS15] Li & Shao 2015, Eq. 7–12.

@group(0) @binding(3) var<storage, read> weights: array<vec4f>;
@group(0) @binding(7) var here_light: texture_2d<f32>;
@group(0) @binding(8) var here_shape: texture_2d<u32>;
// The mean of the coarser levels, and where their surface is.
@group(0) @binding(9) var coarser_mean: texture_2d<f32>;
@group(0) @binding(10) var coarser_shape: texture_2d<u32>;
@group(0) @binding(12) var linear: sampler;

// How many blurs share their taps: (i, j) with i² + j² ≤ 2, or ≤ 4 where they are thirteen. One more may
// have the square of 5×5, which is summed where it has weight.
override BLURS: u32 = 1;
override THIRTEEN: bool = false;
override SQUARE: bool = false;

const ROWS_PER_OCTAVE = 6.0;
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
// Variance of the weights of a blur that hardly reaches the next pixel, in square pixels.
const NARROWEST_WEIGHTS = 0.25;

struct Scale {
    // mm² that a variance of one square pixel stands for.
    mm2: f32,
    // Steps of the lattice, in pixels.
    u: vec2i,
    v: vec2i,
    // Where the weights of this scale are.
    row: u32,
    next: f32,
}

fn scale_of(m: vec3f, id: u32) -> Scale {
    let lambda = eigenvalues(m);
    let stretch = sqrt(lambda.x / lambda.y);
    let narrower = min(stretch, NARROWEST);
    let mm2 = lambda.x / narrower;
    // As many times further along the contour of the slope as across.
    let further = stretch / sqrt(narrower);
    var u = vec2i(1, 0);
    var v = vec2i(0, 1);
    if further > 1.15 {
        // The eigenvector of the smaller one.
        let a = vec2f(-m.y, m.x - lambda.y);
        let b = vec2f(m.z - lambda.y, -m.y);
        let along = normalize(select(a, b, dot(b, b) > dot(a, a)));
        u = vec2i(round(min(1.3 * further, LONGEST_STEP) * along));
        v = select(vec2i(1, 0), vec2i(0, 1), abs(u.x) >= abs(u.y));
    }
    let octave = -0.5 * log2(mm2) + log2(level.scale);
    let row = clamp((octave - view.first_octave) * ROWS_PER_OCTAVE, 0.0, f32(view.rows - 1u));
    let i = min(u32(row), view.rows - 2u);
    return Scale(mm2, u, v, ((id - 1u) * view.rows + i) * view.stride, row - f32(i));
}

fn weight_at(scale: Scale, slot: u32) -> vec3f {
    let i = scale.row + slot;
    return mix(weights[i].rgb, weights[i + view.stride].rgb, scale.next);
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
fn exponents(blur: Blur, plane: Plane, scale: Scale) -> vec3f {
    let u = vec2f(scale.u);
    let v = vec2f(scale.v);
    let du = plane.dx * u.x + plane.dy * u.y;
    let dv = plane.dx * v.x + plane.dy * v.y;
    let metric = vec3f(dot(du, du), dot(du, dv), dot(dv, dv));
    let det = metric.x * metric.z - metric.y * metric.y;
    // The pyramid's own blur is as wide along both axes of the picture.
    let area = u.x * v.y - u.y * v.x;
    let own = blur.own / (area * area) * vec3f(dot(v, v), -dot(u, v), dot(u, u));
    let passed = blur.variance * scale.mm2 / max(det, 1e-30) * vec3f(metric.z, -metric.y, metric.x) - own;
    let sharp = sharpness(blur, passed.xz);
    let c = passed / vec3f(sharp.x, sqrt(sharp.x * sharp.y), sharp.y);
    return 0.5 / (c.x * c.z - c.y * c.y) * vec3f(c.z, -2.0 * c.y, c.x);
}

// What a pixel gathers from.
struct Center {
    pixel: vec2i,
    id: u32,
    plane: Plane,
    // p·(ray, 1) grows by so much along u and v, p.z too; and (ray, 1)².
    to_ray_u: vec2f,
    to_ray_v: vec2f,
    ray2: f32,
    last: vec2i,
    // Of each blur, 1/2v in mm.
    half: vec4f,
    // Of each blur, how many times more its square is with what the pyramid blurs by itself, less 1.
    untold: vec4f,
    // Of each blur, half the inverse covariance over i and j: of i², ij and j².
    kii: vec4f,
    kij: vec4f,
    kjj: vec4f,
    // Of each blur, the color of its weight over the mass of its taps.
    colors: mat4x3f,
    has_square: bool,
}

var<private> center: Center;
var<private> scale: Scale;
// Light by what it weighs, and what it weighs.
var<private> light: vec3f;
var<private> mass: vec3f;

// What the taps (i, j) and (−i, −j) weigh in each blur, the one in the middle being 1; those that are
// of the square alone nothing in the others.
fn weights_of(i: i32, j: i32) -> vec4f {
    let d = vec2f(f32(i), f32(j));
    let w = exp(-(center.kii * (d.x * d.x) + center.kij * (d.x * d.y) + center.kjj * (d.y * d.y)));
    let apart = i * i + j * j;
    let near = select(0.0, 1.0, apart <= select(2, 4, THIRTEEN));
    return w * vec4f(near, f32(BLURS > 1u) * near, f32(BLURS > 2u) * near, f32(SQUARE));
}

// What all taps of a blur weigh.
fn mass_of_taps() -> vec4f {
    var w = weights_of(1, 0) + weights_of(0, 1) + weights_of(1, 1) + weights_of(1, -1);
    if THIRTEEN {
        w += weights_of(2, 0) + weights_of(0, 2);
    }
    if SQUARE {
        if center.has_square {
            w += weights_of(2, 1) + weights_of(2, -1) + weights_of(1, 2) + weights_of(-1, 2)
                + weights_of(2, 2) + weights_of(2, -2);
        }
    }
    return 1.0 + 2.0 * w;
}

fn tap(i: i32, j: i32, weights: vec4f) {
    let q = center.pixel + i * scale.u + j * scale.v;
    if !CAREFUL {
        let there = textureLoad(here_light, q, 0);
        let k = there.a * (center.colors * weights);
        light += k * there.rgb;
        mass += k;
        return;
    }
    if any(q < vec2i(0)) || any(q > center.last) {
        return;
    }
    let there = textureLoad(here_shape, q, 0).rg;
    if there.x >> 24u != center.id {
        return;
    }
    let e = textureLoad(here_light, q, 0);
    // Off the plane along the ray, what the squared distance has more than on it.
    let on_ray = f32(i) * center.to_ray_u + f32(j) * center.to_ray_v;
    let off = bitcast<f32>(there.y) - center.plane.z - on_ray.y;
    let bend = off * (2.0 * on_ray.x + off * center.ray2);
    // What the pyramid blurs by itself knows no distance off the plane, which on a bent surface grows as
    // that on it to the fourth: taps make up for it. At a step in depth there is nothing to make up for.
    let off_plane = bend * center.half;
    let bent = off_plane * (1.0 + center.untold / (1.0 + 2.0 * abs(off_plane)));
    // No weight grows beyond the middle's.
    let nearness = exp(min(-bent, -log(max(weights, vec4f(1e-20)))));
    let k = e.a * (center.colors * (weights * nearness));
    light += k * e.rgb;
    mass += k;
}

fn pair(i: i32, j: i32) {
    let weights = weights_of(i, j);
    tap(i, j, weights);
    tap(-i, -j, weights);
}

// Sums the light around the center.
fn gather() {
    light = vec3f(0.0);
    mass = vec3f(0.0);
    tap(0, 0, vec4f(1.0));
    pair(1, 0);
    pair(0, 1);
    pair(1, 1);
    pair(1, -1);
    if THIRTEEN {
        pair(2, 0);
        pair(0, 2);
    }
    if SQUARE {
        if center.has_square {
            pair(2, 1);
            pair(2, -1);
            pair(1, 2);
            pair(-1, 2);
            pair(2, 2);
            pair(2, -2);
        }
    }
}

// The mean of the coarser levels at a pixel of this one, of its own surface only; a < 0 where there is
// none of it.
fn coarser_at(pixel: vec2i) -> vec4f {
    if !CAREFUL {
        // The texture may be larger than the level.
        let uv = (vec2f(pixel) + 0.5) / (2.0 * vec2f(textureDimensions(coarser_mean)));
        return vec4f(textureSampleLevel(coarser_mean, linear, uv, 0.0).rgb, 1.0);
    }
    let plane = center.plane;
    let last = vec2i(textureDimensions(coarser_shape)) - 1;
    let odd = pixel & vec2i(1);
    let near = pixel >> vec2u(1u);
    let tolerance = 2.0 * TOLERANCE * max(length(plane.dx), length(plane.dy));
    // At the border of the frame, where the light of two pixels goes on as between them.
    var side = 2 * odd - 1;
    let beyond = (near + side < vec2i(0)) | (near + side > last);
    side = select(side, -side, beyond & (last > vec2i(0)));
    let share_far = select(vec2f(0.25), vec2f(-0.25), beyond);
    var total = vec4f(0.0);
    for (var i = 0; i < 4; i++) {
        let far = vec2i(i & 1, i >> 1u);
        let q = clamp(near + far * side, vec2i(0), last);
        let there = textureLoad(coarser_shape, q, 0).rg;
        // Steps of this level from the pixel to the middle of the coarser one.
        let offset = 2.0 * vec2f(q - near) + 0.5 - vec2f(odd);
        let dz = bitcast<f32>(there.y) - plane.z - plane.dx.z * offset.x - plane.dy.z * offset.y;
        let shares = select(1.0 - share_far, share_far, far == vec2i(1));
        let near_plane = saturate(2.0 - 2.0 * abs(dz) / tolerance);
        let w = shares.x * shares.y * near_plane * f32(there.x >> 24u == center.id);
        total += w * vec4f(textureLoad(coarser_mean, q, 0).rgb, 1.0);
    }
    if total.a < 1e-3 {
        return vec4f(0.0, 0.0, 0.0, -1.0);
    }
    return vec4f(max(total.rgb, vec3f(0.0)) / total.a, 1.0);
}

// The blurs of this level and of all coarser ones at a pixel, by the weights of its own scale.
struct Gathered {
    light: vec3f,
    weight: vec3f,
    // The mean of this level's blurs; or what the pixel has, where none is asked for.
    own: vec3f,
}

fn gathered(pixel: vec2i, e: vec3f, shape: Shape) -> Gathered {
    let plane = plane_of(pixel, shape);
    scale = scale_of(plane.m, shape.id);
    center.pixel = pixel;
    center.id = shape.id;
    center.plane = plane;
    let r = vec3f(plane.ray, 1.0);
    let along = mat2x2f(vec2f(dot(plane.dx, r), plane.dx.z), vec2f(dot(plane.dy, r), plane.dy.z));
    center.to_ray_u = along * vec2f(scale.u);
    center.to_ray_v = along * vec2f(scale.v);
    center.ray2 = dot(r, r);
    center.last = vec2i(textureDimensions(here_light)) - 1;
    var wanted = vec3f(0.0);
    var colors = mat4x3f();
    for (var j = 0u; j < 4u; j++) {
        if j < BLURS || SQUARE && j == 3u {
            let blur = level.blurs[j];
            let k = exponents(blur, plane, scale);
            center.kii[j] = k.x;
            center.kij[j] = k.y;
            center.kjj[j] = k.z;
            let told = 1.0 - blur.own / blur.variance;
            center.untold[j] = 1.0 / (told * told) - 1.0;
            // Weights of single pixels are wider than what they spread by.
            center.half[j] = 0.5 / (max(blur.variance, NARROWEST_WEIGHTS) * scale.mm2);
            colors[j] = weight_at(scale, blur.slot);
            wanted += colors[j];
        }
    }
    center.has_square = SQUARE && any(colors[3] > vec3f(0.0));
    let masses = mass_of_taps();
    center.colors = mat4x3f(
        colors[0] / masses.x,
        colors[1] / masses.y,
        colors[2] / masses.z,
        colors[3] / masses.w,
    );
    var light_here = vec3f(0.0);
    if any(wanted > vec3f(0.0)) {
        gather();
        light_here = wanted * light / max(mass, vec3f(1e-20));
    }
    let own = select(e, light_here / max(wanted, vec3f(1e-6)), wanted > vec3f(1e-3));
    let rest = weight_at(scale, level.rest);
    if level.coarser == 0u || all(rest <= vec3f(0.0)) {
        return Gathered(light_here, wanted, own);
    }
    // On no surface of the coarser level this level's own light stands in for it.
    let coarser = coarser_at(pixel);
    return Gathered(light_here + rest * select(own, coarser.rgb, coarser.a >= 0.0), wanted + rest, own);
}

// The mean of this level and the coarser ones, so that finer pixels can weigh it by scales of their own.
@fragment
fn fs_level(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let shape = unpacked(textureLoad(here_shape, pixel, 0).rg);
    if shape.id == 0u {
        return vec4f(0.0);
    }
    let g = gathered(pixel, textureLoad(here_light, pixel, 0).rgb, shape);
    let mean = select(g.own, g.light / max(g.weight, vec3f(1e-6)), g.weight > vec3f(1e-3));
    return half_floats(vec4f(mean, 1.0));
}

// Writes no alpha: it is the host's.
@fragment
fn fs_frame(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let shape = unpacked(textureLoad(here_shape, pixel, 0).rg);
    if shape.id == 0u {
        discard;
    }
    let e = textureLoad(here_light, pixel, 0).rgb;
    let g = gathered(pixel, e, shape);
    return vec4f(e * (1.0 - g.weight) + g.light, 1.0);
}
