//! Renders a head four ways — no scattering, texture space, screen space by a plan and by the exact sum —
//! measures how far they are apart, and writes pictures, layers and a report.
//!
//! ```sh
//! cargo run --release --example compare
//! ```

use std::process::ExitCode;

fn main() -> ExitCode {
    subsurface_lab::compare::main()
}
