//! The device, and every method on it.

use std::cell::RefCell;
use std::sync::{Arc, Mutex};

use glam::Vec3;
use subsurface::wgpu::{CommandEncoder, TextureFormat, TextureView};
use subsurface::{Atlas, DEFAULT_MAX_ERROR, Frame, Plan, Profile};

use crate::Error;
use crate::method::{self, AtlasMethod, Ours, OursUnrolled, ScreenMethod};
use crate::renderer::Gpu;
use crate::rivals;
use crate::stability::case::{ATLAS, EXACT, PLAN, Results};
use crate::stability::inputs::Uploaded;

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

/// A method of either space.
pub enum Method {
    Screen(Box<dyn ScreenMethod>),
    Texture(Box<dyn AtlasMethod>),
}

pub type Methods = Vec<(&'static str, Method)>;

impl Method {
    /// # Errors
    /// Inputs that it refuses.
    pub fn prepare(&mut self, gpu: &Gpu, inputs: &Uploaded) -> Result<(), Error> {
        let (device, queue) = (&gpu.device, &gpu.queue);
        match self {
            Self::Screen(method) => method.prepare(device, queue, &inputs.frame()),
            Self::Texture(method) => method.prepare(device, queue, &inputs.atlas()),
        }
    }

    /// # Errors
    /// An output that it refuses.
    pub fn render(&self, encoder: &mut CommandEncoder, output: &TextureView) -> Result<(), Error> {
        match self {
            Self::Screen(method) => method.render(encoder, output),
            Self::Texture(method) => method.render(encoder, output),
        }
    }

    /// What it makes of these inputs, alpha included.
    ///
    /// # Errors
    /// Inputs that it refuses.
    pub fn scatter(&mut self, gpu: &Gpu, inputs: &Uploaded) -> Result<Vec<[f32; 4]>, Error> {
        self.prepare(gpu, inputs)?;
        gpu.run(|encoder| self.render(encoder, &inputs.output))?;
        Ok(gpu.read(&inputs.output))
    }
}

/// What stays the same from case to case.
pub struct Lab {
    pub gpu: Gpu,
    /// Of the skin profile, at the default error.
    pub plan: Plan,
    methods: RefCell<Methods>,
    /// Those that need a layer behind the frame.
    through: RefCell<Methods>,
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
        let through = rivals::transmission(&gpu.device, OUTPUT, &Profile::SKIN).into_iter();
        let through = through.map(|(name, _, method)| (name, Method::Screen(method))).collect();
        let methods = methods(&gpu, &plan)?;
        Ok(Self { methods: methods.into(), through: RefCell::new(through), gpu, plan, complaints })
    }

    /// What every method in screen space makes of a frame of skin; the first does nothing.
    ///
    /// # Errors
    /// A frame that a method refuses.
    pub fn scatter(&self, frame: &Frame, output: &TextureView) -> Result<Results, Error> {
        let mut results = vec![("none", self.read(frame.irradiance))];
        let mut through = self.through.borrow_mut();
        let through = through.iter_mut().filter(|_| frame.back.is_some());
        for (name, method) in self.methods.borrow_mut().iter_mut().chain(through) {
            if let Method::Screen(method) = method {
                method::scatter(&self.gpu, &mut **method, frame, output)?;
                results.push((*name, self.read(output)));
            }
        }
        Ok(results)
    }

    /// Hands `visit` every method in texture space.
    ///
    /// # Errors
    /// What `visit` fails with.
    pub fn by_atlas(
        &self,
        mut visit: impl FnMut(&'static str, &mut dyn AtlasMethod) -> Result<(), Error>,
    ) -> Result<(), Error> {
        for (name, method) in self.methods.borrow_mut().iter_mut() {
            if let Method::Texture(method) = method {
                visit(name, &mut **method)?;
            }
        }
        Ok(())
    }

    /// What every method in texture space makes of an atlas of skin.
    ///
    /// # Errors
    /// An atlas that a method refuses.
    pub fn scatter_atlas(&self, atlas: &Atlas, output: &TextureView) -> Result<Results, Error> {
        let mut results = Vec::new();
        self.by_atlas(|name, method| {
            method::scatter_atlas(&self.gpu, method, atlas, output)?;
            results.push((name, self.read(output)));
            Ok(())
        })?;
        Ok(results)
    }

    /// What all methods make of a frame, and of an atlas whose texels are its pixels.
    ///
    /// # Errors
    /// Inputs that a method refuses.
    pub fn scatter_both(&self, inputs: &Uploaded) -> Result<Results, Error> {
        let mut results = self.scatter(&inputs.frame(), &inputs.output)?;
        results.extend(self.scatter_atlas(&inputs.atlas(), &inputs.output)?);
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
            Some(first) => Err(Error::new(case, first, "a device without complaints")),
            None => Ok(()),
        }
    }
}

/// Ours alone, new.
///
/// # Errors
/// A device that one of them refuses.
pub fn ours(gpu: &Gpu, plan: &Plan) -> Result<Methods, Error> {
    let screen = |plan| Ours::new(&gpu.device, OUTPUT, plan).map(|m| Method::Screen(Box::new(m)));
    let atlas = OursUnrolled::new(&gpu.device, OUTPUT, plan.profiles())?;
    Ok(vec![
        (EXACT, screen(&Plan::exact(plan.profiles())?)?),
        (PLAN, screen(plan)?),
        (ATLAS, Method::Texture(Box::new(atlas))),
    ])
}

/// Ours and all rivals, new, for the plan's first profile.
///
/// # Errors
/// A device that a method refuses.
pub fn methods(gpu: &Gpu, plan: &Plan) -> Result<Methods, Error> {
    let profile = &plan.profiles()[0];
    let mut methods = ours(gpu, plan)?;
    for (name, setting, method) in rivals::screen(&gpu.device, OUTPUT, profile)? {
        if SETTINGS.contains(&(name, setting.as_str())) {
            methods.push((name, Method::Screen(method)));
        }
    }
    for (name, setting, method) in rivals::atlas(&gpu.device, OUTPUT, profile) {
        if SETTINGS.contains(&(name, setting.as_str())) {
            methods.push((name, Method::Texture(method)));
        }
    }
    Ok(methods)
}
