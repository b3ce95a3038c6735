// Which tiles hold skin, and up to which level of the pyramid each needs the light: what lets all
// other passes run there alone.

// As in pyramid.wgsl.
struct View {
    origin: vec4f,
    step: vec4f,
    depth_to_mm: vec4f,
    first_octave: f32,
    rows: u32,
    stride: u32,
    profiles: u32,
}

// Side of a tile in pixels of its level.
const TILE = 16u;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var depth: texture_2d<f32>;
@group(0) @binding(2) var profile_id: texture_2d<u32>;
// The weights of the plan; the first vector of a row has the highest level in w.
@group(0) @binding(3) var<storage, read> weights: array<vec4f>;
// Of each tile: 0 without skin, else 1 + the highest level.
@group(0) @binding(4) var<storage, read_write> tops: array<u32>;

const ROWS_PER_OCTAVE = 4.0;

var<workgroup> top: atomic<u32>;

// One workgroup a tile.
@compute @workgroup_size(TILE, TILE)
fn mark(
    @builtin(global_invocation_id) at: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(num_workgroups) tiles: vec3u,
) {
    let size = textureDimensions(profile_id);
    var here = 0u;
    if all(at.xy < size) {
        let id = textureLoad(profile_id, at.xy, 0).r;
        if id > 0u && id <= view.profiles {
            let d = textureLoad(depth, at.xy, 0).r;
            let z = (view.depth_to_mm.x * d + view.depth_to_mm.y)
                / (view.depth_to_mm.z * d + view.depth_to_mm.w);
            let mm = abs(view.step.xy * z + view.step.zw);
            // A slope is blurred at finer levels than a surface that faces the camera.
            let row = ceil((-log2(max(mm.x, mm.y)) - view.first_octave) * ROWS_PER_OCTAVE);
            let i = u32(clamp(row, 0.0, f32(view.rows - 1u)));
            here = 1u + u32(weights[((id - 1u) * view.rows + i) * view.stride].w);
        }
    }
    if local == 0u {
        atomicStore(&top, 0u);
    }
    workgroupBarrier();
    atomicMax(&top, here);
    workgroupBarrier();
    if local == 0u {
        tops[tile.y * tiles.x + tile.x] = atomicLoad(&top);
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
@group(0) @binding(6) var<storage, read> tops_below: array<u32>;
@group(0) @binding(7) var<storage, read_write> tops_here: array<u32>;
@group(0) @binding(8) var<storage, read_write> draw: Draw;
// Tiles to be drawn, x in the low half.
@group(0) @binding(9) var<storage, read_write> list: array<u32>;

fn top_of(tile: vec2i) -> u32 {
    let last = vec2i(level.below) - 1;
    if level.level == 0u {
        if any(tile < vec2i(0)) || any(tile > last) {
            return 0u;
        }
        return tops_below[u32(tile.y) * level.below.x + u32(tile.x)];
    }
    var top = 0u;
    for (var i = 0; i < 4; i++) {
        let child = 2 * tile + vec2i(i & 1, i >> 1u);
        if all(child >= vec2i(0)) && all(child <= last) {
            top = max(top, tops_below[u32(child.y) * level.below.x + u32(child.x)]);
        }
    }
    return top;
}

// One thread a tile: lists those that need this level, and their neighbours, which kernels reach.
@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) at: vec3u) {
    if any(at.xy >= level.tiles) {
        return;
    }
    let tile = vec2i(at.xy);
    tops_here[at.y * level.tiles.x + at.x] = top_of(tile);
    var top = 0u;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            top = max(top, top_of(tile + vec2i(x, y)));
        }
    }
    if top > level.level {
        list[atomicAdd(&draw.instances, 1u)] = at.y << 16u | at.x;
    }
}
