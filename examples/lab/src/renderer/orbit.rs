//! A camera that goes around a point, and lights that go around the scene.

use std::f32::consts::FRAC_PI_2;

use super::Camera;
use glam::{Quat, Vec3};

/// At the poles the camera would not know where up is.
const MAX_PITCH: f32 = 0.97 * FRAC_PI_2;
/// From a lip to the room around the head, in degrees.
const FOV_Y: [f32; 2] = [1.5, 60.0];
/// What a notch of the wheel leaves of the field of view.
const NOTCH: f32 = 0.9;

/// A camera around `target`. It zooms as a lens does, so that it never enters the head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    target: Vec3,
    distance: f32,
    /// From +Z to +X, in radians.
    yaw: f32,
    /// Up from the horizon, in radians.
    pitch: f32,
    fov_y: f32,
}

impl From<Camera> for Orbit {
    fn from(camera: Camera) -> Self {
        let (distance, yaw, pitch) = angles(camera.eye - camera.target);
        Self {
            target: camera.target,
            distance,
            yaw,
            pitch: pitch.clamp(-MAX_PITCH, MAX_PITCH),
            fov_y: camera.fov_y,
        }
    }
}

impl Orbit {
    pub fn camera(&self) -> Camera {
        Camera {
            eye: self.target + self.distance * direction(self.yaw, self.pitch),
            target: self.target,
            fov_y: self.fov_y,
        }
    }

    /// The scene follows a drag by a share of the picture's height, to the right and down.
    pub fn turn(&mut self, right: f32, down: f32) {
        self.yaw -= right * 2.0 * FRAC_PI_2;
        self.pitch = (self.pitch + down * 2.0 * FRAC_PI_2).clamp(-MAX_PITCH, MAX_PITCH);
    }

    /// The scene follows a drag across the picture, by a share of its height.
    pub fn shift(&mut self, right: f32, down: f32) {
        let height = 2.0 * self.distance * (self.fov_y / 2.0).tan();
        let turn = Quat::from_rotation_y(self.yaw) * Quat::from_rotation_x(-self.pitch);
        self.target += turn * Vec3::new(-right, down, 0.0) * height;
    }

    /// Nearer by notches of a wheel, or farther.
    pub fn zoom(&mut self, notches: f32) {
        let [min, max] = FOV_Y.map(f32::to_radians);
        // Of the tangent, so that every notch magnifies alike.
        let half = (self.fov_y / 2.0).tan() * NOTCH.powf(notches);
        self.fov_y = (2.0 * half.atan()).clamp(min, max);
    }
}

/// A direction towards a light, dragged by a share of the picture's height; of the length it had.
pub fn turn_light(light: Vec3, right: f32, down: f32) -> Vec3 {
    let (length, yaw, pitch) = angles(light);
    let pitch = (pitch - down * 2.0 * FRAC_PI_2).clamp(-MAX_PITCH, MAX_PITCH);
    length * direction(yaw + right * 2.0 * FRAC_PI_2, pitch)
}

fn direction(yaw: f32, pitch: f32) -> Vec3 {
    Vec3::new(yaw.sin() * pitch.cos(), pitch.sin(), yaw.cos() * pitch.cos())
}

/// Length, yaw and pitch.
fn angles(v: Vec3) -> (f32, f32, f32) {
    let length = v.length();
    let pitch = (v.y / length.max(f32::MIN_POSITIVE)).clamp(-1.0, 1.0);
    (length, v.x.atan2(v.z), pitch.asin())
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Camera =
        Camera { eye: Vec3::new(1.0, 2.5, 4.0), target: Vec3::new(0.5, 1.5, -0.5), fov_y: 0.4 };

    #[test]
    fn a_camera_stays_where_it_was() {
        let camera = Orbit::from(CAMERA).camera();
        assert!(camera.eye.distance(CAMERA.eye) < 1e-5, "{camera:?}");
        assert_eq!((camera.target, camera.fov_y), (CAMERA.target, CAMERA.fov_y));
    }

    #[test]
    fn turning_keeps_the_distance_and_stops_at_the_poles() {
        let mut orbit = Orbit::from(CAMERA);
        for (right, down) in [(0.3, 0.1), (-2.0, 9.0), (0.1, -20.0)] {
            orbit.turn(right, down);
            let camera = orbit.camera();
            let distance = camera.eye.distance(camera.target);
            assert!((distance - orbit.distance).abs() < 1e-5);
            assert!(camera.view().is_finite());
            let up = (camera.eye - camera.target) / distance;
            assert!(up.y.abs() < 0.9999, "{up}");
        }
    }

    #[test]
    fn the_scene_follows_the_pointer() {
        let across = |camera: &Camera, point| camera.view().transform_point3(point);
        let orbit = Orbit::from(CAMERA);
        let front = CAMERA.target + (CAMERA.eye - CAMERA.target) * 0.1;
        for (right, down) in [(0.01, 0.0), (0.0, 0.01), (-0.01, 0.02)] {
            let (mut turned, mut shifted) = (orbit, orbit);
            turned.turn(right, down);
            shifted.shift(right, down);
            let moved = across(&turned.camera(), front) - across(&CAMERA, front);
            assert!(moved.x * right >= -1e-6 && moved.y * down <= 1e-6, "{moved}");
            // A point at the target's depth moves by just the share of the picture that was asked for.
            let height = 2.0 * orbit.distance * (orbit.fov_y / 2.0).tan();
            let moved = across(&shifted.camera(), CAMERA.target) / height;
            let expected = Vec3::new(right, -down, -orbit.distance / height);
            assert!(moved.distance(expected) < 1e-4, "{moved} {expected}");
        }
    }

    #[test]
    fn zoom_comes_back_and_ends() {
        let mut orbit = Orbit::from(CAMERA);
        orbit.zoom(3.0);
        assert!(orbit.fov_y < CAMERA.fov_y);
        orbit.zoom(-3.0);
        assert!((orbit.fov_y - CAMERA.fov_y).abs() < 1e-5);
        orbit.zoom(1e4);
        assert_eq!(orbit.fov_y, FOV_Y[0].to_radians());
        orbit.zoom(-1e4);
        assert_eq!(orbit.fov_y, FOV_Y[1].to_radians());
    }

    #[test]
    fn lights_go_where_they_are_dragged() {
        let light = Vec3::new(0.2, 0.3, 0.9);
        let moved = turn_light(light, 0.1, -0.1);
        assert!((moved.length() - light.length()).abs() < 1e-5);
        assert!(moved.x > light.x && moved.y > light.y);
        assert!(turn_light(light, 0.0, 0.0).distance(light) < 1e-5);
        assert!(turn_light(light, 0.0, -50.0).is_finite());
    }
}
