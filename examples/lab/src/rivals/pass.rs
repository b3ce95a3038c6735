//! A full-screen pass, and the textures that passes hand to each other.

use subsurface::wgpu::{
    self, BindGroup, BindGroupLayout, BindingResource, Color, ColorTargetState, CommandEncoder, Device,
    LoadOp, RenderPipeline, TextureFormat, TextureView,
};

use crate::passes::{self, Pipeline};
pub use crate::passes::{CLEAR, Slot};

/// Which pixels a pass draws.
#[derive(Clone, Copy, PartialEq)]
pub enum Over {
    All,
    /// All, and marks in the stencil what its shader does not discard.
    Marking,
    /// What is marked.
    Skin,
    /// What is not.
    Rest,
}

/// Of the stencil, which the papers have from their G-buffers.
pub const STENCIL: TextureFormat = TextureFormat::Stencil8;
/// What marks skin.
const SKIN: u32 = 1;

impl Over {
    fn depth_stencil(self) -> Option<wgpu::DepthStencilState> {
        use wgpu::{CompareFunction, StencilOperation};
        let (compare, pass_op) = match self {
            Self::All => return None,
            Self::Marking => (CompareFunction::Always, StencilOperation::Replace),
            Self::Skin => (CompareFunction::Equal, StencilOperation::Keep),
            Self::Rest => (CompareFunction::NotEqual, StencilOperation::Keep),
        };
        let face = wgpu::StencilFaceState { compare, pass_op, ..Default::default() };
        Some(wgpu::DepthStencilState {
            format: STENCIL,
            depth_write_enabled: None,
            depth_compare: None,
            stencil: wgpu::StencilState { front: face, back: face, read_mask: 0xff, write_mask: 0xff },
            bias: Default::default(),
        })
    }
}

/// Draws one triangle over its targets by the fragment shader `entry_point` of a WGSL text that
/// has a `vs_main`, too.
pub struct Pass {
    label: String,
    over: Over,
    layout: BindGroupLayout,
    pipeline: RenderPipeline,
}

impl Pass {
    /// Over all pixels. `constants` are the values of the text's `override`s.
    pub fn new(
        device: &Device,
        label: &str,
        shader: (&str, &str),
        slots: &[Slot],
        targets: &[ColorTargetState],
        constants: &[(&str, f64)],
    ) -> Self {
        Self::over(Over::All, device, label, shader, slots, targets, constants)
    }

    /// Over some, by the stencil that it is drawn with.
    pub fn over(
        over: Over,
        device: &Device,
        label: &str,
        (wgsl, entry_point): (&str, &str),
        slots: &[Slot],
        targets: &[ColorTargetState],
        constants: &[(&str, f64)],
    ) -> Self {
        let layout = passes::layout(device, label, slots);
        let shader = passes::module(device, label, &[wgsl]);
        let pipeline = Pipeline {
            groups: &[Some(&layout)],
            targets,
            depth_stencil: over.depth_stencil(),
            constants,
            ..Pipeline::of(label, &shader, ["vs_main", entry_point])
        }
        .make(device);
        Self { label: label.into(), over, layout, pipeline }
    }

    /// Binds the resources, in the order of the slots.
    pub fn bind(&self, device: &Device, resources: &[BindingResource]) -> BindGroup {
        passes::group(device, &self.label, &self.layout, resources)
    }

    /// Draws over targets that need not hold anything yet.
    pub fn draw(&self, encoder: &mut CommandEncoder, group: &BindGroup, targets: &[&TextureView]) {
        let targets: Vec<_> = targets.iter().map(|&view| (view, CLEAR)).collect();
        draw(encoder, &[(self, group)], &targets, None, Color::BLACK);
    }
}

/// Draws passes one after the other over the same targets, each cleared or kept, by a stencil where they need
/// one, and with the constant that blending uses.
pub fn draw(
    encoder: &mut CommandEncoder,
    draws: &[(&Pass, &BindGroup)],
    targets: &[(&TextureView, LoadOp<Color>)],
    stencil: Option<&TextureView>,
    blend_constant: Color,
) {
    // Read only, but where it is marked.
    let marks = draws.iter().any(|(pass, _)| pass.over == Over::Marking);
    let stencil = stencil.map(|view| wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: None,
        stencil_ops: marks
            .then_some(wgpu::Operations { load: LoadOp::Clear(0), store: wgpu::StoreOp::Store }),
    });
    let label = draws.first().map_or("", |(pass, _)| &pass.label);
    let mut pass = passes::begin(encoder, label, targets, stencil);
    pass.set_blend_constant(blend_constant);
    pass.set_stencil_reference(SKIN);
    for (drawn, group) in draws {
        pass.set_pipeline(&drawn.pipeline);
        pass.set_bind_group(0, *group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// The vertex shader of every pass.
pub const TRIANGLE: &str = include_str!("triangle.wgsl");

/// Width and height in pixels.
pub fn size(view: &TextureView) -> [u32; 2] {
    [view.texture().width(), view.texture().height()]
}

/// Textures of these formats and this size: those at hand where they fit, new ones otherwise.
pub fn scratch<const N: usize>(
    device: &Device,
    label: &str,
    at_hand: Option<[TextureView; N]>,
    size: [u32; 2],
    formats: [TextureFormat; N],
) -> [TextureView; N] {
    if let Some(views) = at_hand.filter(|views| views.iter().all(|v| self::size(v) == size)) {
        return views;
    }
    formats.map(|format| texture(device, label, size, format))
}

/// A texture that passes write and read.
pub fn texture(device: &Device, label: &str, size: [u32; 2], format: TextureFormat) -> TextureView {
    device
        .create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        })
        .create_view(&Default::default())
}
