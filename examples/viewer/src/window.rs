//! A window that egui draws in.

use std::sync::Arc;
use std::time::Duration;

use subsurface::wgpu;
use subsurface_lab::Error;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::ActiveEventLoop;

pub struct Window {
    handle: Arc<winit::window::Window>,
    instance: wgpu::Instance,
    device: wgpu::Device,
    queue: wgpu::Queue,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    egui: egui_winit::State,
    painter: egui_wgpu::Renderer,
}

impl Window {
    /// Opens a window of `size` pixels, or of what the desktop makes of that.
    ///
    /// # Errors
    /// No window, or none that an adapter can draw in.
    pub fn new(event_loop: &ActiveEventLoop, title: &str, size: [u32; 2]) -> Result<Self, Error> {
        let attributes = winit::window::Window::default_attributes()
            .with_title(title)
            .with_inner_size(PhysicalSize::new(size[0], size[1]));
        let handle = event_loop.create_window(attributes).map_err(|e| no_window(&e))?;
        let handle = Arc::new(handle);
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let surface = create_surface(&instance, &handle)?;
        let request =
            wgpu::RequestAdapterOptions { compatible_surface: Some(&surface), ..Default::default() };
        let adapter = pollster::block_on(instance.request_adapter(&request)).map_err(|e| no_window(&e))?;
        let (device, queue) =
            pollster::block_on(adapter.request_device(&Default::default())).map_err(|e| no_window(&e))?;
        let mut config = surface
            .get_default_config(&adapter, size[0], size[1])
            .ok_or_else(|| no_window(&"the adapter cannot draw in it"))?;
        // egui blends in sRGB's own values, which formats that encode would encode twice.
        let formats = surface.get_capabilities(&adapter).formats;
        if let Some(plain) = formats.into_iter().find(|f| {
            use wgpu::TextureFormat::{Bgra8Unorm, Rgba8Unorm};
            matches!(f, Bgra8Unorm | Rgba8Unorm)
        }) {
            config.format = plain;
        }
        config.present_mode = wgpu::PresentMode::AutoVsync;
        let egui = egui_winit::State::new(
            egui::Context::default(),
            egui::ViewportId::ROOT,
            &handle,
            Some(handle.scale_factor() as f32),
            None,
            Some(device.limits().max_texture_dimension_2d as usize),
        );
        // Pictures lie on dark grey, and text is there to be read.
        egui.egui_ctx().set_theme(egui::Theme::Dark);
        egui.egui_ctx().global_style_mut(|style| {
            style.visuals.widgets.noninteractive.fg_stroke.color = egui::Color32::from_gray(190);
        });
        let painter = egui_wgpu::Renderer::new(&device, config.format, Default::default());
        // Configured when it is first painted, to the size that it then has.
        config.width = 0;
        Ok(Self { handle, instance, device, queue, surface, config, egui, painter })
    }

    pub fn context(&self) -> &egui::Context {
        self.egui.egui_ctx()
    }

    pub fn redraw(&self) {
        self.handle.request_redraw();
    }

    /// Hands an event to egui, and paints anew if that changes anything.
    pub fn take(&mut self, event: &WindowEvent) {
        if self.egui.on_window_event(&self.handle, event).repaint {
            self.redraw();
        }
    }

    /// Paints what `draw` draws, and says when it wants to be painted again. A window that is
    /// minimised, or has no room, is left alone.
    pub fn paint(&mut self, draw: impl FnMut(&mut egui::Ui)) -> Result<Duration, Error> {
        let limit = self.device.limits().max_texture_dimension_2d;
        let size = self.handle.inner_size();
        let size = [size.width, size.height].map(|s| s.min(limit));
        if size.contains(&0) {
            return Ok(Duration::MAX);
        }
        let context = self.egui.egui_ctx().clone();
        let input = self.egui.take_egui_input(&self.handle);
        let output = context.run_ui(input, draw);
        let mut delay = output
            .viewport_output
            .get(&egui::ViewportId::ROOT)
            .map_or(Duration::MAX, |viewport| viewport.repaint_delay);
        self.egui.handle_platform_output(&self.handle, output.platform_output);
        // Also where there is nothing to paint to: they come only once.
        for (id, deltas) in &output.textures_delta.set {
            for delta in deltas {
                self.painter.update_texture(&self.device, &self.queue, *id, delta);
            }
        }
        match self.target(size)? {
            Some(target) => {
                let shapes = context.tessellate(output.shapes, output.pixels_per_point);
                self.present(target, &shapes, output.pixels_per_point);
            }
            None => delay = delay.min(Duration::from_millis(500)),
        }
        for id in &output.textures_delta.free {
            self.painter.free_texture(id);
        }
        Ok(delay)
    }

    /// The next texture of the surface, none where it has none for now.
    fn target(&mut self, size: [u32; 2]) -> Result<Option<wgpu::SurfaceTexture>, Error> {
        use wgpu::CurrentSurfaceTexture::*;

        if [self.config.width, self.config.height] != size {
            [self.config.width, self.config.height] = size;
            self.surface.configure(&self.device, &self.config);
        }
        // Once to find it gone, once anew.
        for _ in 0..2 {
            match self.surface.get_current_texture() {
                // A suboptimal one is shown, too: where its size is off, a new size is on its way.
                Success(target) | Suboptimal(target) => return Ok(Some(target)),
                Timeout | Occluded | Validation => return Ok(None),
                Outdated => {}
                Lost => self.surface = create_surface(&self.instance, &self.handle)?,
            }
            self.surface.configure(&self.device, &self.config);
        }
        Ok(None)
    }

    fn present(
        &mut self,
        target: wgpu::SurfaceTexture,
        shapes: &[egui::ClippedPrimitive],
        pixels_per_point: f32,
    ) {
        let screen = egui_wgpu::ScreenDescriptor {
            size_in_pixels: [self.config.width, self.config.height],
            pixels_per_point,
        };
        let view = target.texture.create_view(&Default::default());
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut commands =
            self.painter.update_buffers(&self.device, &self.queue, &mut encoder, shapes, &screen);
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("viewer"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        self.painter.render(&mut pass.forget_lifetime(), shapes, &screen);
        commands.push(encoder.finish());
        self.queue.submit(commands);
        self.handle.pre_present_notify();
        self.queue.present(target);
    }
}

fn create_surface(
    instance: &wgpu::Instance,
    window: &Arc<winit::window::Window>,
) -> Result<wgpu::Surface<'static>, Error> {
    instance.create_surface(Arc::clone(window)).map_err(|e| no_window(&e))
}

/// Why there is no window, on one line.
pub fn no_window(error: &dyn std::fmt::Display) -> Error {
    let error = error.to_string().replace('\n', " ");
    // Some start with the place in winit's source where they come from.
    let reason = error.rsplit(".rs:").next().unwrap_or(&error);
    let got = format!("none ({})", reason.trim_start_matches(|c: char| !c.is_alphabetic()));
    let needs = "a desktop to open it on, which the graphics driver can draw on; on Linux, X11";
    Error::new("window", got, needs)
}
