//! Says, once, why something does not scatter.

use bevy::asset::{AssetId, Assets};
use bevy::camera::Camera;
use bevy::core_pipeline::prepass::{DeferredPrepass, DepthPrepass};
use bevy::ecs::prelude::{Has, Local, Query, Res, With};
use bevy::log::{warn, warn_once};
use bevy::material::{AlphaMode, OpaqueRendererMethod};
use bevy::pbr::{DefaultOpaqueRendererMethod, MeshMaterial3d, StandardMaterial};
use bevy::reflect::tuple_struct::TupleStruct;

use crate::{SubsurfaceProfile, SubsurfaceScattering};

/// What is wrong with a material that should scatter, and what to do about it.
fn fault(material: &StandardMaterial, default_method: OpaqueRendererMethod) -> Option<&'static str> {
    let method = match material.opaque_render_method {
        OpaqueRendererMethod::Auto => default_method,
        method => method,
    };
    if !matches!(material.alpha_mode, AlphaMode::Opaque | AlphaMode::Mask(_)) {
        return Some("is transparent: set its alpha_mode to AlphaMode::Opaque or AlphaMode::Mask");
    }
    (method != OpaqueRendererMethod::Deferred).then_some(
        "is drawn by the forward renderer: insert the resource DefaultOpaqueRendererMethod::deferred(), or \
         set its opaque_render_method to OpaqueRendererMethod::Deferred",
    )
}

/// Looks for cameras and materials that cannot scatter. Bevy itself tells of [`Msaa`](bevy::prelude::Msaa).
pub(crate) fn warn_of_unscattered(
    cameras: Query<(Has<DeferredPrepass>, Has<DepthPrepass>), (With<Camera>, With<SubsurfaceScattering>)>,
    skin: Query<&MeshMaterial3d<StandardMaterial>, With<SubsurfaceProfile>>,
    materials: Res<Assets<StandardMaterial>>,
    default_method: Res<DefaultOpaqueRendererMethod>,
    mut warned: Local<Vec<AssetId<StandardMaterial>>>,
) {
    if cameras.is_empty() {
        return;
    }
    if cameras.iter().any(|(deferred, depth)| !deferred || !depth) {
        warn_once!(
            "A camera has SubsurfaceScattering, but lacks a prepass that it needs: insert DeferredPrepass and \
             DepthPrepass."
        );
    }
    // The field is private, but reflected.
    let default_method = default_method.field(0).and_then(|method| method.try_downcast_ref());
    let default_method = default_method.copied().unwrap_or_default();
    for material in &skin {
        let id = material.id();
        let fault = materials.get(id).and_then(|material| fault(material, default_method));
        if let Some(fault) = fault
            && !warned.contains(&id)
        {
            warned.push(id);
            warn!("A mesh with a SubsurfaceProfile does not scatter, since its material {id} {fault}.");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_names_its_remedy() {
        use OpaqueRendererMethod::{Auto, Deferred, Forward};
        let of = |alpha_mode, opaque_render_method, default| {
            let material = StandardMaterial { alpha_mode, opaque_render_method, ..Default::default() };
            fault(&material, default)
        };
        assert_eq!(of(AlphaMode::Opaque, Auto, Deferred), None);
        assert_eq!(of(AlphaMode::Mask(0.5), Deferred, Forward), None);
        assert!(of(AlphaMode::Opaque, Auto, Forward).is_some_and(|f| f.contains("deferred()")));
        assert!(
            of(AlphaMode::Opaque, Forward, Deferred).is_some_and(|f| f.contains("opaque_render_method"))
        );
        assert!(of(AlphaMode::Blend, Auto, Deferred).is_some_and(|f| f.contains("alpha_mode")));
    }
}
