// What every draw of a mesh shares: the camera, the vertex, and the material at a point.
//
// The procedural skin stands in for textures on heads that come with masks instead: lips, redness
// of cheeks, nose and ears, brows, pores.

struct Camera {
    view: mat4x4f,
    view_projection: mat4x4f,
    inverse_view_projection: mat4x4f,
    eye: vec3f,
    mm_per_unit: f32,
}

struct Material {
    base_color: vec4f,
    normal_scale: f32,
    alpha_cutoff: f32,
    // Beckmann slope m of what does not scatter; of skin, the host says it.
    slope: f32,
    profile_id: u32,
    procedural: u32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(1) @binding(0) var<uniform> material: Material;
@group(1) @binding(1) var base_color_map: texture_2d<f32>;
@group(1) @binding(2) var normal_map: texture_2d<f32>;
@group(1) @binding(3) var material_sampler: sampler;

struct VertexIn {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uv: vec2f,
    @location(4) atlas_uv: vec2f,
    @location(5) mask: vec4f,
    @location(6) color: vec4f,
}

struct VertexOut {
    @builtin(position) @invariant clip: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uv: vec2f,
    @location(4) atlas_uv: vec2f,
    @location(5) mask: vec4f,
    @location(6) color: vec4f,
}

fn vertex_at(in: VertexIn, clip: vec4f) -> VertexOut {
    return VertexOut(clip, in.position, in.normal, in.tangent, in.uv, in.atlas_uv, in.mask, in.color);
}

@vertex
fn vs_screen(in: VertexIn) -> VertexOut {
    return vertex_at(in, camera.view_projection * vec4f(in.position, 1.0));
}

struct Surface {
    albedo: vec3f,
    alpha: f32,
    normal: vec3f,
}

fn hash(cell: vec3i) -> vec3f {
    // PCG in three dimensions (Jarzynski & Olano 2020, "Hash functions for GPU rendering").
    var v = bitcast<vec3u>(cell) * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> vec3u(16u);
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return vec3f(v >> vec3u(8u)) / 16777216.0;
}

// Value noise in 0..1 and its gradient.
fn noise(p: vec3f) -> vec4f {
    let cell = vec3i(floor(p));
    let f = p - floor(p);
    let u = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let du = 30.0 * f * f * (f * (f - 2.0) + 1.0);
    var value = 0.0;
    var gradient = vec3f(0.0);
    for (var i = 0; i < 8; i++) {
        let corner = vec3i(i & 1, (i >> 1u) & 1, (i >> 2u) & 1);
        let h = hash(cell + corner).x;
        let s = vec3f(corner);
        let w = mix(1.0 - u, u, s);
        let dw = (2.0 * s - 1.0) * du;
        value += h * w.x * w.y * w.z;
        gradient += h * vec3f(dw.x * w.y * w.z, w.x * dw.y * w.z, w.x * w.y * dw.z);
    }
    return vec4f(gradient, value);
}

// How much of a detail of this size is left when a pixel is `footprint` wide; all in mm.
fn resolved(size: f32, footprint: f32) -> f32 {
    return 1.0 - smoothstep(0.35, 0.7, footprint / size);
}

// Small dark discs, at most one in a cell of the given size: freckles, in 0..1.
fn freckles(mm: vec3f, cell_mm: f32) -> f32 {
    let p = mm / cell_mm;
    var dark = 0.0;
    for (var i = 0; i < 27; i++) {
        let cell = vec3i(floor(p)) + vec3i(i % 3, (i / 3) % 3, i / 9) - 1;
        let h = hash(cell);
        let radius = 0.10 + 0.22 * h.z * h.z;
        let center = vec3f(cell) + 0.25 + 0.5 * hash(cell + 1031);
        let d = distance(p, center) / radius;
        dark = max(dark, (1.0 - smoothstep(0.4, 1.0, d)) * step(0.45, h.x) * (0.4 + 0.6 * h.y));
    }
    return dark;
}

fn procedural_skin(mm: vec3f, mask: vec4f, base: vec3f, footprint: f32) -> vec3f {
    let blotch = 0.6 * noise(mm / 14.0).w + 0.4 * noise(mm / 5.0).w - 0.5;
    let mottle = (noise(mm / 1.7).w - 0.5) * resolved(1.7, footprint);
    var color = base * (1.0 + vec3f(0.05, 0.13, 0.15) * blotch + vec3f(0.03, 0.07, 0.08) * mottle);
    // Blood under thin skin takes green and blue.
    let redness = mask.y * (0.75 + 0.5 * blotch);
    color *= mix(vec3f(1.0), vec3f(0.96, 0.73, 0.72), redness);
    let spots = freckles(mm, 3.4) * resolved(0.9, footprint) * smoothstep(0.05, 0.6, mask.y);
    color *= mix(vec3f(1.0), vec3f(0.74, 0.56, 0.46), 0.55 * spots * (1.0 - mask.x));
    let lips = base * vec3f(0.80, 0.47, 0.50) * (1.0 + 0.25 * blotch);
    color = mix(color, lips, mask.x);
    return mix(color, vec3f(0.055, 0.036, 0.026), 0.9 * mask.z);
}

// Slope of the pores and fine creases: the gradient of a height field, dimensionless.
fn pores(mm: vec3f, footprint: f32) -> vec3f {
    let fine = noise(mm / 0.55);
    let coarse = noise(mm / 1.3 + 7.0);
    // Dimples rather than bumps: the darkest third of the noise goes in.
    let dimple = fine.xyz * (1.0 - smoothstep(0.30, 0.55, fine.w));
    return 0.085 * dimple * resolved(0.55 * 2.0, footprint)
        + 0.05 * coarse.xyz * resolved(1.3 * 2.0, footprint);
}

// What a pixel covers of the surface, each way.
struct Footprint {
    // Geometric mean of its sides, in mm.
    mm: f32,
    // Its sides in the textures.
    duv_dx: vec2f,
    duv_dy: vec2f,
}

fn surface(in: VertexOut) -> Surface {
    let mm = in.world * camera.mm_per_unit;
    let footprint = sqrt(length(dpdx(mm)) * length(dpdy(mm)));
    return surface_over(in, Footprint(footprint, dpdx(in.uv), dpdy(in.uv)));
}

fn surface_over(in: VertexOut, footprint: Footprint) -> Surface {
    let dx = footprint.duv_dx;
    let dy = footprint.duv_dy;
    let base = material.base_color * in.color
        * textureSampleGrad(base_color_map, material_sampler, in.uv, dx, dy);
    let mapped = textureSampleGrad(normal_map, material_sampler, in.uv, dx, dy).xyz * 2.0 - 1.0;
    let mm = in.world * camera.mm_per_unit;

    let n = normalize(in.normal);
    let t = normalize(in.tangent.xyz - n * dot(n, in.tangent.xyz) + vec3f(1e-10));
    let b = cross(n, t) * in.tangent.w;
    var normal = normalize(
        t * mapped.x * material.normal_scale + b * mapped.y * material.normal_scale + n * mapped.z,
    );
    var albedo = base.rgb;
    if material.procedural != 0u {
        albedo = procedural_skin(mm, in.mask, albedo, footprint.mm);
        let slope = pores(mm, footprint.mm) * in.mask.w;
        normal = normalize(normal - (slope - normal * dot(normal, slope)));
    }
    return Surface(albedo, base.a, normal);
}
