// View-space positions from a host's depth buffer: what turns a frame into a surface.
// Any projection is undone by its inverse: perspective or orthographic, forward, reversed or
// infinite depth, off-centre.

struct Settings {
    // Normalised device coordinates to view space, in mm.
    inverse_projection: mat4x4f,
    // Of the viewport, in the textures.
    first_pixel: vec2u,
    size: vec2f,
    // The depth at which there is no surface.
    far: f32,
    // 0: all of the surface is of the first profile.
    has_id: u32,
    // Which id comes first of those of an equal profile, so that light crosses from the one to the other: four
    // bits for each id from 1 on, of what is counted from 0. Others stay what they are.
    first_ids: vec2u,
}

const MAX_PROFILES = 16u;

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var depth: texture_2d<f32>;
@group(0) @binding(2) var profile_id: texture_2d<u32>;

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    let uv = vec2f(f32((vertex << 1u) & 2u), f32(vertex & 2u));
    return vec4f(uv * 2.0 - 1.0, 0.0, 1.0);
}

// Position in mm, and the first id of the profile; zero where nothing scatters.
@fragment
fn fs_positions(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy) + vec2i(settings.first_pixel);
    // No branch on a uniform: lavapipe 22.3 grows by 0.4 MiB a frame with one here, as it compiles anew.
    var id = select(1u, textureLoad(profile_id, pixel, 0).r, settings.has_id != 0u);
    let d = textureLoad(depth, pixel, 0).r;
    if id == 0u || d == settings.far {
        return vec4f(0.0);
    }
    let i = id - 1u;
    if i < MAX_PROFILES {
        let bits = select(settings.first_ids.x, settings.first_ids.y, i >= 8u);
        id = 1u + ((bits >> (4u * (i % 8u))) & 15u);
    }
    let uv = at.xy / settings.size;
    let p = settings.inverse_projection * vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, d, 1.0);
    // Infinitely far away there is no surface, nor where the depth is no number.
    if !(abs(p.z) < 3e38 * abs(p.w)) {
        return vec4f(0.0);
    }
    return vec4f(p.xyz / p.w, f32(id));
}
