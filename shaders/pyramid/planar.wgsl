// The blurs of a level on planar tiles: of one profile, and hardly bent or hardly of different light. What
// taps weigh is found at the corners of a tile, all blurs in one, and lies evenly between. Follows blur.wgsl.

// `Taps`, those that all blurs share with the square's own. In the last components, the weight of all coarser levels.
struct Corner {
    @builtin(position) at: vec4f,
    @location(0) @interpolate(linear) k00: vec4f,
    @location(1) @interpolate(linear) k10: vec4f,
    @location(2) @interpolate(linear) k01: vec4f,
    @location(3) @interpolate(linear) k11: vec3f,
    @location(4) @interpolate(linear) k1m: vec3f,
    @location(5) @interpolate(linear) k20: vec3f,
    @location(6) @interpolate(linear) k02: vec3f,
    // And where the pixel is in the coarser mean.
    @location(7) @interpolate(linear) s2: vec4f,
    @location(8) @interpolate(linear) s3: vec4f,
    @location(9) @interpolate(linear) square: vec3f,
    @location(10) @interpolate(linear) wanted: vec3f,
    @location(11) @interpolate(flat) lattice: vec4i,
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
    let taps = taps_of(plane, scale, lattice);
    let rest = rest_at(scale);
    let s1 = exp2(taps.s1);
    var out = Corner();
    out.at = on_screen(tile, vertex);
    out.k00 = vec4f(taps.k00 + taps.square + LEAST_OWN, rest.r);
    out.k10 = vec4f(taps.k10 + s1.x * taps.square, rest.g);
    out.k01 = vec4f(taps.k01 + s1.y * taps.square, rest.b);
    out.k11 = taps.k11 + s1.z * taps.square;
    out.k1m = taps.k1m + s1.w * taps.square;
    let s2 = exp2(taps.s2);
    out.k20 = taps.k20 + s2.x * taps.square;
    out.k02 = taps.k02 + s2.y * taps.square;
    // The texture may be larger than the level.
    let uv = vec2f((tile + corner_of(vertex)) * TILE) / (2.0 * vec2f(textureDimensions(coarser_mean)));
    out.s2 = vec4f(s2.zw, uv);
    out.s3 = exp2(taps.s3);
    out.square = taps.square;
    out.wanted = taps.wanted;
    out.lattice = vec4i(lattice.u, lattice.v);
    return out;
}

// Light by what it weighs, and what it weighs.
var<private> light: vec3f;
var<private> mass: vec3f;

fn pair(there: vec4f, opposite: vec4f, k: vec3f) {
    light += k * (there.rgb + opposite.rgb);
    mass += k * (there.a + opposite.a);
}

fn at(pixel: vec2i) -> vec4f {
    return textureLoad(here_light, pixel, 0);
}

fn gathered(here: vec4f, pixel: vec2i, tile: Corner) -> Gathered {
    let u = tile.lattice.xy;
    let v = tile.lattice.zw;
    // Along u and v to either side.
    let east = pixel + u;
    let west = pixel - u;
    let south = pixel + v;
    let north = pixel - v;
    light = tile.k00.rgb * here.rgb;
    mass = tile.k00.rgb * here.a;
    pair(at(east), at(west), tile.k10.rgb);
    pair(at(south), at(north), tile.k01.rgb);
    pair(at(south + u), at(north - u), tile.k11);
    pair(at(north + u), at(south - u), tile.k1m);
    if THIRTEEN {
        pair(at(east + u), at(west - u), tile.k20);
        pair(at(south + v), at(north - v), tile.k02);
    }
    if SQUARE {
        if any(tile.square > vec3f(1e-6)) {
            let far_east = east + u;
            let far_west = west - u;
            let outer = tile.s2.x * (at(far_east + v) + at(far_west - v))
                + tile.s2.y * (at(far_east - v) + at(far_west + v))
                + tile.s3.x * (at(south + v + u) + at(north - v - u))
                + tile.s3.y * (at(south + v - u) + at(north - v + u))
                + tile.s3.z * (at(far_east + v + v) + at(far_west - v - v))
                + tile.s3.w * (at(far_east - v - v) + at(far_west + v + v));
            light += tile.square * outer.rgb;
            mass += tile.square * outer.a;
        }
    }
    let rest = vec3f(tile.k00.a, tile.k10.a, tile.k01.a);
    let coarser = textureSampleLevel(coarser_mean, linear, tile.s2.zw, 0.0);
    let found = vec4f(coarser.rgb / max(coarser.a, 1e-3), coarser.a - 1e-3);
    let mean = light / max(mass, vec3f(LEAST_OWN * here.a));
    return with_coarser(mean, tile.wanted, rest, found);
}

@fragment
fn fs_level(tile: Corner) -> @location(0) vec4f {
    let pixel = vec2i(tile.at.xy);
    let here = textureLoad(here_light, pixel, 0);
    if here.a <= 0.0 {
        return vec4f(0.0);
    }
    return mean_of(gathered(here, pixel, tile));
}

@fragment
fn fs_frame(tile: Corner) -> @location(0) vec4f {
    let pixel = vec2i(tile.at.xy) - vec2i(view.first_pixel);
    let share = share_at(pixel);
    let here = textureLoad(here_light, pixel, 0);
    if here.a <= 0.0 {
        discard;
    }
    let e = light_of(here);
    return scattered(pixel, gathered(here, pixel, tile), e, share);
}
