//! A strip of skin across an edge and lines of light: as the material has it, and as a plan draws it.

use glam::Vec3;
use subsurface::physics::Response;
use subsurface::wgpu::TextureFormat;
use subsurface::{Frame, Plan};

use crate::Error;
use crate::method::{self, Ours};
use crate::renderer::Gpu;
use crate::synthetic::View;
use crate::truth::closed_form::{softened, step};

pub const PX_PER_MM: f64 = 20.0;
pub const WIDTH: u32 = 920;
/// Of the frame around it, so large that kernels end within.
const FRAME: [u32; 2] = [2560, 1024];
/// What is lit, in mm from the middle: half a plane, then lines of 4, 2, 1 and ½ mm.
const LIT_MM: [[f64; 2]; 5] = [[-1e4, -11.0], [-4.0, 0.0], [6.0, 8.0], [12.0, 13.0], [17.0, 17.5]];

/// Light by pixel, from the left.
pub struct Strip {
    pub material: Vec<Vec3>,
    pub plan: Vec<Vec3>,
    /// The largest difference of the two.
    pub error: f64,
}

impl Strip {
    /// # Errors
    /// What the effect refuses.
    pub fn new(gpu: &Gpu, responses: &[Response; 3], plan: &Plan) -> Result<Self, Error> {
        let material = by_responses(responses);
        let plan = by_plan(gpu, plan)?;
        let apart = |(a, b): (&Vec3, &Vec3)| f64::from((*a - *b).abs().max_element());
        let error = material.iter().zip(&plan).map(apart).fold(0.0, f64::max);
        Ok(Self { material, plan, error })
    }
}

/// Where a pixel of so many lies, in mm.
fn place(i: u32, width: u32) -> f64 {
    (f64::from(i) + 0.5 - 0.5 * f64::from(width)) / PX_PER_MM
}

fn by_responses(responses: &[Response; 3]) -> Vec<Vec3> {
    // Edges lie between pixels, so that a table of every half pixel has all distances.
    let far = 2 * (WIDTH + 1);
    let tables = responses.each_ref().map(|response| {
        // By eighths of a pixel, from which to soften.
        let fine: Vec<f64> =
            (0..4 * far + 50).map(|i| response.edge(f64::from(i) / (8.0 * PX_PER_MM))).collect();
        let edge = |x: f64| {
            let at = 8.0 * PX_PER_MM * x;
            let i = (at as usize).min(fine.len() - 2);
            let share = (at - i as f64).min(1.0);
            (1.0 - share) * fine[i] + share * fine[i + 1]
        };
        let soft = |i: u32| softened(edge, f64::from(i) / (2.0 * PX_PER_MM), 1.0 / PX_PER_MM);
        (0..far).map(soft).collect::<Vec<_>>()
    });
    let edge = |c: usize, x: f64| {
        let table = &tables[c];
        let i = (2.0 * PX_PER_MM * x.abs()).round() as usize;
        let e = table[i.min(table.len() - 1)];
        if x < 0.0 { 1.0 - e } else { e }
    };
    let light = |x: f64, c: usize| LIT_MM.iter().map(|[a, b]| edge(c, x - a) - edge(c, x - b)).sum::<f64>();
    (0..WIDTH).map(|i| Vec3::from([0, 1, 2].map(|c| light(place(i, WIDTH), c) as f32))).collect()
}

fn by_plan(gpu: &Gpu, plan: &Plan) -> Result<Vec<Vec3>, Error> {
    let [width, height] = FRAME;
    let blur_mm2 = PX_PER_MM.powi(-2);
    let lit =
        |x: f64| LIT_MM.iter().map(|[a, b]| step(x - a, blur_mm2) - step(x - b, blur_mm2)).sum::<f64>();
    let row: Vec<[f32; 4]> =
        (0..width).map(|i| lit(place(i, width)) as f32).map(|e| [e, e, e, 1.0]).collect();
    let light = gpu.upload("light", FRAME, TextureFormat::Rgba32Float, &row.repeat(height as usize));
    let depth = vec![0.5f32; (width * height) as usize];
    let depth = gpu.upload("depth", FRAME, TextureFormat::R32Float, &depth);
    let projection = View::orthographic(FRAME, PX_PER_MM).projection.as_mat4();
    let mut frame = Frame::new(&light, &depth, projection.to_cols_array_2d());
    frame.mm_per_unit = 1.0;
    let output = gpu.target("strip", FRAME, TextureFormat::Rgba32Float);
    let mut ours = Ours::new(&gpu.device, TextureFormat::Rgba32Float, plan)?;
    method::scatter(gpu, &mut ours, &frame, &output)?;
    let pixels = gpu.read(&output);
    let from = height / 2 * width + (width - WIDTH) / 2;
    let row = &pixels[from as usize..][..WIDTH as usize];
    Ok(row.iter().map(|p| Vec3::new(p[0], p[1], p[2])).collect())
}
