//! Scenes that are done, kept until the chart is, so that a run that was stopped goes on.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use crate::Error;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use image::RgbImage;
use serde::{Deserialize, Serialize};

use crate::chart::clock::HostCost;
use crate::chart::plot::Series;
use crate::chart::report::SceneImages;
use crate::chart::row::Row;
use crate::output;

/// What a scene comes to.
#[derive(Default, Deserialize, Serialize)]
pub struct Done {
    pub rows: Vec<Row>,
    pub intervals: Vec<Interval>,
    pub host: Vec<Host>,
    pub heads: Vec<Series>,
    pub notes: Vec<String>,
    pub visibility: Vec<Visibility>,
    pub pictures: Vec<Images>,
}

/// What no method in screen space is spared: the visible integral against Eq. 7, relative RMSE.
#[derive(Deserialize, Serialize)]
pub struct Visibility {
    pub scene: String,
    pub rel_rmse_eq7: Option<f64>,
    pub rel_rmse_eq7_normalised: Option<f64>,
}

/// How sure a multiple of the copy is.
#[derive(Deserialize, Serialize)]
pub struct Interval {
    pub scene: String,
    pub method: String,
    pub setting: String,
    /// Timed submissions.
    pub runs: usize,
    /// Bootstrap, of the median ratio.
    pub interval_95: [f64; 2],
}

/// What a frame of one of our effects takes of a host's CPU.
#[derive(Deserialize, Serialize)]
pub struct Host {
    pub scene: String,
    pub method: String,
    pub setting: String,
    #[serde(flatten)]
    pub cost: HostCost,
}

/// [`SceneImages`] as PNG in base64.
#[derive(Deserialize, Serialize)]
pub struct Images {
    scene: String,
    truth: String,
    entries: Vec<(String, String, String)>,
}

impl Done {
    /// # Errors
    /// A picture that cannot be encoded.
    pub fn keep_images(&mut self, images: &SceneImages) -> Result<(), Error> {
        let text = |picture: &RgbImage| -> Result<String, Error> {
            let png = output::png(picture).map_err(|e| bad_picture(&e))?;
            Ok(BASE64.encode(png))
        };
        let mut entries = Vec::new();
        for (label, picture, error) in &images.entries {
            entries.push((label.clone(), text(picture)?, text(error)?));
        }
        self.pictures.push(Images { scene: images.scene.clone(), truth: text(&images.truth)?, entries });
        Ok(())
    }

    /// The pictures that were kept.
    ///
    /// # Errors
    /// One that cannot be decoded.
    pub fn images(&self) -> Result<Vec<SceneImages>, Error> {
        let picture = |text: &str| -> Result<RgbImage, Error> {
            let png = BASE64.decode(text).map_err(|e| bad_picture(&e))?;
            let picture = image::load_from_memory(&png).map_err(|e| bad_picture(&e))?;
            Ok(picture.into_rgb8())
        };
        let all = self.pictures.iter().map(|images| {
            let mut entries = Vec::new();
            for (label, shown, error) in &images.entries {
                entries.push((label.clone(), picture(shown)?, picture(error)?));
            }
            Ok(SceneImages { scene: images.scene.clone(), truth: picture(&images.truth)?, entries })
        });
        all.collect()
    }
}

fn bad_picture(error: &dyn std::fmt::Display) -> Error {
    Error::new("picture", format!("\"{error}\""), "one that can be kept")
}

/// The finished scenes of one build, given the same settings.
pub struct Progress {
    directory: PathBuf,
}

impl Progress {
    /// # Errors
    /// A program that cannot read itself.
    pub fn new(cache: &Path, settings: impl Hash) -> Result<Self, Error> {
        let program = std::env::current_exe()
            .and_then(std::fs::read)
            .map_err(|e| Error::new("chart", format!("\"{e}\""), "to read its own program"))?;
        let mut hasher = DefaultHasher::new();
        (settings, program).hash(&mut hasher);
        Ok(Self { directory: cache.join(format!("run-{:016x}", hasher.finish())) })
    }

    /// A scene that an earlier run has done.
    pub fn read(&self, scene: &str) -> Option<Done> {
        let text = std::fs::read(self.directory.join(format!("{scene}.json"))).ok()?;
        serde_json::from_slice(&text).ok()
    }

    /// # Errors
    /// A file that cannot be written.
    pub fn keep(&self, scene: &str, done: &Done) -> Result<(), Error> {
        let needs = "a directory to write to";
        let failed = |e: &dyn std::fmt::Display| Error::new("--cache", format!("\"{e}\""), needs);
        let text = serde_json::to_vec(done).map_err(|e| failed(&e))?;
        output::write(&self.directory, &[(format!("{scene}.json"), text)]).map_err(|e| failed(&e))
    }

    /// Drops them: the chart is written, and the next run is to measure anew.
    pub fn forget(&self) {
        // What cannot be removed is only ever found by the same command on the same build.
        let _ = std::fs::remove_dir_all(&self.directory);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finished_scene_is_found_again_by_the_same_command_alone() {
        let cache = std::env::temp_dir().join(format!("progress-{}", std::process::id()));
        let picture = RgbImage::from_fn(3, 2, |x, y| image::Rgb([x as u8, y as u8, 9]));
        let mut done = Done { notes: vec!["a note".into()], ..Default::default() };
        let images = SceneImages {
            scene: "front".into(),
            truth: picture.clone(),
            entries: vec![("none".into(), picture.clone(), picture.clone())],
        };
        done.keep_images(&images).unwrap();

        let progress = Progress::new(&cache, "chart").unwrap();
        assert!(progress.read("front").is_none());
        progress.keep("front", &done).unwrap();
        let found = Progress::new(&cache, "chart").unwrap().read("front").unwrap();
        assert_eq!(found.notes, done.notes);
        let found = found.images().unwrap().remove(0);
        assert_eq!(found.truth, picture);
        assert_eq!(found.entries, images.entries);
        let other = Progress::new(&cache, "chart --quick").unwrap();
        assert!(other.read("front").is_none());
        progress.forget();
        assert!(progress.read("front").is_none());
        std::fs::remove_dir_all(&cache).unwrap();
    }
}
