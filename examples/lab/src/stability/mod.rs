//! The failure atlas: every method where methods fail, held to the integral, against stated thresholds.
//! Exits with 1 where one of ours is worse than it is known to be.
//!
//! ```sh
//! cargo run --release --example stability
//! ```

mod case;
mod cases;
mod inputs;
mod lab;
mod options;
mod report;
mod scene;
mod strip;
mod track;
mod trial;
mod unwrapped;

use std::process::ExitCode;
use std::time::Instant;

use crate::{Error, cli};
use case::{Case, GROUPS, Judged};
pub use cases::sizes;
use lab::Lab;
pub use options::Options;
use report::Report;

pub fn main() -> ExitCode {
    cli::main(options::HELP, Options::parse, |options| {
        let worse = atlas(&options)?;
        for line in &worse {
            eprintln!("error: {line}");
        }
        match worse.len() {
            0 => Ok(()),
            count => Err(Error::new("atlas", format!("{count} that are worse than known"), "none")),
        }
    })
}

/// Runs the cases and writes what came out; what is worse than it is known to be, a line each.
///
/// # Errors
/// No case of that name, no adapter, a case that could not be run, or files that cannot be written.
pub fn atlas(options: &Options) -> Result<Vec<String>, Error> {
    let started = Instant::now();
    let mut cases = cases::all(options.quick);
    cases.retain(|case| options.wants(&case.title()));
    if cases.is_empty() {
        let got = options.only.clone().unwrap_or_default();
        return Err(Error::new("--only", got, "a part of a case's name"));
    }
    let lab = Lab::new()?;
    let count = cases.len();
    let mut judged: Vec<Judged> = Vec::new();
    for case in cases {
        judged.push(judge(case, &lab)?);
        println!("{}/{count} {}", judged.len(), judged[judged.len() - 1]);
    }
    judged.sort_by_key(|j| GROUPS.iter().position(|group| *group == j.case.group));
    let command = std::env::args().skip(1).collect::<Vec<_>>().join(" ");
    let report = Report { judged: &judged, adapter: &lab.gpu.adapter, command: &command };
    report.write(&options.out)?;
    let page = options.out.join("failures.md");
    println!("{} in {:.0} s", page.display(), started.elapsed().as_secs_f64());
    Ok(judged.iter().flat_map(Judged::worse).collect())
}

fn judge(case: Case, lab: &Lab) -> Result<Judged, Error> {
    let since = Instant::now();
    let outcome = (case.run)(lab).map_err(|error| error.within(case.title()))?;
    lab.check(&case.title())?;
    Ok(Judged { case, outcome, took: since.elapsed() })
}
