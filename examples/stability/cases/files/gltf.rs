//! glTF files that are cut short, or lie.

use image::ImageFormat;
use serde_json::{Value, json};
use subsurface::Error;
use subsurface::renderer::Scene;

use super::attempt::{Attempt, Wanted};
use crate::model::{Model, flaw_of_scene, glb, picture};

const HEAD: &[u8] = include_bytes!("../../../compare/head.glb");

/// What is changed of a model that has nothing wrong.
type Change = fn(&mut Model);

pub fn attempt(name: impl Into<String>, wanted: Wanted, bytes: Vec<u8>) -> Attempt {
    Attempt::new(name, wanted, move || {
        Scene::from_glb(&bytes).map(|scene| flaw_of_scene(&scene))
    })
}

fn changed(wanted: Wanted, changes: &[(&'static str, Change)]) -> Vec<Attempt> {
    let attempts = changes.iter().map(|(name, change)| {
        let mut model = Model::new();
        change(&mut model);
        attempt(*name, wanted, model.glb())
    });
    attempts.collect()
}

/// The built-in head up to each of these lengths.
pub fn cut(step: usize) -> Vec<Attempt> {
    let lengths = (0..HEAD.len()).step_by(step);
    lengths
        .map(|n| attempt(format!("{n} bytes"), Wanted::Refused, HEAD[..n].to_vec()))
        .collect()
}

/// The same, where the lengths of the file and of its last chunk say that this is all.
pub fn cut_and_closed(step: usize) -> Vec<Attempt> {
    let word = |at: usize| {
        let bytes = HEAD[at..at + 4].try_into().expect("four bytes");
        u32::from_le_bytes(bytes) as usize
    };
    let json = &HEAD[20..20 + word(12)];
    let bytes = &HEAD[20 + json.len() + 8..];
    let of_json = (0..json.len())
        .step_by(step.min(1024))
        .map(|n| (&json[..n], bytes));
    let of_bytes = (0..bytes.len()).step_by(step).map(|n| (json, &bytes[..n]));
    of_json
        .chain(of_bytes)
        .map(|(json, bytes)| {
            let name = format!("{} bytes of JSON, {} of data", json.len(), bytes.len());
            attempt(name, Wanted::Refused, glb(json, bytes))
        })
        .collect()
}

/// Headers and chunks.
pub fn containers() -> Vec<Attempt> {
    let whole = Model::new().glb();
    let with = |at: usize, bytes: &[u8]| {
        let mut file = whole.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        file
    };
    let json_end = 20 + u32::from_le_bytes([whole[12], whole[13], whole[14], whole[15]]) as usize;
    let json = &whole[20..json_end];
    let refused: Vec<(&str, Vec<u8>)> = vec![
        ("nothing", vec![]),
        ("zeros", vec![0; 4096]),
        ("another magic", with(0, b"glTG")),
        ("version 1", with(4, &[1])),
        ("version 3", with(4, &[3])),
        ("a length of 0", with(8, &[0; 4])),
        ("a length of 11", with(8, &[11, 0, 0, 0])),
        (
            "a length of 12",
            with(8, &[12, 0, 0, 0]).into_iter().take(12).collect(),
        ),
        ("a length of 4 GiB", with(8, &[255; 4])),
        ("JSON of 0 bytes", with(12, &[0; 4])),
        ("JSON of 4 GiB", with(12, &[255; 4])),
        ("binary before JSON", with(16, b"BIN\0")),
        ("JSON twice", with(json_end + 4, b"JSON")),
        ("a chunk of no kind", with(16, b"NONE")),
        ("a chunk of 4 GiB", with(json_end, &[255; 4])),
        ("no UTF-8", with(24, &[0xff])),
        ("a mark of byte order", [b"\xef\xbb\xbf", json].concat()),
        ("no chunk of bytes", [b"", json].concat()),
        ("a string that is JSON", b"\"glTF\"".to_vec()),
        ("a list", b"[]".to_vec()),
        ("an object", b"{}".to_vec()),
        ("an unfinished object", b"{\"asset\": {".to_vec()),
        (
            "100000 brackets",
            [b"[".repeat(100_000), b"]".repeat(100_000)].concat(),
        ),
        ("100000 braces", b"{\"a\":".repeat(100_000)),
    ];
    refused
        .into_iter()
        .map(|(name, bytes)| attempt(name, Wanted::Refused, bytes))
        .collect()
}

/// Counts, offsets and lengths.
pub fn extents() -> Vec<Attempt> {
    let mut attempts = Vec::new();
    let numbers = [
        json!(-1),
        json!(0.5),
        json!("4"),
        json!(1e30),
        json!(1 << 20),
        json!(u32::MAX),
        json!(1u64 << 40),
        json!(i64::MAX),
        json!(u64::MAX),
        json!(u64::MAX - 11),
    ];
    let places = |key: &str, list: &str, n: usize| -> Vec<String> {
        (0..n).map(|i| format!("/{list}/{i}/{key}")).collect()
    };
    let places = [
        places("count", "accessors", 4),
        places("byteOffset", "accessors", 4),
        places("byteOffset", "bufferViews", 5),
        places("byteLength", "bufferViews", 5),
        places("byteStride", "bufferViews", 4),
    ];
    for place in places.concat() {
        for number in &numbers {
            let mut model = Model::new();
            model.set(&place, number.clone());
            attempts.push(attempt(
                format!("{place} of {number}"),
                Wanted::Refused,
                model.glb(),
            ));
        }
    }
    attempts.extend(changed(
        Wanted::Refused,
        &[
            ("no vertices", |m| {
                (0..3).for_each(|i| m.set(&format!("/accessors/{i}/count"), json!(0)));
            }),
            ("no indices", |m| m.set("/accessors/3/count", json!(0))),
            ("five indices", |m| m.set("/accessors/3/count", json!(5))),
            ("more normals than vertices", |m| {
                m.set("/accessors/0/count", json!(3))
            }),
            ("views of no length", |m| {
                m.set("/bufferViews/0/byteLength", json!(0))
            }),
            ("vertices closer than they are long", |m| {
                m.set("/bufferViews/0/byteStride", json!(4))
            }),
            ("a stride of 3", |m| {
                m.set("/bufferViews/0/byteStride", json!(3))
            }),
            ("a stride of 256", |m| {
                m.set("/bufferViews/0/byteStride", json!(256))
            }),
            ("an offset and a length that overflow", |m| {
                m.set("/bufferViews/0/byteOffset", json!(u64::MAX));
                m.set("/bufferViews/0/byteLength", json!(2));
            }),
        ],
    ));
    attempts
}

/// References to what does not exist, or is of another kind.
pub fn references() -> Vec<Attempt> {
    let places = [
        "/scene",
        "/scenes/0/nodes/0",
        "/nodes/0/mesh",
        "/meshes/0/primitives/0/attributes/POSITION",
        "/meshes/0/primitives/0/attributes/NORMAL",
        "/meshes/0/primitives/0/attributes/TEXCOORD_0",
        "/meshes/0/primitives/0/indices",
        "/meshes/0/primitives/0/material",
        "/materials/0/pbrMetallicRoughness/baseColorTexture/index",
        "/materials/0/normalTexture/index",
        "/textures/0/source",
        "/images/0/bufferView",
        "/accessors/0/bufferView",
        "/accessors/3/bufferView",
        "/bufferViews/0/buffer",
    ];
    let mut attempts = Vec::new();
    for place in places {
        for number in [
            json!(9),
            json!(-1),
            json!(u32::MAX),
            json!(u64::MAX),
            json!("0"),
        ] {
            let mut model = Model::new();
            model.set(place, number.clone());
            attempts.push(attempt(
                format!("{place} of {number}"),
                Wanted::Refused,
                model.glb(),
            ));
        }
    }
    attempts.extend(changed(
        Wanted::Refused,
        &[
            ("an index of as many vertices", |m| {
                m.bytes[Model::INDICES.start] = 4
            }),
            ("an index of 65535", |m| m.bytes[Model::INDICES].fill(255)),
            ("indices that are floats", |m| {
                m.set("/accessors/3/componentType", json!(5126))
            }),
            ("indices that are signed", |m| {
                m.set("/accessors/3/componentType", json!(5122))
            }),
            ("indices that are vectors", |m| {
                m.set("/accessors/3/type", json!("VEC2"))
            }),
            ("positions in whole numbers", |m| {
                m.set("/accessors/0/componentType", json!(5123))
            }),
            ("positions in a plane", |m| {
                m.set("/accessors/0/type", json!("VEC2"))
            }),
            ("positions that are matrices", |m| {
                m.set("/accessors/0/type", json!("MAT4"))
            }),
            ("a type that there is not", |m| {
                m.set("/accessors/0/type", json!("VEC5"))
            }),
            ("a component that there is not", |m| {
                m.set("/accessors/0/componentType", json!(5127))
            }),
            ("a mode that there is not", |m| {
                m.set("/meshes/0/primitives/0/mode", json!(7))
            }),
            ("no positions", |m| {
                m.set("/meshes/0/primitives/0/attributes/POSITION", Value::Null)
            }),
            ("sparse positions", |m| {
                m.set(
                    "/accessors/0/sparse",
                    json!({
                        "count": 1,
                        "indices": {"bufferView": 3, "componentType": 5123},
                        "values": {"bufferView": 0},
                    }),
                )
            }),
            ("sparse positions of 4 billion", |m| {
                m.set(
                    "/accessors/0/sparse",
                    json!({
                        "count": u32::MAX,
                        "indices": {"bufferView": 3, "componentType": 5123},
                        "values": {"bufferView": 0},
                    }),
                )
            }),
            ("positions of no view", |m| {
                m.set("/accessors/0/bufferView", Value::Null)
            }),
            ("an extension that is required", |m| {
                m.set("/extensionsRequired", json!(["KHR_draco_mesh_compression"]));
            }),
        ],
    ));
    attempts
}

/// Trees of nodes.
pub fn nodes() -> Vec<Attempt> {
    let tree = |name: &str, wanted, nodes: Vec<Value>| {
        let mut model = Model::new();
        model.set("/nodes", Value::Array(nodes));
        attempt(name, wanted, model.glb())
    };
    let to = |child: usize| json!({"children": [child]});
    let chain = |n: usize, last: Value| (1..n).map(to).chain([last]).collect::<Vec<_>>();
    let wide = json!({"children": (1..100_001).collect::<Vec<_>>()});
    let leaves = std::iter::repeat_n(json!({}), 99_999);
    let mut attempts = vec![
        tree(
            "a node that is its own child",
            Wanted::Refused,
            vec![json!({"mesh": 0, "children": [0]})],
        ),
        tree(
            "two nodes in a circle",
            Wanted::Refused,
            vec![to(1), json!({"mesh": 0, "children": [0]})],
        ),
        tree(
            "a child twice",
            Wanted::Refused,
            vec![json!({"children": [1, 1]}), json!({"mesh": 0})],
        ),
        tree(
            "a child of two",
            Wanted::Refused,
            vec![json!({"children": [1, 2]}), to(2), json!({"mesh": 0})],
        ),
        tree("a circle of 100000", Wanted::Refused, chain(100_000, to(0))),
        tree(
            "100000 nodes deep",
            Wanted::Taken,
            chain(100_000, json!({"mesh": 0})),
        ),
        tree(
            "100000 children",
            Wanted::Taken,
            [wide]
                .into_iter()
                .chain(leaves)
                .chain([json!({"mesh": 0})])
                .collect(),
        ),
        // Not finite, the further down.
        tree(
            "200 nodes that each double and double",
            Wanted::Refused,
            (1..200)
                .map(|i| json!({"children": [i], "scale": [4, 4, 4]}))
                .chain([json!({"mesh": 0})])
                .collect(),
        ),
        // Every doubling of a tree that shares its nodes would double what there is to draw.
        tree(
            "nodes that share their children, 60 deep",
            Wanted::Refused,
            (1..60)
                .map(|i| json!({"children": [i, i]}))
                .chain([json!({"mesh": 0})])
                .collect(),
        ),
    ];
    attempts.extend(changed(
        Wanted::Refused,
        &[
            ("a circle that no scene names", |m| {
                m.set("/scene", Value::Null);
                m.set("/scenes", Value::Null);
                m.set(
                    "/nodes",
                    json!([{"mesh": 0, "children": [1]}, {"children": [0]}]),
                );
            }),
            ("a node that two scenes name", |m| {
                m.set("/scenes/0/nodes", json!([0, 0]))
            }),
        ],
    ));
    attempts
}

/// Numbers that are none, or too large.
pub fn numbers() -> Vec<Attempt> {
    let mut attempts = Vec::new();
    let parts = [
        ("position", Model::POSITIONS.start),
        ("normal", Model::NORMALS.start),
        ("UV", Model::UVS.start),
    ];
    for (what, at) in parts {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut model = Model::new();
            model.bytes[at..at + 4].copy_from_slice(&bad.to_le_bytes());
            attempts.push(attempt(
                format!("a {what} of {bad}"),
                Wanted::Refused,
                model.glb(),
            ));
        }
        // A number, if not of this world.
        for odd in [f32::MAX, f32::MIN, f32::MIN_POSITIVE, 1e-45, -0.0] {
            let mut model = Model::new();
            model.bytes[at..at + 4].copy_from_slice(&odd.to_le_bytes());
            attempts.push(attempt(
                format!("a {what} of {odd}"),
                Wanted::Either,
                model.glb(),
            ));
        }
    }
    attempts.extend(changed(
        Wanted::Refused,
        &[
            ("a scale of 1e39", |m| {
                m.set("/nodes/0/scale", json!([1e39, 1, 1]))
            }),
            ("a rotation of 1e39", |m| {
                m.set("/nodes/0/rotation", json!([1e39, 0, 0, 1]))
            }),
            ("a shift of 1e39", |m| {
                m.set("/nodes/0/translation", json!([0, 0, 1e39]))
            }),
            ("a matrix of 1e39", |m| {
                m.set("/nodes/0/matrix", json!(vec![1e39; 16]))
            }),
            ("a matrix of 15 numbers", |m| {
                m.set("/nodes/0/matrix", json!(vec![1; 15]))
            }),
            ("a normal scale of 1e39", |m| {
                m.set("/materials/0/normalTexture/scale", json!(1e39))
            }),
            ("a profile of 1e39", |m| {
                m.set("/materials/0/extras", json!({"subsurface_profile": 1e39}))
            }),
            ("a profile of -1", |m| {
                m.set("/materials/0/extras", json!({"subsurface_profile": -1}))
            }),
            ("a profile of 256", |m| {
                m.set("/materials/0/extras", json!({"subsurface_profile": 256}))
            }),
            ("a profile of a half", |m| {
                m.set("/materials/0/extras", json!({"subsurface_profile": 0.5}))
            }),
            ("a profile that is a name", |m| {
                m.set("/materials/0/extras", json!({"subsurface_profile": "skin"}))
            }),
        ],
    ));
    attempts.extend(changed(
        Wanted::Either,
        &[
            ("a scale of nothing", |m| {
                m.set("/nodes/0/scale", json!([0, 0, 0]))
            }),
            ("a matrix of zeros", |m| {
                m.set("/nodes/0/matrix", json!(vec![0; 16]))
            }),
            ("a scale of 1e18", |m| {
                m.set("/nodes/0/scale", json!([1e18, 1e18, 1e18]))
            }),
            ("a scale of 1e-30", |m| {
                m.set("/nodes/0/scale", json!([1e-30, 1e-30, 1e-30]))
            }),
            ("a colour of 1e39", |m| {
                m.set(
                    "/materials/0/pbrMetallicRoughness/baseColorFactor",
                    json!([1e39, -1e39, 2, -1]),
                );
            }),
            ("a roughness of 1e39", |m| {
                m.set(
                    "/materials/0/pbrMetallicRoughness/roughnessFactor",
                    json!(1e39),
                );
            }),
            ("a cut-out of -1e39", |m| {
                m.set("/materials/0/alphaMode", json!("MASK"));
                m.set("/materials/0/alphaCutoff", json!(-1e39));
            }),
            ("normals of nothing", |m| m.bytes[Model::NORMALS].fill(0)),
            ("all vertices in one place", |m| {
                m.bytes[Model::POSITIONS].fill(0)
            }),
            ("all UVs in one place", |m| m.bytes[Model::UVS].fill(0)),
        ],
    ));
    attempts
}

/// Images that are too large, cut short, or none.
pub fn images() -> Vec<Attempt> {
    let png = picture(ImageFormat::Png);
    let jpeg = picture(ImageFormat::Jpeg);
    let with = |name: String, wanted, picture: &[u8]| {
        let mut model = Model::new();
        model.set_picture(picture);
        attempt(name, wanted, model.glb())
    };
    let mut attempts = vec![with("a JPEG".into(), Wanted::Taken, &jpeg)];
    for n in 0..png.len() - 12 {
        attempts.push(with(
            format!("{n} bytes of a PNG"),
            Wanted::Refused,
            &png[..n],
        ));
    }
    for n in 0..jpeg.len() {
        // What is missing of a JPEG may be drawn as grey.
        attempts.push(with(
            format!("{n} bytes of a JPEG"),
            Wanted::Either,
            &jpeg[..n],
        ));
    }
    for [width, height] in [
        [0, 0],
        [0, 2],
        [100_000, 100_000],
        [1 << 30, 1],
        [1, 1 << 30],
        [i32::MAX as u32, i32::MAX as u32],
        [u32::MAX, u32::MAX],
    ] {
        let name = format!("a PNG that claims {width}x{height}");
        attempts.push(with(name, Wanted::Refused, &claiming(&png, width, height)));
    }
    let mut large = jpeg.clone();
    let frame = large
        .windows(2)
        .position(|w| w == [0xff, 0xc0])
        .expect("a JPEG has a frame");
    large[frame + 5..frame + 9].fill(255);
    // A GiB of pixels, all of them missing but four.
    attempts.push(with(
        "a JPEG that claims 65535x65535".into(),
        Wanted::Refused,
        &large,
    ));
    attempts.extend(changed(
        Wanted::Refused,
        &[
            ("text for a picture", |m| m.set_picture(b"no picture")),
            ("a picture without bytes", |m| {
                m.set("/images/0/bufferView", Value::Null)
            }),
            ("a picture of a kind that is not read", |m| {
                m.set_picture(b"GIF89a\x01\0\x01\0\0\0\0;")
            }),
            ("a picture from a web page", |m| {
                m.set("/images/0", json!({"uri": "https://example.org/a.png"}));
            }),
            ("a picture from a file", |m| {
                m.set("/images/0", json!({"uri": "a.png"}))
            }),
            ("a data URI that ends early", |m| {
                m.set(
                    "/images/0",
                    json!({"uri": "data:image/png;base64,iVBORw0KGgo"}),
                );
            }),
            ("a data URI of nothing", |m| {
                m.set("/images/0", json!({"uri": "data:image/png;base64,"}))
            }),
            ("a data URI that is no base64", |m| {
                m.set("/images/0", json!({"uri": "data:image/png;base64,*&^%"}));
            }),
            ("a data URI without a comma", |m| {
                m.set("/images/0", json!({"uri": "data:image/png"}))
            }),
            ("a URI that is empty", |m| {
                m.set("/images/0", json!({"uri": ""}))
            }),
            ("a texture without a picture", |m| {
                m.set("/textures/0/source", Value::Null)
            }),
        ],
    ));
    attempts
}

/// A PNG whose header says another size, and is right to itself.
fn claiming(png: &[u8], width: u32, height: u32) -> Vec<u8> {
    let mut png = png.to_vec();
    // After the signature: length, "IHDR", width, height, five bytes, and the sum over all but the length.
    png[16..20].copy_from_slice(&width.to_be_bytes());
    png[20..24].copy_from_slice(&height.to_be_bytes());
    let sum = !png[12..29].iter().fold(!0u32, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| {
            (sum >> 1) ^ (0xedb8_8320 & (sum & 1).wrapping_neg())
        })
    });
    png[29..33].copy_from_slice(&sum.to_be_bytes());
    png
}

/// A JSON in a directory of its own, whose buffer is this file.
fn beside(uri: &'static str) -> Attempt {
    Attempt::new(format!("bytes in {uri}"), Wanted::Refused, move || {
        let mut model = Model::new();
        model.set("/buffers/0/uri", json!(uri));
        let path = std::env::temp_dir().join(format!("stability-{}.gltf", std::process::id()));
        let unwritable = |e: std::io::Error| {
            Error::new(
                path.display().to_string(),
                e.to_string(),
                "a file that can be written",
            )
        };
        std::fs::write(&path, model.json.to_string()).map_err(unwritable)?;
        let scene = Scene::load(&path);
        std::fs::remove_file(&path).map_err(unwritable)?;
        scene.map(|scene| flaw_of_scene(&scene))
    })
}

/// Buffers that are missing, short, or elsewhere.
pub fn buffers() -> Vec<Attempt> {
    let mut attempts = changed(
        Wanted::Refused,
        &[
            ("no buffers", |m| m.set("/buffers", Value::Null)),
            ("two buffers of one chunk", |m| {
                m.set("/buffers", json!([{"byteLength": 8}, {"byteLength": 8}]));
            }),
            ("no bytes", |m| m.bytes.clear()),
            ("a byte that is missing", |m| {
                m.bytes.truncate(Model::INDICES.end - 4)
            }),
            ("bytes in a file", |m| {
                m.set("/buffers/0/uri", json!("a.bin"))
            }),
            ("bytes in a file of the system", |m| {
                m.set("/buffers/0/uri", json!("file:///dev/zero"))
            }),
            ("bytes on a web page", |m| {
                m.set("/buffers/0/uri", json!("https://example.org/a.bin"))
            }),
            ("a scheme without a name", |m| {
                m.set("/buffers/0/uri", json!(":"))
            }),
            ("a data URI of nothing", |m| {
                m.set(
                    "/buffers/0/uri",
                    json!("data:application/octet-stream;base64,"),
                );
            }),
            ("a data URI that ends early", |m| {
                m.set(
                    "/buffers/0/uri",
                    json!("data:application/octet-stream;base64,AAAAAAAAAAA"),
                );
            }),
            ("a data URI that is no base64", |m| {
                m.set(
                    "/buffers/0/uri",
                    json!("data:application/octet-stream;base64,\u{1f600}%"),
                );
            }),
            ("a data URI without a comma", |m| {
                m.set("/buffers/0/uri", json!("data:application/octet-stream"));
            }),
            ("a name with half an escape", |m| {
                m.set("/buffers/0/uri", json!("a%"))
            }),
            ("a name that is no UTF-8", |m| {
                m.set("/buffers/0/uri", json!("a%ff.bin"))
            }),
        ],
    );
    // Where there are such files, they have no end.
    attempts.extend(["/dev/zero", "file:///dev/zero", ".", "%2e", "no.bin"].map(beside));
    let Model { json, .. } = Model::new();
    attempts.push(attempt(
        "JSON alone",
        Wanted::Refused,
        json.to_string().into_bytes(),
    ));
    attempts
}

/// Scenes of which nothing can be drawn, or nothing scatters.
pub fn nothing() -> Vec<Attempt> {
    let mut attempts = changed(
        Wanted::Refused,
        &[
            ("no scenes and no nodes", |m| {
                for place in ["/scene", "/scenes", "/nodes"] {
                    m.set(place, Value::Null);
                }
            }),
            ("a scene without nodes", |m| {
                m.set("/scenes/0/nodes", json!([]))
            }),
            ("a node without a mesh", |m| {
                m.set("/nodes/0/mesh", Value::Null)
            }),
            ("a mesh without primitives", |m| {
                m.set("/meshes/0/primitives", json!([]))
            }),
            ("triangles without area, by indices", |m| {
                m.bytes[Model::INDICES].fill(0)
            }),
            ("points", |m| m.set("/meshes/0/primitives/0/mode", json!(0))),
            ("lines", |m| m.set("/meshes/0/primitives/0/mode", json!(1))),
        ],
    );
    attempts.extend(changed(
        Wanted::Taken,
        &[
            ("all as it should be", |_| ()),
            ("no skin by name", |m| {
                m.set("/materials/0/name", json!("Eye"))
            }),
            ("no skin by number", |m| {
                m.set("/materials/0/extras", json!({"subsurface_profile": 0}))
            }),
            ("no material", |m| {
                m.set("/meshes/0/primitives/0/material", Value::Null)
            }),
            ("no UVs, no normals", |m| {
                m.set("/meshes/0/primitives/0/attributes", json!({"POSITION": 0}));
            }),
            ("a skin of all profiles", |m| {
                m.set("/materials/0/extras", json!({"subsurface_profile": 255}))
            }),
        ],
    ));
    attempts
}

/// Less than a megabyte that would have far more read, or drawn.
pub fn demands() -> Vec<Attempt> {
    let many = |name: &str, wanted, mode: u32, corners: usize, nodes: usize| {
        let mut model = Model::new();
        model.set(
            "/meshes/0/primitives/0",
            json!({"attributes": {"POSITION": 0}, "mode": mode}),
        );
        model.set("/nodes", Value::Array(vec![json!({"mesh": 0}); nodes]));
        model.set("/scenes/0/nodes", json!((0..nodes).collect::<Vec<_>>()));
        model.bytes = (0..3 * corners)
            .flat_map(|i| (i as f32).to_le_bytes())
            .collect();
        model.set("/accessors/0/count", json!(corners));
        model.set(
            "/bufferViews",
            json!([{"buffer": 0, "byteLength": model.bytes.len()}]),
        );
        model.set("/images", Value::Null);
        model.set("/textures", Value::Null);
        model.set("/materials", Value::Null);
        model.set("/accessors", json!([model.json["accessors"][0]]));
        model.set("/buffers/0/byteLength", json!(model.bytes.len()));
        attempt(name, wanted, model.glb())
    };
    vec![
        many(
            "a mesh of 10000 triangles, 3000 times",
            Wanted::Refused,
            4,
            30_000,
            3000,
        ),
        many(
            "a strip of 30000 triangles, 3000 times",
            Wanted::Refused,
            5,
            30_000,
            3000,
        ),
        many(
            "30000 points, 30000 times",
            Wanted::Refused,
            0,
            30_000,
            30_000,
        ),
        many("1000 triangles, 300 times", Wanted::Taken, 4, 3000, 300),
    ]
}
