// The frame as the pyramid has it: light and area, and where the surface is. Follows surface.wgsl.

@group(0) @binding(4) var irradiance: texture_2d<f32>;
@group(0) @binding(5) var depth: texture_2d<f32>;
@group(0) @binding(6) var profile_id: texture_2d<u32>;
// Of each tile, as in tiles.wgsl: a bit for each level at which it is not flat, from BENT_SHIFT on.
@group(0) @binding(11) var<storage, read_write> marked: array<atomic<u32>>;

// Second differences of depth, over the mm of a pixel, up to which a level is flat.
const FLAT = 0.4;
// Levels that may have flat tiles; as in tiles.wgsl.
const FLAT_LEVELS = 3u;
const BENT_SHIFT = 11u;
// ∂z over the mm of a pixel that a surface may have.
const STEEPEST = 40.0;

// Whether light is a number. By its bits, since compilers may take for granted that it is.
fn is_finite(light: vec3f) -> bool {
    return all((bitcast<vec3u>(light) & vec3u(0x7f800000u)) != vec3u(0x7f800000u));
}

fn depth_at(pixel: vec2i) -> f32 {
    return textureLoad(depth, vec2i(view.first_pixel) + pixel, 0).r;
}

fn z_at(pixel: vec2i) -> f32 {
    let d = depth_at(pixel);
    let c = view.depth_to_mm;
    return (c.x * d + c.y) / (c.z * d + c.w);
}

fn is_inside(pixel: vec2i) -> bool {
    return all(pixel >= vec2i(0)) && all(pixel < vec2i(view.size));
}

// ∂z over the mm of a pixel, from the steps from its neighbour and to the one on the other side: the mean
// where they agree; else of the shorter one, as it curves towards the pixel, since the other jumps.
// Beyond the frame nothing is known. Follows `tangent` and `one_sided` of gaussian_sum.wgsl.
fn tangent(pixel: vec2i, step: vec2i, sides: vec2f, mm: f32) -> f32 {
    let lengths2 = sides * sides + mm * mm;
    let has_last = is_inside(pixel - step);
    let has_next = is_inside(pixel + step);
    // A factor of two in length is more than a smooth surface changes in a pixel.
    let is_smooth = max(lengths2.x, lengths2.y) <= 4.0 * min(lengths2.x, lengths2.y);
    var known = 0.5 * (sides.x + sides.y);
    var dz = known;
    if !(has_last && has_next && is_smooth) {
        let is_forward = has_next && (!has_last || lengths2.y < lengths2.x);
        let way = select(-step, step, is_forward);
        let first = select(-sides.x, sides.y, is_forward);
        let beyond = z_at(pixel + 2 * way) - z_at(pixel + way);
        // Maybe to infinity.
        let is_known = is_inside(pixel + 2 * way) && abs(beyond) < STEEPEST * mm;
        let second = select(0.0, beyond, is_known);
        let mm2 = mm * mm;
        let first2 = first * first + mm2;
        let both2 = (first + second) * (first + second) + 4.0 * mm2;
        let turn = (first * second + mm2) * inverseSqrt(first2 * (second * second + mm2));
        let on = saturate(5.0 * (turn - 0.7)) * clamp(first2 / max(both2 - 2.0 * first2, 1e-20), 0.0, 1.0);
        known = first;
        dz = select(first, first + on * (first - second), is_known);
        dz = select(-dz, dz, is_forward);
    }
    // What jumps on both sides, maybe to infinity, faces the camera for all that is known.
    return select(0.0, clamp(dz / mm, -STEEPEST, STEEPEST), abs(known) < STEEPEST * mm);
}

@fragment
fn fs_pack(@builtin(position) at: vec4f) -> Surface {
    let pixel = vec2i(at.xy);
    let none = Surface(vec4f(0.0), vec2u(0u));
    let pixel_of_host = vec2i(view.first_pixel) + pixel;
    var id = 1u;
    if view.has_id != 0u {
        id = textureLoad(profile_id, pixel_of_host, 0).r;
    }
    if id == 0u || id > view.profiles {
        return none;
    }
    let size = vec2i(view.size);
    let last = size - 1;
    let z = z_at(pixel);
    // Infinitely far away there is no surface.
    if !(abs(z) < 3e38) || depth_at(pixel) == view.far {
        return none;
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
    // Twice as much at each level; half of it is what a pixel is off the plane of its neighbour.
    let bend = max(abs(east - west) / mm.x, abs(south - north) / mm.y);
    let light = textureLoad(irradiance, pixel_of_host, 0).rgb;
    let is_light = is_finite(light);
    if bend > FLAT / f32(1u << (FLAT_LEVELS - 1u)) || !is_light {
        // 0 where all levels are bent, FLAT_LEVELS − 1 where the last is. Simple tiles have light.
        let flat_levels = select(0u, u32(max(ceil(log2(FLAT / bend)), 0.0)), is_light);
        let columns = (u32(size.x) + TILE - 1u) / TILE;
        let tile = vec2u(pixel) / TILE;
        let bends = (1u << FLAT_LEVELS) - (1u << flat_levels);
        atomicOr(&marked[tile.y * columns + tile.x], bends << BENT_SHIFT);
    }
    var shape = Shape(id, z, vec2f(0.0));
    shape.tangent.x = tangent(pixel, vec2i(1, 0), vec2f(west, east), mm.x);
    shape.tangent.y = tangent(pixel, vec2i(0, 1), vec2f(north, south), mm.y);
    let plane = plane_of(pixel, shape);
    let area = length(cross(plane.dx, plane.dy)) / (mm.x * mm.y);
    let sines = shape.tangent * inverseSqrt(1.0 + shape.tangent * shape.tangent);
    // Light that is no number goes no further. What is packed is half floats, which end there.
    let packed_light = select(vec4f(0.0), vec4f(clamp(light, vec3f(-65504.0), vec3f(65504.0)), area), is_light);
    return Surface(half_floats(packed_light), packed(id, z, sines));
}
