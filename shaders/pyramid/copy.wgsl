// What the frame was, for all that does not scatter. Follows surface.wgsl.

@group(0) @binding(4) var irradiance: texture_2d<f32>;
// What multiplies what is added to a target.
@group(0) @binding(5) var albedo: texture_2d<f32>;

@vertex
fn vs_frame(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    let uv = vec2f(f32((vertex << 1u) & 2u), f32(vertex & 2u));
    return vec4f(uv * 2.0 - 1.0, 0.0, 1.0);
}

@fragment
fn fs_copy(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let e = textureLoad(irradiance, vec2i(at.xy), 0);
    if view.has_albedo == 0u {
        return e;
    }
    return vec4f(e.rgb * textureLoad(albedo, vec2i(at.xy), 0).rgb, e.a);
}
