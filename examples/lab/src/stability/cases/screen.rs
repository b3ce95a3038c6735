//! Where screen space fails: what lies close in the picture and far apart in space, what the camera
//! does not see, and what is too steep, too wide or too small for pixels.

mod border;
mod hidden;
mod layers;
mod scale;
mod scene;
mod silhouettes;
mod slopes;
mod trial;

use super::{FOUND, REACH_MM, SEEN, STEP};
use crate::stability::case::{Case, Known};

pub fn cases(quick: bool) -> Vec<Case> {
    [
        layers::cases(quick),
        silhouettes::cases(quick),
        border::cases(quick),
        slopes::cases(quick),
        hidden::cases(quick),
        scale::cases(quick),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// A mode of ours that does not pass, though another method could.
fn known(method: &'static str, at_most: f64, why: &str) -> Known {
    Known {
        method,
        at_most,
        by_nature: false,
        why: why.into(),
    }
}

/// A mode of ours that cannot pass, knowing what it knows.
fn by_nature(method: &'static str, at_most: f64, why: &str) -> Known {
    Known {
        by_nature: true,
        ..known(method, at_most, why)
    }
}
