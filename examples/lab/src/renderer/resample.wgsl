// From the scattered atlas back onto the screen. Behind material.wgsl.

@group(2) @binding(0) var scattered: texture_2d<f32>;
@group(2) @binding(1) var scattered_sampler: sampler;

// A triangle without area in the atlas has no texel: it keeps the irradiance that is there. A pixel
// at an island's edge takes what is covered of its footprint.
//
// A pixel often covers many texels: the mean of 4 × 4 places in its footprint.
const PLACES = 4;

@fragment
fn fs_resample(in: VertexOut) -> @location(0) vec4f {
    let du = dpdx(in.atlas_uv) / f32(PLACES);
    let dv = dpdy(in.atlas_uv) / f32(PLACES);
    var sum = vec4f(0.0);
    for (var y = 0; y < PLACES; y++) {
        for (var x = 0; x < PLACES; x++) {
            let at = vec2f(f32(x), f32(y)) + 0.5 - 0.5 * f32(PLACES);
            let uv = in.atlas_uv + at.x * du + at.y * dv;
            sum += textureSampleLevel(scattered, scattered_sampler, uv, 0.0);
        }
    }
    if sum.a == 0.0 {
        discard;
    }
    return vec4f(sum.rgb / sum.a, 1.0);
}
