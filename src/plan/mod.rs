//! The plan: how much of which blur makes a profile, at every scale, to a stated error.

mod kernels;
mod nnls;
mod response;

use std::fmt;

use glam::{DVec3, Vec3, Vec4};

use crate::{Error, Profile};
pub(crate) use kernels::{KERNELS, Kernels, Kinds, Shape, own_blur};
use response::Responses;

/// How a profile is scattered at a stated error: the weights of the blurs at every scale.
///
/// It is made once for a set of profiles, not for each frame: fitting a profile takes a second, or
/// several where `max_error` is small. Every blur is a
/// Gaussian of a fixed width *in pixels*, those of a level twice as wide as those of the level
/// before; what changes with the scale is how much of each is taken. The weights are fitted so that
/// the largest error on straight edges is the least: edges soft by σ = 1 px against the closed form,
/// hard ones along an axis of the pixels against the visible integral. Hard ones at other angles, layers
/// and detail of a pixel on steep slopes may be off by more (docs/method.md).
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    max_error: f32,
    pub(crate) kernels: Kernels,
    /// Levels above the frame.
    pub(crate) levels: usize,
    first_octave: f64,
    /// A profile's rows, at scales a sixth of an octave apart.
    profiles: Vec<Vec<Row>>,
}

/// What is done at one scale.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Pixels per mm along the direction in which a surface is foreshortened most.
    pub px_per_mm: f32,
    /// Light that stays, then each blur of the frame, then each of level 1 and so on.
    pub weights: Vec<Vec3>,
    /// The largest error on straight edges, up to the next row; in units of `white`.
    pub predicted_error: f32,
}

/// Rows to an octave of scale; between two of them weights are interpolated.
pub(crate) const ROWS_PER_OCTAVE: f64 = 6.0;

/// Levels that a plan may use: at the last, a pixel is 128 of the frame's.
const MAX_LEVELS: usize = 7;

impl Plan {
    /// The cheapest plan whose error on flat edges is at most `max_error`, in units of the radiance
    /// that the host shows as white; ids count `profiles` from 1.
    ///
    /// # Errors
    /// No profile, or more than [`MAX_PROFILES`](crate::MAX_PROFILES); a `max_error` that is not a
    /// number above 0, or less than the best plan has.
    pub fn new(profiles: &[Profile], max_error: f32) -> Result<Self, Error> {
        crate::input::check_profiles(profiles)?;
        if !max_error.is_finite() || max_error <= 0.0 {
            return Err(Error::new(
                "max_error",
                max_error.to_string(),
                "a finite number above 0",
            ));
        }
        let mut least = f32::INFINITY;
        for kernels in KERNELS {
            let plan = Self::of(profiles, max_error, kernels);
            if plan.predicted_error() <= max_error {
                return Ok(plan);
            }
            least = least.min(plan.predicted_error());
        }
        Err(Error::new(
            "max_error",
            max_error.to_string(),
            format!("at least {least}; or the exact effect"),
        ))
    }

    /// The plan of these kernels, whatever its error.
    fn of(profiles: &[Profile], max_error: f32, kernels: Kernels) -> Self {
        let responses = Responses::new(&kernels, MAX_LEVELS);
        let widest = |p: &Profile| {
            let variances = p.gaussians().iter().map(|g| f64::from(g.variance_mm2));
            variances.fold(0.0, f64::max).sqrt()
        };
        let widest = profiles.iter().map(widest).fold(0.0, f64::max);
        // From where the widest Gaussian is far below a pixel, to where the last level is as wide.
        let (first, last) = if widest > 0.0 {
            let last = f64::from(1 << MAX_LEVELS) / widest;
            ((LEAST_PX / widest).log2(), last.log2())
        } else {
            (0.0, 0.0)
        };
        let rows = ((last - first) * ROWS_PER_OCTAVE).ceil() as usize + 2;
        let fit = |profile: &Profile| {
            let scale = |row: f64| f64::exp2(first + row / ROWS_PER_OCTAVE);
            let mut fitted: Vec<Row> = (0..rows)
                .map(|i| fit_row(&responses, &kernels, profile, scale(i as f64), max_error))
                .collect();
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
        Self {
            max_error,
            kernels,
            levels: MAX_LEVELS,
            first_octave: first,
            profiles: profiles.iter().map(fit).collect(),
        }
    }

    /// log₂ of the pixels per mm of the first row.
    pub(crate) fn first_octave(&self) -> f32 {
        self.first_octave as f32
    }

    pub(crate) fn profile_count(&self) -> usize {
        self.profiles.len()
    }

    pub(crate) fn row_count(&self) -> usize {
        self.profiles[0].len()
    }

    /// Where blur `j` of level `l` is in a row of weights; the light that stays is at 0.
    pub(crate) fn slot(&self, level: usize, j: usize) -> usize {
        let Kernels { fine, coarse } = &self.kernels;
        match level {
            0 => 1 + j,
            l => 1 + fine.len() + (l - 1) * coarse.len() + j,
        }
    }

    /// Where the sum of the weights of all levels beyond `level` is.
    pub(crate) fn rest_slot(&self, level: usize) -> usize {
        self.slot(self.levels + 1, 0) + level
    }

    /// Vectors to a row of [`table`](Self::table).
    pub(crate) fn stride(&self) -> usize {
        self.rest_slot(self.levels) + 1
    }

    /// The weights as the shaders have them: of each profile the rows, of each row the slots, and in
    /// the last component of its first one the highest level of all rows up to here.
    pub(crate) fn table(&self) -> Vec<Vec4> {
        let mut table = Vec::new();
        for rows in &self.profiles {
            let mut top = 0;
            for row in rows {
                let levels = 0..=self.levels;
                let beyond = |l: usize| row.weights[self.slot(l + 1, 0)..].iter().sum::<Vec3>();
                let rest: Vec<Vec3> = levels.map(beyond).collect();
                top = top.max(rest.iter().take_while(|r| **r != Vec3::ZERO).count());
                let weights = row.weights.iter().chain(&rest).map(|w| w.extend(0.0));
                let first = table.len();
                table.extend(weights);
                table[first].w = top as f32;
            }
        }
        table
    }

    /// The error that was asked for.
    pub fn max_error(&self) -> f32 {
        self.max_error
    }

    /// The largest error on flat edges, of any profile at any scale.
    pub fn predicted_error(&self) -> f32 {
        let rows = self.profiles.iter().flatten();
        rows.map(|r| r.predicted_error).fold(0.0, f32::max)
    }

    /// The rows of a profile, counted from 0, from the smallest scale to the largest; none of one
    /// that the plan was not made for.
    pub fn rows(&self, profile: usize) -> &[Row] {
        self.profiles.get(profile).map_or(&[], |rows| rows)
    }
}

/// σ of the widest Gaussian, in pixels, below which a profile does nothing worth a row.
const LEAST_PX: f64 = 0.0625;

/// The weights at one scale, without the squares that the error does not ask for.
fn fit_row(
    responses: &Responses,
    kernels: &Kernels,
    profile: &Profile,
    px_per_mm: f64,
    max_error: f32,
) -> Row {
    let wanted = responses.wanted(profile, px_per_mm);
    let [fine, coarse] = [kernels.fine, kernels.coarse].map(|k| k.square_px2.is_some());
    // From the cheapest on: a level has a quarter of the pixels of the one before.
    let mut choices = vec![[false, false]];
    choices.extend(coarse.then_some([false, true]));
    choices.extend(fine.then_some([true, false]));
    choices.extend((fine && coarse).then_some([true, true]));
    let mut best: Option<Row> = None;
    for squares in choices {
        let row = fit_columns(responses, kernels, &wanted, squares, px_per_mm, max_error);
        // Between two rows the error is a little larger than at either.
        let enough = row.predicted_error <= 0.95 * max_error;
        if best
            .as_ref()
            .is_none_or(|b| row.predicted_error < b.predicted_error)
        {
            best = Some(row);
        }
        if enough {
            break;
        }
    }
    best.expect("there is a choice without squares")
}

/// The weights with or without the square of the frame, and those of the levels.
fn fit_columns(
    responses: &Responses,
    kernels: &Kernels,
    wanted: &[Vec<f64>; 3],
    [fine, coarse]: [bool; 2],
    px_per_mm: f64,
    max_error: f32,
) -> Row {
    let count = responses.columns[0].len();
    let used: Vec<usize> = (0..count)
        .filter(|i| {
            let is_square = |kinds: &Kinds, j: usize| j == kinds.variances_px2.len();
            match i.checked_sub(1) {
                None => true,
                Some(j) if j < kernels.fine.len() => fine || !is_square(&kernels.fine, j),
                Some(j) => {
                    let j = (j - kernels.fine.len()) % kernels.coarse.len();
                    coarse || !is_square(&kernels.coarse, j)
                }
            }
        })
        .collect();
    let columns: Vec<Vec<f64>> = responses
        .columns
        .iter()
        .map(|row| used.iter().map(|i| row[*i]).collect())
        .collect();
    let mut weights = vec![Vec3::ZERO; count];
    for (channel, wanted) in wanted.iter().enumerate() {
        let fit = nnls::minimax(&columns, wanted).0;
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
    Row {
        px_per_mm: px_per_mm as f32,
        predicted_error: worst(responses, &weights, wanted),
        weights,
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

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(
            f,
            "error {} asked for, {:.5} predicted",
            self.max_error,
            self.predicted_error()
        )?;
        for (what, kinds) in [
            ("the frame", self.kernels.fine),
            ("each level", self.kernels.coarse),
        ] {
            write!(f, "{what}:")?;
            for blur in kinds.blurs() {
                let taps = blur.shape.count();
                write!(f, "  {} px² by {taps} taps", blur.variance_px2)?;
            }
            writeln!(f)?;
        }
        for (rows, id) in self.profiles.iter().zip(1..) {
            writeln!(f, "profile {id}:  px/mm   error    weights")?;
            for row in rows {
                write!(f, "  {:14.4}  {:.5} ", row.px_per_mm, row.predicted_error)?;
                for w in &row.weights {
                    let [r, g, b] = w.to_array().map(|c| (100.0 * c).round());
                    write!(f, " {r:.0}/{g:.0}/{b:.0}")?;
                }
                writeln!(f)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plans_keep_what_they_state() {
        for max_error in [1.0 / 100.0, 1.0 / 255.0] {
            let since = std::time::Instant::now();
            let plan = Plan::new(&[Profile::SKIN], max_error).unwrap();
            println!("{plan}{:?}", since.elapsed());
            assert!(plan.predicted_error() <= max_error);
        }
    }

    #[test]
    fn profiles_of_any_width_have_a_plan() {
        let of = |variance_mm2| crate::Gaussian {
            variance_mm2,
            weight: Vec3::ONE,
        };
        for gaussians in [
            vec![of(0.0)],
            vec![of(1e-12)],
            vec![of(1e6)],
            vec![of(1e-12), of(1.0), of(1e6)],
        ] {
            let profile = Profile::new(&gaussians).unwrap();
            let plan = Plan::new(&[profile], 0.1).unwrap();
            for row in plan.rows(0) {
                // Light that is moved between blurs is neither made nor lost.
                let sum: Vec3 = row.weights.iter().sum();
                assert!((sum - 1.0).abs().max_element() < 1e-5, "{sum}");
            }
        }
    }
}
