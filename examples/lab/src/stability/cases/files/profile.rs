//! Profiles as JSON that are cut short, or lie.

use serde_json::{Value, json};
use subsurface::Profile;

use super::attempt::{Attempt, Wanted};
use crate::model::flaw_of_profile;

fn attempt(name: impl Into<String>, wanted: Wanted, text: String) -> Attempt {
    Attempt::new(name, wanted, move || {
        Ok(flaw_of_profile(&Profile::from_json(&text)?))
    })
}

fn of(gaussians: &[Value]) -> String {
    json!({"gaussians": gaussians}).to_string()
}

fn one(variance: Value, weight: Value) -> String {
    of(&[json!({"variance_mm2": variance, "weight": weight})])
}

pub fn all() -> Vec<Attempt> {
    let white = || json!([1, 1, 1]);
    let plain = json!({"variance_mm2": 1, "weight": [1, 1, 1]});
    let skin: Vec<Value> = Profile::SKIN
        .gaussians()
        .iter()
        .map(|g| json!({"variance_mm2": g.variance_mm2, "weight": g.weight}))
        .collect();
    let skin = of(&skin);
    let refused: Vec<(&str, String)> = vec![
        ("no JSON", "variance".into()),
        ("a list", "[]".into()),
        ("an object", "{}".into()),
        ("null", "null".into()),
        ("100000 brackets", "[".repeat(100_000)),
        ("a zero byte", "\0".into()),
        ("two profiles", skin.repeat(2)),
        ("a comma too many", skin.replace("]}]", "]},]")),
        ("no Gaussians", of(&[])),
        ("nine Gaussians", of(&vec![plain.clone(); 9])),
        ("1000 Gaussians", of(&vec![plain.clone(); 1000])),
        (
            "Gaussians twice",
            r#"{"gaussians": [], "gaussians": []}"#.into(),
        ),
        (
            "a key that is not known",
            json!({"gaussians": [plain], "name": "skin"}).to_string(),
        ),
        ("a variance that is negative", one(json!(-1), white())),
        ("a variance that is text", one(json!("1"), white())),
        ("a variance that is null", one(Value::Null, white())),
        ("a variance of 1e39", one(json!(1e39), white())),
        (
            "a variance of 1e999",
            one(json!(7), white()).replace('7', "1e999"),
        ),
        (
            "a variance of NaN",
            one(json!(7), white()).replace('7', "NaN"),
        ),
        (
            "a weight that is negative",
            one(json!(1), json!([1, -1, 1])),
        ),
        ("a weight of 1e39", one(json!(1), json!([1e39, 1, 1]))),
        ("two weights", one(json!(1), json!([1, 1]))),
        ("four weights", one(json!(1), json!([1, 1, 1, 1]))),
        ("a weight that is a number", one(json!(1), json!(1))),
        ("a colour without weight", one(json!(1), json!([1, 0, 1]))),
        (
            "weights of no weight",
            one(json!(1), json!([1e-45, 1e-45, 1e-45])),
        ),
        (
            "a sum that is infinite",
            of(&vec![
                json!({"variance_mm2": 1, "weight": [3e38, 3e38, 3e38]});
                2
            ]),
        ),
    ];
    let taken: Vec<(&str, String)> = vec![
        ("skin", skin.clone()),
        ("eight Gaussians", of(&vec![plain; 8])),
        ("weights that sum to 7", one(json!(1), json!([7, 7, 7]))),
        (
            "weights that sum to 1e-30",
            one(json!(1), json!([1e-30, 1e-30, 1e-30])),
        ),
        ("a variance of 0", one(json!(0), white())),
        ("a variance of 1e-45", one(json!(1e-45), white())),
        ("a variance of 3e38", one(json!(3e38), white())),
    ];
    let cut = (0..skin.len())
        .map(|n| attempt(format!("{n} bytes"), Wanted::Refused, skin[..n].to_owned()));
    let refused = refused
        .into_iter()
        .map(|(name, text)| attempt(name, Wanted::Refused, text));
    let taken = taken
        .into_iter()
        .map(|(name, text)| attempt(name, Wanted::Taken, text));
    refused.chain(taken).chain(cut).collect()
}
