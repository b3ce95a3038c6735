//! Numbers that a host should not hand over, or seldom does: light, depth, sizes, widths and units.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3, Vec3};
use half::f16;
use subsurface::wgpu::{self, ErrorFilter};
use subsurface::{Gaussian, Plan, Profile};

use super::{EVEN, GRADIENT, noise};
use crate::Error;
use crate::stability::case::{
    ATLAS, Bound, Case, EXACT, Figures, Outcome, PLAN, Results, by_nature, known,
};
use crate::stability::inputs::Texels;
use crate::stability::lab::{Lab, OUTPUT, methods, ours};
use crate::stability::trial::{Crop, Known, apart, worst};
use crate::synthetic::{GBuffer, View, plane, sphere};

pub fn cases(quick: bool) -> Vec<Case> {
    let side = if quick { 96 } else { 192 };
    let mut cases: Vec<Case> = [0.0, 1e-6, 1e4, 65504.0].map(|e| constant(e, side)).into();
    cases.push(saturated(side));
    cases.extend(lost_light(side));
    cases.push(negative(side));
    cases.extend(depths(side));
    cases.extend(stored_depths(side));
    cases.extend([[1, 1], [1, 4096], [4096, 1], [127, 61], [128, 64]].map(small));
    cases.push(too_large());
    if !quick {
        cases.push(large());
    }
    cases.extend([("no width", 0.0), ("a nanometre", 1e-6), ("a metre", 1e3)].map(|w| width(w, side)));
    cases.extend([("micrometres", 1e-3), ("metres", 1e3)].map(|u| unit(u, side)));
    cases
}

/// The same truth at these pixels.
fn all_are(pixels: Vec<usize>, light: f64) -> Known {
    pixels.into_iter().map(|i| (i, DVec3::splat(light))).collect()
}

/// A ball of 12 mm in perspective at 3 px/mm.
fn ball(side: u32, light: impl Fn(DVec3) -> f64) -> GBuffer {
    let view = View::perspective([side; 2], 0.0625 * f64::from(side));
    view.shoot(sphere(12.0, 300.0, |n| DVec3::splat(light(n))))
}

/// Light that is the same everywhere.
fn constant(light: f32, side: u32) -> Case {
    let bound = match light {
        0.0 => Bound {
            passes: 0.0,
            degrades: f16::MIN_POSITIVE_SUBNORMAL.into(),
            why: "nothing comes of nothing; 6e-8 is the smallest half float.",
        },
        1e-6 => Bound {
            passes: 0.06,
            degrades: 0.5,
            why: "so close to 0 a step of half floats is 6 %; half of the light is 8 steps, one \
                  or more a pass.",
        },
        _ => EVEN,
    };
    let what = "A ball of 12 mm before a background of the same light, 3 px/mm: largest \
        difference to that light, as a share of it unless it is 0.";
    Case::new(format!("light of {light} throughout"), what, bound, move |lab| {
        let e = f64::from(f16::from_f32(light));
        let texels = Texels::of(&ball(side, |_| e), e);
        let results = lab.scatter_both(&texels.upload(&lab.gpu))?;
        let figures = worst(&results, &all_are(texels.skin(), e)).into_iter();
        let whole = if light == 0.0 { 1.0 } else { e };
        Ok(figures.map(|(m, f)| (m, f / whole)).collect::<Figures>().into())
    })
}

/// A flat face of skin, `side` pixels at 6 px/mm; no skin on the last sixth of each row.
fn face(side: u32, light: impl Fn(DVec3) -> f64) -> Texels {
    let view = View::orthographic([side; 2], 6.0);
    let g = view.shoot(plane(DVec3::Z, 300.0, |p| DVec3::splat(light(p))));
    let mut texels = Texels::of(&g, 0.0);
    for i in (0..side * side).filter(|i| i % side >= side / 6 * 5) {
        texels.clear(i as usize);
    }
    texels
}

/// The most that half floats hold, beside nothing.
fn saturated(side: u32) -> Case {
    let what = "A hard edge at 27 degrees between the largest half float and no light: largest \
        difference to the same method's result of light of 1, times 65504, as a share of 65504, \
        since scattering is linear.";
    let why = "Along the frame's border coarse levels are extrapolated from the last two pixels, \
        and cut off where that is more than half floats hold. The exact sum does not \
        extrapolate.";
    Case::new("65504 beside black", what, EVEN, move |lab| {
        let across = DVec2::from_angle(27f64.to_radians()).extend(0.0);
        let edge = |light: f64| face(side, |p| if p.dot(across) < 0.0 { light } else { 0.0 });
        let scatter = |light| lab.scatter_both(&edge(light).upload(&lab.gpu));
        let (dim, mut bright) = (scatter(1.0)?, scatter(65504.0)?);
        bright.iter_mut().flat_map(|(_, r)| r).for_each(|e| *e /= 65504.0);
        Ok(apart(&bright, &dim, &edge(1.0).skin()).into())
    })
    .known([known(PLAN, 0.0035, why)])
}

/// A face under light of 1 with four pixels of another: within a tile of 8×8, at the corner of one, at the
/// corner of the frame, and beside the background.
fn dotted(light: f32, side: u32) -> Texels {
    let mut face = face(side, |_| 1.0);
    for [x, y] in [[44, 44], [24, 63], [0, 0], [side / 6 * 5 - 1, 20]] {
        face.light((y * side + x) as usize, light);
    }
    face
}

/// Light that is no number: pixels that are lost, and what changes.
fn lost_light(side: u32) -> Vec<Case> {
    let lost = |results: &Results, _: &Known| -> Figures {
        let lost = |r: &[Vec3]| r.iter().filter(|e| !e.is_finite()).count() as f64;
        results.iter().map(|(m, r)| (*m, lost(r))).collect()
    };
    let case = |name: &str, value: f32, kind: &str, bound, measure: fn(&Results, &Known) -> Figures| {
        let what = "Flat skin under light of 1, but for four pixels far from each other that are \
            NaN or infinite. Pixels lost: how many of the result are not finite. What changes: \
            largest difference to 1 on all of the skin; such a pixel should give nothing, and \
            take the light around it.";
        let run = move |lab: &Lab| {
            let texels = dotted(value, side);
            let results = lab.scatter_both(&texels.upload(&lab.gpu))?;
            let truth = all_are(texels.skin(), 1.0);
            let crop = Crop { first: [20, 20], size: [56; 2] };
            Ok(Outcome {
                figures: measure(&results, &truth),
                shown: Some(crop.show(side, &results, &truth)),
            })
        };
        Case::new(format!("{name} in 4 pixels, {kind}"), what, bound, run)
    };
    let few = Bound {
        passes: 0.0,
        degrades: 4.0,
        why: "one lost pixel becomes a patch in bloom, and can turn the frame black by automatic \
            exposure. Four were lost before; if there are more, scattering has spread them.",
    };
    let values = [("NaN", f32::NAN), ("infinity", f32::INFINITY), ("minus infinity", f32::NEG_INFINITY)];
    let lost = values.map(|(name, value)| case(name, value, "pixels lost", few, lost).pictured(false));
    // Infinity looks as NaN does.
    let changes =
        values.map(|(name, value)| case(name, value, "what changes", EVEN, worst).pictured(value.is_nan()));
    lost.into_iter().chain(changes).collect()
}

/// Light below 0, which is finite and which linear sums can take.
fn negative(side: u32) -> Case {
    let what = "Flat skin under light of 1, with -1 in four pixels, and again with 3 in them: \
        largest difference of the mean of both results to 1. Scattering is linear, so light \
        below 0 is not to be cut off.";
    Case::new("-1 in 4 pixels", what, EVEN, move |lab| {
        let [below, above] = [-1.0, 3.0].map(|e| dotted(e, side));
        let mut mean = lab.scatter_both(&below.upload(&lab.gpu))?;
        let above = lab.scatter_both(&above.upload(&lab.gpu))?;
        for ((_, a), (_, b)) in mean.iter_mut().zip(above) {
            a.iter_mut().zip(b).for_each(|(a, b)| *a = 0.5 * (*a + b));
        }
        Ok(worst(&mean, &all_are(below.skin(), 1.0)).into())
    })
}

/// Depth that says nothing, or the wrong thing: pixels that lie nowhere, or somewhere else.
fn depths(side: u32) -> [Case; 5] {
    let what = "Flat skin 300 mm away under light of 1, with reversed infinite depth, 3 px/mm. \
        One pixel and one row are black and have this depth, which puts them 290 mm or more from \
        the rest, or nowhere: largest difference to 1 on other pixels, and to black on these. \
        Positions in the atlas follow from the depth; texels infinitely far away hold no skin.";
    let why = "A position that is NaN spreads as far as the kernel reaches; to test for it would \
        cost every tap. Leave such texels without skin.";
    let depths = [
        ("0, infinitely far", 0.0),
        ("1, the near plane", 1.0),
        ("NaN", f32::NAN),
        ("infinity", f32::INFINITY),
        ("-1, behind the camera", -1.0),
    ];
    depths.map(|(name, value)| {
        let case = Case::new(format!("depth of {name}"), what, EVEN, move |lab| {
            let view = View::perspective([side; 2], 0.0625 * f64::from(side));
            let g = view.shoot(plane(DVec3::Z, 300.0, |_| DVec3::ONE));
            let mut texels = Texels::of(&g, 0.0);
            let bad = (70 * side..71 * side).chain([40 * side + 40]);
            let bad: Vec<usize> = bad.map(|i| i as usize).collect();
            for &i in &bad {
                texels.light(i, 0.0);
                texels.depth[i] = value;
                let at = DVec2::new(i as f64 % f64::from(side), (i as u32 / side).into());
                let distance_mm = view.projection.w_axis.z / f64::from(value);
                let position = (view.ray(at + 0.5).1 * distance_mm).as_vec3().extend(1.0);
                texels.positions_mm[i] = position.to_array();
                if value == 0.0 {
                    texels.positions_mm[i] = [0.0; 4];
                }
            }
            let mut truth = all_are(texels.skin(), 1.0);
            truth.iter_mut().filter(|(i, _)| bad.contains(i)).for_each(|(_, e)| *e = DVec3::ZERO);
            let inputs = texels.upload(&lab.gpu);
            let mut results = lab.scatter(&inputs.frame(), &inputs.output)?;
            let mut figures = worst(&results, &truth);
            // Texels without skin take what is around them, which the final pass never asks for.
            let textured = lab.scatter_atlas(&inputs.atlas(), &inputs.output)?;
            let in_atlas = truth.iter().filter(|(i, _)| texels.positions_mm[*i][3] != 0.0);
            figures.extend(worst(&textured, &in_atlas.copied().collect()));
            results.extend(textured);
            let crop = Crop { first: [24, 24], size: [56; 2] };
            let shown = Some(crop.show(side, &results, &truth));
            Ok(Outcome { figures, shown })
        });
        // Infinity looks as NaN does, and -1 as 1.
        let looks_alike = value == f32::INFINITY || value == -1.0;
        let held = "A coarse pixel that holds the row right before the camera holds no face; planar tiles from three \
            pixels beside it on take of it. Hand over depth without such rows, or use the exact sum.";
        let is_close = value == 1.0 || value == -1.0;
        case.known(value.is_nan().then(|| known(ATLAS, f64::INFINITY, why)))
            .known(is_close.then(|| known(PLAN, 0.062, held)))
            .pictured(!looks_alike)
    })
}

/// Depth as hosts store it: in few bits, in steps, with noise.
fn stored_depths(side: u32) -> Vec<Case> {
    let what = "A ball of 12 mm lit from 60 degrees to the side, 300 mm away, 3 px/mm, near plane at \
        10 mm: largest difference to the visible integral over the depth as it was, where turned by less \
        than 60 degrees. A step of 16 bits is 0.14 mm there: distance² / (near plane × 65536). Dithered: \
        rounded up or down at random, so that the mean is right. Noise: even, up to that either way.";
    // From a distance, and a number from 0 to 1 that differs from pixel to pixel, to a distance.
    type Store = fn(f64, f64) -> f64;
    let stored: [(&str, Store); 8] = [
        ("in 24 bits", |z, _| in_bits(z, 24, 0.5)),
        ("in 16 bits", |z, _| in_bits(z, 16, 0.5)),
        ("in 16 bits, dithered", |z, u| in_bits(z, 16, u)),
        ("in steps of 0.02 mm", |z, _| (z / 0.02).round() * 0.02),
        ("in steps of 0.5 mm", |z, _| (z / 0.5).round() * 0.5),
        ("with noise of 0.02 mm", |z, u| z + (2.0 * u - 1.0) * 0.02),
        ("with noise of 0.1 mm", |z, u| z + (2.0 * u - 1.0) * 0.1),
        ("with noise of 2 mm", |z, u| z + (2.0 * u - 1.0) * 2.0),
    ];
    let case = |(name, store): (&str, Store)| {
        let case = Case::new(format!("depth {name}"), what, GRADIENT, move |lab| {
            let to_light = DVec3::new(0.75f64.sqrt(), 0.0, 0.5);
            let g = ball(side, |n| n.dot(to_light).max(0.0));
            let mut texels = Texels::of(&g, 0.0);
            for (i, hit) in g.hits.iter().enumerate() {
                if let Some(hit) = hit {
                    let stored_mm = store(-hit.point.z, noise([i as u32 % side, i as u32 / side]));
                    texels.depth[i] = (NEAR_MM / stored_mm) as f32;
                }
            }
            let inputs = texels.upload(&lab.gpu);
            let results = lab.scatter(&inputs.frame(), &inputs.output)?;
            let faces = |i: &usize| g.hits[*i].is_some_and(|hit| hit.normal.z > 0.5);
            let asked: Vec<usize> = (0..g.hits.len()).filter(faces).step_by(3).collect();
            let truth = g.visible_integral(&asked, &Profile::SKIN);
            let truth = asked.into_iter().zip(truth).collect();
            let crop = Crop { first: [side / 4; 2], size: [side / 2; 2] };
            Ok(Outcome { figures: worst(&results, &truth), shown: Some(crop.show(side, &results, &truth)) })
        });
        let why = "Each pixel is a surface of its own then, 2 mm from the next, and hardly any light crosses. \
            Hand over the depth of the mesh, from before noise or offsets of pixels are added to it.";
        let is_torn = name == "with noise of 2 mm";
        let torn = [by_nature(EXACT, 0.04, why), by_nature(PLAN, 0.058, why)];
        let steps =
            "Steps look like layers to the tiles that hold them. Use the exact sum, or finer depth.";
        let at_most = [("in steps of 0.5 mm", 0.014), ("with noise of 0.1 mm", 0.0105)];
        let at_most = at_most.into_iter().find(|(of, _)| *of == name);
        case.known(is_torn.then_some(torn).into_iter().flatten())
            .known(at_most.map(|(_, at_most)| known(PLAN, at_most, steps)))
            .pictured(is_torn)
    };
    stored.map(case).into()
}

/// Of [`View::perspective`].
const NEAR_MM: f64 = 10.0;

/// A distance whose reversed, infinite depth is stored in so many bits; `up` from 0 to 1 says where between two
/// steps it is rounded.
fn in_bits(z_mm: f64, bits: i32, up: f64) -> f64 {
    let steps = f64::from(bits).exp2() - 1.0;
    NEAR_MM / ((NEAR_MM / z_mm * steps + up).floor() / steps)
}

/// Flat skin at 6 px/mm, lit by waves 4 mm long at 27 degrees to the rows, from the first pixel on.
fn waves(size: [u32; 2]) -> GBuffer {
    let corner = DVec2::new(-f64::from(size[0]), f64::from(size[1])) / 12.0;
    let across = DVec2::from_angle(-27f64.to_radians());
    let light = |p: DVec3| 0.5 + 0.5 * (TAU * (p.truncate() - corner).dot(across) / 4.0).sin();
    View::orthographic(size, 6.0).shoot(plane(DVec3::Z, 300.0, |p| DVec3::splat(light(p))))
}

/// Frames of one pixel, of one row, and with sides that halve to odd numbers at every level of a pyramid.
fn small([width, height]: [u32; 2]) -> Case {
    let what = "Flat skin under waves of light 4 mm long, 6 px/mm: largest difference to the \
        visible integral, along the frame's last rows and columns, and at every fifth pixel of \
        every fifth row.";
    let why = "Taps of the pyramid have the right width only together. At the frame's border \
        some are missing, in a frame a pixel wide all but the middle ones, and coarse levels are \
        extrapolated from the last two pixels. Use the exact sum, or draw a wider frame.";
    let at_most = if width.min(height) == 1 { 0.025 } else { 0.022 };
    let case = Case::new(format!("{width}x{height}"), what, GRADIENT, move |lab| {
        let g = waves([width, height]);
        let results = lab.scatter_both(&Texels::of(&g, 0.0).upload(&lab.gpu))?;
        let is_asked = |i: &u32| {
            let [x, y] = [i % width, i / width];
            x + 2 >= width || y + 2 >= height || x % 5 == 0 && y % 5 == 0
        };
        let asked = (0..width * height).filter(is_asked).map(|i| i as usize);
        let asked: Vec<usize> = asked.collect();
        let truth = g.visible_integral(&asked, &Profile::SKIN);
        Ok(worst(&results, &asked.into_iter().zip(truth).collect()).into())
    });
    case.known((width > 1 || height > 1).then(|| known(PLAN, at_most, why)))
}

/// As many pixels as a full screen of the densest displays, and more.
fn large() -> Case {
    const SIDE: u32 = 4096;
    const PART: u32 = 192;
    let what = "Skin in the last 192x192 pixels of such a frame alone, under waves of light 4 mm \
        long, 6 px/mm: largest difference to the same in a frame of 192x192, beyond the reach of \
        its first row and column, which are borders of that frame alone. Single floats hold the \
        place of a pixel in a frame of 680 mm to 0.00006 mm. In the full form alone.";
    let why = "At the border of the small frame coarse levels are extrapolated, which their blurs carry \
        farther than the profile reaches.";
    Case::new("4096x4096", what, EVEN, |lab| {
        let part = Texels::of(&waves([PART; 2]), 0.0);
        let small = lab.scatter_both(&part.upload(&lab.gpu))?;
        let mut whole = Texels::of(&View::orthographic([SIDE; 2], 6.0).shoot(|_, _| None), 0.0);
        // Both frames have their middles at the origin.
        let moved_mm = f64::from(SIDE - PART) / 12.0;
        for i in 0..(PART * PART) as usize {
            let [x, y] = [i as u32 % PART, i as u32 / PART].map(|c| c + SIDE - PART);
            let to = (y * SIDE + x) as usize;
            whole.irradiance[to] = part.irradiance[i];
            whole.depth[to] = part.depth[i];
            whole.profile_id[to] = 1;
            let [x_mm, y_mm, z_mm, id] = part.positions_mm[i].map(f64::from);
            whole.positions_mm[to] = [x_mm + moved_mm, y_mm - moved_mm, z_mm, id].map(|c| c as f32);
        }
        let inputs = whole.upload(&lab.gpu);
        drop(whole);
        let reach = (f64::from(Profile::SKIN.reach_mm()) * 6.0).ceil() as u32;
        let is_far = |i: &usize| *i as u32 % PART > reach && *i as u32 / PART > reach;
        let far: Vec<usize> = (0..(PART * PART) as usize).filter(is_far).collect();
        let cut = lab.gpu.target("cut", [PART; 2], OUTPUT);
        let mut figures = Vec::new();
        // One at a time, since the scratch textures of all of them are 5 GiB.
        for (name, mut method) in methods(&lab.gpu, &lab.plan)? {
            method.prepare(&lab.gpu, &inputs)?;
            lab.gpu.run(|encoder| -> Result<(), Error> {
                method.render(encoder, &inputs.output)?;
                let mut source = inputs.output.texture().as_image_copy();
                let [x, y] = [SIDE - PART; 2];
                source.origin = wgpu::Origin3d { x, y, z: 0 };
                let size = cut.texture().size();
                encoder.copy_texture_to_texture(source, cut.texture().as_image_copy(), size);
                Ok(())
            })?;
            let own: Results = small.iter().filter(|(m, _)| *m == name).cloned().collect();
            figures.extend(apart(&vec![(name, lab.read(&cut))], &own, &far));
        }
        Ok(figures.into())
    })
    .known([known(PLAN, 0.0062, why)])
}

/// Textures that cannot be made, handed to an effect all the same.
fn too_large() -> Case {
    let what = "A host makes textures wider than the device allows, which wgpu reports to it and \
        `Gpu::check_size` beforehand. Each method gets them as a frame all the same, then one of \
        64x64 that it has had before: how many pixels of that have changed; infinite where \
        nothing told the host. A panic ends the run.";
    let bound = Bound {
        passes: 0.0,
        degrades: 1.0,
        why: "wgpu has told the host of its mistake; the next frame is like any other.",
    };
    Case::new("a size beyond the device's limit", what, bound, |lab| {
        let gpu = &lab.gpu;
        let limit = gpu.device.limits().max_texture_dimension_2d;
        let size = [limit + 1, 1];
        let refused = gpu.check_size(size).err().map(|e| e.to_string());
        let named = refused.is_some_and(|e| e.starts_with("size: ") && e.contains(&limit.to_string()));
        let good = Texels::of(&waves([64; 2]), 0.0).upload(gpu);
        let mut figures = Vec::new();
        for (name, mut method) in methods(gpu, &lab.plan)? {
            let before = method.scatter(gpu, &good)?;
            let scope = gpu.device.push_error_scope(ErrorFilter::Validation);
            let bad = Texels::of(&waves(size), 0.0).upload(gpu);
            // Whether it refuses them or not, as long as it goes on.
            if method.prepare(gpu, &bad).is_ok() {
                let _ = gpu.run(|encoder| method.render(encoder, &bad.output));
            }
            let told = pollster::block_on(scope.pop()).is_some();
            let after = method.scatter(gpu, &good)?;
            let changed = before.iter().zip(&after).filter(|(a, b)| a != b).count();
            figures.push((name, if named && told { changed as f64 } else { f64::INFINITY }));
        }
        Ok(figures.into())
    })
}

/// A profile of one Gaussian.
fn width((name, sigma_mm): (&str, f32), side: u32) -> Case {
    let narrow = sigma_mm < 1.0;
    let what = "One Gaussian, a hard edge at 27 degrees on flat skin, 6 px/mm: largest \
        difference to the light as it was where it is narrow; of a metre to the visible \
        integral, which is the mean of all light in the frame, by a plan for an error of 0.01. \
        Rivals have their kernels fitted to it; none can be to no width, and `jimenez_2009` is \
        made for skin alone.";
    let why = if narrow {
        "No plan keeps 1/255 for a single Gaussian, and one for 0.01 may blur by half of that. \
         Use the exact sum."
    } else {
        "The kernel is wider than the coarsest level of the pyramid; `Plan::useful_px_per_mm` \
         says to what scale a plan is good. Use the exact sum."
    };
    let bound = if narrow { EVEN } else { GRADIENT };
    Case::new(format!("a profile of {name}"), what, bound, move |lab| {
        let profile = Profile::new(&[Gaussian { variance_mm2: sigma_mm * sigma_mm, weight: [1.0; 3] }])?;
        // No plan keeps 1/255 for a single Gaussian.
        let plan = Plan::new(&[profile], 0.01)?;
        let across = DVec2::from_angle(27f64.to_radians()).extend(0.0);
        let light = move |p: DVec3| DVec3::splat(if p.dot(across) < 0.0 { 1.0 } else { 0.0 });
        let face = plane(DVec3::Z, 300.0, light);
        // A third of the frame has no skin.
        let end_mm = f64::from(side) / 36.0;
        let view = View::orthographic([side; 2], 6.0);
        let g = view.shoot(|origin, ray| face(origin, ray).filter(|hit| hit.point.x < end_mm));
        let texels = Texels::of(&g, 0.0);
        let inputs = texels.upload(&lab.gpu);
        let mut results: Results = vec![("none", lab.read(inputs.frame().irradiance))];
        let methods = if sigma_mm == 0.0 { ours(&lab.gpu, &plan)? } else { methods(&lab.gpu, &plan)? };
        for (name, mut method) in methods {
            method.scatter(&lab.gpu, &inputs)?;
            results.push((name, lab.read(&inputs.output)));
        }
        let asked: Vec<usize> = texels.skin().into_iter().step_by(7).collect();
        let truth = match narrow {
            true => asked.iter().map(|i| results[0].1[*i].as_dvec3()).collect(),
            false => g.visible_integral(&asked, &profile),
        };
        Ok(worst(&results, &asked.into_iter().zip(truth).collect()).into())
    })
    .known((sigma_mm > 0.0).then(|| known(PLAN, if narrow { 0.0055 } else { 0.05 }, why)))
}

/// The same scene in other units.
fn unit((name, mm_per_unit): (&str, f32), side: u32) -> Case {
    let what = "A ball of 12 mm lit from one side, in perspective, 3 px/mm, the scene in these \
        units: largest difference to the same method's result in millimetres.";
    Case::new(format!("a scene in {name}"), what, EVEN, move |lab| {
        let to_light = DVec3::new(0.8, 0.0, 0.6);
        let in_mm = Texels::of(&ball(side, |n| n.dot(to_light).max(0.0)), 0.0);
        let in_units = Texels { mm_per_unit, ..in_mm.clone() };
        let before = lab.scatter_both(&in_mm.upload(&lab.gpu))?;
        let after = lab.scatter_both(&in_units.upload(&lab.gpu))?;
        Ok(apart(&after, &before, &in_mm.skin()).into())
    })
}
