// Where a host's frame has a surface, and how coarsely it is blurred there. Follows surface.wgsl.

// The first vector of a row of weights has the coarsest level in w, the second which id stands for the profile:
// ids of equal profiles are one.
@group(0) @binding(3) var<storage, read> weights: array<vec4f>;
@group(0) @binding(5) var depth: texture_2d<f32>;
@group(0) @binding(6) var profile_id: texture_2d<u32>;

fn z_of(d: f32) -> f32 {
    let c = view.depth_to_mm;
    return (c.x * d + c.y) / (c.z * d + c.w);
}

fn z_at(pixel: vec2i) -> f32 {
    return z_of(textureLoad(depth, vec2i(view.first_pixel) + pixel, 0).r);
}

struct HostSurface {
    // As the host has it; 0 where there is no surface.
    id: u32,
    // In mm, negative.
    z: f32,
}

fn host_surface(pixel: vec2i) -> HostSurface {
    let pixel_of_host = vec2i(view.first_pixel) + pixel;
    var id = 1u;
    if view.has_id != 0u {
        id = textureLoad(profile_id, pixel_of_host, 0).r;
    }
    let d = textureLoad(depth, pixel_of_host, 0).r;
    let z = z_of(d);
    // Infinitely far away there is no surface, nor where the depth is NaN.
    let is_surface = abs(z) < 3e38 && d != view.far;
    return HostSurface(select(0u, id, is_surface), z);
}

// Where the weights of a profile begin.
fn first_weight(id: u32) -> u32 {
    if ONE_PROFILE {
        return 0u;
    }
    return (id - 1u) * (view.rows * view.stride);
}

// The id that stands for all of equal profiles.
fn stand_in(id: u32) -> u32 {
    if ONE_PROFILE {
        return 1u;
    }
    return u32(weights[first_weight(id) + 1u].w);
}

// The coarsest level that a pixel at z of a profile is blurred at.
fn coarsest_level(z: f32, id: u32) -> u32 {
    let mm = abs(view.step.xy * z + view.step.zw);
    // A slope is blurred at finer levels than a surface that faces the camera; what is narrower
    // across a ray, or in a pixel that is not square, by less than two rows at coarser ones.
    let row = ceil((-log2(max(mm.x, mm.y)) - view.first_octave) * ROWS_PER_OCTAVE) + 2.0;
    let i = u32(clamp(row, 0.0, f32(view.rows - 1u)));
    return u32(weights[first_weight(id) + i * view.stride].w);
}
