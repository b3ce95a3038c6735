// Which tiles each level is made of, and which of them are planar: what lets all other passes run there
// alone, and as cheaply as they can. Follows surface.wgsl.

// Of each level columns and rows of tiles, and where they begin.
@group(0) @binding(9) var<uniform> grids: array<vec4u, GRIDS>;
// Three words of each tile, as pack.wgsl has them.
@group(0) @binding(10) var<storage, read> contents: array<u32>;
@group(0) @binding(11) var<storage, read_write> draws: array<Draw>;
@group(0) @binding(12) var<storage, read_write> list: array<u32>;

struct Draw {
    vertices: u32,
    instances: atomic<u32>,
    first_vertex: u32,
    first_instance: u32,
}

const GRIDS = 11u;
const LEVELS = 0x7ffu;
const DIFFICULTY_SHIFT = 11u;
const NOT_SKIN = 1u << 15u;
const PROFILES = 0xffff0000u;

struct Contents {
    marks: u32,
    brightest: u32,
    darkest: u32,
}

// Of a tile; beyond the level there is no skin.
fn contents_of(grid: vec4u, tile: vec2i) -> Contents {
    if any(tile < vec2i(0)) || any(tile >= vec2i(grid.xy)) {
        return Contents(NOT_SKIN, 0u, 0u);
    }
    let first = 3u * (grid.z + u32(tile.y) * grid.x + u32(tile.x));
    return Contents(contents[first], contents[first + 1u], contents[first + 2u]);
}

// What a tile and those around it hold together.
fn contents_around(grid: vec4u, tile: vec2i) -> Contents {
    var all = Contents();
    for (var i = 0; i < 9; i++) {
        let one = contents_of(grid, tile + vec2i(i % 3, i / 3) - 1);
        all.marks |= one.marks;
        all.brightest = max(all.brightest, one.brightest);
        all.darkest = max(all.darkest, one.darkest);
    }
    return all;
}

// Whether a tile is blurred well enough as if all of it lay on planes: of one profile, and hardly bent, or
// hardly of different light.
fn is_planar(around: Contents, l: u32) -> bool {
    let difficulty = (around.marks >> DIFFICULTY_SHIFT) & 15u;
    // The largest bound that the surface passed: .03, .125, .5 or 2, and twice that on each level.
    var bend = select(0.0, exp2(f32(2u * firstLeadingBit(difficulty) + l) - 5.0), difficulty != 0u);
    bend = max(bend, select(0.0, HOLES, (around.marks & NOT_SKIN) != 0u));
    let range = bitcast<f32>(around.brightest) - bitcast<f32>(~around.darkest);
    return countOneBits(around.marks & PROFILES) == 1u && min(bend, 2.0) * range <= view.planar_limit;
}

// What pixels without skin are taken for.
const HOLES = 1.0;

// One thread a tile: lists those with skin that need their level, or are next to one that does.
@compute @workgroup_size(8, 8)
fn list_tiles(@builtin(global_invocation_id) at: vec3u) {
    let l = at.z;
    let grid = grids[l];
    let tile = vec2i(at.xy);
    if any(at.xy >= grid.xy) || (contents_of(grid, tile).marks & PROFILES) == 0u {
        return;
    }
    let around = contents_around(grid, tile);
    if (around.marks & LEVELS) >> l == 0u {
        return;
    }
    let word = (at.y << 16u) | at.x;
    if is_planar(around, l) {
        list[grid.z + atomicAdd(&draws[2u * l].instances, 1u)] = word;
    } else {
        let end = grid.z + grid.x * grid.y - 1u;
        list[end - atomicAdd(&draws[2u * l + 1u].instances, 1u)] = word;
    }
}
