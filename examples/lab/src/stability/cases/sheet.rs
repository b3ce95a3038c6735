//! A sheet with bumps, as a glTF file whose UVs are as an artist may have left them, by the renderer that
//! plays the host.

use std::f32::consts::TAU;

use crate::Error;
use crate::method;
use glam::{Vec2, Vec3};

use crate::model::glb;
use crate::renderer::{AtlasRenderer, Camera, Light, Lighting, Renderer, Scene};
use crate::stability::case::{ATLAS, Outcome, Results};
use crate::stability::lab::Lab;
use crate::stability::trial::{Crop, apart, merge};

const SIDE_MM: f32 = 24.0;
/// Low enough to cast no shadow, whose edges would be as fine as a texel.
const BUMPS_MM: f32 = 0.5;
/// Squares along a side.
const GRID: u32 = 48;
const PIXELS: [u32; 2] = [96; 2];
/// Along a side of an atlas.
const TEXELS: u32 = 160;

/// UVs of a place on the sheet, x and y from 0 to 1.
pub type Uvs = fn(Vec2) -> Vec2;

/// On its page with room to spare.
pub const INSIDE: Uvs = |at| 0.05 + 0.9 * at;

/// Each method's largest difference, over these UVs, from the sheet with UVs [`INSIDE`].
///
/// # Errors
/// A sheet that cannot be drawn, or that a method refuses.
pub fn run(lab: &Lab, uvs: &[Uvs]) -> Result<Outcome, Error> {
    let (truth, skin) = scatter(lab, INSIDE)?;
    let mut outcome = Outcome::default();
    // Each is held to its own, so that a picture has room for one; the middle half is enough to see.
    let crop = Crop { first: [0, PIXELS[1] / 4], size: [PIXELS[0], PIXELS[1] / 2] };
    let own = truth.iter().find(|(name, _)| *name == ATLAS);
    let own = own.map(|(_, r)| r.iter().map(|v| v.as_dvec3()).enumerate().collect::<Vec<_>>());
    for uv in uvs {
        let (mut results, _) = scatter(lab, *uv)?;
        merge(&mut outcome.figures, apart(&results, &truth, &skin));
        results.retain(|(name, _)| *name == ATLAS);
        outcome.shown = own.as_ref().map(|own| crop.show(PIXELS[0], &results, own));
    }
    Ok(outcome)
}

/// The picture by every method, and the pixels of it that show skin.
fn scatter(lab: &Lab, uv: Uvs) -> Result<(Results, Vec<usize>), Error> {
    const MM_PER_UNIT: f32 = 1000.0;
    let gpu = &lab.gpu;
    let mut scene = Scene::from_glb(&sheet(uv))?;
    for material in &mut scene.materials {
        // An even normal map of 8 bits is not quite flat, and leans the other way where UVs are mirrored.
        material.normal_scale = 0.0;
    }
    let renderer = Renderer::new(gpu, &scene, PIXELS)?;
    let distance = 120.0;
    let camera = Camera {
        eye: Vec3::new(0.0, 0.0, distance / MM_PER_UNIT),
        target: Vec3::ZERO,
        fov_y: 2.0 * (0.52 * SIDE_MM / distance).atan(),
    };
    let lighting = Lighting {
        lights: vec![Light { direction: Vec3::new(-0.8, 0.4, 0.5), radius_degrees: 4.0, color: Vec3::ONE }],
        ..Default::default()
    };
    renderer.render(gpu, &camera, &lighting, MM_PER_UNIT)?;
    let buffers = &renderer.gbuffer;
    let output = renderer.scattered_target(gpu);
    let frame = buffers.frame(camera.projection(PIXELS), MM_PER_UNIT);
    let mut results = lab.scatter(&frame, &output)?;
    let atlas = AtlasRenderer::new(gpu, &renderer, TEXELS)?;
    lab.by_atlas(|name, method| {
        atlas.render(gpu, &renderer, 1, MM_PER_UNIT, &output, |atlas, output| {
            method::scatter_atlas(gpu, method, atlas, output)
        })?;
        results.push((name, lab.read(&output)));
        Ok(())
    })?;
    let ids = gpu.read_bytes(buffers.profile_id.texture()).into_iter().enumerate();
    Ok((results, ids.filter(|(_, id)| *id == 1).map(|(i, _)| i).collect()))
}

/// The sheet as a binary glTF file, in metres.
fn sheet(uv: Uvs) -> Vec<u8> {
    let corners = (0..=GRID).flat_map(|y| (0..=GRID).map(move |x| Vec2::new(x as f32, y as f32)));
    let corners: Vec<Vec2> = corners.map(|at| at / GRID as f32).collect();
    let positions: Vec<Vec3> = corners
        .iter()
        .map(|at| {
            let [x, y] = (*at * TAU).to_array();
            let bumps = BUMPS_MM * (3.0 * x).sin() * (2.0 * y).cos();
            ((*at - 0.5) * SIDE_MM).extend(bumps) / 1000.0
        })
        .collect();
    let uvs: Vec<Vec2> = corners.iter().map(|at| uv(*at)).collect();
    let square = |x: u32, y: u32| {
        let first = y * (GRID + 1) + x;
        let above = first + GRID + 1;
        [first, first + 1, above + 1, first, above + 1, above]
    };
    let indices: Vec<u32> = (0..GRID).flat_map(|y| (0..GRID).flat_map(move |x| square(x, y))).collect();
    let views = [
        bytemuck::cast_slice::<_, u8>(&positions),
        bytemuck::cast_slice(&uvs),
        bytemuck::cast_slice(&indices),
    ];
    let bytes = views.concat();
    let ends = positions.iter().copied();
    let least = ends.clone().fold(Vec3::INFINITY, Vec3::min).to_array();
    let greatest = ends.fold(Vec3::NEG_INFINITY, Vec3::max).to_array();
    let [positions_end, uvs_end] = [views[0].len(), views[0].len() + views[1].len()];
    let (vertices, corners) = (positions.len(), indices.len());
    let json = format!(
        r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": {}}}], "bufferViews": [
        {{"buffer": 0, "byteLength": {positions_end}}},
        {{"buffer": 0, "byteOffset": {positions_end}, "byteLength": {}}},
        {{"buffer": 0, "byteOffset": {uvs_end}, "byteLength": {}}}], "accessors": [
        {{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": {vertices},
            "min": {least:?}, "max": {greatest:?}}},
        {{"bufferView": 1, "componentType": 5126, "type": "VEC2", "count": {vertices}}},
        {{"bufferView": 2, "componentType": 5125, "type": "SCALAR", "count": {corners}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "TEXCOORD_0": 1}},
        "indices": 2}}]}}], "nodes": [{{"mesh": 0}}]}}"#,
        bytes.len(),
        views[1].len(),
        views[2].len(),
    );
    glb(json.as_bytes(), &bytes)
}
