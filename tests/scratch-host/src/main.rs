//! Two cameras in one submission, each scattered as a layer and in place; read back and checked.
use glam::camera::rh::proj::directx::perspective_infinite_reverse;
use subsurface::{Frame, Output, Plan, ScreenSpace, View};
use wgpu::TextureFormat::{Depth32Float, R8Uint, Rgba16Float};
use wgpu::*;

const SIDE: u32 = 256;
const PIXELS: usize = (SIDE * SIDE) as usize;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let adapter = pollster::block_on(Instance::default().request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let errors = device.push_error_scope(ErrorFilter::Validation);
    let module = &device.create_shader_module(include_wgsl!("scene.wgsl"));
    let scene = device.create_render_pipeline(&RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: VertexState {
            module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: Some(DepthStencilState {
            format: Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(FragmentState {
            module,
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[Rgba16Float, Rgba16Float, R8Uint].map(|format| Some(format.into())),
        }),
        multiview_mask: None,
        cache: None,
    });
    let texture_usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
    let target = |format: TextureFormat| {
        let texture = device.create_texture(&TextureDescriptor {
            label: None,
            size: Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format,
            usage: texture_usage | TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        texture.create_view(&Default::default())
    };
    let usage = BufferUsages::COPY_DST | BufferUsages::MAP_READ;
    let size = 8 * 8 * PIXELS as u64; // eight images of Rgba16Float
    let descriptor = BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
    let buffer = &device.create_buffer(&descriptor);
    let mut layout = TexelCopyBufferLayout { bytes_per_row: Some(8 * SIDE), ..Default::default() };
    let mut encoder = device.create_command_encoder(&Default::default());
    let layer = ScreenSpace::new(&device, Rgba16Float, &Plan::skin())?;
    let in_place = ScreenSpace::new(&device, Output::AddDifference(Rgba16Float), &Plan::skin())?;
    let shots = [(0, 0.5, &layer), (1, 0.3, &layer), (0, 0.5, &in_place), (1, 0.3, &in_place)];
    let mut views: [View; 4] = Default::default();
    for (view, (camera, fov, effect)) in views.iter_mut().zip(shots) {
        let [light, out, id, depth] = [Rgba16Float, Rgba16Float, R8Uint, Depth32Float].map(target);
        let ops = Operations::default(); // clears to 0: no light, no id
        let color =
            |view| Some(RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops });
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            color_attachments: &[color(&light), color(&out), color(&id)],
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(Default::default()), // clears to 0: infinity
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&scene);
        pass.draw(0..6 * 256 * 128, 2 * camera..2 * camera + 2);
        drop(pass);
        let projection = perspective_infinite_reverse(fov, 1.0, 0.05);
        let mut frame = Frame::new(&light, &depth, projection.to_cols_array_2d());
        frame.profile_id = Some(&id);
        view.prepare(&device, &queue, effect, &frame)?;
        view.render(&mut encoder, &out)?;
        for image in [light.texture(), out.texture()] {
            let to = TexelCopyBufferInfo { buffer, layout };
            encoder.copy_texture_to_buffer(image.as_image_copy(), to, image.size());
            layout.offset += 8 * PIXELS as u64;
        }
    }
    queue.submit([encoder.finish()]);
    buffer.map_async(MapMode::Read, .., |mapped| mapped.unwrap());
    device.poll(PollType::wait_indefinitely())?;

    let error = pollster::block_on(errors.pop());
    println!("validation: {error:?}");
    let bytes = buffer.get_mapped_range(..)?;
    let pixels: Vec<_> = bytes.chunks_exact(8).collect();
    let images: Vec<_> = pixels.chunks_exact(PIXELS).collect();
    let differ = images[1] != images[3] && images[5] != images[7];
    println!("the views differ: {differ}");
    let mut good = error.is_none() && differ;
    for image in images.chunks_exact(2) {
        let skin = |i: usize| image[0][i][7] != 0; // alpha
        let same = (0..PIXELS).all(|i| skin(i) || image[0][i] == image[1][i]);
        // A step of light to the right: the upper byte of a half rises by 4 where light doubles.
        let step = |n: usize, i: usize| image[n][i][1].abs_diff(image[n][i - 1][1]);
        let edges = (1..PIXELS).filter(|&i| skin(i - 1) && skin(i) && step(0, i) > 4);
        let soft = edges.clone().filter(|&i| step(1, i) < step(0, i)).count();
        let sharp = edges.count() - soft;
        println!("pixels off skin are as they were: {same}");
        println!("edges of light on skin: {soft} got softer, {sharp} did not");
        good &= same && soft > 100 && sharp == 0;
    }
    std::process::exit(i32::from(!good))
}
