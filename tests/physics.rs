//! Profiles from physics against values that were computed by other programs, against closed forms and
//! against random walks. The former are of other solvers, ten million paths each for the walks.

use std::time::{Duration, Instant};

use subsurface::physics::artist::{self, Burley, VolumeScatter};
use subsurface::physics::presets::{JENSEN_2001, donner_jensen_2005};
use subsurface::physics::{
    Diffusion, Fit, Incidence, Layer, Medium, Response, Skin, Transport, single_scattering,
};
use subsurface::{Error, Plan, Profile};
use subsurface_lab::synthetic::{View, largest, plane};
use subsurface_lab::truth::closed_form::{scattered_step, softened, step};
use subsurface_lab::truth::{Walk, random_walk};

/// Where step edges are known.
const X_MM: [f64; 8] = [0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0];
/// Jensen et al.'s first skin, behind the index of the tables.
const SKIN1: [(f64, f64); 3] = [(0.032, 0.74), (0.17, 0.88), (0.48, 1.01)];

fn one(sigma_a: f64, sigma_s: f64, eta: f64) -> Medium {
    Medium::homogeneous(Layer::isotropic(sigma_a, sigma_s), eta).unwrap()
}

fn skin1(g: f64) -> [Medium; 3] {
    SKIN1.map(|(a, s)| Medium::homogeneous(Layer::isotropic(a, s).with_g(g), 1.4).unwrap())
}

fn respond(medium: &Medium) -> Response {
    Transport::default().response(medium).unwrap()
}

/// Holds an albedo and step edges to a table's.
fn hold(name: &str, response: &Response, albedo: f64, edges: [f64; 8], most: [f64; 2]) {
    let off = X_MM.into_iter().zip(edges).map(|(x, e)| (response.edge(x) - e).abs());
    let off = [(response.albedo() - albedo).abs(), largest(off)];
    println!("{name}: R off by {:.5}, E by {:.4}", off[0], off[1]);
    assert!(off[0] <= most[0] && off[1] <= most[1], "{name}: {off:?}");
}

/// By the other solver: albedos, and step edges at [`X_MM`].
const SOLVED: [[f64; 9]; 12] = [
    [0.40029, 0.5182, 0.5368, 0.5606, 0.5965, 0.6687, 0.7453, 0.8384, 0.9520],
    [0.18630, 0.5393, 0.5760, 0.6198, 0.6801, 0.7829, 0.8695, 0.9462, 0.9953],
    [0.09889, 0.5713, 0.6313, 0.6965, 0.7758, 0.8843, 0.9510, 0.9891, 0.9998],
    [0.85663, 0.5218, 0.5428, 0.5691, 0.6086, 0.6894, 0.7746, 0.8674, 0.9584],
    [0.78677, 0.5298, 0.5574, 0.5914, 0.6415, 0.7400, 0.8343, 0.9214, 0.9852],
    [0.02513, 0.5836, 0.6535, 0.7284, 0.8160, 0.9222, 0.9719, 0.9937, 0.9998],
    [0.32526, 0.5373, 0.5739, 0.6195, 0.6846, 0.7986, 0.8905, 0.9613, 0.9974],
    [0.50793, 0.5569, 0.6027, 0.6532, 0.7196, 0.8262, 0.8998, 0.9465, 0.9751],
    [0.48855, 0.5702, 0.6254, 0.6860, 0.7646, 0.8824, 0.9532, 0.9886, 0.9987],
    [0.36711, 0.5915, 0.6586, 0.7283, 0.8125, 0.9230, 0.9768, 0.9972, 1.0000],
    [0.22999, 0.6389, 0.7159, 0.7873, 0.8662, 0.9562, 0.9913, 0.9996, 1.0000],
    [0.45020, 0.5553, 0.5943, 0.6374, 0.6977, 0.8047, 0.8946, 0.9641, 0.9977],
];

#[test]
fn the_solver_agrees_with_another() {
    let [red, green, blue] = donner_jensen_2005(0.0).unwrap();
    let spectrum = Skin::LIGHT.spectrum().unwrap();
    let [blue460, red620] = [460.0, 620.0].map(|nm| {
        let (_, medium) = spectrum.iter().find(|(at, _)| *at == nm).unwrap();
        medium.clone()
    });
    let media = [
        ("skin1 red", one(0.032, 0.74, 1.4)),
        ("skin1 green", one(0.17, 0.88, 1.4)),
        ("skin1 blue", one(0.48, 1.01, 1.4)),
        ("marble red", one(0.0021, 2.19, 1.4)),
        ("marble blue", one(0.0071, 3.00, 1.4)),
        ("α′ = .3", one(0.7, 0.3, 1.4)),
        ("skin1 green, η = 1", one(0.17, 0.88, 1.0)),
        ("three layers, red", red),
        ("three layers, green", green),
        ("three layers, blue", blue),
        ("light skin, 460 nm", blue460),
        ("light skin, 620 nm", red620),
    ];
    for ((name, medium), [albedo, edges @ ..]) in media.into_iter().zip(SOLVED) {
        hold(name, &respond(&medium), albedo, edges, [0.0003, 0.0005]);
    }
    let cosine = Transport { incidence: Incidence::Cosine, ..Transport::default() };
    let edges = [0.5352, 0.5690, 0.6105, 0.6695, 0.7744, 0.8651, 0.9450, 0.9952];
    let response = cosine.response(&one(0.17, 0.88, 1.4)).unwrap();
    hold("cosine", &response, 0.18123, edges, [0.0003, 0.0005]);
    let s = [0.0, 0.5, 1.0, 2.0, 5.0, 10.0];
    let transforms = [0.186302, 0.156836, 0.118816, 0.079843, 0.043345, 0.025086];
    for (s, transform) in s.into_iter().zip(transforms) {
        let got = Transport::default().transform(&one(0.17, 0.88, 1.4), s).unwrap();
        // The table's own 2·10⁻⁵, and what the coarser mesh costs from s = 2 on.
        assert!((got - transform).abs() < 8e-5, "R̂({s}) {got} is not {transform}");
    }
}

#[test]
fn no_order_changes_what_scatters_all_ways_alike() {
    let medium = one(0.17, 0.88, 1.4);
    let g = Medium::homogeneous(Layer::isotropic(0.17, 0.88).with_g(0.8), 1.4).unwrap();
    let similar = Transport { order: 0, ..Transport::default() };
    let [a, b] = [respond(&medium), similar.response(&g).unwrap()];
    assert!((a.albedo() - b.albedo()).abs() < 1e-12);
    // Moments that are next to nothing change next to nothing, on the coarser mesh that they take.
    let faint = Medium::homogeneous(Layer::isotropic(0.17, 0.88).with_g(1e-9), 1.4).unwrap();
    let c = respond(&faint);
    assert!((a.albedo() - c.albedo()).abs() < 2e-4, "{} {}", a.albedo(), c.albedo());
    for x in X_MM {
        assert!((a.edge(x) - c.edge(x)).abs() < 2e-4, "{x} {} {}", a.edge(x), c.edge(x));
    }
}

/// Fails where two numbers differ by more than three of both standard errors together.
fn agree(name: &str, [a, a_error]: [f64; 2], [b, b_error]: [f64; 2]) {
    let sigmas = (a - b).abs() / a_error.hypot(b_error);
    assert!(sigmas < 3.0, "{name}: {a} ± {a_error} is not {b} ± {b_error}");
}

fn walk(medium: &Medium, incidence: Incidence, paths: u64) -> Walk {
    random_walk(medium, incidence, paths, 1, &|_| ())
}

#[test]
fn walks_agree_with_other_walks() {
    let at = |medium: &Medium, paths| walk(medium, Incidence::Normal, paths);
    let green = at(&one(0.17, 0.88, 1.4), 1_000_000);
    for (inner, outer, value, error) in [
        (0.02661, 0.02985, 1.409, 0.009),
        (0.08913, 0.1, 0.3276, 0.0013),
        (0.26607, 0.29854, 0.0703, 0.0003),
        (0.89125, 1.0, 0.009627, 0.00002),
        (2.66073, 2.98538, 8.656e-4, 2e-6),
        (7.07946, 7.94328, 1.220e-5, 6e-8),
    ] {
        agree("skin1 green", green.annulus(inner, outer), [value, error]);
    }
    let layers = at(&donner_jensen_2005(0.0).unwrap()[1], 400_000);
    agree("three layers", layers.albedo(), [0.48852, 0.00012]);
    for (inner, outer, value, error) in [
        (0.01496, 0.01679, 14.19, 0.06),
        (0.14962, 0.16788, 0.6337, 0.0016),
        (0.44668, 0.50119, 0.1090, 0.0002),
        (1.1885, 1.33352, 0.01049, 3e-5),
    ] {
        agree("three layers", layers.annulus(inner, outer), [value, error]);
    }
    let forward = at(&skin1(0.8)[1], 400_000);
    agree("g = .8", forward.albedo(), [0.16909, 0.0001]);
    for (inner, outer, value, error) in [
        (0.02661, 0.02985, 0.527, 0.010),
        (0.08913, 0.1, 0.1409, 0.0019),
        (0.26607, 0.29854, 0.0419, 0.0003),
        (0.89125, 1.0, 0.01024, 3e-5),
        (2.66073, 2.98538, 0.001148, 3e-6),
    ] {
        agree("g = .8", forward.annulus(inner, outer), [value, error]);
    }
    for (nm, albedo, error) in
        [(460.0, 0.22992, 0.00009), (540.0, 0.21968, 0.00008), (620.0, 0.45024, 0.00010)]
    {
        let spectrum = Skin::LIGHT.spectrum().unwrap();
        let (_, medium) = spectrum.iter().find(|(at, _)| *at == nm).unwrap();
        agree("light skin", at(medium, 200_000).albedo(), [albedo, error]);
    }
}

#[test]
fn a_walk_can_be_repeated() {
    // On however many threads, in whatever order: each of its parts has its own numbers.
    let walk = || walk(&one(0.48, 1.01, 1.4), Incidence::Cosine, 6400).albedo();
    assert_eq!(walk(), walk());
}

#[test]
fn the_solver_agrees_with_walks() {
    let isotropic = Transport::default();
    let cosine = Transport { incidence: Incidence::Cosine, ..isotropic };
    let [_, green, blue] = skin1(0.8);
    let layers = donner_jensen_2005(0.8).unwrap();
    // Two orders of moments leave up to 0.006 of E and 2 % of R at g = 0.8.
    for (name, medium, transport, edge, albedo) in [
        ("green, cosine", one(0.17, 0.88, 1.4), cosine, 0.0005, 0.0003),
        ("α′ = .3", one(0.7, 0.3, 1.4), isotropic, 0.0005, 0.0003),
        ("g = .8, green", green, isotropic, 0.006, 0.004),
        ("g = .8, blue", blue, isotropic, 0.006, 0.004),
        ("g = .8, three layers", layers[2].clone(), isotropic, 0.002, 0.006),
    ] {
        let walk = walk(&medium, transport.incidence, 300_000);
        let response = transport.response(&medium).unwrap();
        let off = X_MM.map(|x| (response.edge(x) - walk.edge(x)[0]).abs());
        let off = [largest(off), response.albedo() / walk.albedo()[0] - 1.0];
        println!("{name}: E off by {:.4}, R by {:.1} %", off[0], 100.0 * off[1]);
        let [value, error] = walk.albedo();
        let off = (response.albedo() - value).abs();
        assert!(off < albedo + 3.0 * error, "{name}: R {} {value} ± {error}", response.albedo());
        for x in X_MM {
            let [value, error] = walk.edge(x);
            let off = (response.edge(x) - value).abs();
            assert!(off < edge + 3.0 * error, "{name}: E({x}) {} {value} ± {error}", response.edge(x));
        }
    }
}

/// Four digits.
fn digits(name: &str, got: f64, value: f64) {
    assert!((got / value - 1.0).abs() < 1e-4, "{name}: {got} is not {value}");
}

#[test]
fn baselines_agree_with_their_closed_values() {
    let r_mm = [0.1, 0.3, 1.0, 3.0];
    for ((a, s), radial, total) in [
        (SKIN1[0], [0.044035, 0.041069, 0.022019, 0.0029474], 0.43596),
        (SKIN1[1], [0.061713, 0.053840, 0.018234, 0.00088640], 0.22733),
        (SKIN1[2], [0.085913, 0.064859, 0.010096, 0.00010654], 0.13100),
    ] {
        for (r, value) in r_mm.into_iter().zip(radial) {
            digits("dipole", Diffusion::Dipole.radial(&Layer::isotropic(a, s), 1.3, r), value);
        }
        digits("dipole", Diffusion::Dipole.response(&one(a, s, 1.3)).unwrap().albedo(), total);
    }
    let green = Layer::isotropic(SKIN1[1].0, SKIN1[1].1);
    let beam = [0.085982, 0.037139, 0.0086579, 0.00075935];
    let once = [0.22692, 0.029522, 0.00070812, 5.937e-7];
    for ((r, beam), once) in r_mm.into_iter().zip(beam).zip(once) {
        digits("photon beam", Diffusion::PhotonBeam.radial(&green, 1.4, r), beam);
        digits("single scattering", single_scattering(&green, 1.4, r), once);
    }
    for (medium, total) in skin1(0.0).iter().zip([0.41381, 0.19593, 0.10697]) {
        digits("photon beam", Diffusion::PhotonBeam.response(medium).unwrap().albedo(), total);
    }
    let edges = [0.5382, 0.5741, 0.6173, 0.6772, 0.7804, 0.8685, 0.9464, 0.9954];
    let response = Diffusion::PhotonBeam.response(&skin1(0.0)[1]).unwrap();
    hold("photon beam", &response, 0.19593, edges, [0.00002, 0.0001]);
    // How far they are from transport at the worst edge (one source, then along the beam, then Jensen's).
    for (medium, worst) in
        skin1(0.0).iter().zip([[-0.021, 0.001, -0.044], [-0.030, -0.003, -0.087], [-0.034, -0.009, -0.130]])
    {
        let truth = respond(medium);
        let models = [Diffusion::BetterDipole, Diffusion::PhotonBeam, Diffusion::Dipole];
        for (model, worst) in models.into_iter().zip(worst) {
            let model = model.response(medium).unwrap();
            let off = (0..200).map(|i| 0.01 * 1.05f64.powi(i)).map(|x| model.edge(x) - truth.edge(x));
            let off = off.fold(0.0, |m: f64, e| if e.abs() > m.abs() { e } else { m });
            assert!((off - worst).abs() < 0.001, "{off} is not {worst}");
        }
    }
}

#[test]
fn one_layer_is_what_the_baselines_know() {
    let layers = &donner_jensen_2005(0.0).unwrap()[0];
    let error = Diffusion::Dipole.response(layers).unwrap_err();
    assert_eq!(error.to_string(), "diffusion: layers: got 3, needs 1");
}

/// All RGB sets whose fits are known, but for those of a spectrum.
fn sets() -> Vec<(String, [Response; 3])> {
    let mut sets = Vec::new();
    let mut add = |name: String, responses: [Response; 3]| sets.push((name, responses));
    let skin2 = [(0.013, 1.09), (0.070, 1.59), (0.145, 1.79)];
    let marble = [(0.0021, 2.19), (0.0041, 2.62), (0.0071, 3.0)];
    for (name, coefficients) in [("skin1", SKIN1), ("skin2", skin2), ("marble", marble)] {
        let media = |eta| coefficients.map(|(a, s)| one(a, s, eta));
        let eta = if name == "marble" { 1.5 } else { 1.3 };
        let dipole = media(eta).map(|m| Diffusion::Dipole.response(&m).unwrap());
        add(format!("{name}, dipole"), dipole);
        for model in [Diffusion::BetterDipole, Diffusion::PhotonBeam] {
            add(format!("{name}, {model:?}"), media(1.4).map(|m| model.response(&m).unwrap()));
        }
        add(format!("{name}, transport"), media(1.4).map(|m| respond(&m)));
    }
    add("skin1, g = .8".into(), skin1(0.8).map(|m| respond(&m)));
    let walks = skin1(0.0).map(|m| walk(&m, Incidence::Normal, 200_000).response());
    add("skin1, walk".into(), walks);
    add("three layers".into(), donner_jensen_2005(0.0).unwrap().map(|m| respond(&m)));
    let burley = [(0.85, 1.55), (0.55, 0.8), (0.45, 0.55)];
    let burley = burley.map(|(a, l)| Burley::Searchlight.response(a, l).unwrap());
    add("Burley".into(), burley);
    for preset in JENSEN_2001 {
        let media = preset.media().unwrap();
        add(preset.name.into(), media.map(|m| respond(&m)));
    }
    sets
}

#[test]
fn five_gaussians_fit_every_medium() {
    for (name, responses) in sets() {
        let errors = [5, 6].map(|k| Fit::new(&responses, k).unwrap().worst());
        println!("{name}: {errors:.4?}");
        assert!(errors[0] <= 0.0035 && errors[1] <= 0.0020, "{name}: {errors:?}");
    }
}

#[test]
fn the_six_gaussians_of_2007_and_a_skin_of_three_layers() {
    let responses = donner_jensen_2005(0.0).unwrap().map(|m| respond(&m));
    let six = Fit::error_of(&Profile::SKIN, &responses).unwrap();
    for (error, known) in six.into_iter().zip([0.034, 0.104, 0.119]) {
        assert!((error - known).abs() < 0.001, "{error} is not {known}");
    }
    assert!(Fit::new(&responses, 6).unwrap().worst() < 0.0015);
}

#[test]
fn as_few_gaussians_as_the_error_allows() {
    let responses = Transport::default().responses(&skin1(0.0)).unwrap();
    let mut before = 0;
    for max_error in [0.1, 0.03, 1.0 / 255.0, 0.001] {
        let fit = Fit::within(&responses, max_error).unwrap();
        let k = fit.profile.gaussians().len();
        assert!(fit.worst() <= max_error && k > before, "{k} {:?}", fit.edge_error);
        assert!(
            Fit::new(&responses, k - 1).is_err()
                || Fit::new(&responses, k - 1).unwrap().worst() > max_error
        );
        before = k;
        assert_eq!(Fit::error_of(&fit.profile, &responses).unwrap(), fit.edge_error);
    }
    // What eight do not reach is said.
    let fit = Fit::within(&responses, 1e-6).unwrap();
    assert!(fit.profile.gaussians().len() == 8 && fit.worst() > 1e-6);
}

#[test]
fn a_sum_of_gaussians_is_its_own_fit() {
    let gaussians = [(0.04, [0.3, 0.5, 0.7]), (0.5, [0.3, 0.3, 0.3]), (4.0, [0.4, 0.2, 0.0])];
    let responses = [0, 1, 2].map(|c| Response::gaussians(gaussians.map(|(v, w)| (v, 0.5 * w[c]))));
    let fit = Fit::new(&responses, 3).unwrap();
    assert!(fit.worst() < 1e-5, "{:?}", fit.edge_error);
    assert!(fit.albedo.iter().all(|a| (a - 0.5).abs() < 1e-12));
    for (fitted, (variance, _)) in fit.profile.gaussians().iter().zip(gaussians) {
        assert!((f64::from(fitted.variance_mm2) / variance - 1.0).abs() < 0.01, "{fit:?}");
    }
}

#[test]
fn a_fitted_edge_is_that_of_a_walk() {
    let media = skin1(0.0);
    let fit = Fit::within(&Transport::default().responses(&media).unwrap(), 1.0 / 255.0).unwrap();
    for (c, medium) in media.iter().enumerate() {
        let walk = walk(medium, Incidence::Normal, 300_000);
        for x in X_MM {
            let edge = scattered_step(x, 0.0, &fit.profile)[c];
            let [value, error] = walk.edge(x);
            // The fit's error, the solver's and the walk's.
            let most = fit.edge_error[c] + 0.0005 + 3.0 * error;
            assert!((edge - value).abs() < most, "E({x}) {edge} {value} ± {error}");
        }
    }
}

/// From media to a fit to a plan to pixels: no step may cost more than it says.
#[test]
fn a_rendered_edge_is_that_of_a_walk() {
    let white = 1.0 / 255.0;
    for (name, media) in [("skin1", skin1(0.0)), ("three layers", donner_jensen_2005(0.0).unwrap())] {
        let responses = Transport::default().responses(&media).unwrap();
        let fit = Fit::within(&responses, white).unwrap();
        let plan = Plan::new(&[fit.profile], white as f32).unwrap();
        let stated = f64::from(plan.stated_error());
        assert!(stated <= 2.0 * white && fit.worst() <= f64::from(fit.profile.fit_error()) + 1e-7);
        // As many paths as bring as many back, for as little noise in blue as in red.
        let walks: [Walk; 3] = std::array::from_fn(|c| {
            walk(&media[c], Incidence::Normal, (100_000.0 / responses[c].albedo()) as u64)
        });
        let spread = walks.each_ref().map(Walk::response);
        for px_per_mm in [2.0, 10.0] {
            let sigma_mm = f64::recip(px_per_mm);
            // As wide as the plan's kernels need on both sides of what is looked at.
            let half = f64::from(fit.profile.reach_mm()) + 4.0;
            let width = (2.0 * half * px_per_mm).ceil() as u32;
            // As high as its widest levels need to be there.
            let view = View::orthographic([width, 256], px_per_mm);
            let lit = |p: glam::DVec3| glam::DVec3::splat(step(p.x, sigma_mm * sigma_mm));
            let g = view.shoot(plane(glam::DVec3::Z, 300.0, lit));
            let out = g.scatter_planned(&plan);
            let row = g.pixels(|h| h.point.x.abs() < 4.0 && h.point.y > 0.0 && h.point.y < sigma_mm);
            let mut worst = 0.0f64;
            for (i, hit) in row {
                for (c, walk) in walks.iter().enumerate() {
                    let x = hit.point.x;
                    let truth = softened(|x| spread[c].edge(x), x, sigma_mm);
                    let noise = walk.edge(x.abs())[1].max(walk.edge(x.abs() + sigma_mm)[1]);
                    let off = (f64::from(out[i][c]) - truth).abs();
                    worst = worst.max(off);
                    // The solver's own and the walk's.
                    assert!(off < stated + 0.0005 + 3.0 * noise, "{name}: {off} at {} mm", hit.point.x);
                }
            }
            println!("{name}, {px_per_mm} px/mm: {worst:.4}, {stated:.4} stated");
            assert!(worst <= 2.0 * white, "{name}: {worst}");
        }
    }
}

#[test]
fn three_skins() {
    let start = Instant::now();
    for (skin, name, albedo, widths) in [
        (
            Skin::LIGHT,
            "light",
            [0.4261, 0.2470, 0.1941],
            [[0.328, 0.112, 0.049], [1.70, 0.64, 0.36], [4.18, 1.45, 0.96]],
        ),
        (
            Skin::MEDIUM,
            "medium",
            [0.2386, 0.1051, 0.0595],
            [[0.221, 0.049, 0.012], [1.38, 0.42, 0.14], [3.64, 1.02, 0.51]],
        ),
        (
            Skin::DARK,
            "dark",
            [0.1012, 0.0353, 0.0172],
            [[0.131, 0.012, 0.003], [1.17, 0.23, 0.01], [3.34, 0.71, 0.03]],
        ),
    ] {
        let responses = skin.responses(&Transport::default()).unwrap();
        for c in 0..3 {
            let got = responses[c].albedo();
            // The table's last digit, and how the weights of the spectrum are rounded.
            assert!((got - albedo[c]).abs() < 0.0003, "{name}: R {got} is not {}", albedo[c]);
            for (share, widths) in [0.5, 0.9, 0.99].into_iter().zip(widths) {
                let got = responses[c].half_width(share);
                // 2 % of a width, and half of the last digit.
                let most = 0.02 * widths[c] + if widths[c] < 0.33 { 0.005 } else { 0.01 };
                assert!((got - widths[c]).abs() < most, "{name}: {share} in {got}, not {}", widths[c]);
            }
        }
        let fit = |k| Fit::new(&responses, k).unwrap();
        let (five, six) = (fit(5), fit(6));
        println!("{name}: {:.4?} {:.4?} floor {:.4?}", five.edge_error, six.edge_error, five.floor);
        if name == "light" {
            assert!(five.worst() <= 0.0035 && six.worst() <= 0.0020, "{five:?} {six:?}");
        }
        // The others' floors are of weights that may not be negative.
        let floor = six.floor.into_iter().fold(0.0, f64::max);
        assert!(six.worst() <= floor + 0.001, "{name}: {six:?}");
        let within = Fit::within(&responses, 1.0 / 255.0).unwrap();
        println!("{name}: {} Gaussians, {:.4?}", within.profile.gaussians().len(), within.edge_error);
    }
    println!("three skins in {:?}", start.elapsed());
    let [red, green, blue] = Skin::LIGHT.responses(&Transport::default()).unwrap();
    for (name, response, albedo, edges) in [
        ("red", red, 0.4261, [0.5551, 0.5940, 0.6367, 0.6962, 0.8025, 0.8929, 0.9635, 0.9975]),
        ("green", green, 0.2470, [0.6066, 0.6725, 0.7379, 0.8178, 0.9260, 0.9814, 0.9997, 1.0002]),
        ("blue", blue, 0.1941, [0.6671, 0.7524, 0.8254, 0.8986, 0.9711, 0.9959, 1.0007, 1.0001]),
    ] {
        hold(name, &response, albedo, edges, [0.0003, 0.001]);
    }
}

#[test]
fn burley_is_its_own_formula() {
    let response = Burley::Searchlight.response(0.7, 1.0).unwrap();
    assert!((response.albedo() - 0.7).abs() < 1e-9);
    // s(.7) = 1.157, d = 1/1.157; the table is of d = 1.
    let unit = Burley::Searchlight.response(0.7, 1.157).unwrap();
    for (x, edge) in [(0.1, 0.56318), (0.3, 0.63755), (1.0, 0.77699), (3.0, 0.91917), (10.0, 0.99493)] {
        assert!((unit.edge(x) - edge).abs() < 5e-5, "E({x}) {} is not {edge}", unit.edge(x));
    }
    for (k, worst) in [(3, 0.0055), (4, 0.0023), (5, 0.0010)] {
        let [a, b, c] = [(); 3].map(|()| response.clone());
        let fit = Fit::new(&[a, b, c], k).unwrap();
        assert!(fit.worst() < worst, "k = {k}: {}", fit.worst());
    }
}

/// The worst difference of two step edges.
fn apart(a: &Response, b: &Response) -> f64 {
    let at = |i| 0.01 * 1.05f64.powi(i);
    largest((0..200).map(at).map(|x| (a.edge(x) - b.edge(x)).abs()))
}

/// The medium without a refracting surface that sends this much light back, straight in.
fn searchlight_medium(albedo: f64) -> Medium {
    let (mut least, mut most) = (0.0, 1.0 - 1e-4);
    for _ in 0..20 {
        let alpha = 0.5 * (least + most);
        let medium = one(1.0 - alpha, alpha, 1.0);
        if Transport::default().transform(&medium, 0.0).unwrap() < albedo {
            least = alpha;
        } else {
            most = alpha;
        }
    }
    one(1.0 - most, most, 1.0)
}

#[test]
fn burley_and_the_walk_it_was_fitted_to() {
    // Searchlight and diffuse; a mean free path of 1 mm.
    for (a, searchlight, diffuse) in [
        (0.2, 0.008, 0.004),
        (0.35, 0.002, 0.003),
        (0.55, 0.006, 0.007),
        (0.7, 0.005, 0.007),
        (0.85, 0.023, 0.010),
        (0.95, 0.041, 0.032),
    ] {
        let straight = respond(&searchlight_medium(a));
        let cosine = Transport { incidence: Incidence::Cosine, ..Transport::default() };
        let diffused = artist::random_walk(a, 1.0, 0.0).unwrap();
        let diffused = cosine.response(&diffused).unwrap();
        // Kulla & Conty's inversion, of which this says "within 0.002", rounded.
        assert!((diffused.albedo() - a).abs() < 0.0025, "{} is not {a}", diffused.albedo());
        for (form, truth, known) in
            [(Burley::Searchlight, straight, searchlight), (Burley::Diffuse, diffused, diffuse)]
        {
            let off = apart(&form.response(a, 1.0).unwrap(), &truth);
            println!("A = {a}, {form:?}: {off:.4}");
            // The table's last digit, and where it sampled edges.
            assert!((off - known).abs() < 0.001, "A = {a}, {form:?}: {off} is not {known}");
        }
    }
}

#[test]
fn what_artists_set_is_what_media_have() {
    let gltf = VolumeScatter {
        multiscatter: 0.7,
        anisotropy: 0.5,
        attenuation: 0.2,
        attenuation_distance_m: 0.001,
        ior: 1.4,
    };
    let layer = gltf.medium().unwrap().layers()[0];
    let sigma_t = layer.sigma_a_per_mm + layer.sigma_s_per_mm;
    assert!((sigma_t - 5f64.ln()).abs() < 1e-12 && layer.g == 0.5);
    // 1 m of radius at a scale of a thousandth is 1 mm.
    let free = artist::blender_mean_free_path_mm(1.0, 0.001);
    assert!((free - 1.0 / (4.0 * std::f64::consts::PI)).abs() < 1e-15);
    // Blender's inversion is of the dipole, by its closed form.
    let medium = artist::blender_skin(0.4, 1.0, 1.4, 0.0).unwrap();
    let albedo = Diffusion::Dipole.response(&medium).unwrap().albedo();
    assert!((albedo - 0.4).abs() < 0.0002, "{albedo}");
    let layer = medium.layers()[0];
    let diffuse_free = 1.0 / (3.0 * layer.sigma_a_per_mm * layer.sigma_t_reduced()).sqrt();
    assert!((diffuse_free - 1.0).abs() < 1e-9, "{diffuse_free}");
}

/// Whether an error names this input.
fn names(error: Error, input: &str) {
    assert!(error.to_string().starts_with(&format!("{input}: ")), "{error}");
}

#[test]
fn what_no_medium_has_is_named() {
    let layer = Layer::isotropic(0.1, 1.0);
    let nan = f64::NAN;
    let bad = |layers: &[Layer], eta, says: &str| {
        let error = Medium::new(layers, eta).unwrap_err().to_string();
        assert!(error.contains(says), "{error} does not say {says}");
    };
    bad(&[], 1.4, "layers: got 0");
    bad(&[layer; 9], 1.4, "layers: got 9");
    bad(&[layer], 0.9, "eta: got 0.9");
    bad(&[layer], nan, "eta: got NaN");
    bad(&[layer.thick(1.0)], 1.4, "thickness_mm of layer 0: got 1");
    bad(&[layer, layer], 1.4, "thickness_mm of layer 0: got inf");
    bad(&[layer.thick(-1.0), layer], 1.4, "thickness_mm of layer 0: got -1");
    bad(&[Layer::isotropic(-0.1, 1.0)], 1.4, "sigma_a_per_mm of layer 0: got -0.1");
    bad(&[Layer::isotropic(0.1, nan)], 1.4, "sigma_s_per_mm of layer 0: got NaN");
    bad(&[Layer::isotropic(0.0, 1.0)], 1.4, "sigma_a_per_mm of layer 0: got 0");
    bad(&[Layer::isotropic(1.0, 0.0)], 1.4, "sigma_s_per_mm of all layers: got 0");
    for g in [1.0, -1.0, nan] {
        bad(&[Layer { g, ..layer }], 1.4, "g of layer 0");
        bad(&[layer.with_g(g)], 1.4, "g of layer 0");
        names(Skin { g, ..Skin::DARK }.spectrum().unwrap_err(), "skin: g");
    }
    let melanin = Skin { melanin: 1.5, ..Skin::LIGHT };
    assert_eq!(melanin.spectrum().unwrap_err().to_string(), "skin: melanin: got 1.5, needs 0 to 1");
    for a in [0.0, -1.0, 1.0, nan] {
        names(artist::random_walk(a, 1.0, 0.0).unwrap_err(), "artist: albedo");
    }
    assert!(Burley::Diffuse.response(0.5, 0.0).is_err());
    let transport = Transport { order: 3, ..Transport::default() };
    assert!(transport.response(&one(0.1, 1.0, 1.4)).is_err());
    assert!(Transport::default().transform(&one(0.1, 1.0, 1.4), nan).is_err());
    let skin = skin1(0.0).map(|m| respond(&m));
    names(Fit::new(&skin, 9).unwrap_err(), "fit: gaussians");
    names(Fit::within(&skin, nan).unwrap_err(), "fit: max_error");
    let [red, green, _] = skin;
    let error = Fit::new(&[red, green, Response::default()], 4).unwrap_err();
    names(error, "fit: albedo of the response to blue light");
}

#[test]
fn extremes_have_their_limits() {
    // A layer of no thickness, and one so thin, are none.
    let thin = Layer::isotropic(5.0, 3.0);
    let below = Layer::isotropic(0.17, 0.88);
    let none = respond(&one(0.17, 0.88, 1.4));
    for mm in [0.0, 1e-9] {
        let got = respond(&Medium::new(&[thin.thick(mm), below], 1.4).unwrap());
        assert!((got.albedo() - none.albedo()).abs() < 1e-4 && apart(&got, &none) < 5e-4);
    }
    // One without an end hides what is below.
    for mm in [1e3, 1e9] {
        let got = respond(&Medium::new(&[below.thick(mm), thin], 1.4).unwrap());
        assert!((got.albedo() - none.albedo()).abs() < 1e-4 && apart(&got, &none) < 5e-4);
    }
    // A layer that does neither is a gap; what only absorbs at the bottom sends nothing back.
    let gap = Layer::isotropic(0.0, 0.0).thick(0.1);
    let floor = Layer::isotropic(2.0, 0.0);
    let medium = Medium::new(&[gap, below.thick(1.0), floor], 1.4).unwrap();
    let [value, error] = walk(&medium, Incidence::Normal, 200_000).albedo();
    assert!((respond(&medium).albedo() - value).abs() < 3.0 * error + 0.0003);
    // The unit of length is nobody's business.
    for unit in [1e-9, 1e9] {
        let got = respond(&one(0.17 * unit, 0.88 * unit, 1.4));
        assert!((got.albedo() - none.albedo()).abs() < 1e-9);
        for x in X_MM {
            assert!((got.edge(x / unit) - none.edge(x)).abs() < 1e-6, "{unit}");
        }
        let fit = Fit::new(&[got.clone(), got.clone(), got], 5).unwrap();
        assert!(fit.worst() < 0.0035, "{unit}: {fit:?}");
    }
    // Both at once, and next to no absorption: all light comes back, from far away.
    for (a, s) in [(1e9, 1e-9), (1e-9, 1e-9), (1e9, 1e9)] {
        let got = respond(&one(a, s, 1.4));
        assert!(got.albedo() > 0.0 && got.albedo() < 1.0 && got.edge(1e12) > 0.99, "{a} {s}");
    }
    let milk = respond(&one(2e-6, 1.0, 1.4));
    assert!(milk.albedo() > 0.98 && milk.albedo() < 1.0, "{}", milk.albedo());
}

/// What this thread has spent on a core; where the system does not say, what time it is.
fn busy(start: Instant) -> Duration {
    let spent = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let spent = spent.and_then(|text| text.split(' ').next()?.parse().ok());
    spent.map_or_else(|| start.elapsed(), Duration::from_nanos)
}

#[test]
fn profiles_take_no_time() {
    let start = Instant::now();
    // The least of a few tries, since other tests run beside this one.
    let least = |work: &dyn Fn()| {
        let time = || {
            let before = busy(start);
            work();
            busy(start) - before
        };
        (0..3).map(|_| time()).min().unwrap()
    };
    let transport = Transport::default();
    let fit = |responses| {
        Fit::within(&responses, 1.0 / 255.0).unwrap();
    };
    let rgb = least(&|| fit(transport.responses(&skin1(0.0)).unwrap()));
    let layers = donner_jensen_2005(0.0).unwrap();
    let layers = least(&|| fit(transport.responses(&layers).unwrap()));
    let spectral = least(&|| fit(Skin::LIGHT.responses(&transport).unwrap()));
    let forward = least(&|| fit(transport.responses(&skin1(0.8)).unwrap()));
    let both = donner_jensen_2005(0.8).unwrap();
    let both = least(&|| fit(transport.responses(&both).unwrap()));
    println!("RGB {rgb:?}, three layers {layers:?}, spectral {spectral:?}");
    println!("g = .8: {forward:?}, three layers {both:?}");
    if cfg!(not(debug_assertions)) {
        assert!(rgb.max(layers) < Duration::from_millis(200), "{rgb:?} {layers:?}");
        assert!(spectral < Duration::from_secs(3), "{spectral:?}");
    }
}
