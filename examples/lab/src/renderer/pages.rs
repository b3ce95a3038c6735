//! UV pages: atlas coordinates that give every surface point a texel of its own.
//!
//! A texture-space method stores light per texel, but an artist's UVs overlap, mirror and leave
//! the unit square. Here a mesh is cut into UV islands, each is brought inside the unit square,
//! and islands that would cover the same texels go to different pages of the atlas.

use std::collections::HashMap;
use std::ops::Range;

use super::scene::{Primitive, Vertex};

/// Texels along one side of the raster that overlap is counted on.
const RASTER: usize = 1024;
/// How far outside the unit square UVs may lie and still count as inside.
const MARGIN: f64 = 1e-6;
/// Share of its own texels that an island may have in common with a page.
const OVERLAP: f64 = 0.005;
/// The last page takes all that found no place, so that thousands of islands stacked on one
/// tile do not cost thousands of pages.
const MAX_PAGES: usize = 64;

/// One bit per texel of a row.
type Row = [u64; RASTER / 64];
type Mask = Vec<Row>;

/// Fills in `atlas_uv` and sorts the triangles by page, and returns each page's index range.
/// A vertex that several islands share is duplicated, so islands share no vertex afterwards.
///
/// Every index must lie in `vertices`. An island that overlaps itself stays as it is.
pub(super) fn paginate(vertices: &mut Vec<Vertex>, indices: &mut Vec<u32>) -> Vec<Range<u32>> {
    let mut islands = islands(vertices, indices.as_chunks().0);
    let mut owner = vec![usize::MAX; vertices.len()];
    let mut copies = HashMap::new();
    for (id, island) in islands.iter_mut().enumerate() {
        let to_atlas = placement(&island.triangles, vertices);
        for corner in island.triangles.iter_mut().flatten() {
            let source = *corner as usize;
            if owner[source] == usize::MAX {
                owner[source] = id;
                vertices[source].atlas_uv = to_atlas(vertices[source].uv);
            } else if owner[source] != id {
                *corner = *copies.entry((source, id)).or_insert_with(|| {
                    let mut copy = vertices[source];
                    copy.atlas_uv = to_atlas(copy.uv);
                    vertices.push(copy);
                    vertices.len() as u32 - 1
                });
            }
        }
        let area = |t: &[u32; 3]| uv_area(t.map(|i| vertices[i as usize].atlas_uv)).abs();
        island.area = island.triangles.iter().map(area).sum();
    }
    islands.sort_by(|a, b| b.area.total_cmp(&a.area));

    let mut pages: Vec<(Mask, Vec<u32>)> = Vec::new();
    let mut mask = empty_mask();
    for island in islands {
        let rows = island.rasterise(vertices, &mut mask);
        let own = &mut mask[rows.clone()];
        let texels: u32 = own.iter().flatten().map(|word| word.count_ones()).sum();
        let allowed = ((OVERLAP * f64::from(texels)) as u32).max(2);
        let fits = |(page, _): &(Mask, _)| overlap_within(allowed, &page[rows.clone()], own);
        let chosen = pages.iter().position(fits).unwrap_or_else(|| {
            if pages.len() < MAX_PAGES {
                pages.push((empty_mask(), Vec::new()));
            }
            pages.len() - 1
        });
        let (page, page_indices) = &mut pages[chosen];
        for (to, from) in page[rows].iter_mut().flatten().zip(own.iter_mut().flatten()) {
            *to |= std::mem::take(from);
        }
        page_indices.extend(island.triangles.iter().flatten());
    }

    indices.clear();
    let append = |(_, page_indices): &(_, Vec<u32>)| {
        let start = indices.len() as u32;
        indices.extend(page_indices);
        start..indices.len() as u32
    };
    pages.iter().map(append).collect()
}

impl Primitive {
    /// Size of one texel on the surface, in scene units, when `page` is stored in a square texture
    /// of `texture_size` texels a side: the area-weighted median over the page's triangles of
    /// √(surface area / texel area). 0 if there is no such page or it covers no texels.
    pub fn texel_size(&self, page: usize, texture_size: u32) -> f32 {
        let texels = f64::from(texture_size).powi(2);
        let measure = |triangle: &[u32; 3]| {
            let corners = triangle.map(|i| self.vertices[i as usize]);
            let [a, b, c] = corners.map(|v| glam::Vec3::from(v.position).as_dvec3());
            let area = 0.5 * (b - a).cross(c - a).length();
            let texel_area = uv_area(corners.map(|v| v.atlas_uv)).abs() * texels;
            (texel_area > 0.0).then(|| ((area / texel_area).sqrt(), area))
        };
        let range = self.pages.get(page).cloned().unwrap_or_default();
        let (triangles, _) = self.indices[range.start as usize..range.end as usize].as_chunks();
        let mut sizes: Vec<(f64, f64)> = triangles.iter().filter_map(measure).collect();
        sizes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut remaining = 0.5 * sizes.iter().map(|(_, area)| area).sum::<f64>();
        let median = sizes.iter().find(|(_, area)| {
            remaining -= area;
            remaining <= 0.0
        });
        median.map_or(0.0, |(size, _)| *size as f32)
    }
}

/// Triangles that are connected in UV space and wound the same way there.
#[derive(Default)]
struct Island {
    triangles: Vec<[u32; 3]>,
    /// Area in the atlas, 1 being the whole page.
    area: f64,
}

impl Island {
    /// Sets the texels whose centres the island covers and returns the rows it touches.
    ///
    /// Scan lines are half open in both axes (the top-left rule), and an edge is walked in the
    /// same direction from either side, so that islands sharing an edge share no texel.
    fn rasterise(&self, vertices: &[Vertex], mask: &mut Mask) -> Range<usize> {
        let texel = |x: f64| ((x - 0.5).ceil().max(0.0) as usize).min(RASTER);
        let (mut first, mut end) = (RASTER, 0);
        for triangle in &self.triangles {
            let uvs = triangle.map(|i| vertices[i as usize].atlas_uv);
            let corners = uvs.map(|uv| uv.map(|x| f64::from(x) * RASTER as f64));
            let [y0, y1, y2] = corners.map(|c| c[1]);
            let rows = texel(y0.min(y1).min(y2))..texel(y0.max(y1).max(y2));
            (first, end) = (first.min(rows.start), end.max(rows.end));
            for row in rows {
                let y = row as f64 + 0.5;
                let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
                for k in 0..3 {
                    let (mut a, mut b) = (corners[k], corners[(k + 1) % 3]);
                    if a[1] > b[1] {
                        (a, b) = (b, a);
                    }
                    if a[1] <= y && y < b[1] {
                        let x = a[0] + (y - a[1]) * (b[0] - a[0]) / (b[1] - a[1]);
                        (left, right) = (left.min(x), right.max(x));
                    }
                }
                fill(&mut mask[row], texel(left)..texel(right));
            }
        }
        first.min(end)..end
    }
}

fn empty_mask() -> Mask {
    vec![[0; RASTER / 64]; RASTER]
}

/// Sets a range of one row's bits.
fn fill(row: &mut Row, columns: Range<usize>) {
    if columns.is_empty() {
        return;
    }
    let (first, last) = (columns.start / 64, (columns.end - 1) / 64);
    for (word, bits) in row.iter_mut().enumerate().take(last + 1).skip(first) {
        let from = columns.start.saturating_sub(64 * word);
        let to = (columns.end - 64 * word).min(64);
        *bits |= (u64::MAX >> (64 - (to - from))) << from;
    }
}

/// Whether two stacks of rows have at most `allowed` texels in common.
fn overlap_within(allowed: u32, a: &[Row], b: &[Row]) -> bool {
    let common = |(a, b): (&Row, &Row)| a.iter().zip(b).map(|(a, b)| (a & b).count_ones()).sum();
    let mut rows = a.iter().zip(b).map(common);
    let within = rows.try_fold(allowed, |left, texels: u32| left.checked_sub(texels));
    within.is_some()
}

/// Signed UV area, computed in double precision so that its sign can be trusted.
fn uv_area(uv: [[f32; 2]; 3]) -> f64 {
    let [a, b, c] = uv.map(|[u, v]| [f64::from(u), f64::from(v)]);
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]))
}

/// The map that brings an island's UVs into the unit square, moving them as little as possible.
fn placement(triangles: &[[u32; 3]], vertices: &[Vertex]) -> impl Fn([f32; 2]) -> [f32; 2] + use<> {
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for corner in triangles.iter().flatten() {
        for (bound, x) in bounds.iter_mut().zip(vertices[*corner as usize].uv) {
            *bound = [bound[0].min(x.into()), bound[1].max(x.into())];
        }
    }
    let [width, height] = bounds.map(|[low, high]| high - low);
    let extent = width.max(height);
    let fits = extent <= 1.0 + 2.0 * MARGIN;
    let scale = if fits { 1.0 } else { 1.0 / extent };
    let inside = |[low, high]: [f64; 2]| low >= -MARGIN && high <= 1.0 + MARGIN;
    let shift = bounds.map(|[low, high]| {
        let [low, high] = [low * scale, high * scale];
        let tiles = -(low + MARGIN).floor();
        if inside([low, high]) {
            0.0
        } else if fits && inside([low + tiles, high + tiles]) {
            tiles
        } else if low < 0.0 {
            -low
        } else {
            1.0 - high
        }
    });
    move |uv| [0, 1].map(|k| (f64::from(uv[k]) * scale + shift[k]).clamp(0.0, 1.0) as f32)
}

/// Cuts the triangles into islands, in the order of their first triangles.
fn islands(vertices: &[Vertex], triangles: &[[u32; 3]]) -> Vec<Island> {
    // A corner is one position and UV per winding: 0 none, 1 positive, 2 negative. Mirrored halves
    // that meet at a seam vertex have different corners there, and so come apart.
    let mut welds = HashMap::new();
    let weld = |v: &Vertex| {
        let next = welds.len();
        let bits = |x: f32| (x + 0.0).to_bits(); // -0 becomes 0
        let key = (v.position.map(bits), v.uv.map(bits));
        *welds.entry(key).or_insert(next)
    };
    let weld_of: Vec<usize> = vertices.iter().map(weld).collect();
    let winding = |t: &[u32; 3]| match uv_area(t.map(|i| vertices[i as usize].uv)) {
        area if area > 0.0 => 1,
        area if area < 0.0 => 2,
        _ => 0,
    };
    let corners = |t: &[u32; 3]| t.map(|i| 3 * weld_of[i as usize] + winding(t));
    let mut parent: Vec<usize> = (0..3 * welds.len()).collect();
    let mut used = vec![false; parent.len()];
    for triangle in triangles.iter().map(corners) {
        let root = find(&mut parent, triangle[0]);
        for corner in triangle {
            let other = find(&mut parent, corner);
            parent[other] = root;
            used[corner] = true;
        }
    }
    // Triangles without UV area join whichever neighbour comes first.
    for corner in triangles.iter().flat_map(corners) {
        let root = find(&mut parent, corner);
        let mut sides = [1, 2].map(|winding| corner - corner % 3 + winding).into_iter();
        let neighbour = sides.find(|&side| used[side]);
        if let Some(neighbour) = neighbour
            && root.is_multiple_of(3)
        {
            parent[root] = find(&mut parent, neighbour);
        }
    }
    let mut number = HashMap::new();
    let mut islands: Vec<Island> = Vec::new();
    for triangle in triangles {
        let root = find(&mut parent, corners(triangle)[0]);
        let id = *number.entry(root).or_insert(islands.len());
        if id == islands.len() {
            islands.push(Island::default());
        }
        islands[id].triangles.push(*triangle);
    }
    islands
}

/// The root of a disjoint set, halving the path to it.
fn find(parent: &mut [usize], mut x: usize) -> usize {
    while parent[x] != x {
        parent[x] = parent[parent[x]];
        x = parent[x];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    /// A grid of `n`×`n` squares at height `z` whose UVs are `uv(x, y)` for x and y 0 to 1.
    fn grid(n: u32, z: f32, uv: impl Fn(f32, f32) -> [f32; 2]) -> (Vec<Vertex>, Vec<u32>) {
        let vertex = |i: u32| {
            let (x, y) = ((i % (n + 1)) as f32 / n as f32, (i / (n + 1)) as f32 / n as f32);
            Vertex { position: [x, y, z], uv: uv(x, y), ..Vertex::zeroed() }
        };
        let square = |i: u32| {
            let a = i / n * (n + 1) + i % n;
            [a, a + 1, a + n + 2, a, a + n + 2, a + n + 1]
        };
        ((0..(n + 1) * (n + 1)).map(vertex).collect(), (0..n * n).flat_map(square).collect())
    }

    /// Every triangle as positions, sorted, to compare meshes whose vertices were renumbered.
    fn triangles(vertices: &[Vertex], indices: &[u32]) -> Vec<Vec<[u32; 3]>> {
        let corner = |i: &u32| vertices[*i as usize].position.map(f32::to_bits);
        let mut all: Vec<Vec<_>> = indices.chunks(3).map(|t| t.iter().map(corner).collect()).collect();
        all.sort();
        all
    }

    #[test]
    fn clean_uvs_stay_on_one_page() {
        let (mut vertices, mut indices) = grid(8, 0.0, |x, y| [x, y]);
        let pages = paginate(&mut vertices, &mut indices);
        assert_eq!(pages, vec![0..384; 1]);
        assert_eq!(vertices.len(), 81);
        assert!(vertices.iter().all(|v| v.atlas_uv == v.uv));
    }

    #[test]
    fn mirrored_halves_part_and_no_triangle_is_lost() {
        let (mut vertices, mut indices) = grid(8, 0.0, |x, y| [(2.0 * x - 1.0).abs(), y]);
        let before = triangles(&vertices, &indices);
        let pages = paginate(&mut vertices, &mut indices);
        assert_eq!(pages, [0..192, 192..384]);
        assert_eq!(vertices.len(), 81 + 9, "the seam is duplicated");
        assert_eq!(triangles(&vertices, &indices), before);
    }

    #[test]
    fn stacked_islands_part_and_touching_ones_do_not() {
        let (mut vertices, mut indices) = grid(4, 0.0, |x, y| [0.5 * x, y]);
        for (z, left) in [(1.0, 0.0), (2.0, 0.5)] {
            let (more, more_indices) = grid(4, z, |x, y| [left + 0.5 * x, y]);
            indices.extend(more_indices.iter().map(|i| i + vertices.len() as u32));
            vertices.extend(more);
        }
        let pages = paginate(&mut vertices, &mut indices);
        assert_eq!(pages, [0..192, 192..288]);
    }

    #[test]
    fn stray_uvs_come_inside() {
        let placed = |[low, high]: [f32; 2]| {
            let (mut vertices, mut indices) = grid(1, 0.0, |x, y| [low + (high - low) * x, y]);
            paginate(&mut vertices, &mut indices);
            [vertices[0].atlas_uv[0], vertices[1].atlas_uv[0]]
        };
        let cases = [
            ([-0.05, 0.4], [0.0, 0.45]), // the least shift
            ([0.75, 1.25], [0.5, 1.0]),
            ([-1.75, -1.25], [0.25, 0.75]), // whole tiles
            ([-1.0, 3.0], [0.0, 1.0]),      // scaled
        ];
        for (uv, expected) in cases {
            let got = placed(uv);
            let error = (got[0] - expected[0]).abs().max((got[1] - expected[1]).abs());
            assert!(error < 1e-6, "{uv:?} went to {got:?}, not to {expected:?}");
        }
    }

    #[test]
    fn triangles_without_uv_area_follow_a_neighbour() {
        let (mut vertices, mut indices) = grid(2, 0.0, |x, y| [x, y.min(0.5)]);
        assert_eq!(paginate(&mut vertices, &mut indices), vec![0..24; 1]);
        assert_eq!(vertices.len(), 9);
    }

    #[test]
    fn texel_size_is_length_over_texels() {
        let (mut vertices, mut indices) = grid(4, 0.0, |x, y| [0.5 * x, 0.5 * y]);
        let pages = paginate(&mut vertices, &mut indices);
        let primitive = Primitive {
            name: String::new(),
            node: String::new(),
            head: None,
            vertices,
            indices,
            material: 0,
            pages,
            procedural: false,
        };
        assert!((primitive.texel_size(0, 512) - 1.0 / 256.0).abs() < 1e-7);
        assert_eq!(primitive.texel_size(1, 512), 0.0);
    }
}
