//! The failure atlas in its quick form: every method where methods fail, held to the integral.

use std::path::Path;

use subsurface_lab::stability::{Options, atlas};

#[test]
fn nothing_is_worse_than_it_is_known_to_be() {
    // A failure leaves its page and pictures there.
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("stability");
    let worse = atlas(&Options { quick: true, only: None, out }).unwrap_or_else(|error| panic!("{error}"));
    assert!(worse.is_empty(), "{}", worse.join("\n"));
}
