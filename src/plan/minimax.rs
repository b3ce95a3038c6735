//! Least squares with unknowns that are not negative, and of these the one of the least largest
//! residual.

/// The x ≥ 0 of the least |Ax − b|², from the normal equations: `gram` = AᵀA, row by row, and
/// `rhs` = Aᵀb. C. L. Lawson & R. J. Hanson, *Solving least squares problems*, 1974, ch. 23.
pub(crate) fn nnls(gram: &[Vec<f64>], rhs: &[f64]) -> Vec<f64> {
    let n = rhs.len();
    let mut x = vec![0.0; n];
    let mut free = vec![false; n];
    let scale = rhs.iter().fold(0.0f64, |m, r| m.max(r.abs()));
    // Each step frees one unknown; three times over them is more than was ever seen.
    for _ in 0..3 * n {
        let gain = |j: usize| rhs[j] - dot(&gram[j], &x);
        let bound = (0..n).filter(|j| !free[*j]);
        let Some(next) = bound.max_by(|i, j| gain(*i).total_cmp(&gain(*j))) else {
            break;
        };
        if gain(next) <= 1e-12 * scale {
            break;
        }
        free[next] = true;
        loop {
            let wanted = solve(gram, rhs, &free);
            // As far towards the solution as none of the free ones gets below 0.
            let mut step = 1.0;
            for j in (0..n).filter(|j| free[*j] && wanted[*j] <= 0.0) {
                step = f64::min(step, x[j] / (x[j] - wanted[j]).max(f64::MIN_POSITIVE));
            }
            for j in 0..n {
                x[j] += step * (wanted[j] - x[j]);
                if free[j] && wanted[j] <= 0.0 && x[j] <= 1e-14 {
                    free[j] = false;
                    x[j] = 0.0;
                }
            }
            if step >= 1.0 {
                break;
            }
        }
    }
    x
}

/// The unknowns that are free, with the others at 0: Gauss' elimination with pivots.
fn solve(gram: &[Vec<f64>], rhs: &[f64], free: &[bool]) -> Vec<f64> {
    let at: Vec<usize> = (0..free.len()).filter(|j| free[*j]).collect();
    let n = at.len();
    let mut rows: Vec<Vec<f64>> = at
        .iter()
        .map(|&i| at.iter().map(|&j| gram[i][j]).chain([rhs[i]]).collect())
        .collect();
    for k in 0..n {
        let pivot = (k..n).max_by(|i, j| rows[*i][k].abs().total_cmp(&rows[*j][k].abs()));
        rows.swap(k, pivot.unwrap_or(k));
        let row = rows[k].clone();
        for below in &mut rows[k + 1..] {
            let factor = below[k] / row[k];
            for (b, r) in below[k..].iter_mut().zip(&row[k..]) {
                *b -= factor * r;
            }
        }
    }
    let mut x = vec![0.0; free.len()];
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| rows[k][j] * x[at[j]]).sum();
        x[at[k]] = (rows[k][n] - known) / rows[k][k];
    }
    x
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The x ≥ 0 with Σx = 1 whose largest |Ax − b| is the least, or near it, and that residual: by
/// least squares whose weights grow where the residual is large (Lawson's iteration).
pub(crate) fn minimax(a: &[Vec<f64>], b: &[f64]) -> (Vec<f64>, f64) {
    const STEPS: usize = 40;
    // Σx = 1, as a row that outweighs the others.
    const SUM: f64 = 1e4;
    let n = a[0].len();
    let mut weights = vec![1.0 / b.len() as f64; b.len()];
    let mut best = (Vec::new(), f64::INFINITY);
    for _ in 0..STEPS {
        let mut gram = vec![vec![SUM; n]; n];
        let mut rhs = vec![SUM; n];
        for ((row, b), w) in a.iter().zip(b).zip(&weights) {
            // Most rows soon weigh nothing.
            if *w < 1e-7 {
                continue;
            }
            for i in 0..n {
                let wi = w * row[i];
                rhs[i] += wi * b;
                for (g, r) in gram[i][..=i].iter_mut().zip(row) {
                    *g += wi * r;
                }
            }
        }
        let lower = gram.clone();
        for (i, row) in gram.iter_mut().enumerate() {
            for (j, g) in row.iter_mut().enumerate().skip(i + 1) {
                *g = lower[j][i];
            }
        }
        let mut x = nnls(&gram, &rhs);
        let sum: f64 = x.iter().sum();
        x.iter_mut().for_each(|x| *x /= sum);
        let residuals: Vec<f64> = a
            .iter()
            .zip(b)
            .map(|(a, b)| (dot(a, &x) - b).abs())
            .collect();
        let worst = residuals.iter().copied().fold(0.0, f64::max);
        let mut total = 0.0;
        for (w, r) in weights.iter_mut().zip(&residuals) {
            *w *= r + 1e-3 * worst;
            total += *w;
        }
        weights.iter_mut().for_each(|w| *w /= total);
        if worst < best.1 {
            best = (x, worst);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_unknown_stays_at_zero() {
        // |x₀ − 1|² + |x₁ + 1|².
        let gram = vec![vec![1.0, 0.0], vec![0.0, 1.0]];
        assert_eq!(nnls(&gram, &[1.0, -1.0]), [1.0, 0.0]);
    }

    #[test]
    fn the_largest_residual_is_the_least() {
        // Of a + (1 − a)·t against t² on 0, ½, 1: the line from a to 1 is off by a at 0 and by
        // ½ + a/2 − ¼ at ½; with a ≥ 0 nothing is better than a = 0, which is off by ¼.
        let a = [0.0, 0.5, 1.0].map(|t| vec![1.0, t]);
        let (x, worst) = minimax(&a, &[0.0, 0.25, 1.0]);
        assert!((x[1] - 1.0).abs() < 1e-6 && (worst - 0.25).abs() < 1e-6);
        // Half way between two columns that differ in sign, which is exact.
        let a = [vec![1.0, -1.0], vec![-2.0, 2.0]];
        let (x, worst) = minimax(&a, &[0.0, 0.0]);
        assert!((x[0] - 0.5).abs() < 1e-6 && worst < 1e-6);
    }
}
