// Readies a frame for the rivals: linear depth, which their papers take from the G-buffer, and the
// mask, which is their papers' stencil.

@group(0) @binding(1) var irradiance: texture_2d<f32>;
@group(0) @binding(2) var depth: texture_2d<f32>;
@group(0) @binding(3) var profile_id: texture_2d<u32>;

struct Packed {
    // Irradiance where something scatters, with 1 in alpha; all 0 elsewhere.
    @location(0) color: vec4f,
    @location(1) surface: u32,
    // For methods that add onto the irradiance: as it was.
    @location(2) irradiance: vec4f,
}

fn pack(pixel: vec2i, color: vec4f) -> Packed {
    let id = textureLoad(profile_id, pixel, 0).r;
    if id == 0u || id > ID {
        return Packed(vec4f(0.0), 0u, color);
    }
    let d = textureLoad(depth, pixel, 0).r;
    let below = d * frame[0].z - frame[0].w;
    // Infinitely far away there is no surface.
    if below == 0.0 {
        return Packed(vec4f(0.0), 0u, color);
    }
    let z_mm = (frame[0].x - d * frame[0].y) / below;
    return Packed(vec4f(color.rgb, 1.0), surface_of(-z_mm, id), color);
}

@fragment
fn fs_pack(@builtin(position) at: vec4f) -> Packed {
    let pixel = vec2i(at.xy);
    return pack(pixel, textureLoad(irradiance, pixel, 0));
}
