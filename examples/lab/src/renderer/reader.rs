//! A scene from a glTF 2.0 file, as it stands at rest: skins by their joints, morph targets by their
//! default weights. What is read of a material and what is left out [`Scene::notes`] says.
//!
//! Nothing in a file is trusted: whatever is out of bounds, not finite or absurdly large is an [`Error`].

use std::collections::{BTreeSet, HashMap};
use std::path::Path;

use crate::Error;
use glam::Mat4;
use gltf::Semantic;
use gltf::accessor::DataType;
use gltf::json::validation::{self, Validate};
use gltf::mesh::Mode;

use super::accessor::{Buffers, Problem};
use super::names;
use super::pages::paginate;
use super::scene::{Primitive, Scene, Vertex};
use super::tangents::{complete_normals, compute_tangents, square_tangents};

/// Most triangles a scene may have; small files can ask for any number by repeating a mesh.
const MAX_TRIANGLES: usize = 1 << 23;
/// Most vertices that may be read; a primitive reads all of its accessor, whatever it draws.
const MAX_VERTICES: usize = 1 << 27;
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
    ("draco", "plain meshes, as Blender's or glTF-Transform's export writes them"),
    ("meshopt", "plain meshes, as Blender's or glTF-Transform's export writes them"),
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
            gltf::buffer::Source::Bin => blob.take().ok_or("no uri, and no binary chunk".to_string()),
            gltf::buffer::Source::Uri(uri) => read_uri(uri, base),
        };
        let (name, length) = (format!("{input}, buffer {}", buffer.index()), buffer.length());
        let bytes = bytes.map_err(|got| Error::new(&name, got, "its bytes"))?;
        if bytes.len() < length {
            let got = format!("{} bytes", bytes.len());
            return Err(Error::new(name, got, format!("the {length} of its byteLength")));
        }
        buffers.push(bytes);
    }
    let tree = Tree::new(document).map_err(fail("nodes that form a tree"))?;
    let nodes: Vec<_> = document.nodes().collect();
    let drawn: Vec<_> = tree.drawn.iter().map(|&i| &nodes[i]).collect();
    check_size(&drawn).map_err(|(got, needs)| Error::new(input, got, needs))?;
    let mut reader = Reader {
        input,
        base,
        document,
        tree: &tree,
        buffers: Buffers(buffers),
        images: HashMap::new(),
        scene: Scene { left_out: left_out(document), ..Scene::default() },
    };
    for (node, mesh) in drawn.into_iter().filter_map(|node| Some((node, node.mesh()?))) {
        for primitive in mesh.primitives() {
            reader.add(node, &mesh, &primitive)?;
        }
    }
    let mut scene = reader.scene;
    if scene.primitives.is_empty() {
        let left_out = scene.left_out.iter().cloned().collect::<Vec<_>>().join("; ");
        let why = if left_out.is_empty() { String::new() } else { format!(" (left out: {left_out})") };
        return Err(fail("opaque triangles in its scene")(format!("nothing to draw{why}")));
    }
    // What no name speaks of is skin where no name speaks of skin.
    let is_named = scene.materials.iter().any(|m| m.profile_id != 0);
    for material in scene.materials.iter_mut().filter(|m| m.reason.is_empty()) {
        material.profile_id = (!is_named).into();
        material.reason = if is_named { "no such name" } else { "no name says otherwise" }.into();
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
    // Some editors put one before the text.
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
    let is_text = bytes.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b'{');
    if let Some(header) = bytes.strip_prefix(b"glTF").and_then(|rest| rest.first_chunk::<8>()) {
        let [version, length] = [0, 4].map(|i| u32::from_le_bytes([0, 1, 2, 3].map(|k| header[i + k])));
        if version != 2 {
            return Err(fail(format!("version {version}")));
        }
        // It subtracts the header's size, 12, from the length without a check,
        if (length as usize) < 12 || length as usize > bytes.len() {
            return Err((format!("{} bytes for the {length} of its header", bytes.len()), "a whole file"));
        }
    } else if !is_text {
        return Err(fail("no glTF".into()));
    }
    let gltf = gltf::Gltf::from_slice_without_validation(bytes).map_err(|e| fail(e.to_string()))?;
    let known = |name: &str| READ.contains(&name) || HARMLESS.iter().any(|h| name.starts_with(h));
    if let Some(name) = gltf.document.extensions_required().find(|name| !known(name)) {
        let instead = INSTEAD.iter().find(|(part, _)| name.contains(part));
        let needs = instead.map_or("a file that does not require it", |(_, needs)| needs);
        return Err((format!("{name}, which it requires and this program does not read"), needs));
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
    let extensions = document.extensions_used().filter(|name| !READ.contains(name));
    let mut all: BTreeSet<String> = extensions.map(str::to_string).collect();
    let any = |has: fn(&gltf::Material) -> bool| document.materials().any(|m| has(&m));
    let parts = [
        ("animations", document.animations().len() > 0),
        ("cameras", document.cameras().len() > 0),
        ("light that surfaces emit", any(|m| m.emissive_factor() != [0.0; 3])),
        ("occlusion maps", any(|m| m.occlusion_texture().is_some())),
        (
            "maps of metalness and roughness",
            any(|m| m.pbr_metallic_roughness().metallic_roughness_texture().is_some()),
        ),
    ];
    all.extend(parts.into_iter().filter(|(_, has)| *has).map(|(name, _)| name.to_string()));
    all
}

/// The nodes' transforms.
pub(super) struct Tree {
    pub parents: Vec<Option<usize>>,
    /// To the world, of each node.
    pub worlds: Vec<Mat4>,
    /// The nodes of the default scene, else of the first, else all.
    drawn: Vec<usize>,
}

impl Tree {
    fn new(document: &gltf::Document) -> Result<Self, String> {
        let nodes: Vec<_> = document.nodes().collect();
        let twice = |i: usize| format!("node {i} in two places");
        let mut parents = vec![None; nodes.len()];
        for (i, child) in nodes.iter().flat_map(|n| n.children().map(|c| (n.index(), c.index()))) {
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
        Ok(Self { parents, worlds, drawn: order })
    }
}

/// Checks how much there is to read, before any of it is.
fn check_size(nodes: &[&gltf::Node]) -> Result<(), (String, String)> {
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
        return Err((format!("{triangles} triangles"), format!("at most {MAX_TRIANGLES}")));
    }
    if vertices > MAX_VERTICES {
        return Err((format!("{vertices} vertices to read"), format!("at most {MAX_VERTICES}")));
    }
    Ok(())
}

/// The bytes of a data URI or of a file beside the glTF file.
pub(super) fn read_uri(uri: &str, base: Option<&Path>) -> Result<Vec<u8>, String> {
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

/// A file that is being read.
pub(super) struct Reader<'a> {
    pub input: &'a str,
    pub base: Option<&'a Path>,
    pub document: &'a gltf::Document,
    pub tree: &'a Tree,
    pub buffers: Buffers,
    /// From a glTF image to the scene's.
    pub images: HashMap<usize, usize>,
    pub scene: Scene,
}

impl Reader<'_> {
    fn add(&mut self, node: &gltf::Node, mesh: &gltf::Mesh, from: &gltf::Primitive) -> Result<(), Error> {
        let node_name = node.name().unwrap_or_default();
        let mesh_name = match (mesh.name(), node_name) {
            (Some(name), _) => name.to_string(),
            (None, "") => format!("mesh {}", mesh.index()),
            (None, name) => name.to_string(),
        };
        let alone = mesh.primitives().len() == 1;
        let name = if alone { mesh_name.clone() } else { format!("{mesh_name}/{}", from.index()) };
        let input = format!("{}, mesh {}", self.input, name.strip_prefix("mesh ").unwrap_or(&name));
        let fail = |(got, needs): Problem| Error::new(&input, got, needs);
        check_bytes(from).map_err(fail)?;
        let count = from.get(&Semantic::Positions).map_or(0, |a| a.count());
        let triangles = self.triangles(from, count).map_err(fail)?;
        if triangles.is_empty() {
            self.scene.left_out.insert(format!("{name}, which has no triangles"));
            return Ok(());
        }
        if from.material().transmission().is_some_and(|t| t.transmission_factor() >= 0.5) {
            self.scene.left_out.insert(format!("{name}, which lets light through"));
            return Ok(());
        }
        if node.skin().is_some() && from.get(&Semantic::Weights(0)).is_none() {
            self.scene.left_out.insert(format!("{name}'s rig, which has no weights"));
        }
        let (material, mapping) = self.material(&from.material(), [&mesh_name, node_name], alone)?;
        let attributes = self.attributes(node, mesh, from, &mapping).map_err(fail)?;
        // Placed, they would be made up anew, as those are that a transform flattens.
        if !attributes.normals.as_flattened().iter().all(|x| x.is_finite()) {
            return Err(fail(("NaN or infinity".into(), "finite normals")));
        }
        let world = self.tree.worlds[node.index()];
        let (mut vertices, mut indices, head) = attributes.place(&triangles, world);
        check_finite(&vertices).map_err(fail)?;
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
                indices.map_err(named)?.into_iter().map(|[index]| index).collect()
            }
            None => (0..count as u32).collect(),
        };
        if let Some(index) = corners.iter().find(|&&i| i as usize >= count) {
            return Err((format!("index {index} of {count} vertices"), "existing vertices"));
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
}

/// Positions and indices may lie in an extension, or nowhere.
fn check_bytes(from: &gltf::Primitive) -> Result<(), Problem> {
    let has_no_bytes = |a: &gltf::Accessor| a.view().is_none() && a.sparse().is_none();
    if from.get(&Semantic::Positions).is_some_and(|a| has_no_bytes(&a)) {
        let draco = from.extension_value("KHR_draco_mesh_compression").is_some();
        let got = if draco { "KHR_draco_mesh_compression" } else { "POSITION without bytes" };
        return Err((got.into(), "plain positions"));
    }
    match from.indices().is_some_and(|a| has_no_bytes(&a)) {
        true => Err(("indices without bytes".into(), "a buffer view of them")),
        false => Ok(()),
    }
}

fn check_finite(vertices: &[Vertex]) -> Result<(), Problem> {
    let is_finite =
        |v: &Vertex| bytemuck::bytes_of(v).as_chunks().0.iter().all(|x| f32::from_ne_bytes(*x).is_finite());
    match vertices.iter().position(|v| !is_finite(v)) {
        Some(i) => {
            let got = format!("NaN or infinity at vertex {i}, as its node places it");
            Err((got, "finite attributes and transforms"))
        }
        None => Ok(()),
    }
}
