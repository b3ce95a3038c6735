//! Profiles from what skin and other materials are made of.

mod complex;
mod medium;
mod quadrature;
mod response;
mod transport;

pub use medium::{Layer, Medium};
pub use quadrature::fresnel_inside;
pub use response::Response;
pub use transport::{Incidence, Transport};
