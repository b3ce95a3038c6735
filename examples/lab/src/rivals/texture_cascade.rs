//! A cascade of Gaussian blurs in texture space. Driver of `texture_cascade.wgsl` and
//! `texture_cascade_pack.wgsl`.
//!
//! E. d'Eon, D. Luebke. *Advanced techniques for realistic real-time skin rendering.* GPU Gems 3,
//! ch. 14, 2007.

use std::fmt::Write;

use crate::Error;
use glam::DVec3;
use subsurface::wgpu::{
    BindGroup, BindingResource, CommandEncoder, Device, Queue, Sampler, TextureFormat, TextureView,
};
use subsurface::{Atlas, Profile};

use super::atlas::{ATLAS, Gutter, uniform};
use super::edge::{terms, vec3f};
use super::packed::COLOR;
use super::pass::{Pass, Slot, TRIANGLE, scratch, size, texture};
use crate::method::AtlasMethod;
use crate::passes::linear_sampler;

const STRETCH: TextureFormat = TextureFormat::Rg16Float;

/// Each blur is of what the former one left, by the variance that it lacks; every one is kept, and
/// at the end they are summed by the profile's weights.
pub struct TextureCascade {
    pack: Pass,
    /// Along u and along v.
    blurs: Vec<(Pass, Pass)>,
    sum: Pass,
    gutter: Gutter,
    linear: Sampler,
    scratch: Option<[TextureView; 3]>,
    blurred: Vec<TextureView>,
    prepared: Option<Prepared>,
}

struct Prepared {
    pack: BindGroup,
    blurs: Vec<(BindGroup, BindGroup)>,
    sum: BindGroup,
}

impl TextureCascade {
    pub fn new(device: &Device, format: TextureFormat, profile: &Profile) -> Self {
        let mut terms = terms(profile);
        terms.sort_by(|a, b| a.0.total_cmp(&b.0));
        let shader =
            [TRIANGLE, include_str!("seven_taps.wgsl"), include_str!("texture_cascade.wgsl")].concat();
        let mut before_mm2 = 0.0;
        let mut blurs = Vec::new();
        for (variance_mm2, _) in &terms {
            let sigma_mm = (variance_mm2 - before_mm2).sqrt();
            before_mm2 = *variance_mm2;
            let pass = |entry_point| {
                Pass::new(
                    device,
                    &format!("rivals texture_cascade {entry_point}"),
                    (&shader, entry_point),
                    &[Slot::Float, Slot::Filtered, Slot::Sampler],
                    &[COLOR.into()],
                    &[("sigma_mm", sigma_mm)],
                )
            };
            blurs.push((pass("fs_u"), pass("fs_v")));
        }
        let weights: Vec<_> = terms.iter().map(|(_, weight)| *weight).collect();
        Self {
            pack: Pass::new(
                device,
                "rivals texture_cascade pack",
                (&[ATLAS, include_str!("texture_cascade_pack.wgsl")].concat(), "fs_pack"),
                &[Slot::Uniform, Slot::Float, Slot::Float],
                &[COLOR.into(), STRETCH.into()],
                &[],
            ),
            blurs,
            sum: Pass::new(
                device,
                "rivals texture_cascade sum",
                (&sum_wgsl(&weights), "fs_sum"),
                &vec![Slot::Float; weights.len()],
                &[COLOR.into()],
                &[],
            ),
            gutter: Gutter::new(device, format),
            linear: linear_sampler(device, "rivals texture_cascade"),
            scratch: None,
            blurred: Vec::new(),
            prepared: None,
        }
    }
}

/// The weighted sum of the blurs, written out.
fn sum_wgsl(weights: &[DVec3]) -> String {
    let mut text = TRIANGLE.to_string();
    // Writing to a String cannot fail.
    for i in 0..weights.len() {
        let _ = writeln!(text, "@group(0) @binding({i}) var blur_{i}: texture_2d<f32>;");
    }
    text += "@fragment\n\
             fn fs_sum(@builtin(position) at: vec4f) -> @location(0) vec4f {\n    \
             let texel = vec2i(at.xy);\n    \
             var sum = vec4f(0.0, 0.0, 0.0, textureLoad(blur_0, texel, 0).a);\n    \
             if sum.a == 0.0 {\n        return sum;\n    }\n";
    for (i, weight) in weights.iter().enumerate() {
        let _ = writeln!(
            text,
            "    sum += vec4f({} * textureLoad(blur_{i}, texel, 0).rgb, 0.0);",
            vec3f(*weight)
        );
    }
    text + "    return sum;\n}\n"
}

impl AtlasMethod for TextureCascade {
    fn prepare(&mut self, device: &Device, _: &Queue, atlas: &Atlas) -> Result<(), Error> {
        let uniform = uniform(device, atlas)?;
        let size = size(atlas.irradiance);
        let label = "rivals texture_cascade";
        let formats = [COLOR, STRETCH, COLOR];
        let views = scratch(device, label, self.scratch.take(), size, formats);
        if self.blurred.first().is_none_or(|v| super::pass::size(v) != size) {
            let blurred = self.blurs.iter().map(|_| texture(device, label, size, COLOR));
            self.blurred = blurred.collect();
        }
        let [color, stretch, rows] = self.scratch.insert(views);
        let bind = |pass: &Pass, color| {
            pass.bind(
                device,
                &[
                    BindingResource::TextureView(stretch),
                    BindingResource::TextureView(color),
                    BindingResource::Sampler(&self.linear),
                ],
            )
        };
        let sources = std::iter::once(&*color).chain(&self.blurred);
        let blurs = self
            .blurs
            .iter()
            .zip(sources)
            .map(|((u, v), source)| (bind(u, source), bind(v, rows)))
            .collect();
        let blurred: Vec<_> = self.blurred.iter().map(BindingResource::TextureView).collect();
        self.gutter.prepare(device, rows, atlas);
        self.prepared = Some(Prepared {
            pack: self.pack.bind(
                device,
                &[
                    uniform.as_entire_binding(),
                    BindingResource::TextureView(atlas.positions),
                    BindingResource::TextureView(atlas.irradiance),
                ],
            ),
            blurs,
            sum: self.sum.bind(device, &blurred),
        });
        Ok(())
    }

    fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error> {
        let (Some([color, stretch, rows]), Some(prepared)) = (&self.scratch, &self.prepared) else {
            return Ok(());
        };
        self.pack.draw(encoder, &prepared.pack, &[color, stretch]);
        for (i, (u, v)) in self.blurs.iter().enumerate() {
            u.draw(encoder, &prepared.blurs[i].0, &[rows]);
            v.draw(encoder, &prepared.blurs[i].1, &[&self.blurred[i]]);
        }
        self.sum.draw(encoder, &prepared.sum, &[rows]);
        self.gutter.render(encoder, output);
        Ok(())
    }

    fn scratch_bytes_per_texel(&self) -> f64 {
        8.0 + 4.0 + 8.0 + 8.0 * self.blurs.len() as f64
    }
}
