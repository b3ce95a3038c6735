//! What a frame of one size needs, for one plan.

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, UVec4, Vec2, Vec3, Vec4};
use wgpu::{Buffer, BufferUsages, Device, Queue, TextureView};

use super::passes::{LIGHT, SHAPE};
use crate::gpu;
use crate::plan::{Kinds, MAX_LEVELS, Shape, Weights, own_blur};

/// Side of a tile, in pixels of its level.
pub(super) const TILE: u32 = 8;
/// Tiles along a side of what a workgroup packs.
pub(super) const SIDE: u32 = 2;

/// `View` of the shaders.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct View {
    pub has_id: u32,
    pub has_strength: u32,
    pub far: f32,
    pub has_albedo: u32,
    pub origin: Vec4,
    pub step: Vec4,
    pub depth_to_mm: Vec4,
    pub first_octave: f32,
    pub rows: u32,
    pub stride: u32,
    pub profiles: u32,
    pub first_pixel: UVec2,
    pub size: UVec2,
    pub frame_limit: f32,
    pub level_limit: f32,
    pub levels: u32,
    pub back_reach: f32,
    pub back_growth: f32,
    pub pad: [u32; 3],
}

/// `Blur` of surface.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Blur {
    variance: f32,
    own: f32,
    limit: f32,
    narrow: f32,
    sharpness: Vec4,
    slot: u32,
    pad: [u32; 3],
}

/// `Level` of surface.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Level {
    blurs: [Blur; 4],
    size: Vec2,
    scale: f32,
    rest: u32,
    coarser: u32,
    first_tile: u32,
    tile_count: u32,
    pad: u32,
}

/// `Step` of direct.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Default, Pod, Zeroable)]
struct Step {
    variances: Vec3,
    level: u32,
    slot: u32,
    pad: [u32; 3],
}

/// The narrow blurs of the frame, its wide ones, then those of each level.
pub(super) const STEPS: usize = 2 + MAX_LEVELS;

/// Blurs of the frame from this variance on are not summed together with narrower ones.
const WIDE_PX2: f32 = 1.0;

/// Bytes of a `Draw` of list_tiles.wgsl.
pub(super) const DRAW_BYTES: u64 = 16;
/// Draws of a level, one for each class of tiles.
pub(super) const CLASSES: u64 = 2;
/// Words of what a tile holds.
const CONTENTS: u32 = 3;

#[derive(Debug)]
pub(super) struct Scratch {
    pub size: [u32; 2],
    pub view: Buffer,
    /// Columns and rows of tiles of each level, and where they begin.
    pub grids: Buffer,
    pub steps: Buffer,
    /// What each tile holds.
    pub contents: Buffer,
    /// Tiles to be drawn.
    pub list: Buffer,
    pub draws: Buffer,
    /// What `draws` begins as.
    pub no_draws: Buffer,
    /// All levels of light, and of where the surface is.
    pub lights: TextureView,
    pub shapes: TextureView,
    pub levels: Vec<LevelScratch>,
    /// Means of level 1 and of level 2, and by turns of those above.
    pub means: [TextureView; 2],
}

#[derive(Debug)]
pub(super) struct LevelScratch {
    pub size: [u32; 2],
    pub tiles: [u32; 2],
    pub first_tile: u32,
    pub settings: Buffer,
    pub light: TextureView,
    pub shape: TextureView,
}

/// Levels above a frame of this size: one of a single pixel has nothing above it.
fn level_count(size: [u32; 2], plan: &Weights) -> usize {
    let [width, height] = padded(size);
    plan.levels.min(width.max(height).ilog2() as usize)
}

/// The frame, with as many columns and rows more as make the first levels whole.
fn padded(size: [u32; 2]) -> [u32; 2] {
    size.map(|s| s.next_multiple_of(1 << WHOLE_LEVELS))
}

/// Levels whose pixels cover all of the frame; those of the others leave less than one of them out.
const WHOLE_LEVELS: u32 = 4;

fn size_of_level(size: [u32; 2], l: usize) -> [u32; 2] {
    padded(size).map(|s| (s >> l).max(1))
}

fn tiles_of_level(size: [u32; 2], l: usize) -> [u32; 2] {
    // Of the tiles of the frame, which all have a place in each level.
    size.map(|s| s.div_ceil(TILE).div_ceil(1 << l))
}

fn count([x, y]: [u32; 2]) -> u64 {
    u64::from(x) * u64::from(y)
}

/// Bytes of the textures and lists of a frame of this size.
pub(super) fn bytes(size: [u32; 2], plan: &Weights) -> u64 {
    let of_level = |l| {
        // Light and shape; what tiles hold, and their list.
        16 * count(size_of_level(size, l)) + 16 * count(tiles_of_level(size, l))
    };
    let levels: u64 = (0..=level_count(size, plan)).map(of_level).sum();
    let means = [1, 2].map(|l| 8 * count(size_of_level(size, l)));
    levels + means.iter().sum::<u64>()
}

/// What a back layer takes on top.
pub(super) fn back_bytes(size: [u32; 2], plan: &Weights) -> u64 {
    let of_level = |l| 16 * count(size_of_level(size, l)) + 4 * count(tiles_of_level(size, l));
    (0..=level_count(size, plan)).map(of_level).sum()
}

/// A texture of so many levels, for a frame of this size.
pub(super) fn mips(
    device: &Device,
    label: &str,
    size: [u32; 2],
    levels: usize,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    let [width, height] = padded(size);
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: levels as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// One level of it.
pub(super) fn mip(texture: &wgpu::Texture, l: usize) -> TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        base_mip_level: l as u32,
        mip_level_count: Some(1),
        ..Default::default()
    })
}

impl Scratch {
    pub(super) fn new(device: &Device, queue: &Queue, size: [u32; 2], plan: &Weights) -> Self {
        let words = |label: &str, count: u32, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: 4 * u64::from(count),
                usage: BufferUsages::STORAGE | usage,
                mapped_at_creation: false,
            })
        };
        let last = level_count(size, plan);
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::STORAGE_BINDING;
        let mips = |label, format| mips(device, label, size, 1 + last, format, usage);
        let lights = mips("subsurface::pyramid light", LIGHT);
        let shapes = mips("subsurface::pyramid shape", SHAPE);
        let mut first_tile = 0;
        let levels: Vec<_> = (0..=last)
            .map(|l| {
                let level = LevelScratch {
                    size: if l == 0 { size } else { size_of_level(size, l) },
                    tiles: tiles_of_level(size, l),
                    first_tile,
                    settings: gpu::uniform_buffer::<Level>(device, "subsurface::pyramid level"),
                    light: mip(&lights, l),
                    shape: mip(&shapes, l),
                };
                first_tile += level.tiles[0] * level.tiles[1];
                level
            })
            .collect();
        let mut grids = [UVec4::ZERO; 1 + MAX_LEVELS];
        for (grid, level) in grids.iter_mut().zip(&levels) {
            *grid = UVec4::new(level.tiles[0], level.tiles[1], level.first_tile, 0);
        }
        let grids_buffer =
            gpu::uniform_buffer::<[UVec4; 1 + MAX_LEVELS]>(device, "subsurface::pyramid grids");
        queue.write_buffer(&grids_buffer, 0, bytemuck::bytes_of(&grids));
        let no_draws: Vec<u32> = [4u32, 0, 0, 0].repeat(CLASSES as usize * levels.len());
        let mean =
            |l| gpu::scratch_texture(device, "subsurface::pyramid mean", size_of_level(size, l), LIGHT);
        Self {
            size,
            view: gpu::uniform_buffer::<View>(device, "subsurface::pyramid view"),
            grids: grids_buffer,
            steps: gpu::uniform_buffer::<[Step; STEPS]>(device, "subsurface::pyramid steps"),
            contents: words(
                "subsurface::pyramid contents of tiles",
                CONTENTS * first_tile,
                BufferUsages::COPY_DST,
            ),
            list: words("subsurface::pyramid tiles", first_tile, BufferUsages::COPY_SRC),
            draws: words(
                "subsurface::pyramid draws",
                no_draws.len() as u32,
                BufferUsages::INDIRECT | BufferUsages::COPY_DST | BufferUsages::COPY_SRC,
            ),
            no_draws: gpu::filled_buffer(
                device,
                "subsurface::pyramid no draws",
                bytemuck::cast_slice(&no_draws),
                BufferUsages::COPY_SRC,
            ),
            lights: lights.create_view(&Default::default()),
            shapes: shapes.create_view(&Default::default()),
            levels,
            means: [mean(1), mean(2)],
        }
    }

    /// Uploads what the blurs of each level are by this plan, of which `last` is the coarsest.
    pub(super) fn set_plan(&self, queue: &Queue, plan: &Weights, last: usize) {
        for (l, level) in self.levels[..=last].iter().enumerate() {
            let settings = level_settings(plan, l, last, level);
            queue.write_buffer(&level.settings, 0, bytemuck::bytes_of(&settings));
        }
        queue.write_buffer(&self.steps, 0, bytemuck::bytes_of(&steps(plan, last)));
    }

    /// Where the mean of level `l` goes, from 1 on.
    pub(super) fn mean(&self, l: usize) -> &TextureView {
        &self.means[(l + 1) % 2]
    }
}

fn steps(plan: &Weights, last: usize) -> [Step; STEPS] {
    let mut steps = [Step::default(); STEPS];
    let step = |l: usize, first: usize, variances: &[f32]| {
        let variance = |j: usize| variances.get(j).copied().unwrap_or(0.0);
        let variances = Vec3::new(variance(0), variance(1), variance(2));
        Step { variances, level: l as u32, slot: plan.slot(l, first) as u32, pad: [0; 3] }
    };
    let of = |kinds: &Kinds| kinds.blurs().map(|b| b.variance_px2 as f32).collect::<Vec<_>>();
    let (fine, coarse) = (of(&plan.kernels.fine), of(&plan.kernels.coarse));
    let narrow = fine.partition_point(|variance| *variance < WIDE_PX2);
    steps[0] = step(0, 0, &fine[..narrow]);
    steps[1] = step(0, narrow, &fine[narrow..]);
    for l in 1..=last {
        steps[l + 1] = step(l, 0, &coarse);
    }
    steps
}

fn level_settings(plan: &Weights, l: usize, last: usize, level: &LevelScratch) -> Level {
    let kinds = if l == 0 { plan.kernels.fine } else { plan.kernels.coarse };
    let mut blurs = [Blur::zeroed(); 4];
    for (j, kind) in kinds.blurs().enumerate() {
        let square = kind.shape == Shape::Square;
        blurs[if square { 3 } else { j }] = Blur {
            variance: kind.variance_px2 as f32,
            own: own_blur(l) as f32,
            limit: kind.shape.limit() as f32,
            narrow: kind.shape.narrow() as f32,
            sharpness: Vec4::from_array(kind.shape.sharpness().map(|c| c as f32)),
            slot: plan.slot(l, j) as u32,
            pad: [0; 3],
        };
    }
    Level {
        blurs,
        size: Vec2::new(level.size[0] as f32, level.size[1] as f32),
        scale: (1 << l) as f32,
        rest: plan.rest_slot(l) as u32,
        coarser: u32::from(l < last),
        first_tile: level.first_tile,
        tile_count: level.tiles[0] * level.tiles[1],
        pad: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::passes::{DIRECT, LIST_TILES, PACK, PLANAR};
    use crate::wgsl::assert_layout;

    #[test]
    fn constants_are_those_of_the_shaders() {
        let shader = DIRECT.concat();
        let levels = crate::plan::MAX_LEVELS + 1;
        let profiles = 32 - crate::MAX_PROFILES;
        for constant in [
            format!("const TILE = {TILE}u;"),
            format!("const CLASSES = {CLASSES}u;"),
            format!("const STEPS = {STEPS}u;"),
            format!("const GRIDS = {levels}u;"),
            format!("const LEVELS = {:#x}u;", (1 << levels) - 1),
            format!("const DIFFICULTY_SHIFT = {levels}u;"),
            format!("const PROFILE_SHIFT = {profiles}u;"),
            format!("const ROWS_PER_OCTAVE = {:.1};", crate::plan::ROWS_PER_OCTAVE),
        ] {
            assert!(shader.contains(&constant), "{constant}");
        }
        assert!(PACK.concat().contains(&format!("const SIDE = {SIDE}u;")));
    }

    #[test]
    fn structs_lie_as_the_shaders_have_them() {
        assert_layout!(
            &PLANAR.concat(),
            "View",
            View {
                has_id,
                has_strength,
                far,
                has_albedo,
                origin,
                step,
                depth_to_mm,
                first_octave,
                rows,
                stride,
                profiles,
                first_pixel,
                size,
                frame_limit,
                level_limit,
                levels,
                back_reach,
                back_growth
            }
        );
        assert_layout!(&PLANAR.concat(), "Blur", Blur { variance, own, limit, narrow, sharpness, slot });
        assert_layout!(
            &PLANAR.concat(),
            "Level",
            Level { blurs, size, scale, rest, coarser, first_tile, tile_count }
        );
        assert_layout!(&DIRECT.concat(), "Step", Step { variances, level, slot });
        let (_, draw) = crate::wgsl::layout(&LIST_TILES.concat(), "Draw");
        assert_eq!(draw as u64, DRAW_BYTES);
    }
}
