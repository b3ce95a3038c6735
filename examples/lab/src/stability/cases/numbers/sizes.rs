//! Frames of one pixel, of one row, of odd and of very many.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use subsurface::Profile;
use subsurface::wgpu::{self, ErrorFilter, TextureView};

use super::EVEN;
use crate::renderer::Gpu;
use crate::stability::case::{Case, Group, Known, Outcome};
use crate::stability::cases::surface::{Surface, methods};
use crate::stability::cases::{FOUND, SEEN, worst};
use crate::stability::frame::Texels;
use crate::stability::lab::OUTPUT;
use crate::synthetic::{GBuffer, Hit, View};

const PX_PER_MM: f64 = 6.0;

pub fn cases(quick: bool) -> Vec<Case> {
    let mut cases = vec![
        one_pixel(),
        strip([1, 4096]),
        strip([4096, 1]),
        odd([127, 61]),
        odd([128, 64]),
        too_large(),
    ];
    if !quick {
        cases.push(large());
    }
    cases
}

/// Flat skin, lit by waves 4 mm long at 27 degrees to the rows, from the first pixel on.
fn waves(size: [u32; 2]) -> GBuffer {
    let view = View::orthographic(size, PX_PER_MM);
    let corner = DVec2::new(-f64::from(size[0]), f64::from(size[1])) / PX_PER_MM / 2.0;
    let across = DVec2::from_angle(-27f64.to_radians());
    view.shoot(|origin, _| {
        let along_mm = (origin.truncate() - corner).dot(across);
        Some(Hit {
            point: DVec3::new(origin.x, origin.y, -300.0),
            normal: DVec3::Z,
            irradiance: DVec3::splat(0.5 + 0.5 * (TAU * along_mm / 4.0).sin()),
            id: 1,
        })
    })
}

fn one_pixel() -> Case {
    Case {
        group: Group::Numbers,
        name: "1x1".into(),
        what: "A frame of one pixel of skin: the difference to its own light, which is all that there is.".into(),
        passes: EVEN,
        degrades: FOUND,
        why: ".2 % is what even light may be off by.".into(),
        known: vec![],
        run: Box::new(|lab| {
            let g = waves([1, 1]);
            let mut surface = Surface::of(&g, DVec3::ZERO);
            surface.light(0, 0.75);
            let results = surface.upload(&lab.gpu).scatter(lab)?;
            Ok(Outcome {
                figures: worst(&results, &[(0, DVec3::splat(0.75))]),
                shown: None,
            })
        }),
    }
}

fn strip(size: [u32; 2]) -> Case {
    Case {
        group: Group::Numbers,
        name: format!("{}x{}", size[0], size[1]),
        what: "A frame a pixel wide, of flat skin under waves of light 4 mm long, 6 px/mm: the largest difference to \
               the visible integral, at both ends and in the middle."
            .into(),
        passes: FOUND,
        degrades: SEEN,
        why: ".01 is what an eye may find.".into(),
        known: vec![Known {
            method: "screen_planned",
            at_most: 0.025,
            by_nature: false,
            why: "A plan's taps have the right width only together, and a frame a pixel wide leaves those of the middle, \
                  which spread too little. Take `ScreenSpace`."
                .into(),
        }],
        run: Box::new(move |lab| {
            let g = waves(size);
            let results = Surface::of(&g, DVec3::ZERO).upload(&lab.gpu).scatter(lab)?;
            let asked: Vec<usize> = (0..16).chain(2000..2064).chain(4080..4096).collect();
            let truth = g.visible_integral(&asked, &Profile::SKIN);
            let truth: Vec<_> = asked.into_iter().zip(truth).collect();
            Ok(Outcome {
                figures: worst(&results, &truth),
                shown: None,
            })
        }),
    }
}

/// Sides that halve to odd numbers at every level of a pyramid.
fn odd(size: [u32; 2]) -> Case {
    Case {
        group: Group::Numbers,
        name: format!("{}x{}", size[0], size[1]),
        what: "Flat skin under waves of light 4 mm long, 6 px/mm: the largest difference to the visible integral, along \
               the frame's last rows and columns, and at every fifth pixel of every fifth row."
            .into(),
        passes: FOUND,
        degrades: SEEN,
        why: ".01 is what an eye may find.".into(),
        known: vec![Known {
            method: "screen_planned",
            at_most: 0.022,
            by_nature: false,
            why: "Along the frame's border taps are missing, and coarse levels are extrapolated from the last two pixels; \
                  odd and even sides are off alike. Take `ScreenSpace`, or draw a wider frame."
                .into(),
        }],
        run: Box::new(move |lab| {
            let g = waves(size);
            let results = Surface::of(&g, DVec3::ZERO).upload(&lab.gpu).scatter(lab)?;
            let [width, height] = size;
            let is_asked = |i: &usize| {
                let [x, y] = [*i as u32 % width, *i as u32 / width];
                x + 2 >= width || y + 2 >= height || x % 5 == 0 && y % 5 == 0
            };
            let asked: Vec<usize> = (0..g.hits.len()).filter(is_asked).collect();
            let truth = g.visible_integral(&asked, &Profile::SKIN);
            let truth: Vec<_> = asked.into_iter().zip(truth).collect();
            Ok(Outcome {
                figures: worst(&results, &truth),
                shown: None,
            })
        }),
    }
}

/// As many pixels as a full screen of the densest displays, and more.
fn large() -> Case {
    Case {
        group: Group::Numbers,
        name: "4096x4096".into(),
        what: "Skin in the last 192x192 pixels of such a frame alone, under waves of light 4 mm long, 6 px/mm: the \
               largest difference to the same in a frame of 192x192, beyond the reach of its first row and column, which \
               are borders of that frame alone. In the full form alone."
            .into(),
        passes: EVEN,
        degrades: FOUND,
        why: "Both frames know the same, and single floats hold the place of a pixel in a frame of 680 mm to .00006 mm."
            .into(),
        known: vec![],
        run: Box::new(|lab| {
            const SIDE: u32 = 4096;
            const PART: u32 = 192;
            let part = waves([PART; 2]);
            let small = Surface::of(&part, DVec3::ZERO).upload(&lab.gpu).scatter(lab)?;
            let view = View::orthographic([SIDE; 2], PX_PER_MM);
            let place = |i: usize| {
                let [x, y] = [i as u32 % PART, i as u32 / PART];
                [x, y].map(|c| c + SIDE - PART)
            };
            let reach = (f64::from(Profile::SKIN.reach_mm()) * PX_PER_MM).ceil() as u32;
            let is_far = |i: usize| {
                let i = i as u32;
                i % PART > reach && i / PART > reach
            };
            let count = (SIDE * SIDE) as usize;
            let mut texels = Texels {
                size: [SIDE; 2],
                irradiance: vec![[0.0, 0.0, 0.0, 1.0]; count],
                depth: vec![0.0; count],
                profile_id: vec![0; count],
                projection: view.projection.as_mat4(),
            };
            let mut positions_mm = vec![[0.0; 4]; count];
            for (i, hit) in part.pixels(|_| true) {
                let [x, y] = place(i);
                let to = (y * SIDE + x) as usize;
                let (origin, _) = view.ray(DVec2::new(x.into(), y.into()) + 0.5);
                let point = DVec3::new(origin.x, origin.y, hit.point.z);
                texels.irradiance[to] = hit.irradiance.as_vec3().extend(1.0).to_array();
                texels.depth[to] = (view.projection * point.extend(1.0)).z as f32;
                texels.profile_id[to] = 1;
                positions_mm[to] = point.as_vec3().extend(1.0).to_array();
            }
            let surface = Surface {
                texels,
                positions_mm,
                profile: Profile::SKIN,
                mm_per_unit: 1.0,
            };
            let uploaded = surface.upload(&lab.gpu);
            drop(surface);
            let mut figures = Vec::new();
            // One at a time, since the scratch textures of all of them are 5 GiB.
            for (name, mut method) in methods(&lab.gpu, &Profile::SKIN, &lab.plan)? {
                uploaded.by(&lab.gpu, &mut method)?;
                let cut = lab.read(&cut(&lab.gpu, uploaded.output(), PART));
                let own = small.iter().find(|(m, _)| *m == name);
                let truth = own.map(|(_, r)| r.iter().map(|e| e.as_dvec3()).enumerate());
                let truth = truth.into_iter().flatten();
                let truth: Vec<_> = truth.filter(|(i, _)| is_far(*i)).collect();
                figures.extend(worst(&vec![(name, cut)], &truth));
            }
            Ok(Outcome {
                figures,
                shown: None,
            })
        }),
    }
}

/// Textures that cannot be made, handed to an effect all the same.
fn too_large() -> Case {
    Case {
        group: Group::Numbers,
        name: "a size beyond the device's limit".into(),
        what: "A host makes textures wider than the device allows, which wgpu reports to it and `Gpu::check_size` beforehand. \
               Each method gets them as a frame all the same, then one of 64x64 that it has had before: how many pixels \
               of that have changed; infinitely many where nothing told the host. A panic ends the run."
            .into(),
        passes: 0.0,
        degrades: 1.0,
        why: "wgpu has told the host of its mistake; the next frame is like any other.".into(),
        known: vec![],
        run: Box::new(|lab| {
            let gpu = &lab.gpu;
            let limit = gpu.device.limits().max_texture_dimension_2d;
            let size = [limit + 1, 1];
            let refused = gpu.check_size(size).err();
            let named = refused.is_some_and(|e| {
                let said = e.to_string();
                said.starts_with("size: ") && said.contains(&limit.to_string())
            });
            let good = Surface::of(&waves([64; 2]), DVec3::ZERO).upload(gpu);
            let mut figures = Vec::new();
            for (name, mut method) in methods(gpu, &Profile::SKIN, &lab.plan)? {
                let before = good.by(gpu, &mut method)?;
                let scope = gpu.device.push_error_scope(ErrorFilter::Validation);
                let bad = Surface::of(&waves(size), DVec3::ZERO).upload(gpu);
                // Whether it refuses them or not, as long as it goes on.
                if method.prepare(gpu, &bad).is_ok() {
                    let _ = gpu.run(|encoder| method.render(encoder, bad.output()));
                }
                let told = pollster::block_on(scope.pop()).is_some();
                let after = good.by(gpu, &mut method)?;
                let changed = before.iter().zip(&after).filter(|(a, b)| a != b).count();
                let clear = named && told;
                figures.push((name, if clear { changed as f64 } else { f64::INFINITY }));
            }
            Ok(Outcome {
                figures,
                shown: None,
            })
        }),
    }
}

/// The last pixels of a texture, in one of their own.
fn cut(gpu: &Gpu, from: &TextureView, side: u32) -> TextureView {
    let to = gpu.target("cut", [side; 2], OUTPUT);
    let mut source = from.texture().as_image_copy();
    source.origin = wgpu::Origin3d {
        x: from.texture().width() - side,
        y: from.texture().height() - side,
        z: 0,
    };
    gpu.run(|encoder| {
        encoder.copy_texture_to_texture(source, to.texture().as_image_copy(), to.texture().size());
    });
    to
}
