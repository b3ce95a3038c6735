// What may be wrong with a host's light, and what its normals say, where it has any. Both effects follow
// this.

// Whether light is a number. By its bits, since compilers may take for granted that it is.
fn is_finite(light: vec3f) -> bool {
    return all((bitcast<vec3u>(light) & vec3u(0x7f800000u)) != vec3u(0x7f800000u));
}

// Normals of a host.
struct Normals {
    // 0: there are none. First, as in View of surface.wgsl.
    has: u32,
    // x·n + y has -1 to 1.
    decode: vec2f,
    to_view: mat3x3f,
}

// How z grows with a step of a pixel along a row and along a column, by the normal: 0 = n·∂p, where a
// step is `mm` at the same z, and p.xy grows by `ray` for one of z. Whether it tells.
struct Slope {
    dz: vec2f,
    is_known: bool,
}

fn slope_by_normal(normals: Normals, texel: vec3f, ray: vec2f, mm: vec2f) -> Slope {
    let n = normals.to_view * (normals.decode.x * texel + normals.decode.y);
    let along_ray = dot(n, vec3f(ray, 1.0));
    // Seen from 87° and more a normal says no more than that.
    let is_known = dot(n, n) > 0.01
        && along_ray * along_ray > 0.0025 * dot(n, n) * (1.0 + dot(ray, ray));
    return Slope(-n.xy * mm / select(1.0, along_ray, is_known), is_known);
}
