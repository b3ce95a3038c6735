//! How much of which blur makes a profile, at every scale.

use glam::{DVec3, Vec3, Vec4};

use super::Row;
use super::edge_response::Responses;
use super::kernels::Kernels;
use super::minimax::minimax;
use crate::Profile;

/// Rows to an octave of scale; between two of them weights are interpolated.
pub(crate) const ROWS_PER_OCTAVE: f64 = 6.0;

/// How many rows a tile looks beyond that of its scale, rounded up; as in pack.wgsl.
const ROWS_BEYOND: f32 = 2.0;

/// Levels that weights are fitted for: at the last, a pixel is 256 of the frame's.
const FITTED_LEVELS: usize = 8;
/// Levels that weights may be for.
pub(crate) const MAX_LEVELS: usize = 10;

/// The weights of the blurs of a pyramid.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Weights {
    pub kernels: Kernels,
    /// Levels above the frame.
    pub levels: usize,
    first_octave: f64,
    /// A profile's rows, at scales a sixth of an octave apart.
    pub profiles: Vec<Vec<Row>>,
}

impl Weights {
    /// Those of these kernels whose error is the least. Where that is more than `max_error` at some scale, the
    /// largest error.
    pub fn new(profiles: &[Profile], max_error: f32, kernels: Kernels) -> Result<Self, f32> {
        let responses = Responses::new(&kernels, FITTED_LEVELS);
        let widths = || profiles.iter().map(widest_mm).filter(|w| *w > 0.0);
        let (widest, narrowest) = (
            widths().fold(0.0, f64::max),
            widths().fold(f64::MAX, f64::min),
        );
        // From where the widest Gaussian of all is far below a pixel, to where the last level is as wide
        // as that of any profile.
        let (first, last) = if widest > 0.0 {
            let last = f64::from(1 << FITTED_LEVELS) / narrowest;
            ((LEAST_PX / widest).log2(), last.log2())
        } else {
            (0.0, 0.0)
        };
        let rows = ((last - first) * ROWS_PER_OCTAVE).ceil() as usize + 2;
        let fit = |profile: &Profile| {
            let scale = |row: f64| f64::exp2(first + row / ROWS_PER_OCTAVE);
            let mut fitted = Vec::new();
            for i in 0..rows {
                fitted.push(fit_row(
                    &responses,
                    &kernels,
                    profile,
                    scale(i as f64),
                    max_error,
                ));
            }
            for i in 0..rows - 1 {
                let mean: Vec<Vec3> = fitted[i]
                    .weights
                    .iter()
                    .zip(&fitted[i + 1].weights)
                    .map(|(a, b)| (*a + *b) / 2.0)
                    .collect();
                let wanted = responses.wanted(profile, scale(i as f64 + 0.5));
                let between = worst(&responses, &mean, &wanted);
                let here = &mut fitted[i].predicted_error;
                *here = here.max(between);
            }
            for i in 0..rows - 1 {
                let next = fitted[i + 1].predicted_error;
                fitted[i].predicted_error = fitted[i].predicted_error.max(next);
            }
            fitted
        };
        let mut fitted: Vec<Vec<Row>> = Vec::new();
        for (i, profile) in profiles.iter().enumerate() {
            // Several heads may well have the same skin.
            let rows = match profiles[..i].iter().position(|p| p == profile) {
                Some(same) => fitted[same].clone(),
                None => fit(profile),
            };
            fitted.push(rows);
        }
        let mut weights = Self {
            kernels,
            levels: MAX_LEVELS,
            first_octave: first,
            profiles: fitted,
        };
        weights.extend(max_error);
        weights.find_levels();
        let error = weights.predicted_error();
        if error <= max_error {
            Ok(weights)
        } else {
            Err(error)
        }
    }

    /// Goes on beyond the scales that were fitted, to where the last level is used up: a profile of twice the
    /// pixels takes of each level what it took of the one before. What it took of the frame's blurs goes to
    /// the first level's narrowest; edges differ by half of that at most. Stops where some profile would
    /// then be off by more than `max_error`.
    fn extend(&mut self, max_error: f32) {
        let (first, per_level) = (self.slot(1, 0), self.kernels.coarse.len());
        for row in self.profiles.iter_mut().flatten() {
            row.weights
                .resize(first + MAX_LEVELS * per_level, Vec3::ZERO);
        }
        let octave = ROWS_PER_OCTAVE as usize;
        if self.row_count() < octave {
            return;
        }
        let doubled = |rows: &Vec<Row>| {
            let mut row = rows[rows.len() - octave].clone();
            let of_frame: Vec3 = row.weights[1..first].iter().sum();
            row.weights[1..first].fill(Vec3::ZERO);
            row.weights[first..].rotate_right(per_level);
            row.weights[first] += of_frame;
            row.predicted_error += 0.5 * of_frame.max_element();
            row.px_per_mm *= 2.0;
            row
        };
        for _ in 0..(MAX_LEVELS - FITTED_LEVELS) * octave {
            let next: Vec<Row> = self.profiles.iter().map(doubled).collect();
            if next.iter().any(|row| row.predicted_error > max_error) {
                return;
            }
            for (rows, row) in self.profiles.iter_mut().zip(next) {
                rows.push(row);
            }
        }
    }

    fn find_levels(&mut self) {
        let slots: Vec<usize> = (1..=self.levels + 1).map(|l| self.slot(l, 0)).collect();
        for rows in &mut self.profiles {
            let mut level = 0;
            for row in rows {
                let beyond = |slot: &usize| row.weights[*slot..].iter().any(|w| *w != Vec3::ZERO);
                level = level.max(slots.iter().take_while(|slot| beyond(slot)).count());
                row.level = level;
            }
        }
    }

    /// log₂ of the pixels per mm of the first row.
    pub fn first_octave(&self) -> f32 {
        self.first_octave as f32
    }

    pub fn row_count(&self) -> usize {
        self.profiles[0].len()
    }

    /// Where blur `j` of level `l` is in a row of weights; the light that stays is at 0.
    pub fn slot(&self, level: usize, j: usize) -> usize {
        let Kernels { fine, coarse } = &self.kernels;
        match level {
            0 => 1 + j,
            l => 1 + fine.len() + (l - 1) * coarse.len() + j,
        }
    }

    /// Where the sum of the weights of all levels beyond `level` is.
    pub fn rest_slot(&self, level: usize) -> usize {
        self.slot(self.levels + 1, 0) + level
    }

    /// Vectors to a row of [`table`](Self::table).
    pub fn stride(&self) -> usize {
        self.rest_slot(self.levels) + 1
    }

    /// The weights as the shaders have them: of each profile the rows, of each row the slots, and in
    /// the last component of its first one its level.
    pub fn table(&self) -> Vec<Vec4> {
        let mut table = Vec::new();
        for rows in &self.profiles {
            for row in rows {
                let levels = 0..=self.levels;
                let beyond = |l: usize| row.weights[self.slot(l + 1, 0)..].iter().sum::<Vec3>();
                let rest: Vec<Vec3> = levels.map(beyond).collect();
                let weights = row.weights.iter().chain(&rest).map(|w| w.extend(0.0));
                let first = table.len();
                table.extend(weights);
                table[first].w = row.level as f32;
            }
        }
        table
    }

    /// Texel fetches for a pixel of a simple tile at a scale, all levels' shares and the copy included.
    pub fn fetches(&self, rows: &[Row], px_per_mm: f32) -> f32 {
        let octave = f64::from(px_per_mm).log2() - self.first_octave;
        let i = (octave * ROWS_PER_OCTAVE).clamp(0.0, (rows.len() - 2) as f64) as usize;
        let used = |slot: usize| rows[i..i + 2].iter().any(|r| r.weights[slot] != Vec3::ZERO);
        let blurs = |l: usize| {
            let kinds = if l == 0 {
                &self.kernels.fine
            } else {
                &self.kernels.coarse
            };
            let taps = kinds
                .blurs()
                .enumerate()
                .filter(|(j, _)| used(self.slot(l, *j)));
            taps.map(|(_, b)| b.shape.count()).max().unwrap_or(0)
        };
        let top = (1..=self.levels).rev().find(|l| blurs(*l) > 0).unwrap_or(0);
        // Marking: depth and id. Packing: them again, four neighbours, the light. The copy.
        let mut sum = 2.0 + 7.0 + 1.0;
        for l in 0..=top {
            // The taps, the one in the middle at least; the coarser mean.
            let blurred = blurs(l).max(1) + usize::from(l < top);
            // Four filtered fetches of light, two of where the surface is.
            let halved = if l > 0 { 6 } else { 0 };
            sum += (blurred + halved) as f32 * f32::powi(0.25, l as i32);
        }
        sum
    }

    /// The row that pack.wgsl asks for the level of a tile.
    pub fn tile_row(&self, px_per_mm: f32) -> usize {
        let rows = (px_per_mm.log2() - self.first_octave()) * ROWS_PER_OCTAVE as f32;
        let row = rows.ceil() + ROWS_BEYOND;
        row.clamp(0.0, (self.row_count() - 1) as f32) as usize
    }

    /// The largest error on straight edges, of any profile at any scale.
    pub fn predicted_error(&self) -> f32 {
        let rows = self.profiles.iter().flatten();
        rows.map(|r| r.predicted_error).fold(0.0, f32::max)
    }
}

/// σ of the widest Gaussian, in pixels, below which a profile does nothing worth a row.
const LEAST_PX: f64 = 0.0625;

/// How many times wider than a profile's widest Gaussian a blur may be. Wider ones would make edges a
/// little better by carrying a little light very far, across whatever lies between.
const WIDER: f64 = 2.0;

/// σ of the widest Gaussian.
fn widest_mm(profile: &Profile) -> f64 {
    let variances = profile
        .gaussians()
        .iter()
        .map(|g| f64::from(g.variance_mm2));
    variances.fold(0.0, f64::max).sqrt()
}

/// The weights at one scale, without the square of the frame where the error does not ask for it.
fn fit_row(
    responses: &Responses,
    kernels: &Kernels,
    profile: &Profile,
    px_per_mm: f64,
    max_error: f32,
) -> Row {
    let wanted = responses.wanted(profile, px_per_mm);
    // Level 1 stays for profiles of hardly any width.
    let widest_px2 = WIDER * WIDER * (widest_mm(profile) * px_per_mm).powi(2);
    let is_near = |variance_px2: f64| variance_px2 <= widest_px2.max(4.0);
    let all: Vec<usize> = kernels
        .variances_px2(FITTED_LEVELS)
        .into_iter()
        .enumerate()
        .filter(|(_, v)| is_near(*v))
        .map(|(i, _)| i)
        .collect();
    if kernels.fine.square_px2.is_some() {
        let square = kernels.fine.len();
        let without: Vec<usize> = all.iter().copied().filter(|i| *i != square).collect();
        let row = fit_columns(responses, &without, &wanted, px_per_mm, max_error);
        // Between two rows the error is a little larger than at either.
        if row.predicted_error <= 0.9 * max_error {
            return row;
        }
    }
    fit_columns(responses, &all, &wanted, px_per_mm, max_error)
}

/// The weights of some of the columns; the others have none.
fn fit_columns(
    responses: &Responses,
    used: &[usize],
    wanted: &[Vec<f64>; 3],
    px_per_mm: f64,
    max_error: f32,
) -> Row {
    let columns: Vec<Vec<f64>> = responses
        .columns
        .iter()
        .map(|row| used.iter().map(|i| row[*i]).collect())
        .collect();
    let mut weights = vec![Vec3::ZERO; responses.columns[0].len()];
    for (channel, wanted) in wanted.iter().enumerate() {
        let fit = minimax(&columns, wanted).0;
        for (i, weight) in used.iter().zip(fit) {
            weights[*i][channel] = weight as f32;
        }
    }
    // What changes nothing is not worth its taps: its light goes to the next narrower blur.
    for pair in used.windows(2).rev() {
        let too_small = weights[pair[1]].cmplt(Vec3::splat(0.05 * max_error));
        let moved = Vec3::select(too_small, weights[pair[1]], Vec3::ZERO);
        weights[pair[1]] -= moved;
        weights[pair[0]] += moved;
    }
    let mut unscattered = vec![Vec3::ZERO; weights.len()];
    unscattered[0] = Vec3::ONE;
    Row {
        px_per_mm: px_per_mm as f32,
        predicted_error: worst(responses, &weights, wanted),
        unscattered_error: worst(responses, &unscattered, wanted),
        weights,
        level: 0, // known once all rows are
    }
}

fn worst(responses: &Responses, weights: &[Vec3], wanted: &[Vec<f64>; 3]) -> f32 {
    let mut worst = 0.0;
    for (i, columns) in responses.columns.iter().enumerate() {
        let found: DVec3 = columns
            .iter()
            .zip(weights)
            .map(|(c, w)| w.as_dvec3() * *c)
            .sum();
        let wanted = DVec3::new(wanted[0][i], wanted[1][i], wanted[2][i]);
        worst = (found - wanted).abs().max_element().max(worst);
    }
    worst as f32
}
