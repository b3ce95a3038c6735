//! Scenes from glTF 2.0 files: triangles in world space, their materials and images.
//!
//! Read are the default scene's meshes, their first UV set, base colours, normal maps and alpha
//! cut-outs; every surface shows both sides. Left out are animation, skins and morph targets (a skinned mesh stands as modelled),
//! cameras, lights, further UV sets and texture transforms. Nothing in a file is trusted: whatever
//! is out of bounds, not finite or absurdly large is an [`Error`].

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::Path;

use crate::Error;
use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Mat4, Vec2, Vec3, Vec4};
use gltf::Semantic;
use gltf::accessor::{DataType, Dimensions, Iter};
use gltf::json::validation::Validate;
use gltf::material::AlphaMode;
use gltf::mesh::Mode;

use super::pages::paginate;

/// Most triangles a scene may have; small files can ask for any number by repeating a mesh.
const MAX_TRIANGLES: usize = 1 << 23;
/// Most vertices that may be read; a primitive reads all of its accessor, whatever it draws.
const MAX_VERTICES: usize = 1 << 27;
/// The glTF attribute that holds [`Vertex::mask`], less its underscore.
const SKIN_MASK: &str = "SKIN_MASK";
/// Materials that do not scatter, by how their names start.
const NOT_SKIN: [&str; 6] = ["eye", "teeth", "tongue", "lash", "hair", "brow"];

/// One vertex, in world space and scene units.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Vertex {
    /// Position, in scene units.
    pub position: [f32; 3],
    /// Unit normal, pointing out of the surface.
    pub normal: [f32; 3],
    /// Unit tangent along +u, at right angles to the normal, and the handedness, 1 or −1: as in
    /// glTF, the bitangent is cross(normal, tangent) · handedness and points up in the image, −v.
    pub tangent: [f32; 4],
    /// Coordinates in the material's textures, in units of a tile, v downwards; 0 if there are none.
    pub uv: [f32; 2],
    /// Coordinates in the primitive's pages, 0 to 1 and v downwards; 0 if there are no pages.
    pub atlas_uv: [f32; 2],
    /// Where procedural skin has lips, redness, brows and pores, each 0 to 1; otherwise 0.
    pub mask: [f32; 4],
}

/// Triangles of one material.
#[derive(Clone, Debug)]
pub struct Primitive {
    /// The mesh's name, followed by the primitive's number if the mesh has several.
    pub name: String,
    /// The vertices, each used by some triangle.
    pub vertices: Vec<Vertex>,
    /// Three per triangle, counter-clockwise seen from outside.
    pub indices: Vec<u32>,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// The indices of each UV page. On one page UV islands do not overlap, but for .5 % of their
    /// texels, so that each surface point has its own `atlas_uv`; an island that overlaps itself
    /// cannot be helped, and what 63 pages leave over shares the last. Empty if the primitive has
    /// no UVs. See [`Primitive::texel_size`].
    pub pages: Vec<Range<u32>>,
    /// Whether the file gave a `_SKIN_MASK`, so that its skin is to be painted procedurally.
    pub procedural: bool,
}

/// How a surface looks and whether it scatters.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The material's name, or its mesh's if it has none.
    pub name: String,
    /// Linear colour and alpha 0 to 1; multiplies the texture.
    pub base_color: [f32; 4],
    /// Index into [`Scene::images`], sRGB colour with linear alpha.
    pub base_color_texture: Option<usize>,
    /// Index into [`Scene::images`], tangent-space normals.
    pub normal_texture: Option<usize>,
    /// Multiplies the x and y of the normal map; 1 by default.
    pub normal_scale: f32,
    /// glTF's roughness 0 to 1, the square root of the micro-facets' slope; of skin, the
    /// lighting says it.
    pub roughness: f32,
    /// Alpha below this is cut out, 0 to 1; 0 for opaque surfaces. Blended ones are cut at 0.5.
    pub alpha_cutoff: f32,
    /// Which scattering profile the surface has, 0 for none: the material's
    /// `extras.subsurface_profile`; failing that, 0 if its name starts with eye, teeth, tongue,
    /// lash, hair or brow, else 1.
    pub profile_id: u8,
}

/// A decoded image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Width, in pixels.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
    /// Four bytes a pixel, row by row from the top.
    pub rgba8: Vec<u8>,
}

/// Everything there is to draw.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// The triangles, at least one primitive if the scene was loaded.
    pub primitives: Vec<Primitive>,
    /// The materials that the primitives use.
    pub materials: Vec<Material>,
    /// The images that the materials use.
    pub images: Vec<Image>,
}

impl Scene {
    /// Reads a `.glb` or `.gltf` file and the files it refers to.
    ///
    /// # Errors
    /// Names the file or the primitive that cannot be used, and why.
    pub fn load(path: &Path) -> Result<Scene, Error> {
        let input = path.display().to_string();
        let fail = |e: std::io::Error| Error::new(&input, e.to_string(), "a readable file");
        let bytes = std::fs::read(path).map_err(fail)?;
        read(&bytes, path.parent(), &input)
    }

    /// Reads a glTF file from memory; it must not refer to other files.
    ///
    /// # Errors
    /// Names the primitive that cannot be used, or "glTF" for the whole, and why.
    pub fn from_glb(bytes: &[u8]) -> Result<Scene, Error> {
        read(bytes, None, "glTF")
    }

    /// Least and greatest corner of the world-space box around everything; zeros if there is nothing.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        bounds(self.primitives.iter())
    }

    /// The box around the primitives that scatter, or around everything if none does.
    pub fn skin_bounds(&self) -> (Vec3, Vec3) {
        let profile = |p: &Primitive| self.materials.get(p.material).map_or(0, |m| m.profile_id);
        let skin: Vec<_> = self.primitives.iter().filter(|p| profile(p) != 0).collect();
        if skin.is_empty() {
            self.bounds()
        } else {
            bounds(skin.into_iter())
        }
    }
}

fn bounds<'a>(primitives: impl Iterator<Item = &'a Primitive>) -> (Vec3, Vec3) {
    let vertices = primitives.flat_map(|primitive| &primitive.vertices);
    let boxes = vertices.map(|v| (Vec3::from(v.position), Vec3::from(v.position)));
    let both = boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    both.unwrap_or_default()
}

fn read(bytes: &[u8], base: Option<&Path>, input: &str) -> Result<Scene, Error> {
    let fail = |needs: &'static str| move |got: String| Error::new(input, got, needs);
    let gltf = parse(bytes).map_err(fail("a glTF 2.0 file"))?;
    let mut blob = gltf.blob;
    let mut buffers = Vec::new();
    for buffer in gltf.document.buffers() {
        let bytes = match buffer.source() {
            gltf::buffer::Source::Bin => blob.take().ok_or("no binary chunk".to_string()),
            gltf::buffer::Source::Uri(uri) => read_uri(uri, base),
        };
        buffers.push(bytes.map_err(fail("every buffer's bytes"))?);
    }
    let mut reader = Reader {
        input,
        base,
        document: &gltf.document,
        buffers,
        images: HashMap::new(),
        materials: HashMap::new(),
        scene: Scene::default(),
    };
    let nodes = walk(&gltf.document).map_err(fail("nodes that form a tree"))?;
    check_size(&nodes).map_err(fail("less to read"))?;
    for (node, world) in nodes {
        if let Some(mesh) = node.mesh() {
            for primitive in mesh.primitives() {
                reader.add(&mesh, &primitive, world)?;
            }
        }
    }
    if reader.scene.primitives.is_empty() {
        return Err(fail("triangles in its scene")("no triangles".into()));
    }
    Ok(reader.scene)
}

/// Parses and validates, guarding the two places where the gltf crate panics on bad input.
fn parse(bytes: &[u8]) -> Result<gltf::Gltf, String> {
    // It subtracts the header's size, 12, from the length without a check,
    if bytes.starts_with(b"glTF") && matches!(bytes.get(8..12), Some([0..12, 0, 0, 0])) {
        return Err("a length shorter than its header".into());
    }
    let gltf = gltf::Gltf::from_slice_without_validation(bytes).map_err(|e| e.to_string())?;
    // and validates POSITION accessors before it knows that they exist.
    let root = gltf.document.as_json();
    let position = gltf::json::validation::Checked::Valid(Semantic::Positions);
    let mut primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let dangles = |index: &gltf::json::Index<_>| root.get(*index).is_none();
    if primitives.any(|p| p.attributes.get(&position).is_some_and(dangles)) {
        return Err("a POSITION accessor that does not exist".into());
    }
    let mut problem = None;
    root.validate(root, gltf::json::Path::new, &mut |path, error| {
        problem.get_or_insert_with(|| format!("{}: {error}", path()));
    });
    problem.map_or(Ok(gltf), Err)
}

/// The scene's nodes with their world transforms: of the default scene, else the first, else all.
fn walk<'a>(document: &'a gltf::Document) -> Result<Vec<(gltf::Node<'a>, Mat4)>, String> {
    let roots: Vec<gltf::Node> = match document.default_scene().or(document.scenes().next()) {
        Some(scene) => scene.nodes().collect(),
        None => {
            let children = document.nodes().flat_map(|node| node.children());
            let children: HashSet<usize> = children.map(|child| child.index()).collect();
            let is_root = |node: &gltf::Node| !children.contains(&node.index());
            document.nodes().filter(is_root).collect()
        }
    };
    let place = |node: gltf::Node<'a>, parent: Mat4| {
        let local = Mat4::from_cols_array_2d(&node.transform().matrix());
        (node, parent * local)
    };
    let mut found = Vec::new();
    found.extend(roots.into_iter().map(|root| place(root, Mat4::IDENTITY)));
    let mut seen = HashSet::new();
    let mut next = 0;
    while let Some((node, world)) = found.get(next).cloned() {
        // Reached twice, it would make a cycle or, worse, repeat its children without end.
        if !seen.insert(node.index()) {
            return Err(format!("node {} in two places", node.index()));
        }
        found.extend(node.children().map(|child| place(child, world)));
        next += 1;
    }
    Ok(found)
}

/// Checks how much there is to read, before any of it is.
fn check_size(nodes: &[(gltf::Node, Mat4)]) -> Result<(), String> {
    let (mut triangles, mut vertices) = (0usize, 0usize);
    let meshes = nodes.iter().filter_map(|(node, _)| node.mesh());
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

/// What is wrong and what is needed.
type Problem = (String, &'static str);

struct Reader<'a> {
    input: &'a str,
    base: Option<&'a Path>,
    document: &'a gltf::Document,
    buffers: Vec<Vec<u8>>,
    /// From a glTF image to the scene's.
    images: HashMap<usize, usize>,
    /// From a glTF material and a profile to the scene's material.
    materials: HashMap<(Option<usize>, u8), usize>,
    scene: Scene,
}

impl Reader<'_> {
    fn add(&mut self, mesh: &gltf::Mesh, from: &gltf::Primitive, world: Mat4) -> Result<(), Error> {
        let mesh_name = mesh.name().map(str::to_string);
        let mesh_name = mesh_name.unwrap_or_else(|| format!("mesh {}", mesh.index()));
        let name = match mesh.primitives().len() {
            1 => mesh_name.clone(),
            _ => format!("{mesh_name}/{}", from.index()),
        };
        let fail = |(got, needs): Problem| Error::new(&name, got, needs);
        self.check(from).map_err(fail)?;
        let attributes = self.attributes(from);
        let triangles = self
            .triangles(from, attributes.positions.len())
            .map_err(fail)?;
        if triangles.is_empty() {
            return Ok(());
        }
        // Placed, they would be made up anew, as those are that a transform flattens.
        let mut normals = attributes.normals.as_flattened().iter();
        if !normals.all(|x| x.is_finite()) {
            return Err(fail(("NaN or infinity".into(), "finite normals")));
        }
        let (mut vertices, mut indices) = attributes.place(&triangles, world);
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
        let material = self.material(&from.material(), &mesh_name)?;
        self.scene.primitives.push(Primitive {
            name,
            vertices,
            indices,
            material,
            pages,
            procedural: !attributes.masks.is_empty(),
        });
        Ok(())
    }

    /// Checks what the gltf crate's readers take for granted: that accessors have the type their
    /// use demands, lie inside their buffers and agree on the number of vertices.
    fn check(&self, primitive: &gltf::Primitive) -> Result<(), Problem> {
        use DataType::{F32, U8, U16, U32};
        use Dimensions::{Scalar, Vec2, Vec3, Vec4};
        let mut used = Vec::new();
        let indices = primitive.indices();
        used.extend(indices.map(|a| (a, Scalar, &[U8, U16, U32][..], "indices")));
        for (semantic, accessor) in primitive.attributes() {
            let (dimensions, types, label) = match semantic {
                Semantic::Positions => (Vec3, &[F32][..], "POSITION"),
                Semantic::Normals => (Vec3, &[F32][..], "NORMAL"),
                Semantic::Tangents => (Vec4, &[F32][..], "TANGENT"),
                Semantic::TexCoords(0) => (Vec2, &[F32, U8, U16][..], "TEXCOORD_0"),
                Semantic::Extras(name) if name == SKIN_MASK => (Vec4, &[F32, U8][..], "_SKIN_MASK"),
                _ => continue,
            };
            used.push((accessor, dimensions, types, label));
        }
        let vertices = primitive.get(&Semantic::Positions).map(|a| a.count());
        for (accessor, dimensions, types, label) in used {
            let (size, count) = (accessor.size(), accessor.count());
            let (shape, kind) = (accessor.dimensions(), accessor.data_type());
            if shape != dimensions || !types.contains(&kind) {
                return Err((
                    format!("{label} of {shape:?} {kind:?}"),
                    "a type glTF allows",
                ));
            }
            if label != "indices" && Some(count) != vertices {
                return Err((format!("{count} of {label}"), "as many as positions"));
            }
            let Some(view) = accessor.view().filter(|_| accessor.sparse().is_none()) else {
                return Err((format!("sparse {label}"), "a plain accessor"));
            };
            let stride = view.stride().unwrap_or(size);
            let last = count
                .checked_sub(1)
                .and_then(|last| last.checked_mul(stride));
            let end = last.and_then(|last| last.checked_add(size)?.checked_add(accessor.offset()));
            let bytes = self.view(&view).map_or(0, <[u8]>::len);
            if stride < size || end.is_none_or(|end| end > bytes) {
                return Err((
                    format!("{count} {label} in {bytes} bytes"),
                    "all their bytes",
                ));
            }
        }
        Ok(())
    }

    fn buffer(&self, buffer: gltf::Buffer) -> Option<&[u8]> {
        self.buffers.get(buffer.index()).map(Vec::as_slice)
    }

    /// The bytes of a buffer view, if it lies inside its buffer.
    fn view(&self, view: &gltf::buffer::View) -> Option<&[u8]> {
        let buffer = self.buffer(view.buffer())?;
        buffer.get(view.offset()..)?.get(..view.length())
    }

    /// Reads what [`Self::check`] has passed.
    fn attributes(&self, primitive: &gltf::Primitive) -> Attributes {
        let get = |buffer: gltf::Buffer| self.buffer(buffer);
        let reader = primitive.reader(get);
        let masks = match primitive.get(&Semantic::Extras(SKIN_MASK.into())) {
            Some(accessor) if accessor.data_type() == DataType::U8 => {
                let bytes: Vec<[u8; 4]> = all(Iter::new(accessor, get));
                let unit = |mask: [u8; 4]| mask.map(|x| f32::from(x) / 255.0);
                bytes.into_iter().map(unit).collect()
            }
            accessor => all(accessor.and_then(|accessor| Iter::new(accessor, get))),
        };
        Attributes {
            positions: all(reader.read_positions()),
            normals: all(reader.read_normals()),
            tangents: all(reader.read_tangents()),
            uvs: all(reader.read_tex_coords(0).map(|uvs| uvs.into_f32())),
            masks,
        }
    }

    /// The triangles that have three different corners; none for points and lines.
    fn triangles(&self, from: &gltf::Primitive, count: usize) -> Result<Vec<[u32; 3]>, Problem> {
        let reader = from.reader(|buffer| self.buffer(buffer));
        let corners: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().collect(),
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
            Mode::Triangles if !corners.len().is_multiple_of(3) => {
                return Err((format!("{} corners", corners.len()), "three a triangle"));
            }
            Mode::Triangles => corners.as_chunks().0.to_vec(),
            Mode::TriangleStrip => runs.map(strip).collect(),
            Mode::TriangleFan => runs.map(|t| [t + 1, t + 2, 0].map(corner)).collect(),
            _ => Vec::new(),
        };
        triangles.retain(|[a, b, c]| a != b && b != c && c != a);
        Ok(triangles)
    }

    fn material(&mut self, from: &gltf::Material, mesh_name: &str) -> Result<usize, Error> {
        let name = from.name().unwrap_or(mesh_name).to_string();
        let profile_id = profile_id(from, &name)?;
        // An unnamed material may scatter on one mesh and not on another.
        let key = (from.index(), profile_id);
        if let Some(&known) = self.materials.get(&key) {
            return Ok(known);
        }
        let normal_scale = from.normal_texture().map_or(1.0, |t| t.scale());
        // JSON holds no infinity, but numbers that are too large for a float.
        if !normal_scale.is_finite() {
            let input = format!("{name}, normalTexture scale");
            return Err(Error::new(
                input,
                normal_scale.to_string(),
                "a finite number",
            ));
        }
        let pbr = from.pbr_metallic_roughness();
        let base_color_texture = pbr.base_color_texture().map(|t| self.image(&t.texture()));
        let normal_texture = from.normal_texture().map(|t| self.image(&t.texture()));
        let material = Material {
            name,
            base_color: pbr.base_color_factor().map(|c| c.clamp(0.0, 1.0)),
            base_color_texture: base_color_texture.transpose()?,
            normal_texture: normal_texture.transpose()?,
            normal_scale,
            roughness: pbr.roughness_factor().clamp(0.0, 1.0),
            alpha_cutoff: match from.alpha_mode() {
                AlphaMode::Opaque => 0.0,
                AlphaMode::Mask => from.alpha_cutoff().unwrap_or(0.5).clamp(0.0, 1.0),
                AlphaMode::Blend => 0.5,
            },
            profile_id,
        };
        self.scene.materials.push(material);
        self.materials.insert(key, self.scene.materials.len() - 1);
        Ok(self.scene.materials.len() - 1)
    }

    fn image(&mut self, texture: &gltf::Texture) -> Result<usize, Error> {
        let index = texture.source().index();
        if let Some(&known) = self.images.get(&index) {
            return Ok(known);
        }
        // Not through the crate's `Image::source`, which panics if there is none.
        let json = &self.document.as_json().images[index];
        let mut views = self.document.views();
        let view = json.buffer_view.and_then(|view| views.nth(view.value()));
        let embedded = view.and_then(|view| self.view(&view));
        let bytes = match &json.uri {
            Some(uri) => read_uri(uri, self.base),
            None => embedded.map(<[u8]>::to_vec).ok_or("no bytes".into()),
        };
        let input = || format!("{}, image {index}", self.input);
        let fail = |got| Error::new(input(), got, "a JPEG or PNG image");
        let bytes = bytes.map_err(fail)?;
        // One by one the decoder holds them to 512 MiB.
        let held = self.scene.images.iter().map(|i| i.rgba8.len() as u64).sum();
        let [width, height] = image_size(&bytes).map_err(|e| fail(e.to_string()))?;
        if !fits(held, [width, height]) {
            let got = format!("{width}x{height} pixels after {} MiB of others", held >> 20);
            return Err(Error::new(
                input(),
                got,
                format!("{} MiB at most together", MOST_IMAGE_BYTES >> 20),
            ));
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

/// What all images of a scene may take when decoded: eight of 8192×8192.
const MOST_IMAGE_BYTES: u64 = 2 << 30;

/// Whether an image may follow those that take so many bytes.
fn fits(held: u64, size: [u32; 2]) -> bool {
    let [width, height] = size.map(u64::from);
    let bytes = width.checked_mul(height).and_then(|n| n.checked_mul(4));
    bytes.is_some_and(|bytes| held.saturating_add(bytes) <= MOST_IMAGE_BYTES)
}

/// The size that an image says it has, without its pixels.
fn image_size(bytes: &[u8]) -> image::ImageResult<[u32; 2]> {
    let reader = image::ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format()?;
    reader.into_dimensions().map(<[u32; 2]>::from)
}

/// A primitive's attributes as the file has them, each empty if it has none.
struct Attributes {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    tangents: Vec<[f32; 4]>,
    uvs: Vec<[f32; 2]>,
    masks: Vec<[f32; 4]>,
}

impl Attributes {
    /// The triangles' vertices in the world, and their indices. Only vertices in use are kept, for
    /// primitives may share one large accessor.
    fn place(&self, triangles: &[[u32; 3]], world: Mat4) -> (Vec<Vertex>, Vec<u32>) {
        let linear = Mat3::from_mat4(world);
        // The cofactors are the inverse transpose times the determinant, and exist without it.
        let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
        let mirrored = x.cross(y).dot(z) < 0.0;
        let handedness = if mirrored { -1.0 } else { 1.0 };
        let cofactors = Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * handedness;
        let vertex = |i: usize| {
            let normal = cofactors * Vec3::from(at(&self.normals, i));
            let tangent = Vec4::from(at(&self.tangents, i));
            let side = handedness * if tangent.w < 0.0 { -1.0 } else { 1.0 };
            Vertex {
                position: world.transform_point3(at(&self.positions, i).into()).into(),
                normal: normal.normalize_or_zero().into(),
                tangent: (linear * tangent.truncate()).extend(side).into(),
                uv: at(&self.uvs, i),
                atlas_uv: [0.0; 2],
                mask: at(&self.masks, i).map(|x| x.clamp(0.0, 1.0)),
            }
        };
        let mut slots = HashMap::new();
        let mut vertices = Vec::new();
        let mut indices = Vec::with_capacity(3 * triangles.len());
        for &[a, b, c] in triangles {
            let (b, c) = if mirrored { (c, b) } else { (b, c) };
            for corner in [a, b, c] {
                indices.push(*slots.entry(corner).or_insert_with(|| {
                    vertices.push(vertex(corner as usize));
                    vertices.len() as u32 - 1
                }));
            }
        }
        (vertices, indices)
    }
}

/// All of an attribute's elements, none if it is missing.
fn all<T>(elements: Option<impl Iterator<Item = T>>) -> Vec<T> {
    elements.into_iter().flatten().collect()
}

/// One element of an attribute, zeros if it is missing.
fn at<const N: usize>(attribute: &[[f32; N]], vertex: usize) -> [f32; N] {
    attribute.get(vertex).copied().unwrap_or([0.0; N])
}

fn profile_id(material: &gltf::Material, name: &str) -> Result<u8, Error> {
    use gltf::json::{Value, deserialize::from_str};
    let extras = material.extras().as_ref().map(|raw| raw.get());
    let extras: Value = extras
        .and_then(|text| from_str(text).ok())
        .unwrap_or_default();
    let Some(profile) = extras.get("subsurface_profile") else {
        let name = name.to_lowercase();
        return Ok(!NOT_SKIN.iter().any(|start| name.starts_with(start)) as u8);
    };
    let in_range = |p: &f64| p.fract() == 0.0 && (0.0..=255.0).contains(p);
    let input = || format!("{name}, subsurface_profile");
    let fail = || Error::new(input(), profile.to_string(), "an integer from 0 to 255");
    let id = profile.as_f64().filter(in_range).ok_or_else(fail)?;
    Ok(id as u8)
}

/// Smooth normals for the vertices whose normal is zero: the mean over the triangles around their
/// position, weighted by angle (Thürmer and Wüthrich 1998) so that tessellation does not matter.
fn complete_normals(vertices: &mut [Vertex], indices: &[u32]) {
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
fn compute_tangents(vertices: &mut [Vertex], indices: &[u32]) {
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
        let handedness = if bitangent.dot(along_v) > 0.0 {
            -1.0
        } else {
            1.0
        };
        vertex.tangent = along_u.extend(handedness).into();
    }
}

/// Brings the tangents to unit length at right angles to the normals, or makes some up.
fn square_tangents(vertices: &mut [Vertex]) {
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

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [[f32; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.]];

    /// Loads one primitive with the corners `at`, accessor 0, `indices`, accessor 1, and UVs
    /// (x, 1 − y), accessor 2. The strings go into the JSON's primitive, node and material.
    fn load(at: [[f32; 3]; 4], indices: &[u8], json: [&str; 3]) -> Result<Scene, Error> {
        let [primitive, node, material] = json;
        let uvs = at.map(|[x, y, _]| [x, 1.0 - y]);
        let bytes = [
            bytemuck::cast_slice(&at),
            bytemuck::cast_slice(&uvs),
            indices,
        ]
        .concat();
        let count = indices.len();
        let json = format!(
            r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": {}}}], "bufferViews": [
            {{"buffer": 0, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 48, "byteLength": 32}},
            {{"buffer": 0, "byteOffset": 80, "byteLength": {count}}}], "accessors": [
            {{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4,
                "min": [0, 0, 0], "max": [1, 1, 0]}},
            {{"bufferView": 2, "componentType": 5121, "type": "SCALAR", "count": {count}}},
            {{"bufferView": 1, "componentType": 5126, "type": "VEC2", "count": 4}}],
            "materials": [{{{material}}}], "meshes": [{{"name": "square", "primitives":
            [{{"material": 0, {primitive}}}]}}], "nodes": [{{"mesh": 0 {node}}}]}}"#,
            bytes.len()
        );
        let lengths = [28 + json.len() + bytes.len(), json.len(), bytes.len()];
        let [all, json_length, length] = lengths.map(|n| (n as u32).to_le_bytes());
        let header = [&b"glTF\x02\0\0\0"[..], &all, &json_length, b"JSON"].concat();
        let binary = [&length[..], b"BIN\0", &bytes].concat();
        Scene::from_glb(&[&header[..], json.as_bytes(), &binary].concat())
    }

    const BARE: &str = r#""attributes": {"POSITION": 0}"#;
    const INDEXED: &str = r#""attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "indices": 1"#;

    /// The direction the first triangle's winding faces.
    fn faces(primitive: &Primitive) -> Vec3 {
        let corner = |k| Vec3::from(primitive.vertices[primitive.indices[k] as usize].position);
        (corner(1) - corner(0)).cross(corner(2) - corner(0))
    }

    #[test]
    fn a_strip_gets_normals_but_no_pages() {
        let strip = format!(r#"{BARE}, "mode": 5"#);
        let scene = load(SQUARE, &[0], [&strip, "", ""]).unwrap();
        let primitive = &scene.primitives[0];
        assert_eq!(primitive.indices, [0, 1, 2, 1, 3, 2]);
        assert!(primitive.pages.is_empty() && !primitive.procedural);
        assert!(
            primitive
                .vertices
                .iter()
                .all(|v| v.normal == [0.0, 0.0, 1.0])
        );
        assert_eq!(scene.bounds(), (Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0)));
    }

    #[test]
    fn images_have_a_budget_together() {
        assert!(fits(0, [8192, 8192]));
        assert!(fits(MOST_IMAGE_BYTES - 4, [1, 1]));
        assert!(!fits(MOST_IMAGE_BYTES, [1, 1]));
        assert!(!fits(u64::MAX, [1, 1]));
        assert!(!fits(0, [u32::MAX; 2]));
    }

    #[test]
    fn tangents_follow_u_and_bitangents_go_up_the_image() {
        let scene = load(SQUARE, &[0, 1, 2], [INDEXED, "", ""]).unwrap();
        let primitive = &scene.primitives[0];
        assert_eq!(
            (primitive.vertices.len(), primitive.pages.clone()),
            (3, vec![0..3; 1])
        );
        assert!(
            primitive
                .vertices
                .iter()
                .all(|v| v.tangent == [1.0, 0.0, 0.0, 1.0])
        );
    }

    #[test]
    fn mirroring_keeps_the_outside_out() {
        let node = r#", "scale": [-2, 1, 1]"#;
        let scene = load(SQUARE, &[0, 1, 2], [INDEXED, node, ""]).unwrap();
        let primitive = &scene.primitives[0];
        assert_eq!(faces(primitive), Vec3::new(0.0, 0.0, 2.0));
        assert!(
            primitive
                .vertices
                .iter()
                .all(|v| v.normal == [0.0, 0.0, 1.0])
        );
        assert!(
            primitive
                .vertices
                .iter()
                .all(|v| v.tangent == [-1.0, 0.0, 0.0, -1.0])
        );
    }

    #[test]
    fn profiles_come_from_extras_or_names() {
        let id = |material| load(SQUARE, &[0, 1, 2], [INDEXED, "", material]);
        let cases = [
            ("", 1),
            (r#""name": "Eye_L""#, 0),
            (r#""name": "eye", "extras": {"subsurface_profile": 7}"#, 7),
        ];
        for (material, expected) in cases {
            assert_eq!(
                id(material).unwrap().materials[0].profile_id,
                expected,
                "{material}"
            );
        }
        assert!(id(r#""extras": {"subsurface_profile": 256}"#).is_err());
    }

    #[test]
    fn bad_input_is_an_error_that_says_why() {
        let with = |json| load(SQUARE, &[0, 1, 2], json);
        let indices = |indices: &[u8]| load(SQUARE, indices, [INDEXED, "", ""]);
        let infinite = SQUARE.map(|[x, y, _]| [x, y, f32::INFINITY]);
        let twice = r#", "children": [1, 1]}, {"mesh": 0"#;
        let float_indices = format!(r#"{BARE}, "indices": 2"#);
        let short_glb = b"glTF\x02\0\0\0\x05\0\0\0";
        let cases = [
            (
                load(infinite, &[0, 1, 2], [INDEXED, "", ""]),
                "square: got NaN",
            ),
            (indices(&[0, 1, 9]), "index 9 of 4 vertices"),
            (indices(&[0, 1]), "2 corners"),
            (indices(&[1, 1, 2]), "no triangles"),
            (with([INDEXED, twice, ""]), "node 1 in two places"),
            (
                with([r#""attributes": {"POSITION": 7}"#, "", ""]),
                "POSITION",
            ),
            (with([&float_indices, "", ""]), "indices of Vec2"),
            (Scene::from_glb(short_glb), "shorter than its header"),
            (Scene::from_glb(b"{}"), "missing field"),
            (Scene::load(Path::new("no/such.glb")), "no/such.glb: got"),
        ];
        for (result, expected) in cases {
            let message = result.unwrap_err().to_string();
            assert!(
                message.contains(expected) && !message.contains('\n'),
                "{message}"
            );
        }
    }
}
