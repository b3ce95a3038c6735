// One blur of the cascade in screen space.
// Jimenez, Sundstedt & Gutierrez 2009, "Screen-space perceptual rendering of human skin", ACM TAP
// 6(4): the width of a blur is α/(d + β·|∇d|) pixels, d being linear depth.

// σ of this blur.
override sigma_mm: f32;

@group(0) @binding(3) var surfaces: texture_2d<u32>;

fn surface(at: vec2f) -> u32 {
    return textureLoad(surfaces, vec2i(at), 0).r;
}

// With f the focal length in pixels, d/f is the mm between pixels. So α = σ·f has the width right
// where the surface faces the camera, and β = f, which sums the way across and the way into depth,
// where it does not. Neither needs f, and the orthographic case is the same.
fn sigma_px(mm_per_px: f32, gradient_mm: f32) -> f32 {
    return sigma_mm / (mm_per_px + abs(gradient_mm));
}

@fragment
fn fs_rows(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let here = surface(at.xy);
    let gradient_mm = dpdx(depth_mm(here));
    return seven_taps(at.xy, vec2f(sigma_px(mm_per_px(here).x, gradient_mm), 0.0));
}

struct Blurred {
    // For the next blur.
    @location(0) next: vec4f,
    // Onto the sum, which blending lerps towards this blur by its share.
    @location(1) share: vec4f,
}

@fragment
fn fs_columns(@builtin(position) at: vec4f) -> Blurred {
    let here = surface(at.xy);
    let gradient_mm = dpdy(depth_mm(here));
    let blurred = seven_taps(at.xy, vec2f(0.0, sigma_px(mm_per_px(here).y, gradient_mm)));
    return Blurred(blurred, blurred);
}
