// The blurs of a level on planar tiles: of one profile, and hardly bent or hardly of different light. What
// taps weigh is found at the corners of a tile, all blurs in one, and lies evenly between. Follows blur.wgsl.

// What the taps (i, j) and (−i, −j) weigh together in all blurs. In the last components, the weight of
// all coarser levels, then the steps of the lattice.
struct Corner {
    @builtin(position) at: vec4f,
    @location(0) @interpolate(linear) k00: vec4f,
    @location(1) @interpolate(linear) k10: vec4f,
    @location(2) @interpolate(linear) k01: vec4f,
    @location(3) @interpolate(linear) k11: vec4f,
    @location(4) @interpolate(linear) k1m: vec4f,
    @location(5) @interpolate(linear) k20: vec4f,
    @location(6) @interpolate(linear) k02: vec4f,
    @location(7) @interpolate(linear) k21: vec4f,
    @location(8) @interpolate(linear) k2m: vec4f,
    @location(9) @interpolate(linear) k12: vec4f,
    @location(10) @interpolate(linear) km2: vec4f,
    @location(11) @interpolate(linear) k22: vec4f,
    @location(12) @interpolate(linear) k2n: vec4f,
}

fn shape_at(pixel: vec2i) -> vec2u {
    return textureLoad(here_shape, clamp(pixel, vec2i(0), vec2i(level.size) - 1), 0).rg;
}

// A pixel of skin of a tile, as near as may be to one of the tile or beside it.
fn skin_near(pixel: vec2i, tile: vec2u) -> vec2i {
    if shape_at(pixel).x >> 24u != 0u {
        return pixel;
    }
    let first = vec2i(tile * TILE);
    var nearest = pixel;
    var least = 1 << 20u;
    for (var i = 0; i < i32(TILE * TILE); i++) {
        let there = first + vec2i(i & 7, i >> 3u);
        let off = there - pixel;
        let distance2 = dot(off, off);
        if distance2 < least && shape_at(there).x >> 24u != 0u {
            nearest = there;
            least = distance2;
        }
    }
    return nearest;
}

@vertex
fn vs_corner(
    @builtin(vertex_index) vertex: u32,
    @builtin(instance_index) instance: u32,
) -> Corner {
    let tile = tile_of(instance);
    // One lattice for the whole tile.
    let middle = skin_near(vec2i(tile * TILE + TILE / 2u), tile);
    let in_middle = shape_at(middle);
    let lattice = scale_of(plane_of(middle, unpacked(in_middle)).m, in_middle.x >> 24u).lattice;
    let corner = skin_near(vec2i((tile + corner_of(vertex)) * TILE), tile);
    let shape = shape_at(corner);
    let plane = plane_of(corner, unpacked(shape));
    let scale = scale_of(plane.m, in_middle.x >> 24u);
    let blurs = blurs_at(plane, scale, lattice);
    let rest = rest_at(scale);
    var out = Corner();
    out.at = on_screen(tile, vertex);
    out.k00 = vec4f(blurs.colors * vec4f(1.0), rest.r);
    out.k10 = vec4f(blurs.colors * weights_at(blurs, 1, 0), rest.g);
    out.k01 = vec4f(blurs.colors * weights_at(blurs, 0, 1), rest.b);
    out.k11 = vec4f(blurs.colors * weights_at(blurs, 1, 1), f32(lattice.u.x));
    out.k1m = vec4f(blurs.colors * weights_at(blurs, 1, -1), f32(lattice.u.y));
    out.k20 = vec4f(blurs.colors * weights_at(blurs, 2, 0), f32(lattice.v.x));
    out.k02 = vec4f(blurs.colors * weights_at(blurs, 0, 2), f32(lattice.v.y));
    out.k21 = vec4f(blurs.colors[3] * square_weight_at(blurs, 2, 1), blurs.wanted.r);
    out.k2m = vec4f(blurs.colors[3] * square_weight_at(blurs, 2, -1), blurs.wanted.g);
    out.k12 = vec4f(blurs.colors[3] * square_weight_at(blurs, 1, 2), blurs.wanted.b);
    out.km2 = vec4f(blurs.colors[3] * square_weight_at(blurs, -1, 2), f32(blurs.has_square));
    out.k22 = vec4f(blurs.colors[3] * square_weight_at(blurs, 2, 2), 0.0);
    out.k2n = vec4f(blurs.colors[3] * square_weight_at(blurs, 2, -2), 0.0);
    return out;
}

// Light by what it weighs, and what it weighs.
var<private> light: vec3f;
var<private> mass: vec3f;

fn pair(pixel: vec2i, offset: vec2i, k: vec3f) {
    let both = textureLoad(here_light, pixel + offset, 0) + textureLoad(here_light, pixel - offset, 0);
    light += k * both.rgb;
    mass += k * both.a;
}

fn gathered(pixel: vec2i, here: vec4f, e: vec3f, tile: Corner) -> Gathered {
    let u = vec2i(round(vec2f(tile.k11.a, tile.k1m.a)));
    let v = vec2i(round(vec2f(tile.k20.a, tile.k02.a)));
    light = tile.k00.rgb * here.rgb;
    mass = tile.k00.rgb * here.a;
    pair(pixel, u, tile.k10.rgb);
    pair(pixel, v, tile.k01.rgb);
    pair(pixel, u + v, tile.k11.rgb);
    pair(pixel, u - v, tile.k1m.rgb);
    if THIRTEEN {
        pair(pixel, 2 * u, tile.k20.rgb);
        pair(pixel, 2 * v, tile.k02.rgb);
    }
    if SQUARE {
        if tile.km2.a > 0.0 {
            pair(pixel, 2 * u + v, tile.k21.rgb);
            pair(pixel, 2 * u - v, tile.k2m.rgb);
            pair(pixel, u + 2 * v, tile.k12.rgb);
            pair(pixel, 2 * v - u, tile.km2.rgb);
            pair(pixel, 2 * u + 2 * v, tile.k22.rgb);
            pair(pixel, 2 * u - 2 * v, tile.k2n.rgb);
        }
    }
    let wanted = vec3f(tile.k21.a, tile.k2m.a, tile.k12.a);
    let blurred = blurred_by(light, mass, wanted, e);
    let rest = vec3f(tile.k00.a, tile.k10.a, tile.k01.a);
    // The texture may be larger than the level.
    let uv = (vec2f(pixel) + 0.5) / (2.0 * vec2f(textureDimensions(coarser_mean)));
    let coarser = textureSampleLevel(coarser_mean, linear, uv, 0.0);
    let found = vec4f(coarser.rgb / max(coarser.a, 1e-3), coarser.a - 1e-3);
    return with_coarser(blurred, wanted, e, rest, found);
}

@fragment
fn fs_level(tile: Corner) -> @location(0) vec4f {
    let pixel = vec2i(tile.at.xy);
    let here = textureLoad(here_light, pixel, 0);
    if here.a <= 0.0 {
        return vec4f(0.0);
    }
    return mean_of(gathered(pixel, here, light_of(here), tile));
}

@fragment
fn fs_frame(tile: Corner) -> @location(0) vec4f {
    let pixel = vec2i(tile.at.xy) - vec2i(view.first_pixel);
    let share = share_at(pixel);
    let here = textureLoad(here_light, pixel, 0);
    if here.a <= 0.0 || share <= 0.0 {
        discard;
    }
    let e = light_of(here);
    return scattered(pixel, gathered(pixel, here, e, tile), e, share);
}
