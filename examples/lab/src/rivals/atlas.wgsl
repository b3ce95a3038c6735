// What the atlas rivals share: the points of the texels.

// The mm of a scene unit, in x.
@group(0) @binding(0) var<uniform> scale: vec4f;
// Position in scene units, and profile id (0: no surface).
@group(0) @binding(1) var positions: texture_2d<f32>;

struct Point {
    mm: vec3f,
    profile: f32,
}

fn size() -> vec2i {
    return vec2i(textureDimensions(positions));
}

fn point(texel: vec2i) -> Point {
    let p = textureLoad(positions, texel, 0);
    return Point(p.xyz * scale.x, p.w);
}

fn point_or_none(texel: vec2i) -> Point {
    if any(texel < vec2i(0)) || any(texel >= size()) {
        return Point(vec3f(0.0), 0.0);
    }
    return point(texel);
}

// ∂p/∂u of a step of one texel, in mm: the mean over the neighbours that there are.
fn tangent(texel: vec2i, step: vec2i, here: Point) -> vec3f {
    let next = point_or_none(texel + step);
    let last = point_or_none(texel - step);
    let forward = select(vec3f(0.0), next.mm - here.mm, next.profile == here.profile);
    let backward = select(vec3f(0.0), here.mm - last.mm, last.profile == here.profile);
    let both = next.profile == here.profile && last.profile == here.profile;
    return select(1.0, 0.5, both) * (forward + backward);
}

