//! Files that are cut short, or lie. Nothing is scattered: the reader is what is scored. Files with damage
//! at random are tried by tests/properties.rs.

use std::ops::Range;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use image::ImageFormat;
use serde_json::{Value, json};
use subsurface::Profile;

use crate::model::{Model, flaw_of_profile, flaw_of_scene, glb, picture};
use crate::renderer::Scene;
use crate::stability::case::{Bound, Case, INPUT};
use crate::{Error, HEAD};

/// What has to become of an input.
#[derive(Clone, Copy, PartialEq)]
enum Must {
    Refuse,
    Take,
    /// As long as what is taken is as its documentation says.
    Either,
}
use Must::{Either, Refuse, Take};

/// Whether a reader takes an input, and what is wrong with what it took.
type Reading = Result<Option<String>, Error>;

/// An input that is read on a thread of its own, so that what becomes of it can be told.
struct Attempt {
    name: String,
    must: Must,
    read: Box<dyn FnOnce() -> Reading + Send>,
}

pub fn cases(quick: bool) -> Vec<Case> {
    let case = |name: &str, what: &str, attempts: Box<dyn Fn() -> Vec<Attempt>>| {
        let bound = Bound {
            passes: 0.0,
            degrades: 0.0,
            why: "the figure counts inputs that make the reader panic, take longer than 20 s or \
                ask for 2 GiB more than the run ever had (where the system tells); that are \
                wrong and taken, or right and refused; or of which it keeps what its \
                documentation rules out.",
        };
        Case::new(name, what, bound, move |_| {
            let faults: Vec<String> = attempts().into_iter().filter_map(Attempt::fault).collect();
            faults.iter().for_each(|fault| eprintln!("{fault}"));
            Ok(vec![(INPUT, faults.len() as f64)].into())
        })
    };
    let step = if quick { 16 << 10 } else { 1 << 10 };
    let damaged = move || [cut(step), containers(), bytes(), images()].into_iter().flatten().collect();
    let lies = || values().into_iter().chain(nodes()).collect();
    vec![
        case(
            "glTF, damaged",
            "The built-in head, cut off after every 16 kB (1 kB in full), as it is and with \
             lengths made to fit; wrong magic numbers, versions, lengths and kinds of chunks; \
             text that is not JSON, or nested 100000 deep; NaN and infinity in positions, \
             normals and UVs; indices without a vertex; a PNG and a JPEG cut off after each of \
             their bytes, or that claim up to 4294967295 pixels a side.",
            Box::new(damaged),
        ),
        case(
            "glTF, lies",
            "A square with counts, offsets, lengths and references that are negative, fractions, \
             text, or too large by one to 2⁶⁴; with wrong types, transforms that overflow, \
             buffers and images that are missing or elsewhere, and nothing to draw. Nodes in \
             circles and shared nodes; chains and fans of 100000 nodes, which are to be read; \
             small files that draw a mesh thousands of times.",
            Box::new(lies),
        ),
        case(
            "profile, JSON",
            "The skin profile cut off after each of its bytes; wrong types, signs, counts and \
             sums; unusual widths and sums, which are to be read.",
            Box::new(profiles),
        ),
    ]
}

impl Attempt {
    fn gltf(name: impl Into<String>, must: Must, bytes: Vec<u8>) -> Self {
        Self {
            name: name.into(),
            must,
            read: Box::new(move || Scene::from_glb(&bytes).map(|scene| flaw_of_scene(&scene))),
        }
    }

    /// A square, changed.
    fn model(name: impl Into<String>, must: Must, change: impl FnOnce(&mut Model)) -> Self {
        let mut model = Model::default();
        change(&mut model);
        Self::gltf(name, must, model.glb())
    }

    /// What went wrong.
    fn fault(self) -> Option<String> {
        /// An input of less than a megabyte is read in a tenth of a second, on a busy machine in some.
        const PATIENCE: Duration = Duration::from_secs(20);
        /// More than the built-in head and the largest picture that is decoded take together.
        const MAX_KIB: u64 = 2 << 20;
        let before = memory_kib();
        let (done, came) = channel();
        let read = self.read;
        // A thread that hangs is left behind. One that overflows its stack ends the program.
        thread::spawn(move || done.send(read()));
        let fault = match came.recv_timeout(PATIENCE) {
            Err(RecvTimeoutError::Disconnected) => Some("panicked".into()),
            Err(RecvTimeoutError::Timeout) => Some(format!("took more than {PATIENCE:?}")),
            Ok(Ok(Some(flaw))) => Some(format!("was taken, with {flaw}")),
            Ok(Ok(None)) => (self.must == Refuse).then(|| "was taken".into()),
            Ok(Err(e)) if self.must == Take => Some(format!("was refused: {e}")),
            Ok(Err(e)) => {
                let said = e.to_string();
                let has_reason = said.contains(": got ") && said.contains(", needs ");
                (!has_reason).then(|| format!("was refused without a reason: {said}"))
            }
        };
        let grown = before
            .zip(memory_kib())
            .and_then(|([now, peak], [_, later])| (later > peak).then(|| later.saturating_sub(now)));
        let greedy = grown.filter(|kib| *kib > MAX_KIB).map(|kib| format!("took {} MiB", kib >> 10));
        fault.or(greedy).map(|fault| format!("{} {fault}", self.name))
    }
}

/// Of this program, now and at most so far, also what was never touched; where the system tells.
fn memory_kib() -> Option<[u64; 2]> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let field = |name: &str| -> Option<u64> {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        line.trim().strip_suffix("kB")?.trim().parse().ok()
    };
    Some([field("VmSize:")?, field("VmPeak:")?])
}

/// The built-in head up to each of many lengths, and the same where its headers say that this is all.
fn cut(step: usize) -> Vec<Attempt> {
    let lengths = (0..HEAD.len()).step_by(step);
    let open = lengths.map(|n| Attempt::gltf(format!("{n} bytes"), Refuse, HEAD[..n].to_vec()));
    let json_end = 20 + u32::from_le_bytes([HEAD[12], HEAD[13], HEAD[14], HEAD[15]]) as usize;
    let (json, bytes) = (&HEAD[20..json_end], &HEAD[json_end + 8..]);
    let of_json = (0..json.len()).step_by(step.min(1024)).map(|n| (&json[..n], bytes));
    let of_bytes = (0..bytes.len()).step_by(step).map(|n| (json, &bytes[..n]));
    let closed = of_json.chain(of_bytes).map(|(json, bytes)| {
        let name = format!("{} bytes of JSON, {} of data", json.len(), bytes.len());
        Attempt::gltf(name, Refuse, glb(json, bytes))
    });
    open.chain(closed).collect()
}

/// Headers and chunks.
fn containers() -> Vec<Attempt> {
    let whole = Model::default().glb();
    let end = 20 + u32::from_le_bytes([whole[12], whole[13], whole[14], whole[15]]) as usize;
    let with = |at: usize, bytes: &[u8]| {
        let mut file = whole.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        file
    };
    let marked = [b"\xef\xbb\xbf", &whole[20..end]].concat();
    let refused: Vec<(&str, Vec<u8>)> = vec![
        ("nothing", vec![]),
        ("zeros", vec![0; 4096]),
        ("another magic", with(0, b"glTG")),
        ("version 1", with(4, &[1])),
        ("version 3", with(4, &[3])),
        ("a length of 0", with(8, &[0; 4])),
        ("a length of 11", with(8, &[11, 0, 0, 0])),
        ("a length of 12", with(8, &[12, 0, 0, 0])[..12].to_vec()),
        ("a length of 4 GiB", with(8, &[255; 4])),
        ("JSON of 0 bytes", with(12, &[0; 4])),
        ("JSON of 4 GiB", with(12, &[255; 4])),
        ("binary before JSON", with(16, b"BIN\0")),
        ("JSON twice", with(end + 4, b"JSON")),
        ("a chunk of no kind", with(16, b"NONE")),
        ("a chunk of 4 GiB", with(end, &[255; 4])),
        ("no UTF-8", with(24, &[0xff])),
        ("a byte order mark", glb(&marked, &whole[end + 8..])),
        ("no chunk of bytes", with(8, &(end as u32).to_le_bytes())[..end].to_vec()),
        ("JSON alone", Model::default().json.to_string().into_bytes()),
        ("a string that is JSON", b"\"glTF\"".to_vec()),
        ("a list", b"[]".to_vec()),
        ("an object", b"{}".to_vec()),
        ("an unfinished object", b"{\"asset\": {".to_vec()),
        ("100000 brackets", [b"[".repeat(100_000), b"]".repeat(100_000)].concat()),
        ("100000 braces", b"{\"a\":".repeat(100_000)),
    ];
    refused.into_iter().map(|(name, bytes)| Attempt::gltf(name, Refuse, bytes)).collect()
}

/// What a reader must do; places in the JSON of [`Model`], where * stands for 0 to 3; and values for them,
/// one at a time, of which null takes a value away.
const VALUES: &str = r#"
refuse /accessors/*/count /accessors/*/byteOffset /bufferViews/*/byteOffset = NUMBERS
refuse /bufferViews/*/byteLength /bufferViews/*/byteStride = NUMBERS
refuse /bufferViews/4/byteOffset /bufferViews/4/byteLength = NUMBERS
refuse /scene /scenes/0/nodes/0 /nodes/0/mesh /textures/0/source /images/0/bufferView = INDICES
refuse /meshes/0/primitives/0/indices /meshes/0/primitives/0/material = INDICES
refuse /meshes/0/primitives/0/attributes/POSITION /meshes/0/primitives/0/attributes/NORMAL = INDICES
refuse /meshes/0/primitives/0/attributes/TEXCOORD_0 /bufferViews/0/buffer = INDICES
refuse /materials/0/pbrMetallicRoughness/baseColorTexture/index /materials/0/normalTexture/index = INDICES
refuse /accessors/0/bufferView /accessors/3/bufferView = INDICES
refuse /accessors/0/count = 3
refuse /accessors/3/count = 0
take /accessors/3/count = 5
take /accessors/0/componentType = 5123
refuse /accessors/0/componentType = 5127
refuse /accessors/3/componentType = 5122 5126
refuse /accessors/0/type = "VEC2" "MAT4" "VEC5"
refuse /accessors/3/type = "VEC2"
refuse /accessors/0/bufferView /images/0/bufferView /textures/0/source /nodes/0/mesh /buffers = null
refuse /meshes/0/primitives/0/attributes/POSITION = null
take /accessors/0/sparse = {"count":1,SPARSE}
refuse /accessors/0/sparse = {"count":4294967295,SPARSE}
refuse /bufferViews/0/byteLength = 0
refuse /bufferViews/0/byteStride = 3 4 256
refuse /buffers = [{"byteLength":8},{"byteLength":8}]
refuse /buffers/0/uri = "a.bin" "a%" "a%ff.bin" ":" "file:///dev/zero" "https://example.org/a.bin"
refuse /buffers/0/uri = "BYTES" "BYTES;base64," "BYTES;base64,AAAAAAAAAAA" "BYTES;base64,\ud83d\ude00%"
refuse /images/0 = {"uri":""} {"uri":"a.png"} {"uri":"https://example.org/a.png"} {"uri":"data:image/png"}
refuse /images/0 = {"uri":"data:image/png;base64,"} {"uri":"data:image/png;base64,iVBORw0KGgo"}
refuse /images/0 = {"uri":"data:image/png;base64,*&^%"}
refuse /meshes/0/primitives = []
refuse /meshes/0/primitives/0/mode = 0 1 7
refuse /extensionsRequired = ["KHR_draco_mesh_compression"]
refuse /scenes/0/nodes = [] [0,0]
refuse /nodes/0/scale /nodes/0/translation = [1e39,1,1]
refuse /nodes/0/rotation = [1e39,0,0,1]
refuse /nodes/0/matrix = [1e39,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1] [1,0,0,0,0,1,0,0,0,0,1,0,0,0,0]
refuse /materials/0/normalTexture/scale = 1e39
refuse /materials/0/extras = {"PROFILE":1e39} {"PROFILE":-1} {"PROFILE":256} {"PROFILE":0.5}
refuse /materials/0/extras = {"PROFILE":"skin"}
take /materials/0/extras = {"PROFILE":0} {"PROFILE":255}
take /materials/0/name = "skin" "Eye"
take /meshes/0/primitives/0/material = null
take /meshes/0/primitives/0/attributes = {"POSITION":0}
either /nodes/0/scale = [0,0,0] [1e18,1e18,1e18] [1e-30,1e-30,1e-30]
either /nodes/0/matrix = [0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0]
either /materials/0/pbrMetallicRoughness/baseColorFactor = [1e39,-1e39,2,-1]
either /materials/0/pbrMetallicRoughness/roughnessFactor /materials/0/alphaCutoff = 1e39 -1e39
"#;

/// What stands in the table for longer text.
const SHORT: [(&str, &str); 5] = [
    (
        "NUMBERS",
        "-1 0.5 \"4\" 1e30 1048576 4294967295 1099511627776 9223372036854775807 18446744073709551615",
    ),
    ("INDICES", "9 -1 4294967295 18446744073709551615 \"0\""),
    ("SPARSE", r#""indices":{"bufferView":3,"componentType":5123},"values":{"bufferView":0}"#),
    ("BYTES", "data:application/octet-stream"),
    ("PROFILE", "subsurface_profile"),
];

/// The same of a profile as JSON.
const PROFILES: &str = r#"
refuse /gaussians = [] {} null
refuse /gaussians/0/variance_mm2 = -1 "1" null 1e39
refuse /gaussians/0/weight = [1,-1,1] [1e39,1,1] [1,1] [1,1,1,1] 1 null
refuse /name = "skin"
take /gaussians/0/variance_mm2 = 0 1e-45 3e38
take /gaussians/0/weight = [7,7,7] [1e-30,1e-30,1e-30]
"#;

/// A model for each value of a table.
fn told(table: &str, base: &Model) -> Vec<(String, Must, Model)> {
    let mut models = Vec::new();
    let table = SHORT.iter().fold(table.to_owned(), |table, (short, long)| table.replace(short, long));
    for line in table.lines().filter(|line| !line.is_empty()) {
        let (what, values) = line.split_once(" = ").expect("places and values");
        let mut words = what.split(' ');
        let must = match words.next() {
            Some("refuse") => Refuse,
            Some("take") => Take,
            _ => Either,
        };
        let all = words.flat_map(|place| (0..4).map(|i| place.replace('*', &i.to_string())));
        let mut all: Vec<String> = all.collect();
        all.dedup();
        for place in all {
            for value in values.split(' ') {
                let mut model = base.clone();
                model.set(&place, serde_json::from_str(value).expect("values are JSON"));
                models.push((format!("{place} of {value}"), must, model));
            }
        }
    }
    models
}

fn values() -> Vec<Attempt> {
    let mut attempts = vec![
        Attempt::model("no scenes and no nodes", Refuse, |m| {
            ["/scene", "/scenes", "/nodes"].iter().for_each(|place| m.set(place, Value::Null));
        }),
        Attempt::model("no vertices", Refuse, |m| {
            (0..3).for_each(|i| m.set(&format!("/accessors/{i}/count"), json!(0)));
        }),
        Attempt::model("an offset and a length that overflow", Refuse, |m| {
            m.set("/bufferViews/0/byteOffset", json!(u64::MAX));
            m.set("/bufferViews/0/byteLength", json!(2));
        }),
    ];
    let told = told(VALUES, &Model::default()).into_iter();
    attempts.extend(told.map(|(name, must, model)| Attempt::gltf(name, must, model.glb())));
    attempts.extend(["/dev/zero", "file:///dev/zero", ".", "%2e", "no.bin"].map(beside));
    attempts
}

/// A JSON in a folder, whose buffer is this file; some have no end.
fn beside(uri: &'static str) -> Attempt {
    let read = move || {
        let mut model = Model::default();
        model.set("/buffers/0/uri", json!(uri));
        let path = std::env::temp_dir().join(format!("stability-{}.gltf", std::process::id()));
        let unwritable = |e: std::io::Error| Error::new(path.display(), e, "a file that can be written");
        std::fs::write(&path, model.json.to_string()).map_err(unwritable)?;
        let scene = Scene::load(&path);
        std::fs::remove_file(&path).map_err(unwritable)?;
        scene.map(|scene| flaw_of_scene(&scene))
    };
    Attempt { name: format!("bytes in {uri}"), must: Refuse, read: Box::new(read) }
}

fn bytes() -> Vec<Attempt> {
    let mut attempts = Vec::new();
    for (what, part) in [("position", Model::POSITIONS), ("normal", Model::NORMALS), ("UV", Model::UVS)] {
        let mut number = |must, x: f32| {
            attempts.push(Attempt::model(format!("a {what} of {x}"), must, |m| {
                m.bytes[part.start..part.start + 4].copy_from_slice(&x.to_le_bytes());
            }));
        };
        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].into_iter().for_each(|x| number(Refuse, x));
        // Numbers, if not of this world.
        let odd = [f32::MAX, f32::MIN, f32::MIN_POSITIVE, 1e-45, -0.0];
        odd.into_iter().for_each(|x| number(Either, x));
    }
    let filled =
        |name, must, part: Range<usize>, with| Attempt::model(name, must, |m| m.bytes[part].fill(with));
    let first = Model::INDICES.start..Model::INDICES.start + 1;
    attempts.extend([
        filled("normals of no length", Either, Model::NORMALS, 0),
        filled("all vertices in one place", Either, Model::POSITIONS, 0),
        filled("all UVs in one place", Either, Model::UVS, 0),
        filled("triangles without area", Refuse, Model::INDICES, 0),
        filled("indices of 65535", Refuse, Model::INDICES, 255),
        filled("an index of as many vertices", Refuse, first, 4),
        Attempt::model("no bytes", Refuse, |m| m.bytes.clear()),
        Attempt::model("a byte that is missing", Refuse, |m| m.bytes.truncate(Model::INDICES.end - 4)),
    ]);
    attempts
}

/// Images that are too large, cut short, or none.
fn images() -> Vec<Attempt> {
    let [png, jpeg] = [ImageFormat::Png, ImageFormat::Jpeg].map(picture);
    let with = |name: String, must, picture: &[u8]| Attempt::model(name, must, |m| m.set_picture(picture));
    let mut attempts = vec![
        with("a JPEG".into(), Take, &jpeg),
        with("text for a picture".into(), Refuse, b"no picture"),
        with("a GIF".into(), Refuse, b"GIF89a\x01\0\x01\0\0\0\0;"),
    ];
    attempts.extend((0..png.len() - 12).map(|n| with(format!("{n} bytes of a PNG"), Refuse, &png[..n])));
    // What is missing of a JPEG may be drawn as grey.
    attempts.extend((0..jpeg.len()).map(|n| with(format!("{n} bytes of a JPEG"), Either, &jpeg[..n])));
    for size in
        [[0, 0], [0, 2], [100_000; 2], [1 << 30, 1], [1, 1 << 30], [i32::MAX as u32; 2], [u32::MAX; 2]]
    {
        attempts.push(with(format!("a PNG that claims {size:?}"), Refuse, &claiming(&png, size)));
    }
    // Four thousand million pixels, all of them missing but four.
    let mut large = jpeg.clone();
    let frame = large.windows(2).position(|w| w == [0xff, 0xc0]).expect("a JPEG has a frame");
    large[frame + 5..frame + 9].fill(255);
    attempts.push(with("a JPEG that claims 65535x65535".into(), Refuse, &large));
    attempts
}

/// A PNG whose header says another size, and is right to itself.
fn claiming(png: &[u8], [width, height]: [u32; 2]) -> Vec<u8> {
    let mut png = png.to_vec();
    // After the signature: length, "IHDR", width, height, five bytes, and the sum over all but the length.
    png[16..20].copy_from_slice(&width.to_be_bytes());
    png[20..24].copy_from_slice(&height.to_be_bytes());
    let sum = !png[12..29].iter().fold(!0u32, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| (sum >> 1) ^ (0xedb8_8320 & (sum & 1).wrapping_neg()))
    });
    png[29..33].copy_from_slice(&sum.to_be_bytes());
    png
}

/// Trees of nodes, and how much they draw.
fn nodes() -> Vec<Attempt> {
    let tree = |name: &str, must, nodes: Vec<Value>| {
        Attempt::model(name, must, |m| m.set("/nodes", Value::Array(nodes)))
    };
    let to = |child: usize| json!({"children": [child]});
    let mesh = || json!({"mesh": 0});
    let chain = |n: usize, node: &dyn Fn(usize) -> Value, last: Value| -> Vec<Value> {
        (1..n).map(node).chain([last]).collect()
    };
    let doubled = |i: usize| json!({"children": [i], "scale": [4, 4, 4]});
    let wide = json!({"children": (1..100_001).collect::<Vec<_>>()});
    let fan = [wide].into_iter().chain(std::iter::repeat_n(json!({}), 99_999)).chain([mesh()]);
    let circle = json!({"mesh": 0, "children": [0]});
    vec![
        tree("a node that is its own child", Refuse, vec![circle.clone()]),
        tree("two nodes in a circle", Refuse, vec![to(1), circle.clone()]),
        tree("a child twice", Refuse, vec![json!({"children": [1, 1]}), mesh()]),
        tree("a child of two", Refuse, vec![json!({"children": [1, 2]}), to(2), mesh()]),
        tree("a circle of 100000", Refuse, chain(100_000, &to, to(0))),
        tree("100000 nodes deep", Take, chain(100_000, &to, mesh())),
        tree("100000 children", Take, fan.collect()),
        // Not finite, the further down.
        tree("200 nodes that each double and double", Refuse, chain(200, &doubled, mesh())),
        // Every doubling of a tree that shares its nodes would double what there is to draw.
        tree("shared children, 60 deep", Refuse, chain(60, &|i| json!({"children": [i, i]}), mesh())),
        Attempt::model("a circle that no scene names", Refuse, |m| {
            m.set("/scene", Value::Null);
            m.set("/scenes", Value::Null);
            m.set("/nodes", json!([{"mesh": 0, "children": [1]}, {"children": [0]}]));
        }),
        drawn("a mesh of 10000 triangles, 3000 times", Refuse, 4, 30_000, 3000),
        drawn("a strip of 30000 triangles, 3000 times", Refuse, 5, 30_000, 3000),
        drawn("30000 points, 30000 times", Refuse, 0, 30_000, 30_000),
        drawn("1000 triangles, 300 times", Take, 4, 3000, 300),
    ]
}

/// Less than a megabyte, of which `nodes` draw so many corners each.
fn drawn(name: &str, must: Must, mode: u32, corners: usize, nodes: usize) -> Attempt {
    Attempt::model(name, must, |m| {
        let numbers = (0..3 * corners).flat_map(|i| (i as f32).to_le_bytes());
        m.bytes = numbers.collect();
        m.set("/meshes/0/primitives/0", json!({"attributes": {"POSITION": 0}, "mode": mode}));
        m.set("/nodes", Value::Array(vec![json!({"mesh": 0}); nodes]));
        m.set("/scenes/0/nodes", json!((0..nodes).collect::<Vec<_>>()));
        m.set("/accessors/0/count", json!(corners));
        m.set("/accessors", json!([m.json["accessors"][0]]));
        m.set("/bufferViews", json!([{"buffer": 0, "byteLength": m.bytes.len()}]));
        m.set("/buffers/0/byteLength", json!(m.bytes.len()));
        ["/images", "/textures", "/materials"].iter().for_each(|place| m.set(place, Value::Null));
    })
}

/// Profiles as JSON.
fn profiles() -> Vec<Attempt> {
    let base = Model { json: json!(Profile::SKIN), bytes: vec![] };
    let skin = base.json.to_string();
    let many = |n: usize| {
        let mut model = base.clone();
        model.set("/gaussians", Value::Array(vec![base.json["gaussians"][0].clone(); n]));
        model.json.to_string()
    };
    let mut texts: Vec<(Must, String)> = vec![
        (Take, skin.clone()),
        (Take, many(8)),
        (Refuse, many(9)),
        (Refuse, many(1000)),
        (Refuse, "[".repeat(100_000)),
        (Refuse, skin.repeat(2)),
        (Refuse, skin.replace("]}]", "]},]")),
        (Refuse, skin.replacen(':', ":[],\"gaussians\":", 1)),
        (Refuse, skin.replacen("[0.", "[1e999", 1)),
        (Refuse, skin.replacen("[0.", "[NaN", 1)),
    ];
    texts.extend((0..skin.len()).map(|n| (Refuse, skin[..n].to_owned())));
    let told = told(PROFILES, &base).into_iter();
    texts.extend(told.map(|(_, must, model)| (must, model.json.to_string())));
    let attempt = |(must, text): (Must, String)| Attempt {
        name: text.chars().take(99).collect(),
        must,
        read: Box::new(move || Ok(flaw_of_profile(&Profile::from_json(&text)?))),
    };
    texts.into_iter().map(attempt).collect()
}
