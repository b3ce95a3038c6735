//! A head of several skins, side by side.

use glam::Vec3;
use image::RgbImage;
use image::imageops::overlay;
use subsurface::DEFAULT_MAX_ERROR;

use super::{Description, plan_near};
use crate::method::{self, Ours};
use crate::renderer::{Camera, Gpu, Layer, Lighting, Renderer, Scene, View};
use crate::{Error, HEAD, srgb};

/// What is drawn: by physics, and what stood for skin before.
const SKINS: [&str; 4] = ["skin", "light", "medium", "dark"];
/// Pixels that each is drawn with, each way; twice as many as are shown.
const SIZE: u32 = 1024;

/// The built-in head of each, by a plan, from left to right.
///
/// # Errors
/// What the effect or the device refuses.
pub fn picture(gpu: &Gpu) -> Result<RgbImage, Error> {
    let mut picture = RgbImage::new(SKINS.len() as u32 * SIZE / 2, SIZE / 2);
    for (name, left) in SKINS.into_iter().zip((0..).step_by(SIZE as usize / 2)) {
        let material = Description::load(name)?;
        let mut scene = Scene::from_glb(HEAD)?;
        if let Some(albedo) = material.albedo {
            scene.color_skin(Vec3::from(albedo.map(|a| a as f32)));
        }
        let size = [SIZE; 2];
        let renderer = Renderer::new(gpu, &scene, size)?;
        let camera = Camera::framing(&scene, View::Front, size);
        renderer.render(gpu, &camera, &Lighting::default(), 1000.0)?;
        let plan = plan_near(material.profile(None, DEFAULT_MAX_ERROR)?, DEFAULT_MAX_ERROR)?;
        let output = renderer.scattered_target(gpu);
        let mut ours = Ours::new(&gpu.device, output.texture().format(), &plan)?;
        let frame = renderer.gbuffer.frame(camera.projection(size), 1000.0);
        method::scatter(gpu, &mut ours, &frame, &output)?;
        let pixels = renderer.compose(gpu, &output, Layer::Picture, 1.0);
        let head = RgbImage::from_raw(SIZE, SIZE, pixels.into_flattened());
        let head = head.ok_or_else(|| Error::new("head", "another size", "a picture of its size"))?;
        overlay(&mut picture, &srgb::halved(&head), left, 0);
    }
    Ok(picture)
}
