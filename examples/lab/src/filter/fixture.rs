//! What the tests write for the filter to read.

use std::fs;
use std::path::PathBuf;

use crate::Error;
use crate::cli::Arguments;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, Text, WritableImage, f16,
};
use glam::Mat4;
use glam::camera::rh::proj::directx::perspective_infinite_reverse;
use serde_json::{Value, json};

use crate::filter::dump::{Camera, Dump};
use crate::filter::options::Options;

pub type Samples = fn(Vec<f32>) -> FlatSamples;
pub const FLOATS: Samples = FlatSamples::F32;
pub const HALVES: Samples = |v| FlatSamples::F16(v.into_iter().map(f16::from_f32).collect());
pub const RGB: &[&str] = &["R", "G", "B"];

/// A dump in a directory of its own, which is removed when the test ends, also by a failure.
pub struct Case {
    pub dir: PathBuf,
    pub size: [u32; 2],
}

impl Drop for Case {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.dir);
    }
}

impl Case {
    /// A description, of files that are not there yet.
    pub fn new(name: &str, size: [u32; 2], projection: Mat4) -> Self {
        let dir = std::env::temp_dir().join(format!("filter-{name}-{}", std::process::id()));
        fs::create_dir_all(&dir).unwrap();
        let case = Self { dir, size };
        case.json(&json!({
            "width": size[0],
            "height": size[1],
            "projection": projection.to_cols_array(),
            "mm_per_unit": 1000,
            "files": {"irradiance": "light.exr", "depth": "depth.exr", "profile_id": "id.exr"},
        }));
        case
    }

    /// A plane half a unit away, of 8 × 4 pixels, that has nothing wrong.
    pub fn plane(name: &str) -> Self {
        let case = Self::new(name, [8, 4], perspective_infinite_reverse(0.1, 2.0, 0.01));
        case.write("light.exr", RGB, FLOATS, |_, _| 0.5);
        case.write("depth.exr", &["Z"], FLOATS, |_, _| 0.5);
        case.write("id.exr", &["V"], HALVES, |_, _| 1.0);
        case
    }

    pub fn at(&self, name: &str) -> String {
        self.dir.join(name).to_str().unwrap().to_owned()
    }

    pub fn json(&self, json: &Value) {
        fs::write(self.at("gbuffer.json"), json.to_string()).unwrap();
    }

    /// Another value at a place in `gbuffer.json`; null removes a key.
    pub fn edit(&self, place: &str, value: Value) {
        let text = fs::read(self.at("gbuffer.json")).unwrap();
        let mut json: Value = serde_json::from_slice(&text).unwrap();
        let (parent, key) = place.rsplit_once('/').unwrap();
        match json.pointer_mut(parent).unwrap() {
            Value::Object(map) if value.is_null() => drop(map.remove(key)),
            Value::Object(map) => drop(map.insert(key.into(), value)),
            list => list[key.parse::<usize>().unwrap()] = value,
        }
        self.json(&json);
    }

    /// A layer or part of some channels, of values by pixel and channel.
    pub fn layer(
        &self,
        part: Option<&str>,
        names: &[&str],
        samples: Samples,
        value: impl Fn(usize, usize) -> f32,
    ) -> Layer<AnyChannels<FlatSamples>> {
        let [width, height] = self.size.map(|s| s as usize);
        let channels = names.iter().enumerate().map(|(c, name)| {
            let values = (0..width * height).map(|i| value(i, c));
            AnyChannel::new(*name, samples(values.collect()))
        });
        let attributes = LayerAttributes { layer_name: part.map(Text::from), ..Default::default() };
        let channels = AnyChannels::sort(channels.collect());
        let encoding = Encoding::SMALL_LOSSLESS;
        Layer::new((width, height), attributes, encoding, channels)
    }

    /// A file of one or more parts that fill the frame.
    pub fn write_layers(&self, file: &str, layers: Vec<Layer<AnyChannels<FlatSamples>>>) {
        let [width, height] = self.size.map(|s| s as usize);
        let window = IntegerBounds::from_dimensions((width, height));
        let image = Image::from_layers(ImageAttributes::new(window), layers);
        image.write().non_parallel().to_file(self.at(file)).unwrap();
    }

    pub fn write(&self, file: &str, names: &[&str], samples: Samples, value: impl Fn(usize, usize) -> f32) {
        self.write_layers(file, vec![self.layer(None, names, samples, value)]);
    }

    pub fn read(&self) -> Result<Dump, Error> {
        Dump::read(Camera::read(&self.dir)?, 1)
    }

    /// Runs the filter.
    pub fn run(&self, args: &[&str]) -> Result<Vec<[f32; 3]>, Error> {
        let (dir, out) = (self.at(""), self.at("out.exr"));
        run(&[&[&dir, "--out", &out], args].concat())?;
        let picture = image::open(out).unwrap().into_rgb32f();
        Ok(picture.pixels().map(|p| p.0).collect())
    }
}

/// The filter's command line, but for the program's name.
pub fn run(args: &[&str]) -> Result<(), Error> {
    crate::filter::filter(&Options::parse(&mut Arguments::new(args))?)
}
