//! Smooth normals for meshes that come without: the glTF standard asks for flat ones then.

use std::collections::HashMap;

use bevy::mesh::VertexAttributeValues;
use bevy::prelude::*;

/// Gives vertices at one place the mean normal of the triangles there, by their areas.
pub fn smooth_normals(mesh: &mut Mesh) {
    let Some(VertexAttributeValues::Float32x3(positions)) = mesh.attribute(Mesh::ATTRIBUTE_POSITION) else {
        return;
    };
    let place = |i: usize| positions[i].map(f32::to_bits);
    let corners: Vec<usize> = match mesh.indices() {
        Some(indices) => indices.iter().collect(),
        None => (0..positions.len()).collect(),
    };
    let mut sums = HashMap::<_, Vec3>::new();
    for triangle in corners.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|k| Vec3::from_array(positions[triangle[k]]));
        let normal = (b - a).cross(c - a);
        for corner in triangle {
            *sums.entry(place(*corner)).or_default() += normal;
        }
    }
    let normal = |i: usize| sums.get(&place(i)).map_or(Vec3::Z, |n| n.normalize_or(Vec3::Z)).to_array();
    let normals: Vec<_> = (0..positions.len()).map(normal).collect();
    mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, normals);
}
