//! What the lab's renderer makes of glTF files as tools write them: each case after a public report.

use glam::{Mat4, Vec3};
use image::ImageFormat;
use proptest::collection::vec;
use proptest::prelude::*;
use serde_json::{Value, json};
use subsurface::wgpu::AddressMode;
use subsurface_lab::Error;
use subsurface_lab::damage::{Damage, Lie, config};
use subsurface_lab::model::{Model, flaw_of_scene, picture};
use subsurface_lab::renderer::{Camera, Material, Primitive, Scene, Vertex, View};

const SIZE: [u32; 2] = [256, 256];

/// An accessor of these numbers, added to the square's.
fn accessor<T: bytemuck::Pod>(
    model: &mut Model,
    numbers: &[T],
    component: u32,
    shape: &str,
    count: usize,
) -> usize {
    let view = model.json["bufferViews"].as_array().unwrap().len();
    model.bytes.resize(model.bytes.len().next_multiple_of(4), 0);
    let bytes: &[u8] = bytemuck::cast_slice(numbers);
    let view_json = json!({"buffer": 0, "byteOffset": model.bytes.len(), "byteLength": bytes.len()});
    model.bytes.extend(bytes);
    model.json["bufferViews"].as_array_mut().unwrap().push(view_json);
    model.set("/buffers/0/byteLength", json!(model.bytes.len()));
    add(model, json!({"bufferView": view, "componentType": component, "type": shape, "count": count}))
}

fn add(model: &mut Model, accessor: Value) -> usize {
    let accessors = model.json["accessors"].as_array_mut().unwrap();
    accessors.push(accessor);
    accessors.len() - 1
}

fn scene(change: impl FnOnce(&mut Model)) -> Scene {
    read(change).unwrap_or_else(|error| panic!("{error}"))
}

fn read(change: impl FnOnce(&mut Model)) -> Result<Scene, Error> {
    let mut model = Model::default();
    change(&mut model);
    Scene::from_glb(&model.glb())
}

fn require(model: &mut Model, extension: &str) {
    for place in ["/extensionsRequired", "/extensionsUsed"] {
        model.set(place, json!([extension]));
    }
}

fn bounds(scene: &Scene) -> [[f32; 3]; 2] {
    let (min, max) = scene.bounds();
    [min, max].map(|v| v.to_array().map(|x| (1e4 * x).round() / 1e4))
}

const ATTRIBUTES: &str = "/meshes/0/primitives/0/attributes";
const UNIT: [[f32; 3]; 2] = [[0.0; 3], [1.0, 1.0, 0.0]];

/// The square on one joint, whose inverse bind matrix this is.
fn rigged(model: &mut Model, bind: Mat4, nodes: Value) {
    let joints = accessor(model, &[[0u8; 4]; 4], 5121, "VEC4", 4);
    let weights = accessor(model, &[[1.0f32, 0.0, 0.0, 0.0]; 4], 5126, "VEC4", 4);
    let bind = accessor(model, &bind.to_cols_array(), 5126, "MAT4", 1);
    model.set(&format!("{ATTRIBUTES}/JOINTS_0"), json!(joints));
    model.set(&format!("{ATTRIBUTES}/WEIGHTS_0"), json!(weights));
    model.set("/skins", json!([{"joints": [1], "inverseBindMatrices": bind}]));
    model.set("/nodes", nodes);
    model.set("/scenes/0/nodes", json!([0, 1]));
}

#[test]
fn a_rigged_mesh_stands_as_its_joints_have_it() {
    let one = Mat4::IDENTITY;
    let up = Mat4::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let half = std::f32::consts::FRAC_1_SQRT_2; // of a quarter turn, as a quaternion
    let cases = [
        ("plain", one, json!([{"mesh": 0, "skin": 0}, {"name": "root"}]), UNIT),
        ("a node scaled", one, json!([{"mesh": 0, "skin": 0, "scale": [100, 100, 100]}, {}]), UNIT),
        (
            "a joint scaled",
            one,
            json!([{"mesh": 0, "skin": 0}, {"scale": [0.01, 0.01, 0.01]}]),
            [[0.0; 3], [0.01, 0.01, 0.0]],
        ),
        (
            "lying, but for its bind matrix",
            up,
            json!([{"mesh": 0, "skin": 0}, {"rotation": [-half, 0, 0, half]}]),
            UNIT,
        ),
        (
            "a joint outside of the scene's first node",
            Mat4::from_translation(Vec3::X),
            json!([{"mesh": 0, "skin": 0}, {"translation": [0, 0, 2]}]),
            [[1.0, 0.0, 2.0], [2.0, 1.0, 2.0]],
        ),
    ];
    for (name, bind, nodes, expected) in cases {
        assert_eq!(bounds(&scene(|m| rigged(m, bind, nodes))), expected, "{name}");
    }
    let error = read(|m| {
        rigged(m, one, json!([{"mesh": 0, "skin": 0}, {}]));
        let four = accessor(m, &[[4u8; 4]; 4], 5121, "VEC4", 4);
        m.set(&format!("{ATTRIBUTES}/JOINTS_0"), json!(four));
    });
    assert!(error.unwrap_err().to_string().contains("joint 4 of 1"));
}

#[test]
fn morph_targets_have_their_default_weights() {
    let target = |m: &mut Model| {
        let moves = [[0.0f32; 3], [1.0, 0.0, 0.0], [0.0, 0.5, 0.0], [1.0, 0.5, 0.0]];
        let moves = accessor(m, &moves, 5126, "VEC3", 4);
        m.set("/meshes/0/primitives/0/targets", json!([{"POSITION": moves}]));
    };
    let grown = [[0.0; 3], [2.0, 1.5, 0.0]];
    let by_mesh = scene(|m| {
        target(m);
        m.set("/meshes/0/weights", json!([1.0]));
    });
    assert_eq!(bounds(&by_mesh), grown);
    let by_node = scene(|m| {
        target(m);
        m.set("/meshes/0/weights", json!([0.0]));
        m.set("/nodes/0/weights", json!([0.5]));
    });
    assert_eq!(bounds(&by_node), [[0.0; 3], [1.5, 1.25, 0.0]]);
    assert_eq!(bounds(&scene(target)), UNIT);
}

#[test]
fn accessors_without_bytes_are_zeros_but_where_they_are_sparse() {
    let zeros = json!({"componentType": 5126, "type": "VEC3", "count": 4});
    let morphed = |sparse: bool| {
        scene(|m| {
            let at = accessor(m, &[1u16, 3], 5123, "SCALAR", 2);
            let with = accessor(m, &[[0.0f32, 0.0, -3.0]; 2], 5126, "VEC3", 2);
            let views = [at, with].map(|i| m.json["accessors"][i]["bufferView"].clone());
            let mut target = zeros.clone();
            if sparse {
                target["sparse"] = json!({"count": 2, "values": {"bufferView": views[1]},
                    "indices": {"bufferView": views[0], "componentType": 5123}});
            }
            let target = add(m, target);
            m.set("/meshes/0/primitives/0/targets", json!([{"POSITION": target}]));
            m.set("/meshes/0/weights", json!([1.0]));
        })
    };
    assert_eq!(bounds(&morphed(false)), UNIT);
    assert_eq!(bounds(&morphed(true)), [[0.0, 0.0, -3.0], [1.0, 1.0, 0.0]]);
}

#[test]
fn numbers_may_be_quantised() {
    let small = scene(|m| {
        let corners = [[0i16, 0, 0, 0], [32767, 0, 0, 0], [0, 16384, 0, 0], [32767, 16384, 0, 0]];
        let positions = accessor(m, &corners, 5122, "VEC3", 4);
        m.json["bufferViews"].as_array_mut().unwrap().last_mut().unwrap()["byteStride"] = json!(8);
        m.json["accessors"][positions]["normalized"] = json!(true);
        m.json["accessors"][positions]["min"] = json!([0, 0, 0]);
        m.json["accessors"][positions]["max"] = json!([1, 1, 1]);
        m.set(&format!("{ATTRIBUTES}/POSITION"), json!(positions));
        require(m, "KHR_mesh_quantization");
    });
    assert_eq!(bounds(&small), [[0.0; 3], [1.0, 0.5, 0.0]]);
}

/// The square by another list of triangles.
fn indexed(list: &[u16]) -> Result<Scene, Error> {
    read(|m| {
        let indices = accessor(m, list, 5123, "SCALAR", list.len());
        m.set("/meshes/0/primitives/0/indices", json!(indices));
    })
}

#[test]
fn what_is_left_of_a_list_of_triangles_is_left_out() {
    let seven = indexed(&[0, 1, 2, 1, 3, 2, 0]).unwrap();
    assert_eq!(seven.primitives[0].indices, [0, 1, 2, 1, 3, 2]);
    assert!(indexed(&[0, 1]).unwrap_err().to_string().contains("no triangles"));
}

#[test]
fn a_strip_and_a_fan_are_triangles() {
    for (mode, expected) in [(5, [0, 1, 2, 1, 3, 2]), (6, [1, 2, 0, 2, 3, 0])] {
        let scene = scene(|m| {
            m.set("/meshes/0/primitives/0/mode", json!(mode));
            m.set("/meshes/0/primitives/0/indices", Value::Null);
            m.set(ATTRIBUTES, json!({"POSITION": 0}));
        });
        let p = &scene.primitives[0];
        let x = |i: &u32| p.vertices[*i as usize].position.map(|x| x as u32);
        let corners: Vec<u32> = p.indices.iter().map(|i| x(i)[0] + 2 * x(i)[1]).collect();
        assert_eq!(corners, expected);
        assert!(p.pages.is_empty() && p.vertices.iter().all(|v| v.normal[2].abs() == 1.0));
    }
}

#[test]
fn tangents_follow_u_and_mirrors_keep_the_outside_out() {
    for (scale, tangent) in [([1, 1, 1], [1.0, 0.0, 0.0, -1.0]), ([-2, 1, 1], [-1.0, 0.0, 0.0, 1.0])] {
        let scene = scene(|m| m.set("/nodes/0/scale", json!(scale)));
        let p = &scene.primitives[0];
        let corner = |k| Vec3::from(p.vertices[p.indices[k] as usize].position);
        assert!((corner(1) - corner(0)).cross(corner(2) - corner(0)).z > 0.0);
        assert!(p.vertices.iter().all(|v| v.normal == [0.0, 0.0, 1.0] && v.tangent == tangent));
    }
}

/// The UVs of the square's last corner, and its material.
fn corner(scene: &Scene) -> ([f32; 2], &Material) {
    let p = &scene.primitives[0];
    let last = p.vertices.iter().find(|v| v.position == [1.0, 1.0, 0.0]).unwrap();
    (last.uv.map(|x| (1e4 * x).round() / 1e4), &scene.materials[p.material])
}

#[test]
fn textures_lie_where_the_file_lays_them() {
    let transform = |transform: Value| {
        scene(|m| {
            let info = json!({"index": 0, "extensions": {"KHR_texture_transform": transform}});
            m.set("/materials/0/pbrMetallicRoughness/baseColorTexture", info.clone());
            m.set("/materials/0/normalTexture", info);
        })
    };
    assert_eq!(corner(&transform(json!({"offset": [0.5, 0]}))).0, [1.5, 1.0]);
    assert_eq!(corner(&transform(json!({"scale": [2, 3]}))).0, [2.0, 3.0]);
    // Against the clock with v downwards: u becomes v, v becomes −u.
    let quarter = transform(json!({"rotation": std::f32::consts::FRAC_PI_2, "scale": [2, 1]}));
    assert_eq!(corner(&quarter).0, [1.0, -2.0]);
    assert!(corner(&quarter).1.normal_texture.is_some());

    let second = |set_of_normals: u32| {
        scene(|m| {
            let uvs = accessor(m, &[[0.25f32, 0.75]; 4], 5126, "VEC2", 4);
            m.set(&format!("{ATTRIBUTES}/TEXCOORD_1"), json!(uvs));
            m.set("/materials/0/pbrMetallicRoughness/baseColorTexture/texCoord", json!(1));
            m.set("/materials/0/normalTexture/texCoord", json!(set_of_normals));
        })
    };
    assert_eq!(corner(&second(1)).0, [0.25, 0.75]);
    assert!(corner(&second(1)).1.normal_texture.is_some());
    // Of two layouts the colours' is taken, and that is said.
    assert!(corner(&second(0)).1.normal_texture.is_none());
    assert!(
        second(0).notes().iter().any(|note| note.contains("skin's normal map")),
        "{:?}",
        second(0).notes()
    );

    let mirrored = scene(|m| {
        m.set("/samplers", json!([{"wrapS": 33648, "wrapT": 33071}]));
        m.set("/textures/0/sampler", json!(0));
    });
    assert_eq!(corner(&mirrored).1.wrap, [AddressMode::MirrorRepeat, AddressMode::ClampToEdge]);
}

#[test]
fn an_image_may_be_a_webp() {
    let scene = scene(|m| {
        m.set_picture(&picture(ImageFormat::WebP));
        m.set("/textures/0", json!({"extensions": {"EXT_texture_webp": {"source": 0}}}));
        require(m, "EXT_texture_webp");
    });
    assert_eq!(scene.images[0].rgba8[..8], [128, 0, 0, 255, 128, 100, 0, 255]);
}

#[test]
fn colours_come_from_vertices_and_older_materials_too() {
    let by_vertex = |component, shape, normalized, numbers: &[u8]| {
        scene(|m| {
            let colors = accessor(m, numbers, component, shape, 4);
            m.json["accessors"][colors]["normalized"] = json!(normalized);
            m.set(&format!("{ATTRIBUTES}/COLOR_0"), json!(colors));
        })
    };
    let red = bytemuck::cast_slice(&[[1.0f32, 0.0, 0.0]; 4]).to_vec();
    let red = by_vertex(5126, "VEC3", false, &red);
    assert!(red.primitives[0].vertices.iter().all(|v| v.color == [1.0, 0.0, 0.0, 1.0]));
    let green = by_vertex(5121, "VEC4", true, &[0, 255, 0, 51].repeat(4));
    assert!(green.primitives[0].vertices.iter().all(|v| v.color == [0.0, 1.0, 0.0, 0.2]));
    let old = scene(|m| {
        let old = json!({"diffuseFactor": [0.5, 0.25, 0.125, 1.0], "glossinessFactor": 0.75});
        m.set("/materials/0/extensions", json!({"KHR_materials_pbrSpecularGlossiness": old}));
    });
    let material = &old.materials[0];
    assert_eq!((material.base_color, material.roughness), ([0.5, 0.25, 0.125, 1.0], 0.25));
    assert_eq!((material.base_color_texture, material.profile_id), (None, 1));
}

#[test]
fn what_is_skin_is_told_and_can_be_said() {
    let with = |material: Value| scene(|m| m.set("/materials/0", material));
    let ids = [
        (json!({}), 1), // nothing says otherwise
        (json!({"name": "Eye_L"}), 0),
        (json!({"name": "eye", "extras": {"subsurface_profile": 7}}), 7),
        (json!({"name": "skin", "pbrMetallicRoughness": {"roughnessFactor": 0.5, "metallicFactor": 0}}), 1),
        (json!({"name": "skin", "pbrMetallicRoughness": {"roughnessFactor": 0.3, "metallicFactor": 1}}), 0),
        (json!({"name": "cards", "alphaMode": "BLEND"}), 0),
        (json!({"name": "Wolf3D_Skin", "alphaMode": "BLEND"}), 1),
        (json!({"name": "wax", "extensions": {"KHR_materials_volume_scatter": {}}}), 1),
    ];
    for (material, id) in ids {
        assert_eq!(with(material.clone()).materials[0].profile_id, id, "{material}");
    }

    // Two squares, one called skin.
    let mut scene = scene(|m| {
        m.set("/materials", json!([{"name": "Wolf3D_Skin"}, {"name": "Material.001"}]));
        m.set("/materials/0/emissiveFactor", json!([1, 0, 0]));
        let mut other = m.json["meshes"][0].clone();
        other["name"] = json!("cube");
        other["primitives"][0]["material"] = json!(1);
        m.json["meshes"].as_array_mut().unwrap().push(other);
        m.set("/nodes", json!([{"mesh": 0}, {"mesh": 1, "name": "Object"}]));
        m.set("/scenes/0/nodes", json!([0, 1]));
        m.set("/extensionsUsed", json!(["KHR_materials_clearcoat", "KHR_texture_transform"]));
    });
    let notes = [
        "Skin: Wolf3D_Skin (\"skin\").",
        "Not skin: Material.001 (no such name).",
        "Left out: KHR_materials_clearcoat, light that surfaces emit.",
    ];
    assert_eq!(scene.notes(), notes);
    let name = |name: &str| [name.to_string()];
    scene.choose(&name("Object"), true, "--skin").unwrap();
    scene.choose(&name("Wolf3D_Skin"), false, "--not-skin").unwrap();
    assert_eq!(scene.notes()[..2], ["Skin: Material.001 (--skin).", "Not skin: Wolf3D_Skin (--not-skin)."]);
    let error = scene.choose(&name("Skin"), true, "--skin").unwrap_err().to_string();
    assert_eq!(
        error,
        "--skin: got Skin, needs a name of the model: Material.001, Object, Wolf3D_Skin, cube, square"
    );
}

#[test]
fn what_lets_light_through_is_not_drawn() {
    let glass =
        json!({"name": "cornea", "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}});
    let scene = scene(|m| {
        m.json["materials"].as_array_mut().unwrap().push(glass);
        let mut other = m.json["meshes"][0]["primitives"][0].clone();
        other["material"] = json!(1);
        m.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(other);
    });
    assert_eq!(scene.primitives.len(), 1);
    assert!(scene.notes()[1].contains("square/1, which lets light through"), "{:?}", scene.notes());
}

#[test]
fn a_refusal_blames_what_is_wrong() {
    let required = |name: &str| {
        read(|m| {
            require(m, name);
            m.set("/accessors/0/bufferView", Value::Null);
        })
    };
    let set = |place: &str, value: Value| read(|m| m.set(place, value));
    let cases = [
        (required("KHR_draco_mesh_compression"), "glTF: got KHR_draco_mesh_compression, which"),
        (required("EXT_meshopt_compression"), "EXT_meshopt_compression, which"),
        (required("KHR_texture_basisu"), "needs JPEG, PNG or WebP images"),
        (required("EXT_mesh_gpu_instancing"), "EXT_mesh_gpu_instancing, which"),
        (
            set("/textures/0", json!({"extensions": {"KHR_texture_basisu": {"source": 0}}})),
            "texture 0: got no image, but [\"KHR_texture_basisu\"]",
        ),
        (
            read(|m| {
                m.set("/meshes/0/primitives/0/extensions", json!({"KHR_draco_mesh_compression": {}}));
                m.set("/accessors/0/bufferView", Value::Null);
            }),
            "square: got KHR_draco_mesh_compression",
        ),
        (set("/accessors/0/bufferView", Value::Null), "square: got POSITION without bytes"),
        (read(|m| m.set_picture(b"RIFF")), "image 0: got"),
        (indexed(&[0, 1, 9]), "square: got index 9 of 4 vertices"),
        (indexed(&[1, 1, 2]), "glTF: got nothing to draw (left out: square, which has no triangles)"),
        (set("/meshes/0/primitives/0/indices", json!(2)), "square: got indices of F32"),
        (set("/accessors/2/count", json!(3)), "square: got 3 elements of TEXCOORD_0 for 4 of POSITION"),
        (set("/accessors/0/type", json!("VEC2")), "mesh square: got POSITION of VEC2 of F32, needs VEC3"),
        (set("/nodes/0/children", json!([1])), "nodes[0].children[0]"),
        (set("/nodes", json!([{"mesh": 0, "children": [1, 1]}, {}])), "node 1 in two places"),
        (set("/nodes", json!([{"mesh": 0, "children": [0]}])), "nodes in a circle"),
        (set(&format!("{ATTRIBUTES}/POSITION"), json!(17)), "POSITION accessor that does not exist"),
        (
            set("/materials/0/extras", json!({"subsurface_profile": 256})),
            "skin, subsurface_profile: got 256",
        ),
        (set("/nodes/0/translation", json!([1e39, 0, 0])), "NaN or infinity"),
        (set("/buffers/0/byteLength", json!(1_000_000)), "of its byteLength"),
        (set("/bufferViews/0/byteOffset", json!(1_000_000)), "needs a view inside its buffer"),
        (set("/bufferViews/0/byteStride", json!(8)), "a byteStride of 8, needs no less than"),
        (Scene::from_glb(b"glTF\x01\0\0\0\x0c\0\0\0"), "got version 1, needs a glTF 2.0 file"),
        (Scene::from_glb(b"glTF\x02\0\0\0\x05\0\0\0"), "got 12 bytes for the 5 of its header"),
        (Scene::from_glb(b"solid cube"), "got no glTF, needs"),
        (Scene::from_glb("\u{feff}{}".as_bytes()), "missing field"),
        (Scene::from_glb(b"{}"), "missing field"),
        (Scene::load("no/such.glb".as_ref()), "no/such.glb: got"),
    ];
    for (result, expected) in cases {
        let message = result.err().map_or("no error".into(), |error| error.to_string());
        assert!(message.contains(expected) && !message.contains('\n'), "{message}, not {expected}");
    }
}

proptest! {
    #![proptest_config(config(512))]

    /// With all that the reader knows of, after lies in the JSON and damage to the bytes.
    #[test]
    fn a_character_that_lies_is_a_scene_or_an_error(
        lies in vec(any::<Lie>(), 1..4),
        damage in vec(any::<Damage>(), 0..3),
    ) {
        let mut m = Model::default();
        rigged(&mut m, Mat4::IDENTITY, json!([{"mesh": 0, "skin": 0, "weights": [0.5]}, {"name": "Head"}]));
        let colors = accessor(&mut m, &[255u8; 16], 5121, "VEC4", 4);
        let moves = accessor(&mut m, &[[0.0f32, 0.0, 1.0]], 5126, "VEC3", 1);
        let at = accessor(&mut m, &[1u8], 5121, "SCALAR", 1);
        let views = [moves, at].map(|i| m.json["accessors"][i]["bufferView"].clone());
        let target = add(&mut m, json!({"componentType": 5126, "type": "VEC3", "count": 4, "sparse": {
            "count": 1, "values": {"bufferView": views[0]},
            "indices": {"bufferView": views[1], "componentType": 5121},
        }}));
        m.set("/meshes/0/primitives/0/targets", json!([{"POSITION": target, "NORMAL": target}]));
        m.set(&format!("{ATTRIBUTES}/COLOR_0"), json!(colors));
        m.set(&format!("{ATTRIBUTES}/TEXCOORD_1"), json!(2));
        m.set("/materials/0/normalTexture/extensions", json!({"KHR_texture_transform": {"scale": [2, 2]}}));
        prop_assert!(Scene::from_glb(&m.glb()).is_ok());
        lies.iter().for_each(|lie| lie.tell(&mut m.json));
        damage.iter().for_each(|damage| damage.apply(&mut m.bytes));
        match Scene::from_glb(&m.glb()) {
            Ok(scene) => {
                prop_assert_eq!(flaw_of_scene(&scene), None);
                Camera::framing(&scene, View::CloseUp, SIZE);
            }
            Err(error) => prop_assert!(error.to_string().contains(": got ")),
        }
    }
}

/// Ellipsoids, each by its middle and its semi-axes along x, y and z after it was turned about z and x.
fn body(parts: &[(Vec3, Vec3, Mat4)]) -> Primitive {
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    for (middle, size, turn) in parts {
        let first = vertices.len() as u32;
        for i in 0..=24u32 {
            for j in 0..=32u32 {
                let (a, b) =
                    (i as f32 / 24.0 * std::f32::consts::PI, j as f32 / 32.0 * std::f32::consts::TAU);
                let p = *size * Vec3::new(a.sin() * b.sin(), a.cos(), a.sin() * b.cos());
                let position = (*middle + turn.transform_vector3(p)).to_array();
                vertices.push(Vertex { position, ..bytemuck::Zeroable::zeroed() });
                if i < 24 && j < 32 {
                    let k = first + 33 * i + j;
                    indices.extend([k, k + 33, k + 1, k + 1, k + 33, k + 34]);
                }
            }
        }
    }
    Primitive {
        name: "body".into(),
        node: String::new(),
        head: None,
        vertices,
        indices,
        material: 0,
        pages: Vec::new(),
        procedural: false,
    }
}

/// A person of 1.75 m whose arms point from the shoulders in these directions, the left one's x to the left.
fn person(arms: [Vec3; 2]) -> Vec<(Vec3, Vec3, Mat4)> {
    let still = Mat4::IDENTITY;
    let mut parts = vec![
        (Vec3::new(0.0, 1.635, 0.0), Vec3::new(0.075, 0.115, 0.095), still),
        (Vec3::new(0.0, 1.62, 0.095), Vec3::new(0.012, 0.02, 0.02), still), // the nose
        (Vec3::new(0.0, 1.48, -0.01), Vec3::new(0.055, 0.12, 0.055), still),
        (Vec3::new(0.0, 1.2, 0.0), Vec3::new(0.17, 0.25, 0.11), still),
        (Vec3::new(0.0, 1.38, 0.0), Vec3::new(0.2, 0.06, 0.08), still),
        (Vec3::new(0.0, 0.95, 0.0), Vec3::new(0.17, 0.14, 0.12), still),
    ];
    for (side, arm) in [-1.0, 1.0].into_iter().zip(arms) {
        let arm = (arm * Vec3::new(side, 1.0, 1.0)).normalize();
        let turn = Mat4::from_quat(glam::Quat::from_rotation_arc(Vec3::Y, arm));
        let shoulder = Vec3::new(0.19 * side, 1.38, 0.0);
        parts.push((shoulder + 0.3 * arm, Vec3::new(0.045, 0.32, 0.045), turn));
        parts.push((shoulder + 0.68 * arm, Vec3::new(0.045, 0.1, 0.02), turn)); // the hand
        parts.push((Vec3::new(0.1 * side, 0.48, 0.0), Vec3::new(0.08, 0.48, 0.08), still));
        parts.push((Vec3::new(0.1 * side, 0.04, 0.06), Vec3::new(0.05, 0.04, 0.13), still));
    }
    parts
}

fn naked(body: Primitive) -> Scene {
    let skin = scene(|_| ()).materials.remove(0);
    Scene { primitives: vec![body], materials: vec![skin], ..Scene::default() }
}

/// That every view frames a head of this middle and height, and the close-up a face with this nose.
fn assert_finds(scene: &Scene, name: &str, head: Vec3, height: f32, nose: Vec3) {
    for view in [View::Front, View::ThreeQuarter, View::Profile] {
        let camera = Camera::framing(scene, view, SIZE);
        let seen = 2.0 * camera.eye.distance(camera.target) * (camera.fov_y / 2.0).tan();
        assert!(camera.target.distance(head) < 0.3 * height, "{name}: {view:?} of {}", camera.target);
        assert!((0.9 * height..2.5 * height).contains(&seen), "{name}: {seen} of {height} in {view:?}");
    }
    let target = Camera::framing(scene, View::CloseUp, SIZE).target;
    assert!(target.distance(nose) < 0.15 * height, "{name}: a close-up of {target}, not of {nose}");
}

#[test]
fn views_find_the_face_of_a_body_in_any_pose() {
    let (head, nose) = (Vec3::new(0.0, 1.635, 0.0), Vec3::new(0.0, 1.62, 0.115));
    let (down, out, ahead) = (Vec3::new(0.2, -1.0, 0.0), Vec3::X, Vec3::new(0.1, 0.1, 1.0));
    let up = Vec3::new(0.15, 1.0, 0.0);
    let poses = [
        ("arms down", [down, down]),
        ("A", [Vec3::new(1.0, -1.0, 0.0); 2]),
        ("T", [out, out]),
        ("one arm ahead", [ahead, down]),
        ("both arms ahead", [ahead, ahead]),
        ("both arms ahead, level", [Vec3::new(0.05, 0.02, 1.0); 2]),
        ("one arm up", [down, up]),
        ("both arms up", [up, up]),
    ];
    for (name, arms) in poses {
        assert_finds(&naked(body(&person(arms))), name, head, 0.23, nose);
    }
    // A child: less of a body below a head as large.
    let mut child = person([down, down]);
    for (middle, size, _) in &mut child[3..] {
        middle.y = 1.42 - 0.55 * (1.42 - middle.y);
        size.y *= 0.55;
    }
    assert_finds(&naked(body(&child)), "a child", head, 0.23, nose);
}

#[test]
fn views_find_the_face_by_joints_names_and_eyes() {
    let (head, nose) = (Vec3::new(0.0, 1.635, 0.0), Vec3::new(0.0, 1.62, 0.115));
    let ahead = Vec3::new(0.1, 0.1, 1.0);
    let parts = person([ahead, ahead]);
    // Lying on its back, with no plane across that could tell the head.
    let lie = Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let lying: Vec<_> = parts.iter().map(|(m, s, t)| (lie.transform_point3(*m), *s, lie * *t)).collect();
    let mut by_joint = naked(body(&lying));
    let of_head = lie.transform_point3(head);
    let reach = Vec3::new(0.075, 0.115, 0.115);
    by_joint.primitives[0].head = Some((of_head - reach, of_head + reach));
    let target = Camera::framing(&by_joint, View::Front, SIZE).target;
    assert!(target.distance(of_head) < 0.08, "{target}, not {of_head}");

    let mut by_name = naked(body(&parts[2..]));
    by_name.primitives.push(Primitive { name: "Wolf3D_Head".into(), ..body(&parts[..2]) });
    assert_finds(&by_name, "a mesh called head", head, 0.23, nose);

    // One that looks the other way, as VRM 0 has it, and whose eyes are joints.
    let about = Mat4::from_rotation_y(std::f32::consts::PI);
    let away: Vec<_> = parts.iter().map(|(m, s, t)| (about.transform_point3(*m), *s, about * *t)).collect();
    let mut by_eyes = naked(body(&away));
    by_eyes.eyes = vec![Vec3::new(0.032, 1.65, -0.08), Vec3::new(-0.032, 1.65, -0.08)];
    assert_finds(&by_eyes, "eyes", head, 0.23, Vec3::new(0.0, 1.62, -0.115));
    assert!(Camera::framing(&by_eyes, View::Front, SIZE).eye.z < -0.3);

    let camera = Camera::looking_at(&by_name, View::Profile, Vec3::Y, 0.4);
    assert!(camera.eye.distance(Vec3::new(-0.4, 1.0, 0.0)) < 1e-5 && camera.target == Vec3::Y);
    let front = camera.turned(-std::f32::consts::FRAC_PI_2);
    assert!(front.eye.distance(Vec3::new(0.0, 1.0, 0.4)) < 1e-5, "{}", front.eye);
}
