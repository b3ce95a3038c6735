//! A dumped frame: `gbuffer.json`, and the EXR files that it names.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::{Path, PathBuf};

use crate::Error;
use glam::{DMat4, Mat4};
use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::filter::channels::{self, Pixels};
use crate::filter::read_text;

/// What Blender writes to *Z* where nothing is.
const BACKGROUND: f32 = 1e10;

/// Keys that mean nothing here.
type Unknown = BTreeMap<String, IgnoredAny>;

/// What `gbuffer.json` says.
#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub struct Camera {
    width: u32,
    height: u32,
    /// View to clip space, column by column.
    projection: [f32; 16],
    pub mm_per_unit: f32,
    files: Files,
    #[serde(flatten)]
    unknown: Unknown,
    /// The directory.
    #[serde(skip)]
    case: PathBuf,
}

#[derive(Deserialize)]
#[serde(expecting = "an object")]
struct Files {
    irradiance: Layers,
    depth: Layers,
    profile_id: Option<Layers>,
    back_irradiance: Option<Layers>,
    back_depth: Option<Layers>,
    #[serde(flatten)]
    unknown: Unknown,
}

/// Where an input is: layers that are added up.
#[derive(Deserialize)]
#[serde(try_from = "Source")]
struct Layers(Vec<Layer>);

#[derive(Deserialize)]
struct Layer {
    /// From the directory of `gbuffer.json`.
    file: PathBuf,
    /// None: the file has just one that fits.
    layer: Option<String>,
    #[serde(flatten)]
    unknown: Unknown,
}

/// How a user writes it.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected a path, {\"file\": path, \"layer\": name} or a list of these to add up"
)]
enum Source {
    File(PathBuf),
    Layer(Layer),
    Sum(Vec<Layers>),
}

impl TryFrom<Source> for Layers {
    type Error = &'static str;

    fn try_from(source: Source) -> Result<Self, Self::Error> {
        Ok(Self(match source {
            Source::Sum(layers) if layers.is_empty() => return Err("an empty list of files"),
            Source::Sum(layers) => layers.into_iter().flat_map(|l| l.0).collect(),
            Source::Layer(layer) => vec![layer],
            Source::File(file) => vec![Layer { file, layer: None, unknown: Unknown::new() }],
        }))
    }
}

impl Camera {
    /// # Errors
    /// A file that cannot be read, or whose numbers cannot be those of a camera.
    pub fn read(case: &Path) -> Result<Self, Error> {
        let path = case.join("gbuffer.json");
        let mut camera: Self = serde_json::from_str(&read_text(&path)?).map_err(|e| {
            let needs = "width, height, projection (16 numbers), mm_per_unit, and files: \
                         irradiance, depth, optionally profile_id, back_irradiance and back_depth";
            Error::new(path.display(), format!("\"{e}\""), needs)
        })?;
        camera.case = case.to_owned();
        let p = camera.projection();
        let [x, y, z, w] = [0, 1, 2, 3].map(|i| p.row(i));
        let is_apart = [x.y, y.x, z.x, z.y, w.x, w.y].iter().all(|c| *c == 0.0);
        let needs = if !p.is_finite() || !p.as_dmat4().inverse().is_finite() {
            "finite numbers that can be inverted"
        } else if z.w == -1.0 && ![0.0, 1.0].contains(&w.z.abs()) {
            "columns; these look like rows"
        } else if !is_apart {
            "x, y and depth that stay apart"
        } else if w.z > 0.0 || (w.z == 0.0 && w.w <= 0.0) {
            "a camera that looks along -Z"
        } else {
            return Ok(camera);
        };
        Err(camera.error(Error::new("projection", p, needs)))
    }

    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    pub fn projection(&self) -> Mat4 {
        Mat4::from_cols_array(&self.projection)
    }

    /// Keys that are not read.
    pub fn unknown(&self) -> Vec<String> {
        let files = &self.files;
        let inputs = [&files.irradiance, &files.depth].into_iter();
        let inputs = inputs.chain(&files.profile_id).chain(&files.back_irradiance).chain(&files.back_depth);
        let layers = inputs.flat_map(|l| &l.0);
        let inner = layers.flat_map(|l| l.unknown.keys());
        let inner = files.unknown.keys().chain(inner);
        let inner = inner.map(|key| format!("files: {key}"));
        self.unknown.keys().cloned().chain(inner).collect()
    }

    /// What is wrong with it, with the file's name.
    pub fn error(&self, error: Error) -> Error {
        error.within(self.case.join("gbuffer.json").display())
    }

    /// The pixels of a layer, and the path of its file.
    fn layer(&self, layer: &Layer, one: bool) -> Result<(PathBuf, Pixels), Error> {
        let path = self.case.join(&layer.file);
        let pixels = channels::read(&path, layer.layer.as_deref(), self.size(), one)?;
        Ok((path, pixels))
    }

    /// Reads an input of light.
    fn light(&self, layers: &Layers) -> Result<Vec<[f32; 4]>, Error> {
        let mut irradiance = Vec::new();
        for layer in &layers.0 {
            let (path, Pixels { rgb, .. }) = self.layer(layer, false)?;
            irradiance.resize(rgb.len(), [0.0, 0.0, 0.0, 1.0]);
            for (i, &light) in rgb.as_flattened().iter().enumerate() {
                let sum = &mut irradiance[i / 3][i % 3];
                *sum += light;
                if !sum.is_finite() {
                    return Err(self.bad_pixel(&path, i / 3, light, "finite light"));
                }
            }
        }
        Ok(irradiance)
    }

    /// Irradiance and depth of the back layer, where the files have one.
    fn back(&self) -> Result<Option<BackLayer>, Error> {
        let (light, depth) = match (&self.files.back_irradiance, &self.files.back_depth) {
            (None, None) => return Ok(None),
            (Some(light), Some(depth)) => (light, depth),
            (light, _) => {
                let [got, missing] = match light {
                    Some(_) => ["back_irradiance", "back_depth"],
                    None => ["back_depth", "back_irradiance"],
                };
                let needs = format!("{missing}, too");
                return Err(self.error(Error::new("files", format!("{got} alone"), needs)));
            }
        };
        let projection = self.projection();
        let (path, distance, _) = self.one("back_depth", depth)?;
        let mut depth = vec![far_depth(projection); distance.len()];
        for (at, distance) in distance.into_iter().enumerate() {
            if distance != 0.0 && distance < BACKGROUND {
                let Some((written, _)) = write_depth(projection, distance) else {
                    let needs = "a distance along -Z that has a depth by projection, or 0 where nothing is";
                    return Err(self.bad_pixel(&path, at, distance, needs));
                };
                depth[at] = written;
            }
        }
        Ok(Some(BackLayer { irradiance: self.light(light)?, depth }))
    }

    /// Reads an input of one channel; with its path, and whether it was in half floats.
    fn one(&self, input: &str, layers: &Layers) -> Result<(PathBuf, Vec<f32>, bool), Error> {
        let [layer] = &*layers.0 else {
            let got = format!("a list of {}", layers.0.len());
            let error = Error::new(format!("files: {input}"), got, "one file or layer");
            return Err(self.error(error));
        };
        let (path, Pixels { rgb, is_half }) = self.layer(layer, true)?;
        // What is not finite is named later.
        let differ = |&[r, g, b]: &[f32; 3]| (r != g || g != b) && (r + g + b).is_finite();
        if let Some(at) = rgb.iter().position(differ) {
            let got = format!("{:?}", rgb[at]);
            return Err(self.bad_pixel(&path, at, &got, "one channel, or R, G and B that are equal"));
        }
        let of = |&[r, g, b]: &[f32; 3]| if r == g && g == b { r } else { r + g + b };
        Ok((path, rgb.iter().map(of).collect(), is_half))
    }

    /// An error that names a file, and a pixel by its column and row from the top left.
    fn bad_pixel(&self, path: &Path, at: usize, got: impl Display, needs: &str) -> Error {
        let [x, y] = [at % self.width as usize, at / self.width as usize];
        Error::new(path.display(), format!("{got} at pixel ({x}, {y})"), needs)
    }
}

/// A surface behind the visible one, as the effects take it.
pub struct BackLayer {
    pub irradiance: Vec<[f32; 4]>,
    /// That of the far plane where nothing is.
    pub depth: Vec<f32>,
}

/// A frame, as the effects take it.
pub struct Dump {
    pub camera: Camera,
    pub irradiance: Vec<[f32; 4]>,
    /// As the projection writes it; that of the far plane where nothing is.
    pub depth: Vec<f32>,
    /// 0 where nothing is.
    pub profile_id: Vec<u8>,
    /// The surface right behind the visible one.
    pub back: Option<BackLayer>,
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
        let projection = camera.projection();
        let irradiance = camera.light(&camera.files.irradiance)?;

        let (depth_path, distance, depth_is_half) = camera.one("depth", &camera.files.depth)?;
        let has_ids = camera.files.profile_id.is_some();
        let mut profile_id = vec![1; distance.len()];
        if let Some(source) = &camera.files.profile_id {
            let (path, ids, _) = camera.one("profile_id", source)?;
            let needs = format!("whole numbers from 0 to {profiles}, the last --profile");
            for (at, id) in ids.into_iter().enumerate() {
                if id.fract() != 0.0 || !(0.0..=profiles as f32).contains(&id) {
                    return Err(camera.bad_pixel(&path, at, id, &needs));
                }
                profile_id[at] = id as u8;
            }
        }

        let mut depth = vec![far_depth(projection); distance.len()];
        let mut depth_error_mm: f64 = 0.0;
        for (at, &distance) in distance.iter().enumerate() {
            let id = &mut profile_id[at];
            if distance == 0.0 || distance >= BACKGROUND {
                *id = 0;
            } else if let Some((written, error)) = write_depth(projection, distance) {
                depth[at] = written;
                if *id > 0 {
                    depth_error_mm = depth_error_mm.max(error * f64::from(camera.mm_per_unit));
                }
            } else if !has_ids || *id > 0 {
                let needs = "a distance along -Z that has a depth by projection; where nothing is, \
                             0, 1e10 or more, or a profile_id of 0";
                return Err(camera.bad_pixel(&depth_path, at, distance, needs));
            }
        }
        let back = camera.back()?;
        Ok(Self { camera, irradiance, depth, profile_id, back, depth_is_half, depth_error_mm })
    }

    /// The largest irradiance of a pixel that scatters, or of the back layer.
    pub fn brightest(&self) -> f32 {
        let pixels = self.irradiance.iter().zip(&self.profile_id);
        let skin = pixels.filter(|(_, id)| **id > 0).flat_map(|(e, _)| &e[..3]);
        let back = self.back.iter().flat_map(|back| &back.irradiance).flat_map(|e| &e[..3]);
        skin.chain(back).copied().fold(0.0, f32::max)
    }
}

/// Where nothing is.
fn far_depth(projection: Mat4) -> f32 {
    // Whether depth grows with the distance.
    let Mat4 { z_axis, w_axis, .. } = projection;
    let is_forward = z_axis.z * w_axis.w < w_axis.z * z_axis.w;
    if is_forward { 1.0 } else { 0.0 }
}

/// Depth of a surface at a distance along −Z, and by how much its rounding to a float moves the
/// surface, in scene units. `None` where the projection has no depth for it.
pub fn write_depth(projection: Mat4, distance: f32) -> Option<(f32, f64)> {
    let DMat4 { z_axis, w_axis, .. } = projection.as_dmat4();
    let z = -f64::from(distance);
    let w = z_axis.w * z + w_axis.w;
    let depth = ((z_axis.z * z + w_axis.z) / w) as f32;
    if !depth.is_finite() || w <= 0.0 || distance < 0.0 {
        return None;
    }
    let d = f64::from(depth);
    let back = (w_axis.z - d * w_axis.w) / (d * z_axis.w - z_axis.z);
    let error = (back - z).abs();
    error.is_finite().then_some((depth, error))
}
