//! What a frame of one size needs, for one plan.

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, Vec2, Vec4};
use wgpu::{Buffer, BufferUsages, Device, Queue, TextureView};

use super::passes::{LIGHT, SHAPE};
use crate::gpu;
use crate::plan::{Shape, Weights, own_blur};

/// Side of a tile, in pixels of its level.
pub(super) const TILE: u32 = 8;
/// Columns of pixels that a workgroup marks the tiles of.
pub(super) const COLUMNS: u32 = 64;

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
    pad: [u32; 3],
}

/// `Level` of tiles.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Gathering {
    tiles: UVec2,
    below: UVec2,
    level: u32,
    pad: u32,
}

/// Bytes of a `Draw` of tiles.wgsl; each list has two, of simple tiles and of the others.
pub(super) const DRAW_BYTES: u64 = 16;

#[derive(Debug)]
pub(super) struct Scratch {
    pub size: [u32; 2],
    pub view: Buffer,
    /// What the frame's tiles hold, and where they bend.
    pub marked: Buffer,
    pub levels: Vec<LevelScratch>,
    /// Means of level 1 and of level 2, and by turns of those above.
    pub means: [TextureView; 2],
}

#[derive(Debug)]
pub(super) struct LevelScratch {
    pub size: [u32; 2],
    pub tiles: [u32; 2],
    pub gathering: Buffer,
    pub settings: Buffer,
    pub light: TextureView,
    pub shape: TextureView,
    pub marked: Buffer,
    pub list: Buffer,
    pub draws: Buffer,
}

/// Levels above a frame of this size: one of a single pixel has nothing above it.
fn level_count(size: [u32; 2], plan: &Weights) -> usize {
    let largest = size[0].max(size[1]);
    plan.levels
        .min(largest.next_power_of_two().ilog2() as usize)
}

fn size_of_level(size: [u32; 2], l: usize) -> [u32; 2] {
    size.map(|s| s.div_ceil(1 << l))
}

fn count([x, y]: [u32; 2]) -> u64 {
    u64::from(x) * u64::from(y)
}

/// Bytes of the textures and lists of a frame of this size.
pub(super) fn bytes(size: [u32; 2], plan: &Weights) -> u64 {
    let tiles = |size: [u32; 2]| count(size.map(|s| s.div_ceil(TILE)));
    let of_level = |l| {
        let size = size_of_level(size, l);
        // Light and shape, marks and a list.
        16 * count(size) + 8 * tiles(size)
    };
    let levels: u64 = (0..=level_count(size, plan)).map(of_level).sum();
    let means: u64 = [1, 2]
        .map(|l| 8 * count(size_of_level(size, l)))
        .iter()
        .sum();
    levels + means + 4 * tiles(size)
}

impl Scratch {
    pub fn new(device: &Device, queue: &Queue, size: [u32; 2], plan: &Weights) -> Self {
        let words = |label: &str, count: u32, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: 4 * u64::from(count),
                usage: BufferUsages::STORAGE | usage,
                mapped_at_creation: false,
            })
        };
        let levels = level_count(size, plan);
        let size_of_level = |l| size_of_level(size, l);
        let tiles_of_frame = size.map(|s| s.div_ceil(TILE));
        let frame_tiles = tiles_of_frame[0] * tiles_of_frame[1];
        let mut below = tiles_of_frame;
        let levels: Vec<_> = (0..=levels)
            .map(|l| {
                let size = size_of_level(l);
                let tiles = size.map(|s| s.div_ceil(TILE));
                let count = tiles[0] * tiles[1];
                let level = LevelScratch {
                    size,
                    tiles,
                    gathering: gpu::uniform_buffer::<Gathering>(
                        device,
                        "subsurface::pyramid tiles of a level",
                    ),
                    settings: gpu::uniform_buffer::<Level>(device, "subsurface::pyramid level"),
                    light: gpu::scratch_texture(device, "subsurface::pyramid light", size, LIGHT),
                    shape: gpu::scratch_texture(device, "subsurface::pyramid shape", size, SHAPE),
                    marked: words("subsurface::pyramid marks", count, BufferUsages::empty()),
                    list: words("subsurface::pyramid tiles", count, BufferUsages::empty()),
                    draws: words(
                        "subsurface::pyramid draws",
                        8,
                        BufferUsages::INDIRECT | BufferUsages::COPY_DST | BufferUsages::COPY_SRC,
                    ),
                };
                let draws = [4u32, 0, 0, 0, 4, 0, 0, 0];
                queue.write_buffer(&level.draws, 0, bytemuck::bytes_of(&draws));
                let gathering = Gathering {
                    tiles: tiles.into(),
                    below: below.into(),
                    level: l as u32,
                    pad: 0,
                };
                queue.write_buffer(&level.gathering, 0, bytemuck::bytes_of(&gathering));
                below = tiles;
                level
            })
            .collect();
        let mean =
            |l| gpu::scratch_texture(device, "subsurface::pyramid mean", size_of_level(l), LIGHT);
        Self {
            size,
            view: gpu::uniform_buffer::<View>(device, "subsurface::pyramid view"),
            marked: words(
                "subsurface::pyramid marks",
                frame_tiles,
                BufferUsages::COPY_DST,
            ),
            levels,
            means: [mean(1), mean(2)],
        }
    }

    /// Uploads what the blurs of each level are by this plan.
    pub fn set_plan(&self, queue: &Queue, plan: &Weights) {
        let last = self.levels.len() - 1;
        for (l, level) in self.levels.iter().enumerate() {
            let settings = level_settings(plan, l, last, level.size);
            queue.write_buffer(&level.settings, 0, bytemuck::bytes_of(&settings));
        }
    }

    /// Where the mean of level `l` goes, from 1 on.
    pub fn mean(&self, l: usize) -> &TextureView {
        &self.means[(l + 1) % 2]
    }
}

fn level_settings(plan: &Weights, l: usize, levels: usize, size: [u32; 2]) -> Level {
    let kinds = if l == 0 {
        plan.kernels.fine
    } else {
        plan.kernels.coarse
    };
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
        size: Vec2::new(size[0] as f32, size[1] as f32),
        scale: (1 << l) as f32,
        rest: plan.rest_slot(l) as u32,
        coarser: u32::from(l < levels),
        pad: [0; 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::passes::{BLURS, PACK, TILES};
    use crate::wgsl::assert_layout;

    #[test]
    fn constants_are_those_of_the_shaders() {
        let rows = crate::plan::ROWS_PER_OCTAVE;
        let [blurs, tiles, pack] = [BLURS[0], TILES, PACK].map(<[&str]>::concat);
        for shader in [&blurs, &tiles] {
            assert!(shader.contains(&format!("const TILE = {TILE}u;")));
            assert!(shader.contains(&format!("const ROWS_PER_OCTAVE = {rows:.1};")));
        }
        // A bit for the frame and for each level, then for the bends; from the other end for each profile.
        let bends = format!("const BENT_SHIFT = {}u;", crate::plan::MAX_LEVELS + 1);
        for shared in ["const FLAT_LEVELS = 3u;", &bends] {
            assert!(tiles.contains(shared) && pack.contains(shared));
        }
        let profiles = 32 - crate::MAX_PROFILES;
        assert!(tiles.contains(&format!("const PROFILE_SHIFT = {profiles}u;")));
        assert!(tiles.contains(&format!("const COLUMNS = {COLUMNS}u;")));
    }

    #[test]
    fn structs_lie_as_the_shaders_have_them() {
        let [blurs, tiles] = [BLURS[0], TILES].map(<[&str]>::concat);
        assert_layout!(
            &blurs,
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
                size
            }
        );
        assert_layout!(
            &blurs,
            "Blur",
            Blur {
                variance,
                own,
                limit,
                narrow,
                sharpness,
                slot
            }
        );
        assert_layout!(
            &blurs,
            "Level",
            Level {
                blurs,
                size,
                scale,
                rest,
                coarser
            }
        );
        assert_eq!(
            crate::wgsl::layout(&tiles, "View"),
            crate::wgsl::layout(&blurs, "View")
        );
        assert_layout!(
            &tiles,
            "Level",
            Gathering {
                tiles,
                below,
                level
            }
        );
    }
}
