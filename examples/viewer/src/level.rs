//! Up to which level of its pyramid a plan blurs each tile, in false colours: as shaders/tiles.wgsl
//! decides, by the row of the plan that the nearest skin of a tile asks for.

use subsurface::Plan;

use crate::width;

/// Side of a tile in pixels, as in shaders/tiles.wgsl.
const TILE: usize = 8;

/// The rows of a plan that lead to one level, in false colours.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    pub level: usize,
    /// Of the first row and of the last one, as the plan lists them.
    pub px_per_mm: [f32; 2],
    /// One a row.
    pub colors: Vec<[u8; 3]>,
}

/// The row that each pixel's tile goes by; none where nothing scatters. `px_per_mm` is of a surface
/// that faces the camera, 0 where nothing scatters.
pub fn rows(plan: &Plan, px_per_mm: &[f32], width: u32) -> Vec<Option<usize>> {
    let width = width as usize;
    let across = width.div_ceil(TILE);
    let tile_of = |i: usize| i / width / TILE * across + i % width / TILE;
    let mut most = vec![0.0f32; px_per_mm.len().div_ceil(width).div_ceil(TILE) * across];
    for (i, scale) in px_per_mm.iter().enumerate() {
        let tile = &mut most[tile_of(i)];
        *tile = tile.max(*scale);
    }
    let rows: Vec<_> = most.iter().map(|scale| plan.tile_row(*scale)).collect();
    let row_of = |(i, scale): (usize, &f32)| rows[tile_of(i)].filter(|_| *scale > 0.0);
    px_per_mm.iter().enumerate().map(row_of).collect()
}

/// The rows as a picture, and what its colours stand for, from the finest level on.
pub fn picture(plan: &Plan, rows: &[Option<usize>]) -> (Vec<[u8; 3]>, Vec<Key>) {
    let shown = || rows.iter().flatten().copied();
    let first = shown().min().unwrap_or(0);
    let last = shown().max().unwrap_or(0);
    let color = |row: usize| width::color((row - first) as f32 / (last - first).max(1) as f32);
    let pixels = rows.iter().map(|row| row.map_or(width::NOT_SKIN, color));
    let mut keys: Vec<Key> = Vec::new();
    let all = plan.rows(0).iter().enumerate();
    for (i, row) in all.filter(|(i, _)| shown().any(|shown| shown == *i)) {
        match keys.last_mut() {
            Some(key) if key.level == row.level => {
                key.px_per_mm[1] = row.px_per_mm;
                key.colors.push(color(i));
            }
            _ => keys.push(Key { level: row.level, px_per_mm: [row.px_per_mm; 2], colors: vec![color(i)] }),
        }
    }
    (pixels.collect(), keys)
}

#[cfg(test)]
mod tests {
    use super::*;
    use subsurface::Profile;

    #[test]
    fn tiles_go_by_their_nearest_skin() {
        let plan = Plan::new(&[Profile::SKIN], 0.02).unwrap();
        // Two tiles and a column of a third; skin far away, but for a pixel in the second.
        let (width, height) = (17, 8);
        let mut px_per_mm = vec![0.05; width * height];
        px_per_mm[3 * width + 10] = 9.0;
        px_per_mm[0] = 0.0;
        let rows = rows(&plan, &px_per_mm, width as u32);
        let [far, near] = [0.05, 9.0].map(|scale| plan.tile_row(scale));
        assert!(far < near);
        for (i, row) in rows.iter().enumerate() {
            let expected = match i {
                0 => None,
                _ if (8..16).contains(&(i % width)) => near,
                _ => far,
            };
            assert_eq!(*row, expected, "pixel {i}");
        }

        let (pixels, keys) = picture(&plan, &rows);
        let table = plan.rows(0);
        let expected = [(far, 0.0), (near, 1.0)].map(|(row, place)| Key {
            level: table[row.unwrap()].level,
            px_per_mm: [table[row.unwrap()].px_per_mm; 2],
            colors: vec![width::color(place)],
        });
        assert_eq!(keys, expected);
        assert!(keys[0].level < keys[1].level);
        let seen = [0, 1, 10].map(|i| pixels[i]);
        assert_eq!(seen, [width::NOT_SKIN, keys[0].colors[0], keys[1].colors[0]]);
    }

    #[test]
    fn nothing_is_shown_where_nothing_scatters() {
        let plan = Plan::exact(&[Profile::SKIN]).unwrap();
        let rows = rows(&plan, &[1.0, 0.0], 2);
        assert_eq!(rows, [None; 2]);
        let (pixels, keys) = picture(&plan, &rows);
        assert_eq!((pixels, keys), (vec![width::NOT_SKIN; 2], Vec::new()));
    }
}
