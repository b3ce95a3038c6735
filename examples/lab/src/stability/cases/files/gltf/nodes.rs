//! Nodes, and how much they draw.

use serde_json::{Value, json};

use super::super::attempt::{Attempt, Wanted};
use super::{attempt, changed};
use crate::model::Model;

/// Trees of nodes.
pub fn nodes() -> Vec<Attempt> {
    let tree = |name: &str, wanted, nodes: Vec<Value>| {
        let mut model = Model::default();
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
            ("a node that a scene names twice", |m| {
                m.set("/scenes/0/nodes", json!([0, 0]))
            }),
        ],
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
        let mut model = Model::default();
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
