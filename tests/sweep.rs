//! Plans beside the exact sum on a head, at two sizes of two views. The failure atlas goes over all sizes,
//! views and widths: `cargo run --release --example stability -- --only sizes`.

use subsurface_lab::stability::sizes::{WORST_CREASE, sweeps};
use subsurface_lab::synthetic::gpu;

#[test]
fn no_size_of_the_frame_goes_astray() {
    for sweep in sweeps(true) {
        let worst = sweep.worst(gpu()).unwrap();
        println!("{sweep:?}: {worst:.4}");
        assert!(worst <= WORST_CREASE, "{sweep:?}: {worst}");
    }
}
