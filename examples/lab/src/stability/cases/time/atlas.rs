//! The surfaces of this group in texture space.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::stability::unwrapped::{Texel, Unwrapped};

/// A square of a plane.
#[derive(Clone, Copy)]
pub struct Sheet {
    pub middle: DVec3,
    /// Two directions on it, at a right angle.
    pub along: DVec3,
    pub across: DVec3,
    pub side_mm: f64,
}

impl Sheet {
    pub fn uv(&self, point: DVec3) -> DVec2 {
        self.place(point) / self.side_mm + 0.5
    }

    /// In mm from its middle.
    pub fn place(&self, point: DVec3) -> DVec2 {
        let from_middle = point - self.middle;
        DVec2::new(from_middle.dot(self.along), from_middle.dot(self.across))
    }

    pub fn point(&self, place: DVec2) -> DVec3 {
        self.middle + place.x * self.along + place.y * self.across
    }

    /// Its atlas, of `texels` each way, under a light that is known by place.
    pub fn unwrap(&self, texels: u32, light: impl Fn(DVec2) -> DVec3) -> Unwrapped {
        Unwrapped::new([texels; 2], |uv| {
            let place = (uv - 0.5) * self.side_mm;
            Some(Texel {
                point_mm: self.point(place),
                irradiance: light(place),
                area_mm2: (self.side_mm / f64::from(texels)).powi(2),
            })
        })
    }
}

/// Where a sphere's atlas has this normal: longitude, its seam at the back, and latitude.
pub fn sphere_uv(normal: DVec3) -> DVec2 {
    let longitude = normal.x.atan2(normal.z);
    DVec2::new(longitude / TAU + 0.5, normal.y.clamp(-1.0, 1.0).acos() / PI)
}

/// A whole sphere around a point, under a light that is known by normal; twice as wide as `rows`.
pub fn unwrapped_sphere(
    rho_mm: f64,
    middle: DVec3,
    rows: u32,
    light: impl Fn(DVec3) -> DVec3,
) -> Unwrapped {
    let step = PI / f64::from(rows);
    Unwrapped::new([2 * rows, rows], |uv| {
        let (longitude, colatitude) = ((uv.x - 0.5) * TAU, uv.y * PI);
        let level = colatitude.sin();
        let normal = DVec3::new(
            level * longitude.sin(),
            colatitude.cos(),
            level * longitude.cos(),
        );
        Some(Texel {
            point_mm: middle + rho_mm * normal,
            irradiance: light(normal),
            area_mm2: (rho_mm * step).powi(2) * level,
        })
    })
}
