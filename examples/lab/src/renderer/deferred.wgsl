// The lighting pass: irradiance and specular of each pixel, in targets of their own. Behind
// material.wgsl (for the camera) and lighting.wgsl.

@group(3) @binding(0) var albedo: texture_2d<f32>;
@group(3) @binding(1) var normals: texture_2d<f32>;
@group(3) @binding(2) var profile_id: texture_2d<u32>;
@group(3) @binding(3) var depth: texture_2d<f32>;

// How far a background is out of focus, as the slope of facets that would blur it so.
const BACKGROUND_SLOPE: f32 = 0.1;

struct Targets {
    @location(0) irradiance: vec4f,
    @location(1) specular: vec4f,
}

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    let uv = vec2f(f32((vertex << 1u) & 2u), f32(vertex & 2u));
    return vec4f(uv * 2.0 - 1.0, 0.0, 1.0);
}

@fragment
fn fs_lighting(@builtin(position) at: vec4f) -> Targets {
    let pixel = vec2i(at.xy);
    let z = textureLoad(depth, pixel, 0).r;
    let uv = at.xy / vec2f(textureDimensions(depth));
    if z == 0.0 { // reversed depth: nothing there
        if all(lighting.turn == vec2f(0.0)) {
            return Targets(vec4f(0.0), vec4f(0.0));
        }
        let far = camera.inverse_view_projection * vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.5, 1.0);
        let direction = normalize(far.xyz / far.w - camera.eye);
        return Targets(vec4f(0.0), vec4f(from_environment(direction, BACKGROUND_SLOPE), 1.0));
    }
    let p = camera.inverse_view_projection * vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, z, 1.0);
    let world = p.xyz / p.w;
    let normal = normalize((transpose(camera.view) * vec4f(textureLoad(normals, pixel, 0).xyz, 0.0)).xyz);
    let skin = textureLoad(profile_id, pixel, 0).r != 0u;
    let m = select(textureLoad(albedo, pixel, 0).a, lighting.slope, skin);
    let intensity = select(1.0, lighting.specular_intensity, skin);
    let l = lit(world, normal, normalize(camera.eye - world), m, intensity);
    return Targets(vec4f(l.irradiance, 1.0), vec4f(l.specular, 1.0));
}
