//! What is checked of a host's inputs, before the device sees them.

use wgpu::{TextureFormat, TextureSampleType, TextureUsages, TextureView};

use crate::{Error, Frame, MAX_PROFILES, Output, Profile, Viewport};

/// What a texture is read as.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Role {
    /// Linear RGB, and alpha where there is one.
    Color,
    /// Positions.
    Positions,
    /// One float, from a depth or a single-channel format.
    Depth,
    /// An unsigned integer.
    Id,
    /// One float, the first of any number.
    Strength,
}

impl Role {
    fn fits(self, format: TextureFormat) -> bool {
        let kind = format.sample_type(None, None);
        let is_float = matches!(kind, Some(TextureSampleType::Float { .. }));
        match self {
            Self::Color => is_float && format.components() >= 3,
            Self::Positions => format == TextureFormat::Rgba32Float,
            Self::Depth => format.has_depth_aspect() || format == TextureFormat::R32Float,
            Self::Id => matches!(kind, Some(TextureSampleType::Uint)) && format.components() == 1,
            Self::Strength => is_float && !format.has_depth_aspect(),
        }
    }

    fn needs(self) -> &'static str {
        match self {
            Self::Color => "three or four float channels",
            Self::Positions => "Rgba32Float",
            Self::Depth => "a depth format or R32Float",
            Self::Id => "one unsigned integer channel",
            Self::Strength => "float channels, such as R8Unorm",
        }
    }
}

/// Checks all of a frame but its projection.
pub(crate) fn frame(frame: &Frame, output: Output) -> Result<(), Error> {
    let size = frame.size();
    for (input, view) in frame.textures() {
        let role = match input {
            "depth" | "back.depth" => Role::Depth,
            "profile_id" | "back.profile_id" => Role::Id,
            "strength" => Role::Strength,
            _ => Role::Color,
        };
        texture(input, view, role, size)?;
    }
    if frame.albedo.is_some() && !output.adds() {
        return Err(Error::AlbedoUnused);
    }
    let Viewport { x, y, width, height } = frame.rectangle();
    let fits = |first: u32, length: u32, size: u32| {
        length > 0 && first.checked_add(length).is_some_and(|end| end <= size)
    };
    if !fits(x, width, size[0]) || !fits(y, height, size[1]) {
        return Err(Error::Viewport { got: frame.rectangle(), size });
    }
    if let Some(nearest) = frame.nearest {
        positive("nearest", nearest)?;
    }
    positive("mm_per_unit", frame.mm_per_unit)
}

/// Checks that `view` shows a single-sampled 2-D texture of this role and size that shaders can read.
pub(crate) fn texture(
    input: &'static str,
    view: &TextureView,
    role: Role,
    size: [u32; 2],
) -> Result<(), Error> {
    let got = view.texture().format();
    if !role.fits(got) {
        return Err(Error::Format { input, got, needs: role.needs() });
    }
    plain(input, view, TextureUsages::TEXTURE_BINDING, size)
}

/// Checks that `view` can be rendered to in the format of `output`, and is none of the textures read.
pub(crate) fn target<'a>(
    view: &TextureView,
    output: Output,
    size: [u32; 2],
    read: impl Iterator<Item = (&'static str, &'a TextureView)>,
) -> Result<(), Error> {
    let got = view.texture().format();
    if got != output.format() {
        return Err(Error::OutputFormat { got, needs: output.format() });
    }
    plain("output", view, TextureUsages::RENDER_ATTACHMENT, size)?;
    for (input, other) in read {
        if other.texture() == view.texture() {
            return Err(Error::OutputIsInput { input });
        }
    }
    Ok(())
}

fn plain(
    input: &'static str,
    view: &TextureView,
    usage: TextureUsages,
    size: [u32; 2],
) -> Result<(), Error> {
    let texture = view.texture();
    if texture.dimension() != wgpu::TextureDimension::D2 || texture.sample_count() != 1 {
        return Err(Error::Texture {
            input,
            dimension: texture.dimension(),
            samples: texture.sample_count(),
        });
    }
    if !texture.usage().contains(usage) {
        return Err(Error::Usage { input, got: texture.usage(), needs: usage });
    }
    let got = [texture.width(), texture.height()];
    if got != size {
        return Err(Error::Size { input, got, needs: size });
    }
    Ok(())
}

/// Checks that there are profiles, and no more than ids can name.
pub(crate) fn profiles(profiles: &[Profile]) -> Result<(), Error> {
    if profiles.is_empty() || profiles.len() > MAX_PROFILES {
        return Err(Error::Count { input: "profiles", got: profiles.len(), needs: [1, MAX_PROFILES] });
    }
    Ok(())
}

/// Checks a length.
pub(crate) fn positive(input: &str, length: f32) -> Result<(), Error> {
    if !length.is_finite() || length <= 0.0 {
        return Err(Error::Number {
            input: input.into(),
            got: length.into(),
            needs: "a finite number above 0",
        });
    }
    Ok(())
}

/// Checks that passes can render to an output, and add to it where they have to.
pub(crate) fn output(device: &wgpu::Device, output: Output) -> Result<(), Error> {
    use wgpu::TextureFormatFeatureFlags as Flags;
    let format = output.format();
    let is_float = matches!(format.sample_type(None, None), Some(TextureSampleType::Float { .. }));
    let features = format.guaranteed_format_features(device.features());
    let can_render = features.allowed_usages.contains(TextureUsages::RENDER_ATTACHMENT);
    let refuse = |needs| Err(Error::Format { input: "output", got: format, needs });
    if !is_float || format.components() < 3 || !can_render {
        return refuse("three or four float channels that this device renders to");
    }
    if output.adds() && !features.flags.contains(Flags::BLENDABLE) {
        return refuse("a format that this device blends, such as Rgba16Float");
    }
    let is_signed = matches!(format, TextureFormat::Rgba16Float | TextureFormat::Rgba32Float);
    if output.adds() && !is_signed {
        return refuse("Rgba16Float or Rgba32Float, since what is added may be negative");
    }
    Ok(())
}
