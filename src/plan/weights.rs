//! The weights of the blurs of a pyramid, as they are drawn with.

use std::fmt;

use glam::{Vec3, Vec4};

use super::Row;
use super::kernels::Kernels;

/// Rows to an octave of scale; between two of them weights are interpolated.
pub(crate) const ROWS_PER_OCTAVE: f64 = 6.0;

/// Levels that weights may be for.
pub(crate) const MAX_LEVELS: usize = 10;

/// How much of each blur a profile takes, at scales a sixth of an octave apart.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Weights {
    pub kernels: Kernels,
    /// Levels above the frame.
    pub levels: usize,
    /// log₂ of the pixels per mm of the first row.
    pub(super) first_octave: f64,
    /// A profile's rows.
    pub profiles: Vec<Vec<Row>>,
}

/// The scale of a row.
pub(super) fn px_per_mm(first_octave: f64, row: f64) -> f64 {
    f64::exp2(first_octave + row / ROWS_PER_OCTAVE)
}

/// What is fitted for one row: all of it but what follows from the others.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "json", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "json", serde(deny_unknown_fields))]
pub(super) struct Mixture {
    pub weights: Vec<[f32; 3]>,
    pub predicted_error: f32,
    pub unscattered_error: f32,
}

impl Weights {
    pub(super) fn new(kernels: Kernels, first_octave: f64, profiles: Vec<Vec<Mixture>>) -> Self {
        let mut weights = Self { kernels, levels: MAX_LEVELS, first_octave, profiles: Vec::new() };
        let slots: Vec<usize> = (1..=MAX_LEVELS + 1).map(|l| weights.slot(l, 0)).collect();
        for rows in profiles {
            let mut level = 0;
            let row = |(i, mixture): (usize, Mixture)| {
                let beyond = |slot: &usize| mixture.weights[*slot..].iter().any(|w| *w != [0.0; 3]);
                level = level.max(slots.iter().take_while(|slot| beyond(slot)).count());
                Row {
                    px_per_mm: px_per_mm(first_octave, i as f64) as f32,
                    weights: mixture.weights,
                    level,
                    predicted_error: mixture.predicted_error,
                    unscattered_error: mixture.unscattered_error,
                }
            };
            weights.profiles.push(rows.into_iter().enumerate().map(row).collect());
        }
        weights
    }

    /// How many weights a row has.
    pub(super) fn slots(kernels: &Kernels) -> usize {
        1 + kernels.fine.len() + MAX_LEVELS * kernels.coarse.len()
    }

    /// As shaders have it.
    pub(crate) fn first_octave(&self) -> f32 {
        self.first_octave as f32
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

    /// The weights as the shaders have them: of each profile the rows, of each row the slots. The last component
    /// of its first one is its level, that of the second the id of the first profile that is equal.
    pub(crate) fn table(&self) -> Vec<Vec4> {
        let mut table = Vec::new();
        let equal =
            |rows: &Vec<Row>| self.profiles.iter().position(|first| first == rows).map_or(0, |i| i + 1);
        let rows = self.profiles.iter().flat_map(|rows| rows.iter().map(move |row| (row, equal(rows))));
        for (row, id) in rows {
            let weights: Vec<Vec3> = row.weights.iter().map(|w| Vec3::from(*w)).collect();
            let beyond = |l: usize| weights[self.slot(l + 1, 0)..].iter().sum::<Vec3>();
            let rest = (0..=self.levels).map(beyond);
            let first = table.len();
            table.extend(weights.iter().copied().chain(rest).map(|w| w.extend(0.0)));
            table[first].w = row.level as f32;
            table[first + 1].w = id as f32;
        }
        table
    }

    /// The coarsest level that skin of at most so many px/mm is blurred at. As `coarsest_level` of host.wgsl.
    pub(crate) fn coarsest_level(&self, px_per_mm: f64) -> usize {
        let row = ((px_per_mm.log2() - self.first_octave) * ROWS_PER_OCTAVE).ceil() + 2.0;
        let rows = self.profiles.iter().flat_map(|rows| &rows[..=(row as usize).min(rows.len() - 1)]);
        rows.map(|row| row.level).max().unwrap_or(0)
    }

    /// Whether no profile differs from another.
    pub(crate) fn has_one_profile(&self) -> bool {
        self.profiles.windows(2).all(|pair| pair[0] == pair[1])
    }

    /// Texel fetches for a pixel of a simple tile at a scale, all levels' shares and the copy included.
    pub(crate) fn fetches(&self, rows: &[Row], px_per_mm: f32) -> f32 {
        let octave = f64::from(px_per_mm).log2() - self.first_octave;
        let i = (octave * ROWS_PER_OCTAVE).clamp(0.0, (rows.len() - 2) as f64) as usize;
        let used = |slot: usize| rows[i..i + 2].iter().any(|r| r.weights[slot] != [0.0; 3]);
        let blurs = |l: usize| {
            let kinds = if l == 0 { &self.kernels.fine } else { &self.kernels.coarse };
            let taps = kinds.blurs().enumerate().filter(|(j, _)| used(self.slot(l, *j)));
            taps.map(|(_, b)| b.shape.count()).max().unwrap_or(0)
        };
        let top = (1..=self.levels).rev().find(|l| blurs(*l) > 0).unwrap_or(0);
        // Marking: depth and id. Packing: them again, four neighbours, the light. The copy.
        let mut sum = 2.0 + 7.0 + 1.0;
        for l in 0..=top {
            // The taps, the one in the middle at least; the coarser mean.
            let blurred = blurs(l).max(1) + usize::from(l < top);
            // Four filtered fetches of light, two of where the surface is.
            let halved = if l > 0 { 6 } else { 0 };
            sum += (blurred + halved) as f32 * f32::powi(0.25, l as i32);
        }
        sum
    }

    /// The largest error on straight edges, of any profile at any scale.
    pub(crate) fn predicted_error(&self) -> f32 {
        let rows = self.profiles.iter().flatten();
        rows.map(|r| r.predicted_error).fold(0.0, f32::max)
    }
}

/// The name of a set of blurs, by which a file tells which one its weights are for.
impl fmt::Display for Kernels {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for (what, kinds) in [("the frame", &self.fine), ("; each level", &self.coarse)] {
            write!(f, "{what}:")?;
            for (j, blur) in kinds.blurs().enumerate() {
                let comma = if j > 0 { "," } else { "" };
                let taps = blur.shape.count();
                write!(f, "{comma} {} px² by {taps} taps", blur.variance_px2)?;
            }
        }
        Ok(())
    }
}
