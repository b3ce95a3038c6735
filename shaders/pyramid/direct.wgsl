// Where anything may be around: edges, layers, creases, slopes under sharp light. Each Gaussian is summed over
// the level that is as fine as it asks for, by distance in space, around the pixel's own place:
//
//   L(p) = w₀ E(p) + Σ_j w_j Σ_q k_j(q) A(q) E(q) / Σ_q k_j(q) A(q)
//
// On the frame nothing is interpolated, and no coarser pixel stands for this one; a level adds the mean of those
// that are coarser. Follows blur.wgsl.
//
// [LS15] Li & Shao 2015, Eq. 7 and 12.

@group(0) @binding(13) var<uniform> steps: array<Step, STEPS>;
@group(0) @binding(14) var lights: texture_2d<f32>;
@group(0) @binding(15) var shapes: texture_2d<u32>;
// The same of the layer behind.
@group(0) @binding(16) var back_lights: texture_2d<f32>;
@group(0) @binding(17) var back_shapes: texture_2d<u32>;

// As in pack_back.wgsl; looked at where there is a layer behind.
@group(0) @binding(18) var<storage, read> back_tiles: array<u32>;

// Whether it is over the tiles that have a layer behind within reach; else over those that have none.
override BACK: bool = false;

// Gaussians of a level that are summed as one.
struct Step {
    // In square pixels of the level; 0 where there are fewer than three.
    variances: vec3f,
    level: u32,
    // Where the first's weights are in a row; the others' follow.
    slot: u32,
}

const STEPS = 12u;
// Furthest taps, in pixels of a level: at 75° a Gaussian is cut off.
const REACH = 6.0;

// Gaussians of no more weight together are not summed: their part stays.
const LEAST_WEIGHT = 0.004;

// Weights are max(1 − r²/8v, 0)², whose variance is v: near to a Gaussian, and 0 beyond √8 σ.
const CUT = 8.0;
// Taps go this part of the way, which are two thirds of them and have 95 % of the weight. What makes up for the
// rest on levels, whose Gaussians are many pixels wide, was found on heads. Pixels that are not square have all.
const TAPS = 0.8;
const WIDER = 1.02;
// Where weights fall no faster than this, by k₀₀ + k₁₁ on the frame and on levels, every other pixel is left out, as
// on a chessboard whose fields hold the nearest one. Of a whole Gaussian of a square pixel that changes the sum by
// 2e-4, and levels have no detail of a pixel. One that ends with a step weighs more on one of the fields: so taps go
// farther there, and the Gaussians of two layers, whose step is larger, take all pixels.
const SLOW = vec2f(0.25, 0.35);
const SPARSE_TAPS = 0.9;

// Across a gap t weights that end fade otherwise than e^(−t²/2v). Where a layer is near, both take Gaussians that
// are cut off there, exp(−3.59 r²/8v) of variance v; what e^(−t²/2v) fades more by is `Row::across`.
const CUT_GAUSSIAN = 3.59;
// A Gaussian does not cross a gap of more than this many of its σ.
const CROSSING_SIGMAS = 3.5;

// The least variance, in square pixels, by which distance off the plane is judged: a single pixel spans more than
// narrower weights spread.
const NARROWEST_IN_SPACE = 0.25;

// The variance to ask for, in square pixels, so that weights of single pixels have `v`; of narrow ones few weigh
// anything.
fn widened_on_lattice(v: f32) -> f32 {
    return max(v, 0.13 + 0.37 * v);
}

// What weights of a variance lose on the plane: of x², xy and y² in pixels of the level. What the level was blurred
// by on the way there is subtracted.
fn on_plane(variance_mm2: f32, m: vec3f, own: f32) -> vec3f {
    let det = m.x * m.z - m.y * m.y;
    var c = variance_mm2 / max(det, 1e-30) * vec3f(m.z, -m.y, m.x) - own * vec3f(1.0, 0.0, 1.0);
    c = vec3f(max(c.x, 0.02), c.y, max(c.z, 0.02));
    if own == 0.0 {
        let wider = vec2f(widened_on_lattice(c.x), widened_on_lattice(c.z));
        c = vec3f(wider.x, c.y * sqrt(wider.x / c.x * (wider.y / c.z)), wider.y);
    }
    let most = 0.98 * sqrt(c.x * c.z);
    c.y = clamp(c.y, -most, most);
    return vec3f(c.z, -2.0 * c.y, c.x) / (CUT * (c.x * c.z - c.y * c.y));
}

// A row of pixels of a level, and what they weigh.
struct Row {
    id: u32,
    level: u32,
    // 1 − k₀₀ dx² − k₀₁ dx dy − k₁₁ dy², without dx.
    rest: f32,
    k01: f32,
    k00: f32,
    // z of the plane in the column of the pixel itself, and its step with each pixel.
    z: f32,
    to_z: f32,
    // 2p·(ray, 1) there and its step, and (ray, 1)², over the square of the distance where weights end.
    on_ray: f32,
    to_ray: f32,
    ray2: f32,
    // Whether both layers take Gaussians: not where one of this profile lies too far behind. What is left of a
    // weight across the gap: 0 where none of this profile is behind the nearest pixel.
    is_thin: bool,
    across: f32,
}

var<private> row: Row;
var<private> sum: vec4f;

// What is left of 1 at a pixel: nothing where its weight ends. Off the plane by δ along the ray, the distance in
// space is p² + δ (2p·(ray, 1) + δ (ray, 1)²).
fn left_at(dx: f32, z: f32) -> f32 {
    let off = z - (row.z + row.to_z * dx);
    let on_plane = row.rest - dx * (row.k00 * dx + row.k01);
    return on_plane - off * (row.on_ray + row.to_ray * dx + off * row.ray2);
}

// The same, as a Gaussian.
fn gaussian(left: f32) -> f32 {
    return exp(CUT_GAUSSIAN * (min(left, 1.0) - 1.0));
}

fn tap(pixel: vec2i, dx: f32, is_inside: bool) {
    let there = textureLoad(shapes, pixel, row.level).rg;
    let light = textureLoad(lights, pixel, row.level);
    let left = left_at(dx, bitcast<f32>(there.y));
    var weight = saturate(left) * saturate(left);
    if BACK {
        if row.is_thin {
            weight = select(0.0, gaussian(left), left > 0.0);
            let behind = textureLoad(back_shapes, pixel, row.level).rg;
            let across = row.across * gaussian(left_at(dx, bitcast<f32>(behind.y)));
            let is_same = is_inside && behind.x >> 24u == row.id;
            sum += select(0.0, across, is_same) * textureLoad(back_lights, pixel, row.level);
        }
    }
    sum += select(0.0, weight, is_inside && is_of(there, row.id)) * light;
}

// The Gaussians of a step as one.
struct Together {
    weight: vec3f,
    // Which part of the weight is blurred, and its variance in square pixels of the level.
    passed: vec3f,
    variance: f32,
}

// As wide as the widest color asks for; of a narrower one part of the light stays, so that its variance is right,
// too.
fn together(step: Step, scale: Scale) -> Together {
    var weight = vec3f(0.0);
    var moment = vec3f(0.0);
    for (var j = 0u; j < 3u; j++) {
        if step.variances[j] > 0.0 {
            let w = weight_at(scale, step.slot + j);
            weight += w;
            moment += step.variances[j] * w;
        }
    }
    let means = moment / max(weight, vec3f(1e-6));
    let variance = max(max(means.r, means.g), means.b);
    let passed = select(weight * (means / variance), vec3f(0.0), weight <= vec3f(LEAST_WEIGHT));
    return Together(weight, passed, variance);
}

// Light around a pixel of a surface, and its area: by a Gaussian over a level whose pixels are as the plane has
// them, of whose variance the level has `own` px² already. Weights end where the distance off the plane is
// 1/√`in_space`.
fn summed(l: u32, center: vec2f, shape: Shape, plane: Plane, variance_mm2: f32, in_space: f32, own: f32) -> vec4f {
    let has_all = has_odd_pixels();
    let k = on_plane(variance_mm2 * select(WIDER, 1.0, has_all || l == 0u), plane.m, own);
    let slow = select(SLOW.y, SLOW.x, l == 0u);
    let is_sparse = !BACK && !has_all && k.x + k.z < slow;
    // The ball, as it is seen.
    let mm = vec2f(plane.dx.x - plane.ray.x * plane.dx.z, plane.dy.y - plane.ray.y * plane.dy.z);
    let end = sqrt(CUT * max(variance_mm2 / (mm * mm) - own, vec2f(0.15)));
    let part = select(select(TAPS, SPARSE_TAPS, is_sparse), 1.0, has_all);
    let reach = min(part * end, vec2f(REACH));
    let first = max(ceil(center - reach), vec2f(0.0));
    let last = min(floor(center + reach), vec2f(textureDimensions(shapes, l)) - 1.0);
    let r = vec3f(plane.ray, 1.0);
    let to_ray = 2.0 * in_space * vec2f(dot(plane.dx, r), dot(plane.dy, r));
    row.id = shape.id;
    row.level = l;
    row.k00 = k.x;
    row.to_z = plane.dx.z;
    row.to_ray = to_ray.x;
    row.ray2 = in_space * dot(r, r);
    if BACK {
        let nearest = vec2i(clamp(round(center), first, last));
        let behind = textureLoad(back_shapes, nearest, l).rg;
        let gap = shape.z - bitcast<f32>(behind.y);
        let is_far = gap * gap > CROSSING_SIGMAS * CROSSING_SIGMAS * variance_mm2;
        // Along the camera's axis: along the normal heads lit from behind come out worse.
        row.is_thin = behind.x >> 24u != shape.id || !is_far;
        // As far as the layers are apart along the normal.
        let apart2 = gap * gap / (1.0 + dot(shape.tangent, shape.tangent));
        let across = exp((CUT_GAUSSIAN - 0.5 * CUT) * apart2 * in_space);
        row.across = select(0.0, across, behind.x >> 24u == shape.id);
    }
    sum = vec4f(0.0);
    let step = select(1, 2, is_sparse);
    let apart = f32(step);
    // Of x + y of the pixels that are taken.
    let parity = i32(round(center.x)) + i32(round(center.y));
    let per_reach2 = 1.0 / (reach.y * reach.y);
    for (var y = first.y; y <= last.y; y += 1.0) {
        let dy = y - center.y;
        let half = reach.x * sqrt(saturate(1.0 - dy * dy * per_reach2));
        let x = max(ceil(center.x - half), 0.0);
        let to = min(half, last.x - center.x);
        // 1 − k₀₀ dx² − k₀₁ dx dy − k₁₁ dy².
        row.k01 = k.y * dy;
        row.rest = 1.0 - k.z * (dy * dy);
        row.z = shape.z + plane.dy.z * dy;
        row.on_ray = to_ray.y * dy;
        var pixel = vec2i(vec2f(x, y));
        pixel.x += (pixel.x + pixel.y + parity) & (step - 1);
        for (var dx = f32(pixel.x) - center.x; dx <= to; dx += 2.0 * apart) {
            tap(pixel, dx, true);
            tap(pixel + vec2i(step, 0), dx + apart, dx + apart <= to);
            pixel.x += 2 * step;
        }
    }
    return sum;
}

// What Gaussians weigh together that found light around the pixel.
var<private> found: vec3f;

// All Gaussians at a pixel of the frame whose surface is of this shape.
fn gathered(pixel: vec2i, e: vec3f, shape: Shape) -> Gathered {
    let plane = plane_of(pixel, shape);
    let scale = scale_of(plane.m, shape.id);
    let at = vec2f(pixel) + 0.5;
    let coarsest = u32(weights[scale.row + view.stride].w);
    var g = Gathered();
    for (var i = 0u; i < STEPS; i++) {
        let step = steps[i];
        if step.level > coarsest {
            break;
        }
        if step.variances.x == 0.0 {
            continue;
        }
        let t = together(step, scale);
        g.weight += t.weight;
        g.light += (t.weight - t.passed) * e;
        if all(t.passed <= vec3f(0.0)) {
            continue;
        }
        let side = f32(1u << step.level);
        let coarser = scaled(plane, side);
        let center = at / side - 0.5;
        let own = 0.25 * (1.0 - 1.0 / (side * side));
        let variance_mm2 = t.variance * scale.mm2 * side * side;
        let in_space = 1.0 / (CUT * max(variance_mm2, NARROWEST_IN_SPACE * scale.mm2));
        let there = summed(step.level, center, shape, coarser, variance_mm2, in_space, own);
        let is_found = there.a > 1e-6;
        g.light += t.passed * select(e, there.rgb / there.a, is_found);
        found += select(vec3f(0.0), t.passed, is_found);
    }
    // Levels that a small frame lacks: what the last one holds stands for them.
    let beyond = weight_at(scale, level.rest + view.levels);
    if any(beyond > vec3f(0.0)) {
        let last = min(pixel >> vec2u(view.levels), vec2i(textureDimensions(lights, view.levels)) - 1);
        let there = textureLoad(lights, last, view.levels);
        g.light += beyond * select(e, there.rgb / there.a, there.a > 1e-6);
        found += select(vec3f(0.0), beyond, there.a > 1e-6);
        g.weight += beyond;
    }
    return g;
}

@vertex
fn vs_direct(
    @builtin(vertex_index) vertex: u32,
    @builtin(instance_index) instance: u32,
) -> @builtin(position) vec4f {
    let tile = tile_of(instance);
    var has_back = false;
    if view.back_reach > 0.0 {
        let columns = (u32(level.size.x) + TILE - 1u) / TILE;
        has_back = (back_tiles[tile.y * columns + tile.x] & 1u) != 0u;
    }
    // Nothing where it is not its kind.
    return select(vec4f(0.0), on_screen(tile, vertex), has_back == BACK);
}

@fragment
fn fs_frame(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy) - vec2i(view.first_pixel);
    let shape = unpacked(textureLoad(here_shape, pixel, 0).rg);
    let share = share_at(pixel);
    if shape.id == 0u {
        discard;
    }
    let here = textureLoad(here_light, pixel, 0);
    let e = light_of(here);
    var g = gathered(pixel, e, shape);
    if here.a <= 0.0 {
        // Light that is no number: the pixel has none of its own, and takes what was found around it.
        g.light /= max(found, vec3f(1e-3));
    }
    return scattered(pixel, g, e, share);
}

// The mean of the coarser levels at a pixel of this one, of its own surface only; a < 0 where there is
// none of it.
fn coarser_at(pixel: vec2i, plane: Plane, id: u32) -> vec4f {
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
        let w = shares.x * shares.y * near_plane * f32(there.x >> 24u == id);
        total += w * vec4f(textureLoad(coarser_mean, q, 0).rgb, 1.0);
    }
    if total.a < 1e-3 {
        return vec4f(0.0, 0.0, 0.0, -1.0);
    }
    // What goes on beyond two pixels may leave what light can be.
    return vec4f(clamp(total.rgb / total.a, vec3f(0.0), vec3f(65504.0)), 1.0);
}

@fragment
fn fs_level(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let shape = unpacked(textureLoad(here_shape, pixel, 0).rg);
    if shape.id == 0u {
        return vec4f(0.0);
    }
    let e = light_of(textureLoad(here_light, pixel, 0));
    let plane = plane_of(pixel, shape);
    let scale = scale_of(plane.m, shape.id);
    let l = firstTrailingBit(u32(level.scale));
    let t = together(steps[l + 1u], scale);
    var mean = e;
    if any(t.passed > vec3f(0.0)) {
        let variance_mm2 = t.variance * scale.mm2;
        let own = level.blurs[0].own;
        // What the pyramid blurs by itself knows no distance off the plane, which on a bent surface grows as that
        // on it to the fourth: taps make up for it, by a power found on heads.
        let told = 1.0 - own / max(t.variance, 1e-3);
        let in_space = 1.0 / (CUT * max(t.variance, NARROWEST_IN_SPACE) * scale.mm2 * pow(told, 1.5));
        let there = summed(l, vec2f(pixel), shape, plane, variance_mm2, in_space, own);
        let share = t.passed / max(t.weight, vec3f(1e-6));
        mean += share * select(vec3f(0.0), there.rgb / there.a - e, there.a > 1e-6);
    }
    let rest = rest_at(scale);
    var coarser = vec4f(0.0);
    if any(rest > vec3f(0.0)) {
        coarser = coarser_at(pixel, plane, shape.id);
    }
    return mean_of(with_coarser(mean, t.weight, rest, coarser));
}
