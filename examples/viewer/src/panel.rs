//! The panel beside the picture.

use egui::{Button, ComboBox, Grid, RichText, ScrollArea, Slider, Ui};
use subsurface_lab::renderer::Lighting;

use crate::layer::{Layer, Mode};
use crate::passes::Pass;
use crate::viewer::Viewer;

/// In points.
pub const WIDTH: f32 = 300.0;

pub fn show(ui: &mut Ui, viewer: &mut Viewer) {
    ui.spacing_mut().slider_width = 180.0;
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.add_space(4.0);
        modes(ui, viewer);
        ui.separator();
        sliders(ui, viewer);
        ui.separator();
        times(ui, viewer);
        ui.separator();
        plan(ui, viewer);
        ui.separator();
        ui.small(&viewer.about);
    });
}

fn modes(ui: &mut Ui, viewer: &mut Viewer) {
    let controls = &mut viewer.controls;
    for (i, mode) in Mode::ALL.into_iter().enumerate() {
        let text = format!("{}  {}", i + 1, mode.title());
        ui.selectable_value(&mut controls.mode, mode, text);
    }
    if controls.mode == Mode::Split {
        for (i, side) in ["left", "right"].into_iter().enumerate() {
            ComboBox::from_label(side).selected_text(controls.pair[i].title()).show_ui(ui, |ui| {
                for layer in Layer::ALL {
                    ui.selectable_value(&mut controls.pair[i], layer, layer.title());
                }
            });
        }
    }
    ui.checkbox(&mut controls.half_resolution, "half resolution (H)");
    ui.horizontal(|ui| {
        ui.checkbox(&mut controls.has_back, "the layer behind (B)");
        if ui.button("light from behind").clicked() {
            controls.lighting.lights = Lighting::behind().lights;
        }
    });
    ui.horizontal(|ui| {
        if ui.button("reset view (R)").clicked() {
            viewer.reset();
        }
        if ui.button("save picture (S)").clicked() {
            viewer.save();
        }
    });
}

fn sliders(ui: &mut Ui, viewer: &mut Viewer) {
    let controls = &mut viewer.controls;
    ui.label("largest error of a plan, of white");
    let max_error = Slider::new(&mut controls.max_error, 0.0005..=0.02);
    ui.add(max_error.logarithmic(true).min_decimals(4).max_decimals(4));
    ui.label("scale of the profile's widths");
    let scale = Slider::new(&mut controls.profile_scale, 0.25..=4.0);
    ui.add(scale.logarithmic(true).max_decimals(2));
    if let Some(key) = controls.lighting.lights.first_mut() {
        ui.label("radius of the key light, degrees");
        ui.add(Slider::new(&mut key.radius_degrees, 0.0..=10.0).max_decimals(2));
    }
    ui.label("roughness: slope of the skin's facets");
    let slope = Slider::new(&mut controls.lighting.slope, 0.05..=1.0);
    ui.add(slope.max_decimals(2));
}

fn times(ui: &mut Ui, viewer: &mut Viewer) {
    ui.horizontal(|ui| {
        ui.strong("ms, wall clock");
        if viewer.is_waiting() {
            ui.label(format!("{} drawing", spinner(ui)));
        }
    });
    if let Some(frame) = &viewer.frame {
        let [width, height] = frame.look.size;
        Grid::new("times").num_columns(3).show(ui, |ui| {
            ui.label("draw and light");
            ui.label(number(frame.draw_ms));
            ui.end_row();
            for time in &frame.times {
                ui.label(time.layer.title());
                ui.label(number(time.ms));
                if time.is_first {
                    ui.small("first run");
                }
                ui.end_row();
            }
            if let Some(ms) = frame.compose_ms {
                ui.label("compose, read back");
                ui.label(number(ms));
                ui.end_row();
            }
        });
        ui.small(format!(
            "{width}×{height}; effects from preparing to the end of submit and wait, of its last run. \
             A first run compiles, too; measuring runs it again."
        ));
    }
    let controls = &viewer.controls;
    let layers = controls.mode.layers(controls.pair);
    let has_passes = layers.into_iter().any(Layer::has_passes) && !viewer.is_waiting();
    let time = ui.add_enabled(has_passes, Button::new("time the passes (T)"));
    viewer.time_passes |= time.clicked();
    if let Some(frame) = &viewer.frame {
        for (layer, times) in &frame.passes {
            passes(ui, *layer, times);
        }
    }
    ui.add_space(4.0);
    ui.strong("relative RMSE against exact");
    if let Some(frame) = &viewer.frame {
        Grid::new("errors").num_columns(2).show(ui, |ui| {
            for (layer, error) in &frame.errors {
                let text = error.map_or("no skin".into(), |e| format!("{:.2} %", 100.0 * e));
                ui.label(layer.title());
                ui.label(text);
                ui.end_row();
            }
        });
    }
    ui.small("Of the irradiance over skin, less a rim of two pixels. Texture space if it was shown.");
    let measure = ui.add_enabled(!viewer.is_waiting(), Button::new("measure this view (M)"));
    viewer.measure |= measure.clicked();
}

/// Two passes to a line.
fn passes(ui: &mut Ui, layer: Layer, passes: &[Pass]) {
    if passes.is_empty() {
        ui.small("the device has no timestamps");
        return;
    }
    let sum: f64 = passes.iter().map(|pass| pass.ms).sum();
    ui.label(format!("{}, by pass: {}", layer.title(), number(sum)));
    let grid = Grid::new(layer).spacing([6.0, 2.0]);
    grid.min_row_height(0.0).show(ui, |ui| {
        for pair in passes.chunks(2) {
            for Pass { name, ms } in pair {
                ui.small(name);
                ui.small(number(*ms));
            }
            ui.end_row();
        }
    });
    ui.small("By the device's timestamps; some software drivers report half of them.");
}

fn plan(ui: &mut Ui, viewer: &Viewer) {
    let planner = &viewer.planner;
    ui.horizontal(|ui| {
        ui.strong("plan");
        if planner.is_fitting() {
            ui.label(format!("{} fitting a new one", spinner(ui)));
        } else if planner.plan.is_some() {
            ui.label(format!("fitted in {:.1} s", planner.seconds));
        }
    });
    if let Some(error) = &planner.error {
        ui.colored_label(ui.visuals().error_fg_color, error.to_string());
    }
    if let Some(plan) = &planner.plan {
        let text = RichText::new(plan.to_string()).monospace().size(10.0);
        ScrollArea::horizontal().show(ui, |ui| {
            ui.add(egui::Label::new(text).wrap_mode(egui::TextWrapMode::Extend));
        });
        ui.small("Weights are red/green/blue in %: what stays, then each blur.");
    }
}

/// Turns at the window's own pace: egui's asks for as many frames as there can be.
fn spinner(ui: &Ui) -> char {
    let quarters = (ui.input(|i| i.time) * 4.0) as usize;
    ['|', '/', '-', '\\'][quarters % 4]
}

fn number(ms: f64) -> String {
    match ms {
        ms if ms < 10.0 => format!("{ms:.2}"),
        ms if ms < 100.0 => format!("{ms:.1}"),
        ms => format!("{ms:.0}"),
    }
}
