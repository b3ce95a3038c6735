// The final pass: albedo times scattered irradiance, plus specular, tone-mapped. The target's
// format encodes to sRGB.
//
// [K24] Khronos PBR Neutral tone mapper, 2024: keeps hue and the colors below the shoulder.

struct Compose {
    exposure: f32,
    // 1: the diffuse layer alone, without albedo.
    layer: u32,
}

@group(0) @binding(0) var<uniform> compose: Compose;
@group(0) @binding(1) var diffuse: texture_2d<f32>;
@group(0) @binding(2) var albedo: texture_2d<f32>;
@group(0) @binding(3) var specular: texture_2d<f32>;
@group(0) @binding(4) var depth: texture_2d<f32>;

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    let uv = vec2f(f32((vertex << 1u) & 2u), f32(vertex & 2u));
    return vec4f(uv * 2.0 - 1.0, 0.0, 1.0);
}

fn tone_map(color_in: vec3f) -> vec3f {
    const START = 0.8 - 0.04;
    const DESATURATION = 0.15;
    let least = min(color_in.r, min(color_in.g, color_in.b));
    let offset = select(0.04, least - 6.25 * least * least, least < 0.08);
    let color = color_in - offset;
    let peak = max(color.r, max(color.g, color.b));
    if peak < START {
        return color;
    }
    const D = 1.0 - START;
    let new_peak = 1.0 - D * D / (peak + D - START);
    let g = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    return mix(color * new_peak / peak, vec3f(new_peak), g);
}

@fragment
fn fs_compose(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    if textureLoad(depth, pixel, 0).r == 0.0 {
        // The environment, where there is one.
        let background = textureLoad(specular, pixel, 0);
        if background.a > 0.0 {
            return vec4f(tone_map(background.rgb * compose.exposure), 1.0);
        }
        let uv = at.xy / vec2f(textureDimensions(depth));
        let vignette = distance(uv, vec2f(0.45, 0.4));
        return vec4f(mix(vec3f(0.065, 0.068, 0.075), vec3f(0.018, 0.019, 0.022), vignette), 1.0);
    }
    let e = textureLoad(diffuse, pixel, 0).rgb;
    if compose.layer == 1u {
        return vec4f(tone_map(e * compose.exposure), 1.0);
    }
    let radiance = textureLoad(albedo, pixel, 0).rgb * e + textureLoad(specular, pixel, 0).rgb;
    return vec4f(tone_map(radiance * compose.exposure), 1.0);
}
