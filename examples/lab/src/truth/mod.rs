//! The integrals that every method approximates, summed without regard to time: what claims are
//! measured against.
//!
//! [`surface_integral`] is Li & Shao's Eq. 7 over a whole mesh, hidden sides included.
//! [`visible_integral`] is the same over what the camera sees, the best that a method can do that
//! knows the frame alone. A method's error falls into the part that is its own, against the visible
//! integral, and the part that no screen-space method is spared, between the two.
//! [`closed_form`] has the cases in which both are known on paper.
//!
//! Nothing here is shared with the effects: not a weight, not a reach, not a line of their shaders.

pub mod closed_form;
mod cloud;
mod random_walk;
mod surface;
mod tree;
mod visible;

pub use cloud::Patch;
pub use random_walk::{Walk, random_walk};
pub use surface::{Place, SurfaceIntegral, Triangles, surface_integral};
pub use visible::{Pixel, even_steps, visible_integral};

/// Is told each share of the work as it is done, from any thread; the shares sum to 1.
pub type Progress<'a> = &'a (dyn Fn(f64) + Sync);
