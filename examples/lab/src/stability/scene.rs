//! Surfaces that a camera looks at and that have UVs.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use subsurface::Profile;

use crate::stability::unwrapped::{Texel, Unwrapped};
pub use crate::synthetic::direction;
use crate::synthetic::{GBuffer, Hit, View, tilted_normal};
use crate::truth::closed_form::{scattered_cosine, scattered_cosine_around, scattered_step, step};

/// Polar angle at which a sphere's island ends: what scatters to its visible half lies before it.
const SPHERE_ENDS: f64 = 2.5;

pub enum Form {
    /// With its UVs along these, which are at right angles.
    Plane { along: DVec3, down: DVec3, size_mm: DVec2 },
    /// Endless; `length_mm` of it is unrolled, its middle turned from the camera by so many radians.
    Cylinder { along: DVec3, rho_mm: f64, length_mm: f64, turned: f64 },
    /// Unrolled by the polar angle from its near side.
    Sphere { rho_mm: f64 },
}

/// Light by the point, from the middle of the surface, and the normal; `None` is a hole.
type Light = Box<dyn Fn(DVec3, DVec3) -> Option<DVec3>>;
/// The closed form of that light, scattered by skin.
type Scattered = Box<dyn Fn(DVec3, DVec3) -> DVec3>;

pub struct Surface {
    form: Form,
    middle_mm: DVec3,
    /// Whether it is a plane that shows the camera its inside.
    is_turned_away: bool,
    light: Light,
    scattered: Option<Scattered>,
}

/// Surfaces that hide each other, side by side in an atlas.
pub struct Scene(pub Vec<Surface>);

impl Form {
    /// A plane that faces the camera.
    pub fn facing(side_mm: f64) -> Self {
        Self::Plane { along: DVec3::X, down: DVec3::NEG_Y, size_mm: DVec2::splat(side_mm) }
    }

    /// A plane turned by `tilt` about the image axis at `axis`, both in degrees.
    pub fn tilted(tilt: f64, axis: f64, side_mm: f64) -> Self {
        let along = direction(axis);
        Self::Plane { along, down: along.cross(tilted_normal(tilt, axis)), size_mm: DVec2::splat(side_mm) }
    }

    /// Where a ray meets it, from its middle: where it enters, or where it leaves what is closed.
    fn meet(&self, origin: DVec3, ray: DVec3, leaves: bool) -> Option<DVec3> {
        let along_ray = match *self {
            Self::Plane { .. } => {
                let normal = self.normal(DVec3::ZERO);
                -origin.dot(normal) / ray.dot(normal)
            }
            Self::Cylinder { along, rho_mm, .. } => {
                through(origin.reject_from(along), ray.reject_from(along), rho_mm)?[usize::from(leaves)]
            }
            Self::Sphere { rho_mm } => through(origin, ray, rho_mm)?[usize::from(leaves)],
        };
        Some(origin + ray * along_ray)
    }

    /// At a point of it.
    fn normal(&self, point: DVec3) -> DVec3 {
        match *self {
            Self::Plane { along, down, .. } => down.cross(along),
            Self::Cylinder { along, rho_mm, .. } => point.reject_from(along) / rho_mm,
            Self::Sphere { rho_mm } => point / rho_mm,
        }
    }

    /// The point at UVs from 0 to 1, and the area of a unit of UV.
    fn at(&self, uv: DVec2) -> Option<(DVec3, f64)> {
        let centred = uv - 0.5;
        match *self {
            Self::Plane { along, down, size_mm } => {
                let place = centred * size_mm;
                let point = along * place.x + down * place.y;
                Some((point, size_mm.element_product()))
            }
            Self::Cylinder { along, rho_mm, length_mm, turned } => {
                let (sin, cos) = (TAU * centred.x + turned).sin_cos();
                let normal = along.cross(DVec3::Z) * sin + DVec3::Z * cos;
                let point = rho_mm * normal + along * (length_mm * centred.y);
                Some((point, TAU * rho_mm * length_mm))
            }
            Self::Sphere { rho_mm } => {
                let theta = 2.0 * SPHERE_ENDS * centred.length();
                let around = centred.normalize_or(DVec2::X);
                let (sin, cos) = theta.sin_cos();
                let normal = (around * sin).extend(cos);
                let stretch = if theta > 0.0 { sin / theta } else { 1.0 };
                let area_mm2 = (2.0 * SPHERE_ENDS * rho_mm).powi(2) * stretch;
                (theta < SPHERE_ENDS).then_some((rho_mm * normal, area_mm2))
            }
        }
    }

    /// The way back.
    fn uv(&self, point: DVec3) -> DVec2 {
        let centred = match *self {
            Self::Plane { along, down, size_mm } => DVec2::new(point.dot(along), point.dot(down)) / size_mm,
            Self::Cylinder { along, length_mm, turned, .. } => {
                let angle = point.dot(along.cross(DVec3::Z)).atan2(point.z) - turned;
                let around = (angle / TAU + 0.5).rem_euclid(1.0) - 0.5;
                DVec2::new(around, point.dot(along) / length_mm)
            }
            Self::Sphere { rho_mm } => {
                let theta = (point.z / rho_mm).clamp(-1.0, 1.0).acos();
                point.truncate().normalize_or(DVec2::X) * theta / (2.0 * SPHERE_ENDS)
            }
        };
        centred + 0.5
    }
}

/// How far along a ray, in its own lengths, a ball around the origin begins and ends.
fn through(origin: DVec3, ray: DVec3, rho_mm: f64) -> Option<[f64; 2]> {
    let (a, b) = (ray.length_squared(), origin.dot(ray));
    let root = b * b - a * (origin.length_squared() - rho_mm * rho_mm);
    (root >= 0.0).then(|| [-1.0, 1.0].map(|side| (-b + side * root.sqrt()) / a))
}

impl Surface {
    /// At a distance of 300 mm.
    pub fn new(form: Form, light: impl Fn(DVec3, DVec3) -> Option<DVec3> + 'static) -> Self {
        let middle_mm = DVec3::new(0.0, 0.0, -300.0);
        Self { form, middle_mm, is_turned_away: false, light: Box::new(light), scattered: None }
    }

    /// Whose scattered light is known.
    pub fn solved(
        form: Form,
        light: impl Fn(DVec3, DVec3) -> DVec3 + 'static,
        scattered: impl Fn(DVec3, DVec3) -> DVec3 + 'static,
    ) -> Self {
        Self {
            scattered: Some(Box::new(scattered)),
            ..Self::new(form, move |point, normal| Some(light(point, normal)))
        }
    }

    /// Under the same light everywhere.
    pub fn even(form: Form, light: f64) -> Self {
        let light = DVec3::splat(light);
        Self::solved(form, move |_, _| light, move |_, _| light)
    }

    /// A plane with an edge of light, `at_mm` from its middle across the edge, soft by this variance.
    pub fn edge(form: Form, across: DVec3, at_mm: f64, blur_mm2: f64) -> Self {
        let place = move |point: DVec3| point.dot(across) - at_mm;
        Self::solved(
            form,
            move |point, _| DVec3::splat(step(place(point), blur_mm2)),
            move |point, _| scattered_step(place(point), blur_mm2, &Profile::SKIN),
        )
    }

    /// A sphere, or a cylinder lit across, under light from afar.
    pub fn lit(form: Form, light: DVec3) -> Self {
        let scattered: Box<dyn Fn(f64) -> DVec3> = match form {
            Form::Sphere { rho_mm } => Box::new(scattered_cosine(rho_mm, &Profile::SKIN)),
            Form::Plane { .. } => Box::new(DVec3::splat),
            Form::Cylinder { rho_mm, .. } => {
                let scattered = scattered_cosine_around(rho_mm, &Profile::SKIN);
                Box::new(move |cosine| scattered(cosine.clamp(-1.0, 1.0).acos()))
            }
        };
        Self::solved(
            form,
            move |_, normal| DVec3::splat(normal.dot(light).max(0.0)),
            move |_, normal| scattered(normal.dot(light)),
        )
    }

    pub fn moved(mut self, by_mm: DVec3) -> Self {
        self.middle_mm += by_mm;
        self
    }

    /// A plane that shows the camera its inside.
    pub fn turned_away(self) -> Self {
        Self { is_turned_away: true, ..self }
    }

    /// What of it faces the camera on a ray, or, `away`, is turned away from it.
    fn hit(&self, origin: DVec3, ray: DVec3, away: bool) -> Option<Hit> {
        let is_open = matches!(self.form, Form::Plane { .. });
        if is_open && self.is_turned_away != away {
            return None;
        }
        let point = self.form.meet(origin - self.middle_mm, ray, away)?;
        let normal = self.form.normal(point);
        Some(Hit { irradiance: (self.light)(point, normal)?, point: point + self.middle_mm, normal, id: 1 })
    }
}

impl Scene {
    /// The surface that is seen along a ray, and what of it.
    pub fn hit(&self, origin: DVec3, ray: DVec3) -> Option<(usize, Hit)> {
        let hits = self.0.iter().enumerate();
        hits.filter_map(|(i, s)| s.hit(origin, ray, false).map(|hit| (i, hit)))
            .max_by(|(_, a), (_, b)| a.point.z.total_cmp(&b.point.z))
    }

    /// The nearest surface behind the one that is seen, of those that are turned away.
    fn behind(&self, origin: DVec3, ray: DVec3) -> Option<Hit> {
        let (_, seen) = self.hit(origin, ray)?;
        let hits = self.0.iter().filter_map(|s| s.hit(origin, ray, true));
        hits.filter(|hit| hit.point.z < seen.point.z).max_by(|a, b| a.point.z.total_cmp(&b.point.z))
    }

    pub fn shoot(&self, view: &View) -> GBuffer {
        view.shoot(|origin, ray| self.hit(origin, ray).map(|(_, hit)| hit))
    }

    /// The layer right behind what [`shoot`](Self::shoot) sees.
    pub fn shoot_back(&self, view: &View) -> GBuffer {
        view.shoot(|origin, ray| self.behind(origin, ray))
    }

    /// Islands of `texels` each in a row.
    pub fn unwrap(&self, texels: [u32; 2]) -> Unwrapped {
        let count = self.0.len();
        let [width, height] = texels;
        let texel_uv2 = 1.0 / f64::from(width * height);
        Unwrapped::new([width * count as u32, height], |uv| {
            let along = uv.x * count as f64;
            let surface = &self.0[along as usize];
            let (point, area_mm2) = surface.form.at(DVec2::new(along.fract(), uv.y))?;
            Some(Texel {
                point_mm: point + surface.middle_mm,
                irradiance: (surface.light)(point, surface.form.normal(point))?,
                area_mm2: area_mm2 * texel_uv2,
            })
        })
    }

    /// The closed form at a point of a surface.
    pub fn scattered(&self, surface: usize, point: DVec3) -> DVec3 {
        let surface = &self.0[surface];
        let point = point - surface.middle_mm;
        let scattered = surface.scattered.as_ref().expect("a surface that is solved");
        scattered(point, surface.form.normal(point))
    }

    /// Where in the atlas a point of a surface lies.
    pub fn uv(&self, surface: usize, point: DVec3) -> DVec2 {
        let at = self.0[surface].form.uv(point - self.0[surface].middle_mm);
        DVec2::new((surface as f64 + at.x) / self.0.len() as f64, at.y)
    }
}

/// A direction `degrees` from the camera's, towards `side` in the picture.
pub fn from_camera(degrees: f64, side: DVec3) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    side * sin + DVec3::Z * cos
}
