// A skin ball, half behind a grey one, over a floor; the camera at the origin looks along -z. Metres.
override scale_x: f32;
override scale_y: f32;
override near: f32;

struct Vertex {
    @builtin(position) position: vec4f,
    @location(0) ndc: vec2f,
}

@vertex
fn vertex(@builtin(vertex_index) i: u32) -> Vertex {
    let ndc = vec2f(f32(i & 1u), f32(i >> 1u)) * 4.0 - 1.0;
    return Vertex(vec4f(ndc, 0.0, 1.0), ndc);
}

struct GBuffer {
    @location(0) irradiance: vec4f, // alpha: 0 off skin, the cosine to the camera on it
    @location(1) id: u32,
    @location(2) lit: vec4f,
    @builtin(frag_depth) depth: f32,
}

fn ball(ray: vec3f, centre: vec3f, radius: f32) -> f32 {
    let b = dot(ray, centre);
    let d = b * b - dot(centre, centre) + radius * radius;
    return select(1e9, b - sqrt(max(d, 0.0)), d > 0.0);
}

@fragment
fn fragment(in: Vertex) -> GBuffer {
    let ray = normalize(vec3f(in.ndc / vec2f(scale_x, scale_y), -1.0));
    let skin_centre = vec3f(-0.02, 0.0, -0.6);
    let grey_centre = vec3f(0.05, -0.03, -0.5);
    let t = vec3f(ball(ray, skin_centre, 0.09), ball(ray, grey_centre, 0.03), select(1e9, -0.1 / ray.y, ray.y < 0.0));
    let nearest = min(min(t.x, t.y), t.z);
    if nearest > 2.0 {
        discard;
    }
    let p = nearest * ray;
    let is_skin = nearest == t.x;
    var normal = vec3f(0.0, 1.0, 0.0);
    var albedo = vec3f(0.3, 0.5, 0.7);
    if is_skin {
        normal = normalize(p - skin_centre);
        albedo = vec3f(0.8, 0.6, 0.5);
    } else if nearest == t.y {
        normal = normalize(p - grey_centre);
    }
    let sun = select(0.0, 0.85, p.x + 0.3 * p.y > -0.03); // a hard edge
    let e = vec3f(0.05 + sun * max(dot(normal, normalize(vec3f(0.4, 0.5, 0.8))), 0.0));
    let cosine = select(0.0, -dot(normal, ray), is_skin);
    return GBuffer(vec4f(e, cosine), u32(is_skin), vec4f(e * albedo, 0.5), -near / p.z);
}
