// What the screen-space rivals share: the surface that a pixel shows.

// Depth from a depth buffer: z = (x − d·y)/(d·z − w) mm; then the mm between neighbouring pixels
// of a surface that faces the camera, at view depth z: |x + y·z| along a row, |z + w·z| along a
// column.
@group(0) @binding(0) var<uniform> frame: array<vec4f, 2>;

// A surface is its depth in mm (the way from the camera along its axis) and, in the five lowest
// bits, which cost .001 mm at 300 mm, its profile id; 0 where nothing scatters.
const ID = 31u;

fn surface_of(depth_mm: f32, id: u32) -> u32 {
    return (bitcast<u32>(depth_mm) & ~ID) | id;
}

fn depth_mm(surface: u32) -> f32 {
    return bitcast<f32>(surface & ~ID);
}

fn mm_per_px(surface: u32) -> vec2f {
    return abs(frame[1].xz - frame[1].yw * depth_mm(surface));
}
