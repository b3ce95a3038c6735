//! What hosts do to an effect over many frames.

use crate::case::Case;

pub fn cases(_quick: bool) -> Vec<Case> {
    vec![]
}
