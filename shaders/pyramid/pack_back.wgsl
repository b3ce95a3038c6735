// The layer behind the frame as the pyramid has it, where it is near enough to what is seen to scatter to it;
// and in which tiles it is. A workgroup is four tiles. Follows pack.wgsl, whose textures here are of the back.

@group(0) @binding(11) var seen_shape: texture_2d<u32>;
@group(0) @binding(13) var seen_light: texture_2d<f32>;
// Of the tiles of each level, as they are in `grids`.
@group(0) @binding(12) var<storage, read_write> back_tiles: array<atomic<u32>>;

// What a tile holds of the back: what scatters to pixels of the tile itself; anything.
const BACK_NEAR = 1u;
const BACK_ANY = 2u;

var<workgroup> held: array<atomic<u32>, TOGETHER>;

// Whether a layer so far behind, in mm, changes the light by more than the plan's error: Σ w e^(−t²/2v) times the
// difference of their light exceeds it.
fn scatters(thickness: f32, seen: vec4f, back: vec4f) -> bool {
    let off = abs(seen.rgb / max(seen.a, 1e-6) - back.rgb / max(back.a, 1e-6));
    let difference = max(max(off.r, off.g), max(off.b, 1e-6));
    let reach2 = view.back_reach * view.back_reach + view.back_growth * log(difference);
    return thickness < 0.0 || thickness * thickness < reach2;
}

// Packs what is behind a pixel of skin, and adds it to what its tile holds.
fn pack_behind(pixel: vec2i, i: u32) {
    let seen = textureLoad(seen_shape, pixel, 0).rg;
    let here = host_surface(pixel);
    let is_skin = here.id != 0u && here.id <= view.profiles;
    let thickness = bitcast<f32>(seen.y) - here.z;
    // A back too far to reach this pixel may reach others: up to twice as far it is kept.
    if seen.x >> 24u != 0u && is_skin && thickness < 2.0 * view.back_reach {
        let packed = packed_at(pixel, here);
        textureStore(packed_light, pixel, packed.light);
        textureStore(packed_shape, pixel, vec4u(packed.shape, 0u, 0u));
        let is_near = packed.shape.x >> 24u == seen.x >> 24u
            && scatters(thickness, textureLoad(seen_light, pixel, 0), packed.light);
        atomicOr(&held[i], select(BACK_ANY, BACK_ANY | BACK_NEAR, is_near));
    }
}

@compute @workgroup_size(TILE, TILE)
fn pack_back(
    @builtin(local_invocation_id) place: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let grid = grids[0].xy;
    for (var i = 0u; i < TOGETHER; i++) {
        let tile = tile_in(group.xy, i);
        let pixel = TILE * tile + place.xy;
        // Where no skin is seen nothing is behind it.
        if all(pixel < view.size)
            && (atomicLoad(&contents[3u * (tile.y * grid.x + tile.x)]) & PROFILES) != 0u {
            pack_behind(vec2i(pixel), i);
        }
    }
    workgroupBarrier();
    let level = thread / TOGETHER;
    let tile = tile_in(group.xy, thread % TOGETHER);
    if level <= view.levels && all(tile < grid) {
        let place = tile >> vec2u(level);
        let word = grids[level].z + place.y * grids[level].x + place.x;
        atomicOr(&back_tiles[word], atomicLoad(&held[thread % TOGETHER]));
    }
}
