//! The models of surface reflection by themselves, as tables. Driver of `brdf_tables.wgsl`.

use bytemuck::{Pod, Zeroable};
use glam::Vec2;
use wgpu::TextureFormat;

use super::{Gpu, Specular};
use crate::passes::{self, CLEAR, Pipeline};

const SHADER: &str = concat!(include_str!("brdf.wgsl"), include_str!("brdf_tables.wgsl"));
/// Directions that a directional albedo is summed over.
const SAMPLES: u32 = 2048;

/// `Table` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct TableUniform {
    size: Vec2,
    model: u32,
    samples: u32,
    slope: f32,
    f0: f32,
}

/// Makes the tables, in targets of Rgba16Float.
pub struct BrdfTables {
    uniform: wgpu::Buffer,
    group: wgpu::BindGroup,
    albedo: wgpu::RenderPipeline,
    lobes: wgpu::RenderPipeline,
}

impl BrdfTables {
    /// Of directional albedo: cosines of the angle to the normal, and slopes, both in equal parts from 0 to 1.
    pub const ALBEDO_SIZE: [u32; 2] = [32, 16];
    /// Of lobes: angles that they are seen from, and light from 0°, 30° and 60°.
    pub const LOBES_SIZE: [u32; 2] = [720, 3];

    pub fn new(gpu: &Gpu) -> Self {
        let label = "subsurface_lab::renderer brdf tables";
        let uniform = gpu.uniform::<TableUniform>(label);
        let (layout, group) = super::textures(gpu, label, Some(&uniform), &[]);
        let shader = passes::module(&gpu.device, label, &[SHADER]);
        let pipeline = |fragment| {
            Pipeline {
                groups: &[Some(&layout)],
                targets: &[TextureFormat::Rgba16Float.into()],
                ..Pipeline::of(label, &shader, ["vs_main", fragment])
            }
            .make(&gpu.device)
        };
        Self { albedo: pipeline("fs_albedo"), lobes: pipeline("fs_lobes"), uniform, group }
    }

    /// ∫f·cos θᵢ dωᵢ without Fresnel, into a target of [`ALBEDO_SIZE`](Self::ALBEDO_SIZE): the part that is
    /// times F₀ in red, the part that is not, Schlick's term, in green.
    pub fn draw_albedo(&self, gpu: &Gpu, model: Specular, to: &wgpu::TextureView) {
        self.draw(gpu, &self.albedo, Self::ALBEDO_SIZE, model, [0.0; 2], to);
    }

    /// f·cos θᵢ·cos θₒ of a slope and F₀ in red, into a target of [`LOBES_SIZE`](Self::LOBES_SIZE).
    pub fn draw_lobes(&self, gpu: &Gpu, model: Specular, slope: f32, f0: f32, to: &wgpu::TextureView) {
        self.draw(gpu, &self.lobes, Self::LOBES_SIZE, model, [slope, f0], to);
    }

    /// How often a table of directional albedo asks its model.
    pub fn evaluations() -> u64 {
        Self::ALBEDO_SIZE.map(u64::from).iter().product::<u64>() * u64::from(SAMPLES)
    }

    fn draw(
        &self,
        gpu: &Gpu,
        pipeline: &wgpu::RenderPipeline,
        size: [u32; 2],
        model: Specular,
        [slope, f0]: [f32; 2],
        to: &wgpu::TextureView,
    ) {
        let [width, height] = size.map(|s| s as f32);
        let size = Vec2::new(width, height);
        let uniform = TableUniform { size, model: model as u32, samples: SAMPLES, slope, f0 };
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        gpu.run(|encoder| {
            let label = "subsurface_lab::renderer brdf tables";
            let mut pass = passes::begin(encoder, label, &[(to, CLEAR)], None);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &self.group, &[]);
            pass.draw(0..3, 0..1);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wgsl::assert_layout;

    #[test]
    fn tables_lie_as_the_shader_has_them() {
        assert_layout!(SHADER, "Table", TableUniform { size, model, samples, slope, f0 });
    }

    #[test]
    fn models_have_the_numbers_of_the_shader() {
        for model in Specular::ALL {
            let name = model.name().replace('-', "_").to_uppercase();
            let line = format!("const {name} = {}u;", model as u32);
            assert!(include_str!("brdf.wgsl").contains(&line), "no {line}");
        }
    }
}
