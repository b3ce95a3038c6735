//! How far a method's result is from the truths of a scene.

use glam::Vec3;
use image::{Rgb, RgbImage};

use crate::chart::row::Row;
use crate::chart::scene::Scene;
use crate::chart::truths::Truths;
use crate::metrics::{self, Layer};

/// How much error maps are amplified.
pub const GAIN: f32 = 10.0;

/// What results are held to, at the pixels that the truth was asked for.
pub struct Score<'a> {
    truths: &'a Truths,
    size: [u32; 2],
    albedo: Vec<Vec3>,
    /// Light as it fell, which pictures show where nothing is compared.
    fallen: Vec<Vec3>,
    /// Skin, without the rim of a pixel, whose light is as much the background's.
    inner: Vec<bool>,
    area_mm2: Vec<f64>,
}

/// Which truth a method's colours are compared with: that which it could know.
#[derive(Clone, Copy, PartialEq)]
pub enum Knows {
    Frame,
    /// The frame, and the layer behind.
    Back,
    Mesh,
}

impl<'a> Score<'a> {
    /// `fallen` is the scene's irradiance, at the pixels that were asked for.
    pub fn new(scene: &Scene, truths: &'a Truths, fallen: Vec<Vec3>) -> Self {
        let [width, height] = scene.size;
        let inner = metrics::erode(&scene.skin, width, height, 1);
        let mut pixels = scene.pixels.iter();
        let area = |skin: &bool| {
            let pixel = skin.then(|| pixels.next()).flatten();
            pixel.map_or(0.0, |p| p.patch.area_mm2.into())
        };
        let area_mm2: Vec<f64> = scene.skin.iter().map(area).collect();
        Self {
            truths,
            size: scene.asked_size(),
            albedo: scene.asked(&scene.albedo),
            fallen,
            inner: scene.asked(&inner),
            area_mm2: scene.asked(&area_mm2),
        }
    }

    fn layer(&self, values: impl Iterator<Item = Vec3>) -> Layer {
        Layer { width: self.size[0], height: self.size[1], pixels: values.map(|v| v.to_array()).collect() }
    }

    fn lit(&self, values: &[Vec3]) -> Layer {
        self.layer(values.iter().zip(&self.albedo).map(|(e, a)| e * a))
    }

    pub fn truth(&self, knows: Knows) -> &[Vec3] {
        match knows {
            Knows::Frame => &self.truths.visible,
            Knows::Back | Knows::Mesh => &self.truths.normalised,
        }
    }

    /// Fills in a row's errors; `result` is of the pixels that were asked for.
    pub fn fill(&self, row: &mut Row, result: &[Vec3], knows: Knows) {
        let plain = |values: &[Vec3]| self.layer(values.iter().copied());
        let a = plain(result);
        let mask = &self.inner;
        if knows == Knows::Frame {
            let visible = plain(&self.truths.visible);
            row.rel_rmse_visible = metrics::relative_rmse(&a, &visible, mask);
            row.max_error_visible = metrics::max_error(&a, &visible, mask);
        }
        let printed = plain(&self.truths.printed);
        row.rel_rmse_eq7 = metrics::relative_rmse(&a, &printed, mask);
        row.max_error_eq7 = metrics::max_error(&a, &printed, mask);
        let normalised = plain(&self.truths.normalised);
        row.rel_rmse_eq7_normalised = metrics::relative_rmse(&a, &normalised, mask);

        let truth = self.truth(knows);
        row.delta_e2000_p99 =
            metrics::delta_e2000_percentile(&self.lit(result), &self.lit(truth), mask, 0.99);
        row.flip_mean = metrics::flip_mean(&self.picture(result), &self.picture(truth), mask).0;
        let energy = |values: &[Vec3]| -> f64 {
            let pixels = values.iter().zip(&self.area_mm2).zip(mask);
            let inner = pixels.filter(|(_, inner)| **inner);
            inner.map(|((e, area), _)| f64::from(e.element_sum()) * area).sum()
        };
        row.energy_ratio = Some(energy(result) / energy(truth)).filter(|r| r.is_finite());
    }

    /// How far the two truths are apart, which no method in screen space is spared: relative RMSE of
    /// the visible integral against Eq. 7 as printed, and normalised.
    pub fn visibility_error(&self) -> [Option<f64>; 2] {
        let plain = |values: &[Vec3]| self.layer(values.iter().copied());
        let visible = plain(&self.truths.visible);
        [&self.truths.printed, &self.truths.normalised]
            .map(|eq7| metrics::relative_rmse(&visible, &plain(eq7), &self.inner))
    }

    /// Light times albedo, as sRGB; brighter than white is white. All pictures are the same where
    /// nothing is compared, so that FLIP does not see it.
    pub fn picture(&self, values: &[Vec3]) -> RgbImage {
        let pixels = values.iter().zip(&self.fallen).zip(&self.inner);
        let shown: Vec<Vec3> = pixels.map(|((v, e), inner)| if *inner { *v } else { *e }).collect();
        let lit = self.lit(&shown);
        RgbImage::from_fn(lit.width, lit.height, |x, y| {
            let pixel = lit.pixels[(y * lit.width + x) as usize];
            Rgb(pixel.map(crate::srgb::encode))
        })
    }

    /// The difference to the truth, amplified by [`GAIN`].
    pub fn error_map(&self, result: &[Vec3], knows: Knows) -> RgbImage {
        let masked = |values: &[Vec3]| {
            let pairs = values.iter().zip(&self.inner);
            self.layer(pairs.map(|(v, inner)| if *inner { *v } else { Vec3::ZERO }))
        };
        metrics::difference(&masked(result), &masked(self.truth(knows)), GAIN)
    }
}
