//! Makes a diffusion profile of what a material is described by, says what it is off by, and draws it.
//!
//! ```sh
//! cargo run --release --example profile -- light
//! ```

use std::process::ExitCode;

fn main() -> ExitCode {
    subsurface_lab::profile::main()
}
