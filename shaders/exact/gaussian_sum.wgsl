// The exact sum of Gaussians over a surface that is given by a position per pixel: the pixels of a frame
// (screen space) or the texels of an atlas (texture space).
//
//   L(p) = Σᵢ wᵢ · Σ_q E(q) A(q) exp(−|q−p|²/2vᵢ) / Σ_q A(q) exp(−|q−p|²/2vᵢ)
//
// Passes: fs_source, then for each Gaussian fs_rows and fs_sum, then one of fs_resolve, fs_add and
// fs_difference. With a back layer fs_sum_layers of back_layer.wgsl takes the place of fs_sum.
//
// [LS15]  Li & Shao 2015, "GPU-based face rendering via the physical model of light interaction with
//         human skin", Eq. 7–12. Their Eq. 10 lacks 1/v; the division above makes up for it.
// [EL07]  d'Eon & Luebke 2007, "Advanced techniques for realistic real-time skin rendering".
// [M10]   Mikkelsen 2010, "Skin rendering by pseudo-separable cross bilateral filtering".
// [S1874] Selling 1874, "Ueber die binaeren und ternaeren quadratischen Formen": reduced forms as sums
//         of squares along steps of a lattice.
// docs/method.md tells where this departs from them, and why.

struct Settings {
    // Weights of red, green and blue, and the variance in mm²: Gaussian i of profile id is at
    // MAX_GAUSSIANS·(id − 1) + i.
    gaussians: array<vec4f, 128>,
    // The mm between neighbouring pixels of a surface that faces the camera, at view depth z:
    // |x + y·z| along a row, |z + w·z| along a column. Zero: as far as the surface itself says.
    spacing: vec4f,
    mm_per_unit: f32,
    // Pixels to which the result is carried past the edge of the surface.
    gutter: i32,
    // Ids beyond this have no profile: no surface.
    profiles: u32,
    has_strength: u32,
    has_albedo: u32,
    // Of the irradiance, the strength and the output, where these are larger than the surface.
    first_pixel: vec2u,
}

@group(0) @binding(0) var<uniform> settings: Settings;
// Position in scene units, and profile id (0: no surface).
@group(0) @binding(1) var positions: texture_2d<f32>;
@group(0) @binding(2) var irradiance: texture_2d<f32>;
// E·A and A, the pixel's irradiance times its area in mm², and that area.
@group(0) @binding(3) var source: texture_2d<f32>;
// Σ w·A·E and Σ w·A along a row, unnormalised.
@group(0) @binding(4) var rows: texture_2d<f32>;
// The Gaussians summed so far.
@group(0) @binding(5) var sum: texture_2d<f32>;
// How much a pixel takes of its scattered light.
@group(0) @binding(6) var strength: texture_2d<f32>;
// What multiplies the light that is added to a target.
@group(0) @binding(7) var albedo: texture_2d<f32>;

// Of a profile.
const MAX_GAUSSIANS = 8u;
// Beyond 3.5 σ a Gaussian on a plane holds e^(−3.5²/2) = .2 % of its mass.
const REACH_SIGMAS: f32 = 3.5;
// Up to this variance along each of three steps of the lattice, in steps², a kernel is summed over their
// neighbours: there a row of taps is too coarse to be sheared.
const SMALL = 0.4;
// Variance along a row, in px², from which the nearest pixel stands for a sheared tap.
const WIDE_PX2 = 9.0;
// How far off a pixel a tap may lie to be that pixel.
const NEGLIGIBLE_PX = 1.0 / 512.0;
// How far a row may lie off the tangent plane before it is weighed anew by a Gaussian of full weight: in
// squared mm, as a share of the squared distance, and of the variance.
const OFF_PLANE_OF_DISTANCE2 = 0.03;
const OFF_PLANE_OF_VARIANCE = 0.018;
// The wave, in rad a pixel, that narrow kernels are made to pass as their Gaussian does.
const WAVE = 1.1;
const COS_WAVE = cos(1.1);
const COS_2WAVE = cos(2.2);

// Whether light is a number. By its bits, since compilers may take for granted that it is.
fn is_finite(light: vec3f) -> bool {
    return all((bitcast<vec3u>(light) & vec3u(0x7f800000u)) != vec3u(0x7f800000u));
}

struct Vertex {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) gaussian: u32,
}

// One triangle over the whole target; the instance is the Gaussian.
@vertex
fn vs_main(@builtin(vertex_index) vertex: u32, @builtin(instance_index) gaussian: u32) -> Vertex {
    let uv = vec2f(f32((vertex << 1u) & 2u), f32(vertex & 2u));
    return Vertex(vec4f(uv * 2.0 - 1.0, 0.0, 1.0), gaussian);
}

struct Point {
    mm: vec3f,
    profile: u32,
}

// A pixel's own light, or none where that is no number.
fn own_light(pixel: vec2i) -> vec3f {
    let light = irradiance_at(pixel).rgb;
    return select(vec3f(0.0), light, is_finite(light));
}

fn irradiance_at(pixel: vec2i) -> vec4f {
    return textureLoad(irradiance, vec2i(settings.first_pixel) + pixel, 0);
}

fn size() -> vec2i {
    return vec2i(textureDimensions(positions));
}

fn point(pixel: vec2i) -> Point {
    let texel = textureLoad(positions, pixel, 0);
    let profile = u32(texel.w);
    return Point(texel.xyz * settings.mm_per_unit, select(0u, profile, profile <= settings.profiles));
}

fn point_or_none(pixel: vec2i) -> Point {
    if any(pixel < vec2i(0)) || any(pixel >= size()) {
        return Point(vec3f(0.0), 0u);
    }
    return point(pixel);
}

struct Tangent {
    // ∂p/∂x of the surface for a step of one pixel, in mm; zero where there is no surface beside the pixel.
    mm: vec3f,
    // From 0 to 1, whether the surface goes on to both sides as a plane does.
    even: f32,
}

// The mean of both sides where they agree; else of the shorter one, as it curves towards `here`, since
// the other jumps to another layer.
fn tangent(pixel: vec2i, step: vec2i, here: Point) -> Tangent {
    let next = point_or_none(pixel + step);
    let last = point_or_none(pixel - step);
    let forward = next.mm - here.mm;
    let backward = here.mm - last.mm;
    let has_forward = next.profile == here.profile;
    let has_backward = last.profile == here.profile;
    let f = dot(forward, forward);
    let b = dot(backward, backward);
    // A factor of two in length is more than a smooth surface changes in a pixel.
    if has_forward && has_backward && max(f, b) <= 4.0 * min(f, b) {
        let bend = forward - backward;
        let even = saturate(1.5 - 8.0 * dot(bend, bend) / max(min(f, b), 1e-20));
        return Tangent(0.5 * (forward + backward), even);
    }
    if has_forward && (!has_backward || f < b) {
        return Tangent(one_sided(forward, point_or_none(pixel + 2 * step), next), 0.0);
    }
    if has_backward {
        return Tangent(-one_sided(-backward, point_or_none(pixel - 2 * step), last), 0.0);
    }
    return Tangent(vec3f(0.0), 0.0);
}

// The step at `here` on the circle through it, the next point and the one beyond; the less the sharper they
// turn.
//
// Tangent to the circle through 0, a and b is a/a² − b/b², of which (b²a − a²b)/(b² − 2a²) goes one step
// across the picture. With b = a + c that is a + a²/(b² − 2a²)(a − c), for a line a + (a − c)/2.
fn one_sided(a: vec3f, beyond: Point, next: Point) -> vec3f {
    // What is of another profile may be no number.
    let c = select(vec3f(0.0), beyond.mm - next.mm, beyond.profile == next.profile);
    let a2 = dot(a, a);
    let b2 = dot(a + c, a + c);
    let turn = dot(a, c) * inverseSqrt(max(a2 * dot(c, c), 1e-30));
    // A turn by 45 degrees is a ridge; and no more than the last turn twice again, since where exactly a rim
    // ends is not known.
    let on = saturate(5.0 * (turn - 0.7)) * clamp(a2 / max(b2 - 2.0 * a2, 1e-20), 0.0, 2.0);
    return a + on * (a - c);
}

// The pixel's frame on the surface: M = JᵀJ with J = (∂p/∂x ∂p/∂y).
struct Metric {
    // √det M, in mm².
    area: f32,
    // κ = M₀₁/M₀₀.
    shear: f32,
    m00: f32,
    // The mm between pixels along a row and between sheared rows; on the screen those of a surface that
    // faces the camera, which are the shortest.
    spacing: vec2f,
    // M₀₀, M₀₁ and M₁₁ of the points, as the weights of narrow Gaussians need them: the surface's own; on
    // the screen, the more it bends within a pixel, those of one that faces the camera.
    lattice: vec3f,
}

fn metric(pixel: vec2i, here: Point) -> Metric {
    let mm = settings.spacing.xz + settings.spacing.yw * here.mm.z;
    let facing = abs(mm);
    let is_screen = any(settings.spacing != vec4f(0.0));
    let along = tangent(pixel, vec2i(1, 0), here);
    let down = tangent(pixel, vec2i(0, 1), here);
    let tx = along.mm;
    let ty = down.mm;
    let points = vec3f(dot(tx, tx), dot(tx, ty), dot(ty, ty));
    let xx = points.x;
    let yy = points.z;
    if xx == 0.0 || yy == 0.0 {
        // A strip one pixel wide has no width of its own: it is taken to be as wide as it faces the
        // camera, or as its pixels are long.
        let width = select(vec2f(sqrt(max(xx, yy))), facing, is_screen);
        let steps = max(width, vec2f(sqrt(xx), sqrt(yy)));
        let square = steps * steps;
        return Metric(steps.x * steps.y, 0.0, square.x, steps, vec3f(square.x, 0.0, square.y));
    }
    let area = length(cross(tx, ty));
    let even = select(1.0, along.even * down.even, is_screen);
    let lattice = mix(vec3f(facing.x * facing.x, 0.0, facing.y * facing.y), points, even);
    let spacing = select(vec2f(sqrt(xx), area / sqrt(xx)), facing, is_screen);
    return Metric(area, dot(tx, ty) / xx, xx, spacing, lattice);
}

// The mm between points along a row and between sheared rows.
fn rows_of(lattice: vec3f) -> vec2f {
    let along = sqrt(lattice.x);
    return vec2f(along, sqrt(max(lattice.z - lattice.y * lattice.y / lattice.x, 0.0)));
}

fn gaussian(here: Point, i: u32) -> vec4f {
    return settings.gaussians[MAX_GAUSSIANS * (here.profile - 1u) + i];
}

// The variance whose point weights, on a lattice of this spacing, pass a wave of ω = WAVE as the Gaussian
// does: light that is soft by a pixel comes out right. `lattice_variance` in src/plan/edge_response.rs.
//
// Point weights of a Gaussian under 0.6 px spread less than it does: with w = e^(−1/2s) at the next pixel
// they pass (1 + 2w cos ω + 2w⁴ cos 2ω)/(1 + 2w + 2w⁴) of the wave instead of e^(−ω²s/2). Solved for w.
fn lattice_variance(variance_mm2: f32, spacing: f32) -> f32 {
    let px2 = max(spacing * spacing, 1e-20);
    let s = variance_mm2 / px2;
    if s > 0.4 || s < 1e-6 {
        return variance_mm2;
    }
    let passed = exp(-0.5 * WAVE * WAVE * s);
    var w = 0.5 * (1.0 - passed) / (passed - COS_WAVE);
    for (var step = 0; step < 11; step++) {
        let w4 = w * w * w * w;
        w = 0.5 * (1.0 - passed - 2.0 * (passed - COS_2WAVE) * w4) / (passed - COS_WAVE);
    }
    return -0.5 * px2 / log(w);
}

// Pixels that the Gaussian reaches along a row and over the rows.
fn reach(spacing: vec2f, variance_mm2: f32) -> vec2i {
    let pixels = ceil(REACH_SIGMAS * sqrt(variance_mm2) / max(spacing, vec2f(1e-20)));
    return vec2i(min(pixels, vec2f(size())));
}

// [LS15] Eq. 10, undivided: exp(−d²/2v). A variance of nothing weighs the pixel itself alone.
fn weight(distance2_mm2: f32, variance_mm2: f32) -> f32 {
    return exp(-0.5 * distance2_mm2 / max(variance_mm2, 1e-12));
}

fn distance2(a: vec3f, b: vec3f) -> f32 {
    let d = a - b;
    return dot(d, d);
}

// E·A and A, the terms of [M10]'s weighted mean. NaN and infinity weigh nothing.
@fragment
fn fs_source(vertex: Vertex) -> @location(0) vec4f {
    let pixel = vec2i(vertex.position.xy);
    let here = point(pixel);
    if here.profile == 0u {
        return vec4f(0.0);
    }
    let light = irradiance_at(pixel).rgb;
    if !is_finite(light) {
        return vec4f(0.0);
    }
    let area = metric(pixel, here).area;
    return vec4f(light * area, area);
}

// First pass, [LS15] Eq. 12: along the row, unnormalised, so that the area enters once.
@fragment
fn fs_rows(vertex: Vertex) -> @location(0) vec4f {
    let pixel = vec2i(vertex.position.xy);
    let here = point(pixel);
    if here.profile == 0u {
        return vec4f(0.0);
    }
    let m = metric(pixel, here);
    let v = gaussian(here, vertex.gaussian).w;
    let reach = reach(m.spacing, v);
    return row(pixel, here, reach.x, lattice_variance(v, rows_of(m.lattice).x));
}

// The pixels of a row around q, as `here` weighs them.
fn row(q: vec2i, here: Point, reach: i32, variance_mm2: f32) -> vec4f {
    let first = max(q.x - reach, 0);
    let last = min(q.x + reach, size().x - 1);
    var total = vec4f(0.0);
    for (var x = first; x <= last; x++) {
        let there = point(vec2i(x, q.y));
        if there.profile == here.profile {
            let w = weight(distance2(there.mm, here.mm), variance_mm2);
            total += w * textureLoad(source, vec2i(x, q.y), 0);
        }
    }
    return total;
}

// Three steps of the lattice that add up to nothing, and how much variance lies along each, in steps²:
// together, Σ ρ e eᵀ, they are a covariance.
struct Steps {
    e: array<vec2i, 3>,
    rho: vec3f,
}

// [S1874] of a covariance, xx, xy and yy in px²: by vectors u + v + w = 0 of which no two are at less than a
// right angle as the covariance measures it.
fn along_steps(c: vec3f) -> Steps {
    let covariance = mat2x2f(c.x, c.y, c.y, c.z);
    var u = vec2f(1.0, 0.0);
    var v = vec2f(0.0, 1.0);
    var w = vec2f(-1.0, -1.0);
    // Twelve are enough up to 87 degrees; where they are not, some ρ is less than 0.
    for (var i = 0; i < 12; i++) {
        if dot(u, covariance * v) > 0.0 {
            w = u - v;
            u = -u;
        } else if dot(v, covariance * w) > 0.0 {
            u = v - w;
            v = -v;
        } else if dot(w, covariance * u) > 0.0 {
            v = w - u;
            w = -w;
        } else {
            break;
        }
    }
    let rho = -vec3f(dot(v, covariance * w), dot(w, covariance * u), dot(u, covariance * v));
    return Steps(array(turned(u), turned(v), turned(w)), rho);
}

// By a right angle.
fn turned(v: vec2f) -> vec2i {
    return vec2i(vec2f(-v.y, v.x));
}

// A small kernel on any slope: three taps along each of three steps, which pass WAVE as their variance asks.
// What is a little off the plane weighs as the plane does at that distance; what is far off, nothing.
fn small(pixel: vec2i, here: Point, lattice: vec3f, steps: Steps) -> vec4f {
    // w with 1 − 2w(1 − cos ω) = e^(−ω²ρ/2), as a series since of no variance nothing may be left.
    let x = 0.5 * WAVE * WAVE * steps.rho;
    let w = x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x / 24.0))) / (2.0 - 2.0 * COS_WAVE);
    let exponents = log(max(w / (1.0 - 2.0 * w), vec3f(1e-30)));
    let last = size() - 1;
    var total = vec4f(0.0);
    for (var i = 0; i < 27; i++) {
        let n = vec3i(i % 3, (i / 3) % 3, i / 9) - 1;
        let exponent = dot(vec3f(abs(n)), exponents);
        // e⁻⁶⁰ is nothing: of no variance the pixel alone is left, and where a step has none, nine taps.
        if exponent < -60.0 {
            continue;
        }
        let offset = n.x * steps.e[0] + n.y * steps.e[1] + n.z * steps.e[2];
        let q = pixel + offset;
        if all(q >= vec2i(0)) && all(q <= last) {
            let there = point(q);
            if there.profile == here.profile {
                let d = vec2f(offset);
                let plane2 = dot(lattice, vec3f(d.x * d.x, 2.0 * d.x * d.y, d.y * d.y));
                let off = distance2(there.mm, here.mm) / max(plane2, 1e-20);
                let is_middle = all(offset == vec2i(0));
                total += exp(exponent * select(off, 1.0, is_middle)) * textureLoad(source, q, 0);
            }
        }
    }
    return total;
}

// What the second pass needs to know of a pixel.
struct Center {
    pixel: vec2i,
    point: Point,
    shear: f32,
    m00: f32,
    // Squared mm between sheared rows on the tangent plane: M₁₁ − κ²M₀₀.
    m11: f32,
    // Whether the first pass was so wide that the pixel nearest to a tap can stand for it.
    wide: bool,
    variance_mm2: f32,
    // The Gaussian's: of a little, rows may lie further off the plane.
    largest_weight: f32,
}

// Marks a row whose sum was weighed from a pixel far off the center's tangent plane: on another layer,
// around a sharp bend or off the surface.
const OFF_PLANE = vec4f(0.0, 0.0, 0.0, -1.0);

// The sum of the row of pixel q as the center weighs it, q being δ = `delta` pixels off the sheared
// line and `dy` rows off the center: by the distance without its part M₀₀δ², which the first pass
// has spent.
fn row_of(q: vec2i, dy: f32, delta: f32, center: Center) -> vec4f {
    if q.x < 0 || q.x >= size().x {
        return OFF_PLANE;
    }
    let there = point(q);
    let d2 = max(distance2(there.mm, center.point.mm) - center.m00 * delta * delta, 0.0);
    let plane2 = center.m11 * dy * dy;
    if there.profile != center.point.profile
        || abs(d2 - plane2) * center.largest_weight
            > OFF_PLANE_OF_DISTANCE2 * min(plane2, d2) + OFF_PLANE_OF_VARIANCE * center.variance_mm2 {
        return OFF_PLANE;
    }
    return weight(d2, center.variance_mm2) * textureLoad(rows, q, 0);
}

// The sum of row y on the sheared line, between two pixels.
fn row_at(y: i32, center: Center) -> vec4f {
    let dy = f32(y - center.pixel.y);
    let dx = -center.shear * dy;
    if center.wide {
        // Rounds alike on both sides, so that it shifts nothing.
        let nearest = sign(dx) * floor(abs(dx) + 0.5);
        return row_of(vec2i(center.pixel.x + i32(nearest), y), dy, nearest - dx, center);
    }
    // A pixel that weighs nothing must not tell whether the row is off the plane.
    let at = select(dx, round(dx), abs(dx - round(dx)) < NEGLIGIBLE_PX);
    let q = vec2i(center.pixel.x + i32(floor(at)), y);
    let f = fract(at);
    let left = row_of(q, dy, -f, center);
    if f == 0.0 {
        return left;
    }
    let right = row_of(q + vec2i(1, 0), dy, 1.0 - f, center);
    return select(mix(left, right, f), OFF_PLANE, left.a < 0.0 || right.a < 0.0);
}

// Second pass, [LS15] Eq. 12: over the rows along the sheared step (−κ, 1), which completes the square
// M₀₀(dx + κ dy)² + (M₁₁ − κ²M₀₀)dy². Rows off the plane are weighed anew from the center, in a loop of
// their own, since most pixels have few.
fn sheared_rows(pixel: vec2i, here: Point, m: Metric, reach: vec2i, v: f32, largest_weight: f32) -> vec4f {
    let m11 = m.area * m.area / m.m00;
    let variance_mm2 = lattice_variance(v, rows_of(m.lattice).y);
    let wide = v > WIDE_PX2 * m.m00;
    let center = Center(pixel, here, m.shear, m.m00, m11, wide, variance_mm2, largest_weight);
    let first = max(pixel.y - reach.y, 0);
    let last = min(pixel.y + reach.y, size().y - 1);
    var total = vec4f(0.0);
    var first_off = last + 1;
    var last_off = first - 1;
    for (var y = first; y <= last; y++) {
        let sum_of_row = row_at(y, center);
        if sum_of_row.a < 0.0 {
            first_off = min(first_off, y);
            last_off = y;
        } else {
            total += sum_of_row;
        }
    }
    for (var y = first_off; y <= last_off; y++) {
        if row_at(y, center).a < 0.0 {
            let up = f32(y - pixel.y) / f32(reach.y);
            let across = i32(ceil(f32(reach.x) * sqrt(1.0 - up * up)));
            total += row(vec2i(pixel.x, y), here, across, variance_mm2);
        }
    }
    return total;
}

// Σ w·A·E and Σ w·A of a Gaussian over the surface around a pixel.
fn front_sum(pixel: vec2i, here: Point, m: Metric, g: vec4f) -> vec4f {
    let l = m.lattice;
    // Without area there is no lattice: but for no variance at all, what is endless is not small.
    let inverse = vec3f(l.z, -l.y, l.x) / max(l.x * l.z - l.y * l.y, 1e-24);
    let steps = along_steps(g.w * inverse);
    if all(steps.rho <= vec3f(SMALL)) && all(steps.rho > vec3f(-1e-3)) {
        return small(pixel, here, l, steps);
    }
    return sheared_rows(pixel, here, m, reach(m.spacing, g.w), g.w, max(g.r, max(g.g, g.b)));
}

// [LS15] Eq. 11: one Gaussian's part, divided by its own mass, added to those before it.
fn with_gaussian(vertex: Vertex, g: vec4f, total: vec4f) -> vec4f {
    let pixel = vec2i(vertex.position.xy);
    var before = vec3f(0.0);
    if vertex.gaussian > 0u {
        before = textureLoad(sum, pixel, 0).rgb;
    }
    if total.a <= 0.0 {
        // No area to speak of: nothing to share with.
        return vec4f(before + g.rgb * own_light(pixel), 1.0);
    }
    return vec4f(before + g.rgb * total.rgb / total.a, 1.0);
}

// The sum of the Gaussians up to this one.
@fragment
fn fs_sum(vertex: Vertex) -> @location(0) vec4f {
    let pixel = vec2i(vertex.position.xy);
    let here = point(pixel);
    if here.profile == 0u {
        return vec4f(0.0);
    }
    let g = gaussian(here, vertex.gaussian);
    var total = vec4f(0.0);
    // A profile of fewer Gaussians than another has some of no weight.
    if any(g.rgb != vec3f(0.0)) {
        total = front_sum(pixel, here, metric(pixel, here), g);
    }
    return with_gaussian(vertex, g, total);
}

// The sum at a pixel of the surface, as much of it as the pixel takes; its light bit for bit where that
// is none.
fn taken(pixel: vec2i) -> vec3f {
    let scattered = textureLoad(sum, pixel, 0).rgb;
    if settings.has_strength == 0u {
        return scattered;
    }
    let share = saturate(textureLoad(strength, vec2i(settings.first_pixel) + pixel, 0).r);
    return select(mix(own_light(pixel), scattered, share), irradiance_at(pixel).rgb, share <= 0.0);
}

// The result: the sum on the surface, carried into the gutter, and the input as it was elsewhere.
@fragment
fn fs_resolve(vertex: Vertex) -> @location(0) vec4f {
    let pixel = vec2i(vertex.position.xy) - vec2i(settings.first_pixel);
    let before = irradiance_at(pixel);
    if point(pixel).profile != 0u {
        return vec4f(taken(pixel), before.a);
    }
    for (var ring = 1; ring <= settings.gutter; ring++) {
        var total = vec4f(0.0);
        var count = 0.0;
        for (var y = -ring; y <= ring; y++) {
            for (var x = -ring; x <= ring; x++) {
                let q = pixel + vec2i(x, y);
                if max(abs(x), abs(y)) == ring && point_or_none(q).profile != 0u {
                    total += vec4f(textureLoad(sum, q, 0).rgb, irradiance_at(q).a);
                    count += 1.0;
                }
            }
        }
        if count > 0.0 {
            return total / count;
        }
    }
    return before;
}

// What an output that is added to is multiplied by.
fn albedo_at(pixel: vec2i) -> vec3f {
    if settings.has_albedo == 0u {
        return vec3f(1.0);
    }
    return textureLoad(albedo, vec2i(settings.first_pixel) + pixel, 0).rgb;
}

// The result, to be added.
@fragment
fn fs_add(vertex: Vertex) -> @location(0) vec4f {
    let pixel = vec2i(vertex.position.xy) - vec2i(settings.first_pixel);
    var light = irradiance_at(pixel).rgb;
    if point(pixel).profile != 0u {
        light = taken(pixel);
    }
    return vec4f(albedo_at(pixel) * light, 0.0);
}

// What the result differs by from the input, to be added.
@fragment
fn fs_difference(vertex: Vertex) -> @location(0) vec4f {
    let pixel = vec2i(vertex.position.xy) - vec2i(settings.first_pixel);
    if point(pixel).profile == 0u {
        discard;
    }
    let before = irradiance_at(pixel).rgb;
    // Nothing can be added to what is no number.
    let difference = select(vec3f(0.0), taken(pixel) - before, is_finite(before));
    return vec4f(albedo_at(pixel) * difference, 0.0);
}
