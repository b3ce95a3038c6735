// The unit Gaussian in seven taps, a σ apart: its integral over each tap's cell.
// [EL07] d'Eon & Luebke 2007, "Advanced techniques for realistic real-time skin rendering", GPU
// Gems 3, ch. 14; Jimenez et al. 2009 take it from there.

// Light with 1 in alpha where something scatters, all 0 elsewhere.
@group(0) @binding(1) var color: texture_2d<f32>;
@group(0) @binding(2) var linear: sampler;

fn pair(at: vec2f, step: vec2f, size: vec2f) -> vec4f {
    return textureSampleLevel(color, linear, (at + step) / size, 0.0)
        + textureSampleLevel(color, linear, (at - step) / size, 0.0);
}

// `sigma` in pixels along the pass. What lies beside the surface has no part in it: the papers'
// stencil.
fn seven_taps(at: vec2f, sigma: vec2f) -> vec4f {
    let size = vec2f(textureDimensions(color));
    let sum = 0.382 * textureLoad(color, vec2i(at), 0)
        + 0.242 * pair(at, sigma, size)
        + 0.061 * pair(at, 2.0 * sigma, size)
        + 0.006 * pair(at, 3.0 * sigma, size);
    return vec4f(sum.rgb / sum.a, 1.0);
}

