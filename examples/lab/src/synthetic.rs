//! One device and synthetic G-buffers with exact points and areas: the effect
//! and the truth over them. What the tests and the failure atlas share.

use std::sync::OnceLock;

use glam::{DMat3, DMat4, DVec2, DVec3, DVec4};
use subsurface::wgpu::{TextureFormat, TextureView};
use subsurface::{Atlas, BackLayer, Frame, Plan, Profile};

use crate::method::{self, AtlasMethod, Ours, ScreenMethod};

use crate::renderer::Gpu;
use crate::truth::{self, Patch, Pixel};

/// The device of this test binary. Without an adapter the test fails and says what to do.
pub fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| Gpu::headless().unwrap_or_else(|error| panic!("{error}")))
}

/// The effect by a plan, on that device.
pub fn ours(plan: &Plan, format: TextureFormat) -> Ours {
    Ours::new(&gpu().device, format, plan).expect("a device for the effect")
}

pub fn single_gaussian(variance_mm2: f32) -> Profile {
    Profile::new(&[subsurface::Gaussian { variance_mm2, weight: [1.0; 3] }]).unwrap()
}

/// A point of a surface seen by a pixel, in view space and mm.
#[derive(Clone, Copy)]
pub struct Hit {
    pub point: DVec3,
    pub normal: DVec3,
    pub irradiance: DVec3,
    pub id: u32,
}

/// A camera: size in pixels and a projection of view space in mm.
#[derive(Clone, Copy)]
pub struct View {
    pub size: [u32; 2],
    pub projection: DMat4,
}

impl View {
    /// Orthographic, looking down −Z from 200 mm, `px_per_mm` on both axes.
    pub fn orthographic(size: [u32; 2], px_per_mm: f64) -> Self {
        let half = DVec2::new(size[0].into(), size[1].into()) / px_per_mm / 2.0;
        Self {
            size,
            projection: DMat4::from_cols(
                DVec4::new(1.0 / half.x, 0.0, 0.0, 0.0),
                DVec4::new(0.0, 1.0 / half.y, 0.0, 0.0),
                DVec4::new(0.0, 0.0, -1.0 / 1000.0, 0.0),
                DVec4::new(0.0, 0.0, 0.0, 1.0),
            ),
        }
    }

    /// Perspective with the given vertical field of view and an infinite, reversed depth whose
    /// near plane is at 10 mm.
    pub fn perspective(size: [u32; 2], fov_y_degrees: f64) -> Self {
        let f = 1.0 / (fov_y_degrees.to_radians() / 2.0).tan();
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        Self {
            size,
            projection: DMat4::from_cols(
                DVec4::new(f / aspect, 0.0, 0.0, 0.0),
                DVec4::new(0.0, f, 0.0, 0.0),
                DVec4::new(0.0, 0.0, 0.0, -1.0),
                DVec4::new(0.0, 0.0, 10.0, 0.0),
            ),
        }
    }

    /// Origin and direction (with z = −1) of the ray through a place in the picture.
    pub fn ray(&self, pixel: DVec2) -> (DVec3, DVec3) {
        let size = DVec2::new(self.size[0].into(), self.size[1].into());
        let ndc = DVec2::new(pixel.x / size.x, 1.0 - pixel.y / size.y) * 2.0 - 1.0;
        // x at clip: (P₀₀ x + P₀₂ z + P₀₃) / (P₃₂ z + P₃₃) = ndc, linear in z.
        let at = |z: f64| {
            let p = self.projection;
            let w = p.z_axis.w * z + p.w_axis.w;
            DVec3::new(
                (ndc.x * w - p.z_axis.x * z - p.w_axis.x) / p.x_axis.x,
                (ndc.y * w - p.z_axis.y * z - p.w_axis.y) / p.y_axis.y,
                z,
            )
        };
        (at(0.0), at(-1.0) - at(0.0))
    }

    /// The G-buffer of what `hit` finds along each ray.
    pub fn shoot(&self, hit: impl Fn(DVec3, DVec3) -> Option<Hit>) -> GBuffer {
        let mut hits = Vec::new();
        let mut steps = Vec::new();
        let mut pixels_mm2 = Vec::new();
        for y in 0..self.size[1] {
            for x in 0..self.size[0] {
                let at = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let (origin, ray) = self.ray(at);
                let found = hit(origin, ray);
                steps.push(found.map_or([DVec3::ZERO; 2], |h| {
                    // Between the pixel's sides on the tangent plane.
                    let on_plane = |dx: f64, dy: f64| {
                        let (o, d) = self.ray(at + DVec2::new(dx, dy));
                        o + d * ((h.point - o).dot(h.normal) / d.dot(h.normal))
                    };
                    [on_plane(0.5, 0.0) - on_plane(-0.5, 0.0), on_plane(0.0, 0.5) - on_plane(0.0, -0.5)]
                }));
                pixels_mm2.push(found.map_or(0.0, |h| {
                    let facing = |dx: f64, dy: f64| {
                        let (o, d) = self.ray(at + DVec2::new(dx, dy));
                        o - d * h.point.z
                    };
                    let du = facing(0.5, 0.0) - facing(-0.5, 0.0);
                    let dv = facing(0.0, 0.5) - facing(0.0, -0.5);
                    du.cross(dv).length()
                }));
                hits.push(found);
            }
        }
        GBuffer { view: *self, hits, steps, pixels_mm2 }
    }
}

/// Per pixel what is seen, the steps in mm on its tangent plane to the next in the row and in the column, and
/// its area in mm² were it to face the camera.
#[derive(Clone)]
pub struct GBuffer {
    pub view: View,
    pub hits: Vec<Option<Hit>>,
    pub steps: Vec<[DVec3; 2]>,
    pub pixels_mm2: Vec<f64>,
}

impl GBuffer {
    /// The effect on the device, with full floats in and out.
    pub fn scatter(&self, profile: &Profile) -> Vec<DVec3> {
        let out = self.scatter_all(std::slice::from_ref(profile), TextureFormat::Rgba32Float);
        out.into_iter().map(rgb).collect()
    }

    pub fn scatter_all(&self, profiles: &[Profile], format: TextureFormat) -> Vec<[f32; 4]> {
        let plan = Plan::exact(profiles).expect("a plan of these profiles");
        self.scatter_by(&mut ours(&plan, format), |_| ())
    }

    /// The effect by a plan, with full floats in and out.
    pub fn scatter_planned(&self, plan: &Plan) -> Vec<[f32; 4]> {
        self.scatter_by(&mut ours(plan, TextureFormat::Rgba32Float), |_| ())
    }

    /// What an effect makes of the frame, after `change`.
    pub fn scatter_by(&self, ours: &mut Ours, change: impl FnOnce(&mut Frame)) -> Vec<[f32; 4]> {
        self.scatter_over(None, ours, change)
    }

    /// The same with a layer behind it.
    pub fn scatter_over(
        &self,
        back: Option<&Self>,
        ours: &mut Ours,
        change: impl FnOnce(&mut Frame),
    ) -> Vec<[f32; 4]> {
        let format = ours.effect.output().format();
        self.scatter_as(back, ours, format, change)
    }

    /// What any method makes of the frame.
    pub fn scatter_to(&self, method: &mut dyn ScreenMethod, format: TextureFormat) -> Vec<[f32; 4]> {
        self.scatter_as(None, method, format, |_| ())
    }

    fn scatter_as(
        &self,
        back: Option<&Self>,
        method: &mut dyn ScreenMethod,
        format: TextureFormat,
        change: impl FnOnce(&mut Frame),
    ) -> Vec<[f32; 4]> {
        let gpu = gpu();
        let [irradiance, depth, id] = self.upload();
        let back = back.map(Self::upload);
        let projection = self.view.projection.as_mat4().to_cols_array_2d();
        let mut frame = Frame::new(&irradiance, &depth, projection);
        frame.profile_id = Some(&id);
        frame.mm_per_unit = 1.0;
        frame.back = back.as_ref().map(|[irradiance, depth, id]| {
            let mut layer = BackLayer::new(irradiance, depth);
            layer.profile_id = Some(id);
            layer
        });
        change(&mut frame);
        let output = gpu.target("output", self.view.size, format);
        method::scatter(gpu, method, &frame, &output).expect("a frame that fits");
        gpu.read(&output)
    }

    /// Irradiance, depth and profile id.
    fn upload(&self) -> [TextureView; 3] {
        let (gpu, size) = (gpu(), self.view.size);
        let mut irradiance = Vec::new();
        let mut depth = Vec::new();
        let mut id = Vec::new();
        for hit in &self.hits {
            let e = hit.map_or(DVec3::splat(0.25), |h| h.irradiance).as_vec3();
            irradiance.push([e.x, e.y, e.z, 0.5]);
            depth.push(hit.map_or(0.0, |h| {
                let clip = self.view.projection * h.point.extend(1.0);
                (clip.z / clip.w) as f32
            }));
            id.push(hit.map_or(0, |h| h.id as u8));
        }
        [
            gpu.upload("irradiance", size, TextureFormat::Rgba32Float, &irradiance),
            gpu.upload("depth", size, TextureFormat::R32Float, &depth),
            gpu.upload("profile id", size, TextureFormat::R8Uint, &id),
        ]
    }

    /// The visible integral at some pixels, all of which have the id 1.
    pub fn visible_integral(&self, asked: &[usize], profile: &Profile) -> Vec<DVec3> {
        self.integral_over(None, asked, profile)
    }

    /// The same over this layer and one behind it.
    pub fn integral_over(&self, back: Option<&Self>, asked: &[usize], profile: &Profile) -> Vec<DVec3> {
        let on_surface = self.pixels(|h| h.id == 1);
        // From what is looked at, which leaves single floats their digits.
        let origin = on_surface[0].1.point;
        let mut pixels = self.patches(&on_surface, origin);
        if let Some(back) = back {
            pixels.extend(back.patches(&back.pixels(|h| h.id == 1), origin));
        }
        let place = |i| on_surface.partition_point(|(j, _)| j < i);
        let asked: Vec<usize> = asked.iter().map(place).collect();
        let sums = truth::visible_integral(&pixels, &asked, profile, &|_| ());
        sums.iter().map(|s| s.as_dvec3()).collect()
    }

    /// What the truth takes of these pixels, relative to a point.
    fn patches(&self, on_surface: &[(usize, Hit)], origin: DVec3) -> Vec<Pixel> {
        let pixels = on_surface.iter().map(|(i, hit)| Pixel {
            patch: Patch {
                point_mm: (hit.point - origin).as_vec3(),
                area_mm2: self.steps[*i][0].cross(self.steps[*i][1]).length() as f32,
                irradiance: hit.irradiance.as_vec3(),
            },
            steps_mm: truth::even_steps(
                self.steps[*i].map(|step| step.as_vec3()),
                self.pixels_mm2[*i].sqrt() as f32,
                |x, y| {
                    let [width, height] = self.view.size.map(|s| s as i32);
                    let (x, y) = (*i as i32 % width + x, *i as i32 / width + y);
                    let is_inside = (0..width).contains(&x) && (0..height).contains(&y);
                    let found = is_inside.then(|| self.hits[(y * width + x) as usize]);
                    let found = found.flatten().filter(|h| h.id == 1)?;
                    Some((found.point - hit.point).as_vec3())
                },
            ),
        });
        pixels.collect()
    }

    /// Differences of `out`, the whole picture scattered by skin, to the visible integral.
    pub fn errors(&self, out: &[DVec3], asked: &[usize]) -> Vec<DVec3> {
        let truth = self.visible_integral(asked, &Profile::SKIN);
        asked.iter().zip(truth).map(|(i, t)| out[*i] - t).collect()
    }

    /// Pixels for which `select` holds, with what they see.
    pub fn pixels(&self, select: impl Fn(&Hit) -> bool) -> Vec<(usize, Hit)> {
        self.hits.iter().enumerate().filter_map(|(i, h)| h.filter(&select).map(|h| (i, h))).collect()
    }
}

/// A plane through the origin of view space shifted to z = −distance.
pub fn plane(
    normal: DVec3,
    distance_mm: f64,
    irradiance: impl Fn(DVec3) -> DVec3,
) -> impl Fn(DVec3, DVec3) -> Option<Hit> {
    move |origin, ray| {
        let anchor = DVec3::new(0.0, 0.0, -distance_mm);
        let point = origin + ray * ((anchor - origin).dot(normal) / ray.dot(normal));
        (point.z < -1.0).then(|| Hit { point, normal, irradiance: irradiance(point - anchor), id: 1 })
    }
}

/// The near side of a sphere of radius `rho_mm` around (0, 0, −distance).
pub fn sphere(
    rho_mm: f64,
    distance_mm: f64,
    irradiance: impl Fn(DVec3) -> DVec3,
) -> impl Fn(DVec3, DVec3) -> Option<Hit> {
    side_of_sphere(-1.0, rho_mm, distance_mm, irradiance)
}

/// Its far side.
pub fn sphere_back(
    rho_mm: f64,
    distance_mm: f64,
    irradiance: impl Fn(DVec3) -> DVec3,
) -> impl Fn(DVec3, DVec3) -> Option<Hit> {
    side_of_sphere(1.0, rho_mm, distance_mm, irradiance)
}

fn side_of_sphere(
    side: f64,
    rho_mm: f64,
    distance_mm: f64,
    irradiance: impl Fn(DVec3) -> DVec3,
) -> impl Fn(DVec3, DVec3) -> Option<Hit> {
    move |origin, ray| {
        let center = DVec3::new(0.0, 0.0, -distance_mm);
        let (d, o) = (ray.normalize(), origin - center);
        let b = o.dot(d);
        let disc = b * b - o.length_squared() + rho_mm * rho_mm;
        (disc >= 0.0).then(|| {
            let normal = (o + d * (-b + side * disc.sqrt())) / rho_mm;
            Hit { point: center + normal * rho_mm, normal, irradiance: irradiance(normal), id: 1 }
        })
    }
}

/// Position in mm and irradiance of a texel; `None` off the islands.
pub type Texel = Option<(DVec3, DVec3)>;

/// The centre of each texel of an atlas.
pub fn texels(size: u32) -> impl Iterator<Item = DVec2> {
    let row = move |y| (0..size).map(move |x| DVec2::new(x.into(), f64::from(y)) + 0.5);
    (0..size).flat_map(row)
}

/// Irradiance and positions of an atlas of so many texels a side, by their centres.
pub fn atlas(size: u32, texel: impl Fn(DVec2) -> Texel) -> [TextureView; 2] {
    let (mut irradiance, mut positions) = (Vec::new(), Vec::new());
    for found in texels(size).map(texel) {
        let (p, e) = found.unwrap_or_default();
        irradiance.push(e.as_vec3().extend(0.5).to_array());
        // In metres, as most scenes are.
        let id = f32::from(u8::from(found.is_some()));
        positions.push((p * 1e-3).as_vec3().extend(id).to_array());
    }
    [("irradiance", irradiance), ("positions", positions)]
        .map(|(name, texels)| gpu().upload(name, [size; 2], TextureFormat::Rgba32Float, &texels))
}

/// What a method makes of such an atlas.
pub fn scatter_atlas(
    method: &mut dyn AtlasMethod,
    format: TextureFormat,
    size: u32,
    texel: impl Fn(DVec2) -> Texel,
) -> Vec<[f32; 4]> {
    let gpu = gpu();
    let [irradiance, positions] = &atlas(size, texel);
    let output = gpu.target("output", [size; 2], format);
    let atlas = Atlas::new(irradiance, positions);
    method::scatter_atlas(gpu, method, &atlas, &output).expect("an atlas that fits");
    gpu.read(&output)
}

pub fn rgb([r, g, b, _]: [f32; 4]) -> DVec3 {
    DVec3::new(r.into(), g.into(), b.into())
}

/// A direction in the picture.
pub fn direction(degrees: f64) -> DVec3 {
    DVec2::from_angle(degrees.to_radians()).extend(0.0)
}

/// Root mean square.
pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut n) = (0.0, 0);
    for v in values {
        sum += v * v;
        n += 1;
    }
    assert!(n > 0, "nothing to take the mean of");
    (sum / f64::from(n)).sqrt()
}

/// As `max`, which would lose NaN.
pub fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b <= a { a } else { b }
}

/// The largest number; NaN where one of them is.
pub fn largest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    numbers.into_iter().reduce(larger).expect("there is something to take the largest of")
}

/// The largest difference between two frames; NaN where one is.
pub fn apart(a: &[[f32; 4]], b: &[[f32; 4]]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    largest(pairs.map(|(a, b)| f64::from((a - b).abs())))
}

/// Rotates the normal (0, 0, 1) by `tilt` about the image axis at `axis`, both in degrees.
pub fn tilted_normal(tilt: f64, axis: f64) -> DVec3 {
    let axis = axis.to_radians();
    DMat3::from_axis_angle(DVec3::new(axis.cos(), axis.sin(), 0.0), tilt.to_radians()) * DVec3::Z
}
