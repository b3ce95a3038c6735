//! The chart of speed against accuracy: every method on every scene, timed and held to the integral
//! that it approximates.
//!
//! ```sh
//! cargo run --release --example chart
//! ```

use std::process::ExitCode;

fn main() -> ExitCode {
    subsurface_lab::chart::main()
}
