use subsurface::physics::*;
use std::time::Instant;

#[test]
fn table() {
    let x = [0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0];
    let three = |c: usize| {
        let epi = ([0.21, 0.21, 0.50], [4.8, 6.0, 6.5]);
        let up = ([0.016, 0.019, 0.030], [3.2, 4.0, 4.6]);
        let bl = ([0.0085, 0.1, 2.5], [0.45, 0.47, 0.48]);
        vec![
            Layer::isotropic(epi.0[c], epi.1[c]).thick(0.25),
            Layer::isotropic(up.0[c], up.1[c]).thick(1.0),
            Layer::isotropic(bl.0[c], bl.1[c]),
        ]
    };
    let h = |a, s| vec![Layer::isotropic(a, s)];
    type T = (&'static str, Vec<Layer>, f64, bool, f64, [f64; 8]);
    let cases: Vec<T> = vec![
        ("skin1 R", h(0.032, 0.74), 1.4, false, 0.40029, [0.5182,0.5368,0.5606,0.5965,0.6687,0.7453,0.8384,0.9520]),
        ("skin1 G", h(0.17, 0.88), 1.4, false, 0.18630, [0.5393,0.5760,0.6198,0.6801,0.7829,0.8695,0.9462,0.9953]),
        ("skin1 B", h(0.48, 1.01), 1.4, false, 0.09889, [0.5713,0.6313,0.6965,0.7758,0.8843,0.9510,0.9891,0.9998]),
        ("marble R", h(0.0021, 2.19), 1.4, false, 0.85663, [0.5218,0.5428,0.5691,0.6086,0.6894,0.7746,0.8674,0.9584]),
        ("marble B", h(0.0071, 3.0), 1.4, false, 0.78677, [0.5298,0.5574,0.5914,0.6415,0.7400,0.8343,0.9214,0.9852]),
        ("a.3", h(0.7, 0.3), 1.4, false, 0.02513, [0.5836,0.6535,0.7284,0.8160,0.9222,0.9719,0.9937,0.9998]),
        ("skin1 G eta1", h(0.17, 0.88), 1.0, false, 0.32526, [0.5373,0.5739,0.6195,0.6846,0.7986,0.8905,0.9613,0.9974]),
        ("skin1 G cos", h(0.17, 0.88), 1.4, true, 0.18123, [0.5352,0.5690,0.6105,0.6695,0.7744,0.8651,0.9450,0.9952]),
        ("3 R", three(0), 1.4, false, 0.50793, [0.5569,0.6027,0.6532,0.7196,0.8262,0.8998,0.9465,0.9751]),
        ("3 G", three(1), 1.4, false, 0.48855, [0.5702,0.6254,0.6860,0.7646,0.8824,0.9532,0.9886,0.9987]),
        ("3 B", three(2), 1.4, false, 0.36711, [0.5915,0.6586,0.7283,0.8125,0.9230,0.9768,0.9972,1.0000]),
        ("l460", vec![Layer::isotropic(1.70846, 8.73903).thick(0.06), Layer::isotropic(0.42160, 4.36951)], 1.4, false, 0.22999, [0.6389,0.7159,0.7873,0.8662,0.9562,0.9913,0.9996,1.0]),
        ("l620", vec![Layer::isotropic(0.55925, 5.07124).thick(0.06), Layer::isotropic(0.05015, 2.53562)], 1.4, false, 0.45020, [0.5553,0.5943,0.6374,0.6977,0.8047,0.8946,0.9641,0.9977]),
    ];
    for (name, layers, eta, cos, r, e) in cases {
        let m = Medium::new(&layers, eta).unwrap();
        let t = Transport { incidence: if cos { Incidence::Cosine } else { Incidence::Normal }, ..Default::default() };
        let start = Instant::now();
        let got = t.response(&m).unwrap();
        let ms = start.elapsed().as_secs_f64() * 1e3;
        print!("{name:14} {ms:6.1} ms R {:+.5} E", got.albedo() - r);
        for (x, e) in x.iter().zip(e) {
            print!(" {:+.4}", got.edge(*x) - e);
        }
        println!();
    }
    let m = Medium::homogeneous(Layer::isotropic(0.17, 0.88), 1.4).unwrap();
    for (s, r) in [(0.0, 0.186302), (0.5, 0.156836), (1.0, 0.118816), (2.0, 0.079843), (5.0, 0.043345), (10.0, 0.025086)] {
        println!("{s} {:+.6}", Transport::default().transform(&m, s).unwrap() - r);
    }
}

#[test]
fn aniso() {
    let three = |c: usize| {
        let epi = ([0.21, 0.21, 0.50], [4.8, 6.0, 6.5]);
        let up = ([0.016, 0.019, 0.030], [3.2, 4.0, 4.6]);
        let bl = ([0.0085, 0.1, 2.5], [0.45, 0.47, 0.48]);
        vec![
            Layer::isotropic(epi.0[c], epi.1[c]).thick(0.25).with_g(0.8),
            Layer::isotropic(up.0[c], up.1[c]).thick(1.0).with_g(0.8),
            Layer::isotropic(bl.0[c], bl.1[c]).with_g(0.8),
        ]
    };
    let h = |a, s| vec![Layer::isotropic(a, s).with_g(0.8)];
    for (l, r) in [
        (h(0.032, 0.74), 0.39361),
        (h(0.17, 0.88), 0.16909),
        (h(0.48, 1.01), 0.07846),
        (three(0), 0.50344),
        (three(1), 0.48408),
        (three(2), 0.35708),
    ] {
        let m = Medium::new(&l, 1.4).unwrap();
        for order in 0..3 {
            let t = Transport { order, ..Default::default() };
            let start = Instant::now();
            let got = t.response(&m).unwrap();
            let ms = start.elapsed().as_secs_f64() * 1e3;
            println!("L{order} {ms:6.1} ms R {:+.5} ({:+.2} %) R(.3) {} R(1) {}", got.albedo() - r, 100. * (got.albedo() / r - 1.), got.radial(0.2826), got.radial(0.94));
        }
    }
}

#[test]
fn fits() {
    let skin1 = [(0.032, 0.74), (0.17, 0.88), (0.48, 1.01)];
    let skin2 = [(0.013, 1.09), (0.070, 1.59), (0.145, 1.79)];
    let marble = [(0.0021, 2.19), (0.0041, 2.62), (0.0071, 3.0)];
    for (name, rgb) in [("skin1", skin1), ("skin2", skin2), ("marble", marble)] {
        let media = rgb.map(|(a, s)| Medium::homogeneous(Layer::isotropic(a, s), 1.4).unwrap());
        for which in 0..4 {
            let responses = media.each_ref().map(|m| match which {
                0 => Transport::default().response(m).unwrap(),
                1 => Diffusion::PhotonBeam.response(m).unwrap(),
                2 => Diffusion::BetterDipole.response(m).unwrap(),
                _ => Diffusion::Dipole.response(m).unwrap(),
            });
            print!("{name} {which} {:.5?}", responses.each_ref().map(|r| r.albedo()));
            for k in [3, 4, 5, 6, 8] {
                let start = Instant::now();
                let fit = Fit::new(&responses, k).unwrap();
                let ms = start.elapsed().as_secs_f64() * 1e3;
                print!(" k={k} {:.4} ({ms:.0} ms)", fit.worst());
                if k == 8 { print!("floor {:.5?}", fit.floor); }
            }
            println!();
        }
    }
    let g = Layer::isotropic(0.17, 0.88);
    for r in [0.1, 0.3, 1.0, 3.0] {
        println!("PBD {:.6} SS {:.6} better {:.6}", Diffusion::PhotonBeam.radial(&g, 1.4, r), single_scattering(&g, 1.4, r), Diffusion::BetterDipole.radial(&g, 1.4, r));
    }
    for (a, s) in skin1 {
        let l = Layer::isotropic(a, s);
        for r in [0.1, 0.3, 1.0, 3.0] { print!("{:.7} ", Diffusion::Dipole.radial(&l, 1.3, r)); }
        let m = Medium::homogeneous(l, 1.3).unwrap();
        println!("dipole {:.5}", Diffusion::Dipole.response(&m).unwrap().albedo());
        let m = Medium::homogeneous(l, 1.4).unwrap();
        let p = Diffusion::PhotonBeam.response(&m).unwrap();
        println!("PBD total {:.5} E {:?}", p.albedo(), [0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0].map(|x| (p.edge(x) * 1e4).round() / 1e4));
    }
}
