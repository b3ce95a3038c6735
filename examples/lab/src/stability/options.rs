//! The command line.

use std::path::PathBuf;

use crate::Error;

const HELP: &str = "\
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
    /// The command line; `None` when it asked for help.
    pub fn parse() -> Result<Option<Self>, Error> {
        use lexopt::prelude::*;

        let mut options = Self { quick: false, only: None, out: "out/stability".into() };
        let refused = |e: lexopt::Error| {
            let got = format!("\"{e}\"");
            Error::new("command line", got, "options as --help lists them")
        };
        let text = |parser: &mut lexopt::Parser| parser.value().and_then(|v| v.string()).map_err(refused);
        let mut parser = lexopt::Parser::from_env();
        while let Some(arg) = parser.next().map_err(refused)? {
            match arg {
                Short('h') | Long("help") => {
                    print!("{HELP}");
                    return Ok(None);
                }
                Long("quick") => options.quick = true,
                Long("only") => options.only = Some(text(&mut parser)?),
                Long("out") => options.out = text(&mut parser)?.into(),
                other => return Err(refused(other.unexpected())),
            }
        }
        Ok(Some(options))
    }

    pub fn wants(&self, title: &str) -> bool {
        self.only.as_ref().is_none_or(|part| title.contains(part))
    }
}
