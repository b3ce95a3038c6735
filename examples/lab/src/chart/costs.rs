//! What a pixel of skin costs, near and far, and a frame without any.

use crate::Error;
use glam::DVec2;

use crate::chart::clock;
use crate::chart::scene::{Scene, flat};
use crate::metrics;
use crate::renderer::{Camera, Gpu, Scene as Model, View};

/// The frames that methods are timed on, in the order of [`scenes`].
pub const SCENES: [&str; 4] = ["cost_empty", "cost_far", "cost_face", "cost_near"];

const FAR_PX_PER_MM: f64 = 0.3;
const NEAR_PX_PER_MM: f32 = 20.0;

/// Frames without skin, full of flat skin from afar, with a face, and full of it from near.
///
/// # Errors
/// A size that the device cannot render; a model without skin in view.
pub fn scenes(gpu: &Gpu, model: &Model, mm_per_unit: f32, size: [u32; 2]) -> Result<[Scene; 4], Error> {
    let [empty, far, face, near] = SCENES;
    let head = |name, camera| Scene::head(gpu, model, mm_per_unit, name, size, camera);
    let close_up = Camera::framing(model, View::CloseUp, size);
    let closer = close_up.px_per_unit(size) / (NEAR_PX_PER_MM * mm_per_unit);
    let narrowed = Camera { fov_y: 2.0 * (closer * (close_up.fov_y / 2.0).tan()).atan(), ..close_up };
    Ok([
        flat(gpu, empty, size, FAR_PX_PER_MM, |_| None),
        flat(gpu, far, size, FAR_PX_PER_MM, |at: DVec2| Some(f64::from(at.x > 0.0))),
        head(face, Camera::framing(model, View::Front, size))?,
        head(near, narrowed)?,
    ])
}

/// What a method's times say, those of [`scenes`] in their order and those of the copy on the empty frame.
pub fn note(name: &str, times: [&[f64]; 4], copy: &[f64], scenes: &[Scene; 4]) -> String {
    let empty = times[0];
    // Without what a frame costs anyway.
    let [far, face, near] = [1, 2, 3].map(|i| -> Vec<f64> {
        let pixels = scenes[i].pixels.len() as f64;
        let rounds = times[i].iter().zip(empty);
        rounds.map(|(t, e)| 1e6 * (t - e) / pixels).collect()
    });
    let ns = |times: &[f64]| format!("{:.0} ns", metrics::median(times));
    let ratio = |times: &[f64], base: &[f64]| {
        let (ratio, [low, high]) = clock::ratio(times, base);
        format!("{ratio:.2} ({low:.2} to {high:.2})")
    };
    format!(
        "{name}: a frame without skin takes {} copies. A pixel of skin, that taken off: {} where the frame is full \
         of flat skin at {FAR_PX_PER_MM} px/mm, {} on the head from the front, {} on the head at {NEAR_PX_PER_MM} \
         px/mm; flat over near {}, near over front {}.",
        ratio(empty, copy),
        ns(&far),
        ns(&face),
        ns(&near),
        ratio(&far, &near),
        ratio(&near, &face),
    )
}
