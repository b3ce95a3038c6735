//! glTF files that are cut short, or lie.

pub mod buffers;
pub mod containers;
pub mod images;
pub mod nodes;
pub mod numbers;
pub mod references;

use crate::renderer::Scene;

use super::attempt::{Attempt, Wanted};
use crate::model::{Model, flaw_of_scene};

/// What is changed of a model that has nothing wrong.
type Change = fn(&mut Model);

fn attempt(name: impl Into<String>, wanted: Wanted, bytes: Vec<u8>) -> Attempt {
    Attempt::new(name, wanted, move || {
        Scene::from_glb(&bytes).map(|scene| flaw_of_scene(&scene))
    })
}

fn changed(wanted: Wanted, changes: &[(&'static str, Change)]) -> Vec<Attempt> {
    let attempts = changes.iter().map(|(name, change)| {
        let mut model = Model::default();
        change(&mut model);
        attempt(*name, wanted, model.glb())
    });
    attempts.collect()
}
