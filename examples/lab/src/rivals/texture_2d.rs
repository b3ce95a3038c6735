//! Each Gaussian as a full convolution over the atlas. Driver of `texture_2d.wgsl` and
//! `texture_2d_source.wgsl`.
//!
//! P. Li, Y. Shao. *GPU-based face rendering via the physical model of light interaction with human
//! skin.* 2015.

use crate::Error;
use subsurface::wgpu::{
    BindGroup, BindingResource, CommandEncoder, Device, Queue, TextureFormat, TextureView,
};
use subsurface::{Atlas, Profile};

use super::atlas::{ATLAS, Gutter, uniform};
use super::edge::terms;
use super::packed::COLOR;
use super::pass::{Pass, Slot, scratch, size};
use crate::method::AtlasMethod;

/// E·A and A: areas are too small for half floats.
const SOURCE: TextureFormat = TextureFormat::Rgba32Float;

pub struct Texture2d {
    source: Pass,
    sums: Vec<Pass>,
    gutter: Gutter,
    /// The source and two sums, of which each pass reads one and writes the other.
    scratch: Option<[TextureView; 3]>,
    prepared: Option<(BindGroup, Vec<BindGroup>)>,
}

impl Texture2d {
    pub fn new(device: &Device, format: TextureFormat, profile: &Profile) -> Self {
        let shader = [ATLAS, include_str!("texture_2d.wgsl")].concat();
        let sums = terms(profile)
            .into_iter()
            .enumerate()
            .map(|(i, (variance_mm2, weight))| {
                Pass::new(
                    device,
                    "rivals texture_2d sum",
                    (&shader, "fs_sum"),
                    &[Slot::Uniform, Slot::Float, Slot::Float, Slot::Float],
                    &[COLOR.into()],
                    &[
                        ("first", f64::from(u8::from(i == 0))),
                        ("variance_mm2", variance_mm2),
                        ("red", weight.x),
                        ("green", weight.y),
                        ("blue", weight.z),
                    ],
                )
            })
            .collect();
        Self {
            source: Pass::new(
                device,
                "rivals texture_2d source",
                (&[ATLAS, include_str!("texture_2d_source.wgsl")].concat(), "fs_source"),
                &[Slot::Uniform, Slot::Float, Slot::Float],
                &[SOURCE.into()],
                &[],
            ),
            sums,
            gutter: Gutter::new(device, format),
            scratch: None,
            prepared: None,
        }
    }
}

impl AtlasMethod for Texture2d {
    fn prepare(&mut self, device: &Device, _: &Queue, atlas: &Atlas) -> Result<(), Error> {
        let uniform = uniform(device, atlas)?;
        let size = size(atlas.irradiance);
        let label = "rivals texture_2d";
        let formats = [SOURCE, COLOR, COLOR];
        let views = scratch(device, label, self.scratch.take(), size, formats);
        let [source, even, odd] = &*self.scratch.insert(views);
        let bind = |pass: &Pass, textures: &[&TextureView]| {
            let mut resources =
                vec![uniform.as_entire_binding(), BindingResource::TextureView(atlas.positions)];
            resources.extend(textures.iter().map(|v| BindingResource::TextureView(v)));
            pass.bind(device, &resources)
        };
        let before = [even, odd].into_iter().cycle();
        let sums =
            self.sums.iter().zip(before).map(|(pass, before)| bind(pass, &[source, before])).collect();
        let last = if self.sums.len().is_multiple_of(2) { even } else { odd };
        self.gutter.prepare(device, last, atlas);
        self.prepared = Some((bind(&self.source, &[atlas.irradiance]), sums));
        Ok(())
    }

    fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error> {
        let (Some([source, even, odd]), Some((source_group, groups))) = (&self.scratch, &self.prepared)
        else {
            return Ok(());
        };
        self.source.draw(encoder, source_group, &[source]);
        let targets = [odd, even].into_iter().cycle();
        for ((pass, group), target) in self.sums.iter().zip(groups).zip(targets) {
            pass.draw(encoder, group, &[target]);
        }
        self.gutter.render(encoder, output);
        Ok(())
    }

    fn scratch_bytes_per_texel(&self) -> f64 {
        16.0 + 8.0 + 8.0
    }
}
