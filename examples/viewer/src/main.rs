//! A window to look at the modes in: turn a head, move the light, and hold one mode to another.
//!
//! ```sh
//! cargo run --release -p subsurface-viewer
//! ```

mod divider;
mod layer;
mod legend;
mod options;
mod panel;
mod passes;
mod planner;
mod shots;
mod stage;
mod viewer;
mod width;
mod window;

use std::process::ExitCode;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use subsurface::wgpu::Features;
use subsurface_lab::renderer::{Camera, Gpu, Scene, View};
use subsurface_lab::{Error, cli};
use winit::application::ApplicationHandler;
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key, NamedKey};
use winit::window::WindowId;

use options::Options;
use planner::{Fitted, Planner};
use stage::{Frame, Stage};
use viewer::Viewer;
use window::Window;

fn main() -> ExitCode {
    cli::main(options::HELP, Options::parse, view)
}

/// What other threads hand to the window's.
enum Answer {
    Frame(Box<Result<Frame, Error>>),
    Plan(Box<Fitted>),
}

fn view(options: Options) -> Result<(), Error> {
    let (name, scene) = match &options.model {
        Some(path) => (path.display().to_string(), Scene::load(path)?),
        None => ("built-in head".to_owned(), Scene::from_glb(subsurface_lab::HEAD)?),
    };
    let gpu = Gpu::with(Features::TIMESTAMP_QUERY)?;
    let event_loop = EventLoop::with_user_event().build().map_err(|e| window::no_window(&e))?;

    let orbit = Camera::framing(&scene, View::Front, options.size).into();
    let about = format!("{name}, {} mm a unit\n{}", options.mm_per_unit, gpu.adapter);
    let stage = Stage {
        gpu,
        scene,
        mm_per_unit: options.mm_per_unit,
        texture_size: options.texture_size,
        environment: options.environment.clone(),
    };
    // An answer that comes after the window has gone is of no use.
    let proxy = event_loop.create_proxy();
    let planner = Planner::new(move |fitted| {
        let _ = proxy.send_event(Answer::Plan(Box::new(fitted)));
    });
    let proxy = event_loop.create_proxy();
    let (requests, received) = mpsc::channel();
    thread::spawn(move || {
        stage.run(received, |frame| {
            let _ = proxy.send_event(Answer::Frame(Box::new(frame)));
        });
    });

    let mut app = App {
        size: options.size,
        viewer: Viewer::new(requests, planner, orbit, options.environment, options.out, about),
        window: None,
        result: Ok(()),
    };
    event_loop.run_app(&mut app).map_err(|e| window::no_window(&e))?;
    app.result
}

struct App {
    /// Of the window when it opens.
    size: [u32; 2],
    viewer: Viewer,
    window: Option<Window>,
    /// Why it ended.
    result: Result<(), Error>,
}

impl App {
    fn paint(&mut self, event_loop: &ActiveEventLoop) {
        let Some(window) = &mut self.window else {
            return;
        };
        let mut drawn = Ok(());
        // egui may lay out twice; the first failure counts.
        let painted = window.paint(|ui| {
            if drawn.is_ok() {
                drawn = self.viewer.ui(ui);
            }
        });
        match drawn.and(painted) {
            Ok(Duration::ZERO) => {
                event_loop.set_control_flow(ControlFlow::Wait);
                window.redraw();
            }
            // Beyond what a clock holds is never.
            Ok(delay) => event_loop.set_control_flow(
                Instant::now().checked_add(delay).map_or(ControlFlow::Wait, ControlFlow::WaitUntil),
            ),
            Err(error) => {
                self.result = Err(error);
                event_loop.exit();
            }
        }
    }
}

impl ApplicationHandler<Answer> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_some() {
            return;
        }
        match Window::new(event_loop, "subsurface viewer", self.size) {
            Ok(window) => self.window.insert(window).redraw(),
            Err(error) => {
                self.result = Err(error);
                event_loop.exit();
            }
        }
    }

    fn new_events(&mut self, _: &ActiveEventLoop, cause: StartCause) {
        if let (StartCause::ResumeTimeReached { .. }, Some(window)) = (cause, &self.window) {
            window.redraw();
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, answer: Answer) {
        let Some(window) = &self.window else {
            return;
        };
        match answer {
            Answer::Frame(frame) => self.viewer.take(*frame, window.context()),
            Answer::Plan(fitted) => self.viewer.planner.take(*fitted),
        }
        window.redraw();
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match &event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::RedrawRequested => self.paint(event_loop),
            WindowEvent::KeyboardInput { event: key, .. }
                if key.logical_key == Key::Named(NamedKey::Escape) =>
            {
                event_loop.exit();
            }
            _ => {
                if let Some(window) = &mut self.window {
                    window.take(&event);
                }
            }
        }
    }
}
