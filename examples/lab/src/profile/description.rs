//! What a material may be described by, and what it does with light by that.

use std::path::Path;

use serde::Deserialize;
use serde_json::Value;
use subsurface::Profile;
use subsurface::physics::artist::{self, VolumeScatter};
use subsurface::physics::presets::{JENSEN_2001, donner_jensen_2005};
use subsurface::physics::{Fit, Layer, Medium, Response, Skin, Transport};

use crate::Error;

/// A material as its description has it.
#[derive(Clone, Debug)]
pub struct Description {
    /// For people.
    pub title: String,
    /// What leaves around a point of red, green and blue light.
    pub responses: [Response; 3],
    /// Whether the responses say how much light comes back, and the index of what reflects at the surface.
    pub albedo: Option<[f64; 3]>,
    /// The profile itself, where that is the description.
    pub profile: Option<Profile>,
}

/// What has a name of its own.
pub const NAMES: [&str; 9] =
    ["skin", "light", "medium", "dark", "layers", "skin1", "skin2", "marble", "whole-milk"];

/// The JSON of a description: one of these keys.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
enum Form {
    Preset(String),
    Medium(MediumForm),
    Skin(SkinForm),
    Burley(BurleyForm),
    Blender(BlenderForm),
    Unreal(UnrealForm),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MediumForm {
    eta: f64,
    /// From the surface down.
    layers: Vec<LayerForm>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LayerForm {
    /// None: the last.
    thickness_mm: Option<f64>,
    sigma_a_per_mm: [f64; 3],
    sigma_s_reduced_per_mm: [f64; 3],
    #[serde(default)]
    g: f64,
}

/// Light skin, but for what is said.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct SkinForm {
    melanin: f64,
    eumelanin: f64,
    haemoglobin: f64,
    oxygenation: f64,
    epidermis_mm: f64,
    g: f64,
}

impl Default for SkinForm {
    fn default() -> Self {
        let Skin { melanin, eumelanin, haemoglobin, oxygenation, epidermis_mm, g } = Skin::LIGHT;
        Self { melanin, eumelanin, haemoglobin, oxygenation, epidermis_mm, g }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BurleyForm {
    form: Burley,
    albedo: [f64; 3],
    mean_free_path_mm: [f64; 3],
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Burley {
    Searchlight,
    Diffuse,
    DiffuseMeanFreePath,
}

impl From<Burley> for artist::Burley {
    fn from(form: Burley) -> Self {
        match form {
            Burley::Searchlight => Self::Searchlight,
            Burley::Diffuse => Self::Diffuse,
            Burley::DiffuseMeanFreePath => Self::DiffuseMeanFreePath,
        }
    }
}

/// Blender's Principled BSDF.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BlenderForm {
    method: BlenderMethod,
    base_color: [f64; 3],
    radius: [f64; 3],
    scale: f64,
    #[serde(default)]
    anisotropy: f64,
    /// Of the random walk for skin alone.
    #[serde(default = "blender_ior")]
    ior: f64,
}

fn blender_ior() -> f64 {
    1.4
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum BlenderMethod {
    Burley,
    RandomWalk,
    RandomWalkSkin,
}

/// Unreal's subsurface profile, where "Enable Mean Free Path" is off.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct UnrealForm {
    surface_albedo: [f64; 3],
    mean_free_path_color: [f64; 3],
    /// In cm.
    mean_free_path_distance: f64,
    world_unit_scale: f64,
}

impl Description {
    /// A name of [`NAMES`]; a file of JSON (a description, or a profile as the library reads it); or a glTF
    /// file with KHR_materials_volume_scatter, behind `#` the name of one of its materials.
    ///
    /// # Errors
    /// What cannot be read, or is refused as a description; the error names it.
    pub fn load(text: &str) -> Result<Self, Error> {
        if let Some(preset) = Self::preset(text)? {
            return Ok(preset);
        }
        let (path, material) = match text.split_once('#') {
            Some((path, material)) => (path, Some(material)),
            None => (text, None),
        };
        let bytes = std::fs::read(path).map_err(|e| {
            let needs = format!("a file that can be read, or one of {}", NAMES.join(", "));
            Error::new(path, format!("\"{e}\""), needs)
        })?;
        let extension = Path::new(path).extension().map(|e| e.to_ascii_lowercase());
        match extension.as_ref().and_then(|e| e.to_str()) {
            Some("glb" | "gltf") => Self::gltf(&bytes, material),
            _ => Self::json(&String::from_utf8_lossy(&bytes)),
        }
        .map_err(|e| e.within(path))
    }

    /// What the library takes for skin where nobody says more.
    pub fn skin_of_2007() -> Self {
        Self::of_profile(Profile::SKIN, "skin, the six Gaussians of d'Eon & Luebke")
    }

    fn preset(name: &str) -> Result<Option<Self>, Error> {
        Ok(Some(match name {
            "skin" => Self::skin_of_2007(),
            "light" => Self::skin(Skin::LIGHT, "light skin")?,
            "medium" => Self::skin(Skin::MEDIUM, "medium skin")?,
            "dark" => Self::skin(Skin::DARK, "dark skin")?,
            "layers" => Self::media(donner_jensen_2005(0.0)?, "three layers of Donner & Jensen 2005")?,
            _ => match JENSEN_2001.into_iter().find(|m| m.name.replace(' ', "-") == name) {
                Some(measured) => {
                    Self::media(measured.media()?, &format!("{} of Jensen et al. 2001", measured.name))?
                }
                None => return Ok(None),
            },
        }))
    }

    fn json(text: &str) -> Result<Self, Error> {
        let needs = "a profile, {\"gaussians\": …}, or a description: one of preset, medium, skin, burley, \
                     blender and unreal";
        let refuse = |e: serde_json::Error| Error::new("description", format!("\"{e}\""), needs);
        let value: Value = serde_json::from_str(text).map_err(refuse)?;
        if value.get("gaussians").is_some() {
            return Ok(Self::of_profile(Profile::from_json(text)?, "a profile"));
        }
        match serde_json::from_value(value).map_err(refuse)? {
            Form::Preset(name) => Self::preset(&name)?
                .ok_or_else(|| Error::new("preset", name, format!("one of {}", NAMES.join(", ")))),
            Form::Medium(form) => form.describe(),
            Form::Skin(form) => {
                let SkinForm { melanin, eumelanin, haemoglobin, oxygenation, epidermis_mm, g } = form;
                let skin = Skin { melanin, eumelanin, haemoglobin, oxygenation, epidermis_mm, g };
                Self::skin(skin, "skin by its pigments")
            }
            Form::Burley(BurleyForm { form, albedo, mean_free_path_mm }) => {
                Self::burley(form.into(), albedo, mean_free_path_mm, "Burley's profile")
            }
            Form::Blender(form) => form.describe(),
            Form::Unreal(form) => form.describe(),
        }
    }

    /// A material of KHR_materials_volume_scatter.
    fn gltf(bytes: &[u8], name: Option<&str>) -> Result<Self, Error> {
        const EXTENSION: &str = "KHR_materials_volume_scatter";
        let refuse = |e: &dyn std::fmt::Display| Error::new("glTF", format!("\"{e}\""), "a glTF 2.0 file");
        let binary = bytes.starts_with(b"glTF");
        let glb =
            if binary { Some(gltf::binary::Glb::from_slice(bytes).map_err(|e| refuse(&e))?) } else { None };
        let json = glb.as_ref().map_or(bytes, |glb| &glb.json);
        let file: Value = serde_json::from_slice(json).map_err(|e| refuse(&e))?;
        let materials = file["materials"].as_array().map_or(&[][..], |m| m);
        let scatters = |m: &&Value| m["extensions"].get(EXTENSION).is_some();
        let names = || materials.iter().filter(scatters).map(|m| m["name"].as_str().unwrap_or_default());
        let chosen = materials.iter().filter(scatters).find(|m| name.is_none_or(|n| m["name"] == n));
        let Some(material) = chosen else {
            let got = name.map_or("none".into(), |name| format!("\"{name}\""));
            let needs = match names().next() {
                Some(_) => format!("one of {}", names().collect::<Vec<_>>().join(", ")),
                None => format!("a material with {EXTENSION}"),
            };
            return Err(Error::new("glTF: material", got, needs));
        };
        let extension = |name: &str| &material["extensions"][name];
        let number = |value: &Value, otherwise: f64| value.as_f64().unwrap_or(otherwise);
        let (scatter, volume) = (extension(EXTENSION), extension("KHR_materials_volume"));
        // What the extensions' texts have where a file has nothing.
        let medium = |c: usize| {
            VolumeScatter {
                multiscatter: number(&scatter["multiscatterColor"][c], 0.0),
                anisotropy: number(&scatter["scatterAnisotropy"], 0.0),
                attenuation: number(&volume["attenuationColor"][c], 1.0),
                attenuation_distance_m: number(&volume["attenuationDistance"], f64::INFINITY),
                ior: number(&extension("KHR_materials_ior")["ior"], 1.5),
            }
            .medium()
        };
        let title = format!("glTF material {}", material["name"].as_str().unwrap_or_default());
        Self::media([medium(0)?, medium(1)?, medium(2)?], title.trim_end())
    }

    fn of_profile(profile: Profile, title: &str) -> Self {
        let gaussian =
            |c: usize| profile.gaussians().iter().map(move |g| (g.variance_mm2.into(), g.weight[c].into()));
        let responses = [0, 1, 2].map(|c| Response::gaussians(gaussian(c)));
        Self { title: title.into(), responses, albedo: None, profile: Some(profile) }
    }

    fn skin(skin: Skin, title: &str) -> Result<Self, Error> {
        let eta = skin.spectrum()?[0].1.eta();
        Ok(Self::of(skin.responses(&Transport::default())?, eta, title))
    }

    fn media(media: [Medium; 3], title: &str) -> Result<Self, Error> {
        let eta = media[0].eta();
        Ok(Self::of(Transport::default().responses(&media)?, eta, title))
    }

    fn burley(
        form: artist::Burley,
        albedo: [f64; 3],
        mean_free_path_mm: [f64; 3],
        title: &str,
    ) -> Result<Self, Error> {
        let of = |c: usize| form.response(albedo[c], mean_free_path_mm[c]);
        Ok(Self::of([of(0)?, of(1)?, of(2)?], 1.0, title))
    }

    /// What is not reflected at the surface, straight on, goes in.
    fn of(responses: [Response; 3], eta: f64, title: &str) -> Self {
        let enters = 1.0 - ((eta - 1.0) / (eta + 1.0)).powi(2);
        let albedo = responses.each_ref().map(|r| enters * r.albedo());
        Self { title: title.into(), responses, albedo: Some(albedo), profile: None }
    }

    /// The profile: itself, or of so many Gaussians, or of as few as keep an error.
    ///
    /// # Errors
    /// As [`Fit::new`] and [`Fit::within`].
    pub fn profile(&self, gaussians: Option<usize>, max_error: f32) -> Result<Profile, Error> {
        Ok(match (self.profile, gaussians) {
            (Some(profile), None) => profile,
            (_, Some(gaussians)) => Fit::new(&self.responses, gaussians)?.profile,
            (None, None) => Fit::within(&self.responses, max_error.into())?.profile,
        })
    }
}

impl MediumForm {
    fn describe(self) -> Result<Description, Error> {
        let medium = |c: usize| {
            let layer = |l: &LayerForm| {
                let layer = Layer::isotropic(l.sigma_a_per_mm[c], l.sigma_s_reduced_per_mm[c]);
                layer.with_g(l.g).thick(l.thickness_mm.unwrap_or(f64::INFINITY))
            };
            Medium::new(&self.layers.iter().map(layer).collect::<Vec<_>>(), self.eta)
        };
        Description::media([medium(0)?, medium(1)?, medium(2)?], "a medium")
    }
}

impl BlenderForm {
    fn describe(self) -> Result<Description, Error> {
        let Self { method, base_color, radius, scale, anisotropy, ior } = self;
        let free = radius.map(|radius| artist::blender_mean_free_path_mm(radius, scale));
        let medium = |c: usize| match method {
            BlenderMethod::RandomWalkSkin => {
                artist::blender_skin(base_color[c], 1000.0 * radius[c] * scale, ior, anisotropy)
            }
            _ => artist::random_walk(base_color[c], free[c], anisotropy),
        };
        match method {
            BlenderMethod::Burley => {
                Description::burley(artist::Burley::Diffuse, base_color, free, "Blender, Burley")
            }
            BlenderMethod::RandomWalk => {
                Description::media([medium(0)?, medium(1)?, medium(2)?], "Blender, random walk")
            }
            BlenderMethod::RandomWalkSkin => {
                Description::media([medium(0)?, medium(1)?, medium(2)?], "Blender, random walk (skin)")
            }
        }
    }
}

impl UnrealForm {
    fn describe(self) -> Result<Description, Error> {
        // cm of the profile, by the scale that its world has.
        let mm = 10.0 * self.mean_free_path_distance * self.world_unit_scale;
        let form = artist::Burley::DiffuseMeanFreePath;
        let free = self.mean_free_path_color.map(|c| c * mm);
        Description::burley(form, self.surface_albedo, free, "Unreal's subsurface profile")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn widths(description: &Description) -> [f64; 3] {
        description.responses.each_ref().map(|r| r.half_width(0.9))
    }

    #[test]
    fn every_name_stands_for_a_material() {
        for name in NAMES {
            let found = Description::preset(name).unwrap().unwrap();
            let [red, _, blue] = widths(&found);
            assert!(red > blue && blue > 0.0, "{name}");
            let text = format!("{{\"preset\": \"{name}\"}}");
            assert_eq!(widths(&Description::json(&text).unwrap()), widths(&found));
        }
    }

    #[test]
    fn descriptions_are_what_they_say() {
        // The same medium twice.
        let layers = r#"{"medium": {"eta": 1.3, "layers": [{"sigma_a_per_mm": [0.032, 0.17, 0.48],
            "sigma_s_reduced_per_mm": [0.74, 0.88, 1.01]}]}}"#;
        let skin1 = Description::preset("skin1").unwrap().unwrap();
        assert_eq!(widths(&Description::json(layers).unwrap()), widths(&skin1));
        let light = Description::preset("light").unwrap().unwrap();
        assert_eq!(widths(&Description::json(r#"{"skin": {}}"#).unwrap()), widths(&light));
        let darker = Description::json(r#"{"skin": {"melanin": 0.1}}"#).unwrap();
        assert!(darker.albedo.unwrap()[0] < light.albedo.unwrap()[0]);
        // Burley's diffuse form, in metres over 4π as Blender has it.
        let burley = r#"{"burley": {"form": "diffuse", "albedo": [0.8, 0.5, 0.4], "mean_free_path_mm": [1, 0.2, 0.1]}}"#;
        let scale = 4.0 * std::f64::consts::PI / 1000.0;
        let blender = format!(
            r#"{{"blender": {{"method": "burley", "base_color": [0.8, 0.5, 0.4], "radius": [1, 0.2, 0.1], "scale": {scale}}}}}"#
        );
        let both = [burley, &blender].map(|text| widths(&Description::json(text).unwrap()));
        assert!(both[0].iter().zip(both[1]).all(|(a, b)| (a / b - 1.0).abs() < 1e-6), "{both:?}");
        let unreal = r#"{"unreal": {"surface_albedo": [0.911, 0.338, 0.272], "mean_free_path_color": [1, 0.089, 0.072],
            "mean_free_path_distance": 2.67, "world_unit_scale": 0.1}}"#;
        assert_eq!(
            Description::json(unreal).unwrap().albedo.unwrap().map(|a| (1e6 * a).round()),
            [911e3, 338e3, 272e3]
        );
        let profile =
            Description::json(r#"{"gaussians": [{"variance_mm2": 2, "weight": [1, 1, 1]}]}"#).unwrap();
        assert_eq!(profile.profile(None, 0.1).unwrap().gaussians()[0].variance_mm2, 2.0);
    }

    #[test]
    fn a_gltf_material_is_a_medium() {
        let file = r#"{"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_materials_volume_scatter"], "materials": [{"name": "plain"},
            {"name": "wax", "extensions": {"KHR_materials_volume": {"attenuationColor": [0.5, 0.3, 0.2], "attenuationDistance": 0.001},
            "KHR_materials_volume_scatter": {"multiscatterColor": [0.8, 0.6, 0.4]}, "KHR_materials_ior": {"ior": 1.4}}}]}"#;
        let [first, named] =
            [None, Some("wax")].map(|name| Description::gltf(file.as_bytes(), name).unwrap());
        assert_eq!(first.title, "glTF material wax");
        assert_eq!(widths(&first), widths(&named));
        for (name, says) in [(Some("plain"), "one of wax"), (Some("none"), "one of wax")] {
            let error = Description::gltf(file.as_bytes(), name).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
        let error = Description::gltf(file.replace("0.001", "0").as_bytes(), None).unwrap_err();
        assert!(error.to_string().contains("attenuationDistance"), "{error}");
    }

    #[test]
    fn what_describes_nothing_is_named() {
        for (text, says) in [
            ("", "description: got"),
            ("[]", "needs a profile"),
            (r#"{"wax": 1}"#, "unknown variant `wax`"),
            (r#"{"preset": "wax"}"#, "preset: got wax"),
            (r#"{"skin": {"melanine": 1}}"#, "unknown field `melanine`"),
            (r#"{"skin": {"melanin": 2}}"#, "skin: melanin: got 2"),
            (r#"{"medium": {"eta": 1.4, "layers": []}}"#, "medium: layers: got 0"),
            (r#"{"gaussians": []}"#, "profile: Gaussians: got 0"),
        ] {
            let error = Description::json(text).unwrap_err().to_string();
            assert!(error.contains(says), "{error} does not say {says}");
        }
        let error = Description::load("no-such-file.json").unwrap_err().to_string();
        assert!(error.starts_with("no-such-file.json: got") && error.contains("whole-milk"), "{error}");
    }
}
