//! The device, and every method on it.

use std::cell::RefCell;
use std::sync::{Arc, Mutex};

use crate::Error;
use glam::Vec3;
use subsurface::wgpu::{TextureFormat, TextureView};
use subsurface::{Atlas, DEFAULT_MAX_ERROR, Frame, Plan, Profile, TextureSpace};

use crate::method::{self, AtlasMethod, Ours, ScreenMethod};
use crate::renderer::Gpu;
use crate::rivals;
use crate::stability::case::METHODS;

/// What results are written as, and what most hosts have.
pub const OUTPUT: TextureFormat = TextureFormat::Rgba16Float;

/// Which of each rival's settings are tried.
const SETTINGS: [(&str, &str); 5] = [
    ("jimenez_2009", ""),
    ("jimenez_separable", "17"),
    ("fitted_separable", "17"),
    ("burley_disk", "40"),
    ("texture_cascade", ""),
];

pub type Screen = (&'static str, Box<dyn ScreenMethod>);
pub type Texture = (&'static str, Box<dyn AtlasMethod>);

/// What stays the same from case to case.
pub struct Lab {
    pub gpu: Gpu,
    /// Of the skin profile, at the default error.
    pub plan: Plan,
    screen: RefCell<Vec<Screen>>,
    /// Over one atlas at a time, [`scatter_atlas`](Self::scatter_atlas).
    pub texture: RefCell<Vec<Texture>>,
    /// What the device complained of.
    complaints: Arc<Mutex<Vec<String>>>,
}

impl Lab {
    /// # Errors
    /// No adapter.
    pub fn new() -> Result<Self, Error> {
        let gpu = Gpu::headless()?;
        let complaints = Arc::new(Mutex::new(Vec::new()));
        let heard = complaints.clone();
        gpu.device.on_uncaptured_error(Arc::new(move |error| {
            if let Ok(mut heard) = heard.lock() {
                heard.push(error.to_string());
            }
        }));
        let plan = Plan::new(&[Profile::SKIN], DEFAULT_MAX_ERROR)?;
        let screen = screen_methods(&gpu, &Profile::SKIN, &plan)?;
        let texture = texture_methods(&gpu, &Profile::SKIN)?;
        Ok(Self {
            screen: RefCell::new(screen),
            texture: RefCell::new(texture),
            gpu,
            plan,
            complaints,
        })
    }

    /// What every method in screen space makes of a frame of skin; the first is that which does nothing.
    ///
    /// # Errors
    /// A frame that a method refuses.
    pub fn scatter(
        &self,
        frame: &Frame,
        output: &TextureView,
    ) -> Result<Vec<(&'static str, Vec<Vec3>)>, Error> {
        let mut results = vec![("none", self.read(frame.irradiance))];
        for (name, method) in self.screen.borrow_mut().iter_mut() {
            method::scatter(&self.gpu, &mut **method, frame, output)?;
            results.push((*name, self.read(output)));
        }
        Ok(results)
    }

    /// What every method in texture space makes of an atlas of skin.
    ///
    /// # Errors
    /// An atlas that a method refuses.
    pub fn scatter_atlas(
        &self,
        atlas: &Atlas,
        output: &TextureView,
    ) -> Result<Vec<(&'static str, Vec<Vec3>)>, Error> {
        let mut results = Vec::new();
        for (name, method) in self.texture.borrow_mut().iter_mut() {
            method::scatter_atlas(&self.gpu, &mut **method, atlas, output)?;
            results.push((*name, self.read(output)));
        }
        Ok(results)
    }

    pub fn read(&self, texture: &TextureView) -> Vec<Vec3> {
        let pixels = self.gpu.read(texture).into_iter();
        pixels.map(|[r, g, b, _]| Vec3::new(r, g, b)).collect()
    }

    /// Whether the device has been content since this was last asked.
    ///
    /// # Errors
    /// What it said first.
    pub fn check(&self, case: &str) -> Result<(), Error> {
        let mut heard = self.complaints.lock().unwrap_or_else(|e| e.into_inner());
        match heard.drain(..).next() {
            Some(first) => Err(Error::new(case, first, "a device that has nothing to say")),
            None => Ok(()),
        }
    }
}

/// Every method in screen space, for a profile and its plan.
///
/// # Errors
/// A device that a method refuses.
pub fn screen_methods(gpu: &Gpu, profile: &Profile, plan: &Plan) -> Result<Vec<Screen>, Error> {
    let device = &gpu.device;
    let exact = Plan::exact(&[*profile])?;
    let exact = Ours::new(device, OUTPUT, &exact)?;
    let planned = Ours::new(device, OUTPUT, plan)?;
    let mut methods: Vec<Screen> = vec![
        ("screen_exact", Box::new(exact)),
        ("screen_planned", Box::new(planned)),
    ];
    for (name, setting, method) in rivals::screen(device, OUTPUT, profile)? {
        if SETTINGS.contains(&(name, setting.as_str())) {
            methods.push((name, method));
        }
    }
    methods.sort_by_key(|(name, _)| METHODS.iter().position(|m| m == name));
    Ok(methods)
}

/// Every method in texture space, for a profile.
///
/// # Errors
/// A device that a method refuses.
pub fn texture_methods(gpu: &Gpu, profile: &Profile) -> Result<Vec<Texture>, Error> {
    let ours = TextureSpace::new(&gpu.device, OUTPUT, &[*profile])?;
    let mut methods: Vec<Texture> = vec![("texture_separable", Box::new(ours))];
    for (name, setting, method) in rivals::atlas(&gpu.device, OUTPUT, profile) {
        if SETTINGS.contains(&(name, setting.as_str())) {
            methods.push((name, method));
        }
    }
    Ok(methods)
}
