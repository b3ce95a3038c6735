//! What profiles make of three skins: each held to a random walk, as the error of a step edge.

use std::fmt::Write as _;
use std::time::Duration;

use image::RgbImage;
use indicatif::{ProgressBar, ProgressStyle};
use subsurface::physics::artist::{self, Burley};
use subsurface::physics::{Diffusion, Fit, Incidence, Response, Skin, Transport};
use subsurface::{DEFAULT_MAX_ERROR, Profile};

use super::picture::COLORS;
use crate::Error;
use crate::chart::plot::label::Area;
use crate::chart::plot::panel::{DIM, LEGEND, Panel, SMALL, TITLE};
use crate::chart::plot::scale::Scale;
use crate::svg::{Rasteriser, Stroke, Svg, Type};
use crate::truth::random_walk;

/// Who is compared, and how a line of theirs looks.
const RIVALS: [(&str, &str, &str); 5] = [
    ("d'Eon & Luebke, as published", "#999999", "5 3"),
    ("d'Eon & Luebke, scaled", "#555555", ""),
    ("dipole of its albedo, scaled", "#e69f00", ""),
    ("Burley of its albedo, scaled", "#6a3d9a", ""),
    ("ours, the fit", "#0072b2", ""),
];
/// Ends of the plots.
const ERRORS: f64 = 0.16;
const X_MM: [f64; 2] = [0.02, 20.0];

/// The table and the figure.
///
/// # Errors
/// A drawing that cannot be made.
pub fn compare(paths: u64) -> Result<(String, RgbImage), Error> {
    let bar = ProgressBar::new(3 * 2 * 16 * 64).with_style(
        ProgressStyle::with_template("{bar:24} {msg} {eta}").expect("the template is a constant"),
    );
    bar.enable_steady_tick(Duration::from_millis(200));
    let places: Vec<f64> =
        (0..=90).map(|i| X_MM[0] * (X_MM[1] / X_MM[0]).powf(f64::from(i) / 90.0)).collect();
    let mut table = String::new();
    let mut say = |line: String| writeln!(table, "{line}").expect("a String takes all text");
    say(format!("{:32}{:>9}{:>9}{:>9}", "worst error of a step edge", "red", "green", "blue"));
    let mut svg = Svg::default();
    legend(&mut svg);
    let skins = [("light", Skin::LIGHT), ("medium", Skin::MEDIUM), ("dark", Skin::DARK)];
    for (row, (name, skin)) in skins.into_iter().enumerate() {
        bar.set_message(format!("walking through {name} skin"));
        // In halves, which differ by as much as tells the noise.
        let spectrum = skin.spectrum()?;
        let walk = |seed: u64| {
            let walks = spectrum.iter().zip(seed..).map(|((_, medium), seed)| {
                random_walk(medium, Incidence::Normal, paths.div_ceil(2), seed, &|_| bar.inc(1)).response()
            });
            Skin::colours(&walks.collect::<Vec<_>>())
        };
        let halves = [walk(1), walk(101)];
        let truth = [0, 1, 2].map(|c| Response::sum(halves.iter().map(|half| (0.5, &half[c]))));
        let fit = Fit::within(&skin.responses(&Transport::default())?, DEFAULT_MAX_ERROR.into())?;
        say(format!("{name} skin, {} Gaussians", fit.profile.gaussians().len()));
        let mut worst = [[0.0; 3]; RIVALS.len()];
        for c in 0..3 {
            let errors = panel(&mut svg, &places, (row, name), c, &truth[c], &fit.profile)?;
            for (worst, errors) in worst.iter_mut().zip(errors) {
                worst[c] = errors;
            }
        }
        for ((name, ..), [r, g, b]) in RIVALS.iter().zip(worst) {
            say(format!("  {name:30}{r:9.4}{g:9.4}{b:9.4}"));
        }
        let apart = |c: usize, x: &f64| 0.5 * (halves[0][c].edge(*x) - halves[1][c].edge(*x));
        let [r, g, b] = [0, 1, 2].map(|c| largest(&places.iter().map(|x| apart(c, x)).collect::<Vec<_>>()));
        say(format!("  {:30}{r:9.4}{g:9.4}{b:9.4}", "half of what two walks differ by"));
    }
    bar.finish_and_clear();
    let caption =
        format!("cargo run --release --example profile -- --three-skins, {paths} paths a wavelength");
    svg.text([20.0, 830.0], &caption, SMALL);
    let drawing = svg.finish(980.0, 842.0, "Three skins");
    let refused =
        |e: Box<dyn std::error::Error>| Error::new("three-skins.png", format!("\"{e}\""), "a drawing");
    Ok((table, Rasteriser::new().picture(&drawing).map_err(refused)?))
}

fn legend(svg: &mut Svg) {
    svg.text([20.0, 34.0], "Three skins, by the profiles of others and by ours", TITLE);
    let meaning = "Error of a step edge against a random walk through both layers, as a share of the light. \
                   Band: ±1/255.";
    svg.text([20.0, 55.0], meaning, Type::new(DIM, 13.0));
    for (i, (name, color, dashes)) in RIVALS.into_iter().enumerate() {
        let at = [26.0 + 300.0 * (i % 3) as f64, 78.0 + 20.0 * (i / 3) as f64];
        svg.line(
            &[[at[0], at[1] - 4.0], [at[0] + 26.0, at[1] - 4.0]],
            Stroke::new(color, 2.0).dashed(dashes),
        );
        svg.text([at[0] + 34.0, at[1]], name, LEGEND);
    }
}

/// Draws the errors of all on a colour of a skin; returns the worst of each.
fn panel(
    svg: &mut Svg,
    places: &[f64],
    (row, name): (usize, &str),
    c: usize,
    truth: &Response,
    fit: &Profile,
) -> Result<[f64; RIVALS.len()], Error> {
    let exact: Vec<f64> = places.iter().map(|x| truth.edge(*x)).collect();
    let curves = [
        (spread(&Profile::SKIN, c), false),
        (spread(&Profile::SKIN, c), true),
        (dipole(truth.albedo())?, true),
        (Burley::Searchlight.response(truth.albedo(), 1.0)?, true),
        (spread(fit, c), false),
    ];
    let left = 72.0 + 300.0 * c as f64;
    let top = 132.0 + 224.0 * row as f64;
    let area = Area { left, top, right: left + 268.0, bottom: top + 180.0 };
    let (x, y) = (Scale::over(X_MM.into_iter()), Scale::linear(-ERRORS, ERRORS));
    let panel = Panel::new(area, x, y);
    panel.grid(svg, &x.ticks(), c == 0);
    svg.text([left, top - 7.0], &format!("{name} skin, {}", COLORS[c].0), LEGEND);
    if c == 0 {
        panel.name_y(svg, "error of E(x)");
    }
    if row == 2 {
        panel.name_x(svg, "x, mm from the edge");
    }
    for limit in [-1.0, 1.0] {
        let level = limit * f64::from(DEFAULT_MAX_ERROR);
        panel.line(svg, &[(X_MM[0], level), (X_MM[1], level)], Stroke::new("#333", 0.7));
    }
    let mut worst = [0.0; RIVALS.len()];
    for (i, (response, is_scaled)) in curves.iter().enumerate() {
        let errors = |scale: f64| -> Vec<f64> {
            places.iter().zip(&exact).map(|(x, e)| response.edge(x / scale) - e).collect()
        };
        let errors = errors(if *is_scaled { best_scale(&errors) } else { 1.0 });
        worst[i] = largest(&errors);
        let (_, color, dashes) = RIVALS[i];
        let points: Vec<(f64, f64)> = places.iter().copied().zip(errors).collect();
        panel.line(svg, &points, Stroke::new(color, 1.6).dashed(dashes));
    }
    Ok(worst)
}

/// A profile's colour.
fn spread(profile: &Profile, c: usize) -> Response {
    Response::gaussians(profile.gaussians().iter().map(|g| (g.variance_mm2.into(), g.weight[c].into())))
}

/// Jensen et al.'s, of one layer behind skin's index that sends so much light back.
fn dipole(albedo: f64) -> Result<Response, Error> {
    Ok(Diffusion::Dipole.response(&artist::blender_skin(albedo, 1.0, 1.4, 0.0)?)?)
}

fn largest(errors: &[f64]) -> f64 {
    errors.iter().fold(0.0, |worst, e| worst.max(e.abs()))
}

/// The width of the least worst error: the best of many, then by golden sections around it.
fn best_scale(errors: &dyn Fn(f64) -> Vec<f64>) -> f64 {
    let worst = |log: f64| largest(&errors(log.exp()));
    let logs = (-24..=24).map(|i| 0.25 * f64::from(i));
    let start = logs.min_by(|a, b| worst(*a).total_cmp(&worst(*b))).unwrap_or(0.0);
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let (mut low, mut high) = (start - 0.25, start + 0.25);
    for _ in 0..20 {
        let [a, b] = [high - golden * (high - low), low + golden * (high - low)];
        if worst(a) < worst(b) { high = b } else { low = a }
    }
    (0.5 * (low + high)).exp()
}
