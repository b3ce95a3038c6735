//! What scatters, and by which profile.

use std::collections::HashMap;

use bevy::asset::{AssetId, Assets};
use bevy::ecs::prelude::{Component, Local, Query, ReflectComponent, ResMut, Resource};
use bevy::log::warn;
use bevy::math::Vec3;
use bevy::pbr::{MeshMaterial3d, StandardMaterial};
use bevy::reflect::{Reflect, std_traits::ReflectDefault};
use bevy::render::RenderApp;
use bevy::render::extract_resource::ExtractResource;
use subsurface::{Error, Gaussian, MAX_PROFILES, Profile};

/// The first of the [`MAX_PROFILES`] values of `StandardMaterial::deferred_lighting_pass_id` that say by
/// which profile a material scatters. They are the highest, so that one draw finds all of them.
pub const FIRST_PASS_ID: u8 = 255 - (MAX_PROFILES as u8 - 1);

/// Component that makes a mesh scatter light: a diffusion profile, as a sum of Gaussians.
///
/// The profile is that of the mesh's `MeshMaterial3d<StandardMaterial>`, so all meshes that share the material
/// scatter with it; give others a material of their own. Removing the component gives the material back as it
/// was. Materials of other types, such as `ExtendedMaterial`, name a profile by
/// [`SubsurfaceProfiles::pass_id`].
///
/// Whatever the profile, metal does not scatter: `metallic` is taken for 0.
///
/// Default: skin.
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct SubsurfaceProfile {
    /// One to eight Gaussians. The weights of each color are scaled to sum to 1.
    pub gaussians: Vec<SubsurfaceGaussian>,
}

/// A Gaussian of a [`SubsurfaceProfile`].
#[derive(Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Clone, Debug, PartialEq)]
pub struct SubsurfaceGaussian {
    /// Variance along one axis, in mm². Zero leaves light where it fell.
    pub variance_mm2: f32,
    /// Weight of linear red, green and blue light, each at least 0.
    pub weight: Vec3,
}

impl Default for SubsurfaceProfile {
    fn default() -> Self {
        Profile::SKIN.into()
    }
}

impl From<Profile> for SubsurfaceProfile {
    fn from(profile: Profile) -> Self {
        let of = |g: &Gaussian| SubsurfaceGaussian {
            variance_mm2: g.variance_mm2,
            weight: Vec3::from_array(g.weight),
        };
        Self { gaussians: profile.gaussians().iter().map(of).collect() }
    }
}

impl TryFrom<&SubsurfaceProfile> for Profile {
    type Error = Error;

    fn try_from(profile: &SubsurfaceProfile) -> Result<Self, Error> {
        let of =
            |g: &SubsurfaceGaussian| Gaussian { variance_mm2: g.variance_mm2, weight: g.weight.to_array() };
        Self::new(&profile.gaussians.iter().map(of).collect::<Vec<_>>())
    }
}

/// The profiles that materials scatter by, up to [`MAX_PROFILES`] at a time. Their places are the
/// `deferred_lighting_pass_id`s from [`FIRST_PASS_ID`] on.
#[derive(Resource, Clone, Debug, Default, ExtractResource)]
#[extract_app(RenderApp)]
pub struct SubsurfaceProfiles {
    places: Vec<Place>,
}

#[derive(Clone, Debug)]
struct Place {
    profile: Profile,
    /// Whether a mesh that was looked at last had this profile.
    of_mesh: bool,
    /// Whether its id was handed out.
    is_held: bool,
}

impl SubsurfaceProfiles {
    /// The `deferred_lighting_pass_id` of a profile, for materials that have no mesh component: set
    /// `StandardMaterial::deferred_lighting_pass_id`, or that of an `ExtendedMaterial`'s base. The profile
    /// keeps its place from then on.
    ///
    /// # Errors
    /// A profile that has no Gaussian, or one that is not a number; more than [`MAX_PROFILES`] profiles.
    pub fn pass_id(&mut self, profile: &SubsurfaceProfile) -> Result<u8, Error> {
        let place = self.place(profile.try_into()?)?;
        self.places[place].is_held = true;
        Ok(pass_id(place))
    }

    /// The profiles, the first of which has the id [`FIRST_PASS_ID`].
    pub fn profiles(&self) -> impl Iterator<Item = Profile> + '_ {
        self.places.iter().map(|place| place.profile)
    }

    /// The place of a profile: the one that it has, else a new one, else one that nobody uses.
    fn place(&mut self, profile: Profile) -> Result<usize, Error> {
        if let Some(place) = self.places.iter().position(|p| p.profile == profile) {
            return Ok(place);
        }
        let new = Place { profile, of_mesh: false, is_held: false };
        if self.places.len() < MAX_PROFILES {
            self.places.push(new);
            return Ok(self.places.len() - 1);
        }
        match self.places.iter().position(|p| !p.of_mesh && !p.is_held) {
            Some(place) => {
                self.places[place] = new;
                Ok(place)
            }
            None => {
                Err(Error::Count { input: "profiles", got: MAX_PROFILES + 1, needs: [1, MAX_PROFILES] })
            }
        }
    }
}

fn pass_id(place: usize) -> u8 {
    FIRST_PASS_ID + place as u8
}

/// A material that scatters since a mesh has a profile.
#[derive(Debug)]
pub(crate) struct Assigned {
    pass_id: u8,
    before: u8,
}

/// Gives the materials of meshes with a profile their pass id, and the others theirs back.
pub(crate) fn assign_profiles(
    meshes: Query<(&SubsurfaceProfile, &MeshMaterial3d<StandardMaterial>)>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut profiles: ResMut<SubsurfaceProfiles>,
    mut assigned: Local<HashMap<AssetId<StandardMaterial>, Assigned>>,
    mut warned: Local<Vec<String>>,
) {
    if meshes.is_empty() && assigned.is_empty() {
        return;
    }
    let mut warn = |message: String| {
        if !warned.contains(&message) {
            warn!("{message}");
            warned.push(message);
        }
    };
    let mut wanted = HashMap::new();
    for (profile, material) in &meshes {
        match Profile::try_from(profile) {
            Ok(profile) => {
                if *wanted.entry(material.id()).or_insert(profile) != profile {
                    warn(format!(
                        "Meshes that share the material {} have different SubsurfaceProfiles, and one of them \
                         is used for all. Give each profile a material of its own.",
                        material.id()
                    ));
                }
            }
            Err(error) => warn(format!("A SubsurfaceProfile is not used: {error}.")),
        }
    }
    for place in &mut profiles.places {
        place.of_mesh = wanted.values().any(|profile| *profile == place.profile);
    }
    assigned.retain(|id, assigned| {
        let stays = wanted.contains_key(id);
        if !stays
            && let Some(mut material) = materials.get_mut(*id)
            && material.deferred_lighting_pass_id == assigned.pass_id
        {
            material.deferred_lighting_pass_id = assigned.before;
        }
        stays
    });
    for (id, profile) in wanted {
        let place = match profiles.place(profile) {
            Ok(place) => place,
            Err(error) => {
                warn(format!("A SubsurfaceProfile is not used: {error}."));
                continue;
            }
        };
        profiles.places[place].of_mesh = true;
        let Some(found) = materials.get(id).map(|material| material.deferred_lighting_pass_id) else {
            continue; // not loaded yet
        };
        let pass_id = pass_id(place);
        let before = match assigned.get(&id) {
            Some(assigned) if found == assigned.pass_id => assigned.before,
            _ => found,
        };
        if found != pass_id
            && let Some(mut material) = materials.get_mut(id)
        {
            material.deferred_lighting_pass_id = pass_id;
        }
        assigned.insert(id, Assigned { pass_id, before });
    }
}
