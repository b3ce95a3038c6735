//! The command line.

use std::path::PathBuf;

use crate::Error;
use crate::cli::Arguments;

pub const HELP: &str = "\
Tries every method where methods fail, and writes what came out: failures.md and pictures.

Usage: cargo run --release --example stability -- [OPTIONS]

  --quick           smaller frames, fewer steps; the same thresholds
  --only TEXT       cases whose group and name hold this text           [all]
  --out DIR         where the atlas goes                                [out/stability]

Exits with 1 where a mode of this crate is worse than it is known to be.
";

/// What is asked for.
pub struct Options {
    pub quick: bool,
    pub only: Option<String>,
    pub out: PathBuf,
}

impl Options {
    /// # Errors
    /// An option that is not known.
    pub fn parse(arguments: &mut Arguments) -> Result<Self, Error> {
        let mut options = Self { quick: false, only: None, out: "out/stability".into() };
        while let Some(name) = arguments.next_word()? {
            match name.as_str() {
                "--quick" => options.quick = true,
                "--only" => options.only = Some(arguments.value()?),
                "--out" => options.out = arguments.value()?.into(),
                _ => return Err(arguments.unknown()),
            }
        }
        Ok(options)
    }

    pub fn wants(&self, title: &str) -> bool {
        self.only.as_ref().is_none_or(|part| title.contains(part))
    }
}
