// The surface right behind the visible one, added to the exact sum: each Gaussian over both layers by distance
// in space, divided by its mass over both. Follows gaussian_sum.wgsl.
//
// The back is no plane through the pixel, so that two passes along rows and columns would not do: it is summed
// pixel by pixel, in the blocks of it that a Gaussian reaches.
//
// [LS15] Li & Shao 2015, Eq. 7 and 11.

// As `positions` and `source`, of the back.
@group(0) @binding(8) var back_positions: texture_2d<f32>;
@group(0) @binding(9) var back_source: texture_2d<f32>;
// Of each block of pixels of the back the nearest and the farthest z in mm.
@group(0) @binding(10) var blocks: texture_2d<f32>;

const BLOCK: i32 = 8;
// Where a block holds nothing: nearer than which nothing is.
const NO_Z: f32 = -3e38;

// What a block holds, `positions` being those of the back.
@fragment
fn fs_blocks(vertex: Vertex) -> @location(0) vec4f {
    let first = BLOCK * vec2i(vertex.position.xy);
    let last = min(first + BLOCK, size()) - 1;
    var nearest = NO_Z;
    var farthest = -NO_Z;
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let there = point(vec2i(x, y));
            if there.profile != 0u {
                nearest = max(nearest, there.mm.z);
                farthest = min(farthest, there.mm.z);
            }
        }
    }
    return vec4f(nearest, farthest, 0.0, 0.0);
}

// Σ w·A·E and Σ w·A of the back, as a pixel of the visible layer weighs them.
fn back_sum(pixel: vec2i, here: Point, m: Metric, variance_mm2: f32) -> vec4f {
    let v = lattice_variance(variance_mm2, rows_of(m.lattice).x);
    let reach_mm = REACH_SIGMAS * sqrt(variance_mm2);
    let reach = reach(m.spacing, variance_mm2);
    let first = max(pixel - reach, vec2i(0));
    let last = min(pixel + reach, size() - 1);
    var total = vec4f(0.0);
    for (var by = first.y / BLOCK; by <= last.y / BLOCK; by++) {
        for (var bx = first.x / BLOCK; bx <= last.x / BLOCK; bx++) {
            let z = textureLoad(blocks, vec2i(bx, by), 0);
            if z.x < here.mm.z - reach_mm || z.y > here.mm.z + reach_mm {
                continue;
            }
            let near = max(BLOCK * vec2i(bx, by), first);
            let far = min(BLOCK * vec2i(bx, by) + BLOCK - 1, last);
            for (var y = near.y; y <= far.y; y++) {
                for (var x = near.x; x <= far.x; x++) {
                    let texel = textureLoad(back_positions, vec2i(x, y), 0);
                    if u32(texel.w) == here.profile {
                        let w = weight(distance2(texel.xyz * settings.mm_per_unit, here.mm), v);
                        total += w * textureLoad(back_source, vec2i(x, y), 0);
                    }
                }
            }
        }
    }
    return total;
}

// [LS15] Eq. 11 over both layers: as fs_sum.
@fragment
fn fs_sum_layers(vertex: Vertex) -> @location(0) vec4f {
    let pixel = vec2i(vertex.position.xy);
    let here = point(pixel);
    if here.profile == 0u {
        return vec4f(0.0);
    }
    let g = gaussian(here, vertex.gaussian);
    var total = vec4f(0.0);
    if any(g.rgb != vec3f(0.0)) {
        let m = metric(pixel, here);
        total = front_sum(pixel, here, m, g) + back_sum(pixel, here, m, g.w);
    }
    return with_gaussian(vertex, g, total);
}
