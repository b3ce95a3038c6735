//! Counts how often the shaders run on the built-in head, from the lists by which the device draws, and writes
//! `examples/lab/uses.txt`.
//!
//! ```sh
//! cargo run --release --example uses
//! ```

use std::process::ExitCode;

fn main() -> ExitCode {
    subsurface_lab::uses::main()
}
