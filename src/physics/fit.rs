//! A profile of few Gaussians from what physics says: the one whose worst step edge is the least.
//!
//! - C. L. Lawson, *Contributions to the theory of linear least maximum approximation*, 1961: weights that
//!   grow where the error is large.
//!   The weights of the end are of a linear program, as in a plan.
//! - G. H. Golub & V. Pereyra, *The differentiation of pseudo-inverses and nonlinear least squares problems
//!   whose variables separate*, SIAM J. Numer. Anal. 10, 1973: variances by descent, weights by least squares.

use super::linear::nnls;
use super::response::step;
use super::{Response, number};
use crate::plan::minimax::{self, Minimax};
use crate::{Error, Gaussian, Profile};

/// The nearest to a line of light, in mm, that a fit looks: on skin, nobody sees less.
const NEAREST_MM: f64 = 0.02;
/// What E may lack of 1 where a fit ends.
const TAIL: f64 = 2e-4;
/// Points that are fitted, and how many times as many the error is taken at.
const POINTS: usize = 64;
const DENSER: usize = 4;
/// Times that weights are made to follow the error.
const ROUNDS: usize = 24;

/// A profile and what it is off by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// The profile, with the worst of [`edge_error`](Self::edge_error) as its own.
    pub profile: Profile,
    /// The worst |ΔE| at a step edge, 0.02 mm from it or more, in red, green and blue, of light that
    /// albedo has not yet scaled.
    pub edge_error: [f64; 3],
    /// What no profile is better than, however many its Gaussians: their weights are not negative, but
    /// green and blue of a spectrum may be, far from where light fell.
    pub floor: [f64; 3],
    /// R of red, green and blue light.
    pub albedo: [f64; 3],
}

impl Fit {
    /// The profile of so many Gaussians, 1 to 8, whose worst step edge is nearest to that of the responses
    /// to red, green and blue light.
    ///
    /// # Errors
    /// A number of Gaussians out of its range; a response whose albedo is not above 0.
    pub fn new(responses: &[Response; 3], gaussians: usize) -> Result<Self, Error> {
        if !(1..=Profile::MAX_GAUSSIANS).contains(&gaussians) {
            return Err(Error::Count {
                input: "fit: gaussians",
                got: gaussians,
                needs: [1, Profile::MAX_GAUSSIANS],
            });
        }
        let target = Target::new(responses)?;
        target.fit(gaussians, target.floor(), f64::INFINITY)
    }

    /// The profile of as few Gaussians as come within an error on every step edge, or within a twentieth of
    /// the floor where that is higher. Where eight do not, the eight: see [`edge_error`](Self::edge_error). A
    /// plan's error is to the fitted profile, so that both add up.
    ///
    /// # Errors
    /// An error that is not above 0; a response whose albedo is not above 0.
    pub fn within(responses: &[Response; 3], max_error: f64) -> Result<Self, Error> {
        if max_error.is_nan() || max_error <= 0.0 {
            return Err(number("fit: max_error", max_error, "a number above 0"));
        }
        let target = Target::new(responses)?;
        let floor = target.floor();
        let mut best = target.fit(1, floor, max_error)?;
        for k in 2..=Profile::MAX_GAUSSIANS {
            let reached = |(e, floor): (&f64, &f64)| *e <= max_error.max(1.05 * floor + TAIL);
            if best.edge_error.iter().zip(&floor).all(reached) {
                break;
            }
            let next = target.fit(k, floor, max_error)?;
            if next.excess() < best.excess() {
                best = next;
            }
        }
        Ok(best)
    }

    /// The worst of the three edge errors.
    pub fn worst(&self) -> f64 {
        self.edge_error.into_iter().fold(0.0, f64::max)
    }

    /// What the worst colour is off by beyond its floor, as if the two were independent.
    fn excess(&self) -> f64 {
        let above = self.edge_error.iter().zip(&self.floor).map(|(e, floor)| e * e - floor * floor);
        above.fold(0.0, f64::max).sqrt()
    }

    /// How far a profile's step edges are from those of the responses, as [`edge_error`](Self::edge_error).
    ///
    /// # Errors
    /// A response whose albedo is not above 0.
    pub fn error_of(profile: &Profile, responses: &[Response; 3]) -> Result<[f64; 3], Error> {
        Ok(Target::new(responses)?.errors(profile))
    }
}

/// Step edges, sampled.
struct Target {
    x_mm: Vec<f64>,
    /// E by colour.
    edges: [Vec<f64>; 3],
    albedo: [f64; 3],
}

impl Target {
    fn new(responses: &[Response; 3]) -> Result<Self, Error> {
        let albedo = responses.each_ref().map(Response::albedo);
        for (name, albedo) in ["red", "green", "blue"].into_iter().zip(albedo) {
            if albedo.is_nan() || albedo <= 0.0 {
                let input = format!("fit: albedo of the response to {name} light");
                return Err(number(input, albedo, "a number above 0"));
            }
        }
        let lacks = |x: f64| responses.iter().map(|r| (1.0 - r.edge(x)).abs()).fold(0.0, f64::max);
        let has = |x: f64| responses.iter().map(|r| r.edge(x) - 0.5).fold(0.0, f64::max);
        // Media that are as wide as a house start further out.
        let mut first = NEAREST_MM;
        while has(2.0 * first) < 1e-4 && first < 1e15 {
            first *= 2.0;
        }
        let (mut x, mut last) = (first, first);
        while x < 8.0 * last {
            x *= 1.25;
            if lacks(x) > TAIL {
                last = x;
            }
        }
        let n = POINTS * DENSER;
        let ratio = (2.0 * last / first).powf(1.0 / (n - 1) as f64);
        let x_mm: Vec<f64> = (0..n).map(|i| first * ratio.powi(i as i32)).collect();
        let edges = responses.each_ref().map(|r| x_mm.iter().map(|x| r.edge(*x)).collect());
        Ok(Self { x_mm, edges, albedo })
    }

    /// Worst errors of many Gaussians, none of them negative.
    fn floor(&self) -> [f64; 3] {
        const RATIO: f64 = 1.5;
        let (first, last) = (self.x_mm[0], self.x_mm[self.x_mm.len() - 1]);
        let n = ((4.0 * last / first).ln() / RATIO.ln()).ceil().min(40.0) as i32;
        let sigma = |i: i32| 0.25 * first * RATIO.powi(i);
        let search = Search::new(self);
        let columns: Vec<_> = (0..=n).map(|i| search.column(sigma(i) * sigma(i))).collect();
        search.edges.each_ref().map(|edge| {
            let mixed = minimax::mix(&columns, &nearest(&columns, edge));
            let off = mixed.iter().zip(edge).map(|(m, e)| (m - e).abs());
            off.fold(0.0, f64::max)
        })
    }

    fn errors(&self, profile: &Profile) -> [f64; 3] {
        let mut worst = [0.0f64; 3];
        for (i, x) in self.x_mm.iter().enumerate() {
            let mut edge = [0.0; 3];
            for g in profile.gaussians() {
                let step = step(*x, f64::from(g.variance_mm2));
                for (c, edge) in edge.iter_mut().enumerate() {
                    *edge += f64::from(g.weight[c]) * step;
                }
            }
            for c in 0..3 {
                worst[c] = worst[c].max((edge[c] - self.edges[c][i]).abs());
            }
        }
        worst
    }

    /// The best profile of so many Gaussians; a rough one where the best would be off by more than
    /// `hopeless`.
    fn fit(&self, gaussians: usize, floor: [f64; 3], hopeless: f64) -> Result<Fit, Error> {
        let last = self.x_mm[self.x_mm.len() - 1];
        let search = Search::new(self);
        let see = |point: &Point| {
            let profile = search.profile(point)?;
            let edge_error = self.errors(&profile);
            let worst = edge_error.into_iter().fold(0.0, f64::max);
            let profile = profile.with_fit_error(worst as f32)?;
            Ok::<_, Error>(Fit { profile, edge_error, floor, albedo: self.albedo })
        };
        let fit = |narrowest: f64| {
            let (low, high) = (narrowest * self.x_mm[0], last / 5.0);
            let steps = (gaussians - 1).max(1) as f64;
            let sigma = |j: usize| low * (high.max(low) / low).powf(j as f64 / steps);
            let mut state = search.start((0..gaussians).map(|j| 2.0 * sigma(j).ln()).collect());
            let mut fit = see(&state.point)?;
            // Sharpened, a fit of least squares is better by a third, never by half.
            let hopeless = fit.excess() > 2.0 * hopeless;
            for _ in 0..if hopeless { 0 } else { ROUNDS } {
                search.sharpen(&mut state, floor);
                let next = see(&state.point)?;
                if next.excess() < fit.excess() {
                    fit = next;
                }
            }
            Ok(fit)
        };
        let (a, b) = (fit(1.0)?, fit(2.5)?);
        Ok(if b.excess() < a.excess() { b } else { a })
    }
}

/// Variances, and how good their best weights are.
#[derive(Clone)]
struct Point {
    log_variances: Vec<f64>,
    /// Σu·ΔE² and its slope.
    value: f64,
    slope: Vec<f64>,
    /// ΔE by colour.
    residuals: [Vec<f64>; 3],
}

/// The weights of columns, none negative and 1 in all, whose sum is nearest to these values at the worst.
fn nearest(columns: &[Vec<f64>], values: &[f64]) -> Vec<f64> {
    let mut weights = Minimax::new(columns.len(), |_| true);
    weights.solve(columns, &[minimax::Target::new(values.to_vec())], f64::INFINITY);
    weights.weights()
}

/// A search under way.
struct State {
    point: Point,
    /// What each |ΔE|² weighs.
    u: [Vec<f64>; 3],
}

/// What a step `s` says of the inverse of the second derivatives, by the change `y` of the slope.
fn update(inverse: &mut Option<Vec<Vec<f64>>>, s: &[f64], y: &[f64], sy: f64, yy: f64) {
    if sy <= 0.0 {
        return;
    }
    let k = s.len();
    let h = inverse.get_or_insert_with(|| {
        let mut h = vec![vec![0.0; k]; k];
        (0..k).for_each(|i| h[i][i] = sy / yy);
        h
    });
    let hy: Vec<f64> = h.iter().map(|row| row.iter().zip(y).map(|(h, y)| h * y).sum()).collect();
    let yhy: f64 = hy.iter().zip(y).map(|(a, b)| a * b).sum();
    for i in 0..k {
        for j in 0..k {
            h[i][j] += ((1.0 + yhy / sy) * s[i] * s[j] - hy[i] * s[j] - s[i] * hy[j]) / sy;
        }
    }
}

/// The search for variances.
struct Search {
    x_mm: Vec<f64>,
    edges: [Vec<f64>; 3],
}

impl Search {
    fn new(target: &Target) -> Self {
        let at = |v: &[f64]| v.iter().copied().step_by(DENSER).collect::<Vec<_>>();
        Self { x_mm: at(&target.x_mm), edges: target.edges.each_ref().map(|e| at(e)) }
    }

    /// What a Gaussian makes of a step edge.
    fn column(&self, variance_mm2: f64) -> Vec<f64> {
        self.x_mm.iter().map(|x| step(*x, variance_mm2)).collect()
    }

    /// The profile of these variances.
    fn profile(&self, point: &Point) -> Result<Profile, Error> {
        let variances: Vec<f64> = point.log_variances.iter().map(|log| log.exp()).collect();
        let columns: Vec<_> = variances.iter().map(|v| self.column(*v)).collect();
        let weights = self.edges.each_ref().map(|edge| nearest(&columns, edge));
        let gaussian = |(j, v): (usize, &f64)| Gaussian {
            variance_mm2: v.min(f64::from(f32::MAX)) as f32,
            weight: [0, 1, 2].map(|c| weights[c][j] as f32),
        };
        Profile::new(&variances.iter().enumerate().map(gaussian).collect::<Vec<_>>())
    }

    /// Variances of least squares.
    fn start(&self, log_variances: Vec<f64>) -> State {
        let u = [(); 3].map(|()| vec![1.0 / POINTS as f64; POINTS]);
        let mut state = State { point: self.at(log_variances, &u), u };
        self.descend(&mut state, 60);
        state
    }

    /// Lawson's step: weights grow where the error is large, above what no fit goes below. By the root of
    /// it, since the variances follow, and what is best for them may jump.
    fn sharpen(&self, state: &mut State, floor: [f64; 3]) {
        let residuals = &state.point.residuals;
        let excess = |c: usize, r: &f64| (r * r - floor[c] * floor[c]).max(0.0).sqrt();
        let each = |c: usize| residuals[c].iter().map(move |r| excess(c, r));
        let worst = (0..3).flat_map(each).fold(f64::MIN_POSITIVE, f64::max);
        let mut sum = 0.0;
        for (c, u) in state.u.iter_mut().enumerate() {
            for (u, r) in u.iter_mut().zip(&residuals[c]) {
                *u *= (excess(c, r) / worst).sqrt() + 0.02;
                sum += *u;
            }
        }
        state.u.iter_mut().flatten().for_each(|u| *u *= 3.0 / sum);
        state.point = self.at(std::mem::take(&mut state.point.log_variances), &state.u);
        self.descend(state, 6);
    }

    /// Steps of BFGS: J. Nocedal & S. J. Wright, *Numerical optimization*, 2nd ed., 2006, ch. 6.1.
    fn descend(&self, State { point, u }: &mut State, steps: usize) {
        let mut inverse: Option<Vec<Vec<f64>>> = None;
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for _ in 0..steps {
            let down = |row: &Vec<f64>| -dot(row, &point.slope);
            let mut way: Vec<f64> = match &inverse {
                Some(h) => h.iter().map(down).collect(),
                None => point.slope.iter().map(|s| -s).collect(),
            };
            // A step changes no width by more than a half.
            let longest = way.iter().fold(0.0f64, |m, w| m.max(w.abs()));
            if longest == 0.0 || !longest.is_finite() {
                return;
            }
            let scale = match &inverse {
                Some(_) => (0.8 / longest).min(1.0),
                None => 0.05 / longest,
            };
            way.iter_mut().for_each(|w| *w *= scale);
            let falls = dot(&way, &point.slope);
            let moved = |share: f64| {
                let logs = point.log_variances.iter().zip(&way);
                (share, self.at(logs.map(|(v, w)| v + share * w).collect(), u))
            };
            let shares = [1.0, 0.3, 0.09, 0.027, 0.008].into_iter();
            let enough = |(share, next): &(f64, Point)| next.value <= point.value + 1e-4 * share * falls;
            let Some((share, next)) = shares.map(moved).find(enough) else {
                if inverse.take().is_none() {
                    return;
                }
                continue;
            };
            let s: Vec<f64> = way.iter().map(|w| share * w).collect();
            let slopes = next.slope.iter().zip(&point.slope);
            let y: Vec<f64> = slopes.map(|(a, b)| a - b).collect();
            update(&mut inverse, &s, &y, dot(&s, &y), dot(&y, &y));
            let gained = point.value - next.value;
            *point = next;
            if gained < 1e-7 * point.value {
                return;
            }
        }
    }

    /// The best weights for these variances, and how the error changes with them: the weights being the
    /// best, as if they stayed.
    fn at(&self, log_variances: Vec<f64>, u: &[Vec<f64>; 3]) -> Point {
        // Σw = 1, as a row that outweighs the others.
        const SUM: f64 = 1e4;
        let k = log_variances.len();
        let mut steps = Vec::with_capacity(POINTS * k);
        let mut slopes = Vec::with_capacity(POINTS * k);
        for x in &self.x_mm {
            for log in &log_variances {
                let t = x * (-0.5 * log).exp();
                steps.push(step(t, 1.0));
                // d/d(ln v) of Φ(x/√v).
                slopes.push(-0.5 * t * (-0.5 * t * t).exp() / (2.0 * std::f64::consts::PI).sqrt());
            }
        }
        let mut point =
            Point { log_variances, value: 0.0, slope: vec![0.0; k], residuals: Default::default() };
        for c in 0..3 {
            let mut gram = vec![vec![SUM; k]; k];
            let mut rhs = vec![SUM; k];
            for ((row, e), u) in steps.chunks(k).zip(&self.edges[c]).zip(&u[c]) {
                for i in 0..k {
                    rhs[i] += u * row[i] * e;
                    for j in 0..k {
                        gram[i][j] += u * row[i] * row[j];
                    }
                }
            }
            let mut w = nnls(&gram, &rhs);
            let sum: f64 = w.iter().sum();
            w.iter_mut().for_each(|w| *w /= sum);
            for (i, e) in self.edges[c].iter().enumerate() {
                let row = i * k..(i + 1) * k;
                let fitted: f64 = steps[row.clone()].iter().zip(&w).map(|(s, w)| s * w).sum();
                let residual = fitted - e;
                point.value += u[c][i] * residual * residual;
                for (slope, (s, w)) in point.slope.iter_mut().zip(slopes[row].iter().zip(&w)) {
                    *slope += 2.0 * u[c][i] * residual * s * w;
                }
                point.residuals[c].push(residual);
            }
        }
        point
    }
}
