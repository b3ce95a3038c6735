//! What a camera asks for.

use bevy::core_pipeline::prepass::{DeferredPrepass, DepthPrepass};
use bevy::ecs::prelude::{Component, ReflectComponent};
use bevy::reflect::{Reflect, std_traits::ReflectDefault};
use bevy::render::RenderApp;
use bevy::render::extract_component::ExtractComponent;
use bevy::render::view::Msaa;

/// Component that enables subsurface scattering for a camera.
///
/// What scatters are the meshes that have a [`SubsurfaceProfile`](crate::SubsurfaceProfile), as far as they
/// are opaque and drawn by the deferred renderer. The picture of a camera without this component is Bevy's
/// own.
///
/// # Usage Notes
///
/// Deferred rendering itself is not enabled: insert `DefaultOpaqueRendererMethod::deferred()` as a resource,
/// or set `StandardMaterial::opaque_render_method` of the skin.
///
/// The camera must have [`Msaa::Off`], as all deferred cameras. `Hdr` is not needed.
///
/// WebGL 2 has no storage buffers, so nothing scatters there.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect, ExtractComponent)]
#[extract_app(RenderApp)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
#[require(DepthPrepass, DeferredPrepass, Msaa = Msaa::Off)]
#[doc(alias = "Sss")]
pub struct SubsurfaceScattering {
    /// The largest error on flat edges of light, in units of white: of the radiance that the camera, by its
    /// exposure, shows as 1. The cheapest blurs that keep it are chosen; a change takes some frames to be
    /// made ready, and the one before is used until then.
    ///
    /// Zero asks for the sum itself, many times dearer: a reference to hold a frame to. An error that no set
    /// of blurs keeps (for skin below about 0.001) is raised to the least that can be kept.
    ///
    /// Default: 1/255.
    pub max_error: f32,

    /// The share of the light that scatters, from 0, none, to 1, all.
    ///
    /// Default: 1.
    pub strength: f32,

    /// Length of a unit of the scene in mm.
    ///
    /// Default: 1000, a scene in metres.
    pub mm_per_unit: f32,

    /// What is shown in place of skin.
    pub debug: SubsurfaceDebug,
}

impl Default for SubsurfaceScattering {
    fn default() -> Self {
        Self {
            max_error: subsurface::DEFAULT_MAX_ERROR,
            strength: 1.0,
            mm_per_unit: 1000.0,
            debug: SubsurfaceDebug::Off,
        }
    }
}

/// What a camera shows in place of skin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Default, Clone, Debug, PartialEq)]
pub enum SubsurfaceDebug {
    /// The scattered picture.
    #[default]
    Off,
    /// Diffuse light before it scatters, without albedo.
    Irradiance,
    /// Diffuse light after it has scattered, without albedo.
    Scattered,
    /// Half of white, and what scattering adds to the diffuse light.
    Difference,
}

impl SubsurfaceDebug {
    /// As in lighting.wesl.
    pub(crate) fn code(self) -> u32 {
        match self {
            Self::Off => 0,
            Self::Irradiance => 1,
            Self::Scattered => 2,
            Self::Difference => 3,
        }
    }
}
