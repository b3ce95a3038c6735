// Readies an atlas for the cascade: the light with its mask, and the stretch map.
// [EL07] d'Eon & Luebke 2007, "Advanced techniques for realistic real-time skin rendering", GPU
// Gems 3, ch. 14.

@group(0) @binding(2) var irradiance: texture_2d<f32>;

struct Packed {
    // Irradiance where something scatters, with 1 in alpha; all 0 elsewhere.
    @location(0) color: vec4f,
    // Texels a mm, along u and along v.
    @location(1) stretch: vec4f,
}

fn texels_per_mm(tangent: vec3f) -> f32 {
    let mm = length(tangent);
    return select(1.0 / mm, 0.0, mm == 0.0);
}

@fragment
fn fs_pack(@builtin(position) at: vec4f) -> Packed {
    let texel = vec2i(at.xy);
    let here = point(texel);
    if here.profile == 0.0 {
        return Packed(vec4f(0.0), vec4f(0.0));
    }
    let u = texels_per_mm(tangent(texel, vec2i(1, 0), here));
    let v = texels_per_mm(tangent(texel, vec2i(0, 1), here));
    return Packed(vec4f(textureLoad(irradiance, texel, 0).rgb, 1.0), vec4f(u, v, 0.0, 0.0));
}
