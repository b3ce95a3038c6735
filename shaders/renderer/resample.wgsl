// From the scattered atlas back onto the screen. Behind material.wgsl.

@group(2) @binding(0) var scattered: texture_2d<f32>;
@group(2) @binding(1) var scattered_sampler: sampler;

// A pixel often covers many texels: the mean of 4 × 4 places in its footprint.
const PLACES = 4;

@fragment
fn fs_resample(in: VertexOut) -> @location(0) vec4f {
    let du = dpdx(in.atlas_uv) / f32(PLACES);
    let dv = dpdy(in.atlas_uv) / f32(PLACES);
    var sum = vec3f(0.0);
    for (var y = 0; y < PLACES; y++) {
        for (var x = 0; x < PLACES; x++) {
            let at = vec2f(f32(x), f32(y)) + 0.5 - 0.5 * f32(PLACES);
            let uv = in.atlas_uv + at.x * du + at.y * dv;
            sum += textureSampleLevel(scattered, scattered_sampler, uv, 0.0).rgb;
        }
    }
    return vec4f(sum / f32(PLACES * PLACES), 1.0);
}
