// The blurs of a level above the frame where anything may be around: edges, layers, bends. Follows blur.wgsl.
//
// Weighing is by the plane through the pixel where its neighbours lie on that plane, and by their
// distance in space where they do not.

// Variance of the weights of a blur that hardly reaches the next pixel, in square pixels.
const NARROWEST_WEIGHTS = 0.25;

// What a pixel gathers from.
struct Center {
    pixel: vec2i,
    id: u32,
    plane: Plane,
    lattice: Lattice,
    // p·(ray, 1) grows by so much along u and v, p.z too; and (ray, 1)².
    to_ray_u: vec2f,
    to_ray_v: vec2f,
    ray2: f32,
    last: vec2i,
    taps: Taps,
    // Of the blurs that share their taps and of the square, log₂ e/2v in mm.
    half: vec2f,
}

var<private> center: Center;
// Light by what it weighs, and what it weighs.
var<private> light: vec3f;
var<private> mass: vec3f;
// Of the square beyond 3×3, over what its middle weighs.
var<private> outer: vec4f;

// A pixel that a blur may reach.
struct Neighbour {
    e: vec4f,
    // What its distance off the plane takes of the weight of the blurs that share their taps and of the square, as powers of 2: all
    // where it is not of the same profile.
    off: vec2f,
}

fn neighbour(i: i32, j: i32) -> Neighbour {
    let q = center.pixel + i * center.lattice.u + j * center.lattice.v;
    let there = textureLoad(here_shape, q, 0).rg;
    let e = textureLoad(here_light, q, 0);
    // Below 0 is far beyond the last.
    let is_same = all(vec2u(q) <= vec2u(center.last)) && there.x >> 24u == center.id;
    // Off the plane along the ray.
    let on_ray = f32(i) * center.to_ray_u + f32(j) * center.to_ray_v;
    let off = bitcast<f32>(there.y) - center.plane.z - on_ray.y;
    let bend = off * (2.0 * on_ray.x + off * center.ray2);
    return Neighbour(e, select(vec2f(-1e9), -bend * center.half, is_same));
}

// No weight grows beyond the middle's.
fn tap(i: i32, j: i32, k: vec3f, s: f32) {
    let there = neighbour(i, j);
    var weight = min(exp2(min(there.off.x, LARGEST)) * k, center.taps.k00);
    if SQUARE {
        weight += exp2(min(s + there.off.y, 0.0)) * center.taps.square;
    }
    light += weight * there.e.rgb;
    mass += weight * there.e.a;
}

// Less than a float's largest power of 2.
const LARGEST = 30.0;

fn pair(i: i32, j: i32, k: vec3f, s: f32) {
    tap(i, j, k, s);
    tap(-i, -j, k, s);
}

fn square_tap(i: i32, j: i32, s: f32) {
    let there = neighbour(i, j);
    outer += exp2(min(s + there.off.y, 0.0)) * there.e;
}

fn square_pair(i: i32, j: i32, s: f32) {
    square_tap(i, j, s);
    square_tap(-i, -j, s);
}

// Sums the light around the center.
fn gather() {
    let taps = center.taps;
    let here = textureLoad(here_light, center.pixel, 0);
    light = (taps.k00 + taps.square) * here.rgb;
    mass = (taps.k00 + taps.square) * here.a;
    pair(1, 0, taps.k10, taps.s1.x);
    pair(0, 1, taps.k01, taps.s1.y);
    pair(1, 1, taps.k11, taps.s1.z);
    pair(1, -1, taps.k1m, taps.s1.w);
    if THIRTEEN {
        pair(2, 0, taps.k20, taps.s2.x);
        pair(0, 2, taps.k02, taps.s2.y);
    }
    if SQUARE {
        if any(taps.square > vec3f(0.0)) {
            outer = vec4f(0.0);
            square_pair(2, 1, taps.s2.z);
            square_pair(2, -1, taps.s2.w);
            square_pair(1, 2, taps.s3.x);
            square_pair(-1, 2, taps.s3.y);
            square_pair(2, 2, taps.s3.z);
            square_pair(2, -2, taps.s3.w);
            light += taps.square * outer.rgb;
            mass += taps.square * outer.a;
        }
    }
}

// The mean of the coarser levels at a pixel of this one, of its own surface only; a < 0 where there is
// none of it.
fn coarser_at(pixel: vec2i) -> vec4f {
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
    // What goes on beyond two pixels may leave what light can be.
    return vec4f(clamp(total.rgb / total.a, vec3f(0.0), vec3f(65504.0)), 1.0);
}

fn gathered(pixel: vec2i, e: vec3f, shape: Shape) -> Gathered {
    let plane = plane_of(pixel, shape);
    let scale = scale_of(plane.m, shape.id);
    center.pixel = pixel;
    center.id = shape.id;
    center.plane = plane;
    center.lattice = scale.lattice;
    let r = vec3f(plane.ray, 1.0);
    let along = mat2x2f(vec2f(dot(plane.dx, r), plane.dx.z), vec2f(dot(plane.dy, r), plane.dy.z));
    center.to_ray_u = along * vec2f(scale.lattice.u);
    center.to_ray_v = along * vec2f(scale.lattice.v);
    center.ray2 = dot(r, r);
    center.last = vec2i(textureDimensions(here_light)) - 1;
    center.taps = taps_of(plane, scale, scale.lattice);
    let wanted = center.taps.wanted;
    // Weights of single pixels are wider than what they spread by.
    let variances = vec2f(center.taps.variance, level.blurs[3].variance);
    center.half = HALF_LOG2_E / (max(variances, vec2f(NARROWEST_WEIGHTS)) * scale.mm2);
    // What the pyramid blurs by itself knows no distance off the plane, which on a bent surface grows as that on it
    // to the fourth: taps make up for it.
    let told = 1.0 - level.blurs[0].own / max(variances, vec2f(1e-3));
    center.half /= told * told;
    var blurred = vec3f(0.0);
    if any(wanted > vec3f(0.0)) {
        gather();
        blurred = blurred_by(light, mass, wanted, e);
    }
    let rest = rest_at(scale);
    var coarser = vec4f(0.0);
    if any(rest > vec3f(0.0)) {
        coarser = coarser_at(pixel);
    }
    return with_coarser(blurred, wanted, e, rest, coarser);
}

@fragment
fn fs_level(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let shape = unpacked(textureLoad(here_shape, pixel, 0).rg);
    if shape.id == 0u {
        return vec4f(0.0);
    }
    let e = light_of(textureLoad(here_light, pixel, 0));
    return mean_of(gathered(pixel, e, shape));
}
