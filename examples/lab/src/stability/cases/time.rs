//! What moves: every method held to the truth's own motion.
//!
//! Figures are of a method's *errors*, its result less the truth, so that nothing counts that the truth
//! does, too. In the pictures a frame is a row: what swings shows as unrest down the columns.

mod atlas;
mod follow;
mod light;
mod pan;
mod roll;
mod track;
mod zoom;

use super::{FOUND, REACH_MM, SEEN, STEP};
use crate::stability::case::Case;

const PX_PER_MM: f64 = 4.0;

const WHY_SWING: &str = "1/255 is a step of eight bits, which an eye sees where it comes and goes; .01 is what it \
                         sees without looking for it.";

const WHY_STEP: &str = "1/255 is a step of eight bits, and from one frame to the next a jump that an eye may see; .01 is one that \
                        it does.";

pub fn cases(quick: bool) -> Vec<Case> {
    let mut cases = pan::cases(quick);
    cases.push(roll::case(quick));
    cases.push(zoom::case(quick));
    cases.extend(light::cases(quick));
    cases
}
