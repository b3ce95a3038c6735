// Half as many pixels each way: those around one of this level, by 1 3 3 1, of one surface only.
// Follows surface.wgsl.
//
// [B81] P. J. Burt, "Fast filter transforms for image processing", 1981: Gaussian pyramids.

@group(0) @binding(7) var finer_light: texture_2d<f32>;
@group(0) @binding(8) var finer_shape: texture_2d<u32>;
@group(0) @binding(12) var linear: sampler;

@fragment
fn fs_halve(@builtin(position) at: vec4f) -> Surface {
    let pixel = vec2i(at.xy);
    if CAREFUL {
        return halved(pixel);
    }
    // Between two pixels, three quarters on the way to the inner one.
    let texel = 1.0 / vec2f(textureDimensions(finer_light));
    let inner = (2.0 * vec2f(pixel) + 1.0 - 0.75) * texel;
    let outer = (2.0 * vec2f(pixel) + 1.0 + 0.75) * texel;
    var light = vec4f(0.0);
    for (var i = 0u; i < 4u; i++) {
        let uv = select(inner, outer, vec2<bool>((i & 1u) == 1u, i > 1u));
        let there = textureSampleLevel(finer_light, linear, uv, 0.0);
        light += 0.25 * there.a * vec4f(there.rgb, 1.0);
    }
    let a = unpacked(textureLoad(finer_shape, 2 * pixel, 0).rg);
    let b = unpacked(textureLoad(finer_shape, 2 * pixel + 1, 0).rg);
    let shape = Shape(a.id, 0.5 * (a.z + b.z), 0.5 * (a.tangent + b.tangent));
    return Surface(half_floats(vec4f(light.rgb / max(light.a, LEAST_AREA), light.a)), packed(shape));
}

// The surface is that of the nearest of the four pixels that this one covers.
fn halved(pixel: vec2i) -> Surface {
    let none = Surface(vec4f(0.0), vec2u(0u));
    let last = vec2i(textureDimensions(finer_shape)) - 1;
    var reference = vec2u(0u);
    var nearest = -3e38;
    for (var i = 0; i < 4; i++) {
        let q = 2 * pixel + vec2i(i & 1, i >> 1u);
        if all(q <= last) {
            let there = textureLoad(finer_shape, q, 0).rg;
            let z = bitcast<f32>(there.y);
            if there.x >> 24u != 0u && z > nearest {
                reference = there;
                nearest = z;
            }
        }
    }
    let surface = unpacked(reference);
    if surface.id == 0u {
        return none;
    }
    let mm = mm_per_px(nearest);
    let slope2 = dot(surface.tangent, surface.tangent);
    let tolerance = TOLERANCE * max(mm.x, mm.y) * sqrt(1.0 + slope2);
    var light = vec4f(0.0);
    var z = 0.0;
    var tangent = vec2f(0.0);
    for (var y = -1; y <= 2; y++) {
        for (var x = -1; x <= 2; x++) {
            let q = 2 * pixel + vec2i(x, y);
            if any(q < vec2i(0)) || any(q > last) {
                continue;
            }
            let there = unpacked(textureLoad(finer_shape, q, 0).rg);
            if there.id != surface.id {
                continue;
            }
            let e = textureLoad(finer_light, q, 0);
            // On its own plane, at the middle of this level's pixel.
            let offset = (0.5 - vec2f(f32(x), f32(y))) * 0.5 * mm;
            let z_there = there.z + dot(there.tangent, offset);
            let is_outer = vec2f(f32(x == -1 || x == 2), f32(y == -1 || y == 2));
            let share = (3.0 - 2.0 * is_outer.x) * (3.0 - 2.0 * is_outer.y) / 64.0;
            let off = (z_there - nearest) / tolerance;
            let w = share * e.a * saturate(2.0 - 2.0 * abs(off));
            light += w * vec4f(e.rgb, 1.0);
            z += w * z_there;
            tangent += w * there.tangent;
        }
    }
    let area = light.a;
    if area <= 0.0 {
        return none;
    }
    return Surface(
        half_floats(vec4f(light.rgb / area, max(area, LEAST_AREA))),
        packed(Shape(surface.id, z / area, tangent / area)),
    );
}
