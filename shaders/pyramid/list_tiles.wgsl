// Which tiles each level is made of, and which of them are planar: what lets all other passes run there
// alone, and as cheaply as they can. Follows surface.wgsl.

// Of each level columns and rows of tiles, and where they begin.
@group(0) @binding(9) var<uniform> grids: array<vec4u, GRIDS>;
// Three words of each tile, as pack.wgsl has them.
@group(0) @binding(10) var<storage, read> contents: array<u32>;
@group(0) @binding(11) var<storage, read_write> draws: array<Draw>;
@group(0) @binding(12) var<storage, read_write> list: array<u32>;
// As in pack_back.wgsl; looked at where there is a back layer.
@group(0) @binding(13) var<storage, read> back_tiles: array<u32>;

struct Draw {
    vertices: u32,
    instances: atomic<u32>,
    first_vertex: u32,
    first_instance: u32,
}

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
    var held = Contents();
    for (var i = 0; i < 9; i++) {
        let one = contents_of(grid, tile + vec2i(i % 3, i / 3) - 1);
        held.marks |= one.marks;
        held.brightest = max(held.brightest, one.brightest);
        held.darkest = max(held.darkest, one.darkest);
    }
    return held;
}

// What the tiles of the level before hold, of which this tile is made, and those around them: as far as taps
// reach. Of the frame nothing.
fn contents_in_reach(l: u32, tile: vec2i) -> Contents {
    var held = Contents();
    for (var i = 0; i < select(16, 0, l == 0u); i++) {
        let one = contents_of(grids[l - 1u], 2 * tile + vec2i(i & 3, i >> 2u) - 1);
        held.marks |= one.marks;
        held.brightest = max(held.brightest, one.brightest);
        held.darkest = max(held.darkest, one.darkest);
    }
    return held;
}

// How far blurs that take the surface for planar may be off, in tiles that hold so much together: how bent
// the surface is, up to 2, times the range of light.
fn doubt(held: Contents, l: u32) -> f32 {
    let difficulty = (held.marks >> DIFFICULTY_SHIFT) & 15u;
    // The largest bound that the surface passed: .03, .125, .5 or 2, and twice that on each level.
    var bend = select(0.0, exp2(f32(2u * firstLeadingBit(difficulty) + l) - 5.0), difficulty != 0u);
    bend = max(bend, select(0.0, 2.0, has_odd_pixels()));
    return min(bend, 2.0) * (bitcast<f32>(held.brightest) - bitcast<f32>(~held.darkest));
}

// How a tile with skin is blurred.
fn class_of(tile: vec2i, l: u32) -> u32 {
    let around = contents_around(grids[l], tile);
    let mixes = countOneBits(around.marks & PROFILES) > 1u;
    var doubted = doubt(contents_in_reach(l, tile), l) > view.level_limit;
    if l == 0u {
        var near = contents_of(grids[0], tile);
        if has_odd_pixels() {
            near = around;
        }
        let word = grids[0].z + u32(tile.y) * grids[0].x + u32(tile.x);
        let has_back = view.back_reach > 0.0 && (back_tiles[word] & 1u) != 0u;
        doubted = has_back || doubt(near, 0u) > view.frame_limit;
    }
    return select(PLANAR, CAREFUL, mixes || doubted);
}

// One thread a tile: lists those with skin that need their level, or are next to one that does.
@compute @workgroup_size(8, 8)
fn list_tiles(@builtin(global_invocation_id) at: vec3u) {
    let l = at.z;
    let grid = grids[l];
    let tile = vec2i(at.xy);
    if any(at.xy >= grid.xy) {
        return;
    }
    let middle = contents_of(grid, tile);
    if (middle.marks & PROFILES) == 0u {
        return;
    }
    let around = contents_around(grid, tile);
    if (around.marks & LEVELS) >> l == 0u {
        return;
    }
    let word = (at.y << 16u) | at.x;
    let kind = class_of(tile, l);
    let place = atomicAdd(&draws[CLASSES * l + kind].instances, 1u);
    list[grid.z + select(place, grid.x * grid.y - 1u - place, kind == CAREFUL)] = word;
}
