// The surface right behind the visible one, lit as that is. Behind material.wgsl and lighting.wgsl.

@group(3) @binding(0) var visible_depth: texture_2d<f32>;

struct Back {
    @location(0) irradiance: vec4f,
    @location(1) profile_id: u32,
}

// Faces that look away, of which the depth test keeps the nearest; depth is reversed.
@fragment
fn fs_back(in: VertexOut, @builtin(front_facing) front: bool) -> Back {
    let s = surface(in);
    let is_behind = in.clip.z < textureLoad(visible_depth, vec2i(in.clip.xy), 0).r;
    if front || !is_behind || s.alpha < material.alpha_cutoff {
        discard;
    }
    return Back(vec4f(lit(in.world, s.normal, s.normal, 1.0, 0.0).irradiance, 1.0), material.profile_id);
}
