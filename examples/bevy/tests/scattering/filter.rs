//! A frame of Bevy through the program `filter`, which knows nothing of Bevy.

use std::path::Path;
use std::process::Command;

use bevy::camera::MainPassResolutionOverride;
use bevy::math::UVec2;
use bevy::render::RenderApp;
use bevy::render::render_resource::Texture;
use bevy::render::sync_world::RenderEntity;
use bevy::render::view::{ExtractedView, ViewDepthStencilTexture};
use exr::prelude::{read_first_rgba_layer_from_file, write_rgb_file};
use subsurface_bevy::{SubsurfaceProfile, SubsurfaceScattering};

use crate::picture::Picture;
use crate::scene::{HDR, SIZE, add_balls, add_camera, add_sun};
use crate::stage::Stage;

/// Rows of the left upper part of a picture.
fn crop(picture: &Picture, size: [u32; 2]) -> Vec<[f32; 4]> {
    let rows = picture.pixels.chunks(picture.size[0] as usize).take(size[1] as usize);
    rows.flat_map(|row| row[..size[0] as usize].iter().copied()).collect()
}

fn write(file: &Path, size: [u32; 2], channels: impl Fn(usize) -> [f32; 3] + Sync) {
    let [width, height] = size.map(|s| s as usize);
    write_rgb_file(file, width, height, |x, y| {
        let [r, g, b] = channels(y * width + x);
        (r, g, b)
    })
    .expect("a file that is written");
}

/// A frame of the balls, or of a part of the target, through `filter`.
fn compare(name: &str, resolution: Option<[u32; 2]>) {
    let mut stage = Stage::new(true);
    let target = stage.image(SIZE, HDR);
    let camera = stage.set(|world| {
        let skin = SubsurfaceProfile::default();
        add_balls(world, Some([skin.clone(), skin]));
        add_sun(world);
        let camera = add_camera(world, &target);
        world.entity_mut(camera).insert(SubsurfaceScattering::default());
        camera
    });
    if let Some(size) = resolution {
        // Bevy wants it in the render world.
        stage.update();
        let main = stage.app.world_mut();
        let entity = main.query::<RenderEntity>().get(main, camera).expect("a camera that is drawn");
        let world = stage.app.sub_app_mut(RenderApp).world_mut();
        world.entity_mut(entity).insert(MainPassResolutionOverride(UVec2::from_array(size)));
    }
    stage.settle(1);
    let size = resolution.unwrap_or(SIZE);
    let textures = stage.textures(camera);
    let [irradiance, scattered, ids] = [textures.irradiance, textures.scattered, textures.profile_id]
        .map(|texture| crop(&stage.read_texture(&texture.texture), size));
    let depth: Texture = stage.of_camera(camera, |depth: &ViewDepthStencilTexture| depth.texture().clone());
    let depth = crop(&stage.read_texture(&depth), size);
    let projection = stage.of_camera(camera, |view: &ExtractedView| view.clip_from_view);

    let dir = std::env::temp_dir().join(format!("subsurface-bevy-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&dir).expect("a directory");
    write(&dir.join("irradiance.exr"), size, |i| [0, 1, 2].map(|c| irradiance[i][c]));
    write(&dir.join("profile_id.exr"), size, |i| [ids[i][0]; 3]);
    // Infinite and reversed: depth is near over the distance.
    let near = projection.w_axis.z;
    write(&dir.join("depth.exr"), size, |i| match depth[i][0] {
        0.0 => [0.0; 3],
        d => [near / d; 3],
    });
    let description = serde_json::json!({
        "width": size[0],
        "height": size[1],
        "projection": projection.to_cols_array(),
        "mm_per_unit": 1000,
        "files": {
            "irradiance": "irradiance.exr", "depth": "depth.exr", "profile_id": "profile_id.exr"
        },
    });
    std::fs::write(dir.join("gbuffer.json"), description.to_string()).expect("a file that is written");
    let out = dir.join("scattered.exr");
    let status = Command::new(env!("CARGO"))
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .args(["run", "--quiet", "--release", "--example", "filter", "--"])
        .args([dir.as_os_str(), "--out".as_ref(), out.as_os_str()])
        // What this build was told is not for that one.
        .env_remove("CARGO_TARGET_DIR")
        .env_remove("RUSTC_WORKSPACE_WRAPPER")
        .status()
        .expect("cargo");
    assert!(status.success());
    let filtered = read_first_rgba_layer_from_file(
        &out,
        |size, _| vec![[0.0f32; 3]; size.width() * size.height()],
        move |pixels, at, (r, g, b, _): (f32, f32, f32, f32)| {
            pixels[at.y() * size[0] as usize + at.x()] = [r, g, b];
        },
    )
    .expect("a file that filter wrote")
    .layer_data
    .channel_data
    .pixels;
    std::fs::remove_dir_all(&dir).expect("the directory");

    let (mut most, mut most_beyond) = (0.0f32, 0.0f32);
    let mut scatters = 0.0f32;
    let skin = (0..ids.len()).filter(|i| ids[*i][0] > 0.0);
    for i in skin {
        for c in 0..3 {
            let off = (filtered[i][c] - scattered[i][c]).abs();
            // The plugin keeps light in half floats, and some drivers cut them off where they are written.
            let step = (filtered[i][c].max(f32::MIN_POSITIVE).log2().floor() - 10.0).exp2();
            most = most.max(off);
            most_beyond = most_beyond.max(off - step);
            scatters = scatters.max((irradiance[i][c] - scattered[i][c]).abs());
        }
    }
    println!(
        "{name}: filter and the plugin differ by {most:.6} at most, {most_beyond:.6} beyond a step of half \
         floats; scattering changes {scatters:.3}"
    );
    assert!(scatters > 0.05);
    assert!(most_beyond <= 0.001);
}

#[test]
fn filter_makes_the_same_of_a_frame() {
    compare("frame", None);
}

/// As upscalers use it: the frame fills a part of the target.
#[test]
fn filter_makes_the_same_of_a_resolution_override() {
    compare("override", Some([160, 160]));
}
