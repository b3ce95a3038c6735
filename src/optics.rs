//! From a projection to millimetres: where the pixels of a frame lie in view space.

use glam::{DMat4, DVec3, Mat4, Vec4};

use crate::{Error, Frame};

/// Where a frame's pixels are, in mm.
#[derive(Debug)]
pub(crate) struct Optics {
    /// Normalised device coordinates to view space.
    pub inverse_projection: Mat4,
    /// The depth at which there is no surface.
    pub far: f32,
    /// x and y over z of the surface at the corner of the viewport, then the part that is not over z.
    pub origin: Vec4,
    /// The same for a step of one pixel.
    pub step: Vec4,
}

impl Optics {
    /// With clip x = P₀₀·X + P₀₂·z + P₀₃ and clip w = P₃₂·z + P₃₃, all in units of the scene,
    /// X = (x′·w − P₀₂·z − P₀₃)/P₀₀ at the device coordinate x′, which is linear over the pixels.
    pub(crate) fn new(frame: &Frame) -> Result<Self, Error> {
        let projection = Mat4::from_cols_array_2d(&frame.projection);
        // In double precision, since the inverse of a projection with a near plane of a millimetre loses
        // half of a float's digits.
        let mm = DMat4::from_scale(DVec3::splat(frame.mm_per_unit.into()));
        let inverse = (mm * projection.as_dmat4().inverse()).as_mat4();
        let [x, y, w] = [0, 1, 3].map(|i| projection.row(i));
        let refuse = |needs| Err(Error::Projection { got: frame.projection, needs });
        if !projection.is_finite() || !projection.as_dmat4().inverse().is_finite() {
            return refuse("finite numbers that can be inverted");
        }
        if !inverse.is_finite() {
            let (got, needs) =
                (frame.mm_per_unit.into(), "a number with which all depths are finite in mm");
            return Err(Error::Number { input: "mm_per_unit".into(), got, needs });
        }
        if x.y != 0.0 || y.x != 0.0 {
            return refuse("x and y that stay apart");
        }
        // Handed over row by row, a perspective has its -1 where the near plane belongs.
        if projection.w_axis.z == -1.0 && ![0.0, 1.0].contains(&projection.z_axis.w.abs()) {
            return refuse("columns; these look like rows");
        }
        let distance = |depth: f32| {
            let z = inverse.z_axis.z * depth + inverse.w_axis.z;
            let z = z / (inverse.z_axis.w * depth + inverse.w_axis.w);
            // An orthographic camera may see what is behind it, farther than what is before it.
            if w.z == 0.0 { -z } else { z.abs() }
        };
        let far = if distance(0.0) > distance(1.0) { 0.0 } else { 1.0 };
        let size = frame.rectangle().size();
        let mm = frame.mm_per_unit;
        let at = |ndc: f32, row: Vec4, scale: f32| {
            [(ndc * w.z - row.z) / scale, (ndc * w.w - row.w) / scale * mm]
        };
        let step = |ndc: f32, scale: f32| [ndc * w.z / scale, ndc * w.w / scale * mm];
        let [ux, vx] = at(-1.0, x, x.x);
        let [uy, vy] = at(1.0, y, y.y);
        let [dux, dvx] = step(2.0 / size[0] as f32, x.x);
        let [duy, dvy] = step(-2.0 / size[1] as f32, y.y);
        Ok(Self {
            inverse_projection: inverse,
            far,
            origin: Vec4::new(ux, uy, vx, vy),
            step: Vec4::new(dux, duy, dvx, dvy),
        })
    }

    /// Checks what the pyramid needs on top: depth that depends on z alone, in a right-handed view space.
    pub(crate) fn check_depth_alone(frame: &Frame) -> Result<(), Error> {
        let projection = Mat4::from_cols_array_2d(&frame.projection);
        let [z, w] = [2, 3].map(|i| projection.row(i));
        let needs = if [z.x, z.y, w.x, w.y].iter().any(|c| *c != 0.0) {
            "depth that does not depend on x and y; Plan::exact takes oblique near planes"
        } else if w.z > 0.0 {
            "columns, of a right-handed view space that looks along -Z"
        } else {
            return Ok(());
        };
        Err(Error::Projection { got: frame.projection, needs })
    }

    /// z = (x·depth + y)/(z·depth + w), in mm.
    pub(crate) fn depth_to_mm(&self) -> Vec4 {
        let m = self.inverse_projection;
        Vec4::new(m.z_axis.z, m.w_axis.z, m.z_axis.w, m.w_axis.w)
    }

    /// The pixels to a mm of a surface that faces the camera so near to it, or at the near plane, along the axis that
    /// has fewer; endless where that is not known.
    pub(crate) fn nearest_px_per_mm(&self, nearest_mm: Option<f32>) -> f64 {
        let [x, y, z, w] = self.depth_to_mm().to_array();
        let near = 1.0 - self.far;
        let s = self.spacing();
        let z = nearest_mm.map_or((x * near + y) / (z * near + w), |mm| -mm);
        let mm = (s.x + s.y * z).abs().max((s.z + s.w * z).abs());
        if mm > 0.0 { f64::from(mm).recip() } else { f64::INFINITY }
    }

    /// The mm between pixels of a surface that faces the camera, at z mm in view space: along a row
    /// |x + y·z|, along a column |z + w·z|; signed as the axes of the picture are.
    pub(crate) fn spacing(&self) -> Vec4 {
        let s = self.step;
        Vec4::new(s.z, s.x, s.w, s.y)
    }
}
