//! Where a model has its head, so that views find the face of a bust, of a whole body, or of an animal.

use glam::Vec3;

use super::names;
use super::scene::{Primitive, Scene, around};

/// A head is smaller than this part of a body, from corner to corner; else the model is a head or a bust.
const PART: f32 = 0.5;
/// Planes across a model, from its top down.
const PLANES: usize = 96;

/// A model's head, in world space and scene units.
pub(super) struct Head {
    /// Least and greatest corner of the skin that shows it: chin to crown with some of the neck; or all skin.
    pub min: Vec3,
    pub max: Vec3,
    /// Where it looks: +Z, as glTF has it, unless its eyes say otherwise; along an axis.
    pub forward: Vec3,
}

impl Head {
    /// By the joints of the head, the names of meshes, the features of the face, or the shape of the skin,
    /// whichever is there; all skin, of a head or a bust.
    pub fn of(scene: &Scene) -> Self {
        let whole = scene.skin_bounds();
        // Each with how much of its height below it is chin and neck.
        let found = by_joints(scene)
            .map(|head| (head, 0.25))
            .or_else(|| by_names(scene).map(|head| (head, 0.0)))
            .or_else(|| by_features(scene).map(|head| (head, 0.0)))
            .or_else(|| by_shape(scene).map(|head| (head, 0.45)));
        let found = found.filter(|(head, _)| is_part(*head, whole));
        let ((mut min, max), below) = found.unwrap_or((whole, 0.0));
        min.y -= below * (max.y - min.y);
        let forward = forward(scene, (min, max)).unwrap_or(Vec3::Z);
        Self { min, max, forward }
    }

    /// The point furthest to the person's right: the rim of an ear.
    pub fn ear(&self, scene: &Scene) -> Vec3 {
        let right = self.forward.cross(Vec3::Y);
        let here = |p: &Vec3| p.cmpge(self.min).all() && p.cmple(self.max).all();
        // Shoulders are further out, and lower.
        let above = 0.5 * (self.min.y + self.max.y);
        let skin = points(scene.skin()).filter(here).filter(|p| p.y >= above);
        let outermost = skin.max_by(|a, b| a.dot(right).total_cmp(&b.dot(right)));
        outermost.unwrap_or(0.5 * (self.min + self.max))
    }

    /// The foremost point above a height, near the middle: the tip of the nose.
    pub fn nose(&self, scene: &Scene, above_y: f32) -> Vec3 {
        let (size, middle) = (self.max - self.min, 0.5 * (self.min + self.max));
        let across = self.forward.cross(Vec3::Y).abs();
        let skin = points(scene.skin());
        let here = skin.filter(|p| {
            let off = (*p - middle).abs();
            p.y >= above_y && p.y <= self.max.y && off.dot(across) <= 0.2 * size.dot(across)
        });
        let here =
            here.filter(|p| ((*p - middle) * self.forward).abs().max_element() <= size.max_element());
        let foremost = here.max_by(|a, b| a.dot(self.forward).total_cmp(&b.dot(self.forward)));
        foremost.unwrap_or(middle)
    }
}

fn is_part((min, max): (Vec3, Vec3), whole: (Vec3, Vec3)) -> bool {
    let size = (max - min).length();
    size > 0.0 && size < PART * (whole.1 - whole.0).length()
}

fn points(primitives: Vec<&Primitive>) -> impl Iterator<Item = Vec3> {
    let vertices = primitives.into_iter().flat_map(|p| &p.vertices);
    vertices.map(|v| Vec3::from(v.position))
}

fn both(a: (Vec3, Vec3), b: (Vec3, Vec3)) -> (Vec3, Vec3) {
    (a.0.min(b.0), a.1.max(b.1))
}

/// What moves with joints called head.
fn by_joints(scene: &Scene) -> Option<(Vec3, Vec3)> {
    let skin = scene.skin().into_iter();
    skin.filter_map(|p| p.head).reduce(both)
}

/// The names that a primitive goes by.
fn named(scene: &Scene, primitive: &Primitive, is: fn(&str) -> bool) -> bool {
    let material = &scene.materials[primitive.material].name;
    [material, &primitive.name, &primitive.node].into_iter().any(|name| is(name))
}

/// Skin that is called a head or a face.
fn by_names(scene: &Scene) -> Option<(Vec3, Vec3)> {
    let mut skin = scene.skin();
    skin.retain(|p| named(scene, p, names::is_head));
    around(points(skin))
}

/// The skin around eyes, brows, lashes and teeth.
fn by_features(scene: &Scene) -> Option<(Vec3, Vec3)> {
    let features = scene.primitives.iter().filter(|p| named(scene, p, names::is_feature));
    let features = around(points(features.collect()).chain(scene.eyes.iter().copied()));
    let (min, max) = features?;
    // From ear to ear a head is about twice as wide as from eye to eye, and taller than wide.
    let reach = 1.8 * (max.x - min.x).max(max.z - min.z);
    let near = |p: &Vec3| (*p - 0.5 * (min + max)).abs().max_element() <= reach;
    around(points(scene.skin()).filter(near))
}

/// The axis from the middle of the head to its eyes.
fn forward(scene: &Scene, (min, max): (Vec3, Vec3)) -> Option<Vec3> {
    let inside = |p: &Vec3| p.cmpge(min).all() && p.cmple(max).all();
    let eyes = scene.primitives.iter().filter(|p| named(scene, p, names::is_eye));
    let eyes = points(eyes.collect()).chain(scene.eyes.iter().copied());
    let (least, greatest) = around(eyes.filter(inside))?;
    let to = 0.5 * (least + greatest) - 0.5 * (min + max);
    let axis = if to.x.abs() > to.z.abs() { Vec3::X } else { Vec3::Z };
    let along = to.dot(axis);
    (along.abs() > 0.1 * (max - min).dot(axis)).then_some(axis * along.signum())
}

/// A limb as far down as planes of constant height have cut it. Boxes are least and greatest corner.
#[derive(Clone, Copy)]
struct Limb {
    /// Around what the lowest plane cuts.
    now: (Vec3, Vec3),
    /// Around what all planes cut.
    all: (Vec3, Vec3),
    /// The same, down to a neck.
    head: (Vec3, Vec3),
    /// Area of the boxes around the widest section, and the narrowest below it.
    widest: f32,
    narrowest: f32,
}

impl Limb {
    fn new(section: (Vec3, Vec3)) -> Self {
        let area = area(section);
        Self { now: section, all: section, head: section, widest: area, narrowest: area }
    }

    /// One plane further down. What narrows and then widens beyond its widest has ended: that is a head on
    /// a neck above shoulders, or a hand on an arm.
    fn grow(&mut self, section: (Vec3, Vec3)) -> Option<Self> {
        let area = area(section);
        let has_neck = self.narrowest < 0.85 * self.widest;
        let ended = (has_neck && area > 1.3 * self.widest).then_some(*self);
        (self.now, self.all) = (section, both(self.all, section));
        if area > self.widest && (!has_neck || ended.is_some()) {
            (self.widest, self.narrowest) = (area, area);
        }
        if area <= self.narrowest {
            // Where it is much narrower, from the chin on, it is neck.
            if self.narrowest > 0.7 * self.widest {
                self.head = self.all;
            }
            self.narrowest = area;
        }
        ended
    }

    /// As deep and as wide, with its ears, as heads are for their height.
    fn is_head(&self) -> bool {
        let size = self.head.1 - self.head.0;
        [size.x, size.z].iter().all(|x| (0.4..=2.5).contains(&(x / size.y)))
    }
}

fn area((min, max): (Vec3, Vec3)) -> f32 {
    (max.x - min.x) * (max.z - min.z)
}

/// The largest limb that hangs from nothing above, has a neck, and is shaped as heads are.
fn by_shape(scene: &Scene) -> Option<(Vec3, Vec3)> {
    let (min, max) = scene.skin_bounds();
    let (mut limbs, mut heads): (Vec<Limb>, Vec<Limb>) = Default::default();
    for plane in sections(scene, min.y, max.y).iter().rev() {
        let mut next = Vec::new();
        for &section in plane {
            let meets = |l: &&Limb| l.now.0.x <= section.1.x && section.0.x <= l.now.1.x;
            let mut met: Vec<Limb> = limbs.iter().filter(meets).copied().collect();
            heads.extend(met.iter_mut().filter_map(|limb| limb.grow(section)));
            // Limbs that meet go on as the widest of them.
            let widest = met.into_iter().max_by(|a, b| a.widest.total_cmp(&b.widest));
            next.push(widest.unwrap_or(Limb::new(section)));
        }
        limbs = next;
    }
    // Not a whole trunk down to its waist.
    heads.retain(|limb| limb.is_head() && is_part(limb.head, (min, max)));
    let head = heads.iter().max_by(|a, b| a.widest.total_cmp(&b.widest))?;
    Some(head.head)
}

/// What each plane cuts, from the lowest up: boxes around what is connected along x.
fn sections(scene: &Scene, bottom: f32, top: f32) -> Vec<Vec<(Vec3, Vec3)>> {
    let step = (top - bottom) / PLANES as f32;
    let mut cuts = vec![Vec::new(); PLANES];
    for primitive in scene.skin() {
        for triangle in primitive.indices.as_chunks::<3>().0 {
            let corners = triangle.map(|i| Vec3::from(primitive.vertices[i as usize].position));
            let [low, high] = [f32::min, f32::max].map(|f| f(f(corners[0].y, corners[1].y), corners[2].y));
            let plane = |y: f32| ((y - bottom) / step - 0.5).ceil().clamp(0.0, PLANES as f32) as usize;
            for (i, cuts) in cuts.iter_mut().enumerate().take(plane(high)).skip(plane(low)) {
                let y = bottom + (i as f32 + 0.5) * step;
                let edges = [0, 1, 2].map(|k| (corners[k], corners[(k + 1) % 3]));
                let crossing = edges.iter().filter(|(a, b)| (a.y < y) != (b.y < y));
                cuts.extend(around(crossing.map(|(a, b)| a.lerp(*b, (y - a.y) / (b.y - a.y)))));
            }
        }
    }
    for cuts in &mut cuts {
        cuts.sort_by(|a, b| a.0.x.total_cmp(&b.0.x));
        cuts.dedup_by(|next, last| {
            let meets = next.0.x <= last.1.x;
            if meets {
                *last = both(*last, *next);
            }
            meets
        });
    }
    cuts
}
