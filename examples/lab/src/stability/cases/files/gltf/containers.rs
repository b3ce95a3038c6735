//! Files that are cut short, and headers and chunks that lie.

use super::super::attempt::{Attempt, Wanted};
use super::attempt;
use crate::model::{Model, glb};

use crate::HEAD;

/// The built-in head up to each of these lengths.
pub fn cut(step: usize) -> Vec<Attempt> {
    let lengths = (0..HEAD.len()).step_by(step);
    lengths
        .map(|n| attempt(format!("{n} bytes"), Wanted::Refused, HEAD[..n].to_vec()))
        .collect()
}

/// The same, where the lengths of the file and of its last chunk say that this is all.
pub fn cut_and_closed(step: usize) -> Vec<Attempt> {
    let word = |at: usize| {
        let bytes = HEAD[at..at + 4].try_into().expect("four bytes");
        u32::from_le_bytes(bytes) as usize
    };
    let json = &HEAD[20..20 + word(12)];
    let bytes = &HEAD[20 + json.len() + 8..];
    let of_json = (0..json.len())
        .step_by(step.min(1024))
        .map(|n| (&json[..n], bytes));
    let of_bytes = (0..bytes.len()).step_by(step).map(|n| (json, &bytes[..n]));
    of_json
        .chain(of_bytes)
        .map(|(json, bytes)| {
            let name = format!("{} bytes of JSON, {} of data", json.len(), bytes.len());
            attempt(name, Wanted::Refused, glb(json, bytes))
        })
        .collect()
}

/// Headers and chunks.
pub fn containers() -> Vec<Attempt> {
    let whole = Model::default().glb();
    let with = |at: usize, bytes: &[u8]| {
        let mut file = whole.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        file
    };
    let json_end = 20 + u32::from_le_bytes([whole[12], whole[13], whole[14], whole[15]]) as usize;
    let json = &whole[20..json_end];
    let refused: Vec<(&str, Vec<u8>)> = vec![
        ("nothing", vec![]),
        ("zeros", vec![0; 4096]),
        ("another magic", with(0, b"glTG")),
        ("version 1", with(4, &[1])),
        ("version 3", with(4, &[3])),
        ("a length of 0", with(8, &[0; 4])),
        ("a length of 11", with(8, &[11, 0, 0, 0])),
        (
            "a length of 12",
            with(8, &[12, 0, 0, 0]).into_iter().take(12).collect(),
        ),
        ("a length of 4 GiB", with(8, &[255; 4])),
        ("JSON of 0 bytes", with(12, &[0; 4])),
        ("JSON of 4 GiB", with(12, &[255; 4])),
        ("binary before JSON", with(16, b"BIN\0")),
        ("JSON twice", with(json_end + 4, b"JSON")),
        ("a chunk of no kind", with(16, b"NONE")),
        ("a chunk of 4 GiB", with(json_end, &[255; 4])),
        ("no UTF-8", with(24, &[0xff])),
        ("a mark of byte order", {
            let marked = [b"\xef\xbb\xbf", json].concat();
            glb(&marked, &whole[json_end + 8..])
        }),
        ("no chunk of bytes", {
            let length = (json_end as u32).to_le_bytes();
            with(8, &length)[..json_end].to_vec()
        }),
        ("a string that is JSON", b"\"glTF\"".to_vec()),
        ("a list", b"[]".to_vec()),
        ("an object", b"{}".to_vec()),
        ("an unfinished object", b"{\"asset\": {".to_vec()),
        (
            "100000 brackets",
            [b"[".repeat(100_000), b"]".repeat(100_000)].concat(),
        ),
        ("100000 braces", b"{\"a\":".repeat(100_000)),
    ];
    refused
        .into_iter()
        .map(|(name, bytes)| attempt(name, Wanted::Refused, bytes))
        .collect()
}
