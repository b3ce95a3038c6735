//! Lights, sky and surface reflection, with the shadow maps that they need. Driver of
//! `lighting.wgsl` and `shadow.wgsl`.

use std::f32::consts::PI;
use std::str::FromStr;

use crate::Error;
use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Mat4, Vec2, Vec3, Vec4};
use wgpu::BindingResource;

use super::mesh::Mesh;
use super::{DEPTH, Gpu};
use crate::passes::{self, Pipeline, Slot};

/// What shaders that light surfaces begin with.
pub(super) const SHADER: &str = concat!(include_str!("brdf.wgsl"), include_str!("lighting.wgsl"));

/// Side of the shadow maps in texels.
const MAP_SIZE: u32 = 2048;
const SHADOW: &str = "subsurface_lab::renderer shadow";

/// A distant light with an extent, and so with soft shadows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Towards the light; any length but zero.
    pub direction: Vec3,
    /// Half the angle under which the light is seen, in degrees, 0 to 10: .27 for the sun.
    pub radius_degrees: f32,
    /// Radiance that a white diffuse surface facing the light reflects, linear RGB.
    pub color: Vec3,
}

/// Light from all around, as the nine coefficients of irradiance/π over the unit normal: of
/// 1, y, z, x, xy, yz, 3z² − 1, xz, x² − y².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky(pub [Vec3; 9]);

/// The form of the surface reflection: numbers of brdf.wgsl.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Specular {
    /// Kelemen & Szirmay-Kalos with Schlick's Fresnel term, as GPU Gems 3 ch. 14 uses it.
    Kelemen = 0,
    /// Li & Shao 2015, Eq. 4–6 as printed: Beckmann's distribution times the cosine, no more.
    Printed = 1,
    /// Blinn–Phong, normalised, with Schlick's Fresnel term.
    BlinnPhong = 2,
    /// Cook & Torrance: Beckmann's distribution, V-shaped grooves, Schlick's Fresnel term.
    Beckmann = 3,
    /// Trowbridge & Reitz's distribution with Smith's shadowing.
    Ggx = 4,
}

impl Specular {
    /// By their numbers.
    pub const ALL: [Self; 5] = [Self::Kelemen, Self::Printed, Self::BlinnPhong, Self::Beckmann, Self::Ggx];

    /// As options have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kelemen => "kelemen",
            Self::Printed => "printed",
            Self::BlinnPhong => "blinn-phong",
            Self::Beckmann => "beckmann",
            Self::Ggx => "ggx",
        }
    }
}

impl FromStr for Specular {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        let found = Self::ALL.into_iter().find(|model| model.name() == name);
        let names = || Self::ALL.map(Self::name).join(", ");
        found.ok_or_else(|| Error::new("specular", name, format!("one of {}", names())))
    }
}

/// All that lights a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Lighting {
    /// 0 to 4 lights.
    pub lights: Vec<Light>,
    /// The sky.
    pub sky: Sky,
    /// Form of the surface reflection.
    pub specular: Specular,
    /// RMS slope m of the skin's micro-facets, .01 to 1.
    pub slope: f32,
    /// Intensity ρ_s of the skin's reflection (of all but the printed model).
    pub intensity: f32,
    /// Reflectance at normal incidence (of all but the printed model): .028 for skin.
    pub f0: f32,
    /// How far the `Environment` that the renderer has was turned about y, in radians; none: it is neither
    /// reflected nor behind the scene. The sky and the lights are what it lights by
    /// (`Environment::light`).
    pub turn: Option<f32>,
}

impl Sky {
    /// A dim overcast room: cool from above, warm from the floor.
    pub fn soft() -> Self {
        let zenith = Vec3::new(0.105, 0.118, 0.145);
        let horizon = Vec3::new(0.075, 0.076, 0.082);
        let floor = Vec3::new(0.042, 0.036, 0.032);
        Self::project(|d| {
            if d.y > 0.0 { horizon.lerp(zenith, d.y) } else { horizon.lerp(floor, (-3.0 * d.y).min(1.0)) }
        })
    }

    /// The coefficients of a sky given by its radiance from each direction.
    pub fn project(radiance: impl Fn(Vec3) -> Vec3) -> Self {
        const SAMPLES: usize = 4096;
        Self::sum((0..SAMPLES).map(|i| {
            // A Fibonacci spiral.
            let up = 1.0 - 2.0 * (i as f32 + 0.5) / SAMPLES as f32;
            let phi = i as f32 * PI * (3.0 - 5f32.sqrt());
            let around = (1.0 - up * up).sqrt();
            let d = Vec3::new(around * phi.cos(), up, around * phi.sin());
            (d, radiance(d), 4.0 * PI / SAMPLES as f32)
        }))
    }

    /// The coefficients of a sky in parts: direction, radiance, solid angle (Ramamoorthi & Hanrahan 2001,
    /// Eq. 3 and 10).
    pub fn sum(parts: impl Iterator<Item = (Vec3, Vec3, f32)>) -> Self {
        // Normalisation of each basis function, and the cosine's share A_l/π of its band.
        let y = [0.282095, 0.488603, 0.488603, 0.488603, 1.092548, 1.092548, 0.315392, 1.092548, 0.546274];
        let a = [1.0, 2.0 / 3.0, 0.25];
        let mut sky = [Vec3::ZERO; 9];
        for (d, radiance, solid_angle) in parts {
            let light = radiance * solid_angle;
            for (k, b) in basis(d).into_iter().enumerate() {
                let band = [0, 1, 1, 1, 2, 2, 2, 2, 2][k];
                sky[k] += light * b * y[k] * y[k] * a[band];
            }
        }
        Self(sky)
    }

    /// Irradiance/π on a surface of this normal.
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        self.0.iter().zip(basis(normal)).map(|(c, b)| *c * b).sum()
    }

    /// The sky, turned: what came from d now comes from `rotation`·d. E(n) = c + b·n + nᵀQn, a number, a
    /// vector and a symmetric matrix without a trace; b becomes Rb, and Q becomes RQRᵀ.
    pub fn turned(&self, rotation: Mat3) -> Self {
        let mut turned = *self;
        for channel in 0..3 {
            let [_, y, z, x, xy, yz, zz, xz, xxyy] = self.0.map(|c| c[channel]);
            let b = rotation * Vec3::new(x, y, z);
            let q = Mat3::from_cols(
                Vec3::new(xxyy - zz, 0.5 * xy, 0.5 * xz),
                Vec3::new(0.5 * xy, -xxyy - zz, 0.5 * yz),
                Vec3::new(0.5 * xz, 0.5 * yz, 2.0 * zz),
            );
            let q = rotation * q * rotation.transpose();
            let [x, y, z] = [q.x_axis, q.y_axis, q.z_axis];
            let of = [b.y, b.z, b.x, 2.0 * x.y, 2.0 * y.z, 0.5 * z.z, 2.0 * x.z, 0.5 * (x.x - y.y)];
            for (to, of) in turned.0[1..].iter_mut().zip(of) {
                to[channel] = of;
            }
        }
        turned
    }
}

fn basis(d: Vec3) -> [f32; 9] {
    [1.0, d.y, d.z, d.x, d.x * d.y, d.y * d.z, 3.0 * d.z * d.z - 1.0, d.x * d.z, d.x * d.x - d.y * d.y]
}

impl Lighting {
    /// Light from behind the head, on the side of its right ear, and a dim sky.
    pub fn behind() -> Self {
        let light = Light {
            direction: Vec3::new(-0.45, 0.25, -0.86),
            radius_degrees: 2.0,
            color: Vec3::new(1.6, 1.5, 1.4),
        };
        Self { lights: vec![light], ..Self::default() }
    }
}

impl Default for Lighting {
    /// A portrait: a warm key from the side, a cool rim from behind, a dim sky.
    fn default() -> Self {
        Self {
            lights: vec![
                Light {
                    direction: Vec3::new(-0.82, 0.38, 0.55),
                    radius_degrees: 3.0,
                    color: Vec3::new(1.05, 0.98, 0.90),
                },
                Light {
                    direction: Vec3::new(0.80, 0.30, -0.62),
                    radius_degrees: 4.0,
                    color: Vec3::new(0.34, 0.42, 0.55),
                },
            ],
            sky: Sky::soft(),
            specular: Specular::Kelemen,
            slope: 0.3,
            intensity: 0.32,
            f0: 0.028,
            turn: None,
        }
    }
}

/// `Light` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Default, Pod, Zeroable)]
pub(super) struct LightUniform {
    direction: Vec3,
    tan_radius: f32,
    color: Vec3,
    pad: f32,
    to_map: Mat4,
}

/// `Lighting` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct LightingUniform {
    lights: [LightUniform; Lighting::MAX_LIGHTS],
    sky: [Vec4; 9],
    map_extent: f32,
    count: u32,
    specular_model: u32,
    specular_intensity: f32,
    f0: f32,
    slope: f32,
    turn: Vec2,
}

impl Lighting {
    /// The most lights.
    pub const MAX_LIGHTS: usize = 4;

    fn uniform(&self, bounds: (Vec3, Vec3)) -> Result<LightingUniform, Error> {
        if self.lights.len() > Self::MAX_LIGHTS {
            return Err(Error::new(
                "lights",
                self.lights.len().to_string(),
                format!("at most {}", Self::MAX_LIGHTS),
            ));
        }
        let center = (bounds.0 + bounds.1) / 2.0;
        let extent = 1.02 * bounds.0.distance(bounds.1);
        let mut lights = [LightUniform::zeroed(); Self::MAX_LIGHTS];
        for (to, light) in lights.iter_mut().zip(&self.lights) {
            let Some(direction) = light.direction.try_normalize() else {
                return Err(Error::new(
                    "light: direction",
                    light.direction.to_string(),
                    "a finite direction",
                ));
            };
            let right = direction.any_orthonormal_vector();
            let up = direction.cross(right);
            // Right-handed as seen from the light: x right, y down the map, z away.
            let rows = [right, -up, -direction].map(|axis| axis / extent);
            let offset = rows.map(|row| 0.5 - row.dot(center));
            *to = LightUniform {
                direction,
                tan_radius: light.radius_degrees.clamp(0.0, 10.0).to_radians().tan(),
                color: light.color,
                pad: 0.0,
                to_map: Mat4::from_cols(
                    rows[0].extend(offset[0]),
                    rows[1].extend(offset[1]),
                    rows[2].extend(offset[2]),
                    Vec4::W,
                )
                .transpose(),
            };
        }
        Ok(LightingUniform {
            lights,
            sky: self.sky.0.map(|c| c.extend(0.0)),
            map_extent: extent,
            count: self.lights.len() as u32,
            specular_model: self.specular as u32,
            specular_intensity: self.intensity,
            f0: self.f0,
            slope: self.slope.clamp(0.01, 1.0),
            turn: self.turn.map_or(Vec2::ZERO, Vec2::from_angle),
        })
    }
}

/// The lighting on the device: uniform, shadow maps, an environment, and the bind group that shaders read
/// all by.
pub(super) struct Lights {
    pub layout: wgpu::BindGroupLayout,
    pub group: wgpu::BindGroup,
    uniform: wgpu::Buffer,
    #[cfg_attr(not(feature = "programs"), expect(dead_code, reason = "programs alone set an environment"))]
    maps: wgpu::Texture,
    #[cfg_attr(not(feature = "programs"), expect(dead_code, reason = "programs alone set an environment"))]
    sampler: wgpu::Sampler,
    pipeline: wgpu::RenderPipeline,
    shadows: [Shadow; Lighting::MAX_LIGHTS],
}

/// The shadow map of one light.
struct Shadow {
    to_clip: wgpu::Buffer,
    group: wgpu::BindGroup,
    map: wgpu::TextureView,
}

impl Lights {
    pub fn new(gpu: &Gpu) -> Self {
        let device = &gpu.device;
        let label = "subsurface_lab::renderer lighting";
        let slots = [
            Slot::Uniform,
            Slot::DepthLayers,
            Slot::Comparison,
            Slot::FilteredLayers,
            Slot::FilteredLayers,
            Slot::Sampler,
        ];
        let layout = passes::layout(device, label, &slots);
        let count = Lighting::MAX_LIGHTS as u32;
        let maps = gpu.layers("subsurface_lab::renderer shadow maps", [MAP_SIZE; 2], count, DEPTH);
        let uniform = gpu.uniform::<LightingUniform>(label);
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some(label),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..Default::default()
        });
        let group = group(gpu, &layout, &uniform, &maps, &sampler, &Maps::none(gpu));

        let shader = device.create_shader_module(wgpu::include_wgsl!("shadow.wgsl"));
        let map_layout = passes::layout(device, SHADOW, &[Slot::Uniform]);
        let pipeline = Pipeline {
            groups: &[Some(&map_layout)],
            buffers: &[Mesh::VERTEX_LAYOUT],
            depth_stencil: Some(super::depth_state(wgpu::CompareFunction::Less, true)),
            ..Pipeline::of(SHADOW, &shader, ["vs_shadow", ""])
        }
        .make(device);
        let shadow = |layer| {
            let to_clip = gpu.uniform::<Mat4>(SHADOW);
            Shadow {
                group: passes::group(device, SHADOW, &map_layout, &[to_clip.as_entire_binding()]),
                map: super::gpu::layer(&maps, layer as u32),
                to_clip,
            }
        };
        let shadows = std::array::from_fn(shadow);
        Self { layout, group, uniform, maps, sampler, pipeline, shadows }
    }

    /// Has an environment reflected from now on.
    #[cfg(feature = "programs")]
    pub fn set_environment(&mut self, gpu: &Gpu, environment: &Maps) {
        self.group = group(gpu, &self.layout, &self.uniform, &self.maps, &self.sampler, environment);
    }

    /// Uploads the lights and draws their shadow maps.
    pub fn render(
        &self,
        gpu: &Gpu,
        lighting: &Lighting,
        meshes: &[Mesh],
        bounds: (Vec3, Vec3),
    ) -> Result<(), Error> {
        let uniform = lighting.uniform(bounds)?;
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        gpu.run(|encoder| {
            for (shadow, light) in self.shadows.iter().zip(&uniform.lights[..uniform.count as usize]) {
                // Map coordinates to clip space: x and y from 0..1 to −1..1, y turned up.
                let to_clip =
                    Mat4::from_cols(2.0 * Vec4::X, -2.0 * Vec4::Y, Vec4::Z, Vec4::new(-1.0, 1.0, 0.0, 1.0))
                        * light.to_map;
                gpu.queue.write_buffer(&shadow.to_clip, 0, bytemuck::bytes_of(&to_clip));
                let depth = super::depth_attachment(&shadow.map, wgpu::LoadOp::Clear(1.0));
                let mut pass = passes::begin(encoder, SHADOW, &[], Some(depth));
                pass.set_pipeline(&self.pipeline);
                pass.set_bind_group(0, &shadow.group, &[]);
                for mesh in meshes {
                    mesh.draw(&mut pass, 0..mesh.index_count);
                }
            }
        });
        Ok(())
    }
}

/// An environment on the device.
pub(super) struct Maps {
    radiance: wgpu::Texture,
    reflectance: wgpu::Texture,
    sampler: wgpu::Sampler,
}

impl Maps {
    /// Of nothing.
    fn none(gpu: &Gpu) -> Self {
        Self::new(gpu, Self::layers(gpu, [1, 1], 1), Self::layers(gpu, [1, 1], 1))
    }

    /// Radiance by direction, in layers of slopes, and what a model reflects, in a layer each.
    pub fn new(gpu: &Gpu, radiance: wgpu::Texture, reflectance: wgpu::Texture) -> Self {
        // Around, and not over the poles.
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("subsurface_lab::renderer environment"),
            address_mode_u: wgpu::AddressMode::Repeat,
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self { radiance, reflectance, sampler }
    }

    pub fn layers(gpu: &Gpu, size: [u32; 2], layers: u32) -> wgpu::Texture {
        gpu.layers("subsurface_lab::renderer environment", size, layers, wgpu::TextureFormat::Rgba16Float)
    }
}

/// What shaders that light read.
fn group(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    uniform: &wgpu::Buffer,
    maps: &wgpu::Texture,
    sampler: &wgpu::Sampler,
    environment: &Maps,
) -> wgpu::BindGroup {
    let [maps, radiance, reflectance] =
        [maps, &environment.radiance, &environment.reflectance].map(super::gpu::array);
    let resources = [
        uniform.as_entire_binding(),
        BindingResource::TextureView(&maps),
        BindingResource::Sampler(sampler),
        BindingResource::TextureView(&radiance),
        BindingResource::TextureView(&reflectance),
        BindingResource::Sampler(&environment.sampler),
    ];
    passes::group(&gpu.device, "subsurface_lab::renderer lighting", layout, &resources)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wgsl::assert_layout;

    #[test]
    fn lights_lie_as_the_shader_has_them() {
        let shader = SHADER;
        assert_layout!(shader, "Light", LightUniform { direction, tan_radius, color, pad, to_map });
        assert_layout!(
            shader,
            "Lighting",
            LightingUniform {
                lights,
                sky,
                map_extent,
                count,
                specular_model,
                specular_intensity,
                f0,
                slope,
                turn
            }
        );
    }

    #[test]
    fn a_uniform_sky_lights_every_side_alike() {
        let sky = Sky::project(|_| Vec3::ONE);
        // π of irradiance over π; 4096 samples of a constant leave rounding only.
        for n in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE.normalize()] {
            let e = sky.irradiance(n);
            assert!((e - Vec3::ONE).abs().max_element() < 2e-3, "{n}: {e}");
        }
    }

    #[test]
    fn a_half_sky_lights_the_horizon_by_half() {
        let sky = Sky::project(|d| Vec3::splat(if d.y > 0.0 { 1.0 } else { 0.0 }));
        let e = |n: Vec3| sky.irradiance(n).x;
        // (1 + n·y)/2 lies wholly in the first two bands.
        for n in [Vec3::X, Vec3::Y, Vec3::NEG_Y, Vec3::new(0.6, 0.8, 0.0)] {
            assert!((e(n) - (1.0 + n.y) / 2.0).abs() < 2e-3, "{n}: {}", e(n));
        }
    }

    #[test]
    fn a_sky_turns_with_what_it_lights() {
        let sky = Sky::project(|d| Vec3::new(d.x, d.y * d.z, 1.0 + d.x * d.y).max(Vec3::ZERO));
        let turn = Mat3::from_euler(glam::EulerRot::XYZ, 0.3, -2.0, 1.1);
        let turned = sky.turned(turn);
        for n in [Vec3::X, Vec3::NEG_Y, Vec3::new(0.6, 0.0, -0.8), Vec3::ONE.normalize()] {
            let off = (turned.irradiance(turn * n) - sky.irradiance(n)).abs().max_element();
            assert!(off < 1e-6, "{n}: {off}");
        }
    }
}
