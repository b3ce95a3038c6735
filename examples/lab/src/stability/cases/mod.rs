//! The cases, a file a group, and what they share.

mod files;
mod hosts;
mod ids;
mod islands;
mod numbers;
mod screen;
mod sheet;
pub mod sizes;
mod texture;
mod time;

use std::cell::OnceCell;
use std::rc::Rc;

use crate::Error;
use crate::stability::case::{Bound, Case};
use crate::stability::trial::Trial;

/// A step of 8 bits.
const STEP: f64 = 1.0 / 255.0;
/// What an eye may find in a gradient.
const FOUND: f64 = 0.01;
/// What an eye sees at a glance.
const SEEN: f64 = 0.03;

const GRADIENT: Bound = Bound {
    passes: FOUND,
    degrades: SEEN,
    why: "0.01 is what an eye may find in a gradient, 0.03 what it sees at a glance.",
};
const PROMISE: Bound = Bound {
    passes: STEP,
    degrades: SEEN,
    why: "1/255 is one step of 8 bits, the error that the plan is made for.",
};
const FLICKER: Bound = Bound {
    passes: STEP,
    degrades: FOUND,
    why: "1/255 is one step of 8 bits, which shows where it comes and goes; 0.01 shows at once.",
};
const EVEN: Bound = Bound {
    passes: 0.002,
    degrades: FOUND,
    why: "0.002 is 4 steps of the half floats that results are stored in; 0.01 is what an eye may find.",
};

/// What the skin profile reaches in mm: 3.5 σ of its widest Gaussian. Closer to the frame's border kernels
/// are cut, and the closed forms do not hold.
const REACH_MM: f64 = 9.6;

/// All of them, group by group; `quick` makes frames smaller and sequences shorter.
pub fn all(quick: bool) -> Vec<Case> {
    let groups = [
        // First, while the process has had little memory: the readers are held to its peak.
        ("files", files::cases(quick)),
        ("screen space", screen::cases(quick)),
        ("light from behind", screen::behind(quick)),
        ("ids and pixels", ids::cases(quick)),
        ("texture space", texture::cases(quick)),
        ("time", time::cases(quick)),
        ("numbers", numbers::cases(quick)),
        ("sizes", sizes::cases(quick)),
        ("hosts", hosts::cases(quick)),
    ];
    let named = |(group, cases): (_, Vec<Case>)| cases.into_iter().map(move |c| Case { group, ..c });
    groups.into_iter().flat_map(named).collect()
}

/// White noise: a number from 0 to 1 that a hash gives a pixel.
fn noise([x, y]: [u32; 2]) -> f64 {
    let mut bits = x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77);
    bits = (bits ^ (bits >> 15)).wrapping_mul(0x2c1b_3c6d);
    bits = (bits ^ (bits >> 12)).wrapping_mul(0x297a_2d39);
    f64::from(bits ^ (bits >> 15)) / f64::from(u32::MAX)
}

/// A case of one frame.
fn trial(
    name: impl Into<String>,
    what: impl Into<String>,
    bound: Bound,
    make: impl Fn() -> Trial + 'static,
) -> Case {
    Case::new(name, what, bound, move |lab| make().run(lab))
}

/// What several cases look at, made by the first of them.
struct Shared<T>(Rc<OnceCell<T>>);

impl<T> Shared<T> {
    fn new() -> Self {
        Self(Rc::default())
    }

    fn get(&self, make: impl FnOnce() -> Result<T, Error>) -> Result<&T, Error> {
        match self.0.get() {
            Some(made) => Ok(made),
            None => make().map(|made| self.0.get_or_init(|| made)),
        }
    }
}

impl<T> Clone for Shared<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}
