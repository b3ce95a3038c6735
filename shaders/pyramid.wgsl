// Scattering by a plan: every level of a pyramid is blurred by Gaussians a few of its pixels wide,
// and all levels are summed, each pixel by the weights of its own scale.
//
//   L(p) = w₀ E(p) + Σ_l Σ_j w_lj(s) (E ∗ G_lj)(p),  s the pixels per mm at p
//
// Weighing is by the plane through the center where its neighbours lie on that plane, and by their
// distance in space where they do not.
//
// [LS15] Li & Shao 2015, "GPU-based face rendering via the physical model of light interaction
//        with human skin", Eq. 7–12.
// [B81]  P. J. Burt, "Fast filter transforms for image processing", 1981: Gaussian pyramids.

struct View {
    // p.xy = (u + ∂u·at)·z + (v + ∂v·at) for the pixel at `at`: x and y of u and v, then of ∂u and ∂v.
    origin: vec4f,
    step: vec4f,
    // z = (x·depth + y)/(z·depth + w), in mm.
    depth_to_mm: vec4f,
    first_octave: f32,
    rows: u32,
    stride: u32,
    profiles: u32,
}

// One of the blurs of a level.
struct Blur {
    // Variance in square pixels of the level, and how much of it is the pyramid's own blur.
    variance: f32,
    own: f32,
    // The variance that weights need, since they are cut off, over the variance that remains.
    widen: f32,
    // Pixels that its taps reach on a surface that faces the camera.
    reach: f32,
    // Its place in a row of weights, in x.
    slot: vec4u,
}

struct Level {
    blurs: array<Blur, 4>,
    // Of this level, in its pixels.
    size: vec2f,
    // Pixels of the frame to one of this level.
    scale: f32,
    // Where the weights of all coarser levels together are in a row.
    rest: u32,
    // 1 where there is a coarser level.
    coarser: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> level: Level;
@group(0) @binding(2) var<storage, read> tiles: array<u32>;
@group(0) @binding(3) var<storage, read> weights: array<vec4f>;
@group(0) @binding(4) var irradiance: texture_2d<f32>;
@group(0) @binding(5) var depth: texture_2d<f32>;
@group(0) @binding(6) var profile_id: texture_2d<u32>;
// The surface at this level, at the finer one, and at the coarser one; packed.
@group(0) @binding(7) var here_packed: texture_2d<u32>;
@group(0) @binding(8) var finer_packed: texture_2d<u32>;
@group(0) @binding(9) var coarser_packed: texture_2d<u32>;
// The mean of the coarser levels.
@group(0) @binding(10) var coarser_sum: texture_2d<u32>;

// Blurs to a level, and whether their taps are those of |x| + |y| ≤ reach.
override BLURS: u32 = 1;
override DIAMOND: bool = false;

const TILE = 16u;
const ROWS_PER_OCTAVE = 4.0;
// Along a slope's contour: the longest reach in pixels, and the largest variance over that across.
const LONGEST_REACH = 16.0;
const LONGEST_STRETCH = 40.0;
// How far from the plane a pixel may lie to be of the same surface, in mm a pixel of the level.
const TOLERANCE = 1.0;
// A pixel that is hardly of any surface still is of one.
const LEAST_AREA = 1e-3;

// Two triangles to a tile.
@vertex
fn vs_tile(
    @builtin(vertex_index) vertex: u32,
    @builtin(instance_index) instance: u32,
) -> @builtin(position) vec4f {
    let tile = tiles[instance];
    // Corners in the order of 0 0, 1 0, 0 1, 1 0, 1 1, 0 1.
    let corner = vec2u((0x1au >> vertex) & 1u, (0x34u >> vertex) & 1u);
    let uv = vec2f((vec2u(tile & 0xffffu, tile >> 16u) + corner) * TILE) / level.size;
    return vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.0, 1.0);
}

@vertex
fn vs_frame(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    let uv = vec2f(f32((vertex << 1u) & 2u), f32(vertex & 2u));
    return vec4f(uv * 2.0 - 1.0, 0.0, 1.0);
}

struct Surface {
    light: vec3f,
    // Area over that of a surface that faces the camera; less where part of the pixel is not of it.
    area: f32,
    // In mm, negative.
    z: f32,
    // ∂z along a row and along a column, over the mm between pixels: sines of the angles.
    slope: vec2f,
    // 0: no surface.
    id: u32,
}

fn pack(s: Surface) -> vec4u {
    let sines = vec2u(clamp(s.slope * 2047.0 + 2048.5, vec2f(0.0), vec2f(4095.0)));
    return vec4u(
        pack2x16float(s.light.rg),
        pack2x16float(vec2f(s.light.b, s.area)),
        s.id << 24u | sines.y << 12u | sines.x,
        bitcast<u32>(s.z),
    );
}

fn light_of(packed: vec4u) -> vec3f {
    return vec3f(unpack2x16float(packed.x), unpack2x16float(packed.y).x);
}

fn slope_of(packed: vec4u) -> vec2f {
    return (vec2f(vec2u(packed.z, packed.z >> 12u) & vec2u(0xfffu)) - 2048.0) / 2047.0;
}

fn tangent_of(sine: vec2f) -> vec2f {
    return sine / sqrt(max(1.0 - sine * sine, vec2f(4e-4)));
}

fn sine_of(tangent: vec2f) -> vec2f {
    return tangent / sqrt(1.0 + tangent * tangent);
}

// p.xy over z, and the rest, at a pixel of this level.
fn ray(pixel: vec2i) -> vec4f {
    let at = (vec2f(pixel) + 0.5) * level.scale;
    return view.origin + view.step * at.xyxy;
}

// The mm between pixels of this level on a surface that faces the camera.
fn mm_per_px(z: f32) -> vec2f {
    return abs(view.step.xy * z + view.step.zw) * level.scale;
}

// The plane through the surface at a pixel, in steps of a pixel.
struct Plane {
    p: vec3f,
    dx: vec3f,
    dy: vec3f,
    // M = JᵀJ: M₀₀, M₀₁, M₁₁, in mm².
    m: vec3f,
}

fn plane_of(pixel: vec2i, z: f32, tangent: vec2f) -> Plane {
    let r = ray(pixel);
    let mm = (view.step.xy * z + view.step.zw) * level.scale;
    let dz = tangent * abs(mm);
    let dx = vec3f(r.xy * dz.x + vec2f(mm.x, 0.0), dz.x);
    let dy = vec3f(r.xy * dz.y + vec2f(0.0, mm.y), dz.y);
    return Plane(
        vec3f(r.xy * z + r.zw, z),
        dx,
        dy,
        vec3f(dot(dx, dx), dot(dx, dy), dot(dy, dy)),
    );
}

fn largest_eigenvalue(m: vec3f) -> f32 {
    let half = 0.5 * (m.x - m.z);
    return 0.5 * (m.x + m.z) + sqrt(half * half + m.y * m.y);
}

// M with its smaller eigenvalue raised to what taps can reach; the directions stay.
fn no_steeper(m: vec3f, largest: f32) -> vec3f {
    let smaller = m.x + m.z - largest;
    let least = largest / LONGEST_STRETCH;
    if smaller >= least {
        return m;
    }
    let share = (largest - least) / (largest - smaller);
    return mix(vec3f(largest, 0.0, largest), m, share);
}

// --- The frame, packed ---------------------------------------------------------------------------

fn z_at(pixel: vec2i) -> f32 {
    let d = textureLoad(depth, pixel, 0).r;
    let c = view.depth_to_mm;
    return (c.x * d + c.y) / (c.z * d + c.w);
}

// ∂z over the mm of a pixel: the mean of both sides where they agree, the shorter where one jumps.
fn tangent(forward: f32, backward: f32, mm: f32) -> f32 {
    let f = forward * forward + mm * mm;
    let b = backward * backward + mm * mm;
    // A factor of two in length is more than a smooth surface changes in a pixel.
    let mean = max(f, b) <= 4.0 * min(f, b);
    let shorter = select(backward, forward, f < b);
    let dz = select(shorter, 0.5 * (forward + backward), mean);
    // What jumps on both sides faces the camera for all that is known.
    return select(0.0, dz / mm, abs(dz) < 40.0 * mm);
}

@fragment
fn fs_pack(@builtin(position) at: vec4f) -> @location(0) vec4u {
    let pixel = vec2i(at.xy);
    let id = textureLoad(profile_id, pixel, 0).r;
    if id == 0u || id > view.profiles {
        return vec4u(0u);
    }
    let last = vec2i(textureDimensions(depth)) - 1;
    let z = z_at(pixel);
    // Infinitely far away there is no surface.
    if !(abs(z) < 3e38) {
        return vec4u(0u);
    }
    let left = z_at(vec2i(max(pixel.x - 1, 0), pixel.y));
    let right = z_at(vec2i(min(pixel.x + 1, last.x), pixel.y));
    let above = z_at(vec2i(pixel.x, max(pixel.y - 1, 0)));
    let below = z_at(vec2i(pixel.x, min(pixel.y + 1, last.y)));
    let mm = mm_per_px(z);
    // At the border one side alone is known.
    let west = select(z - left, right - z, pixel.x == 0);
    let east = select(right - z, z - left, pixel.x == last.x);
    let north = select(z - above, below - z, pixel.y == 0);
    let south = select(below - z, z - above, pixel.y == last.y);
    let t = vec2f(tangent(east, west, mm.x), tangent(south, north, mm.y));
    let plane = plane_of(pixel, z, t);
    let area = length(cross(plane.dx, plane.dy)) / (mm.x * mm.y);
    // What is packed is half floats, which end there.
    let light = min(textureLoad(irradiance, pixel, 0).rgb, vec3f(65504.0));
    return pack(Surface(light, area, z, sine_of(t), id));
}

// --- Half as many pixels -------------------------------------------------------------------------

// The finer level's pixels around one of this level, by 1 3 3 1 each way, of one surface only: that
// of the nearest of the four pixels that it covers.
@fragment
fn fs_halve(@builtin(position) at: vec4f) -> @location(0) vec4u {
    let pixel = vec2i(at.xy);
    let last = vec2i(textureDimensions(finer_packed)) - 1;
    var reference = vec4u(0u);
    var nearest = -3e38;
    for (var i = 0; i < 4; i++) {
        let q = 2 * pixel + vec2i(i & 1, i >> 1u);
        if all(q <= last) {
            let packed = textureLoad(finer_packed, q, 0);
            let z = bitcast<f32>(packed.w);
            if packed.z >> 24u != 0u && z > nearest {
                reference = packed;
                nearest = z;
            }
        }
    }
    let id = reference.z >> 24u;
    if id == 0u {
        return vec4u(0u);
    }
    let mm = mm_per_px(nearest);
    let slope = tangent_of(slope_of(reference));
    let tolerance = TOLERANCE * max(mm.x, mm.y) * sqrt(1.0 + dot(slope, slope));
    var light = vec3f(0.0);
    var area = 0.0;
    var z = 0.0;
    var sum_slope = vec2f(0.0);
    for (var y = -1; y <= 2; y++) {
        for (var x = -1; x <= 2; x++) {
            let q = 2 * pixel + vec2i(x, y);
            if any(q < vec2i(0)) || any(q > last) {
                continue;
            }
            let packed = textureLoad(finer_packed, q, 0);
            if packed.z >> 24u != id {
                continue;
            }
            let b_area = unpack2x16float(packed.y);
            let there = tangent_of(slope_of(packed));
            // On its own plane, at the middle of this level's pixel.
            let offset = (0.5 - vec2f(f32(x), f32(y))) * 0.5 * mm;
            let z_there = bitcast<f32>(packed.w) + dot(there, offset);
            let outer = vec2f(f32(x == -1 || x == 2), f32(y == -1 || y == 2));
            let share = (3.0 - 2.0 * outer.x) * (3.0 - 2.0 * outer.y) / 64.0;
            let off = (z_there - nearest) / tolerance;
            let w = share * b_area.y * saturate(2.0 - 2.0 * abs(off));
            light += w * vec3f(unpack2x16float(packed.x), b_area.x);
            area += w;
            z += w * z_there;
            sum_slope += w * there;
        }
    }
    if area <= 0.0 {
        return vec4u(0u);
    }
    return pack(Surface(light / area, max(area, LEAST_AREA), z / area, sine_of(sum_slope / area), id));
}

// --- The blurs of a level, and all coarser ones ----------------------------------------------------

struct Scale {
    row: u32,
    next: f32,
}

// Where the weights of this scale are.
fn scale_of(m: vec3f, id: u32) -> Scale {
    let octave = -0.5 * log2(largest_eigenvalue(m)) + log2(level.scale);
    let row = clamp((octave - view.first_octave) * ROWS_PER_OCTAVE, 0.0, f32(view.rows - 1u));
    let i = min(u32(row), view.rows - 2u);
    return Scale(((id - 1u) * view.rows + i) * view.stride, row - f32(i));
}

fn weight_at(scale: Scale, slot: u32) -> vec3f {
    let i = scale.row + slot;
    return mix(weights[i].rgb, weights[i + view.stride].rgb, scale.next);
}

// The mean of the coarser levels at a pixel of this one, between their four pixels around it, of its
// own surface only; a < 0 where none of them is.
fn coarser_at(pixel: vec2i, plane: Plane, id: u32) -> vec4f {
    let last = vec2i(textureDimensions(coarser_sum)) - 1;
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
        let packed = textureLoad(coarser_packed, q, 0);
        // Steps of this level from the pixel to the middle of the coarser one.
        let offset = 2.0 * vec2f(q - near) + 0.5 - vec2f(odd);
        let dz = bitcast<f32>(packed.w) - plane.p.z - plane.dx.z * offset.x - plane.dy.z * offset.y;
        let shares = select(1.0 - share_far, share_far, far == vec2i(1));
        let share = shares.x * shares.y;
        let w = share * saturate(2.0 - 2.0 * abs(dz) / tolerance) * f32(packed.z >> 24u == id);
        let sum = textureLoad(coarser_sum, q, 0).rg;
        total += w * vec4f(unpack2x16float(sum.x), unpack2x16float(sum.y).x, 1.0);
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

fn gathered(pixel: vec2i, packed: vec4u) -> Gathered {
    let id = packed.z >> 24u;
    let z = bitcast<f32>(packed.w);
    let plane = plane_of(pixel, z, tangent_of(slope_of(packed)));
    let scale = scale_of(plane.m, id);
    let largest = largest_eigenvalue(plane.m);
    let m = no_steeper(plane.m, largest);
    let det = m.x * m.z - m.y * m.y;
    // Of each blur: half of the inverse covariance in pixels, 1/2v in mm, and the weight.
    var inverse: array<vec3f, 4>;
    var half: array<f32, 4>;
    var w: array<vec3f, 4>;
    var wanted = vec3f(0.0);
    var reach = vec2f(0.0);
    var stretched = false;
    for (var j = 0u; j < BLURS; j++) {
        let blur = level.blurs[j];
        w[j] = weight_at(scale, blur.slot.x);
        wanted += w[j];
        let v = blur.variance * largest;
        // v M⁻¹ less the pyramid's own.
        let along = v / det * m.zx - blur.own;
        let further = ceil(2.4 * (sqrt(along) - sqrt(blur.variance - blur.own)) - 0.1);
        // Taps of a slope reach further, and are hardly cut off.
        let is_stretched = any(further > vec2f(0.0));
        let widen = select(blur.widen, 1.0, is_stretched);
        let covariance = widen * vec3f(along.x, -v / det * m.y, along.y);
        let d = covariance.x * covariance.z - covariance.y * covariance.y;
        inverse[j] = vec3f(covariance.z, -covariance.y, covariance.x) * (0.5 / d);
        half[j] = 0.5 / v;
        let taps = min(blur.reach + max(further, vec2f(0.0)), vec2f(LONGEST_REACH));
        let used = any(w[j] > vec3f(0.0));
        reach = max(reach, select(vec2f(0.0), taps, used));
        stretched |= used && is_stretched;
    }
    var light = vec3f(0.0);
    if reach.x > 0.0 {
        let taps = vec2i(reach);
        // Stretched taps fill their box.
        let corner = select(0, 1, DIAMOND && !stretched);
        let last = vec2i(textureDimensions(here_packed)) - 1;
        let first_row = max(pixel.y - taps.y, 0);
        let last_row = min(pixel.y + taps.y, last.y);
        var sums: array<vec4f, 4>;
        // Along a ray all of p grows by (r, 1) for one of z.
        let r = vec3f(ray(pixel).xy, 1.0);
        let to_ray = vec4f(dot(plane.dx, r), dot(plane.dy, r), plane.dx.z, plane.dy.z);
        let ray2 = dot(r, r);
        for (var y = first_row; y <= last_row; y++) {
            let across = taps.x - corner * abs(y - pixel.y);
            let first = max(pixel.x - across, 0);
            let end = min(pixel.x + across, last.x);
            for (var x = first; x <= end; x++) {
                let there = textureLoad(here_packed, vec2i(x, y), 0);
                let b_area = unpack2x16float(there.y);
                let area = select(0.0, b_area.y, there.z >> 24u == id);
                let e = vec3f(unpack2x16float(there.x), b_area.x);
                let d = vec2f(f32(x - pixel.x), f32(y - pixel.y));
                let squares = vec3f(d.x * d.x, 2.0 * d.x * d.y, d.y * d.y);
                // Off the plane along the ray, what the squared distance has more than on it.
                let off = bitcast<f32>(there.w) - plane.p.z - dot(to_ray.zw, d);
                let bend = off * (2.0 * dot(to_ray.xy, d) + off * ray2);
                for (var j = 0u; j < BLURS; j++) {
                    // Each to its own reach, to which it was widened.
                    let inside = corner == 0 || abs(d.x) + abs(d.y) <= level.blurs[j].reach;
                    let k = exp(min(-dot(inverse[j], squares) - bend * half[j], 0.0));
                    sums[j] += select(0.0, k * area, inside) * vec4f(e, 1.0);
                }
            }
        }
        for (var j = 0u; j < BLURS; j++) {
            light += w[j] * sums[j].rgb / max(sums[j].a, 1e-20);
        }
    }
    let own = select(light_of(packed), light / max(wanted, vec3f(1e-6)), wanted > vec3f(1e-3));
    if level.coarser == 0u {
        return Gathered(light, wanted, own);
    }
    // On no surface of the coarser level this level's own light stands in for it.
    let coarser = coarser_at(pixel, plane, id);
    let rest = weight_at(scale, level.rest);
    return Gathered(light + rest * select(own, coarser.rgb, coarser.a >= 0.0), wanted + rest, own);
}

// The mean of this level and the coarser ones, so that finer pixels can weigh it by scales of their own.
@fragment
fn fs_level(@builtin(position) at: vec4f) -> @location(0) vec2u {
    let pixel = vec2i(at.xy);
    let packed = textureLoad(here_packed, pixel, 0);
    if packed.z >> 24u == 0u {
        return vec2u(0u);
    }
    let g = gathered(pixel, packed);
    let mean = select(g.own, g.light / max(g.weight, vec3f(1e-6)), g.weight > vec3f(1e-3));
    return vec2u(pack2x16float(mean.rg), pack2x16float(vec2f(mean.b, 0.0)));
}

@fragment
fn fs_frame(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let packed = textureLoad(here_packed, pixel, 0);
    if packed.z >> 24u == 0u {
        discard;
    }
    let before = textureLoad(irradiance, pixel, 0);
    let g = gathered(pixel, packed);
    return vec4f(before.rgb * (1.0 - g.weight) + g.light, before.a);
}

// What the frame was, for all that does not scatter.
@fragment
fn fs_copy(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return textureLoad(irradiance, vec2i(at.xy), 0);
}
