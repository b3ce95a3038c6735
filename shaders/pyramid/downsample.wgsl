// Half as many pixels each way: those around one of this level, by 1 3 3 1, of one surface only.
// Follows surface.wgsl.
//
// [B81] P. J. Burt, "Fast filter transforms for image processing", 1981: Gaussian pyramids.

@group(0) @binding(7) var finer_light: texture_2d<f32>;
@group(0) @binding(8) var finer_shape: texture_2d<u32>;
@group(0) @binding(12) var linear: sampler;

@fragment
fn fs_downsample(@builtin(position) at: vec4f) -> Surface {
    let pixel = vec2i(at.xy);
    if CLASS == CAREFUL {
        return of_one_surface(pixel, 1.0);
    }
    return of_all(pixel);
}

// The mean of those of two pixels that are skin.
struct OnPlane {
    id: u32,
    z: f32,
    sines: vec2f,
}

fn of_two(pixel: vec2i, first: vec2i, second: vec2i) -> OnPlane {
    let a = textureLoad(finer_shape, 2 * pixel + first, 0).rg;
    let b = textureLoad(finer_shape, 2 * pixel + second, 0).rg;
    // Their shares.
    let is_skin = vec2f(f32(a.x >> 24u != 0u), f32(b.x >> 24u != 0u));
    let w = is_skin / max(is_skin.x + is_skin.y, 1.0);
    let z = w.x * bitcast<f32>(a.y) + w.y * bitcast<f32>(b.y);
    return OnPlane(max(a.x >> 24u, b.x >> 24u), z, w.x * sines_of(a) + w.y * sines_of(b));
}

// All of the pixels are of one surface.
fn of_all(pixel: vec2i) -> Surface {
    // Between two pixels, three quarters on the way to the inner one.
    let texel = 1.0 / vec2f(textureDimensions(finer_light));
    let middle = (2.0 * vec2f(pixel) + 1.0) * texel;
    let off = 0.75 * texel;
    let light = textureSampleLevel(finer_light, linear, middle - off, 0.0)
        + textureSampleLevel(finer_light, linear, middle + vec2f(off.x, -off.y), 0.0)
        + textureSampleLevel(finer_light, linear, middle + vec2f(-off.x, off.y), 0.0)
        + textureSampleLevel(finer_light, linear, middle + off, 0.0);
    // The plane through two that are opposite, where these are skin, is that through all four.
    var on_plane = of_two(pixel, vec2i(0), vec2i(1));
    if on_plane.id == 0u {
        on_plane = of_two(pixel, vec2i(1, 0), vec2i(0, 1));
    }
    if on_plane.id == 0u {
        return Surface(vec4f(0.0), vec2u(0u));
    }
    return Surface(half_floats(0.25 * light), packed(on_plane.id, on_plane.z, on_plane.sines));
}

// The surface is that of the nearest of the four pixels that this one covers; of the farthest where `side` is −1.
fn of_one_surface(pixel: vec2i, side: f32) -> Surface {
    let none = Surface(vec4f(0.0), vec2u(0u));
    let last = vec2i(textureDimensions(finer_shape)) - 1;
    var reference = vec2u(0u);
    var nearest = -3e38;
    for (var i = 0; i < 4; i++) {
        let q = 2 * pixel + vec2i(i & 1, i >> 1u);
        if all(q <= last) {
            let there = textureLoad(finer_shape, q, 0).rg;
            let z = bitcast<f32>(there.y);
            if there.x >> 24u != 0u && side * z > nearest {
                reference = there;
                nearest = side * z;
            }
        }
    }
    let surface = unpacked(reference);
    if surface.id == 0u {
        return none;
    }
    nearest *= side;
    let mm = mm_per_px(nearest);
    let slope2 = dot(surface.tangent, surface.tangent);
    let tolerance = TOLERANCE * max(mm.x, mm.y) * sqrt(1.0 + slope2);
    var light = vec4f(0.0);
    var z = 0.0;
    // Of sines, as they are packed.
    var steps = vec2f(0.0);
    // How z changes over a pixel of the finer level.
    let slope = 0.5 * surface.tangent * mm;
    let per_tolerance = 2.0 / tolerance;
    for (var y = -1; y <= 2; y++) {
        for (var x = -1; x <= 2; x++) {
            let q = 2 * pixel + vec2i(x, y);
            let there = textureLoad(finer_shape, q, 0).rg;
            let e = textureLoad(finer_light, q, 0);
            // At the middle of this level's pixel, as the surface is inclined.
            let z_there = bitcast<f32>(there.y) + dot(slope, 0.5 - vec2f(vec2i(x, y)));
            let is_outer = vec2f(f32(x == -1 || x == 2), f32(y == -1 || y == 2));
            let share = (3.0 - 2.0 * is_outer.x) * (3.0 - 2.0 * is_outer.y) / 64.0;
            let near = saturate(2.0 - per_tolerance * abs(z_there - nearest));
            let is_same = there.x >> 24u == surface.id && all(q >= vec2i(0)) && all(q <= last);
            let w = select(0.0, share * near, is_same);
            light += w * e;
            z += w * e.a * z_there;
            steps += w * e.a * steps_of(there);
        }
    }
    let area = light.a;
    if area <= 0.0 {
        return none;
    }
    return Surface(
        half_floats(light),
        packed(surface.id, z / area, sines_by(steps / area)),
    );
}
