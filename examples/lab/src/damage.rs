//! What happens to files on their way, and what those who write them get wrong.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use proptest::test_runner::RngSeed;
use serde_json::{Value, json};

/// As many inputs, the same ones on every run, unless the environment asks for others.
pub fn config(cases: u32) -> ProptestConfig {
    let asked = |name: &str| std::env::var_os(name).is_some();
    let mut config = ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    if !asked("PROPTEST_CASES") {
        config.cases = cases;
    }
    if !asked("PROPTEST_RNG_SEED") {
        config.rng_seed = RngSeed::Fixed(1);
    }
    config
}

/// Of bytes.
#[derive(Clone, Debug)]
pub enum Damage {
    /// Others in their place.
    Overwrite(Index, Vec<u8>),
    Insert(Index, Vec<u8>),
    Remove(Index, usize),
    /// A part again, somewhere else.
    Copy(Index, Index, usize),
    Cut(Index),
}

impl Damage {
    pub fn apply(&self, bytes: &mut Vec<u8>) {
        let size = bytes.len();
        let at = |index: &Index| index.index(size + 1);
        let part = |index: &Index, length: usize| at(index)..(at(index) + length).min(size);
        match self {
            Self::Overwrite(index, with) => {
                drop(bytes.splice(part(index, with.len()), with.iter().copied()))
            }
            Self::Insert(index, with) => drop(bytes.splice(part(index, 0), with.iter().copied())),
            Self::Remove(index, length) => drop(bytes.drain(part(index, *length))),
            Self::Copy(from, to, length) => {
                let copy = bytes[part(from, *length)].to_vec();
                bytes.splice(part(to, copy.len()), copy);
            }
            Self::Cut(index) => bytes.truncate(at(index)),
        }
    }
}

impl Arbitrary for Damage {
    type Parameters = ();
    type Strategy = BoxedStrategy<Self>;

    fn arbitrary_with((): ()) -> Self::Strategy {
        let place = any::<Index>;
        let few = || vec(any::<u8>(), 1..5);
        prop_oneof![
            8 => (place(), few()).prop_map(|(at, with)| Self::Overwrite(at, with)),
            2 => (place(), few()).prop_map(|(at, with)| Self::Insert(at, with)),
            2 => (place(), 1usize..64).prop_map(|(at, length)| Self::Remove(at, length)),
            2 => (place(), place(), 1usize..64).prop_map(|(from, to, length)| Self::Copy(from, to, length)),
            1 => place().prop_map(Self::Cut),
        ]
        .boxed()
    }
}

/// Another value for one of those in a JSON.
#[derive(Clone, Debug)]
pub enum Lie {
    Say(Index, Value),
    Leave(Index),
    /// A value that is elsewhere in it.
    Swap(Index, Index),
}

impl Lie {
    pub fn tell(&self, json: &mut Value) {
        let mut all = Vec::new();
        places(json, "", &mut all);
        if all.is_empty() {
            return;
        }
        let place = |index: &Index| all[index.index(all.len())].as_str();
        match self {
            Self::Say(at, value) => {
                if let Some(slot) = json.pointer_mut(place(at)) {
                    *slot = value.clone();
                }
            }
            Self::Swap(from, to) => {
                let value = json.pointer(place(from)).cloned();
                if let (Some(value), Some(slot)) = (value, json.pointer_mut(place(to))) {
                    *slot = value;
                }
            }
            Self::Leave(at) => {
                let Some((parent, key)) = place(at).rsplit_once('/') else {
                    return;
                };
                match json.pointer_mut(parent) {
                    Some(Value::Object(map)) => drop(map.remove(key)),
                    Some(Value::Array(list)) => drop(list.pop()),
                    _ => (),
                }
            }
        }
    }
}

/// Every value's, but the whole one's.
fn places(json: &Value, at: &str, all: &mut Vec<String>) {
    let children: Vec<(String, &Value)> = match json {
        Value::Object(map) => map
            .iter()
            .map(|(key, v)| (format!("{at}/{key}"), v))
            .collect(),
        Value::Array(list) => list
            .iter()
            .enumerate()
            .map(|(i, v)| (format!("{at}/{i}"), v))
            .collect(),
        _ => vec![],
    };
    for (place, value) in children {
        places(value, &place, all);
        all.push(place);
    }
}

impl Arbitrary for Lie {
    type Parameters = ();
    type Strategy = BoxedStrategy<Self>;

    fn arbitrary_with((): ()) -> Self::Strategy {
        let place = any::<Index>;
        let odd = select(vec![
            json!(null),
            json!(true),
            json!(-1),
            json!(0),
            json!(1),
            json!(2),
            json!(0.5),
            json!(1e-45),
            json!(1e20),
            json!(1e39),
            json!(1e300),
            json!(1u64 << 31),
            json!(u32::MAX),
            json!(i64::MIN),
            json!(u64::MAX),
            json!(""),
            json!("data:,"),
            json!("MAT4"),
            json!([]),
            json!([0]),
            json!({}),
            json!([1e39, 1e39, 1e39, 1e39]),
        ]);
        let number = any::<f32>().prop_map(|x| json!(x));
        let count = (0u32..300).prop_map(|x| json!(x));
        prop_oneof![
            6 => (place(), odd).prop_map(|(at, value)| Self::Say(at, value)),
            2 => (place(), number).prop_map(|(at, value)| Self::Say(at, value)),
            2 => (place(), count).prop_map(|(at, value)| Self::Say(at, value)),
            2 => place().prop_map(Self::Leave),
            3 => (place(), place()).prop_map(|(from, to)| Self::Swap(from, to)),
        ]
        .boxed()
    }
}
