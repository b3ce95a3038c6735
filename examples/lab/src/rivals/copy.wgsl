// One read and one write a pixel: the unit that the chart measures time in.

@group(0) @binding(0) var irradiance: texture_2d<f32>;

@fragment
fn fs_copy(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return textureLoad(irradiance, vec2i(at.xy), 0);
}
