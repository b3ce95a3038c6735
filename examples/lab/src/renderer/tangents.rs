//! Normals and tangents that a mesh does not bring.

use std::collections::HashMap;

use glam::{Vec2, Vec3, Vec4};

use super::scene::Vertex;

/// Smooth normals for the vertices whose normal is zero: the mean over the triangles around their
/// position, weighted by angle (Thürmer and Wüthrich 1998) so that tessellation does not matter.
pub(super) fn complete_normals(vertices: &mut [Vertex], indices: &[u32]) {
    let key = |v: &Vertex| v.position.map(|x| (x + 0.0).to_bits()); // -0 becomes 0
    let mut sums: HashMap<[u32; 3], Vec3> = HashMap::new();
    for triangle in indices.chunks_exact(3) {
        let corners = [0, 1, 2].map(|k| vertices[triangle[k] as usize]);
        for k in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|n| Vec3::from(corners[(k + n) % 3].position));
            let normal = (b - a).cross(c - a);
            let angle = normal.length().atan2((b - a).dot(c - a));
            *sums.entry(key(&corners[k])).or_default() += normal.normalize_or_zero() * angle;
        }
    }
    for vertex in vertices.iter_mut().filter(|v| v.normal == [0.0; 3]) {
        let sum = sums.get(&key(vertex)).copied().unwrap_or_default();
        vertex.normal = sum.normalize_or(Vec3::Y).into();
    }
}

/// Tangents and handedness from the UV gradients around each vertex, still to be squared.
pub(super) fn compute_tangents(vertices: &mut [Vertex], indices: &[u32]) {
    let mut sums = vec![(Vec3::ZERO, Vec3::ZERO); vertices.len()];
    for triangle in indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|k| vertices[triangle[k] as usize]);
        let edge = |to: Vertex| Vec3::from(to.position) - Vec3::from(a.position);
        let uv_edge = |to: Vertex| Vec2::from(to.uv) - Vec2::from(a.uv);
        let (p1, p2, w1, w2) = (edge(b), edge(c), uv_edge(b), uv_edge(c));
        // Not divided by the UV area, so that large triangles weigh more.
        let area = w1.perp_dot(w2);
        let sign = if area == 0.0 { 0.0 } else { area.signum() };
        for &corner in triangle {
            let (along_u, along_v) = &mut sums[corner as usize];
            *along_u += (p1 * w2.y - p2 * w1.y) * sign;
            *along_v += (p2 * w1.x - p1 * w2.x) * sign;
        }
    }
    for (vertex, (along_u, along_v)) in vertices.iter_mut().zip(sums) {
        let bitangent = Vec3::from(vertex.normal).cross(along_u);
        let handedness = if bitangent.dot(along_v) > 0.0 { -1.0 } else { 1.0 };
        vertex.tangent = along_u.extend(handedness).into();
    }
}

/// Brings the tangents to unit length at right angles to the normals, or makes some up.
pub(super) fn square_tangents(vertices: &mut [Vertex]) {
    for vertex in vertices {
        let (normal, tangent) = (Vec3::from(vertex.normal), Vec4::from(vertex.tangent));
        let along = tangent.truncate().normalize_or_zero();
        let along = along - normal * normal.dot(along);
        // Along the normal, what remains is rounding.
        let along = match along.length() > 1e-3 {
            true => along.normalize(),
            false => normal.any_orthonormal_vector(),
        };
        vertex.tangent = along.extend(tangent.w).into();
    }
}
