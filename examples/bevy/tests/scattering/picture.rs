//! Pictures that were read back.

use bevy::render::render_resource::TextureFormat;
use half::f16;

/// Linear values of a texture; bits as they were stored.
#[derive(Clone, PartialEq)]
pub struct Picture {
    pub size: [u32; 2],
    pub pixels: Vec<[f32; 4]>,
}

impl Picture {
    /// From rows without padding.
    pub fn new(size: [u32; 2], format: TextureFormat, texels: &[u8]) -> Self {
        let pixels = match format {
            TextureFormat::Rgba16Float => texels
                .chunks(8)
                .map(|t| [0, 2, 4, 6].map(|i| f16::from_le_bytes([t[i], t[i + 1]]).to_f32()))
                .collect(),
            TextureFormat::Rgba8UnormSrgb => {
                texels.chunks(4).map(|t| [t[0], t[1], t[2], t[3]].map(|b| f32::from(b) / 255.0)).collect()
            }
            TextureFormat::R8Uint => texels.iter().map(|t| [f32::from(*t); 4]).collect(),
            TextureFormat::Depth32Float => {
                texels.chunks(4).map(|t| [f32::from_le_bytes([t[0], t[1], t[2], t[3]]); 4]).collect()
            }
            other => panic!("a format that no test reads: {other:?}"),
        };
        Self { size, pixels }
    }

    /// The largest difference of a colour, and in how many pixels there is one, where `mask` is true.
    pub fn difference(&self, other: &Self, mask: impl Fn(usize) -> bool) -> (f32, usize) {
        assert_eq!(self.size, other.size);
        let mut most = 0.0f32;
        let mut count = 0;
        for (i, (a, b)) in self.pixels.iter().zip(&other.pixels).enumerate() {
            if mask(i) {
                let d = [0, 1, 2, 3].map(|c| (a[c] - b[c]).abs()).into_iter().fold(0.0, f32::max);
                assert!(d.is_finite());
                most = most.max(d);
                count += usize::from(d > 0.0);
            }
        }
        (most, count)
    }

    /// The mean of the colours where `mask` is true.
    pub fn mean(&self, mask: impl Fn(usize) -> bool) -> [f64; 3] {
        let inside: Vec<_> = self.pixels.iter().enumerate().filter(|(i, _)| mask(*i)).collect();
        [0, 1, 2].map(|c| inside.iter().map(|(_, p)| f64::from(p[c])).sum::<f64>() / inside.len() as f64)
    }
}
