// Light from behind as engines add it: the far side's, times what a slab of this thickness passes.
// Jimenez, Whelan, Sundstedt, Gutierrez 2010, "Real-time realistic skin translucency", IEEE CG&A 30(4).
// Burley 2015, "Extending the Disney BRDF to a BSDF with integrated subsurface scattering", as Unity's High
// Definition Render Pipeline has it.
//
// Behind this text stands `transmittance`, of a thickness in mm.

@group(0) @binding(1) var depth: texture_2d<f32>;
@group(0) @binding(2) var profile_id: texture_2d<u32>;
@group(0) @binding(3) var back_irradiance: texture_2d<f32>;
@group(0) @binding(4) var back_depth: texture_2d<f32>;

fn z_mm(d: f32) -> f32 {
    return (frame[0].x - d * frame[0].y) / (d * frame[0].z - frame[0].w);
}

@fragment
fn fs_transmission(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let behind = textureLoad(back_depth, pixel, 0).r;
    // The far plane: nothing.
    if textureLoad(profile_id, pixel, 0).r == 0u || behind == 0.0 {
        discard;
    }
    let thickness_mm = abs(z_mm(textureLoad(depth, pixel, 0).r) - z_mm(behind));
    return vec4f(textureLoad(back_irradiance, pixel, 0).rgb * transmittance(thickness_mm), 0.0);
}
