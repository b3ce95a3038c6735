//! Numbers that a host should not hand over, or seldom does.

mod geometry;
mod light;
mod sizes;
mod widths;

use crate::stability::case::Case;

/// What flat skin under even light may gain or lose, as a share of it: half a step of eight bits near white,
/// and four of the half floats that results are stored in.
const EVEN: f64 = 0.002;

pub fn cases(quick: bool) -> Vec<Case> {
    [
        light::cases(quick),
        geometry::cases(quick),
        sizes::cases(quick),
        widths::cases(quick),
    ]
    .into_iter()
    .flatten()
    .collect()
}
