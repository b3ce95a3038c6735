// Which tiles hold skin, up to which level of the pyramid each needs the light, and which of them are
// simple: what lets all other passes run there alone, and as cheaply as they can.

// As in surface.wgsl.
struct View {
    has_id: u32,
    has_strength: u32,
    far: f32,
    has_albedo: u32,
    origin: vec4f,
    step: vec4f,
    depth_to_mm: vec4f,
    first_octave: f32,
    rows: u32,
    stride: u32,
    profiles: u32,
    first_pixel: vec2u,
    size: vec2u,
}

// Side of a tile in pixels of its level; taps reach as far.
const TILE = 8u;
// Levels that may have flat tiles.
const FLAT_LEVELS = 3u;
// Columns of pixels that a workgroup marks the tiles of.
const COLUMNS = 64u;
// How far from even slopes may be, as sines.
const EVEN = 0.1;
const ROWS_PER_OCTAVE = 6.0;

// What is known of a tile, a bit each, so that several together are those of all of them: each level
// that light is needed of; each level at which the surface is bent; whether there is anything but
// skin; each profile.
const BENT_SHIFT = 11u;
const LEVELS = (1u << BENT_SHIFT) - 1u;
const ELSE = 1u << (BENT_SHIFT + FLAT_LEVELS);
const PROFILE_SHIFT = 16u;
const PROFILES = 0xffffu << PROFILE_SHIFT;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var depth: texture_2d<f32>;
@group(0) @binding(2) var profile_id: texture_2d<u32>;
// The weights of the plan; the first vector of a row has the highest level in w.
@group(0) @binding(3) var<storage, read> weights: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> marked: array<atomic<u32>>;

fn marks_of_pixel(pixel_of_view: vec2u) -> u32 {
    let pixel = view.first_pixel + pixel_of_view;
    var id = 1u;
    if view.has_id != 0u {
        id = textureLoad(profile_id, pixel, 0).r;
    }
    if id == 0u || id > view.profiles {
        return ELSE;
    }
    let d = textureLoad(depth, pixel, 0).r;
    let z = (view.depth_to_mm.x * d + view.depth_to_mm.y)
        / (view.depth_to_mm.z * d + view.depth_to_mm.w);
    // Infinitely far away there is no surface.
    if !(abs(z) < 3e38) || d == view.far {
        return ELSE;
    }
    let mm = abs(view.step.xy * z + view.step.zw);
    // A slope is blurred at finer levels than a surface that faces the camera; what is narrower
    // across a ray, or in a pixel that is not square, by less than two rows at coarser ones.
    let row = ceil((-log2(max(mm.x, mm.y)) - view.first_octave) * ROWS_PER_OCTAVE) + 2.0;
    let i = u32(clamp(row, 0.0, f32(view.rows - 1u)));
    let highest = u32(weights[((id - 1u) * view.rows + i) * view.stride].w);
    return (1u << highest) | (1u << (PROFILE_SHIFT + id - 1u));
}

// One thread a column of a tile.
@compute @workgroup_size(COLUMNS)
fn mark(@builtin(global_invocation_id) at: vec3u) {
    let tiles = (view.size.x + TILE - 1u) / TILE;
    let tile = vec2u(at.x / TILE, at.y);
    if tile.x >= tiles {
        return;
    }
    var marks = 0u;
    for (var y = 0u; y < TILE; y++) {
        let pixel = vec2u(at.x, at.y * TILE + y);
        if all(pixel < view.size) {
            marks |= marks_of_pixel(pixel);
        } else {
            marks |= ELSE;
        }
    }
    atomicOr(&marked[tile.y * tiles + tile.x], marks);
}

struct Level {
    // Tiles of this level and of the one below.
    tiles: vec2u,
    below: vec2u,
    level: u32,
}

struct Draw {
    vertices: u32,
    instances: atomic<u32>,
    first_vertex: u32,
    first_instance: u32,
}

@group(0) @binding(5) var<uniform> level: Level;
@group(0) @binding(6) var<storage, read> below: array<u32>;
@group(0) @binding(7) var<storage, read_write> here: array<u32>;
// Of the tiles that are simple, and of the others.
@group(0) @binding(8) var<storage, read_write> draws: array<Draw, 2>;
// Tiles to be drawn, x in the low half: the simple ones from the front on, the others from the end.
@group(0) @binding(9) var<storage, read_write> list: array<u32>;
// Where the frame's surface is, as in surface.wgsl.
@group(0) @binding(10) var shape: texture_2d<u32>;

fn marks_below(tile: vec2i) -> u32 {
    if any(tile < vec2i(0)) || any(tile >= vec2i(level.below)) {
        return ELSE;
    }
    return below[u32(tile.y) * level.below.x + u32(tile.x)];
}

// Of a tile of this level: what was marked, or what its four children have together.
fn marks_of(tile: vec2i) -> u32 {
    if level.level == 0u {
        return marks_below(tile);
    }
    return marks_below(2 * tile) | marks_below(2 * tile + vec2i(1, 0))
        | marks_below(2 * tile + vec2i(0, 1)) | marks_below(2 * tile + 1);
}

// The sines of the slopes of the surface, along a row and along a column.
fn slopes(pixel: vec2i) -> vec2f {
    let last = vec2i(textureDimensions(shape)) - 1;
    let packed = textureLoad(shape, clamp(pixel, vec2i(0), last), 0).r;
    return (vec2f(vec2u(packed, packed >> 12u) & vec2u(0xfffu)) - 2048.0) / 2047.0;
}

// Whether the slopes of a tile are as between those at its corners.
fn turns_evenly(tile: vec2i) -> bool {
    let side = i32(TILE << level.level);
    let first = tile * side;
    let a = slopes(first);
    let b = slopes(first + vec2i(side, 0));
    let c = slopes(first + vec2i(0, side));
    let d = slopes(first + vec2i(side, side));
    var off = vec2f(0.0);
    for (var i = 0; i < 9; i++) {
        let at = vec2i(i % 3, i / 3);
        let share = vec2f(at) / 2.0;
        let between = mix(mix(a, b, share.x), mix(c, d, share.x), share.y);
        off = max(off, abs(slopes(first + at * side / 2) - between));
    }
    return max(off.x, off.y) <= EVEN;
}

// One thread a tile: lists those with skin that need this level, or are next to one that does.
@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) at: vec3u) {
    if any(at.xy >= level.tiles) {
        return;
    }
    let middle = marks_of(vec2i(at.xy));
    here[at.y * level.tiles.x + at.x] = middle;
    if (middle & PROFILES) == 0u {
        return;
    }
    var around = 0u;
    for (var i = 0; i < 9; i++) {
        around |= marks_of(vec2i(at.xy) + vec2i(i % 3, i / 3) - 1);
    }
    if (around & LEVELS) >> level.level == 0u {
        return;
    }
    let is_flat = level.level < FLAT_LEVELS && (around & (ELSE | (1u << (BENT_SHIFT + level.level)))) == 0u;
    let tile = (at.y << 16u) | at.x;
    if is_flat && countOneBits(around & PROFILES) == 1u && turns_evenly(vec2i(at.xy)) {
        list[atomicAdd(&draws[0].instances, 1u)] = tile;
    } else {
        list[arrayLength(&list) - 1u - atomicAdd(&draws[1].instances, 1u)] = tile;
    }
}
