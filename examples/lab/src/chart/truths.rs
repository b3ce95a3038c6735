//! The truths of a scene, computed once: they are kept in a directory, under a name that stands for
//! all that they follow from.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

use crate::Error;
use glam::Vec3;
use indicatif::ProgressBar;
use subsurface::Profile;

use crate::chart::scene::{Scene, Surface, vertices_mm};
use crate::output;
use crate::renderer::{Camera, Gpu, Probe, Renderer, Scene as Model};
use crate::truth::{Patch, Place, SurfaceIntegral, Triangles, surface_integral, visible_integral};

/// Of each pixel that is asked for, on a regular grid; zero where nothing scatters.
#[derive(Debug, PartialEq)]
pub struct Truths {
    pub visible: Vec<Vec3>,
    pub printed: Vec<Vec3>,
    pub normalised: Vec<Vec3>,
}

/// What the truths are made by; as they change, so does the name.
const SOURCES: [&str; 13] = [
    include_str!("../truth/cloud.rs"),
    include_str!("../truth/closed_form.rs"),
    include_str!("../truth/surface.rs"),
    include_str!("../truth/tree.rs"),
    include_str!("../truth/visible.rs"),
    include_str!("../renderer/camera.rs"),
    include_str!("../renderer/lighting.rs"),
    include_str!("../renderer/probe.rs"),
    include_str!("../renderer/lighting.wgsl"),
    include_str!("../renderer/material.wgsl"),
    include_str!("../renderer/probe.wgsl"),
    include_str!("../renderer/shadow.wgsl"),
    include_str!("truths.rs"),
];

impl Truths {
    /// From `cache`, or computed and put there.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn of(
        gpu: &Gpu,
        model: &Model,
        scene: &Scene,
        profile: &Profile,
        cache: &Path,
        bar: &ProgressBar,
    ) -> Result<Self, Error> {
        let name = format!("{}-{:016x}.truth", scene.name, key(model, scene, profile));
        if let Some(kept) = std::fs::read(cache.join(&name)).ok().and_then(|b| Self::read(&b, scene)) {
            return Ok(kept);
        }
        let truths = Self::compute(gpu, model, scene, profile, bar)?;
        let bytes = [&truths.visible, &truths.printed, &truths.normalised]
            .map(|t| bytemuck::cast_slice::<Vec3, u8>(t))
            .concat();
        output::write(cache, &[(name, bytes)])
            .map_err(|e| Error::new("--cache", format!("\"{e}\""), "a directory to write to"))?;
        Ok(truths)
    }

    fn read(bytes: &[u8], scene: &Scene) -> Option<Self> {
        let [width, height] = scene.asked_size().map(|s| s as usize);
        if bytes.len() != 3 * width * height * size_of::<Vec3>() {
            return None;
        }
        let values: Vec<Vec3> = bytemuck::pod_collect_to_vec(bytes);
        let mut thirds = values.chunks(width * height).map(<[Vec3]>::to_vec);
        Some(Self { visible: thirds.next()?, printed: thirds.next()?, normalised: thirds.next()? })
    }

    fn compute(
        gpu: &Gpu,
        model: &Model,
        scene: &Scene,
        profile: &Profile,
        bar: &ProgressBar,
    ) -> Result<Self, Error> {
        // Where each pixel of the grid is among the pixels of skin.
        let mut count = 0;
        let places: Vec<Option<usize>> = scene
            .skin
            .iter()
            .map(|skin| {
                count += usize::from(*skin);
                skin.then(|| count - 1)
            })
            .collect();
        let places = scene.asked(&places);
        let asked: Vec<usize> = places.iter().flatten().copied().collect();
        let whole = |values: Vec<Vec3>| {
            let mut values = values.into_iter();
            let of = |place: &Option<usize>| place.and_then(|_| values.next()).unwrap_or_default();
            places.iter().map(of).collect::<Vec<_>>()
        };

        // A bar counts whole steps.
        const STEPS: u64 = 1_000_000_000;
        let begin = |what: &str| {
            bar.set_length(STEPS);
            bar.set_position(0);
            bar.set_message(format!("{}: {what}", scene.name));
        };
        let progress = |share: f64| bar.inc((share * STEPS as f64) as u64);
        begin("the visible integral");
        let visible = whole(visible_integral(&scene.pixels, &asked, profile, &progress));
        begin("the surface integral");
        let (printed, normalised) = match &scene.surface {
            Surface::Known(known) => {
                let known: Vec<Vec3> = asked.iter().map(|i| known[*i]).collect();
                (known.clone(), known)
            }
            Surface::Head(head) => {
                let patches: Vec<Patch> = asked.iter().map(|i| scene.pixels[*i].patch).collect();
                let by = (&head.renderer, &head.camera);
                let truth = eq7(gpu, model, by, scene.mm_per_unit, &patches, profile, 1.0, &progress);
                (truth.printed, truth.normalised)
            }
        };
        Ok(Self { visible, printed: whole(printed), normalised: whole(normalised) })
    }
}

/// Eq. 7 over all of a model's skin, by the lights that a renderer last drew it with, for a camera.
#[allow(clippy::too_many_arguments, reason = "each is a thing of its own")]
pub fn eq7(
    gpu: &Gpu,
    model: &Model,
    (renderer, camera): (&Renderer, &Camera),
    mm_per_unit: f32,
    asked: &[Patch],
    profile: &Profile,
    density: f32,
    progress: &(dyn Fn(f64) + Sync),
) -> SurfaceIntegral {
    let probe = Probe::new(gpu, renderer);
    let skin = model.primitives.iter().enumerate();
    let skin: Vec<_> = skin.filter(|(_, p)| model.materials[p.material].profile_id == 1).collect();
    // All primitives as one mesh, and the first triangle of each.
    let (mut points, mut indices, mut firsts) = (Vec::new(), Vec::new(), Vec::new());
    for (_, primitive) in &skin {
        firsts.push(indices.len() / 3);
        let first = points.len() as u32;
        points.extend(vertices_mm(primitive, mm_per_unit));
        indices.extend(primitive.indices.iter().map(|i| first + i));
    }
    let light = |places: &[Place]| -> Result<Vec<Vec3>, std::convert::Infallible> {
        let owner = |p: &Place| firsts.partition_point(|first| *first <= p.triangle) - 1;
        let runs = places.chunk_by(|a, b| owner(a) == owner(b)).flat_map(|run| {
            let owner = owner(&run[0]);
            let places: Vec<_> = run.iter().map(|p| (p.triangle - firsts[owner], p.barycentric)).collect();
            probe.irradiance(gpu, renderer, camera, skin[owner], mm_per_unit, &places)
        });
        Ok(runs.collect())
    };
    let mesh = Triangles { vertices_mm: &points, indices: &indices };
    let Ok(integral) = surface_integral(mesh, asked, profile, density, light, progress);
    integral
}

/// All that a model is.
pub fn hash_model(model: &Model, hasher: &mut DefaultHasher) {
    for p in &model.primitives {
        bytemuck::cast_slice::<_, u8>(&p.vertices).hash(hasher);
        (&p.indices, p.material, p.procedural).hash(hasher);
    }
    for image in &model.images {
        (image.width, image.height, &image.rgba8).hash(hasher);
    }
    format!("{:?}", model.materials).hash(hasher);
}

/// A number for all that the truths follow from. `DefaultHasher` may change with the compiler; then
/// they are computed once more.
fn key(model: &Model, scene: &Scene, profile: &Profile) -> u64 {
    let mut hasher = DefaultHasher::new();
    SOURCES.hash(&mut hasher);
    hash_model(model, &mut hasher);
    format!("{profile:?} {}", scene.mm_per_unit).hash(&mut hasher);
    for p in &scene.pixels {
        let Patch { point_mm, area_mm2, irradiance } = p.patch;
        area_mm2.to_bits().hash(&mut hasher);
        let [x, y] = p.steps_mm;
        for v in [point_mm, irradiance, x, y] {
            v.to_array().map(f32::to_bits).hash(&mut hasher);
        }
    }
    match &scene.surface {
        Surface::Known(known) => bytemuck::cast_slice::<Vec3, u8>(known).hash(&mut hasher),
        Surface::Head(head) => format!("{:?}", head.camera).hash(&mut hasher),
    }
    (&scene.skin, scene.stride).hash(&mut hasher);
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_samples_change_nothing() {
        let gpu = Gpu::headless().unwrap();
        let model = Model::from_glb(crate::HEAD).unwrap();
        for view in ["front", "close-up"] {
            let scene = Scene::new(&gpu, &model, 1000.0, view, [[64; 2]; 2], 1).unwrap();
            let Surface::Head(head) = &scene.surface else {
                panic!("a view of the head has a head");
            };
            let asked: Vec<Patch> = scene.pixels.iter().map(|p| p.patch).collect();
            let of = |density| {
                let none = |_| ();
                let by = (&head.renderer, &head.camera);
                eq7(&gpu, &model, by, 1000.0, &asked, &Profile::SKIN, density, &none)
            };
            let (whole, half) = (of(1.0), of(0.5));
            let worst = |a: &[Vec3], b: &[Vec3]| {
                let pairs = a.iter().zip(b);
                let worst = pairs.map(|(a, b)| (a - b).abs().max_element());
                worst.fold(0.0, f32::max)
            };
            let printed = worst(&whole.printed, &half.printed);
            let normalised = worst(&whole.normalised, &half.normalised);
            println!(
                "{view}: {} and {} samples, at most {printed:.5} as printed, {normalised:.5} normalised",
                whole.samples, half.samples,
            );
            assert!(printed <= 0.001 && normalised <= 0.001, "{view}: {printed}, {normalised}");
        }
    }

    #[test]
    fn truths_are_kept_and_found_again() {
        let gpu = Gpu::headless().unwrap();
        let model = Model::from_glb(crate::HEAD).unwrap();
        let cache = std::env::temp_dir().join(format!("truths-{}", std::process::id()));
        let scene = |name| Scene::new(&gpu, &model, 1000.0, name, [[32; 2]; 2], 1).unwrap();
        let bar = ProgressBar::hidden();
        let truths = |scene: &Scene| Truths::of(&gpu, &model, scene, &Profile::SKIN, &cache, &bar).unwrap();
        let count = || std::fs::read_dir(&cache).unwrap().count();
        let first = truths(&scene("sphere"));
        assert_eq!(count(), 1);
        assert_eq!(truths(&scene("sphere")), first);
        assert_eq!(count(), 1);
        // Another scene has another name; a file cut short is not believed.
        assert_ne!(truths(&scene("edge_8")), first);
        assert_eq!(count(), 2);
        for entry in std::fs::read_dir(&cache).unwrap() {
            std::fs::write(entry.unwrap().path(), "cut").unwrap();
        }
        assert_eq!(truths(&scene("sphere")), first);
        std::fs::remove_dir_all(&cache).unwrap();
    }
}
