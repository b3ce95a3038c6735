//! Light from all around, as a picture: what it lights, and what surfaces reflect of it.
//!
//! - R. Ramamoorthi & P. Hanrahan, *An efficient representation for irradiance environment maps*, SIGGRAPH 2001.
//! - P. Debevec, *A median cut algorithm for light probe sampling*, 2005: bright parts as lights of their own.
//! - B. Karis, *Real shading in Unreal Engine 4*, 2013: reflection prefiltered by roughness.

use std::f32::consts::{PI, TAU};
use std::io::Cursor;
use std::path::Path;

use glam::{Mat3, Vec3};
use half::f16;
use image::{DynamicImage, ImageReader};
use rayon::prelude::*;

use super::gpu::layer;
use super::lighting::Maps;
use super::{BrdfTables, Gpu, Light, Lighting, Sky, Specular};
use crate::Error;

/// Pixels that are kept: 1.4° each.
const SIZE: [u32; 2] = [256, 128];
/// The slope of the first blurred layer, each having twice that of the one before; as in lighting.wgsl.
const FIRST_SLOPE: f32 = 0.05;
const LAYERS: u32 = 5;
/// Directions that a blur sums over.
const SAMPLES: u32 = 192;
/// The most lights that are taken out of a picture.
const LIGHTS: usize = 2;
/// What is brighter than so many times the mean is of a light, within this angle of its brightest pixel.
const LIGHT_ABOVE: f32 = 8.0;
const LIGHT_DEGREES: f32 = 12.0;
/// What sums over a picture still hold in a float.
const MOST_RADIANCE: f32 = 1e30;
/// What a white surface that faces the brightest light reflects: faces are rendered about so bright.
const BRIGHTEST: f32 = 1.1;

/// A picture of the light from all around: longitudes across, from the top to the bottom; −Z is in its
/// middle, and +X to the right of it.
#[derive(Clone, Debug)]
pub struct Environment {
    /// Radiance, without what `lights` have; linear RGB.
    texels: Vec<Vec3>,
    sky: Sky,
    lights: Vec<Light>,
}

impl Environment {
    /// The built-in `studio`, or a file.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn named(name: &str) -> Result<Self, Error> {
        match name {
            "studio" => Ok(Self::studio()),
            path => Self::load(Path::new(path)),
        }
    }

    /// Reads an .hdr or .exr file, scaled to the light that faces are rendered in.
    ///
    /// # Errors
    /// A file that cannot be read, is not of all directions, or has light that is not finite or nowhere.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let bytes = std::fs::read(path).map_err(|e| {
            Error::new(path.display(), format!("\"{e}\""), "an .hdr or .exr file that can be read")
        })?;
        Self::decode(&bytes).map_err(|e| e.within(path.display()))
    }

    fn decode(bytes: &[u8]) -> Result<Self, Error> {
        let refuse = |e: &dyn std::fmt::Display| {
            Error::new("picture", format!("\"{e}\""), "a whole .hdr or .exr file, of red, green and blue")
        };
        let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| refuse(&e))?;
        let picture = reader.decode().map_err(|e| refuse(&e))?;
        if !matches!(picture, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_)) {
            let needs = "linear light in floats: .hdr or .exr";
            return Err(Error::new("picture", "eight or sixteen bits a channel", needs));
        }
        let size @ [width, height] = [picture.width(), picture.height()];
        // To a pixel, since rows and columns may be odd.
        if width == 0 || height == 0 || u64::from(width).abs_diff(2 * u64::from(height)) > 1 {
            let needs = "all directions, twice as many longitudes across as latitudes down";
            return Err(Error::new("picture", format!("{width}x{height} pixels"), needs));
        }
        let picture = picture.into_rgb32f();
        let pixels: Vec<Vec3> = picture.pixels().map(|p| Vec3::from(p.0)).collect();
        if let Some(i) =
            pixels.iter().position(|p| !(p.abs().max_element() < MOST_RADIANCE && p.is_finite()))
        {
            let got = format!("{} in column {}, row {}", pixels[i], i as u32 % width, i as u32 / width);
            return Err(Error::new("picture", got, format!("finite numbers below {MOST_RADIANCE:e}")));
        }
        Self::new(&shrunk(&pixels, size))
            .ok_or_else(|| Error::new("picture", "no light", "a pixel above 0"))
    }

    /// A studio by a formula: a warm window in front to the left, a cool one behind to the right, a ceiling and
    /// a floor.
    pub fn studio() -> Self {
        let window = |d: Vec3, towards: Vec3, degrees: f32| {
            let angle = d.dot(towards.normalize()).clamp(-1.0, 1.0).acos().to_degrees();
            1.0 - ((angle - degrees) / 1.5).clamp(0.0, 1.0)
        };
        let radiance = |d: Vec3| {
            let up = Vec3::new(0.105, 0.118, 0.145);
            let level = Vec3::new(0.075, 0.076, 0.082);
            let down = Vec3::new(0.042, 0.036, 0.032);
            let room =
                if d.y > 0.0 { level.lerp(up, d.y) } else { level.lerp(down, (-3.0 * d.y).min(1.0)) };
            let key = window(d, Vec3::new(-0.82, 0.38, 0.55), 7.0) * Vec3::new(72.0, 67.0, 61.0);
            let rim = window(d, Vec3::new(0.80, 0.30, -0.62), 6.0) * Vec3::new(31.0, 38.0, 50.0);
            room + key + rim
        };
        let texels: Vec<Vec3> = directions().map(|(d, _)| radiance(d)).collect();
        Self::new(&texels).expect("the formula is of light")
    }

    /// None where there is no light.
    fn new(texels: &[Vec3]) -> Option<Self> {
        let mut texels: Vec<Vec3> = texels.iter().map(|t| t.max(Vec3::ZERO)).collect();
        let mut lights = Vec::new();
        for _ in 0..LIGHTS {
            lights.extend(take_light(&mut texels, &lights));
        }
        let parts = directions().zip(&texels).map(|((d, solid_angle), t)| (d, *t, solid_angle));
        let mut sky = Sky::sum(parts);
        let lit = |n: Vec3| {
            let direct = lights.iter().map(|l: &Light| l.color * n.dot(l.direction).max(0.0)).sum::<Vec3>();
            luminance(direct + sky.irradiance(n))
        };
        let brightest = directions().map(|(d, _)| lit(d)).fold(0.0, f32::max);
        let scale = BRIGHTEST / brightest;
        if !scale.is_finite() {
            return None;
        }
        texels.iter_mut().for_each(|t| *t *= scale);
        lights.iter_mut().for_each(|l| l.color *= scale);
        sky.0.iter_mut().for_each(|c| *c *= scale);
        Some(Self { texels, sky, lights })
    }

    /// Has a scene lit by it, turned about y by so many radians. Nothing is allocated once there are as many
    /// lights.
    pub fn light(&self, lighting: &mut Lighting, turn: f32) {
        let rotation = Mat3::from_rotation_y(turn);
        lighting.sky = self.sky.turned(rotation);
        lighting.lights.clear();
        let turned = |light: &Light| Light { direction: rotation * light.direction, ..*light };
        lighting.lights.extend(self.lights.iter().map(turned));
        lighting.turn = Some(turn);
    }

    /// Itself on the device: blurred by slopes, and what each model reflects.
    pub(super) fn maps(&self, gpu: &Gpu) -> Maps {
        let radiance = Maps::layers(gpu, SIZE, LAYERS);
        let mut light = self.texels.clone();
        let mut before = 0.0;
        for layer in 0..LAYERS {
            // From the layer before, which leaves less to blur and no noise.
            let slope = FIRST_SLOPE * (1 << layer) as f32;
            light = blurred(&light, (slope * slope - before * before).sqrt());
            before = slope;
            let most = f16::MAX.to_f32();
            let texel = |t: &Vec3| [t.x, t.y, t.z, 1.0].map(|c| f16::from_f32(c.min(most)).to_bits());
            let texels: Vec<[u16; 4]> = light.iter().map(texel).collect();
            gpu.queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
                    ..radiance.as_image_copy()
                },
                bytemuck::cast_slice(&texels),
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(8 * SIZE[0]),
                    rows_per_image: None,
                },
                wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
            );
        }
        let reflectance = Maps::layers(gpu, BrdfTables::ALBEDO_SIZE, Specular::ALL.len() as u32);
        let tables = BrdfTables::new(gpu);
        for model in Specular::ALL {
            tables.draw_albedo(gpu, model, &layer(&reflectance, model as u32));
        }
        Maps::new(gpu, radiance, reflectance)
    }
}

/// Radiance from a direction, between the pixels around it, as the device's sampler has it.
fn radiance(texels: &[Vec3], d: Vec3) -> Vec3 {
    let [width, height] = SIZE.map(|s| s as usize);
    let x = (d.x.atan2(-d.z) / TAU + 0.5) * width as f32 + width as f32 - 0.5;
    let y = (d.y.clamp(-1.0, 1.0).acos() / PI * height as f32 - 0.5).clamp(0.0, (height - 1) as f32);
    let [left, top] = [x as usize % width, y as usize];
    let row = |y: usize| {
        let at = |x: usize| texels[y * width + x % width];
        at(left).lerp(at(left + 1), x.fract())
    };
    row(top).lerp(row((top + 1).min(height - 1)), y.fract())
}

/// What facets of a slope reflect of a picture where they are seen in the direction of the mirror.
fn blurred(texels: &[Vec3], slope: f32) -> Vec<Vec3> {
    let directions: Vec<Vec3> = directions().map(|(d, _)| d).collect();
    // Half vectors by Beckmann's distribution, each to four sides, so that it does not show how they lie.
    let halves: Vec<Vec3> = (0..SAMPLES)
        .map(|i| {
            let (i, side) = (i / 4, i % 4);
            let u = (i as f32 + 0.5) / (SAMPLES / 4) as f32;
            let phi = TAU / 4.0 * (side as f32 + i.reverse_bits() as f32 * 2f32.powi(-32));
            let tan = slope * (-(1.0 - u).ln()).sqrt();
            let cos = (1.0 + tan * tan).sqrt().recip();
            Vec3::new(tan * cos * phi.cos(), tan * cos * phi.sin(), cos)
        })
        .collect();
    let blurred = directions.par_iter().map(|n| {
        let right = n.any_orthonormal_vector();
        let up = n.cross(right);
        let (mut sum, mut mass) = (Vec3::ZERO, 0.0);
        for h in &halves {
            let h = h.x * right + h.y * up + h.z * *n;
            let l = 2.0 * n.dot(h) * h - *n;
            let cos = l.dot(*n);
            if cos > 0.0 {
                sum += cos * radiance(texels, l);
                mass += cos;
            }
        }
        sum / mass
    });
    blurred.collect()
}

/// Directions of the pixels, row by row, and the solid angle of each.
fn directions() -> impl Iterator<Item = (Vec3, f32)> {
    let [width, height] = SIZE;
    (0..width * height).map(move |i| {
        let phi = TAU * (((i % width) as f32 + 0.5) / width as f32 - 0.5);
        let theta = PI * ((i / width) as f32 + 0.5) / height as f32;
        let half = 0.5 * PI / height as f32;
        let solid_angle = TAU / width as f32 * 2.0 * theta.sin() * half.sin();
        (Vec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos()), solid_angle)
    })
}

/// Means over pixels of [`SIZE`], of pictures that are larger; the nearest pixels of others.
fn shrunk(pixels: &[Vec3], size: [u32; 2]) -> Vec<Vec3> {
    let range = |i: u32, axis: usize| {
        let at = |i: u32| (u64::from(i) * u64::from(size[axis]) / u64::from(SIZE[axis])) as u32;
        at(i)..at(i + 1).max(at(i) + 1)
    };
    let texel = |i: u32| {
        let (columns, rows) = (range(i % SIZE[0], 0), range(i / SIZE[0], 1));
        let count = columns.len() * rows.len();
        let row = |y: u32| columns.clone().map(move |x| pixels[(y * size[0] + x) as usize]).sum::<Vec3>();
        rows.map(row).sum::<Vec3>() / count as f32
    };
    (0..SIZE[0] * SIZE[1]).map(texel).collect()
}

fn luminance(light: Vec3) -> f32 {
    light.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Takes the brightest light out of a picture, if there is one that matters: one with a shadow of its own, and
/// not what others have left of themselves.
fn take_light(texels: &mut [Vec3], others: &[Light]) -> Option<Light> {
    let directions: Vec<(Vec3, f32)> = directions().collect();
    let mean =
        directions.iter().zip(&*texels).map(|((_, w), t)| w * luminance(*t)).sum::<f32>() / (4.0 * PI);
    let most = LIGHT_ABOVE * mean;
    let near = LIGHT_DEGREES.to_radians().cos();
    let is_new = |i: &usize| others.iter().all(|other| directions[*i].0.dot(other.direction) < near);
    let brightest = (0..texels.len())
        .filter(is_new)
        .max_by(|a, b| luminance(texels[*a]).total_cmp(&luminance(texels[*b])))?;
    // Around a direction: its power, where that comes from, and the picture without it.
    let take = |middle: Vec3| {
        let (mut power, mut towards) = (Vec3::ZERO, Vec3::ZERO);
        let left = directions.iter().zip(&*texels).map(|((d, solid_angle), texel)| {
            let bright = luminance(*texel);
            let share = if bright > most && d.dot(middle) > near { 1.0 - most / bright } else { 0.0 };
            let taken = share * *texel;
            power += taken * *solid_angle;
            towards += luminance(taken * *solid_angle) * *d;
            *texel - taken
        });
        let left: Vec<Vec3> = left.collect();
        (power, towards, left)
    };
    // The brightest pixel may lie at the rim.
    let mut direction = directions[brightest].0;
    for _ in 0..3 {
        direction = take(direction).1.try_normalize()?;
    }
    let (power, towards, left) = take(direction);
    // How far it is spread: a disc of radius ρ has a mean of 1 − cos of ρ²/4.
    let spread = 1.0 - towards.length() / luminance(power);
    let color = power / PI;
    // A tenth of what the rest lights by.
    if luminance(color) < 0.1 * mean {
        return None;
    }
    texels.copy_from_slice(&left);
    let radius_degrees = (4.0 * spread.max(0.0)).sqrt().to_degrees().clamp(0.3, 10.0);
    Some(Light { direction, radius_degrees, color })
}

#[cfg(test)]
mod tests {
    use image::{ImageFormat, Rgb, Rgb32FImage};
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;
    use crate::damage::{Damage, config};

    /// Irradiance/π by all pixels, lights included.
    fn lit(environment: &Environment, n: Vec3) -> Vec3 {
        let direct = environment.lights.iter().map(|l| l.color * n.dot(l.direction).max(0.0)).sum::<Vec3>();
        direct + environment.sky.irradiance(n)
    }

    #[test]
    fn a_picture_lights_as_its_pixels_do() {
        // A smooth picture has no lights in it; one with a lamp has one, where it is and as strong.
        let smooth: Vec<Vec3> = directions().map(|(d, _)| Vec3::splat(1.0 + 0.5 * d.y)).collect();
        let environment = Environment::new(&smooth).unwrap();
        assert!(environment.lights.is_empty());
        // Irradiance/π of 1 + y/2 is 1 + y/3.
        let [up, side] = [Vec3::Y, Vec3::X].map(|n| lit(&environment, n).x);
        assert!((up / side - 4.0 / 3.0).abs() < 1e-3 && (up - BRIGHTEST).abs() < 1e-3, "{up} {side}");

        let towards = Vec3::new(0.3, 0.5, -0.8).normalize();
        let lamp = |d: Vec3| if d.dot(towards) > 5f32.to_radians().cos() { 500.0 } else { 0.0 };
        let texels: Vec<Vec3> = directions().map(|(d, _)| Vec3::splat(1.0 + lamp(d))).collect();
        let environment = Environment::new(&texels).unwrap();
        let [light] = environment.lights[..] else { panic!("{:?}", environment.lights) };
        assert!(light.direction.dot(towards) > 0.5f32.to_radians().cos());
        assert!((light.radius_degrees - 5.0).abs() < 0.3, "{}", light.radius_degrees);
        // 500 sin² 5° over the room's 1.
        let [facing, away] = [towards, -towards].map(|n| lit(&environment, n).x);
        let expected = 1.0 + 500.0 * 5f32.to_radians().sin().powi(2);
        // Pixels of 1.4° make a disc of 5° up to a twentieth too large or small.
        assert!((facing / away / expected - 1.0).abs() < 0.05, "{} {expected}", facing / away);
    }

    #[test]
    fn the_studio_is_lit_from_where_the_portrait_is() {
        let studio = Environment::studio();
        let portrait = Lighting::default();
        assert_eq!(studio.lights.len(), portrait.lights.len());
        for (light, known) in studio.lights.iter().zip(&portrait.lights) {
            assert!(light.direction.dot(known.direction.normalize()) > 0.999, "{light:?} {known:?}");
            assert!((light.color / known.color - 1.0).abs().max_element() < 0.25, "{light:?} {known:?}");
        }
    }

    #[test]
    fn what_turns_by_a_whole_circle_comes_back() {
        let studio = Environment::studio();
        let mut lighting = Lighting::default();
        studio.light(&mut lighting, 0.0);
        let first = lighting.clone();
        let capacity = lighting.lights.capacity();
        for i in 1..=100 {
            studio.light(&mut lighting, i as f32 / 100.0 * TAU);
        }
        assert_eq!(capacity, lighting.lights.capacity());
        for (a, b) in lighting.lights.iter().zip(&first.lights) {
            assert!((a.direction - b.direction).abs().max_element() < 1e-5);
        }
        for n in [Vec3::X, Vec3::NEG_Z, Vec3::ONE.normalize()] {
            assert!((lighting.sky.irradiance(n) - first.sky.irradiance(n)).abs().max_element() < 1e-5);
        }
    }

    #[test]
    fn blurring_keeps_what_is_the_same_all_around() {
        let even = Environment::new(&vec![Vec3::splat(2.0); (SIZE[0] * SIZE[1]) as usize]).unwrap();
        for slope in [0.05, 0.8] {
            for texel in blurred(&even.texels, slope) {
                assert!((texel - BRIGHTEST).abs().max_element() < 1e-3, "{slope}: {texel}");
            }
        }
    }

    #[test]
    fn blurring_leaves_no_patches() {
        // What is linear in the direction stays so, since all directions are blurred alike.
        let linear: Vec<Vec3> = directions().map(|(d, _)| Vec3::new(d.x, d.y, d.z)).collect();
        for slope in [0.05, 0.1, 0.4] {
            let blurred = blurred(&linear, slope);
            let along = directions().zip(&blurred).map(|((d, _), t)| d.dot(*t)).sum::<f32>();
            let share = along / blurred.len() as f32;
            let off = |((d, _), t): ((Vec3, f32), &Vec3)| (share * d - *t).abs().max_element();
            let off = directions().zip(&blurred).map(off).fold(0.0, f32::max);
            // At the poles, across which pixels are not interpolated; the nearest pixels would leave .0023.
            assert!(off < 6e-4, "{slope}: {off}");
        }
    }

    #[test]
    fn pictures_of_any_size_are_taken() {
        for size in [[1, 1], [3, 2], [1000, 700]] {
            let pixels = vec![Vec3::ONE; (size[0] * size[1]) as usize];
            assert!(shrunk(&pixels, size).iter().all(|t| (*t - 1.0).abs().max_element() < 1e-5));
        }
        assert!(Environment::new(&vec![Vec3::ZERO; (SIZE[0] * SIZE[1]) as usize]).is_none());
    }

    fn picture(size: [u32; 2], pixel: impl Fn(u32, u32) -> f32) -> DynamicImage {
        let pixel = |x, y| Rgb([1.0, 0.5, 0.25].map(|c| c * pixel(x, y)));
        Rgb32FImage::from_fn(size[0], size[1], pixel).into()
    }

    fn encoded(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    /// As `compare --environment FILE` does it.
    fn loaded(name: &str, bytes: &[u8]) -> Result<Environment, Error> {
        let path = std::env::temp_dir().join(format!("environment-{}-{name}", std::process::id()));
        std::fs::write(&path, bytes).unwrap();
        let environment = Environment::named(path.to_str().unwrap());
        std::fs::remove_file(&path).unwrap();
        environment
    }

    #[test]
    fn a_bright_pixel_of_a_file_lights_its_side() {
        let size = [32, 16];
        for [column, row] in [[24, 7], [7, 4], [0, 11], [16, 8]] {
            let lamp = picture(size, |x, y| if [x, y] == [column, row] { 1000.0 } else { 1.0 });
            // Longitudes from behind, by the left, the front (-Z) and the right; latitudes from the top.
            let angle = |i: u32, of: u32| (i as f32 + 0.5) / of as f32;
            let (east, down) = (TAU * (angle(column, size[0]) - 0.5), PI * angle(row, size[1]));
            let towards = Vec3::new(east.sin() * down.sin(), down.cos(), -east.cos() * down.sin());
            let half = 0.5 * PI / size[1] as f32;
            let solid_angle = TAU / size[0] as f32 * 2.0 * down.sin() * half.sin();
            for (name, format) in [("lamp.hdr", ImageFormat::Hdr), ("lamp.exr", ImageFormat::OpenExr)] {
                let environment = loaded(name, &encoded(&lamp, format)).unwrap();
                let [light] = environment.lights[..] else { panic!("{:?}", environment.lights) };
                // A degree: the pixel is 11 wide, and away from the equator its middle is not its mean.
                assert!(
                    light.direction.dot(towards) > 1f32.to_radians().cos(),
                    "{name}: {light:?} {towards}"
                );
                let [facing, away] = [towards, -towards].map(|n| lit(&environment, n));
                let expected = 1.0 + 1000.0 * solid_angle / PI;
                // What the lamp leaves in the sky lights the far side, too, by nine coefficients: 2 %. Eight bits: .4 %.
                assert!(
                    (facing.x / away.x / expected - 1.0).abs() < 0.03,
                    "{} {expected}",
                    facing.x / away.x
                );
                assert!((facing / facing.x - Vec3::new(1.0, 0.5, 0.25)).abs().max_element() < 0.005);
                assert!((luminance(facing) / BRIGHTEST - 1.0).abs() < 0.01, "{facing}");
            }
        }
    }

    #[test]
    fn files_that_are_no_pictures_of_light_are_named() {
        let grey = picture([8, 4], |_, _| 1.0);
        let [hdr, exr] = [ImageFormat::Hdr, ImageFormat::OpenExr].map(|format| encoded(&grey, format));
        let odd = |x: f32| {
            let odd = picture([8, 4], |column, row| if [column, row] == [5, 2] { x } else { 1.0 });
            encoded(&odd, ImageFormat::OpenExr)
        };
        let of = |size| encoded(&picture(size, |_, _| 1.0), ImageFormat::Hdr);
        let empty = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 0 +X 0\n".to_vec();
        let huge = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 120000\n".to_vec();
        for (name, bytes, needs) in [
            ("cut.hdr", hdr[..hdr.len() - 5].to_vec(), "a whole .hdr or .exr file"),
            ("cut.exr", exr[..exr.len() - 5].to_vec(), "a whole .hdr or .exr file"),
            ("nothing.hdr", vec![], "a whole .hdr or .exr file"),
            ("words.exr", b"no picture".to_vec(), "a whole .hdr or .exr file"),
            ("huge.hdr", huge, "a whole .hdr or .exr file"),
            ("display.png", encoded(&grey.to_rgb8().into(), ImageFormat::Png), "linear light in floats"),
            ("none.hdr", empty, "all directions"),
            ("square.hdr", of([8, 8]), "all directions"),
            ("strip.hdr", of([8, 1]), "all directions"),
            ("nan.exr", odd(f32::NAN), "finite numbers"),
            ("infinite.exr", odd(f32::INFINITY), "finite numbers"),
            ("most.exr", odd(f32::MAX), "finite numbers"),
            ("black.hdr", encoded(&picture([8, 4], |_, _| 0.0), ImageFormat::Hdr), "a pixel above 0"),
            (
                "negative.exr",
                encoded(&picture([8, 4], |_, _| -1.0), ImageFormat::OpenExr),
                "a pixel above 0",
            ),
        ] {
            let error = loaded(name, &bytes).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains("got ") && error.contains(needs), "{error}");
        }
        let error = Environment::named("no-such.hdr").unwrap_err().to_string();
        assert!(error.starts_with("no-such.hdr: got"), "{error}");
    }

    proptest! {
        #![proptest_config(config(300))]

        #[test]
        fn damaged_files_are_light_or_an_error(is_hdr: bool, damage in vec(any::<Damage>(), 1..4)) {
            let format = if is_hdr { ImageFormat::Hdr } else { ImageFormat::OpenExr };
            let mut bytes = encoded(&picture([8, 4], |x, y| (x * y) as f32), format);
            damage.iter().for_each(|damage| damage.apply(&mut bytes));
            if let Ok(environment) = Environment::decode(&bytes) {
                prop_assert!(environment.texels.iter().all(|t| t.is_finite()));
            }
        }
    }
}
