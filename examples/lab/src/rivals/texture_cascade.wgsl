// One blur of the cascade in texture space, along u or along v, as wide as the stretch map says.
// [EL07] d'Eon & Luebke 2007, "Advanced techniques for realistic real-time skin rendering", GPU
// Gems 3, ch. 14.

// σ of this blur.
override sigma_mm: f32;

@group(0) @binding(0) var stretch: texture_2d<f32>;

fn sigma_texels(at: vec2f) -> vec2f {
    return sigma_mm * textureLoad(stretch, vec2i(at), 0).rg;
}

fn is_surface(at: vec2f) -> bool {
    return textureLoad(color, vec2i(at), 0).a > 0.0;
}

@fragment
fn fs_u(@builtin(position) at: vec4f) -> @location(0) vec4f {
    if !is_surface(at.xy) {
        return vec4f(0.0);
    }
    return seven_taps(at.xy, vec2f(sigma_texels(at.xy).x, 0.0));
}

@fragment
fn fs_v(@builtin(position) at: vec4f) -> @location(0) vec4f {
    if !is_surface(at.xy) {
        return vec4f(0.0);
    }
    return seven_taps(at.xy, vec2f(0.0, sigma_texels(at.xy).y));
}
