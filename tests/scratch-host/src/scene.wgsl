// Two balls in metres: skin at the origin and a grey one before it, lit up to a hard edge.
const FOV = array(0.5, 0.3); // by camera, in radians, as the host has them
const NEAR = 0.05;
const COLUMNS = 256u;
const ROWS = 128u;
const PI = 3.14159265;

struct Surface {
    @builtin(position) position: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
    @location(2) @interpolate(flat) id: u32,
}

// A grid of longitude and latitude, two triangles a cell. Instances are the two balls as the first
// camera sees them, and then as the second does; both stand at z = 0.5 and look along -z.
@vertex
fn vertex(@builtin(vertex_index) i: u32, @builtin(instance_index) instance: u32) -> Surface {
    let corner = vec2u(i % 2u, (i % 6u + 1u) / 3u % 2u);
    let cell = vec2u(i / 6u % COLUMNS, i / 6u / COLUMNS) + corner;
    let angles = vec2f(cell) * vec2f(2.0 * PI / f32(COLUMNS), PI / f32(ROWS));
    let across = vec2f(cos(angles.x), sin(angles.x)) * sin(angles.y);
    let normal = vec3f(across.x, cos(angles.y), across.y);
    let id = 1u - instance % 2u;
    let world = select(vec3f(0.05, -0.03, 0.1) + 0.03 * normal, 0.09 * normal, id == 1u);
    let camera = instance / 2u;
    let view = world - vec3f(-0.04 * f32(camera), 0.0, 0.5);
    return Surface(vec4f(view.xy / tan(0.5 * FOV[camera]), NEAR, -view.z), world, normal, id);
}

struct GBuffer {
    @location(0) light: vec4f, // diffuse irradiance; alpha is the id, to be read back with it
    @location(1) picture: vec4f, // where the result goes
    @location(2) id: u32, // 1: the first profile of the plan
}

@fragment
fn fragment(in: Surface) -> GBuffer {
    let sun = select(0.0, 0.85, in.world.x + 0.3 * in.world.y > -0.03);
    let facing = max(dot(normalize(in.normal), normalize(vec3f(0.4, 0.5, 0.8))), 0.0);
    let light = vec4f(vec3f(0.05 + sun * facing), f32(in.id));
    return GBuffer(light, light, in.id);
}
