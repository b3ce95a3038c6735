// What the passes over the pyramid share: surfaces, packed, and the planes through them.
//
// [LS15] Li & Shao 2015, "GPU-based face rendering via the physical model of light interaction
//        with human skin".

struct View {
    // 0: all of the surface is of the first profile. First since shaders branch on it: lavapipe of Mesa
    // 22.3 then compiles the first word of a buffer in, whichever that is, and where the shader gets
    // longer by it does so at every draw, and keeps them all.
    has_id: u32,
    has_strength: u32,
    // The depth at which there is no surface.
    far: f32,
    has_albedo: u32,
    // p.xy = (u + ∂u·at)·z + (v + ∂v·at) for the pixel at `at`: x and y of u and v, then of ∂u and ∂v.
    origin: vec4f,
    step: vec4f,
    // z = (x·depth + y)/(z·depth + w), in mm.
    depth_to_mm: vec4f,
    first_octave: f32,
    rows: u32,
    stride: u32,
    profiles: u32,
    // Of the viewport, in the textures of the host.
    first_pixel: vec2u,
    size: vec2u,
    // How far planar blurs may be off in a tile by its looks, on the frame and on levels, for it to be planar.
    frame_limit: f32,
    level_limit: f32,
    // Levels above the frame.
    levels: u32,
    // How far behind the frame, in mm, a layer may lie to scatter to it where their light differs by 1; 0 where there
    // is none. And what is added to the square of that for each factor of e in the difference.
    back_reach: f32,
    back_growth: f32,
}

// A Gaussian, cut off by a shape of taps.
struct Blur {
    // In square pixels of the level, and how much of it is the pyramid's own blur.
    variance: f32,
    own: f32,
    // What taps of this shape can have at most, and up to what they are three columns.
    limit: f32,
    narrow: f32,
    // Inverse variance of the weights that have a variance when cut off, over its own: with t the
    // variance over `limit`, (1 − t)(x/t + y + z·t + w·t²).
    sharpness: vec4f,
    // Its place in a row of weights.
    slot: u32,
}

struct Level {
    // Up to three that share their taps; the last one has those of the square.
    blurs: array<Blur, 4>,
    // Of this level, in its pixels.
    size: vec2f,
    // Pixels of the frame to one of this level.
    scale: f32,
    // Where the weights of all coarser levels together are in a row.
    rest: u32,
    // 1 where there is a coarser level.
    coarser: u32,
    // Where its tiles are in lists, and how many.
    first_tile: u32,
    tile_count: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> level: Level;
// Of all levels; x in the low half. Of a level the planar ones from the front on, the others from the end.
@group(0) @binding(2) var<storage, read> tiles: array<u32>;

// Which tiles a pass is over.
override CLASS: u32 = 0u;
const PLANAR = 0u;
// Summed directly on the frame; on levels each pixel finds what its taps weigh.
const CAREFUL = 1u;
const CLASSES = 2u;

// What a tile holds, a bit each, so that several together hold all of theirs: each level that light is needed
// of; how difficult the surface is; whether there is anything but skin; each profile.
const LEVELS = 0x7ffu;
const DIFFICULTY_SHIFT = 11u;
const NOT_SKIN = 1u << 15u;
const PROFILE_SHIFT = 16u;
const PROFILES = 0xffffu << PROFILE_SHIFT;
// The frame and its levels.
const GRIDS = 11u;
const ROWS_PER_OCTAVE = 6.0;

// Whether all skin is of one profile: what is none has no light, so that no id needs to be looked at.
override ONE_PROFILE: bool = false;

const TILE = 8u;
// How far from the plane a pixel may lie to be of the same surface, in mm a pixel of the level.
const TOLERANCE = 2.0;

fn tile_of(instance: u32) -> vec2u {
    var place = level.first_tile + instance;
    if CLASS == CAREFUL {
        place = level.first_tile + level.tile_count - 1u - instance;
    }
    let tile = tiles[place];
    return vec2u(tile & 0xffffu, tile >> 16u);
}

// Corners of a tile, as a strip has them.
fn corner_of(vertex: u32) -> vec2u {
    return vec2u(vertex & 1u, vertex >> 1u);
}

fn on_screen(tile: vec2u, vertex: u32) -> vec4f {
    let uv = vec2f((tile + corner_of(vertex)) * TILE) / level.size;
    return vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.0, 1.0);
}

@vertex
fn vs_tile(
    @builtin(vertex_index) vertex: u32,
    @builtin(instance_index) instance: u32,
) -> @builtin(position) vec4f {
    return on_screen(tile_of(instance), vertex);
}

// The two textures that hold a surface.
struct Surface {
    // Area over that of a surface that faces the camera, less where part of the pixel is not of it; and
    // light times that.
    @location(0) light: vec4f,
    @location(1) shape: vec2u,
}

// Where a surface is.
struct Shape {
    // 0: no surface.
    id: u32,
    // In mm, negative.
    z: f32,
    // ∂z over the mm between pixels, along a row and along a column.
    tangent: vec2f,
}

// Half floats that stores keep as they are, whether they round or truncate.
fn half_floats(v: vec4f) -> vec4f {
    return vec4f(unpack2x16float(pack2x16float(v.xy)), unpack2x16float(pack2x16float(v.zw)));
}

// Whether light that weighs its area is of a profile.
fn is_of(shape: vec2u, id: u32) -> bool {
    return ONE_PROFILE || shape.x >> 24u == id;
}

// Slopes are kept as sines, which are within ±1.
fn packed(id: u32, z: f32, sines: vec2f) -> vec2u {
    let steps = vec2u(sines * 2047.0 + 2048.5);
    return vec2u((id << 24u) | (steps.y << 12u) | steps.x, bitcast<u32>(z));
}

fn steps_of(shape: vec2u) -> vec2f {
    return vec2f(vec2u(shape.x, shape.x >> 12u) & vec2u(0xfffu));
}

fn sines_by(steps: vec2f) -> vec2f {
    return (steps - 2048.0) / 2047.0;
}

fn sines_of(shape: vec2u) -> vec2f {
    return sines_by(steps_of(shape));
}

fn unpacked(shape: vec2u) -> Shape {
    let sines = sines_of(shape);
    let tangent = sines * inverseSqrt(max(1.0 - sines * sines, vec2f(4e-4)));
    return Shape(shape.x >> 24u, bitcast<f32>(shape.y), tangent);
}

// p.xy over z, and the rest, at a pixel of this level.
fn ray(pixel: vec2i) -> vec4f {
    let at = (vec2f(pixel) + 0.5) * level.scale;
    return view.origin + view.step * at.xyxy;
}

// The mm between pixels of this level on a surface that faces the camera.
fn mm_per_px(z: f32) -> vec2f {
    return abs(view.step.xy * z + view.step.zw) * level.scale;
}

// Whether pixels are so far from square that blurs of few taps do not fit them, and not so far that steps of
// two pixels do.
fn has_odd_pixels() -> bool {
    // Of a perspective camera the latter are 0, of an orthographic one the former.
    let px = abs(view.step.xy) + abs(view.step.zw);
    let ratio = max(px.x, px.y) / min(px.x, px.y);
    return ratio > 1.1 && ratio < 1.7;
}

// The plane through the surface at a pixel, in steps of a pixel.
struct Plane {
    z: f32,
    dx: vec3f,
    dy: vec3f,
    // Along a ray all of p grows by (ray, 1) for one of z.
    ray: vec2f,
    // M = JᵀJ: M₀₀, M₀₁, M₁₁, in mm².
    m: vec3f,
}

fn plane_of(pixel: vec2i, shape: Shape) -> Plane {
    let r = ray(pixel);
    let mm = (view.step.xy * shape.z + view.step.zw) * level.scale;
    let dz = shape.tangent * abs(mm);
    let dx = vec3f(r.xy * dz.x + vec2f(mm.x, 0.0), dz.x);
    let dy = vec3f(r.xy * dz.y + vec2f(0.0, mm.y), dz.y);
    return Plane(shape.z, dx, dy, r.xy, vec3f(dot(dx, dx), dot(dx, dy), dot(dy, dy)));
}

// The plane in steps of so many pixels.
fn scaled(plane: Plane, side: f32) -> Plane {
    return Plane(plane.z, side * plane.dx, side * plane.dy, plane.ray, side * side * plane.m);
}
