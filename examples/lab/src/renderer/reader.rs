//! A scene from a glTF 2.0 file, as it stands at rest: skins by their joints, morph targets by their
//! default weights. What is read of a material and what is left out [`Scene::notes`] says.
//!
//! Nothing in a file is trusted: whatever is out of bounds, not finite or absurdly large is an [`Error`].
//! \[glTF\]: Khronos 2021, "glTF 2.0 Specification".

use std::collections::{BTreeSet, HashMap};
use std::path::Path;

use crate::Error;
use glam::{Affine2, Mat3, Mat4, Vec2, Vec3, Vec4};
use gltf::Semantic;
use gltf::accessor::{Accessor, DataType, Dimensions};
use gltf::json::Value;
use gltf::json::validation::{self, Validate};
use gltf::material::AlphaMode;
use gltf::mesh::Mode;
use gltf::texture::WrappingMode;

use super::accessor::{Buffers, Problem};
use super::names;
use super::pages::paginate;
use super::scene::{Image, Material, Primitive, Scene, Vertex, around};
use super::tangents::{complete_normals, compute_tangents, square_tangents};

/// Most triangles a scene may have; small files can ask for any number by repeating a mesh.
const MAX_TRIANGLES: usize = 1 << 23;
/// Most vertices that may be read; a primitive reads all of its accessor, whatever it draws.
const MAX_VERTICES: usize = 1 << 27;
/// What all images of a scene may take when decoded: eight of 8192×8192.
const MAX_IMAGE_BYTES: u64 = 2 << 30;
/// The glTF attribute that holds [`Vertex::mask`], less its underscore.
const SKIN_MASK: &str = "SKIN_MASK";
/// Extensions that are read.
const READ: [&str; 5] = [
    "EXT_texture_webp",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];
/// Extensions, by how their names start, without which a surface is still where it should be.
const HARMLESS: [&str; 4] = ["KHR_materials_", "KHR_lights_", "KHR_animation_", "KHR_xmp"];
/// What a file needs instead, by what the extension's name holds.
const INSTEAD: [(&str, &str); 3] = [
    (
        "draco",
        "plain meshes, as Blender's or glTF-Transform's export writes them",
    ),
    (
        "meshopt",
        "plain meshes, as Blender's or glTF-Transform's export writes them",
    ),
    ("texture", "JPEG, PNG or WebP images"),
];

pub(super) fn read(bytes: &[u8], base: Option<&Path>, input: &str) -> Result<Scene, Error> {
    let fail = |needs: &'static str| move |got: String| Error::new(input, got, needs);
    let gltf = parse(bytes).map_err(|(got, needs)| Error::new(input, got, needs))?;
    let document = &gltf.document;
    let mut blob = gltf.blob;
    let mut buffers = Vec::new();
    for buffer in document.buffers() {
        let bytes = match buffer.source() {
            gltf::buffer::Source::Bin => blob.take().ok_or("no binary chunk".to_string()),
            gltf::buffer::Source::Uri(uri) => read_uri(uri, base),
        };
        buffers.push(bytes.map_err(fail("every buffer's bytes"))?);
    }
    let tree = Tree::new(document).map_err(fail("nodes that form a tree"))?;
    let nodes: Vec<_> = document.nodes().collect();
    let drawn: Vec<_> = tree.drawn.iter().map(|&i| &nodes[i]).collect();
    check_size(&drawn).map_err(fail("less to read"))?;
    let mut reader = Reader {
        input,
        base,
        document,
        tree: &tree,
        buffers: Buffers(buffers),
        images: HashMap::new(),
        scene: Scene {
            left_out: left_out(document),
            ..Scene::default()
        },
    };
    for (node, mesh) in drawn
        .into_iter()
        .filter_map(|node| Some((node, node.mesh()?)))
    {
        for primitive in mesh.primitives() {
            reader.add(node, &mesh, &primitive)?;
        }
    }
    let mut scene = reader.scene;
    if scene.primitives.is_empty() {
        return Err(fail("triangles in its scene")("no triangles".into()));
    }
    // What no name speaks of is skin where no name speaks of skin.
    let is_named = scene.materials.iter().any(|m| m.profile_id != 0);
    for material in scene.materials.iter_mut().filter(|m| m.reason.is_empty()) {
        material.profile_id = (!is_named).into();
        material.reason = if is_named {
            "no such name"
        } else {
            "no name says otherwise"
        }
        .into();
    }
    let joints = document.skins().flat_map(|skin| skin.joints());
    let eyes = joints.filter(|joint| joint.name().is_some_and(names::is_eye));
    let place = |joint: gltf::Node| tree.worlds[joint.index()].w_axis.truncate();
    scene.eyes = eyes.map(place).filter(|place| place.is_finite()).collect();
    Ok(scene)
}

/// Parses and validates, guarding the two places where the gltf crate panics on bad input.
fn parse(bytes: &[u8]) -> Result<gltf::Gltf, Problem> {
    let fail = |got: String| (got, "a glTF 2.0 file");
    // It subtracts the header's size, 12, from the length without a check,
    if bytes.starts_with(b"glTF") && matches!(bytes.get(8..12), Some([0..12, 0, 0, 0])) {
        return Err(fail("a length shorter than its header".into()));
    }
    let gltf = gltf::Gltf::from_slice_without_validation(bytes).map_err(|e| fail(e.to_string()))?;
    let known = |name: &str| READ.contains(&name) || HARMLESS.iter().any(|h| name.starts_with(h));
    if let Some(name) = gltf
        .document
        .extensions_required()
        .find(|name| !known(name))
    {
        let instead = INSTEAD.iter().find(|(part, _)| name.contains(part));
        let needs = instead.map_or("a file that does not require it", |(_, needs)| needs);
        return Err((
            format!("{name}, which it requires and this program does not read"),
            needs,
        ));
    }
    // and validates POSITION accessors before it knows that they exist.
    let root = gltf.document.as_json();
    let position = validation::Checked::Valid(Semantic::Positions);
    let mut primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let dangles = |index: &gltf::json::Index<_>| root.get(*index).is_none();
    if primitives.any(|p| p.attributes.get(&position).is_some_and(dangles)) {
        return Err(fail("a POSITION accessor that does not exist".into()));
    }
    let mut problem = None;
    root.validate(root, gltf::json::Path::new, &mut |path, error| {
        let path = path().to_string();
        // It does not know that accessors without bytes are zeros, nor what is read here.
        let zeros = path.starts_with("accessors[") && error == validation::Error::Missing;
        if !zeros && error != validation::Error::Unsupported {
            problem.get_or_insert_with(|| format!("{path}: {error}"));
        }
    });
    problem.map_or(Ok(gltf), |problem| Err(fail(problem)))
}

/// What the file has and is not shown, by name.
fn left_out(document: &gltf::Document) -> BTreeSet<String> {
    let extensions = document
        .extensions_used()
        .filter(|name| !READ.contains(name));
    let mut all: BTreeSet<String> = extensions.map(str::to_string).collect();
    let any = |has: fn(&gltf::Material) -> bool| document.materials().any(|m| has(&m));
    let parts = [
        ("animations", document.animations().len() > 0),
        ("cameras", document.cameras().len() > 0),
        (
            "light that surfaces emit",
            any(|m| m.emissive_factor() != [0.0; 3]),
        ),
        ("occlusion maps", any(|m| m.occlusion_texture().is_some())),
        (
            "maps of metalness and roughness",
            any(|m| {
                m.pbr_metallic_roughness()
                    .metallic_roughness_texture()
                    .is_some()
            }),
        ),
    ];
    all.extend(
        parts
            .into_iter()
            .filter(|(_, has)| *has)
            .map(|(name, _)| name.to_string()),
    );
    all
}

/// The nodes' transforms.
struct Tree {
    parents: Vec<Option<usize>>,
    /// To the world, of each node.
    worlds: Vec<Mat4>,
    /// The nodes of the default scene, else of the first, else all.
    drawn: Vec<usize>,
}

impl Tree {
    fn new(document: &gltf::Document) -> Result<Self, String> {
        let nodes: Vec<_> = document.nodes().collect();
        let twice = |i: usize| format!("node {i} in two places");
        let mut parents = vec![None; nodes.len()];
        for (i, child) in nodes
            .iter()
            .flat_map(|n| n.children().map(|c| (n.index(), c.index())))
        {
            if parents[child].replace(i).is_some() {
                return Err(twice(child));
            }
        }
        let scene = document.default_scene().or(document.scenes().next());
        let mut shown = vec![scene.is_none(); nodes.len()];
        for root in scene.iter().flat_map(|scene| scene.nodes()) {
            if std::mem::replace(&mut shown[root.index()], true) {
                return Err(twice(root.index()));
            }
        }
        let mut worlds = vec![Mat4::IDENTITY; nodes.len()];
        let mut order: Vec<usize> = (0..nodes.len()).filter(|&i| parents[i].is_none()).collect();
        let mut next = 0;
        while let Some(&i) = order.get(next) {
            let local = Mat4::from_cols_array_2d(&nodes[i].transform().matrix());
            worlds[i] = parents[i].map_or(local, |parent: usize| worlds[parent] * local);
            shown[i] |= parents[i].is_some_and(|parent| shown[parent]);
            order.extend(nodes[i].children().map(|child| child.index()));
            next += 1;
        }
        if order.len() < nodes.len() {
            return Err("nodes in a circle".into());
        }
        order.retain(|&i| shown[i]);
        Ok(Self {
            parents,
            worlds,
            drawn: order,
        })
    }
}

/// Checks how much there is to read, before any of it is.
fn check_size(nodes: &[&gltf::Node]) -> Result<(), String> {
    let (mut triangles, mut vertices) = (0usize, 0usize);
    let meshes = nodes.iter().filter_map(|node| node.mesh());
    for primitive in meshes.flat_map(|mesh| mesh.primitives().collect::<Vec<_>>()) {
        let count = primitive.get(&Semantic::Positions).map_or(0, |a| a.count());
        let corners = primitive.indices().map_or(count, |a| a.count());
        let drawn = match primitive.mode() {
            Mode::Triangles => corners / 3,
            Mode::TriangleStrip | Mode::TriangleFan => corners,
            _ => 0,
        };
        triangles = triangles.saturating_add(drawn);
        vertices = vertices.saturating_add(count.max(corners));
    }
    if triangles > MAX_TRIANGLES {
        return Err(format!("{triangles} triangles, more than {MAX_TRIANGLES}"));
    }
    if vertices > MAX_VERTICES {
        return Err(format!(
            "{vertices} vertices to read, more than {MAX_VERTICES}"
        ));
    }
    Ok(())
}

/// The bytes of a data URI or of a file beside the glTF file.
fn read_uri(uri: &str, base: Option<&Path>) -> Result<Vec<u8>, String> {
    if uri.starts_with("data:") {
        let source = gltf::buffer::Source::Uri(uri);
        let data = gltf::buffer::Data::from_source(source, base);
        return data.map(|data| data.0).map_err(|e| e.to_string());
    }
    if uri.contains(':') {
        return Err(format!("the address {uri}"));
    }
    let base = base.ok_or_else(|| format!("a reference to the file {uri}"))?;
    // Decoded here because the gltf crate panics on escapes that are not UTF-8.
    let mut parts = uri.split('%');
    let mut name = parts.next().unwrap_or_default().as_bytes().to_vec();
    for part in parts {
        match part.get(..2).map(|hex| u8::from_str_radix(hex, 16)) {
            Some(Ok(byte)) => {
                name.push(byte);
                name.extend(&part.as_bytes()[2..]);
            }
            _ => return Err(format!("the file name {uri} with a bad escape")),
        }
    }
    let name = String::from_utf8(name).map_err(|e| format!("the file name {uri}, {e}"))?;
    let path = base.join(name);
    // A device or a pipe may have no end.
    match std::fs::metadata(&path) {
        Ok(file) if !file.is_file() => Err(format!("{uri}, which is no file")),
        _ => std::fs::read(&path).map_err(|e| format!("{uri}, {e}")),
    }
}

struct Reader<'a> {
    input: &'a str,
    base: Option<&'a Path>,
    document: &'a gltf::Document,
    tree: &'a Tree,
    buffers: Buffers,
    /// From a glTF image to the scene's.
    images: HashMap<usize, usize>,
    scene: Scene,
}

impl Reader<'_> {
    fn add(
        &mut self,
        node: &gltf::Node,
        mesh: &gltf::Mesh,
        from: &gltf::Primitive,
    ) -> Result<(), Error> {
        let node_name = node.name().unwrap_or_default();
        let mesh_name = match (mesh.name(), node_name) {
            (Some(name), _) => name.to_string(),
            (None, "") => format!("mesh {}", mesh.index()),
            (None, name) => name.to_string(),
        };
        let alone = mesh.primitives().len() == 1;
        let name = if alone {
            mesh_name.clone()
        } else {
            format!("{mesh_name}/{}", from.index())
        };
        let fail = |(got, needs): Problem| Error::new(&name, got, needs);
        let count = from.get(&Semantic::Positions).map_or(0, |a| a.count());
        let triangles = self.triangles(from, count).map_err(fail)?;
        if triangles.is_empty() {
            self.scene
                .left_out
                .insert(format!("{name}, which has no triangles"));
            return Ok(());
        }
        if from
            .material()
            .transmission()
            .is_some_and(|t| t.transmission_factor() >= 0.5)
        {
            self.scene
                .left_out
                .insert(format!("{name}, which lets light through"));
            return Ok(());
        }
        let (material, mapping) =
            self.material(&from.material(), [&mesh_name, node_name], alone)?;
        let attributes = self.attributes(node, mesh, from, &mapping).map_err(fail)?;
        // Placed, they would be made up anew, as those are that a transform flattens.
        if !attributes
            .normals
            .as_flattened()
            .iter()
            .all(|x| x.is_finite())
        {
            return Err(fail(("NaN or infinity".into(), "finite normals")));
        }
        let world = self.tree.worlds[node.index()];
        let (mut vertices, mut indices, head) = attributes.place(&triangles, world);
        let mut numbers = bytemuck::cast_slice::<Vertex, f32>(&vertices).iter();
        if !numbers.all(|x| x.is_finite()) {
            return Err(fail(("NaN or infinity".into(), "finite attributes")));
        }
        if vertices.iter().any(|v| v.normal == [0.0; 3]) {
            complete_normals(&mut vertices, &indices);
        }
        let mut pages = Vec::new();
        if !attributes.uvs.is_empty() {
            // Before tangents are computed, so that mirrored halves do not share any.
            pages = paginate(&mut vertices, &mut indices);
        }
        if attributes.tangents.is_empty() {
            compute_tangents(&mut vertices, &indices);
        }
        square_tangents(&mut vertices);
        let primitive = Primitive {
            name,
            node: node_name.to_string(),
            head,
            vertices,
            indices,
            material: self.scene.material(material),
            pages,
            procedural: !attributes.masks.is_empty(),
        };
        self.scene.primitives.push(primitive);
        Ok(())
    }

    /// The triangles that have three different corners; none for points and lines.
    fn triangles(&self, from: &gltf::Primitive, count: usize) -> Result<Vec<[u32; 3]>, Problem> {
        let corners: Vec<u32> = match from.indices() {
            Some(accessor) => {
                let named = |(got, needs)| (format!("indices of {got}"), needs);
                let kind = accessor.data_type();
                if !matches!(kind, DataType::U8 | DataType::U16 | DataType::U32) {
                    return Err(named((format!("{kind:?}"), "whole numbers")));
                }
                let indices = self.buffers.read(&accessor, accessor.count(), |x| x as u32);
                indices
                    .map_err(named)?
                    .into_iter()
                    .map(|[index]| index)
                    .collect()
            }
            None => (0..count as u32).collect(),
        };
        if let Some(index) = corners.iter().find(|&&i| i as usize >= count) {
            return Err((
                format!("index {index} of {count} vertices"),
                "existing vertices",
            ));
        }
        let runs = 0..corners.len().saturating_sub(2);
        let corner = |k: usize| corners[k];
        let strip = |t: usize| [t, t + 1 + t % 2, t + 2 - t % 2].map(corner);
        let mut triangles: Vec<[u32; 3]> = match from.mode() {
            // One or two that are left over make none.
            Mode::Triangles => corners.as_chunks().0.to_vec(),
            Mode::TriangleStrip => runs.map(strip).collect(),
            Mode::TriangleFan => runs.map(|t| [t + 1, t + 2, 0].map(corner)).collect(),
            _ => Vec::new(),
        };
        triangles.retain(|[a, b, c]| a != b && b != c && c != a);
        Ok(triangles)
    }

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
            return Err((
                format!("{} of {label}", accessor.count()),
                "as many as positions",
            ));
        }
        let numbers = self.buffers.read(accessor, count, |x| x as f32);
        numbers.map_err(|(got, needs)| (format!("{label} of {got}"), needs))
    }

    fn attributes(
        &self,
        node: &gltf::Node,
        mesh: &gltf::Mesh,
        from: &gltf::Primitive,
        mapping: &Mapping,
    ) -> Result<Attributes, Problem> {
        let bytes = from
            .get(&Semantic::Positions)
            .and_then(|accessor| accessor.view());
        if bytes.is_none() {
            let draco = from.extension_value("KHR_draco_mesh_compression").is_some();
            let got = if draco {
                "KHR_draco_mesh_compression"
            } else {
                "POSITION without bytes"
            };
            return Err((got.into(), "plain positions"));
        }
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
        for (target, &weight) in from
            .morph_targets()
            .zip(weights)
            .filter(|(_, weight)| **weight != 0.0)
        {
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
            to.iter_mut()
                .zip(by)
                .for_each(|(to, by)| *to += weight * by);
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
                matrices
                    .map_err(|(got, needs)| (format!("inverse bind matrices of {got}"), needs))?
            }
            None => vec![Mat4::IDENTITY.to_cols_array(); joints.len()],
        };
        let to_world = |(joint, bind): (&gltf::Node, &[f32; 16])| {
            self.tree.worlds[joint.index()] * Mat4::from_cols_array(bind)
        };
        let matrices: Vec<Mat4> = joints.iter().zip(&bind).map(to_world).collect();
        let name_of: HashMap<usize, &str> = joints
            .iter()
            .map(|j| (j.index(), j.name().unwrap_or_default()))
            .collect();
        // A joint of the head's, or one that hangs from it.
        let is_head = |joint: &gltf::Node| {
            let up = std::iter::successors(Some(joint.index()), |&i| self.tree.parents[i]);
            up.map_while(|i| name_of.get(&i))
                .any(|name| names::is_head(name))
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
            if let Some(joint) = joints
                .as_flattened()
                .iter()
                .find(|joint| !exists.contains(joint))
            {
                return Err((
                    format!("joint {joint} of {}", matrices.len()),
                    "existing joints",
                ));
            }
            shares.push((joints, weights));
        }
        Ok(Some(Rig {
            matrices,
            is_head,
            shares,
        }))
    }

    /// A material, and how its textures lie on the mesh. Its reason is empty where no name says what it is.
    fn material(
        &mut self,
        from: &gltf::Material,
        [mesh, node]: [&str; 2],
        alone: bool,
    ) -> Result<(Material, Mapping), Error> {
        let name = from.name().unwrap_or(mesh).to_string();
        let (profile_id, reason) = profile(from, &name, [mesh, node], alone)?;
        let pbr = from.pbr_metallic_roughness();
        let old = from.pbr_specular_glossiness();
        let (factor, base, roughness) = match &old {
            Some(old) => (
                old.diffuse_factor(),
                old.diffuse_texture(),
                1.0 - old.glossiness_factor(),
            ),
            None => (
                pbr.base_color_factor(),
                pbr.base_color_texture(),
                pbr.roughness_factor(),
            ),
        };
        let base = base.map(|t| {
            let transform = t.extension_value("KHR_texture_transform");
            (
                Mapping::new(&t.texture(), t.tex_coord(), transform),
                t.texture(),
            )
        });
        let mut normal = from.normal_texture().map(|t| {
            let transform = t.extension_value("KHR_texture_transform");
            (
                Mapping::new(&t.texture(), t.tex_coord(), transform),
                t.texture(),
            )
        });
        if let (Some(base), Some(map)) = (&base, &normal)
            && base.0 != map.0
        {
            self.scene.left_out.insert(format!(
                "{name}'s normal map, whose UVs are not its colours'"
            ));
            normal = None;
        }
        let mapping = base
            .as_ref()
            .or(normal.as_ref())
            .map_or(Mapping::default(), |(mapping, _)| *mapping);
        let normal_scale = from.normal_texture().map_or(1.0, |t| t.scale());
        // JSON holds no infinity, but numbers that are too large for a float.
        if !normal_scale.is_finite() {
            let input = format!("{name}, normalTexture scale");
            return Err(Error::new(input, normal_scale, "a finite number"));
        }
        let mut image = |texture: Option<(Mapping, gltf::Texture)>| {
            texture.map(|(_, texture)| self.image(&texture)).transpose()
        };
        let material = Material {
            base_color_texture: image(base)?,
            normal_texture: image(normal)?,
            name,
            base_color: factor.map(|c| c.clamp(0.0, 1.0)),
            wrap: mapping.wrap,
            normal_scale,
            roughness: roughness.clamp(0.0, 1.0),
            alpha_cutoff: match from.alpha_mode() {
                AlphaMode::Opaque => 0.0,
                AlphaMode::Mask => from.alpha_cutoff().unwrap_or(0.5).clamp(0.0, 1.0),
                AlphaMode::Blend => 0.5,
            },
            profile_id,
            reason,
        };
        Ok((material, mapping))
    }

    fn image(&mut self, texture: &gltf::Texture) -> Result<usize, Error> {
        // Not through the crate's `Image::source`, which panics if there is none.
        let images = &self.document.as_json().images;
        let webp = || {
            texture
                .extension_value("EXT_texture_webp")?
                .get("source")?
                .as_u64()
        };
        let source = texture.source().map(|image| image.index());
        let source = source.or_else(|| usize::try_from(webp()?).ok());
        let Some((index, json)) = source.and_then(|i| Some((i, images.get(i)?))) else {
            let others = texture
                .extensions()
                .into_iter()
                .flat_map(|all| all.keys().cloned());
            let got = format!("no image, but [{}]", Vec::from_iter(others).join(", "));
            let input = format!("{}, texture {}", self.input, texture.index());
            return Err(Error::new(input, got, "a JPEG, PNG or WebP image"));
        };
        if let Some(&known) = self.images.get(&index) {
            return Ok(known);
        }
        let mut views = self.document.views();
        let view = json.buffer_view.and_then(|view| views.nth(view.value()));
        let embedded = view.and_then(|view| self.buffers.view(&view));
        let bytes = match &json.uri {
            Some(uri) => read_uri(uri, self.base),
            None => embedded.map(<[u8]>::to_vec).ok_or("no bytes".into()),
        };
        let input = || format!("{}, image {index}", self.input);
        let fail = |got| Error::new(input(), got, "a JPEG, PNG or WebP image");
        let bytes = bytes.map_err(fail)?;
        // One by one the decoder holds them to 512 MiB.
        let held = self.scene.images.iter().map(|i| i.rgba8.len() as u64).sum();
        let [width, height] = image_size(&bytes).map_err(|e| fail(e.to_string()))?;
        if !fits(held, [width, height]) {
            let got = format!("{width}x{height} pixels after {} MiB of others", held >> 20);
            let needs = format!("{} MiB at most together", MAX_IMAGE_BYTES >> 20);
            return Err(Error::new(input(), got, needs));
        }
        let pixels = image::load_from_memory(&bytes).map_err(|e| fail(e.to_string()))?;
        let pixels = pixels.into_rgba8();
        self.scene.images.push(Image {
            width: pixels.width(),
            height: pixels.height(),
            rgba8: pixels.into_raw(),
        });
        self.images.insert(index, self.scene.images.len() - 1);
        Ok(self.scene.images.len() - 1)
    }
}

/// Whether an image may follow those that take so many bytes.
fn fits(held: u64, size: [u32; 2]) -> bool {
    let [width, height] = size.map(u64::from);
    let bytes = width.checked_mul(height).and_then(|n| n.checked_mul(4));
    bytes.is_some_and(|bytes| held.saturating_add(bytes) <= MAX_IMAGE_BYTES)
}

/// The size that an image says it has, without its pixels.
fn image_size(bytes: &[u8]) -> image::ImageResult<[u32; 2]> {
    let reader = image::ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format()?;
    reader.into_dimensions().map(<[u32; 2]>::from)
}

/// How a texture lies on a mesh.
#[derive(Clone, Copy, Default, PartialEq)]
struct Mapping {
    /// Which of the mesh's UVs.
    set: u32,
    transform: Affine2,
    wrap: [wgpu::AddressMode; 2],
}

impl Mapping {
    /// KHR_texture_transform: scaled, turned against the clock, which v downwards makes a negative angle, moved.
    fn new(texture: &gltf::Texture, set: u32, transform: Option<&Value>) -> Self {
        let number = |key: &str, i: usize| {
            let value = transform?.get(key)?;
            Some(value.get(i).unwrap_or(value).as_f64()? as f32)
        };
        let pair = |key, default| Vec2::from([0, 1].map(|i| number(key, i).unwrap_or(default)));
        let angle = -number("rotation", 0).unwrap_or(0.0);
        let own_set = transform.and_then(|t| t.get("texCoord")?.as_u64()?.try_into().ok());
        let sampler = texture.sampler();
        Self {
            set: own_set.unwrap_or(set),
            transform: Affine2::from_scale_angle_translation(
                pair("scale", 1.0),
                angle,
                pair("offset", 0.0),
            ),
            wrap: [sampler.wrap_s(), sampler.wrap_t()].map(|wrap| match wrap {
                WrappingMode::ClampToEdge => wgpu::AddressMode::ClampToEdge,
                WrappingMode::MirroredRepeat => wgpu::AddressMode::MirrorRepeat,
                WrappingMode::Repeat => wgpu::AddressMode::Repeat,
            }),
        }
    }
}

/// The scattering profile of a material and what tells it: `extras.subsurface_profile`, what the surface is
/// made of, then the names, the material's before its mesh's. An empty reason where nothing tells.
fn profile(
    from: &gltf::Material,
    name: &str,
    [mesh, node]: [&str; 2],
    alone: bool,
) -> Result<(u8, String), Error> {
    let extras = from.extras().as_ref().map(|raw| raw.get());
    let extras: Option<Value> =
        extras.and_then(|text| gltf::json::deserialize::from_str(text).ok());
    if let Some(profile) = extras
        .as_ref()
        .and_then(|extras| extras.get("subsurface_profile"))
    {
        let in_range = |p: &f64| p.fract() == 0.0 && (0.0..=255.0).contains(p);
        let input = || format!("{name}, subsurface_profile");
        let fail = || Error::new(input(), profile, "an integer from 0 to 255");
        let id = profile.as_f64().filter(in_range).ok_or_else(fail)?;
        return Ok((id as u8, "subsurface_profile".into()));
    }
    let pbr = from.pbr_metallic_roughness();
    let (metallic, roughness) = (pbr.metallic_factor(), pbr.roughness_factor());
    // Both at their default of 1 say nothing, and a map says more than its factor.
    let is_metal = metallic > 0.5
        && (metallic, roughness) != (1.0, 1.0)
        && pbr.metallic_roughness_texture().is_none()
        && from.pbr_specular_glossiness().is_none();
    let transmits = from
        .transmission()
        .is_some_and(|t| t.transmission_factor() > 0.0);
    let scatters = [
        "KHR_materials_volume_scatter",
        "KHR_materials_diffuse_transmission",
    ];
    // A mesh of several materials is not named for each.
    let others = [name]
        .into_iter()
        .chain([mesh, node].into_iter().filter(|_| alone));
    let other = others.filter_map(names::not_skin).next();
    let word = [name, mesh, node].into_iter().find_map(names::skin);
    Ok(if is_metal {
        (0, "a metal".into())
    } else if transmits {
        (0, "lets light through".into())
    } else if let Some(other) = other {
        (0, format!("\"{other}\""))
    } else if let Some(scatters) = scatters
        .into_iter()
        .find(|e| from.extension_value(e).is_some())
    {
        (1, scatters.into())
    } else if let Some(word) = word {
        (1, format!("\"{word}\""))
    } else if from.alpha_mode() == AlphaMode::Blend {
        (0, "blended".into())
    } else {
        (0, String::new())
    })
}

/// What moves a primitive's vertices.
struct Rig {
    /// From the mesh to the world, for each joint.
    matrices: Vec<Mat4>,
    /// Whether the joint is the head's or hangs from it.
    is_head: Vec<bool>,
    /// Joints and their weights for each vertex, four at a time.
    shares: Vec<(Vec<[f32; 4]>, Vec<[f32; 4]>)>,
}

impl Rig {
    /// A vertex's transform, and how much of it is the head's, 0 to 1; \[glTF\] 3.7.3.3. None without weights.
    fn at(&self, vertex: usize) -> Option<(Mat4, f32)> {
        let (mut sum, mut head, mut total) = (Mat4::ZERO, 0.0, 0.0);
        for (joints, weights) in &self.shares {
            for (joint, weight) in joints[vertex].into_iter().zip(weights[vertex]) {
                sum += self.matrices[joint as usize] * weight;
                head += if self.is_head[joint as usize] {
                    weight
                } else {
                    0.0
                };
                total += weight;
            }
        }
        (total != 0.0).then(|| (sum * total.recip(), head / total))
    }
}

/// A primitive's attributes as the file has them, each empty if it has none.
struct Attributes {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    tangents: Vec<[f32; 4]>,
    uvs: Vec<[f32; 2]>,
    colors: Vec<[f32; 4]>,
    masks: Vec<[f32; 4]>,
    rig: Option<Rig>,
}

impl Attributes {
    /// The triangles' vertices in the world, their indices, and the box around those that move with the head.
    /// Only vertices in use are kept, for primitives may share one large accessor. The transform of a node
    /// whose mesh is rigged does not count (\[glTF\] 3.7.3.3).
    fn place(
        &self,
        triangles: &[[u32; 3]],
        world: Mat4,
    ) -> (Vec<Vertex>, Vec<u32>, Option<(Vec3, Vec3)>) {
        let at = |i: usize| {
            self.rig
                .as_ref()
                .and_then(|rig| rig.at(i))
                .unwrap_or((world, 0.0))
        };
        // The cofactors are the inverse transpose times the determinant, and exist without it.
        let cofactors = |m: Mat3| {
            Mat3::from_cols(
                m.y_axis.cross(m.z_axis),
                m.z_axis.cross(m.x_axis),
                m.x_axis.cross(m.y_axis),
            )
        };
        let first = triangles
            .first()
            .map_or(world, |[first, ..]| at(*first as usize).0);
        let mirrored = first.determinant() < 0.0;
        let handedness = if mirrored { -1.0 } else { 1.0 };
        let vertex = |i: usize, world: Mat4| {
            let linear = Mat3::from_mat4(world);
            let normal = cofactors(linear) * handedness * Vec3::from(element(&self.normals, i));
            let tangent = Vec4::from(element(&self.tangents, i));
            let side = handedness * if tangent.w < 0.0 { -1.0 } else { 1.0 };
            let color = self.colors.get(i).copied().unwrap_or([1.0; 4]);
            Vertex {
                position: world
                    .transform_point3(element(&self.positions, i).into())
                    .into(),
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
        let head = around(
            of_head
                .into_iter()
                .map(|i| Vec3::from(vertices[i].position)),
        );
        (vertices, indices, head)
    }
}

/// One element of an attribute, zeros if it is missing.
fn element<const N: usize>(attribute: &[[f32; N]], vertex: usize) -> [f32; N] {
    attribute.get(vertex).copied().unwrap_or([0.0; N])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_have_a_budget_together() {
        assert!(fits(0, [8192, 8192]));
        assert!(fits(MAX_IMAGE_BYTES - 4, [1, 1]));
        assert!(!fits(MAX_IMAGE_BYTES, [1, 1]));
        assert!(!fits(u64::MAX, [1, 1]));
        assert!(!fits(0, [u32::MAX; 2]));
    }
}
