//! Buffers.

use crate::Error;
use serde_json::{Value, json};

use super::super::attempt::{Attempt, Wanted};
use super::{attempt, changed};
use crate::model::{Model, flaw_of_scene};
use crate::renderer::Scene;

/// A JSON in a directory of its own, whose buffer is this file.
fn beside(uri: &'static str) -> Attempt {
    Attempt::new(format!("bytes in {uri}"), Wanted::Refused, move || {
        let mut model = Model::default();
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
    let Model { json, .. } = Model::default();
    attempts.push(attempt(
        "JSON alone",
        Wanted::Refused,
        json.to_string().into_bytes(),
    ));
    attempts
}
