//! The failure atlas: every method where methods fail, held to the integral, against stated thresholds.
//! Exits with 1 where one of ours is worse than it is known to be.
//!
//! ```sh
//! cargo run --release --example stability
//! ```

use std::process::ExitCode;

fn main() -> ExitCode {
    subsurface_lab::stability::main()
}
