//! A dumped frame: `gbuffer.json`, and the EXR files that it names.

use std::path::{Path, PathBuf};

use crate::Error;
use glam::{DMat4, Mat4};
use serde::Deserialize;

use crate::filter::channels::{self, Pixels};

/// `gbuffer.json`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Json {
    width: u32,
    height: u32,
    projection: Vec<f64>,
    mm_per_unit: f64,
    files: Files,
}

/// Paths, from where `gbuffer.json` is.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Files {
    irradiance: PathBuf,
    depth: PathBuf,
    normal: Option<PathBuf>,
    profile_id: Option<PathBuf>,
}

/// What `gbuffer.json` says.
pub struct Camera {
    pub size: [u32; 2],
    /// View to clip space.
    pub projection: Mat4,
    pub mm_per_unit: f32,
    case: PathBuf,
    /// Of `gbuffer.json`.
    path: PathBuf,
    files: Files,
}

impl Camera {
    /// # Errors
    /// A file that cannot be read, or whose numbers cannot be those of a camera.
    pub fn read(case: &Path) -> Result<Self, Error> {
        let path = case.join("gbuffer.json");
        let input = path.display().to_string();
        let text = std::fs::read_to_string(&path)
            .map_err(|e| Error::new(&input, format!("\"{e}\""), "a file that can be read"))?;
        let json: Json = serde_json::from_str(&text).map_err(|e| {
            let needs = "width, height, projection, mm_per_unit, and files: irradiance, depth, \
                         optionally normal and profile_id";
            Error::new(&input, format!("\"{e}\""), needs)
        })?;
        let refused = |what: &str, got: String, needs: &str| {
            Err(Error::new(format!("{input}: {what}"), got, needs))
        };
        let floats: Vec<f32> = json.projection.iter().map(|x| *x as f32).collect();
        let Ok(columns) = <[f32; 16]>::try_from(floats.as_slice()) else {
            let got = format!("{} numbers", floats.len());
            return refused("projection", got, "16, column by column");
        };
        let projection = Mat4::from_cols_array(&columns);
        if !projection.is_finite() || !projection.as_dmat4().inverse().is_finite() {
            let needs = "a finite matrix that can be inverted";
            return refused("projection", projection.to_string(), needs);
        }
        let [x, y, z, w] = [0, 1, 2, 3].map(|i| projection.row(i));
        if [x.y, y.x, z.x, z.y, w.x, w.y].iter().any(|c| *c != 0.0) {
            let needs = "x and y that stay apart, depth that does not depend on them, and columns, \
                         not rows, one after the other";
            return refused("projection", projection.to_string(), needs);
        }
        let mm_per_unit = json.mm_per_unit as f32;
        if !mm_per_unit.is_finite() || mm_per_unit <= 0.0 {
            let got = json.mm_per_unit.to_string();
            return refused("mm_per_unit", got, "a finite number above 0");
        }
        Ok(Self {
            size: [json.width, json.height],
            projection,
            mm_per_unit,
            case: case.to_owned(),
            path,
            files: json.files,
        })
    }

    /// What is wrong with it, with the file's name.
    pub fn error(&self, error: Error) -> Error {
        error.within(self.path.display())
    }

    fn file(&self, path: &Path) -> PathBuf {
        self.case.join(path)
    }
}

/// A frame, as the effects take it.
pub struct Dump {
    pub camera: Camera,
    pub irradiance: Vec<[f32; 4]>,
    /// In view space.
    pub normal: Option<Vec<[f32; 4]>>,
    /// As the projection writes it; 0 where nothing is.
    pub depth: Vec<f32>,
    pub profile_id: Vec<u8>,
    pub depth_is_half: bool,
    /// How far the rounding of `depth` to a float moves a surface that scatters, at most.
    pub depth_error_mm: f64,
}

impl Dump {
    /// Reads the files of a frame whose ids count up to `profiles`.
    ///
    /// # Errors
    /// The first pixel of the first file that cannot be used.
    pub fn read(camera: Camera, profiles: usize) -> Result<Self, Error> {
        let size = camera.size;
        let path = camera.file(&camera.files.irradiance);
        let Pixels { values, .. } = channels::read_three(&path, size, &channels::RGB)?;
        check(&path, size, values.as_flattened(), "finite light", |_| true)?;
        let irradiance = values.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();

        let normal = match &camera.files.normal {
            None => None,
            Some(path) => {
                let path = camera.file(path);
                let Pixels { values, .. } =
                    channels::read_three(&path, size, &channels::RGB_OR_XYZ)?;
                check(&path, size, values.as_flattened(), "finite vectors", |_| {
                    true
                })?;
                Some(values.iter().map(|&[x, y, z]| [x, y, z, 0.0]).collect())
            }
        };

        let path = camera.file(&camera.files.depth);
        let distance = channels::read_one(&path, size)?;
        let needs = "distances along −Z, 0 where nothing is";
        check(&path, size, &distance.values, needs, |z| z >= 0.0)?;
        let depth_is_half = distance.half;
        let distance = distance.values;

        let mut profile_id: Vec<u8> = match &camera.files.profile_id {
            None => vec![1; distance.len()],
            Some(path) => {
                let path = camera.file(path);
                let ids = channels::read_one(&path, size)?.values;
                let needs = format!("whole numbers from 0 to {profiles}, the last --profile");
                check(&path, size, &ids, &needs, |id| {
                    id.fract() == 0.0 && (0.0..=profiles as f32).contains(&id)
                })?;
                ids.iter().map(|id| *id as u8).collect()
            }
        };
        for (id, distance) in profile_id.iter_mut().zip(&distance) {
            if *distance == 0.0 {
                *id = 0;
            }
        }

        let mut depth = Vec::with_capacity(distance.len());
        let mut depth_error_mm: f64 = 0.0;
        for (i, (&distance, id)) in distance.iter().zip(&profile_id).enumerate() {
            if distance == 0.0 {
                depth.push(0.0);
                continue;
            }
            let Some((written, error)) = write_depth(camera.projection, distance) else {
                let got = format!("no depth for {distance} at {}", pixel(i, size));
                let needs = "a right-handed projection that looks down −Z, of such distances";
                return Err(camera.error(Error::new("projection", got, needs)));
            };
            depth.push(written);
            if *id > 0 {
                depth_error_mm = depth_error_mm.max(error * f64::from(camera.mm_per_unit));
            }
        }
        Ok(Self {
            camera,
            irradiance,
            normal,
            depth,
            profile_id,
            depth_is_half,
            depth_error_mm,
        })
    }
}

/// Depth of a surface at a distance along −Z, and by how much its rounding to a float moves the
/// surface, in scene units. `None` where the projection has no depth for it.
pub fn write_depth(projection: Mat4, distance: f32) -> Option<(f32, f64)> {
    let DMat4 { z_axis, w_axis, .. } = projection.as_dmat4();
    let z = -f64::from(distance);
    let w = z_axis.w * z + w_axis.w;
    let depth = ((z_axis.z * z + w_axis.z) / w) as f32;
    if !depth.is_finite() || w <= 0.0 {
        return None;
    }
    let d = f64::from(depth);
    let back = (w_axis.z - d * w_axis.w) / (d * z_axis.w - z_axis.z);
    let error = (back - z).abs();
    error.is_finite().then_some((depth, error))
}

/// Checks that all values, as many for each pixel, are finite and fit; names the first pixel where
/// one does not.
fn check(
    path: &Path,
    size: [u32; 2],
    values: &[f32],
    needs: &str,
    fits: impl Fn(f32) -> bool,
) -> Result<(), Error> {
    let bad = values.iter().position(|v| !v.is_finite() || !fits(*v));
    let Some(i) = bad else { return Ok(()) };
    let channels = values.len() / (size[0] * size[1]) as usize;
    let got = format!("{} at {}", values[i], pixel(i / channels, size));
    Err(Error::new(path.display().to_string(), got, needs))
}

/// A pixel by its column and row, from the top left.
fn pixel(i: usize, size: [u32; 2]) -> String {
    let width = size[0] as usize;
    format!("pixel ({}, {})", i % width, i / width)
}
