//! Scatters a frame that another program dumped: irradiance and depth as EXR files, with the camera
//! beside them. docs/dumps.md says how to write one.
//!
//! ```sh
//! cargo run --release --example filter -- CASE_DIR --out FILE.exr
//! ```

use std::process::ExitCode;

fn main() -> ExitCode {
    subsurface_lab::filter::main()
}
