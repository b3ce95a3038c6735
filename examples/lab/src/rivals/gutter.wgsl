// The result of an atlas rival: the sum on the islands, carried 4 texels past them, and the
// irradiance as it was elsewhere. Alpha is the irradiance's.

// Scattered light with 1 in alpha on the islands, all 0 elsewhere.
@group(0) @binding(0) var sum: texture_2d<f32>;
@group(0) @binding(1) var irradiance: texture_2d<f32>;

const GUTTER = 4;

@fragment
fn fs_gutter(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let texel = vec2i(at.xy);
    let before = textureLoad(irradiance, texel, 0);
    let here = textureLoad(sum, texel, 0);
    if here.a > 0.0 {
        return vec4f(here.rgb, before.a);
    }
    let last = vec2i(textureDimensions(sum)) - 1;
    for (var ring = 1; ring <= GUTTER; ring++) {
        var total = vec4f(0.0);
        var count = 0.0;
        for (var y = -ring; y <= ring; y++) {
            // All of the first and last row, the ends of those between.
            let step = select(2 * ring, 1, abs(y) == ring);
            for (var x = -ring; x <= ring; x += step) {
                let q = texel + vec2i(x, y);
                if any(q < vec2i(0)) || any(q > last) {
                    continue;
                }
                let there = textureLoad(sum, q, 0);
                if there.a > 0.0 {
                    total += vec4f(there.rgb, textureLoad(irradiance, q, 0).a);
                    count += 1.0;
                }
            }
        }
        if count > 0.0 {
            return total / count;
        }
    }
    return before;
}
