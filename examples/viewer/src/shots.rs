//! Screenshots, numbered.

use std::path::{Path, PathBuf};

use image::RgbImage;
use subsurface_lab::Error;

use subsurface_lab::output;

/// Writes a picture under the first number beyond those in use, whole or not at all.
pub fn save(dir: &Path, picture: &RgbImage) -> Result<PathBuf, Error> {
    let fail = |e: &dyn std::fmt::Display| {
        let needs = "a directory that can be written to";
        Error::new("screenshot", format!("\"{e}\""), needs)
    };
    // A directory that is not there yet has no names; one that cannot be read says so below.
    let names = std::fs::read_dir(dir).into_iter().flatten().flatten();
    let names = names.filter_map(|e| e.file_name().into_string().ok());
    let name = next(names);
    let file = output::png(picture).map_err(|e| fail(&e))?;
    output::write(dir, &[(name.clone(), file)]).map_err(|e| fail(&e))?;
    Ok(dir.join(name))
}

fn next(names: impl Iterator<Item = String>) -> String {
    let number = |name: String| -> Option<u32> {
        let digits = name.strip_prefix("viewer-")?.strip_suffix(".png")?;
        digits.parse().ok()
    };
    let last = names.filter_map(number).max().unwrap_or(0);
    format!("viewer-{:03}.png", last.saturating_add(1))
}

#[cfg(test)]
mod tests {
    #[test]
    fn numbers_go_on_where_they_were() {
        let next = |names: &[&str]| super::next(names.iter().map(|n| n.to_string()));
        assert_eq!(next(&[]), "viewer-001.png");
        assert_eq!(next(&["viewer-009.png", "viewer-002.png", "viewer-x.png"]), "viewer-010.png");
        assert_eq!(next(&["viewer-1000.png"]), "viewer-1001.png");
    }
}
