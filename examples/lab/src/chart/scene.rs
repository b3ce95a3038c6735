//! What the methods are tried on: a frame as a host hands it over, and what its pixels show.

use crate::Error;
use glam::{DMat4, DVec2, DVec3, DVec4, Mat4, Vec3};
use half::f16;
use subsurface::wgpu::{TextureFormat, TextureView};
use subsurface::{BackLayer, Frame, Profile};

use crate::renderer::{
    BackRenderer, Camera, Gpu, Lighting, Primitive, Probe, Renderer, Scene as Model, View, Visible,
};
use crate::truth::{Patch, Pixel, closed_form, even_steps};

/// σ of red light in the skin profile, in mm, by which the edges are named.
const RED_SIGMA_MM: f64 = 1.176;
/// Projected widths of the edges: red σ in pixels.
const EDGES_PX: [f64; 8] = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
/// From this width on, the truth of an edge is asked for at so many times fewer pixels each way: it
/// would take hours.
const SPARSE_FROM_PX: f64 = 8.0;
pub const SPARSE: u32 = 2;

/// Names of the scenes, in the order in which they are run.
pub fn names() -> Vec<String> {
    let heads = ["front", "three-quarter", "close-up", "far", "profile", "ear", "wide", "sphere"];
    let edges = EDGES_PX.iter().map(|px| format!("edge_{px}"));
    heads.map(String::from).into_iter().chain(edges).collect()
}

/// A frame, and what is known of it beyond what methods are told.
pub struct Scene {
    pub name: String,
    pub size: [u32; 2],
    pub px_per_mm: f64,
    pub irradiance: TextureView,
    pub depth: TextureView,
    pub profile_id: TextureView,
    pub projection: Mat4,
    pub mm_per_unit: f32,
    /// Whether a pixel scatters.
    pub skin: Vec<bool>,
    /// What the pixels of `skin` show, in their order.
    pub pixels: Vec<Pixel>,
    /// Of every pixel; white where a scene has none.
    pub albedo: Vec<Vec3>,
    /// The truth is asked for at every so many pixels, each way.
    pub stride: u32,
    pub surface: Surface,
    /// The surface right behind the visible one, where methods are tried with it.
    back: Option<BackRenderer>,
}

/// What the surface integral is taken over.
pub enum Surface {
    Head(Box<Head>),
    /// Known on paper, in the order of `pixels`.
    Known(Vec<Vec3>),
}

/// A head, as it was last rendered.
pub struct Head {
    pub renderer: Renderer,
    pub camera: Camera,
}

impl Scene {
    /// The scene of this name, which `wide` is of another size than the others; the truth is asked for at
    /// every `stride` pixels, or fewer.
    ///
    /// # Errors
    /// A name that is none, or a size that the device cannot render.
    pub fn new(
        gpu: &Gpu,
        model: &Model,
        mm_per_unit: f32,
        name: &str,
        [size, wide]: [[u32; 2]; 2],
        stride: u32,
    ) -> Result<Self, Error> {
        if name == "wide" {
            let camera = a_third(gpu, model, mm_per_unit, wide)?;
            let scene = Self::head(gpu, model, mm_per_unit, name, wide, camera)?;
            let stride = SPARSE * stride;
            return Ok(Self { stride, ..scene });
        }
        let view = |view| Camera::framing(model, view, size);
        let camera = match name {
            "front" => view(View::Front),
            "three-quarter" => view(View::ThreeQuarter),
            "close-up" => view(View::CloseUp),
            "profile" => view(View::Profile),
            "far" => far(view(View::Front), size, mm_per_unit),
            "ear" => view(View::Ear),
            "sphere" => return Ok(sphere(gpu, size, stride)),
            _ => {
                let width = name.strip_prefix("edge_").and_then(|px| px.parse().ok());
                return match width {
                    Some(sigma_px) if EDGES_PX.contains(&sigma_px) => Ok(edge(gpu, size, sigma_px, stride)),
                    _ => Err(Error::new("--scenes", name, names().join(", "))),
                };
            }
        };
        let scene = match name {
            "ear" => Self::from_behind(gpu, model, mm_per_unit, name, size, camera)?,
            _ => Self::head(gpu, model, mm_per_unit, name, size, camera)?,
        };
        Ok(Self { stride, ..scene })
    }

    /// Lit from behind, with the layer behind what is seen.
    fn from_behind(
        gpu: &Gpu,
        model: &Model,
        mm_per_unit: f32,
        name: &str,
        size: [u32; 2],
        camera: Camera,
    ) -> Result<Self, Error> {
        let renderer = Renderer::new(gpu, model, size)?;
        renderer.render(gpu, &camera, &Lighting::behind(), mm_per_unit)?;
        let back = BackRenderer::new(gpu, &renderer);
        back.render(gpu, &renderer);
        let scene = Self::drawn(gpu, renderer, mm_per_unit, name, size, camera)?;
        Ok(Self { back: Some(back), ..scene })
    }

    /// Any view of heads, in a portrait's light.
    ///
    /// # Errors
    /// A size that the device cannot render; no skin in view.
    pub fn head(
        gpu: &Gpu,
        model: &Model,
        mm_per_unit: f32,
        name: &str,
        size: [u32; 2],
        camera: Camera,
    ) -> Result<Self, Error> {
        let renderer = Renderer::new(gpu, model, size)?;
        renderer.render(gpu, &camera, &Lighting::default(), mm_per_unit)?;
        Self::drawn(gpu, renderer, mm_per_unit, name, size, camera)
    }

    /// What a renderer last drew, for this camera.
    fn drawn(
        gpu: &Gpu,
        renderer: Renderer,
        mm_per_unit: f32,
        name: &str,
        size: [u32; 2],
        camera: Camera,
    ) -> Result<Self, Error> {
        let visible = Probe::new(gpu, &renderer).visible(gpu, &renderer);
        let g = &renderer.gbuffer;
        let skin: Vec<bool> = gpu.read_bytes(g.profile_id.texture()).iter().map(|id| *id == 1).collect();
        let irradiance = gpu.read(&g.irradiance);
        let view = camera.view();
        let mm_per_px = 2.0 * (camera.fov_y / 2.0).tan() / size[1] as f32;
        if !skin.contains(&true) {
            return Err(Error::new(name, "no skin in view", "a model that scatters"));
        }
        let pixels = (0..skin.len()).filter(|i| skin[*i]).map(|i| {
            let Visible { point_mm, steps_mm } = visible[i];
            let depth_mm = -view.transform_point3(point_mm / mm_per_unit).z * mm_per_unit;
            let beside = |x, y| Some(visible[skin_beside(&skin, size, i, x, y)?].point_mm - point_mm);
            Pixel {
                patch: Patch {
                    point_mm,
                    area_mm2: steps_mm[0].cross(steps_mm[1]).length(),
                    irradiance: rgb(irradiance[i]),
                },
                steps_mm: even_steps(steps_mm, depth_mm * mm_per_px, beside),
            }
        });
        Ok(Self {
            name: name.into(),
            size,
            px_per_mm: f64::from(camera.px_per_unit(size) / mm_per_unit),
            pixels: pixels.collect(),
            skin,
            irradiance: g.irradiance.clone(),
            depth: g.depth.clone(),
            profile_id: g.profile_id.clone(),
            projection: camera.projection(size),
            mm_per_unit,
            albedo: gpu.read(&g.albedo).into_iter().map(rgb).collect(),
            stride: 1,
            surface: Surface::Head(Box::new(Head { renderer, camera })),
            back: None,
        })
    }

    /// What lies right behind what is seen; where the scene is not lit through it, nothing.
    pub fn back(&self) -> Option<BackLayer<'_>> {
        self.back.as_ref().map(BackRenderer::layer)
    }

    /// As methods take it, without what is behind.
    pub fn frame(&self) -> Frame<'_> {
        let projection = self.projection.to_cols_array_2d();
        let mut frame = Frame::new(&self.irradiance, &self.depth, projection);
        frame.profile_id = Some(&self.profile_id);
        frame.mm_per_unit = self.mm_per_unit;
        frame
    }

    /// Size of the pictures of the pixels that the truth is asked for.
    pub fn asked_size(&self) -> [u32; 2] {
        self.size.map(|s| s.div_ceil(self.stride))
    }

    /// Of a value for every pixel, those of the pixels that the truth is asked for.
    pub fn asked<T: Copy>(&self, values: &[T]) -> Vec<T> {
        let stride = self.stride as usize;
        let rows = values.chunks(self.size[0] as usize).step_by(stride);
        rows.flat_map(|row| row.iter().step_by(stride).copied()).collect()
    }
}

pub fn rgb([r, g, b, _]: [f32; 4]) -> Vec3 {
    Vec3::new(r, g, b)
}

/// Corners of a primitive's triangles in mm.
pub fn vertices_mm(primitive: &Primitive, mm_per_unit: f32) -> impl Iterator<Item = Vec3> {
    let positions = primitive.vertices.iter().map(|v| Vec3::from(v.position));
    positions.map(move |p| p * mm_per_unit)
}

/// The view from the front, narrowed or widened until a third of the frame is skin.
fn a_third(gpu: &Gpu, model: &Model, mm_per_unit: f32, size: [u32; 2]) -> Result<Camera, Error> {
    const TRIES: usize = 4;
    // Of what part is skin, few pixels tell enough.
    let small = size.map(|s| (s / 8).max(1));
    let mut camera = Camera::framing(model, View::Front, size);
    for _ in 0..TRIES {
        let scene = Scene::head(gpu, model, mm_per_unit, "wide", small, camera)?;
        let share = scene.pixels.len() as f32 / scene.skin.len() as f32;
        let half = (camera.fov_y / 2.0).tan() * (3.0 * share).sqrt();
        camera.fov_y = 2.0 * half.atan();
    }
    Ok(camera)
}

/// The pixel so many columns and rows beside one, where it is skin.
fn skin_beside(skin: &[bool], size: [u32; 2], i: usize, x: i32, y: i32) -> Option<usize> {
    let [width, height] = size.map(|s| s as i32);
    let (x, y) = (i as i32 % width + x, i as i32 / width + y);
    let is_inside = (0..width).contains(&x) && (0..height).contains(&y);
    let there = (y * width + x) as usize;
    (is_inside && skin[there]).then_some(there)
}

/// From so far away that a pixel is a third of a centimetre.
fn far(near: Camera, size: [u32; 2], mm_per_unit: f32) -> Camera {
    const PX_PER_MM: f32 = 0.3;
    let closer = near.px_per_unit(size) / (PX_PER_MM * mm_per_unit);
    Camera { eye: near.target + (near.eye - near.target) * closer, ..near }
}

/// What a ray along −Z finds: point, normal, irradiance, and the light that Eq. 7 scatters there.
struct Hit {
    point_mm: DVec3,
    normal: DVec3,
    irradiance: f64,
    scattered: DVec3,
}

/// A ball of 10 mm, lit from the side, across half of the picture's height.
fn sphere(gpu: &Gpu, size: [u32; 2], stride: u32) -> Scene {
    const RHO_MM: f64 = 10.0;
    let px_per_mm = 0.25 * f64::from(size[1]) / RHO_MM;
    let light = DVec3::new(1.0, 0.0, 1.0).normalize();
    let scattered = closed_form::scattered_cosine(RHO_MM, &Profile::SKIN);
    orthographic(gpu, "sphere".into(), size, px_per_mm, stride, |at| {
        let z2 = RHO_MM * RHO_MM - at.length_squared();
        (z2 > 0.0).then(|| {
            let point_mm = at.extend(z2.sqrt());
            let normal = point_mm / RHO_MM;
            let cosine = normal.dot(light);
            Hit { point_mm, normal, irradiance: cosine.max(0.0), scattered: scattered(cosine) }
        })
    })
}

/// A plane that faces the camera: where it is skin, and its light.
pub fn flat(
    gpu: &Gpu,
    name: &str,
    size: [u32; 2],
    px_per_mm: f64,
    irradiance: impl Fn(DVec2) -> Option<f64>,
) -> Scene {
    orthographic(gpu, name.into(), size, px_per_mm, 1, |at| {
        Some(Hit {
            point_mm: at.extend(0.0),
            normal: DVec3::Z,
            irradiance: irradiance(at)?,
            // Nobody asks.
            scattered: DVec3::NAN,
        })
    })
}

/// A straight edge, soft by σ = 1 px, at 30°, over a whole frame of skin.
fn edge(gpu: &Gpu, size: [u32; 2], sigma_px: f64, stride: u32) -> Scene {
    let px_per_mm = sigma_px / RED_SIGMA_MM;
    let blur_mm2 = px_per_mm.powi(-2);
    let across = DVec2::from_angle(30f64.to_radians());
    let sparse = if sigma_px < SPARSE_FROM_PX { 1 } else { SPARSE };
    let stride = stride * sparse;
    let name = format!("edge_{sigma_px}");
    orthographic(gpu, name, size, px_per_mm, stride, |at| {
        let x = at.dot(across);
        Some(Hit {
            point_mm: at.extend(0.0),
            normal: DVec3::Z,
            irradiance: closed_form::step(x, blur_mm2),
            scattered: closed_form::scattered_step(x, blur_mm2, &Profile::SKIN),
        })
    })
}

/// What a pixel shows.
fn pixel(h: &Hit, irradiance: f32, px_per_mm: f64, beside: impl Fn(i32, i32) -> Option<Vec3>) -> Pixel {
    // On the tangent plane, down being −y in mm.
    let step = |x: f64, y: f64| {
        let z = -(x * h.normal.x + y * h.normal.y) / h.normal.z;
        DVec3::new(x, y, z) / px_per_mm
    };
    let tangents = [step(1.0, 0.0), step(0.0, -1.0)];
    Pixel {
        patch: Patch {
            point_mm: h.point_mm.as_vec3(),
            area_mm2: tangents[0].cross(tangents[1]).length() as f32,
            irradiance: Vec3::splat(irradiance),
        },
        steps_mm: even_steps(tangents.map(|t| t.as_vec3()), px_per_mm.recip() as f32, beside),
    }
}

/// A surface over the xy plane, seen along −Z from half a metre, in mm.
fn orthographic(
    gpu: &Gpu,
    name: String,
    size: [u32; 2],
    px_per_mm: f64,
    stride: u32,
    hit: impl Fn(DVec2) -> Option<Hit>,
) -> Scene {
    let half = DVec2::new(size[0].into(), size[1].into()) / px_per_mm / 2.0;
    // Reversed depth from 0 at 1000 mm to 1 at the eye.
    let projection = DMat4::from_cols(
        DVec4::new(1.0 / half.x, 0.0, 0.0, 0.0),
        DVec4::new(0.0, 1.0 / half.y, 0.0, 0.0),
        DVec4::new(0.0, 0.0, 1e-3, 0.0),
        DVec4::new(0.0, 0.0, 1.0, 1.0),
    );
    let places = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
    let hits: Vec<Option<Hit>> = places
        .map(|place| {
            let at = DVec2::from(place.map(|p| f64::from(p) + 0.5)) / px_per_mm - half;
            hit(DVec2::new(at.x, -at.y))
        })
        .collect();
    let bits = |h: &Option<Hit>| {
        let e = h.as_ref().map_or(0.0, |h| h.irradiance);
        [e, e, e, 1.0].map(|c| f16::from_f64(c).to_bits())
    };
    let irradiance: Vec<_> = hits.iter().map(bits).collect();
    let clip = |h: &Hit| (projection.z_axis.z * (h.point_mm.z - 500.0) + 1.0) as f32;
    let depth: Vec<_> = hits.iter().map(|h| h.as_ref().map_or(0.0, clip)).collect();
    let skin: Vec<bool> = hits.iter().map(Option::is_some).collect();
    let id: Vec<u8> = skin.iter().map(|is_skin| u8::from(*is_skin)).collect();
    let (mut pixels, mut known) = (Vec::new(), Vec::new());
    for (i, h) in hits.iter().enumerate() {
        let Some(h) = h else { continue };
        let beside = |x, y| {
            let there = hits[skin_beside(&skin, size, i, x, y)?].as_ref()?;
            Some((there.point_mm - h.point_mm).as_vec3())
        };
        pixels.push(pixel(h, f16::from_bits(irradiance[i][0]).to_f32(), px_per_mm, beside));
        known.push(h.scattered.as_vec3());
    }
    Scene {
        irradiance: gpu.upload("irradiance", size, TextureFormat::Rgba16Float, &irradiance),
        depth: gpu.upload("depth", size, TextureFormat::R32Float, &depth),
        profile_id: gpu.upload("profile id", size, TextureFormat::R8Uint, &id),
        albedo: vec![Vec3::ONE; skin.len()],
        name,
        size,
        px_per_mm,
        projection: projection.as_mat4(),
        mm_per_unit: 1.0,
        skin,
        pixels,
        stride,
        surface: Surface::Known(known),
        back: None,
    }
}
