// The surface that each pixel shows, and the light on any place of a surface. Behind material.wgsl
// and lighting.wgsl.

// A place a texel: world position and footprint in mm; normal and footprint in the textures;
// tangent; texture coordinates; mask; color.
@group(3) @binding(0) var places: texture_2d_array<f32>;

// What a pixel shows: its position, in mm.
@fragment
fn fs_position(in: VertexOut) -> @location(0) vec4f {
    return vec4f(in.world * camera.mm_per_unit, 0.0);
}

struct Steps {
    @location(0) x: vec4f,
    @location(1) y: vec4f,
}

// And the way on it to where the next pixel in the row, and in the column, looks, in mm.
@fragment
fn fs_steps(in: VertexOut) -> Steps {
    let mm = in.world * camera.mm_per_unit;
    return Steps(vec4f(dpdx(mm), 0.0), vec4f(dpdy(mm), 0.0));
}

@vertex
fn vs_probe(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    let uv = vec2f(f32((vertex << 1u) & 2u), f32(vertex & 2u));
    return vec4f(uv * 2.0 - 1.0, 0.0, 1.0);
}

@fragment
fn fs_irradiance(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let texel = vec2i(at.xy);
    let position = textureLoad(places, texel, 0, 0);
    let normal = textureLoad(places, texel, 1, 0);
    let in = VertexOut(
        vec4f(0.0),
        position.xyz,
        normal.xyz,
        textureLoad(places, texel, 2, 0),
        textureLoad(places, texel, 3, 0).xy,
        vec2f(0.0),
        textureLoad(places, texel, 4, 0),
        textureLoad(places, texel, 5, 0),
    );
    let footprint = Footprint(position.w, vec2f(normal.w, 0.0), vec2f(0.0, normal.w));
    let s = surface_over(in, footprint);
    return vec4f(lit(in.world, s.normal, s.normal, 1.0, 0.0).irradiance, 1.0);
}
