// The G-buffer. Behind material.wgsl.

struct GBuffer {
    // Linear albedo; the material's Beckmann slope.
    @location(0) albedo: vec4f,
    // View-space normal.
    @location(1) normal: vec4f,
    @location(2) profile_id: u32,
}

@fragment
fn fs_gbuffer(in: VertexOut, @builtin(front_facing) front: bool) -> GBuffer {
    let s = surface(in);
    if s.alpha < material.alpha_cutoff {
        discard;
    }
    let normal = select(-s.normal, s.normal, front);
    return GBuffer(
        vec4f(s.albedo, material.slope),
        vec4f((camera.view * vec4f(normal, 0.0)).xyz, 0.0),
        material.profile_id,
    );
}
