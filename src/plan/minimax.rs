//! The mixture of columns that is nearest to its targets: a Chebyshev approximation whose weights are not
//! negative and sum to 1.
//!
//! A linear program: the least t over (x, t) with x ≥ 0, Σx = 1 and, at every sample of every target,
//! |share·Σⱼ xⱼ·columnⱼ − value| − allowance ≤ t. It is solved by exchange, which is the dual simplex method.
//!
//! References:
//! - E. Stiefel, *Note on Jordan elimination, linear programming and Tchebycheff approximation*,
//!   Numerische Mathematik 2, 1960.
//! - C. E. Lemke, *The dual method of solving the linear programming problem*, Naval Research Logistics
//!   Quarterly 1, 1954.

/// How far the largest residual may be above the least one.
const ACCURACY: f64 = 1e-7;

/// Exchanges for each unknown, which are never needed: one to five are.
const EXCHANGES: usize = 50;

/// Below, what should be 0 is rounding.
const ROUNDING: f64 = 1e-10;

/// What a share of the mixture should be at every sample.
pub(crate) struct Target {
    pub share: f64,
    pub values: Vec<f64>,
    /// How much larger than t its residuals may be.
    pub allowance: f64,
}

impl Target {
    /// That all of the mixture is to be these values.
    pub(crate) fn new(values: Vec<f64>) -> Self {
        Self { share: 1.0, values, allowance: 0.0 }
    }

    /// The largest |share·mixed − value| − allowance, and where.
    fn largest_residual(&self, mixed: &[f64]) -> (f64, usize) {
        let mut largest = (0.0, 0);
        for (i, (m, value)) in mixed.iter().zip(&self.values).enumerate() {
            let residual = (self.share * m - value).abs();
            if residual > largest.0 {
                largest = (residual, i);
            }
        }
        (largest.0 - self.allowance, largest.1)
    }
}

/// Σⱼ xⱼ·columnⱼ.
pub(crate) fn mix(columns: &[Vec<f64>], x: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; columns[0].len()];
    for (column, x) in columns.iter().zip(x).filter(|(_, x)| x.abs() > ROUNDING) {
        for (s, c) in sum.iter_mut().zip(column) {
            *s += x * c;
        }
    }
    sum
}

/// The largest residual of any target.
pub(super) fn largest_residual(columns: &[Vec<f64>], x: &[f64], targets: &[Target]) -> f64 {
    let mixed = mix(columns, x);
    let residuals = targets.iter().map(|t| t.largest_residual(&mixed).0);
    residuals.fold(0.0, f64::max)
}

/// As many constraints g·(x, t) ≥ c as unknowns, met with equality at a point where no smaller t meets them.
/// Other constraints may be violated there: [`solve`](Self::solve) takes them in, one for another.
///
/// Nothing is lost when targets or constraints are added to those of an earlier solution: to go on from there
/// takes a few exchanges.
#[derive(Clone)]
pub(crate) struct Minimax {
    /// The inverse of the matrix whose rows are the gradients, column by column: a column a constraint. The
    /// last row holds their multipliers, which are at least 0 where constraints are inequalities.
    inverse: Vec<Vec<f64>>,
    constants: Vec<f64>,
    /// Which x ≥ 0 a constraint is, if it is one.
    bounds: Vec<Option<usize>>,
    /// Constraints that stay: equations.
    stays: Vec<bool>,
    /// x, then t.
    point: Vec<f64>,
}

impl Minimax {
    /// x = (1, 0, …, 0), with the constraint t ≥ Σx − x₀ − 2, which any target replaces. Of the other
    /// unknowns only those in `used` may grow.
    pub(crate) fn new(n: usize, used: impl Fn(usize) -> bool) -> Self {
        let unit = |k: usize| {
            let mut column = vec![0.0; n + 1];
            column[k] = 1.0;
            column
        };
        let bound = |j: usize| {
            let mut column = unit(j);
            (column[0], column[n]) = (-1.0, 1.0);
            column
        };
        let sum = [unit(0)].into_iter();
        let mut constants = vec![0.0; n + 1];
        (constants[0], constants[n]) = (1.0, -2.0);
        let mut start = Self {
            inverse: sum.chain((1..n).map(bound)).chain([unit(n)]).collect(),
            constants,
            bounds: (0..=n).map(|k| (k > 0 && k < n).then_some(k)).collect(),
            stays: (0..=n).map(|k| k == 0 || k < n && !used(k)).collect(),
            point: Vec::new(),
        };
        start.find_point();
        start
    }

    /// Exchanges constraints until none is violated. False, and not at an end, if no x keeps all residuals
    /// within `limit`.
    pub(crate) fn solve(&mut self, columns: &[Vec<f64>], targets: &[Target], limit: f64) -> bool {
        let n = columns.len();
        for _ in 0..EXCHANGES * n {
            let (x, t) = (&self.point[..n], self.point[n]);
            if t > limit {
                return false;
            }
            let mixed = mix(columns, x);
            let residuals = targets.iter().map(|target| (target, target.largest_residual(&mixed)));
            let worst = residuals.max_by(|a, b| a.1.0.total_cmp(&b.1.0));
            let least = (0..n).min_by(|i, j| x[*i].total_cmp(&x[*j]));
            let (Some((target, (residual, i))), Some(least)) = (worst, least) else {
                return true;
            };
            let mut gradient = vec![0.0; n + 1];
            let mut constant = 0.0;
            let mut bound = None;
            if (residual - t).max(-x[least]) <= ACCURACY {
                return true;
            } else if residual - t > -x[least] {
                // t ∓ (share·Σⱼ xⱼ·columnⱼ − value) ≥ 0.
                let sign = (target.share * mixed[i] - target.values[i]).signum();
                for (g, column) in gradient.iter_mut().zip(columns) {
                    *g = -sign * target.share * column[i];
                }
                gradient[n] = 1.0;
                constant = -sign * target.values[i] - target.allowance;
            } else {
                gradient[least] = 1.0;
                bound = Some(least);
            }
            if self.exchange(&gradient, constant, bound).is_none() {
                return true;
            }
        }
        true
    }

    /// Leaves a column out from now on.
    pub(crate) fn leave_out(&mut self, j: usize) {
        let slot = self.bounds.iter().position(|bound| *bound == Some(j));
        let slot = slot.or_else(|| {
            let mut gradient = vec![0.0; self.point.len()];
            gradient[j] = -1.0;
            self.exchange(&gradient, 0.0, None)
        });
        if let Some(k) = slot {
            self.stays[k] = true;
        }
    }

    /// Takes a constraint in for the one whose multiplier is the first to get to 0, and says where. None if
    /// there is none, which rounding alone can bring about: some t meets all constraints.
    fn exchange(&mut self, gradient: &[f64], constant: f64, bound: Option<usize>) -> Option<usize> {
        let t = self.point.len() - 1;
        let along: Vec<f64> = self.inverse.iter().map(|column| dot(gradient, column)).collect();
        let candidates = || (0..=t).filter(|k| !self.stays[*k] && along[*k] > ROUNDING);
        // Of those that get to 0 together the one that divides best (P. M. J. Harris, Pivot selection
        // methods of the Devex LP code, Mathematical Programming 5, 1973).
        let step = |k: usize, slack: f64| (self.inverse[k][t].max(0.0) + slack) / along[k];
        let first = candidates().map(|k| step(k, ROUNDING)).fold(f64::INFINITY, f64::min);
        let together = candidates().filter(|k| step(*k, 0.0) <= first);
        let out = together.max_by(|i, j| along[*i].total_cmp(&along[*j]))?;
        let pivot: Vec<f64> = self.inverse[out].iter().map(|p| p / along[out]).collect();
        for (column, along) in self.inverse.iter_mut().zip(&along) {
            for (c, p) in column.iter_mut().zip(&pivot) {
                *c -= along * p;
            }
        }
        self.inverse[out] = pivot;
        self.constants[out] = constant;
        self.bounds[out] = bound;
        self.find_point();
        Some(out)
    }

    fn find_point(&mut self) {
        self.point = vec![0.0; self.constants.len()];
        for (column, constant) in self.inverse.iter().zip(&self.constants) {
            for (p, c) in self.point.iter_mut().zip(column) {
                *p += constant * c;
            }
        }
    }

    /// The x that was found, 1 in all.
    pub(crate) fn weights(&self) -> Vec<f64> {
        let mut x = self.point[..self.point.len() - 1].to_vec();
        x.iter_mut().for_each(|x| *x = if *x > ACCURACY { *x } else { 0.0 });
        let sum: f64 = x.iter().sum();
        x.iter_mut().for_each(|x| *x /= sum);
        x
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fitted(columns: &[Vec<f64>], values: Vec<f64>) -> (Vec<f64>, f64) {
        let targets = [Target::new(values)];
        let mut fit = Minimax::new(columns.len(), |_| true);
        assert!(fit.solve(columns, &targets, f64::INFINITY));
        let x = fit.weights();
        let residual = largest_residual(columns, &x, &targets);
        (x, residual)
    }

    #[test]
    fn the_largest_residual_is_the_least() {
        // Of a + (1 − a)·t against t² on 0, ½, 1: the line from a to 1 is off by a at 0 and by
        // ½ + a/2 − ¼ at ½; with a ≥ 0 nothing is better than a = 0, which is off by ¼.
        let (x, residual) = fitted(&[vec![1.0; 3], vec![0.0, 0.5, 1.0]], vec![0.0, 0.25, 1.0]);
        assert!((x[1] - 1.0).abs() < 1e-6 && (residual - 0.25).abs() < 1e-6);
        // Half way between two columns that differ in sign, which is exact.
        let (x, residual) = fitted(&[vec![1.0, -2.0], vec![-1.0, 2.0]], vec![0.0, 0.0]);
        assert!((x[0] - 0.5).abs() < 1e-6 && residual < 1e-6);
    }

    #[test]
    fn a_solution_goes_on_with_more_to_meet() {
        // Powers of s against s³: all of it, then without itself, which leaves the others more to do.
        let power = |p: i32| (0..=20).map(|i| (f64::from(i) / 20.0).powi(p)).collect();
        let columns: Vec<Vec<f64>> = (0..6).map(power).collect();
        let targets = [Target::new(power(3))];
        let mut fit = Minimax::new(6, |_| true);
        assert!(fit.solve(&columns, &targets, f64::INFINITY));
        assert!((fit.weights()[3] - 1.0).abs() < 1e-5);
        fit.leave_out(3);
        assert!(!fit.clone().solve(&columns, &targets, 1e-3));
        assert!(fit.solve(&columns, &targets, f64::INFINITY));
        let mut anew = Minimax::new(6, |j| j != 3);
        assert!(anew.solve(&columns, &targets, f64::INFINITY));
        for (x, y) in fit.weights().into_iter().zip(anew.weights()) {
            assert!((x - y).abs() < 1e-5, "{x} and {y}");
        }
        assert_eq!(fit.weights()[3], 0.0);
    }
}
