//! What moves: every method held to the truth's own motion.
//!
//! Figures are of a method's *errors*, its result less the truth, so that nothing counts that the truth
//! does, too. In the pictures a frame is a row: what swings shows as unrest down the columns.

mod atlas;
mod camera;
mod light;
mod track;

use crate::case::Case;

/// What an eye may see move: a step of eight bits.
const STEP: f64 = 1.0 / 255.0;

/// What it sees without looking for it, as for errors that stand still.
const SEEN: f64 = 0.01;

/// What the skin profile reaches in mm: 3.5 σ of its widest Gaussian. Closer to the frame's edge kernels
/// are cut, and the closed forms do not hold.
const REACH_MM: f64 = 9.6;

pub fn cases(quick: bool) -> Vec<Case> {
    let mut cases = camera::cases(quick);
    cases.extend(light::cases(quick));
    cases
}
