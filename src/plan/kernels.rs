//! The blurs that plans are made of.

/// Which pixels around the middle one a blur takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
    /// The 9 of 3×3.
    Nine,
    /// The 13 of |x| + |y| ≤ 2.
    Thirteen,
    /// The 25 of 5×5.
    Square,
}

impl Shape {
    pub(crate) fn count(self) -> usize {
        match self {
            Self::Nine => 9,
            Self::Thirteen => 13,
            Self::Square => 25,
        }
    }

    fn holds(self, [x, y]: [i32; 2]) -> bool {
        match self {
            Self::Nine => x.abs() <= 1 && y.abs() <= 1,
            Self::Thirteen => x.abs() + y.abs() <= 2,
            Self::Square => true,
        }
    }

    /// The variance of equal weights, which no others exceed.
    pub(crate) fn limit(self) -> f64 {
        match self {
            Self::Nine => 2.0 / 3.0,
            Self::Thirteen => 14.0 / 13.0,
            Self::Square => 2.0,
        }
    }

    /// Up to which variance a blur is no more than its three innermost columns.
    pub(crate) fn narrow(self) -> f64 {
        if self == Self::Nine { self.limit() } else { 0.26 }
    }

    /// `Blur::sharpness` of surface.wgsl: fitted to [`Shape::exponent`] from [`Shape::narrow`] to .97 of
    /// the limit.
    pub(crate) fn sharpness(self) -> [f64; 4] {
        match self {
            Self::Nine => [0.0; 4],
            Self::Thirteen => [-0.1746, 1.8812, -0.0573, 0.8913],
            Self::Square => [-0.0215, 1.0592, 1.2778, 0.5434],
        }
    }

    /// The variance along an axis that weights exp(−r²/2q) have, cut off.
    fn variance(self, q: f64) -> f64 {
        let taps = self.taps(q);
        taps.iter().map(|([x, _], w)| w * f64::from(x * x)).sum()
    }

    /// Pixels and their weights exp(−r²/2q), 1 in all.
    fn taps(self, q: f64) -> Taps {
        let square = -2..=2;
        let pixels = square.clone().flat_map(|y| square.clone().map(move |x| [x, y]));
        let mut taps: Taps = pixels
            .filter(|p| self.holds(*p))
            .map(|[x, y]| ([x, y], (-f64::from(x * x + y * y) / (2.0 * q)).exp()))
            .collect();
        let mass: f64 = taps.iter().map(|(_, w)| w).sum();
        taps.iter_mut().for_each(|(_, w)| *w /= mass);
        taps
    }
}

/// Weights of pixels.
pub(super) type Taps = Vec<([i32; 2], f64)>;

/// A Gaussian, cut off by a shape of taps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Blur {
    /// In square pixels of its level, what the pyramid blurs by itself included.
    pub variance_px2: f64,
    pub shape: Shape,
}

impl Blur {
    /// What it weighs on level `l`.
    pub(crate) fn taps(&self, l: usize) -> Taps {
        let variance = self.variance_px2 - own_blur(l);
        self.shape.taps(self.shape.exponent(variance))
    }
}

impl Shape {
    /// The q of weights exp(−r²/2q) that have `variance` when they are cut off.
    pub(crate) fn exponent(self, variance: f64) -> f64 {
        let (mut low, mut high) = (1e-2, 1e3);
        for _ in 0..60 {
            let middle = f64::sqrt(low * high);
            if self.variance(middle) < variance {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }
}

/// The blurs of one resolution: up to three that share their taps, and one that takes the whole square,
/// for which pixels only pay where a plan gives it weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Kinds {
    pub shape: Shape,
    pub variances_px2: &'static [f64],
    pub square_px2: Option<f64>,
}

impl Kinds {
    /// All of them, the square one last.
    pub(crate) fn blurs(&self) -> impl Iterator<Item = Blur> {
        let blur = |shape| move |variance_px2| Blur { variance_px2, shape };
        let shared = self.variances_px2.iter().copied().map(blur(self.shape));
        shared.chain(self.square_px2.map(blur(Shape::Square)))
    }

    pub(crate) fn len(&self) -> usize {
        self.variances_px2.len() + usize::from(self.square_px2.is_some())
    }
}

/// The blurs of a plan: of the frame itself, and of each level, whose variances hold what the pyramid
/// blurs by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Kernels {
    pub fine: Kinds,
    pub coarse: Kinds,
}

impl Kernels {
    /// Of the light that stays, of each blur of the frame, then of each of level 1 and so on: its level, and its
    /// variance in square pixels of that level.
    pub(crate) fn blurs(&self, levels: usize) -> Vec<(usize, f64)> {
        let mut blurs = vec![(0, 0.0)];
        blurs.extend(self.fine.blurs().map(|b| (0, b.variance_px2)));
        for l in 1..=levels {
            blurs.extend(self.coarse.blurs().map(|b| (l, b.variance_px2)));
        }
        blurs
    }

    /// The variances in square pixels of the frame.
    pub(crate) fn variances_px2(&self, levels: usize) -> Vec<f64> {
        self.blurs(levels).iter().map(|(l, v)| v * f64::powi(4.0, *l as i32)).collect()
    }
}

/// From the cheapest to the most exact. Levels double, so variances of a level are those of the one
/// before, four times; whatever lies between is mixed. Found by fitting skin with many sets, at all
/// scales: of those with as many taps these keep the smallest error.
pub(crate) const KERNELS: [Kernels; 2] = [
    Kernels {
        fine: Kinds { shape: Shape::Nine, variances_px2: &[0.3, 0.55], square_px2: None },
        coarse: Kinds { shape: Shape::Nine, variances_px2: &[0.9], square_px2: None },
    },
    Kernels {
        fine: Kinds { shape: Shape::Thirteen, variances_px2: &[0.15, 0.45, 0.87], square_px2: Some(1.25) },
        coarse: Kinds { shape: Shape::Thirteen, variances_px2: &[1.03], square_px2: Some(1.5) },
    },
];

/// Variance in square pixels of level `l` that going there and back blurs by: ¾·4ʲ on the way down
/// and as much on the way up, for each level j below.
pub(crate) fn own_blur(l: usize) -> f64 {
    0.5 * (1.0 - f64::powi(0.25, l as i32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sharpness_gives_weights_their_variance() {
        for shape in [Shape::Nine, Shape::Thirteen, Shape::Square] {
            let [x, y, z, w] = shape.sharpness();
            for i in 0..=20 {
                let variance = 0.1 + (0.95 * shape.limit() - 0.1) * f64::from(i) / 20.0;
                let t = variance / shape.limit();
                let wide = (1.0 - t) * (x / t + y + t * (z + t * w));
                let narrow = -2.0 * variance * (variance / (2.0 - 2.0 * variance)).ln();
                let sharpness = if variance < shape.narrow() { narrow } else { wide };
                let found = shape.variance(variance / sharpness);
                // As far as a cubic goes.
                assert!((found / variance - 1.0).abs() < 0.02, "{shape:?} {variance}: {found}");
            }
        }
    }

    #[test]
    fn no_blur_is_wider_than_its_taps() {
        for kernels in KERNELS {
            // What the pyramid blurs by itself is the least on level 1, and all of it is left for the
            // taps of the frame.
            let levels = [(kernels.fine, 0), (kernels.coarse, 1)];
            for (kinds, l) in levels {
                for blur in kinds.blurs() {
                    let by_taps = blur.variance_px2 - own_blur(l);
                    assert!(by_taps < 0.97 * blur.shape.limit(), "{blur:?} on level {l}");
                }
            }
            let deep = kernels.coarse.blurs().map(|b| b.variance_px2 - own_blur(20));
            assert!(deep.fold(f64::MAX, f64::min) > 0.0);
        }
    }
}
