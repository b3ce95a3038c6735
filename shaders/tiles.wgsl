// Which tiles hold skin, up to which level of the pyramid each needs the light, and which of them are
// simple: what lets all other passes run there alone, and as cheaply as they can.

// As in surface.wgsl.
struct View {
    has_id: u32,
    has_strength: u32,
    far: f32,
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
// How far from even slopes may be, as sines.
const EVEN = 0.1;
const ROWS_PER_OCTAVE = 6.0;

// What is known of a tile: 1 + the highest level it needs, or 0 without skin; whether it holds anything
// else, too; and its profile.
const TOP = 0xfu;
const ELSE = 0x10u;
const ID_SHIFT = 16u;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var depth: texture_2d<f32>;
@group(0) @binding(2) var profile_id: texture_2d<u32>;
// The weights of the plan; the first vector of a row has the highest level in w.
@group(0) @binding(3) var<storage, read> weights: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> marked: array<u32>;

var<workgroup> top: atomic<u32>;
var<workgroup> largest_id: atomic<u32>;
var<workgroup> elsewhere: atomic<u32>;

// One workgroup a tile.
@compute @workgroup_size(TILE, TILE)
fn mark(
    @builtin(global_invocation_id) at: vec3u,
    @builtin(local_invocation_id) inside: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(num_workgroups) tiles: vec3u,
) {
    var id = 0u;
    let pixel = view.first_pixel + at.xy;
    if all(at.xy < view.size) {
        id = 1u;
        if view.has_id != 0u {
            id = textureLoad(profile_id, pixel, 0).r;
        }
        if id > view.profiles {
            id = 0u;
        }
    }
    if id > 0u {
        let d = textureLoad(depth, pixel, 0).r;
        let z = (view.depth_to_mm.x * d + view.depth_to_mm.y)
            / (view.depth_to_mm.z * d + view.depth_to_mm.w);
        // Infinitely far away there is no surface.
        if !(abs(z) < 3e38) || d == view.far {
            id = 0u;
        } else {
            let mm = abs(view.step.xy * z + view.step.zw);
            // A slope is blurred at finer levels than a surface that faces the camera; what is narrower
            // across a ray, or in a pixel that is not square, by less than two rows at coarser ones.
            let row = ceil((-log2(max(mm.x, mm.y)) - view.first_octave) * ROWS_PER_OCTAVE) + 2.0;
            let i = u32(clamp(row, 0.0, f32(view.rows - 1u)));
            // Most pixels of a tile say the same, and a load is cheaper.
            let needs = 1u + u32(weights[((id - 1u) * view.rows + i) * view.stride].w);
            if needs > atomicLoad(&top) {
                atomicMax(&top, needs);
            }
            if id > atomicLoad(&largest_id) {
                atomicMax(&largest_id, id);
            }
        }
    }
    workgroupBarrier();
    let of_tile = atomicLoad(&largest_id);
    if id != of_tile {
        atomicStore(&elsewhere, ELSE);
    }
    workgroupBarrier();
    if local == 0u {
        let skin = of_tile << ID_SHIFT | atomicLoad(&elsewhere) | atomicLoad(&top);
        marked[tile.y * tiles.x + tile.x] = select(ELSE, skin, of_tile > 0u);
    }
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
// Of each tile of this level and of the one below, a bit for each level at which it is bent.
@group(0) @binding(10) var<storage, read> bends_below: array<u32>;
@group(0) @binding(11) var<storage, read_write> bends: array<u32>;

// Where the frame's surface is, as in surface.wgsl.
@group(0) @binding(12) var shape: texture_2d<u32>;

struct Tile {
    marks: u32,
    bends: u32,
}

fn tile_below(tile: vec2i) -> Tile {
    if any(tile < vec2i(0)) || any(tile >= vec2i(level.below)) {
        return Tile(ELSE, 0u);
    }
    let i = u32(tile.y) * level.below.x + u32(tile.x);
    return Tile(below[i], bends_below[i]);
}

// A tile of this level: as it was marked, or what its four children are together.
fn tile_at(tile: vec2i) -> Tile {
    if level.level == 0u {
        return tile_below(tile);
    }
    var all = Tile(0u, 0u);
    var highest = 0u;
    var id = 0u;
    for (var i = 0; i < 4; i++) {
        let child = tile_below(2 * tile + vec2i(i & 1, i >> 1u));
        all.bends |= child.bends;
        all.marks |= child.marks & ELSE;
        highest = max(highest, child.marks & TOP);
        let child_id = child.marks >> ID_SHIFT;
        if child_id != 0u && id != 0u && child_id != id {
            all.marks |= ELSE;
        }
        id = max(id, child_id);
    }
    all.marks |= id << ID_SHIFT | highest;
    return all;
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
    let middle = tile_at(vec2i(at.xy));
    var bent = 0u;
    var simple = level.level < FLAT_LEVELS;
    var top = 0u;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let tile = tile_at(vec2i(at.xy) + vec2i(x, y));
            top = max(top, tile.marks & TOP);
            bent |= tile.bends;
            simple &= (tile.marks & ELSE) == 0u && tile.marks >> ID_SHIFT == middle.marks >> ID_SHIFT;
        }
    }
    let i = at.y * level.tiles.x + at.x;
    here[i] = middle.marks;
    bends[i] = middle.bends;
    if top <= level.level || (middle.marks & TOP) == 0u {
        return;
    }
    let tile = at.y << 16u | at.x;
    if simple && (bent >> level.level & 1u) == 0u && turns_evenly(vec2i(at.xy)) {
        list[atomicAdd(&draws[0].instances, 1u)] = tile;
    } else {
        list[arrayLength(&list) - 1u - atomicAdd(&draws[1].instances, 1u)] = tile;
    }
}
