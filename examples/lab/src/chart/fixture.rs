//! Made-up figures of the size that real ones have, for tests and trial pictures.

use image::{Rgb, RgbImage};

use crate::chart::plot::Series;
use crate::chart::report::SceneImages;
use crate::chart::row::Row;

/// A method at a setting: its name, its setting, its time in copies at one pixel a millimetre, the
/// power of the pixels a millimetre that the time grows with, and its error against no scattering's.
const METHODS: [(&str, &str, f64, f64, f64); 21] = [
    ("copy", "", 1.0, 0.0, 1.0),
    ("none", "", 0.0, 0.0, 1.0),
    ("screen_exact", "", 95.0, 0.55, 3e-4),
    ("screen_planned", "1/100", 14.0, 0.2, 0.05),
    ("screen_planned", "1/255", 21.0, 0.22, 0.019),
    ("screen_planned", "1/1000", 34.0, 0.25, 0.005),
    ("texture_separable", "512", 60.0, 0.0, 0.5),
    ("texture_separable", "1024", 230.0, 0.0, 0.3),
    ("texture_separable", "2048", 900.0, 0.0, 0.2),
    ("texture_cascade", "", 45.0, 0.0, 0.42),
    ("texture_2d", "", 4200.0, 0.0, 0.18),
    ("jimenez_2009", "", 9.5, 0.0, 0.33),
    ("jimenez_separable", "11", 3.9, 0.01, 0.27),
    ("jimenez_separable", "17", 5.6, 0.01, 0.25),
    ("jimenez_separable", "25", 7.9, 0.02, 0.24),
    ("fitted_separable", "11", 3.9, 0.01, 0.17),
    ("fitted_separable", "17", 5.7, 0.01, 0.15),
    ("fitted_separable", "25", 8.0, 0.02, 0.145),
    ("burley_disk", "20", 4.6, 0.05, 0.3),
    ("burley_disk", "40", 8.8, 0.06, 0.21),
    ("burley_disk", "80", 17.0, 0.07, 0.15),
];

const SCENES: [(&str, f64); 14] = [
    ("front", 3.6),
    ("three-quarter", 3.6),
    ("close-up", 11.5),
    ("far", 0.9),
    ("profile", 3.6),
    ("sphere", 5.0),
    ("edge_0.5", 0.425),
    ("edge_1", 0.85),
    ("edge_2", 1.7),
    ("edge_4", 3.4),
    ("edge_8", 6.8),
    ("edge_16", 13.6),
    ("edge_32", 27.2),
    ("edge_64", 54.4),
];

pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for (scene, px_per_mm) in SCENES {
        for (i, (method, setting, cost, power, error)) in METHODS.into_iter().enumerate() {
            // The same in every run, another in every row.
            let jitter = 1.0 + 0.12 * ((rows.len() * 37 % 23) as f64 / 11.0 - 1.0);
            let x_copy = cost * f64::powf(px_per_mm, power) * jitter;
            let width_px = 1.176 * px_per_mm;
            let unscattered = 0.03 * width_px / (1.0 + 0.1 * width_px);
            let rel_rmse = if i < 2 { unscattered } else { unscattered * error * jitter };
            let in_texture = method.starts_with("texture");
            let on_screen = |value: f64| (!in_texture).then_some(value);
            let on_head = |value: f64| (!scene.starts_with("edge")).then_some(value);
            rows.push(Row {
                scene: scene.into(),
                method: method.into(),
                setting: setting.into(),
                width: 1920,
                height: 1080,
                skin_pixels: 612_345,
                px_per_mm,
                ms: 0.037 * x_copy,
                x_copy,
                fetches: (method == "burley_disk").then(|| setting.parse().unwrap()),
                rel_rmse_visible: on_screen(rel_rmse),
                max_error_visible: on_screen(4.0 * rel_rmse),
                rel_rmse_eq7: on_head(1.1 * rel_rmse + 0.02),
                max_error_eq7: on_head(6.0 * rel_rmse + 0.1),
                rel_rmse_eq7_normalised: on_head(if in_texture { rel_rmse } else { rel_rmse + 0.008 }),
                delta_e2000_p99: on_screen(60.0 * rel_rmse),
                flip_mean: on_screen(0.8 * rel_rmse),
                energy_ratio: on_screen(1.0 - 0.02 * rel_rmse),
                scratch_bytes_per_pixel: (i > 1).then_some([16.0, 80.0, 23.28][i % 3]),
            });
        }
    }
    rows
}

pub fn heads() -> Vec<Series> {
    let series = |name: &str, fixed: f64, each: f64, extrapolated_from| Series {
        name: name.into(),
        points: [1.0, 2.0, 4.0, 8.0, 16.0].map(|count| (count, 1000.0 / (fixed + each * count))).into(),
        extrapolated_from,
    };
    vec![
        series("screen_exact", 6.0, 0.02, None),
        series("screen_planned 1/255", 1.2, 0.02, None),
        series("burley_disk 40", 0.5, 0.01, None),
        series("jimenez_separable 17", 0.3, 0.01, None),
        series("fitted_separable 17", 0.3, 0.011, None),
        series("texture_separable 2048", 0.5, 33.0, Some(3)),
        series("texture_cascade", 0.5, 1.7, None),
        series("texture_2d", 0.0, 155.0, Some(1)),
    ]
}

pub fn images() -> Vec<SceneImages> {
    let picture = |shade: u32| {
        RgbImage::from_fn(96, 72, |x, y| Rgb([(x * 2) as u8, (y * 3) as u8, (shade * 40) as u8]))
    };
    ["front", "profile"]
        .map(|scene| SceneImages {
            scene: scene.into(),
            truth: picture(0),
            entries: (1..5).map(|i| (format!("method {i}"), picture(i), picture(5 + i))).collect(),
        })
        .into()
}
