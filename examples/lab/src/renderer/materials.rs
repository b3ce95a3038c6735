//! The materials of a glTF file: what they show, how their textures lie, and whether they are skin.

use crate::Error;
use glam::{Affine2, Vec2};
use gltf::json::Value;
use gltf::material::AlphaMode;
use gltf::texture::WrappingMode;

use super::names;
use super::reader::{Reader, read_uri};
use super::scene::{Image, Material};

/// What all images of a scene may take when decoded: eight of 8192×8192.
const MAX_IMAGE_BYTES: u64 = 2 << 30;

impl Reader<'_> {
    /// A material, and how its textures lie on the mesh. Its reason is empty where no name says what it is.
    pub(super) fn material<'a>(
        &mut self,
        from: &gltf::Material<'a>,
        [mesh, node]: [&str; 2],
        alone: bool,
    ) -> Result<(Material, Mapping), Error> {
        let name = from.name().unwrap_or(mesh).to_string();
        let (profile_id, reason) = profile(from, &name, [mesh, node], alone)?;
        let pbr = from.pbr_metallic_roughness();
        let old = from.pbr_specular_glossiness();
        let (factor, base, roughness) = match &old {
            Some(old) => (old.diffuse_factor(), old.diffuse_texture(), 1.0 - old.glossiness_factor()),
            None => (pbr.base_color_factor(), pbr.base_color_texture(), pbr.roughness_factor()),
        };
        let lay = |texture: gltf::Texture<'a>, set: u32, transform: Option<&Value>| {
            (Mapping::new(&texture, set, transform), texture)
        };
        let key = "KHR_texture_transform";
        let base = base.map(|t| lay(t.texture(), t.tex_coord(), t.extension_value(key)));
        let normal = from.normal_texture();
        let normal_scale = normal.as_ref().map_or(1.0, |t| t.scale());
        let mut normal = normal.map(|t| lay(t.texture(), t.tex_coord(), t.extension_value(key)));
        if let (Some(base), Some(map)) = (&base, &normal)
            && base.0 != map.0
        {
            self.scene.left_out.insert(format!("{name}'s normal map, whose UVs are not its colours'"));
            normal = None;
        }
        let mapping = base.as_ref().or(normal.as_ref()).map(|(mapping, _)| *mapping);
        let mapping = mapping.unwrap_or_default();
        // JSON holds no infinity, but numbers that are too large for a float.
        if !normal_scale.is_finite() {
            let input = format!("{name}, normalTexture scale");
            return Err(Error::new(input, normal_scale, "a finite number"));
        }
        let mut image = |texture: Option<(Mapping, gltf::Texture)>| {
            texture.map(|(_, texture)| self.image(&texture)).transpose()
        };
        let material = Material {
            base_color_texture: image(base)?,
            normal_texture: image(normal)?,
            name,
            base_color: factor.map(|c| c.clamp(0.0, 1.0)),
            wrap: mapping.wrap,
            normal_scale,
            roughness: roughness.clamp(0.0, 1.0),
            alpha_cutoff: match from.alpha_mode() {
                AlphaMode::Opaque => 0.0,
                AlphaMode::Mask => from.alpha_cutoff().unwrap_or(0.5).clamp(0.0, 1.0),
                AlphaMode::Blend => 0.5,
            },
            profile_id,
            reason,
        };
        Ok((material, mapping))
    }

    fn image(&mut self, texture: &gltf::Texture) -> Result<usize, Error> {
        // Not through the crate's `Image::source`, which panics if there is none.
        let images = &self.document.as_json().images;
        let webp = || texture.extension_value("EXT_texture_webp")?.get("source")?.as_u64();
        let source = texture.source().map(|image| image.index());
        let source = source.or_else(|| usize::try_from(webp()?).ok());
        let Some((index, json)) = source.and_then(|i| Some((i, images.get(i)?))) else {
            let others: Vec<_> = texture.extensions().into_iter().flat_map(|all| all.keys()).collect();
            let got = format!("no image, but {others:?}");
            let input = format!("{}, texture {}", self.input, texture.index());
            return Err(Error::new(input, got, "a JPEG, PNG or WebP image"));
        };
        if let Some(&known) = self.images.get(&index) {
            return Ok(known);
        }
        let mut views = self.document.views();
        let view = json.buffer_view.and_then(|view| views.nth(view.value()));
        let embedded = view.and_then(|view| self.buffers.view(&view));
        let bytes = match &json.uri {
            Some(uri) => read_uri(uri, self.base),
            None => embedded.map(<[u8]>::to_vec).ok_or("no bytes".into()),
        };
        let input = || format!("{}, image {index}", self.input);
        let fail = |got| Error::new(input(), got, "a JPEG, PNG or WebP image");
        let bytes = bytes.map_err(fail)?;
        // One by one the decoder holds them to 512 MiB.
        let held = self.scene.images.iter().map(|i| i.rgba8.len() as u64).sum();
        let [width, height] = image_size(&bytes).map_err(|e| fail(e.to_string()))?;
        if !fits(held, [width, height]) {
            let got = format!("{width}x{height} pixels after {} MiB of others", held >> 20);
            let needs = format!("{} MiB at most together", MAX_IMAGE_BYTES >> 20);
            return Err(Error::new(input(), got, needs));
        }
        let pixels = image::load_from_memory(&bytes).map_err(|e| fail(e.to_string()))?;
        let pixels = pixels.into_rgba8();
        self.scene.images.push(Image {
            width: pixels.width(),
            height: pixels.height(),
            rgba8: pixels.into_raw(),
        });
        self.images.insert(index, self.scene.images.len() - 1);
        Ok(self.scene.images.len() - 1)
    }
}

/// Whether an image may follow those that take so many bytes.
fn fits(held: u64, size: [u32; 2]) -> bool {
    let [width, height] = size.map(u64::from);
    let bytes = width.checked_mul(height).and_then(|n| n.checked_mul(4));
    bytes.is_some_and(|bytes| held.saturating_add(bytes) <= MAX_IMAGE_BYTES)
}

/// The size that an image says it has, without its pixels.
fn image_size(bytes: &[u8]) -> image::ImageResult<[u32; 2]> {
    let reader = image::ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format()?;
    reader.into_dimensions().map(<[u32; 2]>::from)
}

/// How a texture lies on a mesh.
#[derive(Clone, Copy, Default, PartialEq)]
pub(super) struct Mapping {
    /// Which of the mesh's UVs.
    pub set: u32,
    pub transform: Affine2,
    pub wrap: [wgpu::AddressMode; 2],
}

impl Mapping {
    /// KHR_texture_transform: scaled, turned against the clock, which v downwards makes a negative angle, moved.
    fn new(texture: &gltf::Texture, set: u32, transform: Option<&Value>) -> Self {
        let number = |key: &str, i: usize| {
            let value = transform?.get(key)?;
            Some(value.get(i).unwrap_or(value).as_f64()? as f32)
        };
        let pair = |key, default| Vec2::from([0, 1].map(|i| number(key, i).unwrap_or(default)));
        let angle = -number("rotation", 0).unwrap_or(0.0);
        let own_set = transform.and_then(|t| t.get("texCoord")?.as_u64()?.try_into().ok());
        let sampler = texture.sampler();
        Self {
            set: own_set.unwrap_or(set),
            transform: Affine2::from_scale_angle_translation(
                pair("scale", 1.0),
                angle,
                pair("offset", 0.0),
            ),
            wrap: [sampler.wrap_s(), sampler.wrap_t()].map(|wrap| match wrap {
                WrappingMode::ClampToEdge => wgpu::AddressMode::ClampToEdge,
                WrappingMode::MirroredRepeat => wgpu::AddressMode::MirrorRepeat,
                WrappingMode::Repeat => wgpu::AddressMode::Repeat,
            }),
        }
    }
}

/// The scattering profile of a material and what tells it: `extras.subsurface_profile`, what the surface is
/// made of, then the names, the material's before its mesh's. An empty reason where nothing tells.
fn profile(
    from: &gltf::Material,
    name: &str,
    [mesh, node]: [&str; 2],
    alone: bool,
) -> Result<(u8, String), Error> {
    let extras = from.extras().as_ref().map(|raw| raw.get());
    let extras: Option<Value> = extras.and_then(|text| gltf::json::deserialize::from_str(text).ok());
    if let Some(profile) = extras.as_ref().and_then(|extras| extras.get("subsurface_profile")) {
        let in_range = |p: &f64| p.fract() == 0.0 && (0.0..=255.0).contains(p);
        let input = || format!("{name}, subsurface_profile");
        let fail = || Error::new(input(), profile, "an integer from 0 to 255");
        let id = profile.as_f64().filter(in_range).ok_or_else(fail)?;
        return Ok((id as u8, "subsurface_profile".into()));
    }
    let pbr = from.pbr_metallic_roughness();
    let (metallic, roughness) = (pbr.metallic_factor(), pbr.roughness_factor());
    // Both at their default of 1 say nothing, and a map says more than its factor.
    let is_metal = metallic > 0.5
        && (metallic, roughness) != (1.0, 1.0)
        && pbr.metallic_roughness_texture().is_none()
        && from.pbr_specular_glossiness().is_none();
    let transmits = from.transmission().is_some_and(|t| t.transmission_factor() > 0.0);
    let scatters = ["KHR_materials_volume_scatter", "KHR_materials_diffuse_transmission"];
    // A mesh of several materials is not named for each.
    let others = [name].into_iter().chain([mesh, node].into_iter().filter(|_| alone));
    let other = others.filter_map(names::not_skin).next();
    let word = [name, mesh, node].into_iter().find_map(names::skin);
    Ok(if is_metal {
        (0, "a metal".into())
    } else if transmits {
        (0, "lets light through".into())
    } else if let Some(other) = other {
        (0, format!("\"{other}\""))
    } else if let Some(scatters) = scatters.into_iter().find(|e| from.extension_value(e).is_some()) {
        (1, scatters.into())
    } else if let Some(word) = word {
        (1, format!("\"{word}\""))
    } else if from.alpha_mode() == AlphaMode::Blend {
        (0, "blended".into())
    } else {
        (0, String::new())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_have_a_budget_together() {
        assert!(fits(0, [8192, 8192]));
        assert!(fits(MAX_IMAGE_BYTES - 4, [1, 1]));
        assert!(!fits(MAX_IMAGE_BYTES, [1, 1]));
        assert!(!fits(u64::MAX, [1, 1]));
        assert!(!fits(0, [u32::MAX; 2]));
    }
}
