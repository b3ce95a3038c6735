// Readies a frame for the rivals: linear depth, which their papers take from the G-buffer, and the
// mask. What is not discarded is skin in the stencil, by which all passes behind draw.

@group(0) @binding(1) var irradiance: texture_2d<f32>;
@group(0) @binding(2) var depth: texture_2d<f32>;
@group(0) @binding(3) var profile_id: texture_2d<u32>;

// Both are cleared to 0.
struct Packed {
    // Irradiance where something scatters, with 1 in alpha.
    @location(0) color: vec4f,
    @location(1) surface: u32,
}

@fragment
fn fs_pack(@builtin(position) at: vec4f) -> Packed {
    let pixel = vec2i(at.xy);
    let id = textureLoad(profile_id, pixel, 0).r;
    if id == 0u || id > ID {
        discard;
    }
    let d = textureLoad(depth, pixel, 0).r;
    let below = d * frame[0].z - frame[0].w;
    // Infinitely far away there is no surface.
    if below == 0.0 {
        discard;
    }
    let z_mm = (frame[0].x - d * frame[0].y) / below;
    let light = textureLoad(irradiance, pixel, 0).rgb;
    return Packed(vec4f(light, 1.0), surface_of(-z_mm, id));
}
