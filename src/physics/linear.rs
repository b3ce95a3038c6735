//! Systems of linear equations, and least squares whose unknowns are not negative.

/// Solves a square system, row by row, in place by Gauss' elimination with pivots; `x` is the right side,
/// then the solution.
pub(super) fn solve(a: &mut [f64], x: &mut [f64]) {
    let n = x.len();
    for k in 0..n {
        let size = |i: &usize| a[i * n + k].abs();
        let pivot = (k..n).max_by(|i, j| size(i).total_cmp(&size(j)));
        let pivot = pivot.unwrap_or(k);
        if pivot != k {
            for j in k..n {
                a.swap(k * n + j, pivot * n + j);
            }
            x.swap(k, pivot);
        }
        let (above, below) = a.split_at_mut((k + 1) * n);
        let row = &above[k * n + k..];
        for i in k + 1..n {
            let target = &mut below[(i - k - 1) * n + k..(i - k) * n];
            let factor = target[0] / row[0];
            if factor != 0.0 {
                for (t, r) in target.iter_mut().zip(row) {
                    *t -= factor * r;
                }
                x[i] -= factor * x[k];
            }
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| a[k * n + j] * x[j]).sum();
        x[k] = (x[k] - known) / a[k * n + k];
    }
}

/// The x ≥ 0 of the least |Ax − b|², from the normal equations: `gram` = AᵀA, row by row, and `rhs` = Aᵀb.
/// C. L. Lawson & R. J. Hanson, *Solving least squares problems*, 1974, ch. 23.
pub(super) fn nnls(gram: &[Vec<f64>], rhs: &[f64]) -> Vec<f64> {
    let n = rhs.len();
    let mut x = vec![0.0; n];
    let mut free: Vec<usize> = Vec::new();
    let scale = rhs.iter().fold(0.0f64, |m, r| m.max(r.abs()));
    // Each step frees one unknown; three times over them is more than was ever seen.
    for _ in 0..3 * n {
        let falls = |j: usize| rhs[j] - gram[j].iter().zip(&x).map(|(g, x)| g * x).sum::<f64>();
        let bound = (0..n).filter(|j| !free.contains(j)).map(|j| (falls(j), j));
        let Some((most, next)) = bound.max_by(|a, b| a.0.total_cmp(&b.0)) else {
            break;
        };
        if most <= 1e-12 * scale {
            break;
        }
        free.push(next);
        loop {
            let mut system: Vec<f64> =
                free.iter().flat_map(|i| free.iter().map(|j| gram[*i][*j])).collect();
            let mut wanted: Vec<f64> = free.iter().map(|j| rhs[*j]).collect();
            solve(&mut system, &mut wanted);
            // As far towards the solution as none of the free ones gets below 0.
            let mut step = 1.0;
            for (&j, &wanted) in free.iter().zip(&wanted).filter(|(_, wanted)| **wanted <= 0.0) {
                step = f64::min(step, x[j] / (x[j] - wanted).max(f64::MIN_POSITIVE));
            }
            for (&j, &wanted) in free.iter().zip(&wanted) {
                x[j] += step * (wanted - x[j]);
                if wanted <= 0.0 && x[j] <= 1e-14 {
                    x[j] = 0.0;
                }
            }
            free.retain(|j| x[*j] > 0.0);
            if step >= 1.0 || free.is_empty() {
                break;
            }
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_is_solved_whose_first_pivot_is_zero() {
        let mut x = [3.0, 5.0];
        solve(&mut [0.0, 1.0, 2.0, 1.0], &mut x);
        assert_eq!(x, [1.0, 3.0]);
    }

    #[test]
    fn a_bound_unknown_stays_at_zero() {
        // |x₀ − 1|² + |x₁ + 1|².
        let gram = [vec![1.0, 0.0], vec![0.0, 1.0]];
        assert_eq!(nnls(&gram, &[1.0, -1.0]), [1.0, 0.0]);
    }
}
