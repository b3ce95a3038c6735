// The models of surface reflection as tables. Behind brdf.wgsl.
//
// [K13] Karis 2013, "Real shading in Unreal Engine 4": directional albedo in two parts.

struct Table {
    // Texels.
    size: vec2f,
    model: u32,
    samples: u32,
    // Of lobes.
    slope: f32,
    f0: f32,
}

@group(0) @binding(0) var<uniform> table: Table;

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    let uv = vec2f(f32((vertex << 1u) & 2u), f32(vertex & 2u));
    return vec4f(uv * 2.0 - 1.0, 0.0, 1.0);
}

// Hammersley's second coordinate.
fn radical_inverse(i: u32) -> f32 {
    return f32(reverseBits(i)) * 2.3283064365386963e-10;
}

// [K13] What a surface reflects of light from everywhere alike: across, by the cosine to the normal; down, by
// the slope; both from 0 to 1. Summed over facets as GGX has them, whose long tails cover all the models.
@fragment
fn fs_albedo(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let n_v = at.x / table.size.x;
    let m = at.y / table.size.y;
    let n = vec3f(0.0, 0.0, 1.0);
    let v = vec3f(sqrt(1.0 - n_v * n_v), 0.0, n_v);
    var sum = vec2f(0.0);
    for (var i = 0u; i < table.samples; i++) {
        let u = (f32(i) + 0.5) / f32(table.samples);
        let phi = 2.0 * PI * radical_inverse(i);
        let cos2 = (1.0 - u) / (1.0 - u * (1.0 - m * m));
        let n_h = sqrt(cos2);
        let across = sqrt(max(1.0 - cos2, 0.0));
        let h = vec3f(across * cos(phi), across * sin(phi), n_h);
        let v_h = dot(v, h);
        let l = 2.0 * v_h * h - v;
        if v_h > 0.0 && l.z > 0.0 {
            let density = ggx(n_h, m) * n_h / (4.0 * v_h);
            let f = facets(table.model, n, l, v, m);
            let share = f.x / max(density, 1e-12);
            sum += share * vec2f(1.0 - f.y, f.y);
        }
    }
    return vec4f(sum / f32(table.samples), 0.0, 1.0);
}

// f_r·cos θᵢ·cos θₒ, the flux that leaves, in the plane of incidence: across, by the angle that it is seen from,
// −90° to 90°; down, of light from 0°, 30°, 60° on the other side.
@fragment
fn fs_lobes(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let seen = (at.x / table.size.x - 0.5) * PI;
    let lit = floor(at.y) * PI / 6.0;
    let v = vec3f(sin(seen), 0.0, cos(seen));
    let l = vec3f(-sin(lit), 0.0, cos(lit));
    let f = facets(table.model, vec3f(0.0, 0.0, 1.0), l, v, table.slope);
    return vec4f(f.x * fresnel(table.model, table.f0, 1.0, f.y) * v.z, 0.0, 0.0, 1.0);
}
