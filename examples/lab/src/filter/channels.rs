//! Channels of an OpenEXR file, picked by the name of their layer.

use std::fmt::Display;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use crate::Error;
use exr::block::UncompressedBlock;
use exr::block::reader::{ChunksReader as _, Reader};
use exr::meta::attribute::SampleType;
use exr::meta::{MetaData, header::Header};
use exr::prelude::{Compression, Vec2, f16};

/// Pixels, row by row over the display window; 0 where the file has none.
pub struct Pixels {
    /// R, G and B. Of a file that has one channel, three times the same.
    pub rgb: Vec<[f32; 3]>,
    /// Whether they were half floats in the file.
    pub is_half: bool,
}

/// Where a channel lies in a file of one or more parts.
struct Channel {
    part: usize,
    index: usize,
    /// In full, with the names of the part and of the layer before its own.
    name: String,
    sample: SampleType,
}

impl Channel {
    /// The name of its layer, and its own.
    fn split(&self) -> (&str, &str) {
        self.name.rsplit_once('.').unwrap_or(("", &self.name))
    }

    /// How well a name fits its layer or itself: 2 in full, 1 at the end after a dot.
    fn fits(&self, name: &str) -> u8 {
        let fit = |full: &str| match full.strip_suffix(name) {
            Some("") => 2,
            Some(before) if before.ends_with('.') => 1,
            _ => 0,
        };
        fit(self.split().0).max(fit(&self.name))
    }
}

/// Reads R, G and B; or, for an input of `one` channel, the only one beside alpha, whatever its name.
/// `layer` is the name of a layer or channel, in full or from a dot on: `Depth` finds `ViewLayer.Depth`.
/// Without it the whole file is searched.
///
/// # Errors
/// A file that cannot be read, of another size, or without just one channel or triple that fits.
pub fn read(path: &Path, layer: Option<&str>, size: [u32; 2], one: bool) -> Result<Pixels, Error> {
    let input = path.display();
    let refuse = |error: &dyn Display, needs| Error::new(&input, format!("\"{error}\""), needs);
    let bad_exr = |e: exr::error::Error| refuse(&e, "an OpenEXR file that can be read");
    let file = File::open(path).map_err(|e| refuse(&e, "a file that can be read"))?;
    let reader = exr::block::read(BufReader::new(file), false).map_err(bad_exr)?;
    for header in reader.headers() {
        check(header, size).map_err(|e| e.within(&input))?;
    }
    let all = channels(reader.headers());
    let fit = |c: &Channel| layer.map_or(1, |name| c.fits(name));
    let best = all.iter().map(fit).max().unwrap_or(0);
    let found = all.iter().filter(|c| best > 0 && fit(c) == best);
    let Some(picked) = pick(&found.collect::<Vec<_>>(), one) else {
        let names: Vec<_> = all.iter().map(|c| c.name.as_str()).collect();
        let what = ["one each of R, G, B", "one beside alpha"][usize::from(one)];
        let needs = match layer {
            Some(layer) => format!("{what} in a layer called {layer}"),
            None => format!("{what}; \"layer\" in gbuffer.json picks one of several"),
        };
        return Err(Error::new(format!("{input}: channels"), names.join(", "), needs));
    };
    Ok(Pixels {
        rgb: decode(reader, picked).map_err(bad_exr)?,
        is_half: picked[0].sample == SampleType::F16,
    })
}

/// Checks a part before its pixels are decoded: a few damaged bytes can ask for all memory, by its windows
/// or by the sizes in DWA's data.
fn check(header: &Header, [width, height]: [u32; 2]) -> Result<(), Error> {
    let Vec2(w, h) = header.shared_attributes.display_window.size;
    if [w, h] != [width as usize, height as usize] {
        let needs = format!("{width}x{height} as gbuffer.json says");
        return Err(Error::new("size", format!("{w}x{h}"), needs));
    }
    let Vec2(data_w, data_h) = header.layer_size;
    if data_w > 2 * w || data_h > 2 * h {
        let got = format!("{data_w}x{data_h}");
        return Err(Error::new("data window", got, "at most twice the frame"));
    }
    if let Compression::DWAA(_) | Compression::DWAB(_) = header.compression {
        return Err(Error::new("compression", "DWA", "another, such as ZIP"));
    }
    Ok(())
}

/// All channels of all parts, but of deep ones.
fn channels(headers: &[Header]) -> Vec<Channel> {
    let mut channels = Vec::new();
    for (part, header) in headers.iter().enumerate().filter(|(_, h)| !h.deep) {
        let prefix = header.own_attributes.layer_name.as_ref();
        let prefix = prefix.map_or(String::new(), |name| format!("{name}."));
        for (index, channel) in header.channels.list.iter().enumerate() {
            let mut name = channel.name.to_string();
            if !name.starts_with(&prefix) {
                name.insert_str(0, &prefix);
            }
            let sample = channel.sample_type;
            channels.push(Channel { part, index, name, sample });
        }
    }
    channels
}

/// The one triple of R, G and B in a layer; or, for an input of `one` channel, that channel three times, or
/// a triple that is alone.
fn pick<'a>(channels: &[&'a Channel], one: bool) -> Option<[&'a Channel; 3]> {
    let find = |like: &Channel, name| {
        let is = |c: &&Channel| c.part == like.part && c.split() == (like.split().0, name);
        channels.iter().copied().find(is)
    };
    let reds = channels.iter().filter(|c| c.split().1 == "R");
    let triples = reds.filter_map(|c| Some([*c, find(c, "G")?, find(c, "B")?]));
    let triples: Vec<_> = triples.collect();
    let opaque = channels.iter().copied().filter(|c| c.split().1 != "A");
    let opaque: Vec<_> = opaque.collect();
    match (one, &*opaque, &*triples) {
        (true, &[channel], _) => Some([channel; 3]),
        (true, &[_, _, _], &[triple]) | (false, _, &[triple]) => Some(triple),
        _ => None,
    }
}

/// Three channels of one part, over the display window.
fn decode(reader: Reader<BufReader<File>>, picked: [&Channel; 3]) -> exr::error::Result<Vec<[f32; 3]>> {
    let part = picked[0].part;
    let header = &reader.headers()[part];
    // The data window may be smaller or larger than the display window, and elsewhere.
    let (display, data) = (header.shared_attributes.display_window, header.own_attributes.layer_position);
    let Vec2(width, height) = display.size;
    let place = move |Vec2(x, y): Vec2<usize>| {
        let shifted = |at, from: i32, to: i32| at as i64 + i64::from(from) - i64::from(to);
        let x = usize::try_from(shifted(x, data.0, display.position.0)).ok()?;
        let y = usize::try_from(shifted(y, data.1, display.position.1)).ok()?;
        (x < width && y < height).then_some(y * width + x)
    };
    let mut pixels = vec![[0.0; 3]; width * height];
    let put = |meta: &MetaData, block: UncompressedBlock| {
        // A damaged table of chunks may lead to any.
        if block.index.layer != part || block.index.level != Vec2(0, 0) {
            return Ok(());
        }
        for line in block.lines(&meta.headers[part].channels) {
            let index = line.location.channel;
            for (c, channel) in picked.iter().enumerate().filter(|(_, p)| p.index == index) {
                let samples = line.value.chunks_exact(channel.sample.bytes_per_sample());
                for (i, bytes) in samples.enumerate() {
                    if let Some(at) = place(line.location.position + Vec2(i, 0)) {
                        pixels[at][c] = to_f32(channel.sample, bytes);
                    }
                }
            }
        }
        Ok(())
    };
    reader
        .filter_chunks(false, |_, tile, block| block.layer == part && tile.is_largest_resolution_level())?
        .decompress_sequential(false, put)?;
    Ok(pixels)
}

/// A sample in the byte order of this machine.
fn to_f32(sample: SampleType, bytes: &[u8]) -> f32 {
    match sample {
        SampleType::F16 => f16::from_bits(bytemuck::pod_read_unaligned(bytes)).to_f32(),
        SampleType::F32 => bytemuck::pod_read_unaligned(bytes),
        SampleType::U32 => bytemuck::pod_read_unaligned::<u32>(bytes) as f32,
    }
}
