//! Channels of an OpenEXR file.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use crate::Error;
use exr::block::reader::Reader;
use exr::meta::attribute::{SampleType, Text};
use exr::meta::header::Header;
use exr::prelude::{ReadChannels as _, ReadLayers as _, ReadSpecificChannel as _, Vec2, read};

/// What red, green and blue are called: channels of colours, and of vectors.
pub const RGB: [[&str; 3]; 1] = [["R", "G", "B"]];
pub const RGB_OR_XYZ: [[&str; 3]; 2] = [["R", "G", "B"], ["X", "Y", "Z"]];

/// Pixels, row by row over the display window; 0 where the file has none.
pub struct Pixels<T = [f32; 3]> {
    pub values: Vec<T>,
    /// Whether they were half floats in the file.
    pub half: bool,
}

/// An open file, of which no pixel has been read.
struct Source<'a> {
    path: &'a Path,
    reader: Reader<BufReader<File>>,
}

/// Three channels, with or without a layer's name before theirs.
///
/// # Errors
/// A file that cannot be read, of another size, or without just one such triple.
pub fn read_three(path: &Path, size: [u32; 2], names: &[[&str; 3]]) -> Result<Pixels, Error> {
    let source = Source::open(path, size)?;
    match source.triples(names).as_slice() {
        [(part, triple)] => source.three(*part, triple),
        _ => {
            let names: Vec<_> = names.iter().map(|n| n.join(", ")).collect();
            Err(source.other_channels(&format!("one each of {}", names.join(" or "))))
        }
    }
}

/// The one channel beside alpha, whatever its name; or red, green and blue that say the same.
///
/// # Errors
/// A file that cannot be read, of another size, or with several channels that differ.
pub fn read_one(path: &Path, size: [u32; 2]) -> Result<Pixels<f32>, Error> {
    let source = Source::open(path, size)?;
    let headers = source.reader.headers().iter().enumerate();
    let channels: Vec<_> = headers
        .flat_map(|(i, header)| channel_names(header).into_iter().map(move |n| (i, n)))
        .filter(|(_, name)| name != "A" && !name.ends_with(".A"))
        .collect();
    if let [(part, name)] = channels.as_slice() {
        return source.one(*part, name);
    }
    let refused =
        source.other_channels("one channel beside alpha, or R, G and B that say the same");
    let triples = source.triples(&RGB);
    let (3, [(part, triple)]) = (channels.len(), triples.as_slice()) else {
        return Err(refused);
    };
    let Pixels { values, half } = source.three(*part, triple)?;
    // A NaN is not itself, but is to be named as what it is.
    let same = |[r, g, b]: &[f32; 3]| (r == g && g == b) || !(r + g + b).is_finite();
    if !values.iter().all(same) {
        return Err(refused);
    }
    let first = |v: &[f32; 3]| v.iter().find(|c| !c.is_finite()).copied().unwrap_or(v[0]);
    let values = values.iter().map(first).collect();
    Ok(Pixels { values, half })
}

impl<'a> Source<'a> {
    fn open(path: &'a Path, size: [u32; 2]) -> Result<Self, Error> {
        let input = path.display().to_string();
        let file = File::open(path)
            .map_err(|e| Error::new(&input, format!("\"{e}\""), "a file that can be read"))?;
        let reader =
            exr::block::read(BufReader::new(file), false).map_err(|e| bad_exr(path, &e))?;
        // Before pixels are decoded: a few damaged bytes can ask for all memory.
        for header in reader.headers() {
            let Vec2(width, height) = header.shared_attributes.display_window.size;
            if [width, height] != size.map(|s| s as usize) {
                return Err(Error::new(
                    format!("{input}: size"),
                    format!("{width}x{height}"),
                    format!("{}x{} as gbuffer.json says", size[0], size[1]),
                ));
            }
            let Vec2(data_width, data_height) = header.layer_size;
            if data_width > 2 * width || data_height > 2 * height {
                return Err(Error::new(
                    format!("{input}: data window"),
                    format!("{data_width}x{data_height}"),
                    format!("at most twice the frame, {}x{}", 2 * width, 2 * height),
                ));
            }
        }
        Ok(Self { path, reader })
    }

    fn other_channels(&self, needs: &str) -> Error {
        let headers = self.reader.headers().iter();
        let names: Vec<_> = headers.flat_map(channel_names).collect();
        let input = format!("{}: channels", self.path.display());
        Error::new(input, names.join(", "), needs)
    }

    /// Where all three of some names are: the part of the file, and the channels in full.
    fn triples(&self, names: &[[&str; 3]]) -> Vec<(usize, [String; 3])> {
        let mut found = Vec::new();
        for (part, header) in self.reader.headers().iter().enumerate() {
            let all = channel_names(header);
            for name in &all {
                let layer = &name[..name.rfind('.').map_or(0, |dot| dot + 1)];
                let triples = names.iter().map(|n| n.map(|c| format!("{layer}{c}")));
                found.extend(
                    triples
                        .filter(|t| t[0] == *name && t.iter().all(|c| all.contains(c)))
                        .map(|triple| (part, triple)),
                );
            }
        }
        found
    }

    /// Three channels of a part of the file.
    fn three(self, part: usize, names: &[String; 3]) -> Result<Pixels, Error> {
        let header = &self.reader.headers()[part];
        let half = is_half(header, &names[0]);
        let (count, place) = window(header);
        let [r, g, b] = names.each_ref().map(|n| Text::from(n.as_str()));
        let channels = read()
            .no_deep_data()
            .largest_resolution_level()
            .specific_channels()
            .required(r)
            .required(g)
            .required(b)
            .collect_pixels(
                move |_, _| vec![[0.0; 3]; count],
                move |pixels: &mut Vec<[f32; 3]>, at, (r, g, b): (f32, f32, f32)| {
                    if let Some(i) = place(at) {
                        pixels[i] = [r, g, b];
                    }
                },
            );
        let image = channels
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_chunks(self.reader)
            .map_err(|e| bad_exr(self.path, &e))?;
        let values = image.layer_data.channel_data.pixels;
        Ok(Pixels { values, half })
    }

    /// One channel of a part of the file.
    fn one(self, part: usize, name: &str) -> Result<Pixels<f32>, Error> {
        let header = &self.reader.headers()[part];
        let half = is_half(header, name);
        let (count, place) = window(header);
        let channels = read()
            .no_deep_data()
            .largest_resolution_level()
            .specific_channels()
            .required(name)
            .collect_pixels(
                move |_, _| vec![0.0; count],
                move |pixels: &mut Vec<f32>, at, (value,): (f32,)| {
                    if let Some(i) = place(at) {
                        pixels[i] = value;
                    }
                },
            );
        let image = channels
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_chunks(self.reader)
            .map_err(|e| bad_exr(self.path, &e))?;
        let values = image.layer_data.channel_data.pixels;
        Ok(Pixels { values, half })
    }
}

fn is_half(header: &Header, name: &str) -> bool {
    let mut channels = header.channels.list.iter();
    channels.any(|c| c.name == *name && c.sample_type == SampleType::F16)
}

/// How many pixels the display window has, and where in it a pixel of the data window lies: the two
/// need not be the same.
fn window(header: &Header) -> (usize, impl Fn(Vec2<usize>) -> Option<usize> + use<>) {
    let window = header.shared_attributes.display_window;
    let offset = header.own_attributes.layer_position;
    let shift = |at: i32, from: i32| i64::from(at) - i64::from(from);
    let (dx, dy) = (
        shift(offset.x(), window.position.x()),
        shift(offset.y(), window.position.y()),
    );
    let Vec2(width, height) = window.size;
    let place = move |at: Vec2<usize>| {
        let x = usize::try_from(at.x() as i64 + dx).ok()?;
        let y = usize::try_from(at.y() as i64 + dy).ok()?;
        (x < width && y < height).then_some(y * width + x)
    };
    (width * height, place)
}

fn channel_names(header: &Header) -> Vec<String> {
    let channels = header.channels.list.iter();
    channels.map(|channel| channel.name.to_string()).collect()
}

fn bad_exr(path: &Path, error: &exr::error::Error) -> Error {
    Error::new(
        path.display().to_string(),
        format!("\"{error}\""),
        "an OpenEXR file that can be read",
    )
}
