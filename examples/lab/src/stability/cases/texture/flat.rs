//! A flat square of skin under a soft edge of light, laid out in an atlas one way or another.

use std::cell::OnceCell;
use std::rc::Rc;

use crate::Error;
use glam::{DAffine2, DMat2, DVec2, DVec3, UVec2, Vec3};
use subsurface::Profile;

use super::super::{Crop, Results};
use crate::stability::case::{Outcome, Run, Shown};
use crate::stability::frame::Texels;
use crate::stability::lab::Lab;
use crate::stability::unwrapped::{Texel, Unwrapped};
use crate::synthetic::{Hit, View};
use crate::truth::closed_form::{scattered_step, step};

/// Side of the square.
pub const SIDE_MM: f64 = 28.0;
pub const HALF_MM: f64 = SIDE_MM / 2.0;
/// Side of the part in the middle that is asked for: what is cut off of the widest Gaussian there
/// weighs less than .0002.
const ASKED_MM: f64 = 11.2;
/// Between an island and the border of its place, in texels: more than results are dilated by.
const GUTTER: f64 = 6.0;

/// What a method is off by, from the truth at each place.
pub type Measure = fn(&Results, &[(usize, DVec3)]) -> Vec<(&'static str, f64)>;

/// The square, and what a camera that faces it makes of it: the same for every atlas.
pub struct Square {
    size: [u32; 2],
    px_per_mm: f64,
    /// Across the edge, from dark to light.
    across: DVec2,
    /// σ of the edge.
    soft_mm: f64,
    seen: OnceCell<Seen>,
}

/// The pixels that are asked for, row by row.
struct Seen {
    side: u32,
    on_square: Vec<DVec2>,
    screen: Results,
    /// Of what the camera sees.
    visible: Vec<(usize, DVec3)>,
    /// Of a square without end.
    whole: Vec<(usize, DVec3)>,
}

impl Square {
    /// The edge's normal is at `degrees` from x.
    pub fn new(degrees: f64, soft_mm: f64, quick: bool) -> Rc<Self> {
        let (pixels, px_per_mm) = if quick { (128, 5.0) } else { (224, 8.0) };
        Rc::new(Self {
            size: [pixels; 2],
            px_per_mm,
            across: DVec2::from_angle(degrees.to_radians()),
            soft_mm,
            seen: OnceCell::new(),
        })
    }

    /// Irradiance on the square, or on the one behind it, which is lit where this one is not.
    fn light(&self, on_square: DVec2, is_behind: bool) -> f64 {
        let lit = step(on_square.dot(self.across), self.soft_mm.powi(2));
        if is_behind { 1.0 - lit } else { lit }
    }

    fn seen(&self, lab: &Lab) -> Result<&Seen, Error> {
        match self.seen.get() {
            Some(seen) => Ok(seen),
            None => {
                let seen = self.look(lab)?;
                Ok(self.seen.get_or_init(|| seen))
            }
        }
    }

    fn look(&self, lab: &Lab) -> Result<Seen, Error> {
        let g = View::orthographic(self.size, self.px_per_mm).shoot(|origin, _| {
            Some(Hit {
                point: origin.truncate().extend(-300.0),
                normal: DVec3::Z,
                irradiance: DVec3::splat(self.light(origin.truncate(), false)),
                id: 1,
            })
        });
        let side = (ASKED_MM * self.px_per_mm) as u32;
        let crop = Crop {
            first: self.size.map(|s| (s - side) / 2),
            size: [side; 2],
        };
        let asked = crop.pixels(self.size[0]);
        let frame = Texels::of(&g, DVec3::ZERO).upload(&lab.gpu);
        let screen = lab.scatter(&frame.inputs(), &frame.output)?.into_iter();
        let cut = |pixels: Vec<Vec3>| asked.iter().map(|i| pixels[*i]).collect();
        let on_square: Vec<DVec2> = asked
            .iter()
            .filter_map(|i| g.hits[*i].map(|h| h.point.truncate()))
            .collect();
        let visible = g.visible_integral(&asked, &Profile::SKIN);
        let whole = on_square
            .iter()
            .map(|p| scattered_step(p.dot(self.across), self.soft_mm.powi(2), &Profile::SKIN));
        Ok(Seen {
            side,
            screen: screen.map(|(m, pixels)| (m, cut(pixels))).collect(),
            visible: visible.into_iter().enumerate().collect(),
            whole: whole.enumerate().collect(),
            on_square,
        })
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
        Self {
            part_mm,
            to_texels: DAffine2::from_mat2(DMat2::from_cols(u, v).inverse()),
            is_behind: false,
        }
    }

    /// All of the square.
    pub fn whole(texel_mm: [DVec2; 2]) -> Self {
        let half = DVec2::splat(HALF_MM);
        Self::new([-half, half], texel_mm)
    }

    /// The same of the square behind.
    pub fn behind(self) -> Self {
        Self {
            is_behind: true,
            ..self
        }
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
        Self {
            size: size.as_uvec2().to_array(),
            islands,
        }
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
                    irradiance: DVec3::splat(square.light(on_square, island.is_behind)),
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

/// Every method on a square; in texture space laid out like this, and held to the square without end.
pub fn run(square: &Rc<Square>, layout: Layout, measure: Measure) -> Run {
    let square = square.clone();
    Box::new(move |lab| {
        let seen = square.seen(lab)?;
        let uvs: Vec<(usize, DVec2)> = seen
            .on_square
            .iter()
            .enumerate()
            .filter_map(|(i, p)| layout.uv(*p).map(|uv| (i, uv)))
            .collect();
        let in_atlas: Vec<DVec2> = uvs.iter().map(|(_, uv)| *uv).collect();
        let texture = layout.unwrap(&square).scatter(lab, &in_atlas)?;
        let whole = uvs.iter().map(|(i, _)| seen.whole[*i].1);
        let whole: Vec<_> = whole.enumerate().collect();
        let mut figures = measure(&seen.screen, &seen.visible);
        figures.extend(measure(&texture, &whole));
        // The middle half is enough to see.
        let side = seen.side as usize;
        let middle = |values: &[Vec3]| values[side / 4 * side..3 * side / 4 * side].to_vec();
        let is_whole = uvs.len() == seen.on_square.len();
        let results = seen.screen.iter().chain(&texture);
        let truth: Vec<Vec3> = seen.whole.iter().map(|(_, t)| t.as_vec3()).collect();
        let shown = is_whole.then(|| Shown {
            size: [seen.side, 3 * seen.side / 4 - seen.side / 4],
            truth: middle(&truth),
            results: results.map(|(m, values)| (*m, middle(values))).collect(),
        });
        Ok(Outcome { figures, shown })
    })
}
