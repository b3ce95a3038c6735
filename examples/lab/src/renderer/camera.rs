//! Cameras: a perspective, and the views of a head that the examples show.

use std::str::FromStr;

use crate::Error;
use glam::camera::rh::proj::directx::perspective_infinite_reverse;
use glam::{Mat4, Quat, Vec3};

use super::Scene;
use super::head::Head;

/// Of a portrait lens, in radians: 24°.
const FOV_Y: f32 = 24.0 * std::f32::consts::PI / 180.0;

/// A perspective camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where it stands, in scene units.
    pub eye: Vec3,
    /// What it looks at, in scene units; y is up.
    pub target: Vec3,
    /// Vertical field of view in radians.
    pub fov_y: f32,
}

/// A view of a head that faces +Z, as glTF has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// From the front.
    Front,
    /// From 40° to the right of the person, where the default key light is.
    ThreeQuarter,
    /// From the person's right side.
    Profile,
    /// The middle of the face.
    CloseUp,
    /// The person's right ear, from before it.
    Ear,
}

impl FromStr for View {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        match name {
            "front" => Ok(Self::Front),
            "three-quarter" => Ok(Self::ThreeQuarter),
            "profile" => Ok(Self::Profile),
            "close-up" => Ok(Self::CloseUp),
            "ear" => Ok(Self::Ear),
            _ => Err(Error::new("view", name, "front, three-quarter, profile, close-up or ear")),
        }
    }
}

impl Camera {
    /// A portrait lens on a model's head. A bust, wider than tall, is framed by its head.
    pub fn framing(scene: &Scene, view: View, size: [u32; 2]) -> Self {
        let face = Head::of(scene);
        let (min, max) = (face.min, face.max);
        let extent = max - min;
        let bust = extent.x > 0.9 * extent.y;
        let head = if bust { 0.78 * extent.y } else { extent.y };
        let middle = Vec3::new(0.5 * (min.x + max.x), max.y - 0.5 * head, 0.5 * (min.z + max.z));
        let (target, height) = match view {
            View::CloseUp => (face.nose(scene, min.y + 0.35 * extent.y), 0.26 * extent.y),
            View::Ear => (face.ear(scene), 0.34 * extent.y),
            _ => (middle, head),
        };
        // Upright frames need the distance that the width asks for.
        let height = height * (size[1] as f32 / size[0] as f32).max(1.0);
        // Not quite to the edge, and from beyond the nearest point.
        let distance = 0.54 * height / (FOV_Y / 2.0).tan()
            + match view {
                View::CloseUp | View::Ear => 0.0,
                _ => 0.3 * extent.dot(face.forward.abs()),
            };
        Self::facing(face.forward, view, target, distance)
    }

    /// The same lens on any point, from so far away, both in scene units, in a view's direction.
    pub fn looking_at(scene: &Scene, view: View, target: Vec3, distance: f32) -> Self {
        Self::facing(Head::of(scene).forward, view, target, distance)
    }

    /// Turned about what it looks at, in radians, towards the right of a person who faces it.
    pub fn turned(mut self, angle: f32) -> Self {
        self.eye = self.target + Quat::from_rotation_y(-angle) * (self.eye - self.target);
        self
    }

    fn facing(forward: Vec3, view: View, target: Vec3, distance: f32) -> Self {
        let yaw: f32 = match view {
            View::Front => 0.0,
            View::ThreeQuarter => -40.0,
            View::Profile => -90.0,
            View::CloseUp => 20.0,
            View::Ear => -25.0,
        };
        let back = Quat::from_rotation_y(yaw.to_radians()) * forward;
        Self { eye: target + distance * back, target, fov_y: FOV_Y }
    }

    /// World to view space: right-handed, looking down −Z.
    pub fn view(&self) -> Mat4 {
        glam::camera::rh::view::look_at_mat4(self.eye, self.target, Vec3::Y)
    }

    /// View to clip space: infinite, with reversed depth.
    pub fn projection(&self, size: [u32; 2]) -> Mat4 {
        let near = 0.01 * self.eye.distance(self.target).max(f32::MIN_POSITIVE);
        let aspect = size[0] as f32 / size[1] as f32;
        perspective_infinite_reverse(self.fov_y, aspect, near)
    }

    /// Width and height, in scene units, of what a pixel covers of a surface at `point`, in world
    /// space, whose unit normal is `normal`; up to ten times as much as of one that faces it.
    pub fn footprint(&self, size: [u32; 2], point: Vec3, normal: Vec3) -> [f32; 2] {
        let view = self.view();
        let p = view.transform_point3(point);
        let n = view.transform_vector3(normal);
        let ray = p / p.z.abs().max(f32::MIN_POSITIVE);
        let facing = n.dot(ray);
        let facing = facing.abs().max(0.1 * ray.length()).copysign(facing);
        // A pixel of a plane through the point that faces the camera.
        let step = 2.0 * p.z.abs() * (self.fov_y / 2.0).tan() / size[1] as f32;
        [Vec3::X, Vec3::Y].map(|axis| step * (axis - ray * (n.dot(axis) / facing)).length())
    }

    /// Pixels per scene unit at the target.
    pub fn px_per_unit(&self, size: [u32; 2]) -> f32 {
        let height = 2.0 * self.eye.distance(self.target) * (self.fov_y / 2.0).tan();
        size[1] as f32 / height
    }
}
