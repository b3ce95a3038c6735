// What a host's vertex shader needs to draw a mesh into its own UV space; paste it before yours.

// Clip position of a vertex with these texture coordinates, u right and v down as in glTF.
fn atlas_position(uv: vec2f) -> vec4f {
    return vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.0, 1.0);
}
