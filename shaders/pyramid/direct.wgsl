// The frame where anything may be around: edges, layers, creases, slopes under sharp light. Each Gaussian is
// summed over the level that is as fine as it asks for, by distance in space, around the pixel's own place:
//
//   L(p) = w₀ E(p) + Σ_j w_j Σ_q k_j(q) A(q) E(q) / Σ_q k_j(q) A(q)
//
// Nothing is interpolated, and no coarser pixel stands for this one. Follows blur.wgsl.
//
// [LS15] Li & Shao 2015, Eq. 7 and 12.

@group(0) @binding(13) var<uniform> steps: array<Step, STEPS>;
@group(0) @binding(14) var lights: texture_2d<f32>;
@group(0) @binding(15) var shapes: texture_2d<u32>;
// The same of the layer behind.
@group(0) @binding(16) var back_lights: texture_2d<f32>;
@group(0) @binding(17) var back_shapes: texture_2d<u32>;

// Whether there is a layer behind.
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

// Across a gap t weights that end fade otherwise than e^(−t²/2v). Where a layer is near both have Gaussians that
// are cut off where the others end, exp(−3.59 r²/8v) of variance v; what e^(−t²/2v) fades more by is told apart.
const CUT_GAUSSIAN = 3.59;
// Gaussians whose σ is less than this part of what lies between the layers do not cross it.
const CROSSING_SIGMAS = 3.5;

// Weights of single pixels are wider than what they spread by: in square pixels.
const NARROWEST_IN_SPACE = 0.25;

// What of this variance in square pixels has the variance asked for on a lattice of pixels, where few weigh
// anything.
fn widened_on_lattice(v: f32) -> f32 {
    return max(v, 0.13 + 0.37 * v);
}

// The distances on the plane that weights of a variance have, over those in space: of x², xy and y² in
// pixels of the level. What the level was blurred by on the way there is told off.
fn on_plane(variance_mm2: f32, in_space: f32, m: vec3f, own: f32) -> vec3f {
    let det = m.x * m.z - m.y * m.y;
    var c = variance_mm2 / max(det, 1e-30) * vec3f(m.z, -m.y, m.x) - own * vec3f(1.0, 0.0, 1.0);
    c = vec3f(max(c.x, 0.02), c.y, max(c.z, 0.02));
    if own == 0.0 {
        let wider = vec2f(widened_on_lattice(c.x), widened_on_lattice(c.z));
        c = vec3f(wider.x, c.y * sqrt(wider.x / c.x * (wider.y / c.z)), wider.y);
    }
    let most = 0.98 * sqrt(c.x * c.z);
    c.y = clamp(c.y, -most, most);
    let inverse = vec3f(c.z, -2.0 * c.y, c.x) / (CUT * (c.x * c.z - c.y * c.y));
    return inverse - in_space * vec3f(m.x, 2.0 * m.y, m.z);
}

// What Gaussians weigh together that found light around the pixel.
var<private> found: vec3f;

// All Gaussians at a pixel whose surface is of this shape.
fn gathered(pixel: vec2i, e: vec3f, shape: Shape) -> Gathered {
    let plane = plane_of(pixel, shape);
    let scale = scale_of(plane.m, shape.id);
    let at = vec2f(pixel) + 0.5;
    let here = view.origin + view.step * at.xyxy;
    let p = vec3f(here.xy * shape.z + here.zw, shape.z);
    let facing = view.step.xy * shape.z + view.step.zw;
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
        var weight = vec3f(0.0);
        var moment = vec3f(0.0);
        for (var j = 0u; j < 3u; j++) {
            if step.variances[j] > 0.0 {
                let w = weight_at(scale, step.slot + j);
                weight += w;
                moment += step.variances[j] * w;
            }
        }
        g.weight += weight;
        // As wide as the widest color asks for; of a narrower one part of the light stays, so that its variance
        // is right, too.
        let means = moment / max(weight, vec3f(1e-6));
        let variance = max(max(means.r, means.g), means.b);
        let passed = select(weight * (means / variance), vec3f(0.0), weight <= vec3f(LEAST_WEIGHT));
        g.light += (weight - passed) * e;
        if all(passed <= vec3f(0.0)) {
            continue;
        }
        let side = f32(1u << step.level);
        let own = 0.25 * (1.0 - 1.0 / (side * side));
        let m = plane.m * (side * side);
        let variance_mm2 = variance * scale.mm2 * side * side;
        let in_space = 1.0 / (CUT * max(variance_mm2, NARROWEST_IN_SPACE * scale.mm2));
        let k = on_plane(variance_mm2, in_space, m, own);
        // The ball, as it is seen.
        let mm = facing * side;
        let reach = min(sqrt(CUT * max(variance_mm2 / (mm * mm) - own, vec2f(0.15))), vec2f(REACH));
        let center = at / side - 0.5;
        let first = max(vec2i(ceil(center - reach)), vec2i(0));
        let last = min(vec2i(floor(center + reach)), vec2i(textureDimensions(shapes, step.level)) - 1);
        // p.xy = u·z + v along a row: where it begins, and for a step of a pixel.
        let step_x = view.step.xz * side;
        let first_x = view.origin.xz + 0.5 * step_x - vec2f(0.0, p.x);
        let first_y = view.origin.yw + 0.5 * view.step.yw * side - vec2f(0.0, p.y);
        var is_thin = false;
        var across = 0.0;
        if BACK {
            let behind = textureLoad(back_shapes, clamp(vec2i(round(center)), first, last), step.level).rg;
            let gap = shape.z - bitcast<f32>(behind.y);
            let is_far = gap * gap > CROSSING_SIGMAS * CROSSING_SIGMAS * variance_mm2;
            is_thin = behind.x >> 24u != shape.id || !is_far;
            // As far as the layers are apart along the normal.
            let apart2 = gap * gap / (1.0 + dot(shape.tangent, shape.tangent));
            across = select(0.0, exp((CUT_GAUSSIAN - 0.5 * CUT) * apart2 * in_space), behind.x >> 24u == shape.id);
        }
        var sum = vec4f(0.0);
        for (var y = first.y; y <= last.y; y++) {
            let dy = f32(y) - center.y;
            let half = reach.x * sqrt(saturate(1.0 - dy * dy / (reach.y * reach.y)));
            let to = min(i32(floor(center.x + half)), last.x);
            let row_y = first_y + view.step.yw * (side * f32(y));
            // 1 − k₀₀ dx² − k₀₁ dx dy − k₁₁ dy².
            let k01 = k.y * dy;
            let rest = 1.0 - k.z * (dy * dy);
            for (var x = max(i32(ceil(center.x - half)), 0); x <= to; x++) {
                let there = textureLoad(shapes, vec2i(x, y), step.level).rg;
                let light = textureLoad(lights, vec2i(x, y), step.level);
                let z = bitcast<f32>(there.y);
                let row_x = first_x + step_x * f32(x);
                let off = vec3f(row_x.x * z + row_x.y, row_y.x * z + row_y.y, z - p.z);
                let dx = f32(x) - center.x;
                let near = rest - dx * (k.x * dx + k01) - dot(off, off) * in_space;
                var weight = saturate(near) * saturate(near);
                if BACK {
                    if is_thin {
                        weight = select(0.0, exp(CUT_GAUSSIAN * (min(near, 1.0) - 1.0)), near > 0.0);
                        let behind = textureLoad(back_shapes, vec2i(x, y), step.level).rg;
                        let z = bitcast<f32>(behind.y);
                        let off = vec3f(row_x.x * z + row_x.y, row_y.x * z + row_y.y, z - p.z);
                        let near = rest - dx * (k.x * dx + k01) - dot(off, off) * in_space;
                        let w = across * exp(CUT_GAUSSIAN * (min(near, 1.0) - 1.0));
                        let is_same = behind.x >> 24u == shape.id;
                        sum += select(0.0, w, is_same) * textureLoad(back_lights, vec2i(x, y), step.level);
                    }
                }
                sum += select(0.0, weight, there.x >> 24u == shape.id) * light;
            }
        }
        g.light += passed * select(e, sum.rgb / sum.a, sum.a > 1e-6);
        found += select(vec3f(0.0), passed, sum.a > 1e-6);
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
