//! Points ordered in space: a tree of boxes, so that a ball's points are found without looking at
//! the others.

use std::ops::Range;

use glam::Vec3;

/// Points in a leaf: few enough to cut a ball closely, enough to sum in whole SIMD registers.
const LEAF: usize = 64;

/// A binary tree of bounding boxes over points. Nodes lie in the order of a depth-first walk.
pub(super) struct Tree {
    /// Index of the point at each place; leaves own ranges of places.
    pub order: Vec<u32>,
    nodes: Vec<Node>,
}

struct Node {
    min: Vec3,
    max: Vec3,
    places: Range<u32>,
    /// The node after this one's last descendant: where a walk goes that skips it.
    next: u32,
}

impl Tree {
    pub fn new(points: &[Vec3]) -> Self {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let nodes = if points.is_empty() { Vec::new() } else { build(points, &mut order, 0) };
        Self { order, nodes }
    }

    /// Calls `visit` with the places of each leaf that comes within `radius` of `center`, until it
    /// returns true; tells whether it did.
    pub fn any_leaf(&self, center: Vec3, radius: f32, mut visit: impl FnMut(Range<usize>) -> bool) -> bool {
        let mut i = 0;
        while let Some(node) = self.nodes.get(i) {
            let nearest = center.clamp(node.min, node.max);
            if nearest.distance_squared(center) > radius * radius {
                i = node.next as usize;
                continue;
            }
            let places = node.places.start as usize..node.places.end as usize;
            if places.len() <= LEAF && visit(places) {
                return true;
            }
            i += 1;
        }
        false
    }
}

/// The nodes of `order`, whose first place is `first`; puts `order` into the tree's order.
fn build(points: &[Vec3], order: &mut [u32], first: u32) -> Vec<Node> {
    let mut min = Vec3::INFINITY;
    let mut max = Vec3::NEG_INFINITY;
    for &i in order.iter() {
        min = min.min(points[i as usize]);
        max = max.max(points[i as usize]);
    }
    let node = Node { min, max, places: first..first + order.len() as u32, next: 1 };
    if order.len() <= LEAF {
        return vec![node];
    }
    let axis = (max - min).max_position();
    // Halves of whole leaves, so that few leaves are part full.
    let middle = (order.len() / 2).next_multiple_of(LEAF).min(order.len() - 1);
    order.select_nth_unstable_by(middle, |&a, &b| {
        points[a as usize][axis].total_cmp(&points[b as usize][axis])
    });
    let (left, right) = order.split_at_mut(middle);
    let (left, right) =
        rayon::join(|| build(points, left, first), || build(points, right, first + middle as u32));
    let mut nodes = Vec::with_capacity(1 + left.len() + right.len());
    nodes.push(node);
    for child in [left, right] {
        let at = nodes.len() as u32;
        nodes.extend(child.into_iter().map(|mut n| {
            n.next += at;
            n
        }));
    }
    nodes[0].next = nodes.len() as u32;
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_what_a_search_finds() {
        // A lattice with a twist, so that no axis is special.
        let points: Vec<Vec3> = (0..3000)
            .map(|i| {
                let i = i as f32;
                Vec3::new((0.7 * i).sin(), (1.3 * i).cos(), (0.1 * i).sin())
            })
            .collect();
        let tree = Tree::new(&points);
        for (center, radius) in
            [(Vec3::ZERO, 0.3), (Vec3::ONE, 0.5), (Vec3::splat(9.0), 1.0), (Vec3::ZERO, 9.0)]
        {
            let inside = |i: &usize| points[*i].distance(center) <= radius;
            let mut found = Vec::new();
            tree.any_leaf(center, radius, |places| {
                found.extend(tree.order[places].iter().map(|i| *i as usize));
                false
            });
            let visited = found.len();
            found.retain(inside);
            found.sort_unstable();
            let expected: Vec<usize> = (0..points.len()).filter(inside).collect();
            assert_eq!(found, expected);
            assert!(visited < points.len() || expected.len() > points.len() / 2);
        }
    }

    #[test]
    fn stops_when_told_and_is_content_with_nothing() {
        let tree = Tree::new(&vec![Vec3::ONE; 1000]);
        let mut visits = 0;
        assert!(tree.any_leaf(Vec3::ONE, 1.0, |_| {
            visits += 1;
            true
        }));
        assert_eq!(visits, 1);
        assert!(!Tree::new(&[]).any_leaf(Vec3::ONE, 1.0, |_| true));
    }
}
