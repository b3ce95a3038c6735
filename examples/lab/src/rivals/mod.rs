//! The methods of others that ours are compared with, each written from its published formulas. All take
//! what `subsurface` takes and give what it gives: irradiance in, scattered irradiance out, whatever
//! has no profile untouched. They need no feature and no more than WebGPU's default limits, keep
//! half floats between passes as their authors do, and have their taps written out.
//!
//! A method takes one profile, and scatters by it all that has an id.

mod atlas;
mod burley_disk;
mod copy;
mod edge;
mod jimenez_2009;
mod packed;
mod pass;
mod separable;
#[cfg(all(test, feature = "programs"))]
mod tests;
mod texture_2d;
mod texture_cascade;
mod transmission;

use crate::Error;
use subsurface::Profile;
use subsurface::wgpu::{Device, TextureFormat};

use crate::method::{AtlasMethod, ScreenMethod};

/// A method's name, its setting, and the method.
pub type Screen = (&'static str, String, Box<dyn ScreenMethod>);
/// A method's name, its setting, and the method.
pub type Atlas = (&'static str, String, Box<dyn AtlasMethod>);

/// Every rival in screen space, for outputs of `format`; `jimenez_2009`, whose fit is of skin, for
/// [`Profile::SKIN`] only. Fits the others' kernels to the profile, which takes a second or so.
///
/// # Errors
/// A format that `jimenez_2009` cannot blend onto.
pub fn screen(device: &Device, format: TextureFormat, profile: &Profile) -> Result<Vec<Screen>, Error> {
    let mut methods: Vec<Screen> = vec![("copy", String::new(), Box::new(copy::Copy::new(device, format)))];
    if *profile == Profile::SKIN {
        let method = jimenez_2009::Jimenez2009::new(device, format)?;
        methods.push(("jimenez_2009", String::new(), Box::new(method)));
    }
    for pairs in [5, 8, 12] {
        for (name, kernel) in [
            ("jimenez_separable", separable::published_kernel(profile, pairs)),
            ("fitted_separable", separable::fitted_kernel(profile, pairs)),
        ] {
            let method = separable::Separable::new(device, format, &kernel);
            let taps = 2 * pairs + 1;
            methods.push((name, taps.to_string(), Box::new(method)));
        }
    }
    let (shape, _) = burley_disk::fitted_shape(profile);
    for samples in [20, 40, 80] {
        let method = burley_disk::BurleyDisk::new(device, format, shape, samples);
        methods.push(("burley_disk", samples.to_string(), Box::new(method)));
    }
    Ok(methods)
}

/// The separable kernel with light from behind, for frames that have a layer behind: as Jimenez et al. ship it, the
/// same with the exponent that follows from the profile, and as Burley has it.
pub fn transmission(device: &Device, format: TextureFormat, profile: &Profile) -> [Screen; 3] {
    [
        ("jimenez_2010", transmission::gaussians(profile, 1.0)),
        ("jimenez_2010_derived", transmission::gaussians(profile, 2.0)),
        ("burley_2015", transmission::burley(profile)),
    ]
    .map(|(name, transmittance)| -> Screen {
        let method = transmission::Transmission::new(device, format, profile, &transmittance);
        (name, String::new(), Box::new(method))
    })
}

/// Every rival over an atlas, for outputs of `format`.
pub fn atlas(device: &Device, format: TextureFormat, profile: &Profile) -> Vec<Atlas> {
    vec![
        (
            "texture_cascade",
            String::new(),
            Box::new(texture_cascade::TextureCascade::new(device, format, profile)),
        ),
        ("texture_2d", String::new(), Box::new(texture_2d::Texture2d::new(device, format, profile))),
    ]
}
