//! The cases, a file a group.

mod files;
mod hosts;
mod numbers;
mod screen;
mod surface;
mod texture;
mod time;

use glam::{DVec3, Vec3};

use crate::stability::case::{Case, Outcome, Run, Shown};

/// A step of eight bits, which an eye sees where it comes and goes.
const STEP: f64 = 1.0 / 255.0;
/// What an eye may find in a gradient.
const FOUND: f64 = 0.01;
/// What is seen at a glance.
const SEEN: f64 = 0.03;

/// What the skin profile reaches in mm: 3.5 σ of its widest Gaussian. Closer to the frame's border kernels
/// are cut, and the closed forms do not hold.
const REACH_MM: f64 = 9.6;

/// All of them; `quick` makes frames smaller and sequences shorter.
pub fn all(quick: bool) -> Vec<Case> {
    [
        // First, while the process has had little memory, since some of them look at its peak.
        files::cases(quick),
        screen::cases(quick),
        texture::cases(quick),
        time::cases(quick),
        numbers::cases(quick),
        hosts::cases(quick),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// A result of every method: of all pixels of a frame, row by row.
pub type Results = Vec<(&'static str, Vec<Vec3>)>;

/// Each method's largest difference to the truth in any channel, over the pixels that it is known of;
/// not a number where a difference is none.
pub fn worst(results: &Results, truth: &[(usize, DVec3)]) -> Vec<(&'static str, f64)> {
    assert!(!truth.is_empty(), "a case asks for some pixels");
    let of = |pixels: &[Vec3]| {
        let differences = truth
            .iter()
            .map(|(i, t)| (pixels[*i].as_dvec3() - t).abs())
            .flat_map(|d| d.to_array());
        largest(differences)
    };
    results.iter().map(|(name, r)| (*name, of(r))).collect()
}

/// As `max`, which would lose what is not a number.
pub fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b <= a { a } else { b }
}

/// The largest number; not a number where one of them is none.
pub fn largest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    numbers.into_iter().fold(f64::NEG_INFINITY, larger)
}

/// Each method's largest difference between two results of its own.
pub fn apart(a: &Results, b: &Results, pixels: &[usize]) -> Vec<(&'static str, f64)> {
    let pairs = a.iter().zip(b);
    let figures = pairs.flat_map(|(a, (_, b))| {
        let other: Vec<_> = pixels.iter().map(|i| (*i, b[*i].as_dvec3())).collect();
        worst(&vec![a.clone()], &other)
    });
    figures.collect()
}

/// Without a picture: for what would show the same as others do.
pub fn unpictured(case: Case) -> Case {
    let run = case.run;
    let run: Run = Box::new(move |lab| {
        Ok(Outcome {
            shown: None,
            ..run(lab)?
        })
    });
    Case { run, ..case }
}

/// A rectangle of a frame: first column and row, columns and rows.
#[derive(Clone, Copy)]
pub struct Crop {
    pub first: [u32; 2],
    pub size: [u32; 2],
}

impl Crop {
    /// Its pixels in a frame that is `width` wide, row by row.
    pub fn pixels(self, width: u32) -> Vec<usize> {
        let [x, y] = self.first;
        let rows = y..y + self.size[1];
        let row = |y| (x..x + self.size[0]).map(move |x| (y * width + x) as usize);
        rows.flat_map(row).collect()
    }

    /// What a picture shows of it; light that no truth is known of is black there.
    pub fn show(self, width: u32, results: &Results, truth: &[(usize, DVec3)]) -> Shown {
        let pixels = self.pixels(width);
        let known = |i: &usize| {
            let place = truth.binary_search_by_key(i, |(j, _)| *j).ok();
            place.map(|p| truth[p].1.as_vec3())
        };
        let known: Vec<Option<Vec3>> = pixels.iter().map(known).collect();
        let cut = |values: &[Vec3]| {
            let pairs = pixels.iter().zip(&known);
            let cut = pairs.map(|(i, t)| t.map_or(Vec3::ZERO, |_| values[*i]));
            cut.collect()
        };
        Shown {
            size: self.size,
            truth: known.iter().map(|t| t.unwrap_or_default()).collect(),
            results: results.iter().map(|(m, r)| (*m, cut(r))).collect(),
        }
    }
}
