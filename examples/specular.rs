//! Draws models of surface reflection side by side, says what they reflect in all, and times them.
//!
//! ```sh
//! cargo run --release --example specular
//! ```

use std::process::ExitCode;

fn main() -> ExitCode {
    subsurface_lab::specular::main()
}
