//! What a host hands in, checked before the device sees it.

use wgpu::{TextureFormat, TextureSampleType, TextureUsages, TextureView};

use crate::{Error, Output, Profile};

/// What a texture is read or written as.
#[derive(Clone, Copy)]
pub(crate) enum Role {
    /// Read as linear RGB, and alpha where there is one.
    Color,
    /// Read as positions.
    Positions,
    /// Read as one float, from a depth or a single-channel format.
    Depth,
    /// Read as an unsigned integer.
    Id,
    /// Read as three numbers from -1 to 1, or 0 to 1 that stand for them.
    Normal,
    /// Read as one float, the first of any number.
    Strength,
    /// Rendered to.
    Target(TextureFormat),
}

/// Checks that `view` shows a single-sampled 2-D texture of this role and size.
pub(crate) fn check_texture(
    input: &str,
    view: &TextureView,
    role: Role,
    size: [u32; 2],
) -> Result<(), Error> {
    let texture = view.texture();
    let format = texture.format();
    let kind = format.sample_type(None, None);
    let float = matches!(kind, Some(TextureSampleType::Float { .. }));
    let (format_fits, format_needs) = match role {
        Role::Color => (
            float && format.components() >= 3,
            "three or four float channels".into(),
        ),
        Role::Positions => (format == TextureFormat::Rgba32Float, "Rgba32Float".into()),
        Role::Depth => (
            format.has_depth_aspect() || format == TextureFormat::R32Float,
            "a depth format or R32Float".into(),
        ),
        Role::Id => (
            matches!(kind, Some(TextureSampleType::Uint)) && format.components() == 1,
            "one unsigned integer channel".into(),
        ),
        Role::Normal => (
            is_unorm(format)
                || matches!(
                    format,
                    TextureFormat::Rgba16Float
                        | TextureFormat::Rgba32Float
                        | TextureFormat::Rgba8Snorm
                        | TextureFormat::Rgba16Snorm
                ),
            "three signed channels, or unorm ones that stand for them".into(),
        ),
        Role::Strength => (
            float && !format.has_depth_aspect(),
            "float channels, such as R8Unorm".into(),
        ),
        Role::Target(wanted) => (format == wanted, format!("{wanted:?}")),
    };
    if !format_fits {
        return Err(Error::new(
            format!("{input}: format"),
            format!("{format:?}"),
            format_needs,
        ));
    }
    if texture.dimension() != wgpu::TextureDimension::D2 || texture.sample_count() != 1 {
        return Err(Error::new(
            input,
            format!(
                "{:?} with {} samples",
                texture.dimension(),
                texture.sample_count()
            ),
            "a 2-D texture with 1 sample",
        ));
    }
    let usage = match role {
        Role::Target(_) => TextureUsages::RENDER_ATTACHMENT,
        _ => TextureUsages::TEXTURE_BINDING,
    };
    if !texture.usage().contains(usage) {
        return Err(Error::new(
            format!("{input}: usage"),
            format!("{:?}", texture.usage()),
            format!("{usage:?}"),
        ));
    }
    if [texture.width(), texture.height()] != size {
        return Err(Error::new(
            format!("{input}: size"),
            format!("{}x{}", texture.width(), texture.height()),
            format!("{}x{} as the irradiance has", size[0], size[1]),
        ));
    }
    Ok(())
}

/// Checks that no texture is read and written at once.
pub(crate) fn check_apart(
    output: &TextureView,
    inputs: &[(&str, &TextureView)],
) -> Result<(), Error> {
    for (input, view) in inputs {
        if view.texture() == output.texture() {
            return Err(Error::new(
                "output",
                format!("the texture of {input}"),
                "a texture of its own",
            ));
        }
    }
    Ok(())
}

/// Checks that there are profiles, and no more than the ids can name.
pub(crate) fn check_profiles(profiles: &[Profile]) -> Result<(), Error> {
    if profiles.is_empty() || profiles.len() > crate::MAX_PROFILES {
        return Err(Error::new(
            "profiles",
            format!("{}", profiles.len()),
            format!("1 to {}", crate::MAX_PROFILES),
        ));
    }
    Ok(())
}

/// Checks a length of a scene unit in mm.
pub(crate) fn check_mm_per_unit(mm_per_unit: f32) -> Result<(), Error> {
    if !mm_per_unit.is_finite() || mm_per_unit <= 0.0 {
        return Err(Error::new(
            "mm_per_unit",
            mm_per_unit.to_string(),
            "a finite number above 0",
        ));
    }
    Ok(())
}

/// Checks that passes can render to an output, and add to it where they have to.
pub(crate) fn check_output(device: &wgpu::Device, output: Output) -> Result<(), Error> {
    let format = output.format();
    let float = matches!(
        format.sample_type(None, None),
        Some(TextureSampleType::Float { .. })
    );
    let features = format.guaranteed_format_features(device.features());
    if !float
        || format.components() < 3
        || !features
            .allowed_usages
            .contains(TextureUsages::RENDER_ATTACHMENT)
    {
        return Err(Error::new(
            "output: format",
            format!("{format:?}"),
            "a format of three or four float channels that this device renders to",
        ));
    }
    let blends = wgpu::TextureFormatFeatureFlags::BLENDABLE;
    if output.adds() && !features.flags.contains(blends) {
        return Err(Error::new(
            "output: format",
            format!("{format:?}"),
            "a format that this device blends, such as Rgba16Float",
        ));
    }
    let signed = matches!(
        format,
        TextureFormat::Rgba16Float | TextureFormat::Rgba32Float
    );
    if output.adds() && !signed {
        return Err(Error::new(
            "output: format",
            format!("{format:?}"),
            "Rgba16Float or Rgba32Float, since what is added may be negative",
        ));
    }
    Ok(())
}

/// Whether a format holds 0 to 1, in steps.
pub(crate) fn is_unorm(format: TextureFormat) -> bool {
    use TextureFormat as F;
    matches!(
        format,
        F::Rgba8Unorm | F::Bgra8Unorm | F::Rgb10a2Unorm | F::Rgba16Unorm
    )
}

/// Width and height in pixels.
pub(crate) fn size(view: &TextureView) -> [u32; 2] {
    [view.texture().width(), view.texture().height()]
}
