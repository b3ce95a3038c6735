//! What a picture shows, and how the window shows pictures.

/// One picture's content.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Layer {
    /// The light as it fell.
    None,
    /// Scattered over an atlas.
    Texture,
    /// Scattered on the screen by a plan.
    Screen,
    /// Scattered on the screen by the exact sum.
    Exact,
    /// How wide the kernel is, in false colours.
    Width,
    /// Up to which level of the pyramid the plan blurs, in false colours.
    Level,
}

impl Layer {
    pub const ALL: [Self; 6] =
        [Self::None, Self::Texture, Self::Screen, Self::Exact, Self::Width, Self::Level];

    pub fn title(self) -> &'static str {
        match self {
            Self::None => "no scattering",
            Self::Texture => "texture space",
            Self::Screen => "screen space, a plan",
            Self::Exact => "screen space, exact sum",
            Self::Width => "kernel width",
            Self::Level => "level of the plan",
        }
    }

    /// Whether an effect draws it, pass by pass.
    pub fn has_passes(self) -> bool {
        matches!(self, Self::Texture | Self::Screen | Self::Exact)
    }
}

/// One layer, or two on the sides of a divider.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    One(Layer),
    Split,
}

impl Mode {
    /// In the order of their keys, from 1.
    pub const ALL: [Self; 7] = [
        Self::One(Layer::None),
        Self::One(Layer::Texture),
        Self::One(Layer::Screen),
        Self::One(Layer::Exact),
        Self::Split,
        Self::One(Layer::Width),
        Self::One(Layer::Level),
    ];

    pub fn title(self) -> &'static str {
        match self {
            Self::One(layer) => layer.title(),
            Self::Split => "split",
        }
    }

    /// What is to be drawn, from left to right; `pair` are the sides of the divider.
    pub fn layers(self, pair: [Layer; 2]) -> Vec<Layer> {
        match self {
            Self::One(layer) => vec![layer],
            Self::Split => pair.to_vec(),
        }
    }
}
