// What the frame was, where nothing scatters: over tiles of level 1, but for those that are all skin. Follows
// surface.wgsl and list_tiles.wgsl.

@group(0) @binding(4) var irradiance: texture_2d<f32>;
// What multiplies what is added to a target.
@group(0) @binding(5) var albedo: texture_2d<f32>;
@group(0) @binding(8) var here_shape: texture_2d<u32>;

struct Copied {
    @builtin(position) at: vec4f,
    // Whether there is skin, too.
    @location(0) @interpolate(flat) mixes: u32,
}

@vertex
fn vs_copy(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Copied {
    let grid = grids[1];
    let tile = vec2u(instance % grid.x, instance / grid.x);
    let marks = contents_of(grid, vec2i(tile)).marks;
    let uv = vec2f((tile + corner_of(vertex)) * 2u * TILE) / vec2f(view.size);
    var at = vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.0, 1.0);
    if (marks & NOT_SKIN) == 0u {
        // Nothing.
        at = vec4f(0.0);
    }
    return Copied(at, u32((marks & PROFILES) != 0u));
}

@fragment
fn fs_copy(tile: Copied) -> @location(0) vec4f {
    let at = vec2i(tile.at.xy);
    if tile.mixes != 0u && textureLoad(here_shape, at - vec2i(view.first_pixel), 0).r >> 24u != 0u {
        discard;
    }
    let e = textureLoad(irradiance, at, 0);
    if view.has_albedo == 0u {
        return e;
    }
    return vec4f(e.rgb * textureLoad(albedo, at, 0).rgb, e.a);
}
