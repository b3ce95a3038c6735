// Readies an atlas for the full convolution.

@group(0) @binding(2) var irradiance: texture_2d<f32>;

// E·A and A, a texel's irradiance times its area in mm², and that area.
@fragment
fn fs_source(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let texel = vec2i(at.xy);
    let here = point(texel);
    if here.profile == 0.0 {
        return vec4f(0.0);
    }
    let u = tangent(texel, vec2i(1, 0), here);
    let v = tangent(texel, vec2i(0, 1), here);
    let area = length(cross(u, v));
    return vec4f(textureLoad(irradiance, texel, 0).rgb * area, area);
}
