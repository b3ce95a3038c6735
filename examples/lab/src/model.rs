//! A small glTF file that has nothing wrong, and what is wrong of a scene that was read from another.

use std::io::Cursor;
use std::ops::Range;

use glam::Vec3;
use image::{ImageFormat, RgbImage};
use serde_json::{Value, json};
use subsurface::Profile;

use crate::renderer::{Primitive, Scene};

/// A square of skin with normals, UVs, indices and a picture, in accessors 0 to 3 and view 4.
#[derive(Clone, Debug)]
pub struct Model {
    pub json: Value,
    pub bytes: Vec<u8>,
}

impl Model {
    /// Where its bytes hold the positions.
    pub const POSITIONS: Range<usize> = 0..48;
    pub const NORMALS: Range<usize> = 48..96;
    pub const UVS: Range<usize> = 96..128;
    pub const INDICES: Range<usize> = 128..140;

    /// Another value at a place in the JSON, which may be new in its object; `null` takes it away.
    pub fn set(&mut self, place: &str, value: Value) {
        let (parent, key) = place.rsplit_once('/').expect("a place starts with /");
        match self.json.pointer_mut(parent).expect("a place that exists") {
            Value::Array(list) => list[key.parse::<usize>().expect("a number")] = value,
            Value::Object(map) if value.is_null() => drop(map.remove(key)),
            parent => parent[key] = value,
        }
    }

    /// Another picture.
    pub fn set_picture(&mut self, picture: &[u8]) {
        self.bytes.truncate(Self::INDICES.end);
        self.bytes.extend(picture);
        self.set("/bufferViews/4/byteLength", json!(picture.len()));
        self.set("/buffers/0/byteLength", json!(self.bytes.len()));
    }

    pub fn glb(&self) -> Vec<u8> {
        glb(self.json.to_string().as_bytes(), &self.bytes)
    }
}

impl Default for Model {
    fn default() -> Self {
        let corners = [[0.0f32, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let positions = corners.map(|[x, y]| [x, y, 0.0]);
        let indices = [0u16, 1, 2, 1, 3, 2];
        let picture = picture(ImageFormat::Png);
        let bytes = [
            bytemuck::cast_slice(&positions),
            bytemuck::cast_slice(&[[0.0f32, 0.0, 1.0]; 4]),
            bytemuck::cast_slice(&corners),
            bytemuck::cast_slice(&indices),
            &picture,
        ]
        .concat();
        let view =
            |part: Range<usize>| json!({"buffer": 0, "byteOffset": part.start, "byteLength": part.len()});
        let floats = |view: usize, shape: &str| json!({"bufferView": view, "componentType": 5126, "type": shape, "count": 4});
        let mut json = json!({
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"name": "square", "primitives": [{
                "attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2},
                "indices": 3,
                "material": 0,
            }]}],
            "materials": [{
                "name": "skin",
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
                "normalTexture": {"index": 0, "scale": 1.0},
            }],
            "textures": [{"source": 0}],
            "images": [{"bufferView": 4, "mimeType": "image/png"}],
            "accessors": [
                floats(0, "VEC3"),
                floats(1, "VEC3"),
                floats(2, "VEC2"),
                {"bufferView": 3, "componentType": 5123, "type": "SCALAR", "count": indices.len()},
            ],
            "bufferViews": [
                view(Self::POSITIONS),
                view(Self::NORMALS),
                view(Self::UVS),
                view(Self::INDICES),
                view(Self::INDICES.end..bytes.len()),
            ],
            "buffers": [{"byteLength": bytes.len()}],
        });
        json["accessors"][0]["min"] = json!([0, 0, 0]);
        json["accessors"][0]["max"] = json!([1, 1, 0]);
        Self { json, bytes }
    }
}

/// A binary glTF file of its two chunks.
pub fn glb(json: &[u8], bytes: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], with: u8| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), with);
        bytes
    };
    let (json, bytes) = (padded(json, b' '), padded(bytes, 0));
    let length = |n: usize| (n as u32).to_le_bytes();
    [
        &b"glTF\x02\0\0\0"[..],
        &length(28 + json.len() + bytes.len()),
        &length(json.len()),
        b"JSON",
        &json,
        &length(bytes.len()),
        b"BIN\0",
        &bytes,
    ]
    .concat()
}

/// Of 2 × 2 pixels.
pub fn picture(format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let picture = RgbImage::from_fn(2, 2, |x, y| image::Rgb([128, 100 * x as u8, 100 * y as u8]));
    picture.write_to(&mut bytes, format).expect("a picture fits in memory");
    bytes.into_inner()
}

/// What of a scene is not as its documentation says.
pub fn flaw_of_scene(scene: &Scene) -> Option<String> {
    let unit = |x: &f32| (0.0..=1.0).contains(x);
    let image = scene.images.iter().find(|image| {
        let pixels = image.width as usize * image.height as usize;
        pixels == 0 || image.rgba8.len() != 4 * pixels
    });
    let material = scene.materials.iter().find(|m| {
        let textures = [m.base_color_texture, m.normal_texture];
        textures.iter().flatten().any(|t| *t >= scene.images.len())
            || !m.base_color.iter().chain([&m.roughness, &m.alpha_cutoff]).all(unit)
            || !m.normal_scale.is_finite()
    });
    let primitive = scene.primitives.iter().find_map(|p| {
        let has_material = p.material < scene.materials.len();
        let flaw = if has_material { flaw_of_primitive(p) } else { Some("no material".into()) };
        flaw.map(|flaw| format!("{}: {flaw}", p.name))
    });
    let nothing = scene.primitives.is_empty().then(|| "no primitives".into());
    nothing
        .or(image.map(|image| format!("{}x{} pixels that are not there", image.width, image.height)))
        .or(material.map(|m| format!("{m:?}")))
        .or(primitive)
}

fn flaw_of_primitive(p: &Primitive) -> Option<String> {
    let is_unit = |v: &[f32]| (v.iter().map(|x| x * x).sum::<f32>().sqrt() - 1.0).abs() < 1e-3;
    let inside = |v: &[f32]| v.iter().all(|x| (0.0..=1.0).contains(x));
    let vertex = p.vertices.iter().find(|v| {
        let finite = bytemuck::cast_slice::<_, f32>(std::slice::from_ref(*v)).iter().all(|x| x.is_finite());
        let directed = is_unit(&v.normal) && is_unit(&v.tangent[..3]) && v.tangent[3].abs() == 1.0;
        !finite || !directed || !inside(&v.atlas_uv) || !inside(&v.mask)
    });
    let index = p.indices.iter().find(|i| **i as usize >= p.vertices.len());
    let count = p.indices.is_empty() || !p.indices.len().is_multiple_of(3);
    // Pages follow on each other and hold all indices, if there are any.
    let ends = [0].into_iter().chain(p.pages.iter().map(|page| page.end));
    let apart = p.pages.iter().zip(ends).any(|(page, end)| page.start != end || page.is_empty());
    let short = p.pages.last().is_some_and(|page| page.end as usize != p.indices.len());
    vertex
        .map(|v| format!("{v:?}"))
        .or(index.map(|i| format!("index {i} of {} vertices", p.vertices.len())))
        .or(count.then(|| format!("{} indices", p.indices.len())))
        .or((apart || short).then(|| format!("pages {:?}", p.pages)))
}

/// What of a profile is not as its documentation says.
pub fn flaw_of_profile(profile: &Profile) -> Option<String> {
    let gaussians = profile.gaussians();
    let numbers = gaussians.iter().flat_map(|g| g.weight.into_iter().chain([g.variance_mm2]));
    let fits = !gaussians.is_empty() && numbers.into_iter().all(|x| x.is_finite() && x >= 0.0);
    let sum: Vec3 = gaussians.iter().map(|g| Vec3::from(g.weight)).sum();
    let whole = (sum - 1.0).abs().max_element() < 1e-5;
    (!fits || !whole).then(|| format!("{profile:?}"))
}
