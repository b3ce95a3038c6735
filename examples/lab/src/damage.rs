//! What happens to files on their way, and what those who write them get wrong, at random.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use proptest::test_runner::RngSeed;
use serde_json::{Value, json};

/// So many inputs, the same ones on every run, unless the environment asks for others.
pub fn config(cases: u32) -> ProptestConfig {
    let asked = |name: &str| std::env::var_os(name).is_some();
    let mut config = ProptestConfig { failure_persistence: None, ..ProptestConfig::default() };
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
    /// So many are taken away, and others put there.
    Splice(Index, usize, Vec<u8>),
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
            Self::Splice(index, length, with) => {
                drop(bytes.splice(part(index, *length), with.iter().copied()))
            }
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
            8 => (place(), few()).prop_map(|(at, with)| Self::Splice(at, with.len(), with)),
            2 => (place(), few()).prop_map(|(at, with)| Self::Splice(at, 0, with)),
            2 => (place(), 1usize..64).prop_map(|(at, length)| Self::Splice(at, length, vec![])),
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
        let (at, value) = match self {
            Self::Say(at, value) => (place(at), Some(value.clone())),
            Self::Swap(from, to) => (place(to), json.pointer(place(from)).cloned()),
            Self::Leave(at) => (place(at), None),
        };
        let parent_and_key = at.rsplit_once('/').and_then(|(p, key)| Some((json.pointer_mut(p)?, key)));
        match (parent_and_key, value) {
            (Some((Value::Object(map), key)), Some(value)) => drop(map.insert(key.into(), value)),
            (Some((Value::Object(map), key)), None) => drop(map.remove(key)),
            (Some((Value::Array(list), key)), Some(value)) => {
                let slot = key.parse().ok().and_then(|i: usize| list.get_mut(i));
                slot.into_iter().for_each(|slot| *slot = value.clone());
            }
            (Some((Value::Array(list), _)), None) => drop(list.pop()),
            _ => (),
        }
    }
}

/// Where every value is, but the whole one.
fn places(json: &Value, at: &str, all: &mut Vec<String>) {
    let mut visit = |key: &dyn std::fmt::Display, value| {
        let place = format!("{at}/{key}");
        places(value, &place, all);
        all.push(place);
    };
    match json {
        Value::Object(map) => map.iter().for_each(|(key, value)| visit(key, value)),
        Value::Array(list) => list.iter().enumerate().for_each(|(i, value)| visit(&i, value)),
        _ => (),
    }
}

/// Values that are seldom right, as JSON.
const ODD: &str = "null true -1 0 1 2 0.5 1e-45 1e20 1e39 1e300 2147483648 4294967295 -9223372036854775808 \
                   18446744073709551615 \"\" \"data:,\" \"MAT4\" [] [0] {} [1e39,1e39,1e39,1e39]";

impl Arbitrary for Lie {
    type Parameters = ();
    type Strategy = BoxedStrategy<Self>;

    fn arbitrary_with((): ()) -> Self::Strategy {
        let place = any::<Index>;
        let odd = ODD.split_whitespace().map(|text| serde_json::from_str(text).expect("JSON"));
        let say = |(at, value)| Self::Say(at, value);
        prop_oneof![
            6 => (place(), select(odd.collect::<Vec<Value>>())).prop_map(say),
            2 => (place(), any::<f32>().prop_map(|x| json!(x))).prop_map(say),
            2 => (place(), (0u32..300).prop_map(|x| json!(x))).prop_map(say),
            2 => place().prop_map(Self::Leave),
            3 => (place(), place()).prop_map(|(from, to)| Self::Swap(from, to)),
        ]
        .boxed()
    }
}
