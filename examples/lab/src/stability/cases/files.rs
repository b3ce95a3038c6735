//! Files that are cut short, or lie: nothing is scattered, so that what is scored is the reader.

mod attempt;
mod gltf;
mod profile;

use attempt::Attempt;

use crate::stability::case::{Case, Group, INPUT, Outcome};

pub fn cases(quick: bool) -> Vec<Case> {
    let step = if quick { 16 << 10 } else { 1 << 10 };
    vec![
        case(
            "glTF, cut short",
            "The built-in head, cut off after every 16 kB (1 kB in full).",
            move || gltf::containers::cut(step),
        ),
        case(
            "glTF, cut short and closed",
            "The same, with the file's and chunks' lengths made to fit; its JSON is cut after every kB.",
            move || gltf::containers::cut_and_closed(step),
        ),
        case(
            "glTF, headers and chunks",
            "Wrong magic numbers, versions, lengths and kinds of chunks; what is not JSON, and JSON that is nested 100000 deep.",
            gltf::containers::containers,
        ),
        case(
            "glTF, counts and offsets",
            "A square whose counts, offsets, lengths and strides are negative, fractions, too large by anything from one to 2⁶⁴, or \
             text.",
            gltf::references::extents,
        ),
        case(
            "glTF, references",
            "Indices of vertices, accessors, views, images, materials and nodes that do not exist; types \
             that do not fit; sparse accessors, which the reader refuses.",
            gltf::references::references,
        ),
        case(
            "glTF, nodes",
            "Nodes in circles and shared nodes, which are to be refused; chains and fans of 100000 nodes, which are to be read.",
            gltf::nodes::nodes,
        ),
        case(
            "glTF, numbers",
            "NaN and infinity in positions, normals and UVs, by bytes and by transforms that overflow; numbers of \
             materials beyond their ranges, which may be clamped.",
            gltf::numbers::numbers,
        ),
        case(
            "glTF, images",
            "A PNG and a JPEG cut off after each of their bytes, headers that claim up to 4294967295 pixels a side, damaged data \
             URIs.",
            gltf::images::images,
        ),
        case(
            "glTF, buffers",
            "Buffers that are missing, too short, in another file, or damaged data URIs.",
            gltf::buffers::buffers,
        ),
        case(
            "glTF, nothing to draw",
            "Scenes without a triangle, which are to be refused; scenes without skin, which are to be read.",
            gltf::nodes::nothing,
        ),
        case(
            "glTF, small files that ask for much",
            "30000 vertices that 3000 nodes draw, or 30000 points that 30000 nodes do: less than a megabyte each.",
            gltf::nodes::demands,
        ),
        case(
            "profile, JSON",
            "The skin profile cut off after each of its bytes; wrong types, signs, counts and sums; unusual widths and sums, \
             which are to be read. (Dumps of other programs, gbuffer.json and EXR, are tried the same way by \
             `cargo test --release -p subsurface-lab filter`.)",
            profile::all,
        ),
    ]
}

fn case(name: &str, inputs: &str, attempts: impl Fn() -> Vec<Attempt> + 'static) -> Case {
    Case {
        group: Group::Files,
        name: name.into(),
        what: inputs.into(),
        passes: 0.0,
        degrades: 0.0,
        why: "the figure counts the inputs that make the reader panic, take longer than 20 s or ask for 2 GiB more than the \
              run ever had (where the system tells); that are wrong and are taken, or right and refused; or of which it \
              keeps what its documentation rules out. Any one of them crashes a program or has it draw nonsense."
            .into(),
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
