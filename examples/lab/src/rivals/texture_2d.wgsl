// One Gaussian as a full convolution: each texel in reach, by its distance in space.
// Li & Shao 2015, "GPU-based face rendering via the physical model of light interaction with human
// skin", Eq. 7–11, each Gaussian divided by its mass.

// Whether there is no sum yet.
override first: bool;
override variance_mm2: f32;
override red: f32;
override green: f32;
override blue: f32;

// E·A and A.
@group(0) @binding(2) var source: texture_2d<f32>;
// The Gaussians summed so far.
@group(0) @binding(3) var before: texture_2d<f32>;

// Beyond 3.5 σ a Gaussian on a plane holds e^(−3.5²/2) = .2 % of its mass.
const REACH_SIGMAS = 3.5;

@fragment
fn fs_sum(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let texel = vec2i(at.xy);
    let here = point(texel);
    if here.profile == 0.0 {
        return vec4f(0.0);
    }
    let u = tangent(texel, vec2i(1, 0), here);
    let v = tangent(texel, vec2i(0, 1), here);
    // The texels that bound the ellipse of that distance.
    let bound = sqrt(variance_mm2) * vec2f(length(v), length(u)) / max(length(cross(u, v)), 1e-20);
    let reach = vec2i(ceil(min(REACH_SIGMAS * bound, vec2f(size()))));
    let low = max(texel - reach, vec2i(0));
    let high = min(texel + reach, size() - 1);
    let over_2v = -0.5 / max(variance_mm2, 1e-12);
    var total = vec4f(0.0);
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) {
            let there = point(vec2i(x, y));
            if there.profile == here.profile {
                let d = there.mm - here.mm;
                total += exp(over_2v * dot(d, d)) * textureLoad(source, vec2i(x, y), 0);
            }
        }
    }
    // A texel without neighbours has no area and gives nothing: dividing by 1 leaves it dark.
    let mean = total.rgb / select(total.a, 1.0, total.a <= 0.0);
    var sum = vec3f(red, green, blue) * mean;
    if !first {
        sum += textureLoad(before, texel, 0).rgb;
    }
    return vec4f(sum, 1.0);
}
