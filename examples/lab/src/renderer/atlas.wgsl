// A mesh in its own UV space: irradiance and position of each texel, and the way back onto the
// screen. Behind texture_space.wgsl, material.wgsl and lighting.wgsl.

@vertex
fn vs_atlas(in: VertexIn) -> VertexOut {
    return vertex_at(in, atlas_position(in.atlas_uv));
}

struct Atlas {
    @location(0) irradiance: vec4f,
    // World position and profile id.
    @location(1) position: vec4f,
}

@fragment
fn fs_atlas(in: VertexOut) -> Atlas {
    let s = surface(in);
    if s.alpha < material.alpha_cutoff {
        discard;
    }
    // Irradiance does not depend on the eye.
    let l = lit(in.world, s.normal, s.normal, 1.0, 0.0);
    return Atlas(vec4f(l.irradiance, 1.0), vec4f(in.world, f32(material.profile_id)));
}
