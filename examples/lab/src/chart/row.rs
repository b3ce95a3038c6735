//! One row of the chart: a method at a setting, on a scene.

use serde::{Deserialize, Serialize};

/// The columns of `chart.csv`, in their order. Errors are of irradiance/π over skin.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Row {
    /// Scene, such as `front` or `edge_4`.
    pub scene: String,
    /// Method, such as `burley_disk`.
    pub method: String,
    /// Its setting, such as `40` samples; empty where it has none.
    pub setting: String,
    /// Of the frame, in pixels.
    pub width: u32,
    /// Of the frame, in pixels.
    pub height: u32,
    /// Pixels that scatter.
    pub skin_pixels: usize,
    /// Pixels a millimetre, where the surface faces the camera.
    pub px_per_mm: f64,
    /// Median time, by the clock that the chart names; 0 for no scattering, which does nothing.
    pub ms: f64,
    /// The same as a multiple of the plain copy, median of the ratios within a round.
    pub x_copy: f64,
    /// Texel fetches for a pixel of skin, where they can be counted.
    pub fetches: Option<f64>,
    /// Relative RMSE against the visible integral.
    pub rel_rmse_visible: Option<f64>,
    /// Largest error of any channel against the visible integral.
    pub max_error_visible: Option<f64>,
    /// Relative RMSE against the surface integral, Eq. 7 as printed.
    pub rel_rmse_eq7: Option<f64>,
    /// Largest error of any channel against the surface integral, Eq. 7 as printed.
    pub max_error_eq7: Option<f64>,
    /// Relative RMSE against the surface integral, each Gaussian divided by its mass.
    pub rel_rmse_eq7_normalised: Option<f64>,
    /// CIEDE2000 difference that 99 % of the skin stays within.
    pub delta_e2000_p99: Option<f64>,
    /// Mean FLIP over skin.
    pub flip_mean: Option<f64>,
    /// Energy, area-weighted, over that of the truth that colours are compared with: the visible
    /// integral, or for texture space and with the layer behind the surface integral, normalised.
    pub energy_ratio: Option<f64>,
    /// Textures of its own, in bytes a pixel of the frame.
    pub scratch_bytes_per_pixel: Option<f64>,
}
