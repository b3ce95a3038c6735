//! A flat square of skin under a soft edge of light, laid out in an atlas one way or another.

use glam::{DAffine2, DMat2, DVec2, DVec3, UVec2};

use super::Shared;
use crate::Error;
use crate::stability::case::Outcome;
use crate::stability::lab::Lab;
use crate::stability::scene::{Form, Scene, Surface};
use crate::stability::trial::{Crop, Look, Measure, Trial, Truth};
use crate::stability::unwrapped::{Texel, Unwrapped};
use crate::synthetic::View;
use crate::truth::closed_form::step;

/// Side of the square.
pub const SIDE_MM: f64 = 28.0;
pub const HALF_MM: f64 = SIDE_MM / 2.0;
/// Side of the part in the middle that is asked for: what is cut off of the widest Gaussian there
/// weighs less than 0.0002.
const ASKED_MM: f64 = 11.2;
/// Between an island and the border of its place, in texels: more than results are dilated by.
const GUTTER: f64 = 6.0;

/// The square, and what a camera that faces it sees: the same for every atlas.
#[derive(Clone)]
pub struct Square {
    quick: bool,
    /// Across the edge, from dark to light.
    across: DVec2,
    /// σ of the edge.
    soft_mm: f64,
    look: Shared<Look>,
}

impl Square {
    /// The edge's normal is at `degrees` from x.
    pub fn new(degrees: f64, soft_mm: f64, quick: bool) -> Self {
        Self { quick, across: DVec2::from_angle(degrees.to_radians()), soft_mm, look: Shared::new() }
    }

    /// Irradiance on the square, or on the one behind it, which is lit where this one is not.
    fn light(&self, on_square: DVec2, is_behind: bool) -> DVec3 {
        let lit = step(on_square.dot(self.across), self.soft_mm.powi(2));
        DVec3::splat(if is_behind { 1.0 - lit } else { lit })
    }

    fn trial(&self) -> Trial {
        let (pixels, px_per_mm) = if self.quick { (128, 5.0) } else { (224, 8.0) };
        let view = View::orthographic([pixels; 2], px_per_mm);
        let across = self.across.extend(0.0);
        let square = Surface::edge(Form::facing(SIDE_MM), across, 0.0, self.soft_mm.powi(2));
        let side = (ASKED_MM * px_per_mm) as u32;
        // Half as high as wide is enough to see.
        let crop = Crop::middle(&view, [side, side / 2]);
        Trial::new(Scene(vec![square]), view, crop, Truth::Visible)
    }

    /// Every method on it; in texture space laid out like this, and held to the square without end.
    ///
    /// # Errors
    /// Inputs that a method refuses.
    pub fn run(&self, lab: &Lab, layout: &Layout, measure: Measure) -> Result<Outcome, Error> {
        let trial = self.trial();
        let look = self.look.get(|| trial.look(lab))?;
        let truth = look.held_to(Truth::Closed, &trial.scene, None);
        let uv = |_, point: DVec3| layout.uv(point.truncate());
        look.textured(lab, &layout.unwrap(self), uv, &truth, measure)
    }
}

/// A part of the square on its own in the atlas.
#[derive(Clone, Copy)]
pub struct Island {
    /// Least and greatest x and y.
    part_mm: [DVec2; 2],
    /// Texels from mm on the square.
    to_texels: DAffine2,
    /// Whether it shows another square, 100 mm behind.
    is_behind: bool,
}

impl Island {
    /// A part of the square, by the mm that a texel steps along u and along v.
    pub fn new(part_mm: [DVec2; 2], texel_mm: [DVec2; 2]) -> Self {
        let [u, v] = texel_mm;
        Self { part_mm, to_texels: DAffine2::from_mat2(DMat2::from_cols(u, v).inverse()), is_behind: false }
    }

    /// All of the square.
    pub fn whole(texel_mm: [DVec2; 2]) -> Self {
        let half = DVec2::splat(HALF_MM);
        Self::new([-half, half], texel_mm)
    }

    /// The same of the square behind.
    pub fn behind(self) -> Self {
        Self { is_behind: true, ..self }
    }

    fn holds(&self, on_square: DVec2) -> bool {
        let [least, greatest] = self.part_mm;
        on_square.cmpge(least).all() && on_square.cmplt(greatest).all()
    }

    /// Least and greatest texel.
    fn bounds(&self) -> [DVec2; 2] {
        let [a, b] = self.part_mm;
        let corners = [a, DVec2::new(a.x, b.y), DVec2::new(b.x, a.y), b];
        let corners = corners.map(|c| self.to_texels.transform_point2(c));
        let fold = |f: fn(DVec2, DVec2) -> DVec2| corners.into_iter().reduce(f);
        [DVec2::min, DVec2::max].map(|f| fold(f).unwrap_or_default())
    }

    fn texel_mm2(&self) -> f64 {
        1.0 / self.to_texels.matrix2.determinant().abs()
    }
}

/// An atlas of islands.
pub struct Layout {
    size: [u32; 2],
    /// In the order in which they are drawn.
    islands: Vec<Island>,
}

impl Layout {
    /// Islands apart from each other, so many in a row.
    pub fn apart(columns: u32, mut islands: Vec<Island>) -> Self {
        let sizes = islands.iter().map(|i| {
            let [least, greatest] = i.bounds();
            greatest - least
        });
        let place = sizes.fold(DVec2::ZERO, DVec2::max).ceil() + 2.0 * GUTTER;
        let rows = (islands.len() as u32).div_ceil(columns);
        for (i, island) in (0..).zip(&mut islands) {
            let place = place * UVec2::new(i % columns, i / columns).as_dvec2();
            let [least, _] = island.bounds();
            island.to_texels.translation += place + GUTTER - least;
        }
        let size = place * UVec2::new(columns, rows).as_dvec2();
        Self { size: size.as_uvec2().to_array(), islands }
    }

    /// The square behind is drawn over a part of the atlas of this one.
    pub fn drawn_over(self, part_mm: [DVec2; 2]) -> Self {
        let over = |island: &Island| Island { part_mm, ..*island }.behind();
        let over: Vec<Island> = self.islands.iter().map(over).collect();
        let islands = self.islands.into_iter().chain(over).collect();
        Self { islands, ..self }
    }

    fn unwrap(&self, square: &Square) -> Unwrapped {
        let size = UVec2::from(self.size).as_dvec2();
        Unwrapped::new(self.size, |uv| {
            // The last that is drawn stays.
            self.islands.iter().rev().find_map(|island| {
                let on_square = island.to_texels.inverse().transform_point2(uv * size);
                island.holds(on_square).then(|| Texel {
                    point_mm: on_square.extend(if island.is_behind { -100.0 } else { 0.0 }),
                    irradiance: square.light(on_square, island.is_behind),
                    area_mm2: island.texel_mm2(),
                })
            })
        })
    }

    /// Where the atlas has a place of the square, if it has.
    fn uv(&self, on_square: DVec2) -> Option<DVec2> {
        let mut islands = self.islands.iter().filter(|i| !i.is_behind);
        let island = islands.find(|i| i.holds(on_square))?;
        let texel = island.to_texels.transform_point2(on_square);
        Some(texel / UVec2::from(self.size).as_dvec2())
    }
}
