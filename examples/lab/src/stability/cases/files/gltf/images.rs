//! Images.

use image::ImageFormat;
use serde_json::{Value, json};

use super::super::attempt::{Attempt, Wanted};
use super::{attempt, changed};
use crate::model::{Model, picture};

/// Images that are too large, cut short, or none.
pub fn images() -> Vec<Attempt> {
    let png = picture(ImageFormat::Png);
    let jpeg = picture(ImageFormat::Jpeg);
    let with = |name: String, wanted, picture: &[u8]| {
        let mut model = Model::default();
        model.set_picture(picture);
        attempt(name, wanted, model.glb())
    };
    let mut attempts = vec![with("a JPEG".into(), Wanted::Taken, &jpeg)];
    for n in 0..png.len() - 12 {
        attempts.push(with(
            format!("{n} bytes of a PNG"),
            Wanted::Refused,
            &png[..n],
        ));
    }
    for n in 0..jpeg.len() {
        // What is missing of a JPEG may be drawn as grey.
        attempts.push(with(
            format!("{n} bytes of a JPEG"),
            Wanted::Either,
            &jpeg[..n],
        ));
    }
    for [width, height] in [
        [0, 0],
        [0, 2],
        [100_000, 100_000],
        [1 << 30, 1],
        [1, 1 << 30],
        [i32::MAX as u32, i32::MAX as u32],
        [u32::MAX, u32::MAX],
    ] {
        let name = format!("a PNG that claims {width}x{height}");
        attempts.push(with(name, Wanted::Refused, &claiming(&png, width, height)));
    }
    let mut large = jpeg.clone();
    let frame = large
        .windows(2)
        .position(|w| w == [0xff, 0xc0])
        .expect("a JPEG has a frame");
    large[frame + 5..frame + 9].fill(255);
    // Four thousand million pixels, all of them missing but four.
    attempts.push(with(
        "a JPEG that claims 65535x65535".into(),
        Wanted::Refused,
        &large,
    ));
    attempts.extend(changed(
        Wanted::Refused,
        &[
            ("text for a picture", |m| m.set_picture(b"no picture")),
            ("a picture without bytes", |m| {
                m.set("/images/0/bufferView", Value::Null)
            }),
            ("a picture of a kind that is not read", |m| {
                m.set_picture(b"GIF89a\x01\0\x01\0\0\0\0;")
            }),
            ("a picture from a web page", |m| {
                m.set("/images/0", json!({"uri": "https://example.org/a.png"}));
            }),
            ("a picture from a file", |m| {
                m.set("/images/0", json!({"uri": "a.png"}))
            }),
            ("a data URI that ends early", |m| {
                m.set(
                    "/images/0",
                    json!({"uri": "data:image/png;base64,iVBORw0KGgo"}),
                );
            }),
            ("a data URI of nothing", |m| {
                m.set("/images/0", json!({"uri": "data:image/png;base64,"}))
            }),
            ("a data URI that is no base64", |m| {
                m.set("/images/0", json!({"uri": "data:image/png;base64,*&^%"}));
            }),
            ("a data URI without a comma", |m| {
                m.set("/images/0", json!({"uri": "data:image/png"}))
            }),
            ("a URI that is empty", |m| {
                m.set("/images/0", json!({"uri": ""}))
            }),
            ("a texture without a picture", |m| {
                m.set("/textures/0/source", Value::Null)
            }),
        ],
    ));
    attempts
}

/// A PNG whose header says another size, and is right to itself.
fn claiming(png: &[u8], width: u32, height: u32) -> Vec<u8> {
    let mut png = png.to_vec();
    // After the signature: length, "IHDR", width, height, five bytes, and the sum over all but the length.
    png[16..20].copy_from_slice(&width.to_be_bytes());
    png[20..24].copy_from_slice(&height.to_be_bytes());
    let sum = !png[12..29].iter().fold(!0u32, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| {
            (sum >> 1) ^ (0xedb8_8320 & (sum & 1).wrapping_neg())
        })
    });
    png[29..33].copy_from_slice(&sum.to_be_bytes());
    png
}
