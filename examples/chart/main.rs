//! Error against time, for every method on every scene.
#![cfg_attr(
    not(test),
    expect(
        dead_code,
        reason = "nothing is measured yet, so there is nothing to write"
    )
)]

mod files;
#[cfg(test)]
mod fixture;
mod label;
#[path = "../shared/output.rs"]
mod output;
#[path = "../shared/page.rs"]
mod page;
mod panel;
mod plot;
mod report;
mod row;
mod scale;
mod style;
mod svg;

fn main() {}
