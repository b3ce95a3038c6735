//! Which materials of a glTF file are skin.

use bevy::ecs::prelude::{Added, Commands, Entity, Or, Query, Res, Resource, Without};
use bevy::gltf::{GltfMaterialExtras, GltfMaterialName};
use bevy::log::warn;
use subsurface::Profile;

use crate::SubsurfaceProfile;

/// Says which materials of glTF files scatter, by name or by an extra, as their meshes are spawned.
///
/// A material's extra `subsurface_profile` comes first: 0 for none; a number *i* for the *i*-th of
/// [`profiles`](Self::profiles), counted from 1; or a profile in full,
/// `{"gaussians": [{"variance_mm2": 0.5, "weight": [1, 1, 1]}]}`.
///
/// ```
/// # use bevy::prelude::*;
/// # use subsurface_bevy::{SubsurfaceGltf, SubsurfaceProfile};
/// App::new().insert_resource(SubsurfaceGltf {
///     materials: vec![("Skin_Head".into(), SubsurfaceProfile::default())],
///     ..default()
/// });
/// ```
#[derive(Resource, Clone, Debug, PartialEq)]
pub struct SubsurfaceGltf {
    /// Names of materials, and the profile of each.
    ///
    /// Default: none.
    pub materials: Vec<(String, SubsurfaceProfile)>,

    /// The profiles that extras name by their number.
    ///
    /// Default: skin.
    pub profiles: Vec<SubsurfaceProfile>,
}

impl Default for SubsurfaceGltf {
    fn default() -> Self {
        Self { materials: Vec::new(), profiles: vec![SubsurfaceProfile::default()] }
    }
}

impl SubsurfaceGltf {
    /// The profile of a material; `None` if it does not scatter, an error if its extra cannot be read.
    fn profile(
        &self,
        name: Option<&str>,
        extras: Option<&str>,
    ) -> Result<Option<SubsurfaceProfile>, String> {
        let extra = extras
            .and_then(|text| serde_json::from_str::<serde_json::Value>(text).ok())
            .and_then(|extras| extras.get("subsurface_profile").cloned());
        let Some(extra) = extra else {
            let named = self.materials.iter().find(|(n, _)| Some(n.as_str()) == name);
            return Ok(named.map(|(_, profile)| profile.clone()));
        };
        if extra.is_object() {
            let profile = Profile::from_json(&extra.to_string()).map_err(|e| e.to_string())?;
            return Ok(Some(profile.into()));
        }
        let Some(number) = extra.as_u64() else {
            return Err(format!("got {extra}, needs a number or a profile"));
        };
        let Some(place) = number.checked_sub(1) else {
            return Ok(None);
        };
        match self.profiles.get(usize::try_from(place).unwrap_or(usize::MAX)) {
            Some(profile) => Ok(Some(profile.clone())),
            None => Err(format!("got {number}, needs 0 to {}", self.profiles.len())),
        }
    }
}

type Spawned = (Or<(Added<GltfMaterialName>, Added<GltfMaterialExtras>)>, Without<SubsurfaceProfile>);

/// Gives the meshes of a glTF file that was spawned their profiles.
pub(crate) fn mark_skin(
    mut commands: Commands,
    gltf: Res<SubsurfaceGltf>,
    spawned: Query<(Entity, Option<&GltfMaterialName>, Option<&GltfMaterialExtras>), Spawned>,
) {
    for (entity, name, extras) in &spawned {
        let name = name.map(|name| name.0.as_str());
        match gltf.profile(name, extras.map(|extras| extras.value.as_str())) {
            Ok(Some(profile)) => {
                commands.entity(entity).insert(profile);
            }
            Ok(None) => {}
            Err(error) => {
                warn!(
                    "glTF material {}: extra subsurface_profile: {error}.",
                    name.unwrap_or("without a name")
                );
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_extra_comes_before_a_name() {
        let skin = SubsurfaceProfile::default();
        let gltf = SubsurfaceGltf { materials: vec![("Skin".into(), skin.clone())], ..Default::default() };
        for (name, extras, profile) in [
            (None, None, Ok(None)),
            (Some("Skin"), None, Ok(Some(skin.clone()))),
            (Some("skin"), None, Ok(None)),
            (Some("Skin"), Some(r#"{"other": 1}"#), Ok(Some(skin.clone()))),
            (Some("Skin"), Some(r#"{"subsurface_profile": 0}"#), Ok(None)),
            (Some("Eye"), Some(r#"{"subsurface_profile": 1}"#), Ok(Some(skin))),
            (None, Some(r#"{"subsurface_profile": 2}"#), Err("got 2, needs 0 to 1".into())),
            (
                None,
                Some(r#"{"subsurface_profile": "x"}"#),
                Err("got \"x\", needs a number or a profile".into()),
            ),
        ] {
            assert_eq!(gltf.profile(name, extras), profile, "{name:?} {extras:?}");
        }
        let of = |variance: &str| {
            let gaussian = format!(r#"{{"variance_mm2": {variance}, "weight": [1, 1, 1]}}"#);
            let extras = format!(r#"{{"subsurface_profile": {{"gaussians": [{gaussian}]}}}}"#);
            gltf.profile(None, Some(&extras))
        };
        assert_eq!(of("0.5").unwrap().unwrap().gaussians[0].variance_mm2, 0.5);
        assert!(of("-1").unwrap_err().contains("variance_mm2"));
    }
}
