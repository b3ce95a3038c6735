// Two passes of one kernel with a weight for each colour.
// Jimenez, Zsolnai, Jarabo et al. 2015, "Separable subsurface scattering", Computer Graphics Forum
// 34(6), and the depth test of the authors' demo (2012).
//
// Behind this text stand `MM_SATURATES` and the taps, written out.

@group(0) @binding(1) var color: texture_2d<f32>;
@group(0) @binding(2) var linear: sampler;
@group(0) @binding(3) var surfaces: texture_2d<u32>;
@group(0) @binding(4) var irradiance: texture_2d<f32>;

struct Center {
    // In pixels.
    at: vec2f,
    // The step of one mm along the pass, in pixels.
    px_per_mm: vec2f,
    size: vec2f,
    surface: u32,
    color: vec3f,
}

// Light at `offset_mm` from the center, drawn to the center's own by the difference in depth; all
// the way where the tap lands on no surface or on that of another profile.
fn tap(center: Center, offset_mm: f32) -> vec3f {
    let at = center.at + offset_mm * center.px_per_mm;
    let found = textureSampleLevel(color, linear, at / center.size, 0.0);
    let pixel = vec2i(clamp(at, vec2f(0.0), center.size - 1.0));
    let surface = textureLoad(surfaces, pixel, 0).r;
    let apart_mm = abs(depth_mm(surface) - depth_mm(center.surface));
    let same = (surface & ID) == (center.surface & ID);
    let s = select(1.0, saturate(apart_mm / MM_SATURATES), same);
    // What a bilinear tap misses beside the surface is the center's.
    let light = found.rgb + (1.0 - found.a) * center.color;
    return mix(light, center.color, s);
}

fn blur(at: vec2f, surface: u32, axis: vec2f) -> vec3f {
    let here = textureLoad(color, vec2i(at), 0).rgb;
    let size = vec2f(textureDimensions(color));
    return taps(Center(at, axis / mm_per_px(surface), size, surface, here));
}

@fragment
fn fs_rows(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let surface = textureLoad(surfaces, vec2i(at.xy), 0).r;
    return vec4f(blur(at.xy, surface, vec2f(1.0, 0.0)), 1.0);
}

@fragment
fn fs_columns(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let before = textureLoad(irradiance, vec2i(at.xy), 0);
    let surface = textureLoad(surfaces, vec2i(at.xy), 0).r;
    return vec4f(blur(at.xy, surface, vec2f(0.0, 1.0)), before.a);
}

