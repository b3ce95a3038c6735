//! A host that knows the crate by its documentation alone: a G-buffer of its own, three ways to
//! scatter its light, and checks of what came back.

mod host;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use host::{Failure, GBuffer, HEIGHT, NEAR, WIDTH, float, target};
use subsurface::{
    DEFAULT_MAX_ERROR, Output, Plan, PlannedScreenSpace, Profile, ScreenFrame, ScreenSpace,
};
use wgpu::TextureFormat::Rgba16Float;

fn main() -> Result<(), Failure> {
    let instance = wgpu::Instance::default();
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let uncaptured = Arc::new(AtomicUsize::new(0));
    let counter = uncaptured.clone();
    device.on_uncaptured_error(Arc::new(move |error| {
        eprintln!("{error}");
        counter.fetch_add(1, Ordering::Relaxed);
    }));
    println!("{}", adapter.get_info().name);
    let proj = glam::camera::rh::proj::directx::perspective_infinite_reverse(
        30f32.to_radians(),
        WIDTH as f32 / HEIGHT as f32,
        NEAR,
    );
    let mut encoder = device.create_command_encoder(&Default::default());
    let g = GBuffer::draw(&device, &mut encoder, proj);
    let [planned_layer, exact_layer, hdr, again] = [(); 4].map(|()| target(&device, Rgba16Float));
    let (from, to) = (g.lit.texture(), hdr.texture());
    encoder.copy_texture_to_texture(from.as_image_copy(), to.as_image_copy(), from.size());
    queue.submit([encoder.finish()]);

    // The integration.
    let start = Instant::now();
    let plan = Plan::new(&[Profile::SKIN], DEFAULT_MAX_ERROR)?;
    println!(
        "plan: {:?}, predicts {:.5}",
        start.elapsed(),
        plan.predicted_error()
    );
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let mut planned = PlannedScreenSpace::new(&device, Rgba16Float)?;
    let mut exact = ScreenSpace::new(&device, Rgba16Float)?;
    let mut difference = PlannedScreenSpace::new(&device, Output::AddDifference(Rgba16Float))?;
    let frame = ScreenFrame {
        irradiance: &g.irradiance,
        depth: &g.depth,
        profile_id: Some(&g.id),
        normal: None,
        strength: None,
        output: &planned_layer,
        viewport: None,
        projection: proj,
        mm_per_unit: 1000.0,
        profiles: &[Profile::SKIN],
    };
    let mut encoder = device.create_command_encoder(&Default::default());
    planned.prepare(&device, &queue, &frame, &plan)?;
    planned.render(&mut encoder);
    exact.prepare(
        &device,
        &ScreenFrame {
            output: &exact_layer,
            ..frame
        },
    )?;
    exact.render(&mut encoder);
    let in_place = ScreenFrame {
        irradiance: &g.lit,
        output: &hdr,
        ..frame
    };
    difference.prepare(&device, &queue, &in_place, &plan)?;
    difference.render(&mut encoder);
    queue.submit([encoder.finish()]);

    // Mistakes are named, and the next frame is right.
    let no_unit = planned.prepare(
        &device,
        &queue,
        &ScreenFrame {
            mm_per_unit: 0.0,
            ..frame
        },
        &plan,
    );
    let depth_as_light = ScreenFrame {
        irradiance: &g.depth,
        ..frame
    };
    let no_light = planned.prepare(&device, &queue, &depth_as_light, &plan);
    for (result, field) in [(no_unit, "mm_per_unit"), (no_light, "irradiance")] {
        let error = result.expect_err(field);
        println!("{error}");
        assert!(error.input.starts_with(field), "{field} is not named");
    }
    let mut encoder = device.create_command_encoder(&Default::default());
    planned.prepare(
        &device,
        &queue,
        &ScreenFrame {
            output: &again,
            ..frame
        },
        &plan,
    )?;
    planned.render(&mut encoder);
    queue.submit([encoder.finish()]);
    let read = |view| host::read(&device, &queue, view);
    let (light, lit) = (read(&g.irradiance)?, read(&g.lit)?);
    let (planned, exact) = (read(&planned_layer)?, read(&exact_layer)?);
    let (hdr, again) = (read(&hdr)?, read(&again)?);
    assert!(again == planned, "the frame after a mistake differs");

    let px_per_mm = proj.y_axis.y * HEIGHT as f32 / 2.0 / 510.0;
    let reach = (8.0 * px_per_mm) as isize; // three times the widest Gaussian of skin
    let is_skin = |i: isize| light[i as usize][3] != 0;
    let row = WIDTH as isize;
    let (mut skin, mut inside) = (0, 0);
    let [
        mut worst_flat,
        mut worst_steep,
        mut worst_rim,
        mut worst_sum,
    ] = [0f32; 4];
    for i in 0..light.len() {
        if !is_skin(i as isize) {
            let kept = planned[i] == light[i] && exact[i] == light[i] && hdr[i] == lit[i];
            assert!(kept, "background changed at {i}");
            continue;
        }
        skin += 1;
        assert!(
            planned[i][3] == light[i][3] && hdr[i][3] == lit[i][3],
            "alpha changed at {i}"
        );
        let apart = (0..3).map(|c| (float(planned[i][c]) - float(exact[i][c])).abs());
        let apart = apart.fold(0.0, f32::max);
        let steps = [
            -reach,
            reach,
            -reach * row,
            reach * row,
            (row + 1) * (reach * 7 / 10),
        ];
        let far_in = steps
            .iter()
            .all(|step| is_skin(i as isize + step) && is_skin(i as isize - step));
        let worst = match (far_in, float(light[i][3]) > 0.866) {
            (true, true) => &mut worst_flat, // the slopes for which a plan keeps its error: 30 degrees
            (true, false) => &mut worst_steep,
            (false, _) => &mut worst_rim,
        };
        *worst = worst.max(apart);
        inside += u32::from(far_in);
        for (c, albedo) in [0.8, 0.6, 0.5].into_iter().enumerate() {
            let sum = float(lit[i][c]) + albedo * (float(planned[i][c]) - float(light[i][c]));
            worst_sum = worst_sum.max((float(hdr[i][c]) - sum).abs());
        }
    }
    println!("{skin} px of skin, {inside} of them 8 mm and more from a silhouette");
    print!(
        "|planned - exact| / error asked for: {:.1} to 30 degrees, ",
        worst_flat / DEFAULT_MAX_ERROR
    );
    println!(
        "{:.1} steeper, {:.1} at silhouettes",
        worst_steep / DEFAULT_MAX_ERROR,
        worst_rim / DEFAULT_MAX_ERROR
    );
    assert!(skin > 10_000 && inside > 10_000, "no skin to speak of");
    assert!(
        worst_flat < 3.0 * DEFAULT_MAX_ERROR,
        "planned and exact are apart"
    );
    println!("in place - (unscattered + difference): {worst_sum:.5}");
    assert!(
        worst_sum < DEFAULT_MAX_ERROR,
        "the difference is not what was scattered"
    );

    // Two millimetres into the shadow, half way down.
    let line = (HEIGHT / 2 * WIDTH) as usize..;
    let edge = line
        .clone()
        .find(|&i| float(light[i + 1][0]) - float(light[i][0]) > 0.2 && is_skin(i as isize));
    let shadow = edge.expect("a shadow edge") - (2.0 * px_per_mm) as usize;
    for (name, pixels) in [("before", &light), ("planned", &planned), ("exact", &exact)] {
        println!(
            "2 mm into the shadow, {name}: {:.4?}",
            pixels[shadow].map(float)
        );
    }
    for pixels in [&planned, &exact] {
        let [red, _, blue, _] = pixels[shadow].map(float);
        assert!(
            red > float(light[shadow][0]) + 0.02 && red > blue + 0.01,
            "no light crossed"
        );
    }
    let scoped = pollster::block_on(scope.pop());
    assert!(
        scoped.is_none() && uncaptured.load(Ordering::Relaxed) == 0,
        "{scoped:?}"
    );
    Ok(())
}
