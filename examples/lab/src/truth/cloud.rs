//! A surface as a cloud of patches, and the Gaussian sums over it: the only place where the truths
//! weigh anything.

use glam::{DVec3, Vec3};

use super::tree::Tree;

/// A piece of surface, small against the Gaussians that are summed over it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Its middle, in mm.
    pub point_mm: Vec3,
    /// Its area, in mm².
    pub area_mm2: f32,
    /// Irradiance that falls on it, linear RGB.
    pub irradiance: Vec3,
}

/// σ beyond which nothing is summed: e^(−5²/2) = 4e-6 of a plane's mass lies there.
pub(super) const REACH_SIGMAS: f32 = 5.0;

/// As many as the compiler puts into registers of any x86-64 or ARM machine at once.
const LANES: usize = 8;

/// Patches in the tree's order, one array a number, so that eight are summed at a time.
pub(super) struct Cloud {
    tree: Tree,
    /// x, y, z, area, and area times red, green and blue irradiance.
    columns: [Vec<f32>; 7],
}

/// The weight of a displacement r: G = exp(−r²/2v − (r·n)²/2).
pub(super) struct Kernel {
    /// v.
    pub variance_mm2: f32,
    /// n, in 1/mm: the direction in which it is narrower than that; zero where it is as wide in all.
    pub narrowed: Vec3,
}

impl Kernel {
    /// As wide in all directions.
    pub fn round(variance_mm2: f32) -> Self {
        Self { variance_mm2, narrowed: Vec3::ZERO }
    }
}

/// ∫ E G dA and ∫ G dA.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    pub light: DVec3,
    pub mass: f64,
}

impl Cloud {
    pub fn new(patches: &[Patch]) -> Self {
        let points: Vec<Vec3> = patches.iter().map(|p| p.point_mm).collect();
        let tree = Tree::new(&points);
        let column = |value: fn(&Patch) -> f32| {
            let in_order = tree.order.iter().map(|&i| value(&patches[i as usize]));
            in_order.collect::<Vec<f32>>()
        };
        let columns = [
            column(|p| p.point_mm.x),
            column(|p| p.point_mm.y),
            column(|p| p.point_mm.z),
            column(|p| p.area_mm2),
            column(|p| p.area_mm2 * p.irradiance.x),
            column(|p| p.area_mm2 * p.irradiance.y),
            column(|p| p.area_mm2 * p.irradiance.z),
        ];
        Self { tree, columns }
    }

    /// The sum around a point; of everything within [`REACH_SIGMAS`] and some beyond.
    pub fn sum(&self, point_mm: Vec3, kernel: &Kernel) -> Sum {
        let mut sum = Sum::default();
        let sum_leaf = match kernel.narrowed == Vec3::ZERO {
            true => sum_leaf::<true>,
            false => sum_leaf::<false>,
        };
        let reach = REACH_SIGMAS * kernel.variance_mm2.sqrt();
        self.tree.any_leaf(point_mm, reach, |places| {
            let leaf = self.columns.each_ref().map(|c| &c[places.clone()]);
            let [mass, r, g, b] = sum_leaf(leaf, point_mm, kernel);
            sum.light += DVec3::new(r.into(), g.into(), b.into());
            sum.mass += f64::from(mass);
            false
        });
        sum
    }
}

/// Σ G·A and Σ G·A·E over the patches of a leaf; faster for kernels that are as wide in all directions.
fn sum_leaf<const IS_ROUND: bool>(columns: [&[f32]; 7], point: Vec3, kernel: &Kernel) -> [f32; 4] {
    let scale = -0.5 / kernel.variance_mm2;
    let n = kernel.narrowed * std::f32::consts::FRAC_1_SQRT_2;
    let mut totals = [[0.0; LANES]; 4];
    let count = columns[0].len();
    for first in (0..count).step_by(LANES) {
        let full = count - first >= LANES;
        let lanes = columns.map(|c| {
            let mut lane = [0.0; LANES]; // patches of no area fill the last
            if full {
                lane.copy_from_slice(&c[first..first + LANES]);
            } else {
                lane[..count - first].copy_from_slice(&c[first..]);
            }
            lane
        });
        for i in 0..LANES {
            let d = [0, 1, 2].map(|k| lanes[k][i] - point[k]);
            let mut exponent = scale * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
            if !IS_ROUND {
                let narrowed = n.x * d[0] + n.y * d[1] + n.z * d[2];
                exponent -= narrowed * narrowed;
            }
            let weight = exp(exponent);
            for k in 0..4 {
                totals[k][i] += weight * lanes[3 + k][i];
            }
        }
    }
    totals.map(|lanes| lanes.iter().sum())
}

/// eˣ for x ≤ 0 to 2e-7 of its value, 0 below −87: without a branch or a call, so that a loop of it
/// becomes SIMD. 2ⁿ comes from the exponent's bits, the rest from Taylor's series.
fn exp(x: f32) -> f32 {
    // Adding 1.5·2²³ rounds to whole numbers in the low bits.
    const ROUND: f32 = 12_582_912.0;
    let x = x.max(-87.0);
    let rounded = x * std::f32::consts::LOG2_E + ROUND;
    let n = rounded - ROUND;
    let power = f32::from_bits((rounded.to_bits() << 23).wrapping_add(1.0f32.to_bits()));
    // ln 2 in two parts, so that n·ln 2 keeps its digits.
    let f = (x - n * 0.693_359_4) + n * 2.121_944_4e-4;
    let series = 1.0 / 720.0;
    let series =
        [1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0].iter().fold(series, |sum, term| sum * f + term);
    if x <= -87.0 { 0.0 } else { power * series }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_is_that_of_the_library() {
        for i in 0..20_000 {
            let x = -0.0043 * i as f32;
            let exact = f64::from(x).exp();
            // An ulp is 1.2e-7; the series ends at 1e-7.
            assert!((f64::from(exp(x)) / exact - 1.0).abs() < 3e-7, "{x}");
        }
        assert_eq!(exp(0.0), 1.0);
        assert_eq!(exp(-88.0), 0.0);
        assert_eq!(exp(f32::NEG_INFINITY), 0.0);
    }

    #[test]
    fn a_cloud_sums_what_a_loop_sums() {
        let patches: Vec<Patch> = (0..1000)
            .map(|i| {
                let i = i as f32;
                Patch {
                    point_mm: Vec3::new((0.7 * i).sin(), (1.3 * i).cos(), (0.1 * i).sin()),
                    area_mm2: 0.5 + 0.4 * (0.3 * i).sin(),
                    irradiance: Vec3::new(1.0, 0.5 + 0.5 * i.cos(), 0.0),
                }
            })
            .collect();
        let cloud = Cloud::new(&patches);
        let (p, v) = (Vec3::new(0.2, 0.1, -0.3), 0.6);
        let (mut light, mut mass) = (DVec3::ZERO, 0.0);
        for q in &patches {
            let r2 = q.point_mm.as_dvec3().distance_squared(p.as_dvec3());
            let w = f64::from(q.area_mm2) * (-r2 / (2.0 * f64::from(v))).exp();
            light += w * q.irradiance.as_dvec3();
            mass += w;
        }
        let sum = cloud.sum(p, &Kernel::round(v));
        // Full floats over a thousand terms; what lies beyond 5σ is 4e-6.
        assert!((sum.mass / mass - 1.0).abs() < 1e-5);
        assert!(((sum.light - light) / mass).abs().max_element() < 1e-5);
    }
}
