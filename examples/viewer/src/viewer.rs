//! What is shown and asked for: the picture, its mouse and keys, and what they change.

use std::path::PathBuf;
use std::sync::mpsc::Sender;
use std::time::Duration;

use egui::{
    Align2, Color32, ColorImage, CursorIcon, Key, MouseWheelUnit, PointerButton, Pos2, Rect, Response,
    Sense, Stroke, TextureHandle, Ui, Vec2,
};
use image::RgbImage;
use subsurface::Profile;
use subsurface_lab::Error;
use subsurface_lab::renderer::{Environment, Lighting, Orbit, turn_light};

use crate::layer::{Layer, Mode};
use crate::planner::{Planner, Wish};
use crate::stage::{Frame, Look, Picture, Request};
use crate::{divider, legend, panel, shots};

/// On a software driver the window takes time from what it waits for.
const SPINNER: Duration = Duration::from_millis(250);
/// Points from the divider at which it is taken hold of.
const GRIP: f32 = 6.0;

/// What the panel and the mouse set.
#[derive(Clone, PartialEq)]
pub struct Controls {
    pub mode: Mode,
    /// The sides of the divider.
    pub pair: [Layer; 2],
    pub max_error: f32,
    /// s: variances are multiplied by s².
    pub profile_scale: f32,
    pub half_resolution: bool,
    pub lighting: Lighting,
    /// Whether screen space is handed the surface behind the visible one.
    pub has_back: bool,
    pub orbit: Orbit,
}

pub struct Viewer {
    pub controls: Controls,
    pub planner: Planner,
    /// The model, its scale and the adapter.
    pub about: String,
    /// The answer on screen.
    pub frame: Option<Frame>,
    /// Errors against the exact sum are asked for with the next request.
    pub measure: bool,
    /// Times of passes are asked for with the next request.
    pub time_passes: bool,
    /// Instead of lights, where there is one.
    environment: Option<Environment>,
    error: Option<Error>,
    home: Controls,
    out: PathBuf,
    /// The divider's place over the picture, from 0 to 1.
    divider: f32,
    requests: Sender<Request>,
    sent: Option<Look>,
    /// How many requests were sent.
    number: u64,
    /// The pictures of `frame`.
    textures: Vec<TextureHandle>,
    /// What became of the last screenshot.
    saved: String,
}

impl Viewer {
    pub fn new(
        requests: Sender<Request>,
        planner: Planner,
        orbit: Orbit,
        environment: Option<Environment>,
        out: PathBuf,
        about: String,
    ) -> Self {
        let mut lighting = Lighting::default();
        if let Some(environment) = &environment {
            environment.light(&mut lighting, 0.0);
        }
        let controls = Controls {
            mode: Mode::One(Layer::Screen),
            pair: [Layer::None, Layer::Screen],
            max_error: subsurface::DEFAULT_MAX_ERROR,
            profile_scale: 1.0,
            half_resolution: false,
            lighting,
            has_back: false,
            orbit,
        };
        Self {
            home: controls.clone(),
            controls,
            planner,
            about,
            frame: None,
            measure: false,
            time_passes: false,
            environment,
            error: None,
            out,
            divider: 0.5,
            requests,
            sent: None,
            number: 0,
            textures: Vec::new(),
            saved: String::new(),
        }
    }

    /// Takes the answer to a request.
    pub fn take(&mut self, answer: Result<Frame, Error>, context: &egui::Context) {
        match answer {
            Ok(frame) => {
                let upload = |picture: &Picture| {
                    let size = [picture.image.width(), picture.image.height()];
                    let image = ColorImage::from_rgb(size.map(|s| s as usize), picture.image.as_raw());
                    context.load_texture("picture", image, egui::TextureOptions::LINEAR)
                };
                self.textures = frame.pictures.iter().map(|p| upload(p)).collect();
                self.frame = Some(frame);
                self.error = None;
            }
            Err(error) => {
                // Not asked for again until something changes.
                self.error = Some(error);
                self.frame = None;
                self.textures.clear();
            }
        }
    }

    /// Whether the picture is of an earlier request.
    pub fn is_waiting(&self) -> bool {
        let shown = self.frame.as_ref().map_or(0, |f| f.number);
        self.error.is_none() && shown != self.number
    }

    /// The window's content. Fails when nobody draws any more.
    pub fn ui(&mut self, ui: &mut Ui) -> Result<(), Error> {
        if !ui.ctx().egui_wants_keyboard_input() {
            self.keys(ui);
        }
        egui::Panel::left("panel")
            .exact_size(panel::WIDTH)
            .resizable(false)
            .show(ui, |ui| panel::show(ui, self));
        let frame = egui::Frame::NONE.fill(Color32::from_gray(14));
        let picture = egui::CentralPanel::default().frame(frame).show(ui, |ui| {
            let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
            self.mouse(ui, &response);
            self.picture(ui, rect);
            rect
        });
        let is_moving = ui.input(|i| i.pointer.any_down());
        let profile = Profile::SKIN.scaled(self.controls.profile_scale)?;
        if !is_moving {
            self.planner.ask(Wish { profile, max_error: self.controls.max_error });
        }
        let pixels = picture.inner.size() * ui.pixels_per_point();
        self.request(pixels, profile, is_moving)?;
        if self.is_waiting() || self.planner.is_fitting() {
            ui.ctx().request_repaint_after(SPINNER);
        }
        Ok(())
    }

    /// Asks for what is to be seen, unless that was asked for already.
    fn request(&mut self, pixels: Vec2, profile: Profile, is_moving: bool) -> Result<(), Error> {
        let divisor = if self.controls.half_resolution { 2.0 } else { 1.0 };
        let size = [pixels.x, pixels.y].map(|s| (s / divisor).round() as u32);
        if size.contains(&0) {
            return Ok(()); // a window that is all panel
        }
        let look = Look {
            size,
            camera: self.controls.orbit.camera(),
            lighting: self.controls.lighting.clone(),
            has_back: self.controls.has_back,
            profile,
            plan: self.planner.plan.clone(),
            layers: self.controls.mode.layers(self.controls.pair),
            is_moving,
        };
        if self.sent.as_ref() == Some(&look) && !self.measure && !self.time_passes {
            return Ok(());
        }
        self.number += 1;
        self.saved.clear();
        self.sent = Some(look.clone());
        let request = Request {
            number: self.number,
            look,
            measure: std::mem::take(&mut self.measure),
            time_passes: std::mem::take(&mut self.time_passes),
        };
        self.requests
            .send(request)
            .map_err(|_| Error::new("renderer", "an end", "a device that keeps working"))
    }

    fn keys(&mut self, ui: &Ui) {
        let pressed = |key| ui.input(|i| i.key_pressed(key));
        let digits = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7];
        for (key, mode) in digits.into_iter().zip(Mode::ALL) {
            if pressed(key) {
                self.controls.mode = mode;
            }
        }
        self.controls.half_resolution ^= pressed(Key::H);
        self.controls.has_back ^= pressed(Key::B);
        self.measure |= pressed(Key::M);
        self.time_passes |= pressed(Key::T);
        if pressed(Key::R) {
            self.reset();
        }
        if pressed(Key::S) {
            self.save();
        }
    }

    /// Back to the first view and light.
    pub fn reset(&mut self) {
        self.controls.orbit = self.home.orbit;
        self.controls.lighting = self.home.lighting.clone();
    }

    /// Saves the picture as it is shown, at the size that it was drawn in.
    pub fn save(&mut self) {
        self.saved = match self.shown() {
            None => "nothing to save yet".into(),
            Some(picture) => match shots::save(&self.out, &picture) {
                Ok(path) => format!("saved {}", path.display()),
                Err(error) => error.to_string(),
            },
        };
    }

    fn shown(&self) -> Option<RgbImage> {
        match self.frame.as_ref()?.pictures.as_slice() {
            [one] => Some(one.image.clone()),
            [left, right] => Some(divider::join(&left.image, &right.image, self.divider)),
            _ => None,
        }
    }

    fn mouse(&mut self, ui: &Ui, response: &Response) {
        let rect = response.rect;
        let share = response.drag_delta() / rect.height().max(1.0);
        let controls = &mut self.controls;
        let x = rect.left() + self.divider * rect.width();
        let is_split = controls.mode == Mode::Split;
        let near = |at: Option<Pos2>| is_split && at.is_some_and(|at| (at.x - x).abs() <= GRIP);

        // A drag belongs to what it began on.
        let held = response.id;
        if response.drag_started_by(PointerButton::Primary) {
            let origin = ui.input(|i| i.pointer.press_origin());
            ui.data_mut(|data| data.insert_temp(held, near(origin)));
        }
        let is_held = ui.data(|data| data.get_temp(held).unwrap_or(false));
        let is_dragged = response.dragged_by(PointerButton::Primary);
        if is_dragged && is_held {
            if let Some(at) = response.interact_pointer_pos() {
                self.divider = divider::fraction(at.x, rect);
            }
        } else if is_dragged {
            controls.orbit.turn(share.x, share.y);
        }
        if near(response.hover_pos()) || (is_dragged && is_held) {
            ui.set_cursor_icon(CursorIcon::ResizeHorizontal);
        }
        if response.dragged_by(PointerButton::Middle) {
            controls.orbit.shift(share.x, share.y);
        }
        if response.dragged_by(PointerButton::Secondary) {
            if let (Some(environment), Some(turn)) = (&self.environment, controls.lighting.turn) {
                // Half a turn across the picture.
                environment.light(&mut controls.lighting, turn + share.x * std::f32::consts::PI);
            } else if let Some(key) = controls.lighting.lights.first_mut() {
                key.direction = turn_light(key.direction, share.x, share.y);
            }
        }
        if response.hovered() {
            // Not the smoothed scroll, which would have every step in between drawn.
            let notches: f32 = ui.input(|i| i.events.iter().map(notches).sum());
            if notches != 0.0 {
                controls.orbit.zoom(notches);
            }
        }
    }

    fn picture(&self, ui: &Ui, rect: Rect) {
        let painter = ui.painter_at(rect);
        let unit = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
        let image = |texture: &TextureHandle, (at, uv)| {
            painter.image(texture.id(), at, uv, Color32::WHITE);
        };
        let inner = rect.shrink(10.0);
        let pictures = self.frame.as_ref().map_or(&[][..], |f| &f.pictures);
        let wrap = inner.width() / pictures.len().max(1) as f32;
        let label = |at, anchor, text: &str| legend::label(&painter, at, anchor, text, wrap);
        match (self.textures.as_slice(), pictures) {
            ([texture], [picture]) => {
                image(texture, (rect, unit));
                label(inner.left_top(), Align2::LEFT_TOP, &picture.title);
            }
            ([left, right], [on_left, on_right]) => {
                let [at_left, at_right] = divider::halves(rect, self.divider);
                image(left, at_left);
                image(right, at_right);
                let x = at_left.0.right();
                painter.vline(x, rect.y_range(), Stroke::new(3.0, Color32::BLACK));
                painter.vline(x, rect.y_range(), Stroke::new(1.0, Color32::WHITE));
                painter.circle(
                    Pos2::new(x, rect.center().y),
                    GRIP,
                    Color32::WHITE,
                    Stroke::new(1.0, Color32::BLACK),
                );
                label(inner.left_top(), Align2::LEFT_TOP, &on_left.title);
                label(inner.right_top(), Align2::RIGHT_TOP, &on_right.title);
            }
            _ => {
                let text = self.error.as_ref().map(|e| e.to_string());
                let text = text.unwrap_or("drawing the first picture".into());
                label(inner.left_top(), Align2::LEFT_TOP, &text);
            }
        }
        if let Some(frame) = &self.frame {
            let right = (inner.right() - legend::WIDTH).max(inner.left());
            for (picture, x) in pictures.iter().zip([inner.left(), right]) {
                if let Some(legend) = &picture.legend {
                    let half = self.controls.half_resolution;
                    let corner = Pos2::new(x, inner.bottom());
                    legend::show(&painter, corner, legend, &frame.look.profile, half);
                }
            }
        }
        label(inner.left_bottom(), Align2::LEFT_BOTTOM, &self.saved);
    }
}

fn notches(event: &egui::Event) -> f32 {
    match event {
        egui::Event::MouseWheel { unit, delta, .. } => match unit {
            MouseWheelUnit::Point => delta.y / 50.0,
            MouseWheelUnit::Line => delta.y,
            MouseWheelUnit::Page => 10.0 * delta.y,
        },
        _ => 0.0,
    }
}
