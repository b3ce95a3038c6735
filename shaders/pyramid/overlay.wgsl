// What an effect sees of a frame, over the host's own picture. Follows surface.wgsl, host.wgsl and
// list_tiles.wgsl.

// `Show` of src/overlay.rs.
const PX_PER_MM = 0u;
const LEVEL = 1u;
const CLASS_OF_TILE = 2u;

struct Shown {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) show: u32,
}

@vertex
fn vs_overlay(@builtin(vertex_index) vertex: u32, @builtin(instance_index) show: u32) -> Shown {
    let uv = vec2f(f32((vertex << 1u) & 2u), f32(vertex & 2u));
    return Shown(vec4f(uv * 2.0 - 1.0, 0.0, 1.0), show);
}

// From dark blue over cyan, green and yellow to red.
fn heat(t: f32) -> vec3f {
    let x = 4.0 * saturate(t);
    return saturate(vec3f(x - 2.0, min(x, 4.0 - x), 2.0 - x)) * select(1.0, 0.5 + 0.5 * x, x < 1.0);
}

@fragment
fn fs_overlay(shown: Shown) -> @location(0) vec4f {
    let pixel = vec2i(shown.position.xy) - vec2i(view.first_pixel);
    let here = host_surface(pixel);
    if here.id == 0u {
        discard;
    }
    let is_skin = here.id <= view.profiles;
    var color = select(vec3f(1.0, 0.0, 1.0), vec3f(0.0, 0.6, 0.0), is_skin);
    let mm = abs(view.step.xy * here.z + view.step.zw);
    if shown.show == PX_PER_MM {
        // Bands of two octaves, each in two tones.
        let octaves = -log2(max(mm.x, mm.y));
        let band = clamp(floor(0.5 * octaves + 2.0), 0.0, 4.0);
        color = heat(0.25 * band) * select(0.75, 1.0, fract(0.5 * octaves) < 0.5);
    } else if !is_skin {
        discard;
    } else if shown.show == LEVEL {
        color = heat(f32(coarsest_level(here.z, here.id)) / 8.0);
    } else if shown.show == CLASS_OF_TILE {
        let kind = class_of(vec2i(pixel) / i32(TILE), 0u);
        color = select(vec3f(0.9, 0.0, 0.0), vec3f(0.0, 0.6, 0.0), kind == PLANAR);
    }
    return vec4f(color, 0.6);
}
