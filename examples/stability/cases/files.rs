//! Files that are cut short, or lie: nothing is scattered, so that what is scored is the reader.

mod attempt;
mod gltf;
mod profile;

use attempt::Attempt;

use crate::case::{Case, Group, INPUT, Outcome};

pub fn cases(quick: bool) -> Vec<Case> {
    let step = if quick { 16 << 10 } else { 1 << 10 };
    vec![
        case(
            "glTF, cut short",
            "The built-in head, cut off after every 16 kB (1 kB in full).",
            move || gltf::cut(step),
        ),
        case(
            "glTF, cut short and closed",
            "The same, with the lengths of the file and its chunks as if that were all; its JSON every kB.",
            move || gltf::cut_and_closed(step),
        ),
        case(
            "glTF, headers and chunks",
            "Magic, versions, lengths and kinds of chunks that are wrong; JSON that is none, or 100000 deep.",
            gltf::containers,
        ),
        case(
            "glTF, counts and offsets",
            "A square whose counts, offsets, lengths and strides are negative, broken, too large by one or by 2⁶⁴, or text.",
            gltf::extents,
        ),
        case(
            "glTF, references",
            "Indices of vertices, accessors, views, images, materials and nodes that do not exist; types that \
             do not fit; sparse accessors, which are not read.",
            gltf::references,
        ),
        case(
            "glTF, nodes",
            "Nodes in circles, nodes that are shared, and chains and fans of 100000, which are to be read.",
            gltf::nodes,
        ),
        case(
            "glTF, numbers",
            "NaN and infinity in positions, normals and UVs, by bytes and by transforms that overflow; numbers of \
             materials beyond their ranges, which may be clamped.",
            gltf::numbers,
        ),
        case(
            "glTF, images",
            "A PNG and a JPEG up to each of their bytes, headers that claim up to 4294967295 pixels a side, data \
             URIs that are damaged.",
            gltf::images,
        ),
        case(
            "glTF, buffers",
            "Buffers that are missing, short, in a file, or data URIs that are damaged.",
            gltf::buffers,
        ),
        case(
            "glTF, nothing to draw",
            "Scenes without a triangle, to be refused; without skin, to be read.",
            gltf::nothing,
        ),
        case(
            "glTF, small files that ask for much",
            "Meshes that 3000 nodes draw, and points that 30000 nodes would, were points drawn.",
            gltf::demands,
        ),
        case(
            "profile, JSON",
            "The skin profile up to each of its bytes; wrong types, signs, counts and sums; widths and sums that are \
             odd and to be read. (Dumps of other programs, gbuffer.json and EXR, are tried the same way by \
             `cargo test --release --example filter`.)",
            profile::all,
        ),
    ]
}

fn case(name: &str, inputs: &str, attempts: impl Fn() -> Vec<Attempt> + 'static) -> Case {
    Case {
        group: Group::Files,
        name: name.into(),
        what: format!(
            "{inputs} The figure is of how many the reader panicked, took longer than 20 s, asked for more than 2 GiB \
             (where the system tells), took what is wrong or kept something that its documentation rules out, or \
             refused what is right."
        ),
        passes: 0.0,
        degrades: 0.0,
        why: "Each of them is a program that goes down, or draws nonsense, by a file.".into(),
        known: vec![],
        run: Box::new(move |_| {
            let faults: Vec<String> = attempts().into_iter().filter_map(Attempt::fault).collect();
            for fault in &faults {
                eprintln!("{fault}");
            }
            Ok(Outcome {
                figures: vec![(INPUT, faults.len() as f64)],
                shown: None,
            })
        }),
    }
}
