//! One frame by every method, each held to what it can know.

use glam::{DVec2, DVec3, Vec3};
use subsurface::Profile;

use crate::Error;
use crate::stability::case::{Figures, Outcome, Results, Shown};
use crate::stability::inputs::Texels;
use crate::stability::lab::Lab;
use crate::stability::scene::Scene;
use crate::stability::unwrapped::Unwrapped;
use crate::synthetic::{GBuffer, Hit, View, larger, largest};

/// What a method is held to.
#[derive(Clone, Copy)]
pub enum Truth {
    /// Eq. 7 over what the camera sees.
    Visible,
    /// Eq. 7 over that and the layer behind it.
    Layers,
    /// Eq. 7 over the surfaces whole, as the atlas holds them.
    Whole,
    /// Eq. 7 in closed form.
    Closed,
}

/// Pixels and what is true there.
pub type Known = Vec<(usize, DVec3)>;

pub struct Trial {
    pub scene: Scene,
    pub view: View,
    /// Light where there is no surface.
    background: f64,
    /// Whether the methods that know what to do with it are handed the layer behind what is seen.
    has_back: bool,
    /// Where pixels are asked for, and what a picture shows.
    crop: Crop,
    /// Of which pixels; those beside another surface, or beside none, are never asked for.
    asked: Box<dyn Fn(&Hit) -> bool>,
    /// For the methods in screen space.
    truth: Truth,
    /// For those in texture space: texels of each island, and what they are held to.
    atlas: Option<([u32; 2], Truth)>,
}

/// A frame, scattered by the methods in screen space.
pub struct Look {
    g: GBuffer,
    back: Option<GBuffer>,
    crop: Crop,
    results: Results,
    /// Pixels that are asked for, the surface that each shows, and what of it.
    pixels: Vec<(usize, usize, Hit)>,
    truth: Known,
}

impl Trial {
    /// All pixels of `crop`, before nothing, in screen space alone.
    pub fn new(scene: Scene, view: View, crop: Crop, truth: Truth) -> Self {
        let asked = Box::new(|_: &Hit| true);
        Self { scene, view, background: 0.0, has_back: false, crop, asked, truth, atlas: None }
    }

    /// With the layer behind what is seen.
    pub fn with_back(self) -> Self {
        Self { has_back: true, ..self }
    }

    pub fn before(self, background: f64) -> Self {
        Self { background, ..self }
    }

    pub fn only_where(self, asked: impl Fn(&Hit) -> bool + 'static) -> Self {
        Self { asked: Box::new(asked), ..self }
    }

    pub fn atlas(self, texels: [u32; 2], truth: Truth) -> Self {
        Self { atlas: Some((texels, truth)), ..self }
    }

    /// The largest difference of each method.
    ///
    /// # Errors
    /// Inputs that a method refuses.
    pub fn run(&self, lab: &Lab) -> Result<Outcome, Error> {
        let look = self.look(lab)?;
        let Some((texels, truth)) = self.atlas else {
            return Ok(look.outcome(worst));
        };
        let atlas = self.scene.unwrap(texels);
        let truth = look.held_to(truth, &self.scene, Some(&atlas));
        let uv = |surface, point| Some(self.scene.uv(surface, point));
        look.textured(lab, &atlas, uv, &truth, worst)
    }

    /// # Errors
    /// A frame that a method refuses.
    pub fn look(&self, lab: &Lab) -> Result<Look, Error> {
        let g = self.scene.shoot(&self.view);
        let back = self.has_back.then(|| self.scene.shoot_back(&self.view));
        let texels = Texels::of(&g, self.background);
        let texels = match &back {
            Some(back) => texels.before(back),
            None => texels,
        };
        let frame = texels.upload(&lab.gpu);
        let pixels = self.crop.pixels(self.view.size[0]).into_iter();
        let pixels = pixels.filter_map(|pixel| {
            let surface = self.surface_at(pixel)?;
            let hit = g.hits[pixel].filter(|hit| (self.asked)(hit))?;
            Some((pixel, surface, hit))
        });
        let mut look = Look {
            pixels: pixels.collect(),
            crop: self.crop,
            results: lab.scatter(&frame.frame(), &frame.output)?,
            truth: vec![],
            g,
            back,
        };
        look.truth = look.held_to(self.truth, &self.scene, None);
        Ok(look)
    }

    /// The surface that a pixel and all around it show.
    fn surface_at(&self, pixel: usize) -> Option<usize> {
        let [width, height] = self.view.size.map(|s| s as usize);
        let around = |i: usize, end: usize| i.saturating_sub(1)..=(i + 1).min(end - 1);
        let (x, y) = (pixel % width, pixel / width);
        let places = around(y, height).flat_map(|y| around(x, width).map(move |x| [x, y]));
        let mut seen = places.map(|[x, y]| {
            let at = DVec2::new(x as f64, y as f64) + 0.5;
            let (origin, ray) = self.view.ray(at);
            self.scene.hit(origin, ray).map(|(surface, _)| surface)
        });
        let first = seen.next().flatten()?;
        seen.all(|surface| surface == Some(first)).then_some(first)
    }
}

impl Look {
    /// In screen space alone.
    pub fn outcome(&self, measure: Measure) -> Outcome {
        Outcome { figures: measure(&self.results, &self.truth), shown: Some(self.show(&self.results)) }
    }

    /// With the methods in texture space over an atlas; places that it does not have are not asked for. The
    /// picture shows them where both truths are the same for an eye.
    ///
    /// # Errors
    /// An atlas that a method refuses.
    pub fn textured(
        &self,
        lab: &Lab,
        atlas: &Unwrapped,
        uv: impl Fn(usize, DVec3) -> Option<DVec2>,
        truth: &Known,
        measure: Measure,
    ) -> Result<Outcome, Error> {
        let places = self.pixels.iter().zip(truth);
        let places = places.filter_map(|((_, surface, hit), t)| Some((*t, uv(*surface, hit.point)?)));
        let (truth, uvs): (Known, Vec<DVec2>) = places.unzip();
        let place = |values: Vec<Vec3>| {
            let mut all = self.results[0].1.clone();
            for ((pixel, _), value) in truth.iter().zip(values) {
                all[*pixel] = value;
            }
            all
        };
        let results = atlas.scatter(lab, &uvs)?.into_iter();
        let results: Results = results.map(|(m, values)| (m, place(values))).collect();
        let mut outcome = self.outcome(measure);
        outcome.figures.extend(measure(&results, &truth));
        let is_same = |(a, b): (&(usize, DVec3), &(usize, DVec3))| {
            a.0 == b.0 && (a.1 - b.1).abs().max_element() <= 0.002
        };
        if truth.len() == self.truth.len() && truth.iter().zip(&self.truth).all(is_same) {
            let all: Results = self.results.iter().cloned().chain(results).collect();
            outcome.shown = Some(self.show(&all));
        }
        Ok(outcome)
    }

    fn show(&self, results: &Results) -> Shown {
        self.crop.show(self.g.view.size[0], results, &self.truth)
    }

    /// What is true of the pixels that are asked for.
    pub fn held_to(&self, truth: Truth, scene: &Scene, atlas: Option<&Unwrapped>) -> Known {
        let pixels = self.pixels.iter().map(|(pixel, ..)| *pixel);
        let truth = match truth {
            Truth::Visible | Truth::Layers => {
                let pixels: Vec<usize> = pixels.clone().collect();
                let back = self.back.as_ref().filter(|_| matches!(truth, Truth::Layers));
                self.g.integral_over(back, &pixels, &Profile::SKIN)
            }
            Truth::Whole => {
                let points = self.pixels.iter().map(|(.., h)| (h.point, h.irradiance));
                atlas.map_or(vec![], |atlas| atlas.truth(&points.collect::<Vec<_>>()))
            }
            Truth::Closed => {
                let places = self.pixels.iter().map(|(_, i, h)| scene.scattered(*i, h.point));
                places.collect()
            }
        };
        pixels.zip(truth).collect()
    }
}

/// A rectangle of a frame: first column and row, columns and rows.
#[derive(Clone, Copy)]
pub struct Crop {
    pub first: [u32; 2],
    pub size: [u32; 2],
}

impl Crop {
    /// The middle of a frame.
    pub fn middle(view: &View, size: [u32; 2]) -> Self {
        let first = [0, 1].map(|k| (view.size[k] - size[k]) / 2);
        Self { first, size }
    }

    /// Its pixels in a frame that is `width` wide, row by row.
    pub fn pixels(self, width: u32) -> Vec<usize> {
        let [x, y] = self.first;
        let rows = y..y + self.size[1];
        let row = |y| (x..x + self.size[0]).map(move |x| (y * width + x) as usize);
        rows.flat_map(row).collect()
    }

    /// What a picture shows of it; light that no truth is known of is black there.
    pub fn show(self, width: u32, results: &Results, truth: &Known) -> Shown {
        let pixels = self.pixels(width);
        let known = |i: &usize| {
            let place = truth.binary_search_by_key(i, |(j, _)| *j).ok();
            place.map(|p| truth[p].1.as_vec3())
        };
        let known: Vec<Option<Vec3>> = pixels.iter().map(known).collect();
        let cut = |values: &[Vec3]| {
            let pairs = pixels.iter().zip(&known);
            pairs.map(|(i, t)| t.map_or(Vec3::ZERO, |_| values[*i])).collect()
        };
        Shown {
            size: self.size,
            truth: known.iter().map(|t| t.unwrap_or_default()).collect(),
            results: results.iter().map(|(m, r)| (*m, cut(r))).collect(),
        }
    }
}

/// How far results are from the truth.
pub type Measure = fn(&Results, &Known) -> Figures;

/// The largest difference in any channel; NaN where a difference is.
pub fn worst(results: &Results, truth: &Known) -> Figures {
    assert!(!truth.is_empty(), "a case asks for some pixels");
    let of = |pixels: &[Vec3]| {
        let differences = truth.iter().map(|(i, t)| pixels[*i].as_dvec3() - t);
        largest(differences.flat_map(|d| d.abs().to_array()))
    };
    results.iter().map(|(name, r)| (*name, of(r))).collect()
}

/// The root mean square of differences over that of the truth, all channels together.
pub fn relative_rms(results: &Results, truth: &Known) -> Figures {
    let whole: f64 = truth.iter().map(|(_, t)| t.length_squared()).sum();
    let of = |values: &[Vec3]| {
        let differences = truth.iter().map(|(i, t)| t.distance_squared(values[*i].as_dvec3()));
        (differences.sum::<f64>() / whole).sqrt()
    };
    results.iter().map(|(name, r)| (*name, of(r))).collect()
}

/// Each method's largest difference between two results of its own.
pub fn apart(a: &Results, b: &Results, pixels: &[usize]) -> Figures {
    let pairs = a.iter().zip(b);
    let figures = pairs.flat_map(|(a, (_, b))| {
        let other = pixels.iter().map(|i| (*i, b[*i].as_dvec3())).collect();
        worst(&vec![a.clone()], &other)
    });
    figures.collect()
}

/// Each method's largest figure.
pub fn merge(into: &mut Figures, figures: impl IntoIterator<Item = (&'static str, f64)>) {
    for (method, figure) in figures {
        match into.iter_mut().find(|(m, _)| *m == method) {
            Some((_, most)) => *most = larger(*most, figure),
            None => into.push((method, figure)),
        }
    }
}

/// The worst of several frames, with the picture of the first.
///
/// # Errors
/// The first that failed.
pub fn worst_of(outcomes: impl IntoIterator<Item = Result<Outcome, Error>>) -> Result<Outcome, Error> {
    let mut worst = Outcome::default();
    for outcome in outcomes {
        let outcome = outcome?;
        merge(&mut worst.figures, outcome.figures);
        worst.shown = worst.shown.or(outcome.shown);
    }
    Ok(worst)
}
