//! Numbers that a host should not hand over, or seldom does.

mod geometry;
mod light;
mod sizes;
mod widths;

use crate::case::Case;

/// What flat skin under even light may gain or lose, as a share of it: two 8-bit steps in a thousand are
/// never seen, and half floats, which results are stored in, take up to half of it.
const EVEN: f64 = 0.002;
/// A difference that may be seen.
const SEEN: f64 = 0.01;
/// One that is.
const PLAIN: f64 = 0.03;

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
