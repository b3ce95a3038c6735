//! What there is to draw: triangles in world space, their materials and images.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

use crate::Error;
#[cfg(feature = "programs")]
use crate::srgb;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::reader;

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
    /// Multiplies the base colour, linear with alpha, 0 to 1.
    pub color: [f32; 4],
}

/// Triangles of one material.
#[derive(Clone, Debug)]
pub struct Primitive {
    /// The mesh's name, followed by the primitive's number if the mesh has several.
    pub name: String,
    /// The name of the node that has the mesh; empty if it has none.
    pub node: String,
    /// Least and greatest corner of what moves with a joint called head, if there is one.
    pub head: Option<(Vec3, Vec3)>,
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
    /// How both textures go on beyond u and v of 0 to 1.
    pub wrap: [wgpu::AddressMode; 2],
    /// Multiplies the x and y of the normal map; 1 by default.
    pub normal_scale: f32,
    /// glTF's roughness 0 to 1, the square root of the micro-facets' slope; of skin, the
    /// lighting says it.
    pub roughness: f32,
    /// Alpha below this is cut out, 0 to 1; 0 for opaque surfaces. Blended ones are cut at 0.5.
    pub alpha_cutoff: f32,
    /// Which scattering profile the surface has, 0 for none.
    pub profile_id: u8,
    /// What tells that it is skin, or not.
    pub reason: String,
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

#[cfg(feature = "programs")]
impl Image {
    /// Its mean, as linear light.
    fn mean(&self) -> Vec3 {
        let mut counts = [[0u32; 256]; 3];
        for texel in self.rgba8.chunks_exact(4) {
            for (count, byte) in counts.iter_mut().zip(texel) {
                count[usize::from(*byte)] += 1;
            }
        }
        let pixels = (self.rgba8.len() / 4).max(1) as f32;
        let mean = |counts: [u32; 256]| {
            (0..=255u8).zip(counts).map(|(byte, count)| srgb::decode(byte) * count as f32).sum::<f32>()
                / pixels
        };
        Vec3::from(counts.map(mean))
    }
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
    /// Where the joints of eyes are, in scene units.
    pub eyes: Vec<Vec3>,
    /// What the file has and this renderer does not show.
    pub left_out: BTreeSet<String>,
}

impl Scene {
    /// Reads a `.glb` or `.gltf` file and the files it refers to.
    ///
    /// # Errors
    /// Names the file or the primitive that cannot be used, and why.
    pub fn load(path: &Path) -> Result<Scene, Error> {
        let input = path.display().to_string();
        let fail = |e: std::io::Error| Error::new(&input, e, "a readable file");
        let bytes = std::fs::read(path).map_err(fail)?;
        reader::read(&bytes, path.parent(), &input)
    }

    /// Reads a glTF file from memory; it must not refer to other files.
    ///
    /// # Errors
    /// Names the primitive that cannot be used, or "glTF" for the whole, and why.
    pub fn from_glb(bytes: &[u8]) -> Result<Scene, Error> {
        reader::read(bytes, None, "glTF")
    }

    /// Makes skin of what a name stands for, or something else: materials, meshes or nodes of that name.
    ///
    /// # Errors
    /// A name that stands for nothing; `option` is the error's input.
    pub fn choose(&mut self, names: &[String], is_skin: bool, option: &str) -> Result<(), Error> {
        for name in names {
            let mut found = false;
            for i in 0..self.primitives.len() {
                let primitive = &self.primitives[i];
                let mut material = self.materials[primitive.material].clone();
                if ![&material.name, &primitive.name, &primitive.node].contains(&name) {
                    continue;
                }
                found = true;
                material.profile_id = match is_skin {
                    true => material.profile_id.max(1),
                    false => 0,
                };
                material.reason = option.into();
                self.primitives[i].material = self.material(material);
            }
            if !found {
                let names = self
                    .primitives
                    .iter()
                    .flat_map(|p| [&self.materials[p.material].name, &p.name, &p.node].map(String::as_str));
                let names: BTreeSet<&str> = names.filter(|name| !name.is_empty()).collect();
                let needs = names.into_iter().collect::<Vec<_>>().join(", ");
                return Err(Error::new(option, name, format!("a name of the model: {needs}")));
            }
        }
        Ok(())
    }

    /// Gives skin an albedo, linear RGB: in the mean over each material's texture, whose detail stays.
    #[cfg(feature = "programs")]
    pub fn color_skin(&mut self, albedo: Vec3) {
        for material in self.materials.iter_mut().filter(|m| m.profile_id != 0) {
            let mean = material.base_color_texture.map_or(Vec3::ONE, |i| self.images[i].mean());
            // Black skin has no detail to keep.
            let factor = albedo / mean.max(Vec3::splat(1e-3));
            material.base_color = factor.extend(material.base_color[3]).to_array();
        }
    }

    /// Where this material is among the scene's, added if it is new.
    pub(super) fn material(&mut self, material: Material) -> usize {
        let known = self.materials.iter().position(|m| *m == material);
        known.unwrap_or_else(|| {
            self.materials.push(material);
            self.materials.len() - 1
        })
    }

    /// What was taken for skin and what not, each with its reason, and what was left out: a sentence each.
    pub fn notes(&self) -> Vec<String> {
        let materials = |is_skin: bool| -> BTreeSet<String> {
            let materials = self.primitives.iter().map(|p| &self.materials[p.material]);
            let chosen = materials.filter(|m| (m.profile_id != 0) == is_skin);
            chosen.map(|m| format!("{} ({})", m.name, m.reason)).collect()
        };
        let lists = [
            ("Skin", materials(true)),
            ("Not skin", materials(false)),
            ("Left out", self.left_out.clone()),
        ];
        let some = lists.into_iter().filter(|(_, list)| !list.is_empty());
        some.map(|(title, list)| format!("{title}: {}.", Vec::from_iter(list).join(", "))).collect()
    }

    /// Least and greatest corner of the world-space box around everything; zeros if there is nothing.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        bounds(self.primitives.iter())
    }

    /// The box around the primitives that scatter, or around everything if none does.
    pub fn skin_bounds(&self) -> (Vec3, Vec3) {
        bounds(self.skin().into_iter())
    }

    /// The primitives that scatter, or all if none does.
    pub(super) fn skin(&self) -> Vec<&Primitive> {
        let scatters = |p: &&Primitive| self.materials.get(p.material).is_some_and(|m| m.profile_id != 0);
        let skin: Vec<_> = self.primitives.iter().filter(scatters).collect();
        if skin.is_empty() { self.primitives.iter().collect() } else { skin }
    }
}

fn bounds<'a>(primitives: impl Iterator<Item = &'a Primitive>) -> (Vec3, Vec3) {
    let points = primitives.flat_map(|p| &p.vertices).map(|v| Vec3::from(v.position));
    around(points).unwrap_or_default()
}

/// Least and greatest corner of the box around points.
pub(super) fn around(points: impl Iterator<Item = Vec3>) -> Option<(Vec3, Vec3)> {
    points.map(|p| (p, p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}
