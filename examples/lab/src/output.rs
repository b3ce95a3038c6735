//! Files of an example: pictures as PNG, and a directory of files that is written whole or not at
//! all.

use std::io;
use std::path::Path;
use std::{fs, process};

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ImageResult, RgbImage};

/// An sRGB picture as a PNG file.
///
/// # Errors
/// A picture without pixels.
pub fn png(picture: &RgbImage) -> ImageResult<Vec<u8>> {
    let mut file = Vec::new();
    // The encoder's default is made for speed; the report carries a dozen of these.
    let encoder = PngEncoder::new_with_quality(&mut file, CompressionType::Default, FilterType::Adaptive);
    picture.write_with_encoder(encoder)?;
    Ok(file)
}

/// Writes named files into the directory `out`, all or none: they are moved into place only when
/// every one is on disk, in the order given. Makes `out` where it is missing, replaces files of
/// the same names and leaves others alone.
///
/// # Errors
/// Whatever keeps a file from being written, with the path that it happened to.
pub fn write(out: &Path, files: &[(String, Vec<u8>)]) -> io::Result<()> {
    let is_new = !out.exists();
    // Inside `out`, not beside it: a move within one directory never crosses file systems, and
    // the directory above may not be ours to write to.
    let staging = out.join(format!(".new-{}", process::id()));
    let result = stage(&staging, out, files);
    // What is left here is of no use to anyone, and the first error says what went wrong.
    let _ = fs::remove_dir_all(&staging);
    if is_new && result.is_err() {
        let _ = fs::remove_dir(out);
    }
    result
}

fn stage(staging: &Path, out: &Path, files: &[(String, Vec<u8>)]) -> io::Result<()> {
    let at = |path: &Path, error: io::Error| {
        io::Error::new(error.kind(), format!("{}: {error}", path.display()))
    };
    // An interrupted run may have left one behind under the same process id.
    let _ = fs::remove_dir_all(staging);
    if out.exists() && !out.is_dir() {
        return Err(at(out, io::ErrorKind::NotADirectory.into()));
    }
    fs::create_dir_all(out).map_err(|error| at(out, error))?;
    fs::create_dir(staging).map_err(|error| at(staging, error))?;
    for (name, bytes) in files {
        let target = out.join(name);
        if target.is_dir() {
            return Err(at(&target, io::ErrorKind::IsADirectory.into()));
        }
        fs::write(staging.join(name), bytes).map_err(|error| at(&target, error))?;
    }
    for (name, _) in files {
        let target = out.join(name);
        fs::rename(staging.join(name), &target).map_err(|error| at(&target, error))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_survive_their_files() {
        let picture = RgbImage::from_fn(5, 4, |x, y| image::Rgb([x as u8, y as u8, 200]));
        let read = image::load_from_memory(&png(&picture).unwrap()).unwrap().into_rgb8();
        assert_eq!(read, picture);
    }

    /// A directory of this test's own, removed when the test ends, also by a failure.
    struct Scratch(std::path::PathBuf);

    impl Scratch {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("output-{name}-{}", process::id()));
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }

        fn names(&self) -> Vec<String> {
            let entries = fs::read_dir(&self.0).unwrap();
            let mut names: Vec<_> =
                entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
            names.sort();
            names
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    fn files(names: &[&str]) -> Vec<(String, Vec<u8>)> {
        names.iter().map(|&name| (name.to_string(), b"new".to_vec())).collect()
    }

    #[test]
    fn write_replaces_its_own_files_and_no_others() {
        let dir = Scratch::new("replace");
        fs::write(dir.0.join("a"), "old").unwrap();
        fs::write(dir.0.join("other"), "old").unwrap();
        write(&dir.0, &files(&["a", "b"])).unwrap();
        assert_eq!(dir.names(), ["a", "b", "other"]);
        assert_eq!(fs::read(dir.0.join("a")).unwrap(), b"new");
        assert_eq!(fs::read(dir.0.join("other")).unwrap(), b"old");

        write(&dir.0.join("deep/er"), &files(&["a"])).unwrap();
        assert_eq!(fs::read(dir.0.join("deep/er/a")).unwrap(), b"new");
    }

    #[test]
    fn a_failed_write_leaves_nothing() {
        let dir = Scratch::new("fail");
        // The directory to write to is a file.
        fs::write(dir.0.join("out"), "mine").unwrap();
        let error = write(&dir.0.join("out"), &files(&["a"])).unwrap_err();
        assert!(error.to_string().contains("out"), "{error}");
        assert_eq!(dir.names(), ["out"]);
        assert_eq!(fs::read(dir.0.join("out")).unwrap(), b"mine");

        // One of the files cannot be replaced.
        fs::create_dir(dir.0.join("b")).unwrap();
        write(&dir.0, &files(&["a", "b"])).unwrap_err();
        assert_eq!(dir.names(), ["b", "out"]);

        // One of the files cannot be written, in a directory that was not there before.
        write(&dir.0.join("new"), &files(&["a", "no/such"])).unwrap_err();
        assert_eq!(dir.names(), ["b", "out"]);
    }
}
