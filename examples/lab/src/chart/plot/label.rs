//! Where labels go, so that they do not lie on one another.

use crate::svg::Point;

/// A part of the drawing.
#[derive(Clone, Copy, Debug)]
pub struct Area {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Area {
    /// So wide and high, around its centre.
    pub fn around([x, y]: Point, width: f64, height: f64) -> Self {
        Self {
            left: x - width / 2.0,
            top: y - height / 2.0,
            right: x + width / 2.0,
            bottom: y + height / 2.0,
        }
    }

    /// Between two corners.
    pub fn between(a: Point, b: Point) -> Self {
        Self { left: a[0].min(b[0]), top: a[1].min(b[1]), right: a[0].max(b[0]), bottom: a[1].max(b[1]) }
    }

    /// So much larger on every side.
    pub fn grown(self, by: f64) -> Self {
        Self { left: self.left - by, top: self.top - by, right: self.right + by, bottom: self.bottom + by }
    }

    /// The centre.
    pub fn centre(&self) -> Point {
        [(self.left + self.right) / 2.0, (self.top + self.bottom) / 2.0]
    }

    fn size(&self) -> f64 {
        (self.right - self.left) * (self.bottom - self.top)
    }

    /// How much of the two is the same.
    fn shared(&self, other: &Self) -> f64 {
        let width = self.right.min(other.right) - self.left.max(other.left);
        let height = self.bottom.min(other.bottom) - self.top.max(other.top);
        width.max(0.0) * height.max(0.0)
    }
}

/// Places for labels beside their points, each given with its width and height: where they cover
/// least of what is drawn and of one another, within `bounds`, and near.
pub fn beside(labels: &[(Point, f64, f64)], drawn: &[Area], bounds: Area) -> Vec<Area> {
    const ROUNDS: usize = 4;
    let mut places: Vec<Option<Area>> = vec![None; labels.len()];
    // Later labels crowd earlier ones out, so that all are placed again in the light of all.
    for _ in 0..ROUNDS {
        for (i, &(point, width, height)) in labels.iter().enumerate() {
            let cost = |place: &Area| {
                let drawn = drawn.iter().map(|area| place.shared(area));
                let others = places.iter().enumerate().filter(|(j, _)| *j != i);
                let labels = others.filter_map(|(_, other)| Some(place.shared(other.as_ref()?)));
                let outside = place.size() - place.shared(&bounds);
                let [x, y] = place.centre();
                let distance = (x - point[0]).hypot(y - point[1]);
                2.0 * drawn.sum::<f64>() + 2.0 * labels.sum::<f64>() + 8.0 * outside + distance
            };
            places[i] = candidates(point, width, height).min_by(|a, b| cost(a).total_cmp(&cost(b)));
        }
    }
    places.into_iter().flatten().collect()
}

/// Right, left, above, below and between, near and further off.
fn candidates([x, y]: Point, width: f64, height: f64) -> impl Iterator<Item = Area> {
    const SIDES: [Point; 8] = [
        [1.0, 0.0],
        [-1.0, 0.0],
        [0.0, -1.0],
        [0.0, 1.0],
        [1.0, -0.8],
        [1.0, 0.8],
        [-1.0, -0.8],
        [-1.0, 0.8],
    ];
    [6.5, 13.0, 21.0, 32.0].into_iter().flat_map(move |gap| {
        SIDES.into_iter().map(move |[right, down]| {
            let centre = [x + right * (gap + width / 2.0), y + down * (gap + height / 2.0)];
            Area::around(centre, width, height)
        })
    })
}

/// Moves places on a line at least `gap` apart and between `low` and `high`, as little as that
/// takes, in the order that they are in; too many for the line keep an even distance instead.
pub fn spread(wanted: &[f64], gap: f64, low: f64, high: f64) -> Vec<f64> {
    let count = wanted.len();
    let gap = gap.min((high - low) / count.max(2) as f64);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| wanted[a].total_cmp(&wanted[b]));

    // Without the gaps this is a regression that must not fall: neighbours that do are pooled.
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for (rank, &i) in order.iter().enumerate() {
        let mut pool = (wanted[i] - rank as f64 * gap, 1);
        while let Some(&(sum, n)) = pools.last()
            && sum / n as f64 > pool.0 / pool.1 as f64
        {
            pool = (pool.0 + sum, pool.1 + n);
            pools.pop();
        }
        pools.push(pool);
    }
    let last = high - count.saturating_sub(1) as f64 * gap;
    let places =
        pools.into_iter().flat_map(|(sum, n)| std::iter::repeat_n((sum / n as f64).clamp(low, last), n));
    let mut spread = vec![0.0; count];
    for (rank, (i, place)) in order.into_iter().zip(places).enumerate() {
        spread[i] = place + rank as f64 * gap;
    }
    spread
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_labels_keep_their_distance_and_order() {
        let wanted = [50.0, 10.0, 51.0, 52.0, 90.0];
        let places = spread(&wanted, 10.0, 0.0, 100.0);
        assert_eq!(places, [41.0, 10.0, 51.0, 61.0, 90.0]);
        // At an end they move inwards.
        assert_eq!(spread(&[99.0, 98.0], 10.0, 0.0, 100.0), [100.0, 90.0]);
        let crowd = spread(&[5.0; 30], 10.0, 0.0, 100.0);
        assert!(crowd.iter().all(|place| (0.0..=100.0).contains(place)));
        assert!(spread(&[], 10.0, 0.0, 100.0).is_empty());
    }

    #[test]
    fn labels_of_one_place_do_not_lie_on_one_another() {
        let bounds = Area::around([50.0, 50.0], 100.0, 100.0);
        let point = [95.0, 50.0];
        let places = beside(&[(point, 20.0, 10.0); 5], &[Area::around(point, 10.0, 10.0)], bounds);
        for (i, place) in places.iter().enumerate() {
            assert!(place.right <= 100.0, "{place:?}");
            for other in &places[..i] {
                assert_eq!(place.shared(other), 0.0, "{place:?} {other:?}");
            }
        }
    }
}
