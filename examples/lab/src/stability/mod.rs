//! The failure atlas: every method where methods fail, held to the integral, against stated thresholds.
//! Exits with 1 where one of ours is worse than it is known to be.
//!
//! ```sh
//! cargo run --release --example stability
//! ```

mod case;
mod cases;
mod frame;
mod lab;
mod options;
mod report;
mod strip;
mod table;
mod unwrapped;

use std::process::ExitCode;
use std::time::Instant;

use crate::Error;
use indicatif::{ProgressBar, ProgressStyle};

use case::{Case, Judged};
use lab::Lab;
use options::Options;
use report::Report;

pub fn main() -> ExitCode {
    let outcome = Options::parse().and_then(|options| options.map_or(Ok(vec![]), |o| atlas(&o)));
    match outcome {
        Ok(worse) if worse.is_empty() => ExitCode::SUCCESS,
        Ok(worse) => {
            for line in worse {
                eprintln!("error: {line}");
            }
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the cases and writes what came out; what is worse than it is known to be, a line each.
fn atlas(options: &Options) -> Result<Vec<String>, Error> {
    let started = Instant::now();
    let cases: Vec<Case> = cases::all(options.quick)
        .into_iter()
        .filter(|case| options.wants(&case.title()))
        .collect();
    if cases.is_empty() {
        let got = options.only.clone().unwrap_or_default();
        return Err(Error::new("--only", got, "a part of a case's name"));
    }
    let lab = Lab::new()?;
    let style = ProgressStyle::with_template("{bar:24} {pos}/{len} {msg}");
    let bar =
        ProgressBar::new(cases.len() as u64).with_style(style.expect("the template is a constant"));
    bar.enable_steady_tick(std::time::Duration::from_millis(200));
    let mut judged: Vec<Judged> = Vec::new();
    for case in cases {
        bar.set_message(case.title());
        let since = Instant::now();
        let outcome = (case.run)(&lab)?;
        lab.check(&case.title())?;
        let judgement = Judged::new(case, outcome, since.elapsed());
        bar.suspend(|| println!("{judgement}"));
        bar.inc(1);
        judged.push(judgement);
    }
    bar.finish_and_clear();
    let command = std::env::args().skip(1).collect::<Vec<_>>().join(" ");
    Report {
        judged: &judged,
        adapter: &lab.gpu.adapter,
        command: &command,
    }
    .write(&options.out)?;
    println!(
        "{} in {:.0} s",
        options.out.join("failures.md").display(),
        started.elapsed().as_secs_f64()
    );
    Ok(judged.iter().flat_map(Judged::worse).collect())
}
