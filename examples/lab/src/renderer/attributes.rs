//! The attributes of a glTF primitive's vertices: as the file has them, then moved to where they are at rest.
//!
//! \[glTF\]: Khronos 2021, "glTF 2.0 Specification".

use std::collections::HashMap;

use glam::{Mat3, Mat4, Vec2, Vec3, Vec4};
use gltf::Semantic;
use gltf::accessor::{Accessor, DataType, Dimensions};

use super::accessor::Problem;
use super::materials::Mapping;
use super::names;
use super::reader::Reader;
use super::scene::{Vertex, around};

/// The glTF attribute that holds [`Vertex::mask`], less its underscore.
const SKIN_MASK: &str = "SKIN_MASK";

impl Reader<'_> {
    /// An attribute of every vertex; empty if there is none.
    fn attribute<const N: usize>(
        &self,
        from: &gltf::Primitive,
        semantic: Semantic,
    ) -> Result<Vec<[f32; N]>, Problem> {
        let count = from.get(&Semantic::Positions).map_or(0, |a| a.count());
        let Some(accessor) = from.get(&semantic) else {
            return Ok(Vec::new());
        };
        let label = semantic.to_string();
        self.numbers(&accessor, count, &label)
    }

    fn numbers<const N: usize>(
        &self,
        accessor: &Accessor,
        count: usize,
        label: &str,
    ) -> Result<Vec<[f32; N]>, Problem> {
        if accessor.count() != count {
            let got = format!("{} elements of {label} for {count} of POSITION", accessor.count());
            return Err((got, "as many of both"));
        }
        if accessor.data_type() == DataType::U32 {
            return Err((format!("U32 for {label}"), "floats, or whole numbers of 8 or 16 bits"));
        }
        let numbers = self.buffers.read(accessor, count, |x| x as f32);
        numbers.map_err(|(got, needs)| (format!("{label} of {got}"), needs))
    }

    pub(super) fn attributes(
        &self,
        node: &gltf::Node,
        mesh: &gltf::Mesh,
        from: &gltf::Primitive,
        mapping: &Mapping,
    ) -> Result<Attributes, Problem> {
        let is_vec3 = |a: Accessor| a.dimensions() == Dimensions::Vec3;
        let colors = match from.get(&Semantic::Colors(0)).is_some_and(is_vec3) {
            true => {
                let colors = self.attribute(from, Semantic::Colors(0))?;
                colors.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect()
            }
            false => self.attribute(from, Semantic::Colors(0))?,
        };
        let mut uvs = self.attribute(from, Semantic::TexCoords(mapping.set))?;
        for uv in &mut uvs {
            *uv = mapping.transform.transform_point2(Vec2::from(*uv)).into();
        }
        let mut attributes = Attributes {
            positions: self.attribute(from, Semantic::Positions)?,
            normals: self.attribute(from, Semantic::Normals)?,
            tangents: self.attribute(from, Semantic::Tangents)?,
            uvs,
            colors,
            masks: self.attribute(from, Semantic::Extras(SKIN_MASK.into()))?,
            rig: self.rig(node, from)?,
        };
        let weights = node.weights().or(mesh.weights()).unwrap_or_default();
        for (target, &weight) in from.morph_targets().zip(weights).filter(|(_, weight)| **weight != 0.0) {
            self.morph(&mut attributes.positions, target.positions(), weight)?;
            self.morph(&mut attributes.normals, target.normals(), weight)?;
            self.morph(&mut attributes.tangents, target.tangents(), weight)?;
        }
        Ok(attributes)
    }

    fn morph<const N: usize>(
        &self,
        base: &mut [[f32; N]],
        target: Option<Accessor>,
        weight: f32,
    ) -> Result<(), Problem> {
        let Some(target) = target.filter(|_| !base.is_empty()) else {
            return Ok(());
        };
        let moves: Vec<[f32; 3]> = self.numbers(&target, base.len(), "a morph target")?;
        for (to, by) in base.iter_mut().zip(moves) {
            to.iter_mut().zip(by).for_each(|(to, by)| *to += weight * by);
        }
        Ok(())
    }

    /// The joints that move a primitive.
    fn rig(&self, node: &gltf::Node, from: &gltf::Primitive) -> Result<Option<Rig>, Problem> {
        let Some(skin) = node.skin() else {
            return Ok(None);
        };
        let joints: Vec<gltf::Node> = skin.joints().collect();
        let bind: Vec<[f32; 16]> = match skin.inverse_bind_matrices() {
            Some(accessor) => {
                let matrices = self.buffers.read(&accessor, joints.len(), |x| x as f32);
                matrices.map_err(|(got, needs)| (format!("inverse bind matrices of {got}"), needs))?
            }
            None => vec![Mat4::IDENTITY.to_cols_array(); joints.len()],
        };
        let to_world = |(joint, bind): (&gltf::Node, &[f32; 16])| {
            self.tree.worlds[joint.index()] * Mat4::from_cols_array(bind)
        };
        let matrices: Vec<Mat4> = joints.iter().zip(&bind).map(to_world).collect();
        let name_of: HashMap<usize, &str> =
            joints.iter().map(|j| (j.index(), j.name().unwrap_or_default())).collect();
        // A joint of the head's, or one that hangs from it.
        let is_head = |joint: &gltf::Node| {
            let up = std::iter::successors(Some(joint.index()), |&i| self.tree.parents[i]);
            up.map_while(|i| name_of.get(&i)).any(|name| names::is_head(name))
        };
        let is_head = joints.iter().map(is_head).collect();
        let mut shares = Vec::new();
        for set in 0.. {
            let joints: Vec<[f32; 4]> = self.attribute(from, Semantic::Joints(set))?;
            let weights: Vec<[f32; 4]> = self.attribute(from, Semantic::Weights(set))?;
            if joints.is_empty() || weights.is_empty() {
                break;
            }
            let exists = 0.0..matrices.len() as f32;
            if let Some(joint) = joints.as_flattened().iter().find(|joint| !exists.contains(joint)) {
                return Err((format!("joint {joint} of {}", matrices.len()), "existing joints"));
            }
            shares.push([joints, weights]);
        }
        Ok(Some(Rig { matrices, is_head, shares }))
    }
}

/// What moves a primitive's vertices.
struct Rig {
    /// From the mesh to the world, for each joint.
    matrices: Vec<Mat4>,
    /// Whether the joint is the head's or hangs from it.
    is_head: Vec<bool>,
    /// Joints and their weights for each vertex, four at a time.
    shares: Vec<[Vec<[f32; 4]>; 2]>,
}

impl Rig {
    /// A vertex's transform, and how much of it is the head's, 0 to 1; \[glTF\] 3.7.3.3. None without weights.
    fn at(&self, vertex: usize) -> Option<(Mat4, f32)> {
        let (mut sum, mut head, mut total) = (Mat4::ZERO, 0.0, 0.0);
        for [joints, weights] in &self.shares {
            for (joint, weight) in joints[vertex].into_iter().zip(weights[vertex]) {
                sum += self.matrices[joint as usize] * weight;
                head += if self.is_head[joint as usize] { weight } else { 0.0 };
                total += weight;
            }
        }
        (total != 0.0).then(|| (sum * total.recip(), head / total))
    }
}

/// A primitive's attributes as the file has them, each empty if it has none.
pub(super) struct Attributes {
    positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub tangents: Vec<[f32; 4]>,
    pub uvs: Vec<[f32; 2]>,
    colors: Vec<[f32; 4]>,
    pub masks: Vec<[f32; 4]>,
    rig: Option<Rig>,
}

impl Attributes {
    /// The triangles' vertices in the world, their indices, and the box around those that move with the head.
    /// Only vertices in use are kept, for primitives may share one large accessor. The transform of a node
    /// whose mesh is rigged does not count (\[glTF\] 3.7.3.3).
    pub fn place(
        &self,
        triangles: &[[u32; 3]],
        world: Mat4,
    ) -> (Vec<Vertex>, Vec<u32>, Option<(Vec3, Vec3)>) {
        let at = |i: usize| self.rig.as_ref().and_then(|rig| rig.at(i)).unwrap_or((world, 0.0));
        // The cofactors are the inverse transpose times the determinant, and exist without it.
        let cofactors = |m: Mat3| {
            Mat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
        };
        let first = triangles.first().map_or(world, |[first, ..]| at(*first as usize).0);
        let mirrored = first.determinant() < 0.0;
        let handedness = if mirrored { -1.0 } else { 1.0 };
        let vertex = |i: usize, world: Mat4| {
            let linear = Mat3::from_mat4(world);
            let normal = cofactors(linear) * handedness * Vec3::from(element(&self.normals, i));
            let tangent = Vec4::from(element(&self.tangents, i));
            let side = handedness * if tangent.w < 0.0 { -1.0 } else { 1.0 };
            let color = self.colors.get(i).copied().unwrap_or([1.0; 4]);
            Vertex {
                position: world.transform_point3(element(&self.positions, i).into()).into(),
                normal: normal.normalize_or_zero().into(),
                tangent: (linear * tangent.truncate()).extend(side).into(),
                uv: element(&self.uvs, i),
                atlas_uv: [0.0; 2],
                mask: element(&self.masks, i).map(|x| x.clamp(0.0, 1.0)),
                color: color.map(|x| x.clamp(0.0, 1.0)),
            }
        };
        let mut slots = HashMap::new();
        let (mut vertices, mut of_head) = (Vec::new(), Vec::new());
        let mut indices = Vec::with_capacity(3 * triangles.len());
        for &[a, b, c] in triangles {
            let (b, c) = if mirrored { (c, b) } else { (b, c) };
            for corner in [a, b, c] {
                indices.push(*slots.entry(corner).or_insert_with(|| {
                    let (world, head) = at(corner as usize);
                    vertices.push(vertex(corner as usize, world));
                    of_head.extend((head > 0.5).then(|| vertices.len() - 1));
                    vertices.len() as u32 - 1
                }));
            }
        }
        let head = around(of_head.into_iter().map(|i| Vec3::from(vertices[i].position)));
        (vertices, indices, head)
    }
}

/// One element of an attribute, zeros if it is missing.
fn element<const N: usize>(attribute: &[[f32; N]], vertex: usize) -> [f32; N] {
    attribute.get(vertex).copied().unwrap_or([0.0; N])
}
