// The blurs of a level where anything may be around: edges, layers, bends. Follows blur.wgsl.
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
    blurs: Blurs,
    // Of each blur, 1/2v in mm.
    half: vec4f,
    // Of each blur, how many times more its square is with what the pyramid blurs by itself, less 1.
    untold: vec4f,
}

var<private> center: Center;
// Light by what it weighs, and what it weighs.
var<private> light: vec3f;
var<private> mass: vec3f;

// A pixel that a blur may reach.
struct Neighbour {
    e: vec4f,
    // What the squared distance has more than on the plane.
    bend: f32,
}

// e.a = 0 where there is nothing of the same profile.
fn neighbour(i: i32, j: i32) -> Neighbour {
    let q = center.pixel + i * center.lattice.u + j * center.lattice.v;
    let there = textureLoad(here_shape, q, 0).rg;
    var e = textureLoad(here_light, q, 0);
    let outside = any(q < vec2i(0)) || any(q > center.last);
    e = select(e, vec4f(0.0), outside || there.x >> 24u != center.id);
    // Off the plane along the ray.
    let on_ray = f32(i) * center.to_ray_u + f32(j) * center.to_ray_v;
    let off = bitcast<f32>(there.y) - center.plane.z - on_ray.y;
    return Neighbour(e, off * (2.0 * on_ray.x + off * center.ray2));
}

fn add(there: Neighbour, weight: vec3f) {
    light += weight * there.e.rgb;
    mass += weight * there.e.a;
}

// What is off the plane, as it adds to exponents. What the pyramid blurs by itself knows no distance off
// the plane, which on a bent surface grows as that on it to the fourth: taps make up for it. At a step
// in depth there is nothing to make up for.
fn off_plane(bend: f32) -> vec4f {
    let x = bend * center.half;
    if FINEST {
        return x;
    }
    return x * (1.0 + center.untold / (1.0 + 2.0 * abs(x)));
}

fn tap(i: i32, j: i32, exponents: vec4f) {
    let there = neighbour(i, j);
    // No weight grows beyond the middle's.
    let weights = weights_of(min(-exponents - off_plane(there.bend), vec4f(0.0)));
    add(there, center.blurs.colors * weights);
}

fn pair(i: i32, j: i32) {
    let exponents = exponents_at(center.blurs, i, j);
    tap(i, j, exponents);
    tap(-i, -j, exponents);
}

fn square_tap(i: i32, j: i32, exponent: f32) {
    let there = neighbour(i, j);
    let weight = exp(min(-exponent - off_plane(there.bend).w, 0.0));
    add(there, center.blurs.colors[3] * weight);
}

fn square_pair(i: i32, j: i32) {
    let exponent = exponents_at(center.blurs, i, j).w;
    square_tap(i, j, exponent);
    square_tap(-i, -j, exponent);
}

// Sums the light around the center.
fn gather() {
    light = vec3f(0.0);
    mass = vec3f(0.0);
    tap(0, 0, vec4f(0.0));
    pair(1, 0);
    pair(0, 1);
    pair(1, 1);
    pair(1, -1);
    if THIRTEEN {
        pair(2, 0);
        pair(0, 2);
    }
    if SQUARE {
        if center.blurs.has_square {
            square_pair(2, 1);
            square_pair(2, -1);
            square_pair(1, 2);
            square_pair(-1, 2);
            square_pair(2, 2);
            square_pair(2, -2);
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
    center.blurs = blurs_at(plane, scale, scale.lattice);
    for (var j = 0u; j < 4u; j++) {
        if j < BLURS || (SQUARE && j == 3u) {
            let blur = level.blurs[j];
            let told = 1.0 - blur.own / blur.variance;
            center.untold[j] = 1.0 / (told * told) - 1.0;
            // Weights of single pixels are wider than what they spread by.
            center.half[j] = 0.5 / (max(blur.variance, NARROWEST_WEIGHTS) * scale.mm2);
        }
    }
    let wanted = center.blurs.wanted;
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

@fragment
fn fs_frame(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy) - vec2i(view.first_pixel);
    let shape = unpacked(textureLoad(here_shape, pixel, 0).rg);
    let share = share_at(pixel);
    if shape.id == 0u || share <= 0.0 {
        discard;
    }
    let e = light_of(textureLoad(here_light, pixel, 0));
    return scattered(pixel, gathered(pixel, e, shape), e, share);
}
