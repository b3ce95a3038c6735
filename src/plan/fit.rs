//! The fit: how much of which blur makes a profile, at every scale.

use super::edge_response::Responses;
use super::kernels::Kernels;
use super::minimax::{Minimax, Target, largest_residual, mix};
use super::weights::{MAX_LEVELS, Mixture, ROWS_PER_OCTAVE, Weights, px_per_mm};
use crate::Profile;

/// Levels that weights are fitted for: at the last, a pixel is 256 of the frame's.
const FITTED_LEVELS: usize = 8;

/// σ of the widest Gaussian, in pixels, below which a profile does nothing worth a row.
const LEAST_PX: f64 = 0.0625;

/// How many times wider than a profile's widest Gaussian a blur may be. Wider ones would make edges a
/// little better by carrying a little light very far, across whatever lies between.
const WIDER: f64 = 2.0;

/// How much of the accepted error a blur has to be worth. One that is worth less is left out: nobody sees it,
/// and a tile need not draw a level that has no weight.
const SPECK: f64 = 0.02;

/// Where between two rows errors are looked at; weights are interpolated there.
const BETWEEN: [f64; 3] = [0.25, 0.5, 0.75];

/// Weights are multiples of 1/`STEPS`, so that they are written and read without loss.
pub(super) const STEPS: f64 = 1e5;

/// The weights of these blurs whose error is the least, without blurs that `max_error` does not ask for.
/// Where no weights keep it, [`Weights::predicted_error`] is above it.
pub(super) fn fit(profiles: &[Profile], max_error: f32, kernels: Kernels) -> Weights {
    let responses = Responses::new(&kernels, FITTED_LEVELS);
    let (first_octave, rows) = scales(profiles);
    let mut fitted: Vec<Vec<Mixture>> = Vec::new();
    for (i, profile) in profiles.iter().enumerate() {
        // Several heads may well have the same skin.
        let rows = match profiles[..i].iter().position(|p| p == profile) {
            Some(same) => fitted[same].clone(),
            None => {
                let fit = Fit {
                    columns: &responses.columns,
                    variances_px2: kernels.variances_px2(FITTED_LEVELS),
                    square: kernels.fine.square_px2.map(|_| kernels.fine.len()),
                    max_error: max_error.into(),
                };
                let wanted = |row: f64| responses.wanted(profile, px_per_mm(first_octave, row));
                let widest_px = |row: f64| widest_mm(profile) * px_per_mm(first_octave, row);
                fit.rows(rows, wanted, widest_px)
            }
        };
        fitted.push(rows);
    }
    extend(&mut fitted, &kernels, max_error);
    Weights::new(kernels, first_octave, fitted)
}

/// log₂ of the px/mm of the first row, and how many rows there are: from where the widest Gaussian of all is
/// far below a pixel, to where the last level is as wide as that of any profile.
fn scales(profiles: &[Profile]) -> (f64, usize) {
    let widths = || profiles.iter().map(widest_mm).filter(|w| *w > 0.0);
    let (Some(widest), Some(narrowest)) = (widths().reduce(f64::max), widths().reduce(f64::min))
    else {
        return (0.0, 2);
    };
    let first = (LEAST_PX / widest).log2();
    let last = (f64::from(1 << FITTED_LEVELS) / narrowest).log2();
    (
        first,
        ((last - first) * ROWS_PER_OCTAVE).ceil() as usize + 2,
    )
}

/// σ of the widest Gaussian.
fn widest_mm(profile: &Profile) -> f64 {
    let variances = profile
        .gaussians()
        .iter()
        .map(|g| f64::from(g.variance_mm2));
    variances.fold(0.0, f64::max).sqrt()
}

/// Something of red, green and blue.
type Channels<T> = [T; 3];

const CHANNELS: Channels<usize> = [0, 1, 2];

/// What the weights of a profile are found with.
struct Fit<'a> {
    /// Of the light that stays, then of each blur: what it makes of each edge.
    columns: &'a [Vec<f64>],
    variances_px2: Vec<f64>,
    /// The column of the blur that takes the square of the frame.
    square: Option<usize>,
    max_error: f64,
}

impl Fit<'_> {
    /// The weights of `count` rows, from what is wanted at a row, or between two, and how wide the widest
    /// Gaussian is there.
    fn rows(
        &self,
        count: usize,
        wanted: impl Fn(f64) -> Channels<Vec<f64>>,
        widest_px: impl Fn(f64) -> f64,
    ) -> Vec<Mixture> {
        let at: Vec<_> = (0..count).map(|i| wanted(i as f64)).collect();
        let at = |i: usize, c: usize| Target::new(at[i][c].clone());
        let after: Vec<_> = (0..count)
            .map(|i| BETWEEN.map(|part| wanted(i as f64 + part)))
            .collect();
        // What is wanted at scales between row `first` and the next, of `share` of the weights of one of them
        // when the other has those.
        let between = |first: usize, c: usize, share: fn(f64) -> f64, other: &[f64]| {
            let theirs = mix(self.columns, other);
            let target = |(part, wanted): (&f64, &Channels<Vec<f64>>)| {
                let share = share(*part);
                let values = wanted[c]
                    .iter()
                    .zip(&theirs)
                    .map(|(w, t)| w - (1.0 - share) * t);
                Target {
                    share,
                    ..Target::new(values.collect())
                }
            };
            BETWEEN
                .iter()
                .zip(&after[first])
                .map(target)
                .collect::<Vec<_>>()
        };
        let to_next = |i: usize, c: usize, next: &[f64]| between(i, c, |part| 1.0 - part, next);
        let from_last = |i: usize, c: usize, last: &[f64]| between(i - 1, c, |part| part, last);

        // Each row by itself …
        let mut fits = Vec::new();
        for i in 0..count {
            fits.push(self.alone(&CHANNELS.map(|c| [at(i, c)]), widest_px(i as f64)));
        }
        let mut weights: Vec<_> = fits
            .iter()
            .map(|fits| CHANNELS.map(|c| fits[c].weights()))
            .collect();
        let error = |weights: &Channels<Vec<f64>>, i: usize| {
            CHANNELS.map(|c| largest_residual(self.columns, &weights[c], &[at(i, c)]))
        };
        let errors: Vec<_> = (0..count).map(|i| error(&weights[i], i)).collect();

        // … then so that none is further off between it and those before and after it than at either.
        for i in 0..count {
            let targets = CHANNELS.map(|c| {
                let mut targets = vec![at(i, c)];
                let mut add = |other: usize, between: Vec<Target>| {
                    let allowance = (errors[other][c] - errors[i][c]).max(0.0);
                    targets.extend(between.into_iter().map(|t| Target { allowance, ..t }));
                };
                if i > 0 {
                    add(i - 1, from_last(i, c, &weights[i - 1][c]));
                }
                if i + 1 < count {
                    add(i + 1, to_next(i, c, &weights[i + 1][c]));
                }
                targets
            });
            for c in CHANNELS {
                fits[i][c].solve(self.columns, &targets[c], f64::INFINITY);
            }
            self.leave_out_specks(&mut fits[i], &targets);
            weights[i] = CHANNELS.map(|c| rounded(fits[i][c].weights()));
        }

        let largest = |errors: Channels<f64>| errors.into_iter().fold(0.0, f64::max);
        let errors: Vec<f64> = (0..count).map(|i| largest(error(&weights[i], i))).collect();
        let mut unscattered = vec![0.0; self.columns.len()];
        unscattered[0] = 1.0;
        let unscattered = CHANNELS.map(|_| unscattered.clone());
        let mixture = |i: usize| {
            let until_next = weights.get(i + 1).map_or(0.0, |next| {
                let between = |c: usize| to_next(i, c, &next[c]);
                let between =
                    CHANNELS.map(|c| largest_residual(self.columns, &weights[i][c], &between(c)));
                largest(between).max(errors[i + 1])
            });
            let [r, g, b] = &weights[i];
            Mixture {
                weights: (0..r.len())
                    .map(|j| [r[j], g[j], b[j]].map(|w| w as f32))
                    .collect(),
                predicted_error: errors[i].max(until_next) as f32,
                unscattered_error: largest(error(&unscattered, i)) as f32,
            }
        };
        (0..count).map(mixture).collect()
    }

    /// The fit of one row, without the square of the frame where the error does not ask for it.
    fn alone(&self, targets: &Channels<[Target; 1]>, widest_px: f64) -> Channels<Minimax> {
        // Level 1 stays for profiles of hardly any width.
        let widest_px2 = (WIDER * widest_px).powi(2).max(4.0);
        let fits = |used: &dyn Fn(usize) -> bool, limit: f64| {
            let used = |j: usize| self.variances_px2[j] <= widest_px2 && used(j);
            let mut fits = CHANNELS.map(|_| Minimax::new(self.columns.len(), used));
            let kept = fits
                .iter_mut()
                .zip(targets)
                .all(|(fit, target)| fit.solve(self.columns, target, limit));
            (fits, kept)
        };
        if self.square.is_some() {
            // Between two rows the error is a little larger than at either.
            let (fits, kept) = fits(&|j| Some(j) != self.square, 0.9 * self.max_error);
            if kept {
                return fits;
            }
        }
        fits(&|_| true, f64::INFINITY).0
    }

    /// Leaves out the blurs that are worth less than [`SPECK`], from the widest on.
    fn leave_out_specks(&self, fits: &mut Channels<Minimax>, targets: &Channels<Vec<Target>>) {
        let limits = CHANNELS.map(|c| {
            let error = largest_residual(self.columns, &fits[c].weights(), &targets[c]);
            (error + SPECK * self.max_error).min(self.max_error.max(error))
        });
        for j in (1..self.columns.len()).rev() {
            let mut without = fits.clone();
            let kept = CHANNELS.into_iter().all(|c| {
                let had = without[c].weights()[j] > 0.0;
                without[c].leave_out(j);
                !had || without[c].solve(self.columns, &targets[c], limits[c])
            });
            if kept {
                *fits = without;
            }
        }
    }
}

/// The nearest multiples of 1/[`STEPS`] that are 1 in all.
fn rounded(mut weights: Vec<f64>) -> Vec<f64> {
    weights.iter_mut().for_each(|w| *w = (*w * STEPS).round());
    let missing = STEPS - weights.iter().sum::<f64>();
    if let Some(largest) = weights.iter_mut().max_by(|a, b| a.total_cmp(b)) {
        *largest += missing;
    }
    weights.iter_mut().for_each(|w| *w /= STEPS);
    weights
}

/// Goes on beyond the scales that were fitted, to where the last level is used up: a profile of twice the
/// pixels takes of each level what it took of the one before. What it took of the frame's blurs goes to
/// the first level's narrowest; edges differ by half of that at most. Stops where some profile would
/// then be off by more than `max_error`.
fn extend(profiles: &mut [Vec<Mixture>], kernels: &Kernels, max_error: f32) {
    let (first, per_level) = (1 + kernels.fine.len(), kernels.coarse.len());
    for row in profiles.iter_mut().flatten() {
        row.weights.resize(Weights::slots(kernels), [0.0; 3]);
    }
    let octave = ROWS_PER_OCTAVE as usize;
    if profiles[0].len() < octave {
        return;
    }
    let doubled = |rows: &Vec<Mixture>| {
        let mut row = rows[rows.len() - octave].clone();
        let of_frame = CHANNELS.map(|c| row.weights[1..first].iter().map(|w| w[c]).sum::<f32>());
        row.weights[1..first].fill([0.0; 3]);
        row.weights[first..].rotate_right(per_level);
        for (weight, moved) in row.weights[first].iter_mut().zip(of_frame) {
            *weight += moved;
        }
        row.predicted_error += 0.5 * of_frame.into_iter().fold(0.0, f32::max);
        row
    };
    for _ in 0..(MAX_LEVELS - FITTED_LEVELS) * octave {
        let next: Vec<Mixture> = profiles.iter().map(doubled).collect();
        if next.iter().any(|row| row.predicted_error > max_error) {
            return;
        }
        for (rows, row) in profiles.iter_mut().zip(next) {
            rows.push(row);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Gaussian;
    use crate::plan::KERNELS;

    fn profiles() -> Vec<Profile> {
        let of = |terms: &[(f32, [f32; 3])]| {
            let gaussian = |(variance_mm2, weight): &(f32, [f32; 3])| Gaussian {
                variance_mm2: *variance_mm2,
                weight: *weight,
            };
            Profile::new(&terms.iter().map(gaussian).collect::<Vec<_>>()).unwrap()
        };
        let skin = |width: f32| {
            let skin = Profile::SKIN;
            let terms = skin
                .gaussians()
                .iter()
                .map(|g| (g.variance_mm2 * width * width, g.weight));
            of(&terms.collect::<Vec<_>>())
        };
        let eight = (0..8).map(|i| {
            let x = i as f32;
            let green = 0.2 + 0.1 * (1.7 * x).sin().abs();
            (
                0.003 * 4f32.powf(0.9 * x),
                [1.0 / (1.0 + x), green, (-0.8 * x).exp()],
            )
        });
        vec![
            skin(1.0),
            skin(0.4),
            skin(2.5),
            of(&[(1.0, [1.0; 3])]),
            of(&[(0.01, [1.0; 3])]),
            of(&eight.collect::<Vec<_>>()),
        ]
    }

    #[test]
    fn errors_hold_between_rows_too() {
        for kernels in KERNELS {
            let responses = Responses::new(&kernels, FITTED_LEVELS);
            for profile in profiles() {
                let since = std::time::Instant::now();
                let fit = fit(&[profile], 1.0 / 255.0, kernels);
                println!(
                    "{:.6} predicted, {:?}",
                    fit.predicted_error(),
                    since.elapsed()
                );
                let fitted = scales(&[profile]).1;
                for (i, pair) in fit.profiles[0][..fitted].windows(2).enumerate() {
                    for part in [0.0, 0.25, 0.5, 0.75] {
                        let px_per_mm = px_per_mm(scales(&[profile]).0, i as f64 + part);
                        let wanted = responses.wanted(&profile, px_per_mm);
                        for (c, wanted) in wanted.into_iter().enumerate() {
                            let between = |(a, b): (&[f32; 3], &[f32; 3])| {
                                (1.0 - part) * f64::from(a[c]) + part * f64::from(b[c])
                            };
                            let weights: Vec<f64> = pair[0]
                                .weights
                                .iter()
                                .zip(&pair[1].weights)
                                .map(between)
                                .collect();
                            let (fitted, beyond) = weights.split_at(responses.columns.len());
                            assert!(beyond.iter().all(|w| *w == 0.0));
                            let error = largest_residual(
                                &responses.columns,
                                fitted,
                                &[Target::new(wanted)],
                            );
                            // Weights are read as f32.
                            let predicted = f64::from(pair[0].predicted_error);
                            assert!(
                                error < predicted + 1e-6,
                                "row {i} + {part}: {error}, {predicted}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn equal_profiles_have_equal_weights() {
        let other = profiles()[3];
        let fit = fit(&[Profile::SKIN, other, Profile::SKIN], 0.01, KERNELS[0]);
        assert_eq!(fit.profiles[0], fit.profiles[2]);
        assert_ne!(fit.profiles[0], fit.profiles[1]);
    }

    #[test]
    fn rounded_weights_are_one_in_all() {
        let thirds = rounded(vec![1.0 / 3.0; 3]);
        assert_eq!(
            thirds.iter().map(|w| (w * STEPS).round()).sum::<f64>(),
            STEPS
        );
    }
}
