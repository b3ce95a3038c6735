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

/// Solves a square system, row by row, whose matrix is nearly 1, as those of light that scatters are: by
/// steps in the space of the residual's images, or, where that takes long, by elimination. The solution is
/// off by 10⁻⁶ of `x`, the right side. Y. Saad & M. H. Schultz, *GMRES: a generalized minimal residual
/// algorithm for solving nonsymmetric linear systems*, SIAM J. Sci. Stat. Comput. 7, 1986.
pub(super) fn solve_near_one(a: &mut [f64], x: &mut [f64]) {
    const STEPS: usize = 60;
    let n = x.len();
    let norm = dot(x, x).sqrt();
    if norm == 0.0 {
        return;
    }
    // Orthogonal directions; what a makes of them, made triangular by rotations; the rotated residual.
    let mut basis = vec![x.iter().map(|x| x / norm).collect::<Vec<f64>>()];
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut turns: Vec<[f64; 2]> = Vec::new();
    let mut residual = vec![norm];
    for k in 0..STEPS {
        let mut next: Vec<f64> = a.chunks(n).map(|row| dot(row, &basis[k])).collect();
        let mut column = Vec::with_capacity(k + 2);
        for known in &basis {
            let part = dot(known, &next);
            next.iter_mut().zip(known).for_each(|(next, known)| *next -= part * known);
            column.push(part);
        }
        let rest = dot(&next, &next).sqrt();
        column.push(rest);
        for (i, [cos, sin]) in turns.iter().enumerate() {
            let (above, below) = (column[i], column[i + 1]);
            column[i] = cos * above + sin * below;
            column[i + 1] = cos * below - sin * above;
        }
        let length = column[k].hypot(rest);
        let [cos, sin] = [column[k] / length, rest / length];
        turns.push([cos, sin]);
        column[k] = length;
        columns.push(column);
        residual.push(-sin * residual[k]);
        residual[k] *= cos;
        if residual[k + 1].abs() < 1e-6 * norm {
            x.fill(0.0);
            let mut shares = residual;
            for i in (0..=k).rev() {
                let known: f64 = (i + 1..=k).map(|j| columns[j][i] * shares[j]).sum();
                shares[i] = (shares[i] - known) / columns[i][i];
                x.iter_mut().zip(&basis[i]).for_each(|(x, b)| *x += shares[i] * b);
            }
            return;
        }
        next.iter_mut().for_each(|next| *next /= rest);
        basis.push(next);
    }
    solve(a, x);
}

/// Σab, in eight sums that a processor can do at once.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a_parts, b_parts) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a_parts.remainder().iter().zip(b_parts.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a_parts.zip(b_parts) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum::<f64>() + rest
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
    fn steps_and_elimination_agree() {
        // I − K, whose K moves 0.98 of what there is, unevenly, and one that is far from 1.
        const N: usize = 37;
        let share = |i: usize, j: usize| ((i * 7 + j * 3) % 11) as f64;
        for scale in [0.98, 40.0] {
            let of = |i: usize| -> f64 { (0..N).map(|j| share(i, j)).sum() };
            let one = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
            let mut a: Vec<f64> = (0..N * N)
                .map(|k| (k / N, k % N))
                .map(|(i, j)| one(i, j) - scale * share(i, j) / of(i))
                .collect();
            let right: Vec<f64> = (0..N).map(|i| (i as f64).sin()).collect();
            let (mut b, mut x, mut y) = (a.clone(), right.clone(), right);
            solve(&mut a, &mut x);
            solve_near_one(&mut b, &mut y);
            for (x, y) in x.iter().zip(&y) {
                assert!((x - y).abs() < 1e-4 * (1.0 + x.abs()), "{x} {y}");
            }
        }
        let mut zero = [0.0; 2];
        solve_near_one(&mut [1.0, 0.0, 0.0, 1.0], &mut zero);
        assert_eq!(zero, [0.0; 2]);
    }

    #[test]
    fn a_bound_unknown_stays_at_zero() {
        // |x₀ − 1|² + |x₁ + 1|².
        let gram = [vec![1.0, 0.0], vec![0.0, 1.0]];
        assert_eq!(nnls(&gram, &[1.0, -1.0]), [1.0, 0.0]);
    }
}
