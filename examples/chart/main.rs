mod files;
#[cfg(test)]
mod fixture;
mod label;
#[path = "../shared/output.rs"]
mod output;
#[path = "../shared/page.rs"]
mod page;
mod method;
mod panel;
mod plot;
mod report;
mod rivals;
mod row;
mod scale;
mod style;
mod svg;
fn main() {}
