//! Counts, offsets and references that lie.

use serde_json::{Value, json};

use super::super::attempt::{Attempt, Wanted};
use super::{attempt, changed};
use crate::model::Model;

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
            let mut model = Model::default();
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
            let mut model = Model::default();
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
