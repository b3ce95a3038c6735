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

// Two Gaussians that are summed together.
struct Step {
    // In square pixels of the level; 0 where there is only one.
    variances: vec2f,
    level: u32,
    // Where the first's weights are in a row; the second's follow.
    slot: u32,
}

const STEPS = 12u;
// Furthest taps, in pixels of a level: at 75° a Gaussian is cut off.
const REACH = 6.0;

// A Gaussian of no more weight is not summed: its part goes to the narrower one beside it, or stays.
const LEAST_WEIGHT = 0.004;

// Weights are max(1 − r²/8v, 0)², whose variance is v: near to a Gaussian, and 0 beyond √8 σ.
const CUT = 8.0;

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
        if step.level > coarsest || step.variances.x == 0.0 {
            break;
        }
        var w0 = weight_at(scale, step.slot);
        var w1 = vec3f(0.0);
        if step.variances.y > 0.0 {
            w1 = weight_at(scale, step.slot + 1u);
        }
        let has_second = any(w1 > vec3f(LEAST_WEIGHT));
        if !has_second {
            w0 += w1;
        }
        if !has_second && all(w0 <= vec3f(LEAST_WEIGHT)) {
            g.light += w0 * e;
            g.weight += w0;
            continue;
        }
        let side = f32(1u << step.level);
        let own = 0.25 * (1.0 - 1.0 / (side * side));
        let m = plane.m * (side * side);
        let v = step.variances * (scale.mm2 * side * side);
        let in_space = 1.0 / (CUT * max(v, vec2f(NARROWEST_IN_SPACE * scale.mm2)));
        let k0 = on_plane(v.x, in_space.x, m, own);
        let k1 = on_plane(select(v.x, v.y, has_second), in_space.y, m, own);
        // The ball of the wider one, as it is seen.
        let mm = facing * side;
        let reach2 = CUT * max(select(v.x, v.y, has_second) / (mm * mm) - own, vec2f(0.15));
        let reach = min(sqrt(reach2), vec2f(REACH));
        let center = at / side - 0.5;
        let first = max(vec2i(ceil(center - reach)), vec2i(0));
        let last = min(vec2i(floor(center + reach)), vec2i(textureDimensions(shapes, step.level)) - 1);
        // p.xy = u·z + v along a row: where it begins, and for a step of a pixel.
        let step_x = view.step.xz * side;
        let first_x = view.origin.xz + 0.5 * step_x - vec2f(0.0, p.x);
        let first_y = view.origin.yw + 0.5 * view.step.yw * side - vec2f(0.0, p.y);
        var sum0 = vec4f(0.0);
        var sum1 = vec4f(0.0);
        for (var y = first.y; y <= last.y; y++) {
            let dy = f32(y) - center.y;
            let half = reach.x * sqrt(saturate(1.0 - dy * dy / (reach.y * reach.y)));
            let to = min(i32(floor(center.x + half)), last.x);
            let row_y = first_y + view.step.yw * (side * f32(y));
            // 1 − k₀₀ dx² − k₀₁ dx dy − k₁₁ dy² of each of the two.
            let k00 = vec2f(k0.x, k1.x);
            let k01 = vec2f(k0.y, k1.y) * dy;
            let rest = 1.0 - vec2f(k0.z, k1.z) * (dy * dy);
            for (var x = max(i32(ceil(center.x - half)), 0); x <= to; x++) {
                let there = textureLoad(shapes, vec2i(x, y), step.level).rg;
                let light = textureLoad(lights, vec2i(x, y), step.level);
                let z = bitcast<f32>(there.y);
                let row_x = first_x + step_x * f32(x);
                let off = vec3f(row_x.x * z + row_x.y, row_y.x * z + row_y.y, z - p.z);
                let dx = f32(x) - center.x;
                let near = saturate(rest - dx * (k00 * dx + k01) - dot(off, off) * in_space);
                let weight = select(vec2f(0.0), near * near, there.x >> 24u == shape.id);
                sum0 += weight.x * light;
                sum1 += weight.y * light;
            }
        }
        g.light += w0 * select(e, sum0.rgb / sum0.a, sum0.a > 1e-6);
        g.weight += w0;
        if has_second {
            g.light += w1 * select(e, sum1.rgb / sum1.a, sum1.a > 1e-6);
            g.weight += w1;
        }
    }
    // Levels that a small frame lacks: what the last one holds stands for them.
    let beyond = weight_at(scale, level.rest + view.levels);
    if any(beyond > vec3f(0.0)) {
        let last = min(pixel >> vec2u(view.levels), vec2i(textureDimensions(lights, view.levels)) - 1);
        let there = textureLoad(lights, last, view.levels);
        g.light += beyond * select(e, there.rgb / there.a, there.a > 1e-6);
        g.weight += beyond;
    }
    return g;
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
