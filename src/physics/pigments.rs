//! Skin by what colours it: two layers, melanin in the upper and blood in the lower.
//!
//! - C. Donner & H. W. Jensen, *A spectral BSSRDF for shading human skin*, EGSR 2006: the two layers.
//! - A. Krishnaswamy & G. V. G. Baranoski, *A biophysically-based spectral model of light interaction with
//!   human skin*, Eurographics 2004: pigments as what a skin is described by.
//! - S. L. Jacques, *Skin optics*, Oregon Medical Laser Center 1998: melanin and what skin without it absorbs.
//! - S. Prahl, *Optical absorption of hemoglobin*, Oregon Medical Laser Center 1999: the table below.

use super::medium::G_RANGE;
use super::{Layer, Medium, Response, Transport, number};
use crate::Error;

/// A skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Skin {
    /// The share C_m of the epidermis that is melanin, 0 to 1: 0.002 to 0.5 in people.
    pub melanin: f64,
    /// The share β_m of that which is eumelanin, dark brown, 0 to 1; the rest is pheomelanin, reddish.
    pub eumelanin: f64,
    /// The share C_h of the dermis that is blood, 0 to 1: 0.003 to 0.32 in people.
    pub haemoglobin: f64,
    /// The share γ of the blood that carries oxygen, 0 to 1: about 0.75.
    pub oxygenation: f64,
    /// How thick the epidermis is, in mm, 0 to 1: 0.06 to 0.1 on a face. Donner & Jensen's 0.25 is of a
    /// palm and gives a grey face.
    pub epidermis_mm: f64,
    /// The mean cosine of a scattering event, −0.5 to 0.99: 0 is isotropic scattering by the reduced
    /// coefficients, 0.8 nearer to tissue.
    pub g: f64,
}

/// The index of refraction of skin.
const ETA: f64 = 1.4;

/// A wavelength: nm, the molar extinction of blood with and without oxygen in 1/(cm·M), and what it adds to
/// linear sRGB red, green and blue under D65 (CIE 1931, hat functions of 20 nm; each sums to 1).
struct Wavelength(f64, f64, f64, [f64; 3]);

const SPECTRUM: [Wavelength; 16] = [
    Wavelength(400.0, 266232.0, 223296.0, [0.00297, -0.00259, 0.01831]),
    Wavelength(420.0, 480360.0, 407560.0, [0.02013, -0.01835, 0.13583]),
    Wavelength(440.0, 102580.0, 413280.0, [0.03756, -0.03905, 0.34481]),
    Wavelength(460.0, 44480.0, 23388.8, [0.00141, -0.01831, 0.36972]),
    Wavelength(480.0, 26629.2, 14550.0, [-0.06473, 0.04376, 0.19024]),
    Wavelength(500.0, 20932.8, 20862.0, [-0.12895, 0.13201, 0.05128]),
    Wavelength(520.0, 24202.4, 31589.6, [-0.17226, 0.24699, -0.00789]),
    Wavelength(540.0, 53236.0, 46592.0, [-0.09833, 0.29236, -0.02969]),
    Wavelength(560.0, 32613.2, 53788.0, [0.07785, 0.23988, -0.03068]),
    Wavelength(580.0, 50104.0, 37020.0, [0.28243, 0.13292, -0.02211]),
    Wavelength(600.0, 3200.0, 14677.2, [0.40281, 0.03120, -0.01197]),
    Wavelength(620.0, 942.0, 6509.6, [0.34943, -0.01458, -0.00525]),
    Wavelength(640.0, 442.0, 4345.2, [0.18950, -0.01599, -0.00185]),
    Wavelength(660.0, 319.6, 3226.56, [0.07277, -0.00733, -0.00056]),
    Wavelength(680.0, 277.6, 2407.92, [0.02100, -0.00223, -0.00015]),
    Wavelength(700.0, 290.0, 1794.28, [0.00641, -0.00070, -0.00004]),
];

impl Skin {
    /// Light skin.
    pub const LIGHT: Self = Self {
        melanin: 0.02,
        eumelanin: 0.61,
        haemoglobin: 0.015,
        oxygenation: 0.75,
        epidermis_mm: 0.06,
        g: 0.0,
    };

    /// Medium skin.
    pub const MEDIUM: Self = Self { melanin: 0.12, haemoglobin: 0.02, ..Self::LIGHT };

    /// Dark skin.
    pub const DARK: Self = Self { melanin: 0.35, ..Self::MEDIUM };

    /// The skin at 400 to 700 nm, every 20: (nm, medium). Donner & Jensen 2006, in 1/mm.
    ///
    /// # Errors
    /// A value out of its range.
    pub fn spectrum(&self) -> Result<Vec<(f64, Medium)>, Error> {
        for (name, value) in [
            ("melanin", self.melanin),
            ("eumelanin", self.eumelanin),
            ("haemoglobin", self.haemoglobin),
            ("oxygenation", self.oxygenation),
            ("epidermis_mm", self.epidermis_mm),
        ] {
            if !(0.0..=1.0).contains(&value) {
                return Err(number(format!("skin: {name}"), value, "0 to 1"));
            }
        }
        if !G_RANGE.contains(&self.g) {
            return Err(number("skin: g", self.g, "-0.5 to 0.99"));
        }
        SPECTRUM.iter().map(|w| Ok((w.0, self.medium(w)?))).collect()
    }

    fn medium(&self, &Wavelength(nm, oxygenated, deoxygenated, _): &Wavelength) -> Result<Medium, Error> {
        let mix = |share: f64, a: f64, b: f64| share * a + (1.0 - share) * b;
        let bare = 0.0244 + 8.53 * (-(nm - 154.0) / 66.2).exp();
        let melanin = mix(self.eumelanin, 6.6e10 * nm.powf(-3.33), 2.9e14 * nm.powf(-4.75));
        // 150 g of haemoglobin, of 64 500 g a mole, to a litre; per mm, and e instead of ten.
        let blood = mix(self.oxygenation, oxygenated, deoxygenated) * 2.303 * 150.0 / 64500.0 / 10.0;
        let scattering = 14.74 * nm.powf(-0.22) + 2.2e11 * nm.powi(-4);
        let epidermis = Layer::isotropic(mix(self.melanin, melanin, bare), scattering);
        let dermis = Layer::isotropic(mix(self.haemoglobin, blood, bare), 0.5 * scattering);
        let layers = [epidermis.thick(self.epidermis_mm), dermis].map(|layer| layer.with_g(self.g));
        Medium::new(&layers, ETA)
    }

    /// What the skin does with red, green and blue light. (The mean of the *coefficients* over a colour would
    /// be wrong: docs/physics.md.)
    ///
    /// # Errors
    /// A value out of its range, and as [`Transport::response`].
    pub fn responses(&self, transport: &Transport) -> Result<[Response; 3], Error> {
        let spectrum = self.spectrum()?;
        let responses = spectrum.iter().map(|(_, medium)| transport.response(medium));
        Ok(Self::colours(&responses.collect::<Result<Vec<_>, _>>()?))
    }

    /// Red, green and blue of responses at the wavelengths of [`spectrum`](Self::spectrum): each times its
    /// weight in a colour.
    pub fn colours(responses: &[Response]) -> [Response; 3] {
        [0, 1, 2].map(|c| Response::sum(SPECTRUM.iter().map(|w| w.3[c]).zip(responses)))
    }
}
