//! Plans beside the exact effect on a head, over sizes of the frame, views, profiles and errors: what one
//! size hides, another shows.

use subsurface::{Gaussian, Plan, Profile};
use subsurface_lab::method;
use subsurface_lab::renderer::{Camera, Lighting, Renderer, Scene, View};
use subsurface_lab::synthetic::{gpu, ours};

const HEAD: &[u8] = subsurface_lab::HEAD;

/// What a plan may differ by from the exact effect, in units of white: at the worst crease of the head, the
/// line of the lips, coarse pixels hold light from both sides.
const WORST_CREASE: f32 = 0.3;

/// Where a plan is farthest from the exact effect.
#[derive(Debug)]
struct Worst {
    difference: f32,
    pixel: [u32; 2],
    /// Pixels that hold no finite value.
    not_finite: usize,
    /// Pixels that differ by more than [`WORST_CREASE`].
    beyond: usize,
}

/// The skin profile, `widening` times as wide.
fn skin(widening: f32) -> Profile {
    let wider = |g: &Gaussian| Gaussian {
        variance_mm2: g.variance_mm2 * widening * widening,
        ..*g
    };
    let gaussians: Vec<_> = Profile::SKIN.gaussians().iter().map(wider).collect();
    Profile::new(&gaussians).unwrap()
}

/// Each plan beside the exact effect, on the head at one size.
fn sweep(
    scene: &Scene,
    size: [u32; 2],
    view: View,
    profile: Profile,
    plans: &[Plan],
) -> Vec<Worst> {
    let renderer = Renderer::new(gpu(), scene, size).unwrap();
    let camera = Camera::framing(scene, view, size);
    renderer
        .render(gpu(), &camera, &Lighting::default(), 1000.0)
        .unwrap();
    let output = renderer.scattered_target(gpu());
    let format = output.texture().format();
    let frame = renderer.gbuffer.frame(camera.projection(size), 1000.0);
    let scatter = |plan: &Plan| {
        method::scatter(gpu(), &mut ours(plan, format), &frame, &output).unwrap();
        gpu().read(&output)
    };
    let truth = scatter(&Plan::exact(&[profile]).unwrap());
    let worst_of = |plan: &Plan| {
        let mut worst = Worst {
            difference: 0.0,
            pixel: [0; 2],
            not_finite: 0,
            beyond: 0,
        };
        for (i, (found, wanted)) in (0..).zip(scatter(plan).iter().zip(&truth)) {
            if found.iter().any(|c| !c.is_finite()) {
                worst.not_finite += 1;
                continue;
            }
            let channels = found.iter().zip(wanted);
            let difference = channels.fold(0.0, |m: f32, (a, b)| m.max((a - b).abs()));
            worst.beyond += usize::from(difference > WORST_CREASE);
            if difference > worst.difference {
                worst.difference = difference;
                worst.pixel = [i % size[0], i / size[0]];
            }
        }
        worst
    };
    plans.iter().map(worst_of).collect()
}

#[test]
fn no_size_of_the_frame_goes_astray() {
    let scene = Scene::from_glb(HEAD).unwrap();
    let long = std::env::var("LONG").is_ok();
    let widenings: &[f32] = if long { &[1.0, 0.4, 2.5] } else { &[1.0] };
    let sizes: &[[u32; 2]] = if long {
        &[
            [256, 256],
            [389, 517],
            [512, 512],
            [768, 768],
            [893, 611],
            [896, 896],
            [960, 960],
            [1000, 1000],
            [1024, 1024],
            [1366, 768],
            [1920, 1080],
            [1920, 1920],
        ]
    } else {
        &[[389, 517], [768, 768]]
    };
    let views: &[View] = if long {
        &[
            View::Front,
            View::ThreeQuarter,
            View::Profile,
            View::CloseUp,
        ]
    } else {
        &[View::Front, View::ThreeQuarter]
    };
    let mut failed = 0;
    for &widening in widenings {
        let profile = skin(widening);
        let plans = [100.0, 255.0].map(|e: f32| Plan::new(&[profile], e.recip()).unwrap());
        for &view in views {
            for &size in sizes {
                if long && widening != 1.0 && (size[0] > 1024 || size[0] < 700) {
                    continue;
                }
                for (plan, worst) in plans.iter().zip(sweep(&scene, size, view, profile, &plans)) {
                    println!(
                        "{widening} x skin, {view:?}, {size:?}, 1/{:.0}: {worst:?}",
                        plan.max_error().recip()
                    );
                    failed += usize::from(worst.not_finite + worst.beyond > 0);
                }
            }
        }
    }
    assert_eq!(failed, 0);
}
