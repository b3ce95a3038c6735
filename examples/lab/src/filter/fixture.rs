//! What the tests write for the filter to read.

use std::fs;
use std::path::{Path, PathBuf};

use crate::Error;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage,
    f16,
};
use glam::Mat4;
use glam::camera::rh::proj::directx::perspective_infinite_reverse;
use serde_json::{Value, json};

use crate::filter::options::Options;

/// A directory of a test's own, removed when the test ends, also by a failure.
pub struct Scratch(pub PathBuf);

impl Scratch {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("filter-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

pub fn floats(values: impl IntoIterator<Item = f32>) -> FlatSamples {
    FlatSamples::F32(values.into_iter().collect())
}

pub fn halves(values: impl IntoIterator<Item = f32>) -> FlatSamples {
    FlatSamples::F16(values.into_iter().map(f16::from_f32).collect())
}

/// Writes channels, each with a value for every pixel.
pub fn write(path: &Path, size: [u32; 2], channels: Vec<(&str, FlatSamples)>) {
    write_as(path, size, channels, Encoding::SMALL_LOSSLESS);
}

pub fn write_as(
    path: &Path,
    size: [u32; 2],
    channels: Vec<(&str, FlatSamples)>,
    encoding: Encoding,
) {
    let channels = channels.into_iter().map(|(n, s)| AnyChannel::new(n, s));
    let layer = Layer::new(
        (size[0] as usize, size[1] as usize),
        LayerAttributes::default(),
        encoding,
        AnyChannels::sort(channels.collect()),
    );
    let image = Image::from_layer(layer);
    image.write().non_parallel().to_file(path).unwrap();
}

pub fn rgb(
    pixels: &[[f32; 4]],
    samples: fn(Vec<f32>) -> FlatSamples,
) -> Vec<(&'static str, FlatSamples)> {
    let channel = |c: usize| samples(pixels.iter().map(|p| p[c]).collect());
    ["R", "G", "B"]
        .into_iter()
        .zip([0, 1, 2].map(channel))
        .collect()
}

pub fn write_json(case: &Path, size: [u32; 2], projection: Mat4, files: &Value) {
    let json = json!({
        "width": size[0],
        "height": size[1],
        "projection": projection.to_cols_array(),
        "mm_per_unit": 1000.0,
        "files": files,
    });
    fs::write(case.join("gbuffer.json"), json.to_string()).unwrap();
}

/// The filter's command line, but for the program's name.
pub fn run(args: &[&str]) -> Result<(), Error> {
    let options = Options::parse(lexopt::Parser::from_args(args))?;
    crate::filter::filter(&options.expect("no help was asked for"))
}

pub fn read_rgb(path: &Path) -> Vec<[f32; 3]> {
    let picture = image::open(path).unwrap().into_rgb32f();
    picture.pixels().map(|p| p.0).collect()
}

/// A plane half a unit away, of 8 × 4 pixels, that has nothing wrong.
pub struct Plane {
    pub case: Scratch,
}

impl Plane {
    pub const SIZE: [u32; 2] = [8, 4];
    pub const PIXELS: usize = 32;

    pub fn new(name: &str) -> Self {
        let case = Scratch::new(name);
        let files = json!({
            "irradiance": "irradiance.exr",
            "depth": "depth.exr",
            "normal": "normal.exr",
            "profile_id": "profile_id.exr",
        });
        write_json(&case.0, Self::SIZE, Self::projection(), &files);
        let plane = Self { case };
        plane.irradiance(|_, _| 0.5);
        plane.normal(|_, c| if c == 2 { 1.0 } else { 0.0 });
        plane.depth(|_| 0.5);
        plane.ids(|_| 1.0);
        plane
    }

    pub fn projection() -> Mat4 {
        perspective_infinite_reverse(0.1, 2.0, 0.01)
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.case.0.join(name)
    }

    pub fn three(&self, file: &str, names: [&str; 3], value: impl Fn(usize, usize) -> f32) {
        let channel = |c| floats((0..Self::PIXELS).map(|i| value(i, c)));
        let channels = names.into_iter().zip([0, 1, 2].map(channel)).collect();
        write(&self.at(file), Self::SIZE, channels);
    }

    pub fn irradiance(&self, value: impl Fn(usize, usize) -> f32) {
        self.three("irradiance.exr", ["R", "G", "B"], value);
    }

    pub fn normal(&self, value: impl Fn(usize, usize) -> f32) {
        self.three("normal.exr", ["N.X", "N.Y", "N.Z"], value);
    }

    pub fn depth(&self, value: impl Fn(usize) -> f32) {
        let values = floats((0..Self::PIXELS).map(value));
        write(&self.at("depth.exr"), Self::SIZE, vec![("Z", values)]);
    }

    pub fn ids(&self, value: impl Fn(usize) -> f32) {
        let values = halves((0..Self::PIXELS).map(value));
        write(&self.at("profile_id.exr"), Self::SIZE, vec![("id", values)]);
    }

    /// Another value at a place in `gbuffer.json`.
    pub fn json(&self, place: &str, value: Value) {
        let path = self.at("gbuffer.json");
        let mut json: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        let (parent, key) = place.rsplit_once('/').unwrap();
        let parent = json.pointer_mut(parent).unwrap();
        match parent {
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
            _ if value == json!("none") => drop(parent.as_object_mut().unwrap().remove(key)),
            _ => parent[key] = value,
        }
        fs::write(path, json.to_string()).unwrap();
    }

    /// Runs the filter with a loose error, so that its plan is quick.
    pub fn run(&self, args: &[&str]) -> Result<Vec<[f32; 3]>, Error> {
        let out = self.at("out.exr");
        let common = [
            self.case.0.to_str().unwrap(),
            "--out",
            out.to_str().unwrap(),
        ];
        let how: &[&str] = if args.contains(&"--exact") {
            &[]
        } else {
            &["--max-error", "0.02"]
        };
        run(&[&common, how, args].concat())?;
        Ok(read_rgb(&out))
    }
}
