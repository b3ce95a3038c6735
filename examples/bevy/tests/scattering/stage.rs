//! A headless Bevy, with or without the plugin.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use bevy::app::PluginsState;
use bevy::asset::UnapprovedPathMode;
use bevy::diagnostic::FrameCount;
use bevy::image::ImageSampler;
use bevy::pbr::DefaultOpaqueRendererMethod;
use bevy::prelude::*;
use bevy::render::error_handler::RenderErrorHandler;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::{
    Buffer, BufferDescriptor, BufferUsages, Extent3d, MapMode, PollType, TexelCopyBufferInfo,
    TexelCopyBufferLayout, Texture, TextureAspect, TextureFormat, TextureUsages,
};
use bevy::render::renderer::{RenderDevice, RenderQueue, initialize_renderer};
use bevy::render::settings::{Backends, RenderCreation, RenderResources, WgpuSettings};
use bevy::render::sync_world::RenderEntity;
use bevy::render::texture::GpuImage;
use bevy::render::{RenderApp, RenderPlugin};
use subsurface_bevy::{SubsurfacePlugin, ViewSubsurfaceTextures};

use crate::picture::Picture;

/// A Bevy app without a window.
pub struct Stage {
    pub app: App,
    has_plugin: bool,
    /// Holds the number of the frame, by which Bevy turns noise.
    pub holds_frame_count: bool,
}

/// What a scene is made of; goes when the next comes.
#[derive(Component)]
pub struct Prop;

fn resources() -> RenderResources {
    static RESOURCES: OnceLock<RenderResources> = OnceLock::new();
    let make = || {
        let settings = WgpuSettings::default();
        let backends = Backends::from_env().unwrap_or(Backends::PRIMARY);
        bevy::tasks::block_on(initialize_renderer(backends, None, &settings))
    };
    RESOURCES.get_or_init(make).clone()
}

impl Stage {
    pub fn new(has_plugin: bool) -> Self {
        Self::with(has_plugin, true)
    }

    /// Pipelines are made as they are asked for, or, as in a game, while frames are drawn.
    pub fn with(has_plugin: bool, synchronous_pipeline_compilation: bool) -> Self {
        let mut app = App::new();
        let render_creation = RenderCreation::Manual(Box::new(resources()));
        app.add_plugins(
            DefaultPlugins
                .set(RenderPlugin { render_creation, synchronous_pipeline_compilation, ..default() })
                .set(AssetPlugin { unapproved_path_mode: UnapprovedPathMode::Allow, ..default() })
                .disable::<PipelinedRenderingPlugin>()
                .disable::<bevy::log::LogPlugin>(),
        );
        app.insert_resource(DefaultOpaqueRendererMethod::deferred());
        app.insert_resource(ClearColor(Color::linear_rgb(0.02, 0.03, 0.05)));
        app.insert_resource(RenderErrorHandler(|error, _, _| panic!("{error:?}")));
        if has_plugin {
            app.add_plugins(SubsurfacePlugin);
        }
        while app.plugins_state() == PluginsState::Adding {
            std::thread::sleep(Duration::from_millis(1));
        }
        app.finish();
        app.cleanup();
        Self { app, has_plugin, holds_frame_count: false }
    }

    /// A texture that a camera may have for its target.
    pub fn image(&mut self, size: [u32; 2], format: TextureFormat) -> Handle<Image> {
        let mut image = Image::new_target_texture(size[0], size[1], format, None);
        image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
        image.sampler = ImageSampler::nearest();
        self.app.world_mut().resource_mut::<Assets<Image>>().add(image)
    }

    /// Clears the stage, and sets another scene of [`Prop`]s.
    pub fn set<T>(&mut self, scene: impl FnOnce(&mut World) -> T) -> T {
        let world = self.app.world_mut();
        let props: Vec<Entity> = world.query_filtered::<Entity, With<Prop>>().iter(world).collect();
        for prop in props {
            world.despawn(prop);
        }
        self.update();
        scene(self.app.world_mut())
    }

    pub fn update(&mut self) {
        if self.holds_frame_count {
            self.app.insert_resource(FrameCount(0));
        }
        self.app.update();
    }

    /// Draws until each of `scattering` cameras scatters, and two frames more: what a frame leaves behind
    /// for the next would show there.
    pub fn settle(&mut self, scattering: usize) {
        let since = Instant::now();
        loop {
            self.update();
            let ready = if self.has_plugin { self.scattering_cameras() } else { scattering };
            if ready == scattering {
                break;
            }
            assert!(since.elapsed() < Duration::from_secs(120), "{ready} of {scattering} cameras scatter");
            std::thread::sleep(Duration::from_millis(5));
        }
        // Assets arrive a frame later.
        for _ in 0..3 {
            self.update();
        }
    }

    fn scattering_cameras(&mut self) -> usize {
        let world = self.app.sub_app_mut(RenderApp).world_mut();
        world.query::<&ViewSubsurfaceTextures>().iter(world).count()
    }

    /// The textures of a camera's skin.
    pub fn textures(&mut self, camera: Entity) -> ViewSubsurfaceTextures {
        let main = self.app.world_mut();
        let entity = main.query::<RenderEntity>().get(main, camera).expect("a camera that is drawn");
        let world = self.app.sub_app_mut(RenderApp).world_mut();
        world.get::<ViewSubsurfaceTextures>(entity).expect("a camera that scatters").clone()
    }

    /// A component of a camera in the render world.
    pub fn of_camera<C: Component, T>(&mut self, camera: Entity, get: impl Fn(&C) -> T) -> T {
        let main = self.app.world_mut();
        let entity = main.query::<RenderEntity>().get(main, camera).expect("a camera that is drawn");
        let world = self.app.sub_app_mut(RenderApp).world_mut();
        get(world.get::<C>(entity).expect("a component of the camera"))
    }

    pub fn read(&self, image: &Handle<Image>) -> Picture {
        let images = self.app.sub_app(RenderApp).world().resource::<RenderAssets<GpuImage>>();
        let texture = &images.get(image).expect("an image on the device").texture;
        self.read_texture(texture)
    }

    pub fn read_texture(&self, texture: &Texture) -> Picture {
        let world = self.app.sub_app(RenderApp).world();
        let (device, queue) = (world.resource::<RenderDevice>(), world.resource::<RenderQueue>());
        let size = [texture.width(), texture.height()];
        let format = texture.format();
        let bytes = format.block_copy_size(Some(aspect(format))).expect("a plain format");
        let row = (size[0] * bytes).next_multiple_of(256);
        let buffer = device.create_buffer(&BufferDescriptor {
            label: None,
            size: (row * size[1]).into(),
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut source = texture.as_image_copy();
        source.aspect = aspect(format);
        encoder.copy_texture_to_buffer(
            source,
            TexelCopyBufferInfo {
                buffer: &buffer,
                layout: TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None },
            },
            Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        );
        queue.submit([encoder.finish()]);
        let texels = rows(device, &buffer, row as usize, (size[0] * bytes) as usize);
        Picture::new(size, format, &texels)
    }
}

fn aspect(format: TextureFormat) -> TextureAspect {
    if format.has_depth_aspect() { TextureAspect::DepthOnly } else { TextureAspect::All }
}

fn rows(device: &RenderDevice, buffer: &Buffer, row: usize, used: usize) -> Vec<u8> {
    let slice = buffer.slice(..);
    slice.map_async(MapMode::Read, |result| result.expect("a buffer to read"));
    device.poll(PollType::wait_indefinitely()).expect("a device that answers");
    let mapped = slice.get_mapped_range().expect("a range that is mapped");
    mapped.chunks(row).flat_map(|row| row[..used].iter().copied()).collect()
}
