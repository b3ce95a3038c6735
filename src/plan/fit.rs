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

/// Errors that a fit goes by, in units of white.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    /// The largest that is asked for, up to which scales beyond the fitted ones are taken.
    pub(super) max_error: f32,
    /// Blurs that this error does not ask for are left out. 0: none.
    pub(super) spare: f32,
    /// There is no fit where the error is above this, as soon as that is known.
    pub(super) hopeless: f32,
}

/// The weights of these blurs whose error is the least, but for blurs that are left out.
/// [`Weights::predicted_error`] may be above `max_error`.
pub(super) fn fit(profiles: &[Profile], kernels: Kernels, limits: Limits) -> Option<Weights> {
    let Limits { max_error, spare, hopeless } = limits;
    let responses = Responses::new(&kernels, FITTED_LEVELS);
    let (first_octave, rows) = scales(profiles);
    let mut fitted: Vec<Vec<Mixture>> = Vec::new();
    for (i, profile) in profiles.iter().enumerate() {
        // Several heads may well have the same skin.
        let mixtures = match profiles[..i].iter().position(|p| p == profile) {
            Some(same) => fitted[same].clone(),
            None => {
                let fit = Fit {
                    responses: &responses,
                    kernels: &kernels,
                    profile,
                    first_octave,
                    spare: spare.into(),
                };
                fit.rows(rows, hopeless.into())?
            }
        };
        fitted.push(mixtures);
    }
    extend(&mut fitted, &kernels, max_error);
    let weights = Weights::new(kernels, first_octave, fitted);
    (weights.predicted_error() <= hopeless).then_some(weights)
}

/// log₂ of the px/mm of the first row, and how many rows there are: from where the widest Gaussian of all is
/// far below a pixel, to where the last level is as wide as that of any profile.
fn scales(profiles: &[Profile]) -> (f64, usize) {
    let widths = || profiles.iter().map(widest_mm).filter(|w| *w > 0.0);
    let (Some(widest), Some(narrowest)) = (widths().reduce(f64::max), widths().reduce(f64::min)) else {
        return (0.0, 2);
    };
    let first = (LEAST_PX / widest).log2();
    let last = (f64::from(1 << FITTED_LEVELS) / narrowest).log2();
    (first, ((last - first) * ROWS_PER_OCTAVE).ceil() as usize + 2)
}

/// σ of the widest Gaussian.
fn widest_mm(profile: &Profile) -> f64 {
    let variances = profile.gaussians().iter().map(|g| f64::from(g.variance_mm2));
    variances.fold(0.0, f64::max).sqrt()
}

/// Something of red, green and blue.
type Channels<T> = [T; 3];

const CHANNELS: Channels<usize> = [0, 1, 2];

fn largest(errors: Channels<f64>) -> f64 {
    errors.into_iter().fold(0.0, f64::max)
}

/// One profile by one set of blurs.
struct Fit<'a> {
    responses: &'a Responses,
    kernels: &'a Kernels,
    profile: &'a Profile,
    first_octave: f64,
    /// See [`Limits`].
    spare: f64,
}

impl Fit<'_> {
    /// None if no weights keep an error of `hopeless`.
    fn rows(&self, count: usize, hopeless: f64) -> Option<Vec<Mixture>> {
        // Each row by itself …
        let mut fits = Vec::new();
        let mut goals = Goals { columns: &self.responses.columns, at: Vec::new(), between: Vec::new() };
        let mut weights: Vec<Channels<Vec<f64>>> = Vec::new();
        let mut errors = Vec::new();
        for i in 0..count {
            goals.at.push(self.wanted(i as f64));
            let fit = self.alone(i, &CHANNELS.map(|c| [goals.at(i, c)]));
            weights.push(CHANNELS.map(|c| fit[c].weights()));
            errors.push(goals.errors_at(i, &weights[i]));
            if largest(errors[i]) > hopeless {
                return None;
            }
            fits.push(fit);
        }
        // … then so that none is further off on the way to its neighbours than there or here.
        let between = |i| BETWEEN.map(|part| self.wanted(i as f64 + part));
        goals.between = (0..count - 1).map(between).collect();
        for (i, fit) in fits.iter_mut().enumerate() {
            let targets = CHANNELS.map(|c| {
                let mut targets = vec![goals.at(i, c)];
                let mut add = |other: usize, between: Vec<Target>| {
                    let allowance = f64::max(0.0, errors[other][c] - errors[i][c]);
                    targets.extend(between.into_iter().map(|t| Target { allowance, ..t }));
                };
                if i > 0 {
                    add(i - 1, goals.since_last(i, c, &weights[i - 1][c]));
                }
                if i + 1 < count {
                    add(i + 1, goals.until_next(i, c, &weights[i + 1][c]));
                }
                targets
            });
            for c in CHANNELS {
                fit[c].solve(goals.columns, &targets[c], f64::INFINITY);
            }
            self.leave_out_specks(fit, &targets);
            weights[i] = CHANNELS.map(|c| rounded(fit[c].weights()));
        }
        Some((0..count).map(|i| goals.mixture(i, &weights)).collect())
    }

    fn px_per_mm(&self, row: f64) -> f64 {
        px_per_mm(self.first_octave, row)
    }

    fn wanted(&self, row: f64) -> Channels<Vec<f64>> {
        self.responses.wanted(self.profile, self.px_per_mm(row))
    }

    /// The fit of one row, without the square of the frame where the error does not ask for it.
    fn alone(&self, row: usize, targets: &Channels<[Target; 1]>) -> Channels<Minimax> {
        let columns = &self.responses.columns;
        let widest_px = WIDER * widest_mm(self.profile) * self.px_per_mm(row as f64);
        // Level 1 stays for profiles of hardly any width.
        let widest_px2 = widest_px.powi(2).max(4.0);
        let variances_px2 = self.kernels.variances_px2(FITTED_LEVELS);
        let square = self.kernels.fine.square_px2.map(|_| self.kernels.fine.len());
        let fit = |without: Option<usize>, limit: f64| {
            let used = |j: usize| variances_px2[j] <= widest_px2 && Some(j) != without;
            let mut fit = CHANNELS.map(|_| Minimax::new(columns.len(), used));
            let kept = CHANNELS.into_iter().all(|c| fit[c].solve(columns, &targets[c], limit));
            (fit, kept)
        };
        if square.is_some() {
            // Between two rows the error is a little larger than at either.
            let (fit, kept) = fit(square, 0.9 * self.spare);
            if kept {
                return fit;
            }
        }
        fit(None, f64::INFINITY).0
    }

    /// Leaves out the blurs that are worth less than [`SPECK`] to every channel, from the widest on: one that
    /// some channel needs costs the others nothing.
    fn leave_out_specks(&self, fit: &mut Channels<Minimax>, targets: &Channels<Vec<Target>>) {
        let columns = &self.responses.columns;
        let limits = CHANNELS.map(|c| {
            let error = largest_residual(columns, &fit[c].weights(), &targets[c]);
            (error + SPECK * self.spare).min(self.spare.max(error))
        });
        for j in (1..columns.len()).rev() {
            let mut without = fit.clone();
            let kept = CHANNELS.into_iter().all(|c| {
                let had = without[c].weights()[j] > 0.0;
                without[c].leave_out(j);
                !had || without[c].solve(columns, &targets[c], limits[c])
            });
            if kept {
                *fit = without;
            }
        }
    }
}

/// What a profile makes of the edges: at each row, and at scales between it and the next.
struct Goals<'a> {
    /// Of the light that stays, then of each blur: what it makes of them.
    columns: &'a [Vec<f64>],
    at: Vec<Channels<Vec<f64>>>,
    between: Vec<[Channels<Vec<f64>>; BETWEEN.len()]>,
}

impl Goals<'_> {
    fn at(&self, row: usize, c: usize) -> Target {
        Target::new(self.at[row][c].clone())
    }

    /// For the weights of a row, if those of the next are `next`.
    fn until_next(&self, row: usize, c: usize, next: &[f64]) -> Vec<Target> {
        self.on_the_way(row, c, next, |part| 1.0 - part)
    }

    /// For the weights of a row, if those of the one before are `last`.
    fn since_last(&self, row: usize, c: usize, last: &[f64]) -> Vec<Target> {
        self.on_the_way(row - 1, c, last, |part| part)
    }

    /// From row `first` to the next, for the one that has `share` of the weights there, given the other's.
    fn on_the_way(&self, first: usize, c: usize, other: &[f64], share: fn(f64) -> f64) -> Vec<Target> {
        let other = mix(self.columns, other);
        let target = |(part, wanted): (f64, &Channels<Vec<f64>>)| {
            let share = share(part);
            let rest = wanted[c].iter().zip(&other).map(|(w, o)| w - (1.0 - share) * o);
            Target { share, ..Target::new(rest.collect()) }
        };
        BETWEEN.into_iter().zip(&self.between[first]).map(target).collect()
    }

    fn errors_at(&self, row: usize, weights: &Channels<Vec<f64>>) -> Channels<f64> {
        CHANNELS.map(|c| largest_residual(self.columns, &weights[c], &[self.at(row, c)]))
    }

    /// A row, with its errors.
    fn mixture(&self, row: usize, weights: &[Channels<Vec<f64>>]) -> Mixture {
        let here = &weights[row];
        let until_next = weights.get(row + 1).map_or(0.0, |next| {
            let errors = CHANNELS.map(|c| {
                let targets = self.until_next(row, c, &next[c]);
                largest_residual(self.columns, &here[c], &targets)
            });
            largest(errors).max(largest(self.errors_at(row + 1, next)))
        });
        let mut stays = vec![0.0; self.columns.len()];
        stays[0] = 1.0;
        let stays = CHANNELS.map(|_| stays.clone());
        let [r, g, b] = here;
        Mixture {
            weights: (0..r.len()).map(|j| [r[j], g[j], b[j]].map(|w| w as f32)).collect(),
            predicted_error: largest(self.errors_at(row, here)).max(until_next) as f32,
            unscattered_error: largest(self.errors_at(row, &stays)) as f32,
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

    /// Of a fit that is made whatever its error.
    fn limits(max_error: f32) -> Limits {
        Limits { max_error, spare: max_error, hopeless: f32::INFINITY }
    }

    fn profiles() -> Vec<Profile> {
        let of = |terms: &[(f32, [f32; 3])]| {
            let gaussian = |(variance_mm2, weight): &(f32, [f32; 3])| Gaussian {
                variance_mm2: *variance_mm2,
                weight: *weight,
            };
            Profile::new(&terms.iter().map(gaussian).collect::<Vec<_>>()).unwrap()
        };
        let skin = |width: f32| Profile::SKIN.scaled(width).unwrap();
        let eight = (0..8).map(|i| {
            let x = i as f32;
            let green = 0.2 + 0.1 * (1.7 * x).sin().abs();
            (0.003 * 4f32.powf(0.9 * x), [1.0 / (1.0 + x), green, (-0.8 * x).exp()])
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
                let fit = fit(&[profile], kernels, limits(1.0 / 255.0)).unwrap();
                println!("{:.6} predicted, {:?}", fit.predicted_error(), since.elapsed());
                let fitted = scales(&[profile]).1;
                for (i, pair) in fit.profiles[0][..fitted].windows(2).enumerate() {
                    for part in [0.0, 0.25, 0.5, 0.75] {
                        let px_per_mm = px_per_mm(scales(&[profile]).0, i as f64 + part);
                        let wanted = responses.wanted(&profile, px_per_mm);
                        for (c, wanted) in wanted.into_iter().enumerate() {
                            let between = |(a, b): (&[f32; 3], &[f32; 3])| {
                                (1.0 - part) * f64::from(a[c]) + part * f64::from(b[c])
                            };
                            let weights: Vec<f64> =
                                pair[0].weights.iter().zip(&pair[1].weights).map(between).collect();
                            let (fitted, beyond) = weights.split_at(responses.columns.len());
                            assert!(beyond.iter().all(|w| *w == 0.0));
                            let error =
                                largest_residual(&responses.columns, fitted, &[Target::new(wanted)]);
                            // Weights are read as f32.
                            let predicted = f64::from(pair[0].predicted_error);
                            assert!(error < predicted + 1e-6, "row {i} + {part}: {error}, {predicted}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn equal_profiles_have_equal_weights() {
        let other = profiles()[3];
        let fit = fit(&[Profile::SKIN, other, Profile::SKIN], KERNELS[0], limits(0.01)).unwrap();
        assert_eq!(fit.profiles[0], fit.profiles[2]);
        assert_ne!(fit.profiles[0], fit.profiles[1]);
    }

    #[test]
    fn rounded_weights_are_one_in_all() {
        let thirds = rounded(vec![1.0 / 3.0; 3]);
        assert_eq!(thirds.iter().map(|w| (w * STEPS).round()).sum::<f64>(), STEPS);
    }
}
