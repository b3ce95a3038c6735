//! What the filter refuses, and how it says so.

use std::fs;

use crate::Error;
use exr::prelude::{Compression, Encoding};
use proptest::collection::vec;
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::damage::{Damage, Lie, config};
use crate::filter::dump::{Camera, Dump};
use crate::filter::fixture::{Plane, floats, run, write, write_as};

/// What is changed of a plane, and what the error says of it.
type Wrong = (fn(&Plane), &'static [&'static str]);

#[test]
fn what_is_wrong_is_named_and_nothing_is_written() {
    const NAN: f32 = f32::NAN;
    let wrong: &[Wrong] = &[
        // The description.
        (
            |p| fs::remove_file(p.at("gbuffer.json")).unwrap(),
            &["gbuffer.json", "No such file"],
        ),
        (
            |p| fs::write(p.at("gbuffer.json"), "{").unwrap(),
            &["gbuffer.json", "EOF"],
        ),
        (
            |p| fs::write(p.at("gbuffer.json"), [0xff]).unwrap(),
            &["gbuffer.json", "UTF-8"],
        ),
        (
            |p| fs::write(p.at("gbuffer.json"), "[]").unwrap(),
            &["gbuffer.json"],
        ),
        (
            |p| p.json("/width", json!("none")),
            &["gbuffer.json", "missing field `width`"],
        ),
        (
            |p| p.json("/height", json!("none")),
            &["missing field `height`"],
        ),
        (
            |p| p.json("/projection", json!("none")),
            &["missing field `projection`"],
        ),
        (
            |p| p.json("/mm_per_unit", json!("none")),
            &["missing field `mm_per_unit`"],
        ),
        (
            |p| p.json("/files", json!("none")),
            &["missing field `files`"],
        ),
        (
            |p| p.json("/files/depth", json!("none")),
            &["missing field `depth`"],
        ),
        (
            |p| p.json("/files/irradiance", json!("none")),
            &["missing field `irradiance`"],
        ),
        (
            |p| p.json("/files/albedo", json!("a.exr")),
            &["unknown field `albedo`"],
        ),
        (
            |p| p.json("/files/a\nb", json!("a.exr")),
            &["unknown field `a"],
        ),
        (|p| p.json("/fov", json!(1)), &["unknown field `fov`"]),
        (
            |p| p.json("/files/depth", json!(1)),
            &["gbuffer.json", "expected path"],
        ),
        (
            |p| p.json("/width", json!(0)),
            &["gbuffer.json: size: got 0x4"],
        ),
        (
            |p| p.json("/height", json!(0)),
            &["gbuffer.json: size: got 8x0"],
        ),
        (
            |p| p.json("/width", json!(1_000_000)),
            &["gbuffer.json: size: got 1000000x4"],
        ),
        (|p| p.json("/width", json!(-8)), &["gbuffer.json", "-8"]),
        (|p| p.json("/width", json!(8.5)), &["gbuffer.json", "8.5"]),
        (
            |p| p.json("/mm_per_unit", json!(0)),
            &["gbuffer.json: mm_per_unit: got 0"],
        ),
        (
            |p| p.json("/mm_per_unit", json!(-1)),
            &["mm_per_unit: got -1"],
        ),
        (|p| p.json("/mm_per_unit", json!(1e300)), &["mm_per_unit"]),
        (
            |p| p.json("/mm_per_unit", json!(null)),
            &["gbuffer.json", "null"],
        ),
        (
            |p| p.json("/projection", json!([1, 2])),
            &["projection: got 2 numbers"],
        ),
        (
            |p| p.json("/projection", json!(vec![0; 17])),
            &["projection: got 17 numbers"],
        ),
        (
            |p| p.json("/projection", json!(vec![0; 16])),
            &["gbuffer.json: projection", "inverted"],
        ),
        (
            |p| p.json("/projection/5", json!(null)),
            &["gbuffer.json", "null"],
        ),
        (
            |p| p.json("/projection/0", json!(1e300)),
            &["gbuffer.json: projection", "finite"],
        ),
        (
            |p| p.json("/projection/1", json!(0.1)),
            &["gbuffer.json: projection", "apart"],
        ),
        // Row by row.
        (
            |p| {
                let rows = Plane::projection().transpose().to_cols_array();
                p.json("/projection", json!(rows));
            },
            &["gbuffer.json: projection"],
        ),
        // Left-handed.
        (
            |p| p.json("/projection/11", json!(1)),
            &["gbuffer.json: projection", "right-handed"],
        ),
        // The files.
        (
            |p| p.json("/files/depth", json!("no.exr")),
            &["no.exr", "No such file"],
        ),
        (|p| p.json("/files/depth", json!("")), &["directory"]),
        (
            |p| fs::write(p.at("depth.exr"), "no picture").unwrap(),
            &["depth.exr", "OpenEXR"],
        ),
        (
            |p| fs::write(p.at("irradiance.exr"), "").unwrap(),
            &["irradiance.exr", "OpenEXR"],
        ),
        (
            |p| {
                let bytes = fs::read(p.at("normal.exr")).unwrap();
                fs::write(p.at("normal.exr"), &bytes[..bytes.len() - 9]).unwrap();
            },
            &["normal.exr", "OpenEXR"],
        ),
        (
            |p| write(&p.at("depth.exr"), [4, 8], vec![("Z", floats([0.5; 32]))]),
            &["depth.exr: size: got 4x8", "8x4"],
        ),
        (
            |p| p.json("/height", json!(5)),
            &["irradiance.exr: size: got 8x4", "8x5"],
        ),
        (
            |p| p.three("depth.exr", ["R", "G", "B"], |_, c| c as f32),
            &["depth.exr: channels: got B, G, R"],
        ),
        (
            |p| p.three("depth.exr", ["X", "Y", "Z"], |_, _| 0.5),
            &["depth.exr: channels: got X, Y, Z"],
        ),
        (
            |p| p.three("irradiance.exr", ["X", "Y", "Z"], |_, _| 0.5),
            &["irradiance.exr: channels: got X, Y, Z", "R, G, B"],
        ),
        (
            |p| {
                let names = ["a.R", "a.G", "a.B", "b.R", "b.G", "b.B"];
                let channels = names.map(|n| (n, floats([0.5; 32]))).into();
                write(&p.at("irradiance.exr"), Plane::SIZE, channels);
            },
            &["irradiance.exr: channels: got a.B, a.G, a.R, b.B, b.G, b.R"],
        ),
        // The pixels.
        (
            |p| p.irradiance(|i, c| if i == 11 && c == 2 { NAN } else { 0.5 }),
            &["irradiance.exr: got NaN at pixel (3, 1)"],
        ),
        (
            |p| p.irradiance(|i, _| if i == 31 { f32::INFINITY } else { 0.5 }),
            &["irradiance.exr: got inf at pixel (7, 3)"],
        ),
        (
            |p| p.normal(|i, c| if i == 1 && c == 0 { NAN } else { 0.5 }),
            &["normal.exr: got NaN at pixel (1, 0)"],
        ),
        (
            |p| p.depth(|i| if i == 8 { NAN } else { 0.5 }),
            &["depth.exr: got NaN at pixel (0, 1)"],
        ),
        (
            |p| {
                let value = |i, c| if i == 8 && c == 1 { NAN } else { 0.5 };
                p.three("depth.exr", ["R", "G", "B"], value);
            },
            &["depth.exr: got NaN at pixel (0, 1)"],
        ),
        (
            |p| p.depth(|i| if i == 8 { f32::INFINITY } else { 0.5 }),
            &["depth.exr: got inf at pixel (0, 1)"],
        ),
        (
            |p| p.depth(|i| if i == 8 { -0.5 } else { 0.5 }),
            &["depth.exr: got -0.5 at pixel (0, 1)"],
        ),
        // So near that the reversed depth overflows.
        (
            |p| p.depth(|_| 1e-42),
            &["gbuffer.json: projection: got no depth for", "(0, 0)"],
        ),
        (
            |p| p.ids(|_| 2.0),
            &["profile_id.exr: got 2 at pixel (0, 0)", "0 to 1"],
        ),
        (
            |p| p.ids(|_| 0.5),
            &["profile_id.exr: got 0.5 at pixel (0, 0)"],
        ),
        (
            |p| p.ids(|_| -1.0),
            &["profile_id.exr: got -1 at pixel (0, 0)"],
        ),
        (
            |p| p.ids(|_| NAN),
            &["profile_id.exr: got NaN at pixel (0, 0)"],
        ),
        // What cannot be written.
        (
            |p| fs::create_dir(p.at("out.exr")).unwrap(),
            &["--out", "out.exr"],
        ),
    ];
    for (i, (change, says)) in wrong.iter().enumerate() {
        let plane = Plane::new(&format!("wrong-{i}"));
        change(&plane);
        let names = || -> Vec<_> {
            let entries = fs::read_dir(&plane.case.0).unwrap();
            let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name()).collect();
            names.sort();
            names
        };
        let before = names();
        // Without the plan, which is made of nothing that is wrong here.
        let error = match plane.run(&["--exact", "--png"]) {
            Ok(_) => panic!("nothing was wrong, not even {says:?}"),
            Err(error) => error.to_string(),
        };
        for text in *says {
            assert!(error.contains(text), "{error}\ndoes not say {text}");
        }
        assert_eq!(names(), before, "{error}");
    }
}

#[test]
fn options_that_do_not_fit_are_named() {
    let plane = Plane::new("options");
    let at = |name| plane.at(name).to_str().unwrap().to_owned();
    fs::write(at("bad.json"), r#"{"gaussians": []}"#).unwrap();
    let (case, out, bad, none) = (at(""), at("out.exr"), at("bad.json"), at("no.json"));
    let (case, out) = (case.as_str(), out.as_str());
    for (args, says) in [
        (vec![], "no CASE_DIR"),
        (vec![case], "no --out"),
        (vec![case, "--out"], "--out"),
        (vec![case, "--out", "x.png"], "--out: got x.png"),
        (vec![case, "--out", ""], "--out"),
        (vec![case, case, "--out", out], "command line"),
        (vec![case, "--out", out, "--what"], "--what"),
        (vec![case, "--out", out, "-x"], "-x"),
        (vec![case, "--out", out, "--png=1"], "--png"),
        (vec![case, "--out", out, "--profile", &none], "no.json"),
        (
            vec![case, "--out", out, "--profile", &bad],
            "bad.json: profile",
        ),
        (
            vec![case, "--out", out, "--variance-scale", "0"],
            "--variance-scale",
        ),
        (
            vec![case, "--out", out, "--variance-scale", "inf"],
            "--variance-scale",
        ),
        (
            vec![case, "--out", out, "--variance-scale", "3e38"],
            "--variance-scale: profile",
        ),
        (vec![case, "--out", out, "--max-error", "x"], "--max-error"),
        (
            vec![case, "--out", out, "--max-error", "1e-9"],
            "--max-error",
        ),
        (
            vec![case, "--out", out, "--max-error", "NaN"],
            "--max-error",
        ),
        (
            vec![case, "--out", out, "--exact", "--max-error", "1"],
            "--exact",
        ),
        (
            [vec![case, "--out", out], vec!["--profile=skin"; 17]].concat(),
            "--profile: got 17",
        ),
    ] {
        let error = run(&args).unwrap_err().to_string();
        assert!(error.contains(says), "{error}\ndoes not say {says}");
    }
    assert!(!plane.at("out.exr").exists());
}

/// `FILTER_DAMAGES` of them, to look for longer.
fn damages() -> usize {
    let asked = std::env::var("FILTER_DAMAGES").ok();
    asked.and_then(|n| n.parse().ok()).unwrap_or(200)
}

/// Reads a dump; what is taken must be what the effects can take.
fn check(plane: &Plane) -> Result<(), TestCaseError> {
    let read = || -> Result<Dump, Error> { Dump::read(Camera::read(&plane.case.0)?, 1) };
    match read() {
        Err(Error { got, needs, .. }) => prop_assert!(!got.is_empty() && !needs.is_empty()),
        Ok(dump) => {
            let [width, height] = dump.camera.size;
            let pixels = (width * height) as usize;
            let finite = |values: &[[f32; 4]]| values.as_flattened().iter().all(|x| x.is_finite());
            prop_assert_eq!(dump.irradiance.len(), pixels);
            prop_assert_eq!(dump.depth.len(), pixels);
            prop_assert_eq!(dump.profile_id.len(), pixels);
            prop_assert!(dump.normal.is_none_or(|n| n.len() == pixels && finite(&n)));
            prop_assert!(finite(&dump.irradiance));
            prop_assert!(dump.depth.iter().all(|d| d.is_finite()));
            prop_assert!(dump.profile_id.iter().all(|id| *id <= 1));
            prop_assert!(dump.camera.mm_per_unit.is_finite() && dump.camera.mm_per_unit > 0.0);
            prop_assert!(dump.camera.projection.is_finite() && dump.depth_error_mm.is_finite());
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(config(256))]

    #[test]
    fn a_description_that_lies_is_a_frame_or_an_error(
        lies in vec(any::<Lie>(), 0..3),
        damage in vec(any::<Damage>(), 0..3),
    ) {
        let plane = Plane::new("lies");
        let path = plane.at("gbuffer.json");
        let mut json: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        lies.iter().for_each(|lie| lie.tell(&mut json));
        let mut bytes = json.to_string().into_bytes();
        damage.iter().for_each(|damage| damage.apply(&mut bytes));
        fs::write(&path, bytes).unwrap();
        check(&plane)?;
    }

    #[test]
    fn a_damaged_file_is_a_frame_or_an_error(
        file in 0..4usize,
        damage in vec(any::<Damage>(), 1..4),
    ) {
        let plane = Plane::new("damage");
        let names = ["irradiance.exr", "depth.exr", "normal.exr", "profile_id.exr"];
        let path = plane.at(names[file]);
        let mut bytes = fs::read(&path).unwrap();
        damage.iter().for_each(|damage| damage.apply(&mut bytes));
        fs::write(&path, bytes).unwrap();
        check(&plane)?;
    }
}

/// Files that are cut off or damaged are refused, or read as something; never a panic.
#[test]
fn damaged_files_are_no_panic() {
    let plane = Plane::new("damaged");
    let mut random = 1u64;
    let mut next = |end: usize| {
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (random >> 33) as usize % end
    };
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::DWAA(None),
    ] {
        let encoding = Encoding {
            compression,
            ..Encoding::UNCOMPRESSED
        };
        let values = || floats((0..Plane::PIXELS).map(|i| 0.5 + i as f32 * 1e-3));
        let path = plane.at("depth.exr");
        write_as(
            &path,
            Plane::SIZE,
            vec![("R", values()), ("G", values()), ("B", values())],
            encoding,
        );
        let whole = fs::read(&path).unwrap();
        let mut damaged: Vec<Vec<u8>> = (0..whole.len()).map(|n| whole[..n].to_vec()).collect();
        for _ in 0..damages() {
            let mut bytes = whole.clone();
            for _ in 0..1 + next(3) {
                bytes[next(whole.len())] = next(256) as u8;
            }
            damaged.push(bytes);
        }
        for bytes in damaged {
            fs::write(&path, bytes).unwrap();
            check(&plane).unwrap();
        }
    }
}
