// A level of the layer behind, of the one before. A workgroup is a tile of the level. Follows downsample.wgsl,
// whose textures here are of the back.

// As in list_tiles.wgsl and pack_back.wgsl.
@group(0) @binding(9) var<uniform> grids: array<vec4u, GRIDS>;
@group(0) @binding(12) var<storage, read> back_tiles: array<u32>;
@group(0) @binding(13) var halved_light: texture_storage_2d<rgba16float, write>;
@group(0) @binding(14) var halved_shape: texture_storage_2d<rg32uint, write>;

@compute @workgroup_size(TILE, TILE)
fn halve_back(@builtin(global_invocation_id) at: vec3u, @builtin(workgroup_id) tile: vec3u) {
    let grid = grids[firstLeadingBit(u32(level.scale))];
    var halved = Surface(vec4f(0.0), vec2u(0u));
    if back_tiles[grid.z + tile.y * grid.x + tile.x] != 0u {
        // The farthest, as of the frame the nearest: of a closed shape the part that faces the axis most.
        halved = of_one_surface(vec2i(at.xy), -1.0);
    }
    textureStore(halved_light, at.xy, halved.light);
    textureStore(halved_shape, at.xy, vec4u(halved.shape, 0u, 0u));
}
