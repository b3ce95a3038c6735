//! What Rust and WGSL both spell out, held against each other: layouts of structs, constants, and
//! functions, which are run by both.

use std::sync::OnceLock;

use naga::{Expression, Literal};

mod structs;
use structs::parse;
pub(crate) use structs::{assert_layout, layout};

/// The value of a `const` of a shader.
pub(crate) fn constant(source: &str, name: &str) -> f64 {
    let module = parse(source);
    let found = module
        .constants
        .iter()
        .find(|(_, c)| c.name.as_deref() == Some(name))
        .unwrap_or_else(|| panic!("the shader has no constant {name}"));
    match module.global_expressions[found.1.init] {
        Expression::Literal(Literal::F32(x)) => x.into(),
        Expression::Literal(Literal::U32(x)) => x.into(),
        Expression::Literal(Literal::I32(x)) => x.into(),
        Expression::Literal(Literal::AbstractFloat(x)) => x,
        Expression::Literal(Literal::AbstractInt(x)) => x as f64,
        ref other => panic!("{name} is {other:?}"),
    }
}

fn device() -> &'static (wgpu::Device, wgpu::Queue) {
    static DEVICE: OnceLock<(wgpu::Device, wgpu::Queue)> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        let instance = wgpu::Instance::new(descriptor);
        let adapter = pollster::block_on(instance.request_adapter(&Default::default()))
            .expect("a driver: run ./setup");
        pollster::block_on(adapter.request_device(&Default::default())).expect("a device")
    })
}

/// What an expression of `x`, a `vec4f`, is in the shader for each input; `call` is WGSL for a `vec4f`.
pub(crate) fn evaluate(source: &str, call: &str, inputs: &[[f32; 4]]) -> Vec<[f32; 4]> {
    use wgpu::BufferUsages as Usage;
    let (device, queue) = device();
    let source = format!(
        "{source}
@group(3) @binding(0) var<storage, read_write> twins: array<vec4f>;
@compute @workgroup_size(1)
fn run_twin(@builtin(workgroup_id) at: vec3u) {{
    let x = twins[at.x];
    twins[at.x] = {call};
}}"
    );
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("run_twin"),
        compilation_options: Default::default(),
        cache: None,
    });
    let bytes = bytemuck::cast_slice(inputs);
    let usage = Usage::STORAGE | Usage::COPY_SRC;
    let buffer = crate::gpu::filled_buffer(device, "twins", bytes, usage);
    let read = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: buffer.size(),
        usage: Usage::MAP_READ | Usage::COPY_DST,
        mapped_at_creation: false,
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(3),
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(3, &group, &[]);
    pass.dispatch_workgroups(inputs.len() as u32, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&buffer, 0, &read, 0, buffer.size());
    queue.submit([encoder.finish()]);
    read.map_async(wgpu::MapMode::Read, .., |result| result.expect("mapped"));
    device.poll(wgpu::PollType::wait_indefinitely()).expect("the device goes on");
    bytemuck::pod_collect_to_vec(&read.get_mapped_range(..).expect("mapped"))
}
