// The frame as the pyramid has it: light and area, and where the surface is; and what its tiles hold, which
// says how they can be blurred. A workgroup is four tiles, one of level 1, that it packs one after the other.
// Follows surface.wgsl.

@group(0) @binding(4) var irradiance: texture_2d<f32>;
@group(0) @binding(7) var packed_light: texture_storage_2d<rgba16float, write>;
@group(0) @binding(8) var packed_shape: texture_storage_2d<rg32uint, write>;
// As in list_tiles.wgsl: of each level columns and rows of tiles, and where they begin.
@group(0) @binding(9) var<uniform> grids: array<vec4u, GRIDS>;
@group(0) @binding(10) var<storage, read_write> contents: array<atomic<u32>>;

// ∂z over the mm of a pixel that a surface may have.
const STEEPEST = 40.0;

// Tiles of a workgroup, along a side and in all.
const SIDE = 2u;
const TOGETHER = SIDE * SIDE;

// Which of its tiles hold anything but skin, a bit each; and what each holds, gathered over its pixels.
var<workgroup> has_other: atomic<u32>;
var<workgroup> marks: array<atomic<u32>, TOGETHER>;
// Bits of a float, which as integers are in its order; of the darkest what all bits differ in.
var<workgroup> brightest: array<atomic<u32>, TOGETHER>;
var<workgroup> darkest: array<atomic<u32>, TOGETHER>;

// Whether light is a number. By its bits, since compilers may take for granted that it is.
fn is_finite(light: vec3f) -> bool {
    return all((bitcast<vec3u>(light) & vec3u(0x7f800000u)) != vec3u(0x7f800000u));
}

// ∂z over the mm of a pixel that is the `place`th of its row or column, from the steps from its neighbour and to the
// one on the other side: the mean where they agree; else of the shorter one, as it curves towards the pixel, since
// the other jumps. Beyond the frame nothing is known. Follows `tangent` and `one_sided` of gaussian_sum.wgsl.
fn tangent(pixel: vec2i, step: vec2i, place: i32, last: i32, sides: vec2f, mm: f32) -> f32 {
    let mm2 = mm * mm;
    let lengths2 = sides * sides + mm2;
    let has_last = place > 0;
    let has_next = place < last;
    // A factor of two in length is more than a smooth surface changes in a pixel.
    let is_smooth = max(lengths2.x, lengths2.y) <= 4.0 * min(lengths2.x, lengths2.y);
    var known = 0.5 * (sides.x + sides.y);
    var dz = known;
    if !(has_last && has_next && is_smooth) {
        let is_forward = has_next && (!has_last || lengths2.y < lengths2.x);
        let way = select(-1, 1, is_forward);
        let first = select(-sides.x, sides.y, is_forward);
        let beyond = z_at(pixel + 2 * way * step) - z_at(pixel + way * step);
        let place_beyond = place + 2 * way;
        // Maybe to infinity.
        let is_known = place_beyond >= 0 && place_beyond <= last && abs(beyond) < STEEPEST * mm;
        let second = select(0.0, beyond, is_known);
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

// How difficult the surface at a pixel is, a bit for .03, .125, .5 or 2, whichever it passes last: second
// differences of depth over the mm of a pixel, of which a level has twice as many as the one before.
fn difficulty_bits(bend: f32) -> u32 {
    // Half the exponent of a float: 61 from 2⁻⁵ on, 64 from 2 on.
    let passed = clamp(bitcast<u32>(bend) >> 24u, 60u, 64u) - 60u;
    return ((1u << passed) >> 1u) << DIFFICULTY_SHIFT;
}

// The area of a surface over that of one that faces the camera, |∂p/∂x × ∂p/∂y|: by how its depth changes over mm
// in x and y, and the ray through it.
fn area_of(slope: vec2f, ray: vec2f) -> f32 {
    return length(vec3f(slope, 1.0 + dot(ray, slope)));
}

const MOST_LIGHT = 65504.0;

// Light times area, and area, in what half floats hold: where the light is too bright for that it weighs
// less, and keeps its color.
fn area_weighed(host: vec3f, area: f32) -> vec4f {
    let light = clamp(host, vec3f(-MOST_LIGHT), vec3f(MOST_LIGHT));
    let most = max(max(abs(light.r), abs(light.g)), abs(light.b)) * area;
    return vec4f(light * area, area) * min(1.0, MOST_LIGHT / max(most, 1.0));
}

// From how many pixel widths on a second difference of depth is a step, and how far taps reach, in pixels.
const STEP = 2.0;
const REACH = 2;

// Adds a step, and the light there, to what a tile of the frame holds.
fn tell(tile: vec2i, brightness: f32) {
    let grid = vec2i(grids[0].xy);
    if all(tile >= vec2i(0)) && all(tile < grid) {
        let first = 3u * u32(tile.y * grid.x + tile.x);
        atomicOr(&contents[first], difficulty_bits(2.0 * STEP));
        atomicMax(&contents[first + 1u], bitcast<u32>(brightness));
        atomicMax(&contents[first + 2u], ~bitcast<u32>(brightness));
    }
}

// A pixel of skin.
struct Packed {
    light: vec4f,
    shape: vec2u,
    difficulty: u32,
    // The largest second difference of depth, in pixel widths.
    bend: f32,
    // The brightest color; endless where light is no number.
    brightness: f32,
}

fn packed_at(pixel: vec2i, here: HostSurface) -> Packed {
    let z = here.z;
    let last = vec2i(view.size) - 1;
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
    let bend = max(abs(east - west) / mm.x, abs(south - north) / mm.y);
    let along = tangent(pixel, vec2i(1, 0), pixel.x, last.x, vec2f(west, east), mm.x);
    let down = tangent(pixel, vec2i(0, 1), pixel.y, last.y, vec2f(north, south), mm.y);
    let slope = vec2f(along, down);
    let area = area_of(slope * sign(view.step.xy * z + view.step.zw), ray(pixel).xy);
    let sines = slope * inverseSqrt(1.0 + slope * slope);
    let host = textureLoad(irradiance, vec2i(view.first_pixel) + pixel, 0).rgb;
    var light = vec4f(0.0);
    var difficulty = difficulty_bits(bend);
    var brightness = MOST_LIGHT;
    if is_finite(host) {
        light = area_weighed(host, area);
        brightness = max(max(host.r, host.g), max(host.b, 0.0));
    } else {
        // Light that is no number weighs nothing. Such a pixel takes what is around it, which planar tiles
        // do not look for.
        difficulty = difficulty_bits(MOST_LIGHT);
    }
    return Packed(half_floats(light), packed(stand_in(here.id), z, sines), difficulty, bend, brightness);
}

// Packs a pixel of the viewport, and adds what it holds to what its tile does, the `i`th of the workgroup; false where
// it is not skin.
fn pack(pixel: vec2i, i: u32) -> bool {
    let here = host_surface(pixel);
    if here.id == 0u || here.id > view.profiles {
        return false;
    }
    let packed = packed_at(pixel, here);
    let id = packed.shape.x >> 24u;
    textureStore(packed_light, pixel, packed.light);
    textureStore(packed_shape, pixel, vec4u(packed.shape, 0u, 0u));
    if packed.bend > STEP {
        // Taps of the tiles beside this one reach it, too.
        let place = pixel & vec2i(i32(TILE) - 1);
        let before = select(vec2i(0), vec2i(-1), place < vec2i(REACH));
        let beside = before + select(vec2i(0), vec2i(1), place >= vec2i(i32(TILE) - REACH));
        let tile = pixel >> vec2u(firstTrailingBit(TILE));
        tell(tile + vec2i(beside.x, 0), packed.brightness);
        tell(tile + vec2i(0, beside.y), packed.brightness);
    }
    let level = coarsest_level(here.z, id);
    atomicOr(&marks[i], (1u << level) | packed.difficulty | (1u << (PROFILE_SHIFT + id - 1u)));
    atomicMax(&brightest[i], bitcast<u32>(packed.brightness));
    atomicMax(&darkest[i], ~bitcast<u32>(packed.brightness));
    return true;
}

// The `i`th tile of a workgroup.
fn tile_in(group: vec2u, i: u32) -> vec2u {
    return SIDE * group + vec2u(i % SIDE, i / SIDE);
}

// Adds what a tile of the workgroup holds to what a tile of a level does.
fn add(level: u32, tile: vec2u, i: u32) {
    let grid = grids[level];
    let first = 3u * (grid.z + tile.y * grid.x + tile.x);
    let other = select(0u, NOT_SKIN, ((atomicLoad(&has_other) >> i) & 1u) != 0u);
    atomicOr(&contents[first], atomicLoad(&marks[i]) | other);
    atomicMax(&contents[first + 1u], atomicLoad(&brightest[i]));
    atomicMax(&contents[first + 2u], atomicLoad(&darkest[i]));
}

@compute @workgroup_size(TILE, TILE)
fn pack_tiles(
    @builtin(local_invocation_id) place: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    var skin = 0u;
    for (var i = 0u; i < TOGETHER; i++) {
        let pixel = TILE * tile_in(group.xy, i) + place.xy;
        if all(pixel < view.size) {
            skin |= u32(pack(vec2i(pixel), i)) << i;
        }
    }
    atomicOr(&has_other, ~skin);
    workgroupBarrier();
    // To themselves, and to the tile of each level that they are a part of.
    let level = thread / TOGETHER;
    let i = thread % TOGETHER;
    let tile = tile_in(group.xy, i);
    if level <= view.levels && all(tile < grids[0].xy) {
        add(level, tile >> vec2u(level), i);
    }
}
