// Depth as a light sees it.

@group(0) @binding(0) var<uniform> to_clip: mat4x4f;

@vertex
fn vs_shadow(@location(0) position: vec3f) -> @builtin(position) vec4f {
    return to_clip * vec4f(position, 1.0);
}
