//! Numbers that are none, or too large.

use serde_json::json;

use super::super::attempt::{Attempt, Wanted};
use super::{attempt, changed};
use crate::model::Model;

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
            let mut model = Model::default();
            model.bytes[at..at + 4].copy_from_slice(&bad.to_le_bytes());
            attempts.push(attempt(
                format!("a {what} of {bad}"),
                Wanted::Refused,
                model.glb(),
            ));
        }
        // A number, if not of this world.
        for odd in [f32::MAX, f32::MIN, f32::MIN_POSITIVE, 1e-45, -0.0] {
            let mut model = Model::default();
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
