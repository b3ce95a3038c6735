//! One frame by every method, each held to what it can know.

use crate::Error;
use glam::{DVec2, DVec3};
use subsurface::Profile;

use super::scene::Scene;
use crate::stability::case::Outcome;
use crate::stability::cases::{Crop, larger, worst};
use crate::stability::frame::Texels;
use crate::stability::lab::Lab;
use crate::synthetic::{GBuffer, Hit, View};

/// What a method is held to.
pub enum Truth<'a> {
    /// Eq. 7 over what the camera sees.
    Visible,
    /// Eq. 7 over the surfaces whole, as the atlas holds them.
    Whole,
    /// Eq. 7 on paper, by what a pixel sees.
    Paper(&'a dyn Fn(&Hit) -> DVec3),
}

pub struct Trial<'a> {
    pub scene: Scene,
    pub view: View,
    /// Light where there is no surface.
    pub background: f64,
    /// Where pixels are asked for, and what a picture shows.
    pub crop: Crop,
    /// Of which pixels; those beside another surface, or beside none, are never asked for.
    pub asked: &'a dyn Fn(&Hit) -> bool,
    /// For the methods in screen space.
    pub screen: Truth<'a>,
    /// For those in texture space: texels of each island, and what they are held to.
    pub texture: Option<([u32; 2], Truth<'a>)>,
}

impl Trial<'_> {
    /// The largest difference of each method.
    ///
    /// # Errors
    /// A frame that a method refuses.
    pub fn run(&self, lab: &Lab) -> Result<Outcome, Error> {
        let width = self.view.size[0];
        let g = self.scene.shoot(&self.view);
        let frame = Texels::of(&g, DVec3::splat(self.background)).upload(&lab.gpu);
        let mut results = lab.scatter(&frame.inputs(), &frame.output)?;
        let asked: Vec<(usize, usize, Hit)> = self
            .crop
            .pixels(width)
            .into_iter()
            .filter_map(|pixel| self.surface_at(pixel).map(|s| (pixel, s)))
            .filter_map(|(pixel, surface)| g.hits[pixel].map(|hit| (pixel, surface, hit)))
            .filter(|(_, _, hit)| (self.asked)(hit))
            .collect();
        let truth = self.truth(&self.screen, &g, &asked);
        let mut figures = worst(&results, &truth);
        if let Some((texels, held_to)) = &self.texture {
            let uvs: Vec<DVec2> = asked
                .iter()
                .map(|(_, surface, hit)| self.scene.uv(*surface, hit.point))
                .collect();
            let textured = self.scene.unwrap(*texels).scatter(lab, &uvs)?;
            let place = |values: Vec<_>| {
                let mut all = results[0].1.clone();
                for ((pixel, _, _), value) in asked.iter().zip(values) {
                    all[*pixel] = value;
                }
                all
            };
            let textured: Vec<_> = textured.into_iter().map(|(m, r)| (m, place(r))).collect();
            let whole = self.truth(held_to, &g, &asked);
            figures.extend(worst(&textured, &whole));
            // Under a picture of errors there is one truth.
            if whole == truth {
                results.extend(textured);
            }
        }
        Ok(Outcome {
            shown: Some(self.crop.show(width, &results, &truth)),
            figures,
        })
    }

    /// The surface that a pixel and all around it show.
    fn surface_at(&self, pixel: usize) -> Option<usize> {
        let [width, height] = self.view.size.map(|s| s as usize);
        let around = |i: usize, end: usize| i.saturating_sub(1)..=(i + 1).min(end - 1);
        let (x, y) = (pixel % width, pixel / width);
        let mut seen = around(y, height)
            .flat_map(|y| around(x, width).map(move |x| DVec2::new(x as f64, y as f64) + 0.5))
            .map(|at| {
                let (origin, ray) = self.view.ray(at);
                self.scene.hit(origin, ray).map(|(surface, _)| surface)
            });
        let first = seen.next().flatten()?;
        seen.all(|surface| surface == Some(first)).then_some(first)
    }

    fn truth(
        &self,
        held_to: &Truth,
        g: &GBuffer,
        asked: &[(usize, usize, Hit)],
    ) -> Vec<(usize, DVec3)> {
        let pixels = asked.iter().map(|(pixel, _, _)| *pixel);
        let truth = match held_to {
            Truth::Visible => {
                g.visible_integral(&pixels.clone().collect::<Vec<_>>(), &Profile::SKIN)
            }
            Truth::Whole => {
                let points: Vec<_> = asked
                    .iter()
                    .map(|(_, _, h)| (h.point, h.irradiance))
                    .collect();
                let texels = self.texture.as_ref().map_or([1; 2], |(texels, _)| *texels);
                self.scene.unwrap(texels).truth(&points)
            }
            Truth::Paper(paper) => asked.iter().map(|(_, _, hit)| paper(hit)).collect(),
        };
        pixels.zip(truth).collect()
    }
}

/// The worst of several frames, with the picture of the first.
pub fn worst_of(
    outcomes: impl IntoIterator<Item = Result<Outcome, Error>>,
) -> Result<Outcome, Error> {
    let mut worst = Outcome::default();
    for outcome in outcomes {
        let outcome = outcome?;
        for (method, figure) in outcome.figures {
            match worst.figures.iter_mut().find(|(m, _)| *m == method) {
                Some((_, most)) => *most = larger(*most, figure),
                None => worst.figures.push((method, figure)),
            }
        }
        worst.shown = worst.shown.or(outcome.shown);
    }
    Ok(worst)
}

/// The middle of a frame.
pub fn middle(view: &View, size: [u32; 2]) -> Crop {
    let first = [0, 1].map(|k| (view.size[k] - size[k]) / 2);
    Crop { first, size }
}
