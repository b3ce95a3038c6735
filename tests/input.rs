//! Inputs that do not fit are named, never a panic or a validation error of the device.

use std::sync::OnceLock;

use glam::Mat4;
use subsurface::wgpu::{self, TextureFormat, TextureUsages, TextureView};
use subsurface::{
    Atlas, AtlasView, BackLayer, Error, Frame, Output, Plan, Profile, ScreenSpace, TextureSpace, Viewport,
};
use subsurface_lab::synthetic::{View, gpu};

const SIZE: [u32; 2] = [16, 8];
const HALF: TextureFormat = TextureFormat::Rgba16Float;

fn view(format: TextureFormat) -> TextureView {
    gpu().target("input", SIZE, format)
}

fn small(format: TextureFormat) -> TextureView {
    gpu().target("small", [8, 8], format)
}

fn texture(format: TextureFormat, usage: TextureUsages, samples: u32) -> TextureView {
    let texture = gpu().device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: samples,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

/// The exact sum, and a plan.
fn plans() -> &'static [Plan; 2] {
    static PLANS: OnceLock<[Plan; 2]> = OnceLock::new();
    PLANS.get_or_init(|| {
        let skin = [Profile::SKIN];
        [Plan::exact(&skin).unwrap(), Plan::new(&skin, 0.01).unwrap()]
    })
}

fn effects() -> &'static [ScreenSpace; 2] {
    static EFFECTS: OnceLock<[ScreenSpace; 2]> = OnceLock::new();
    EFFECTS.get_or_init(|| {
        let effect = |plan| ScreenSpace::new(&gpu().device, HALF, plan).unwrap();
        plans().each_ref().map(effect)
    })
}

struct Inputs {
    irradiance: TextureView,
    depth: TextureView,
    profile_id: Option<TextureView>,
    strength: Option<TextureView>,
    albedo: Option<TextureView>,
    back: Option<[TextureView; 2]>,
    back_id: Option<TextureView>,
    output: TextureView,
    viewport: Option<Viewport>,
    projection: Mat4,
    mm_per_unit: f32,
    nearest: Option<f32>,
}

impl Inputs {
    fn new() -> Self {
        Self {
            irradiance: view(HALF),
            depth: view(TextureFormat::Depth32Float),
            profile_id: Some(view(TextureFormat::R8Uint)),
            strength: None,
            albedo: None,
            back: None,
            back_id: None,
            output: view(HALF),
            viewport: None,
            projection: View::perspective(SIZE, 40.0).projection.as_mat4(),
            mm_per_unit: 1.0,
            nearest: None,
        }
    }

    fn frame(&self) -> Frame<'_> {
        let projection = self.projection.to_cols_array_2d();
        let mut frame = Frame::new(&self.irradiance, &self.depth, projection);
        frame.profile_id = self.profile_id.as_ref();
        frame.strength = self.strength.as_ref();
        frame.albedo = self.albedo.as_ref();
        let back = self.back.as_ref();
        frame.back = back.map(|[irradiance, depth]| {
            let mut layer = BackLayer::new(irradiance, depth);
            layer.profile_id = self.back_id.as_ref();
            layer
        });
        frame.viewport = self.viewport;
        frame.mm_per_unit = self.mm_per_unit;
        frame.nearest = self.nearest;
        frame
    }
}

/// Scatters a frame of which one thing has changed, by the exact sum and by a plan.
fn screen(change: impl FnOnce(&mut Inputs)) -> Result<(), Error> {
    let mut inputs = Inputs::new();
    change(&mut inputs);
    let gpu = gpu();
    // Whatever gets past the checks must not trip the device's own.
    let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let results = effects().each_ref().map(|effect| {
        let mut view = subsurface::View::new();
        view.prepare(&gpu.device, &gpu.queue, effect, &inputs.frame())?;
        gpu.run(|encoder| view.render(encoder, &inputs.output))
    });
    let error = pollster::block_on(scope.pop());
    assert!(error.is_none(), "{error:?}");
    let [exact, planned] = results;
    // As text, since a matrix may hold NaN, which equals nothing.
    assert_eq!(format!("{exact:?}"), format!("{planned:?}"));
    exact
}

#[test]
fn a_back_layer_that_does_not_fit_is_named() {
    use TextureFormat::{Depth32Float, R8Uint, R16Float};
    let of = |light, depth| screen(|i| i.back = Some([light, depth]));
    assert_eq!(of(view(HALF), view(Depth32Float)), Ok(()));
    let named = |result: Result<(), Error>, start: &str| {
        let error = result.unwrap_err().to_string();
        assert!(error.starts_with(start), "{error}");
    };
    named(of(view(R16Float), view(Depth32Float)), "back.irradiance: format: got R16Float");
    named(of(view(HALF), view(HALF)), "back.depth: format: got Rgba16Float");
    named(of(view(HALF), small(Depth32Float)), "back.depth: size: got 8x8, needs 16x8");
    named(
        screen(|i| {
            i.back = Some([view(HALF), view(Depth32Float)]);
            i.back_id = Some(small(R8Uint));
        }),
        "back.profile_id: size: got 8x8",
    );
    named(
        screen(|i| {
            i.back = Some([view(HALF), view(Depth32Float)]);
            i.output = i.back.as_ref().map(|[light, _]| light.clone()).unwrap();
        }),
        "output: got the texture of back.irradiance",
    );
}

#[test]
fn what_fits_is_taken() {
    use TextureFormat as F;
    screen(|_| ()).unwrap();
    for depth in [F::Depth16Unorm, F::Depth24Plus, F::R32Float] {
        screen(|i| i.depth = view(depth)).unwrap();
    }
    screen(|i| i.irradiance = view(F::Rgba32Float)).unwrap();
    let packed = texture(F::Rg11b10Ufloat, TextureUsages::TEXTURE_BINDING, 1);
    screen(|i| i.irradiance = packed).unwrap();
    screen(|i| i.profile_id = Some(view(F::R32Uint))).unwrap();
    screen(|i| i.profile_id = None).unwrap();
    for strength in [F::R8Unorm, F::Rgba16Float] {
        screen(|i| i.strength = Some(view(strength))).unwrap();
    }
    for [x, y, width, height] in [[0, 0, 16, 8], [15, 7, 1, 1], [3, 2, 9, 5]] {
        let viewport = Viewport { x, y, width, height };
        screen(|i| i.viewport = Some(viewport)).unwrap();
    }
    let sixteen = Plan::exact(&[Profile::SKIN; 16]).unwrap();
    ScreenSpace::new(&gpu().device, HALF, &sixteen).unwrap();
}

/// A sentence begins with the name of the input and says what it got and needs.
fn assert_names(error: &Error, name: &str) {
    let said = error.to_string();
    assert!(said.starts_with(name), "{said}\nshould be about {name}");
    assert!(said.contains("got") && said.contains("needs"), "{said}");
}

#[test]
fn what_does_not_fit_is_named() {
    use TextureFormat as F;
    type Change = fn(&mut Inputs);
    let table: [(&str, Change); 27] = [
        ("irradiance: format", |i| i.irradiance = view(F::Rgba8Uint)),
        ("irradiance: format", |i| i.irradiance = view(F::R16Float)),
        ("depth: format", |i| i.depth = view(F::Rgba16Float)),
        ("depth: format", |i| i.depth = view(F::R8Unorm)),
        ("depth: format", |i| i.depth = view(F::R16Float)),
        ("profile_id: format", |i| i.profile_id = Some(view(F::R8Unorm))),
        ("strength: format", |i| i.strength = Some(view(F::R8Uint))),
        ("strength: format", |i| i.strength = Some(view(F::Depth32Float))),
        ("strength: size", |i| i.strength = Some(small(F::R8Unorm))),
        ("albedo: got a texture", |i| i.albedo = Some(view(HALF))),
        ("albedo: format", |i| i.albedo = Some(view(F::R8Unorm))),
        ("depth: size", |i| i.depth = small(F::Depth32Float)),
        ("depth: got a D2 texture with 4 samples", |i| {
            let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::RENDER_ATTACHMENT;
            i.depth = texture(F::Depth32Float, usage, 4);
        }),
        ("irradiance: usage", |i| {
            i.irradiance = texture(HALF, TextureUsages::RENDER_ATTACHMENT, 1);
        }),
        ("output: format", |i| i.output = view(F::Rgba32Float)),
        ("output: size", |i| i.output = small(HALF)),
        ("output: usage", |i| {
            i.output = texture(HALF, TextureUsages::TEXTURE_BINDING, 1);
        }),
        ("output: got the texture of irradiance", |i| {
            i.output = i.irradiance.clone();
        }),
        ("output: got the texture of strength", |i| {
            i.strength = Some(i.output.clone());
        }),
        ("projection", |i| i.projection = Mat4::ZERO),
        ("projection", |i| i.projection.x_axis.x = f32::NAN),
        ("projection", |i| i.projection.x_axis.y = 0.5),
        ("mm_per_unit", |i| i.mm_per_unit = 0.0),
        ("mm_per_unit", |i| i.mm_per_unit = -1.0),
        ("mm_per_unit", |i| i.mm_per_unit = f32::NAN),
        ("nearest", |i| i.nearest = Some(0.0)),
        ("nearest", |i| i.nearest = Some(f32::INFINITY)),
    ];
    for (name, change) in table {
        assert_names(&screen(change).expect_err(name), name);
    }
    for [x, y, width, height] in [[0, 0, 0, 8], [0, 0, 17, 8], [9, 0, 8, 8], [u32::MAX, 0, 2, 1]] {
        let viewport = Viewport { x, y, width, height };
        let error = screen(|i| i.viewport = Some(viewport)).unwrap_err();
        assert_names(&error, "viewport");
    }
    for count in [0, 17] {
        let error = Plan::exact(&vec![Profile::SKIN; count]).unwrap_err();
        assert_names(&error, "profiles");
        let texture = TextureSpace::new(&gpu().device, HALF, &vec![Profile::SKIN; count]);
        assert_names(&texture.unwrap_err(), "profiles");
    }
}

#[test]
fn an_output_that_cannot_be_drawn_to_is_named() {
    use TextureFormat as F;
    let device = &gpu().device;
    for plan in plans() {
        for output in [
            Output::Scattered(F::Rgba8Uint),
            Output::Scattered(F::Depth32Float),
            Output::Scattered(F::Bc1RgbaUnorm),
            // Not blended without a feature.
            Output::AddScattered(F::Rgba32Float),
            Output::AddDifference(F::Rgba32Float),
            // What is added may be negative.
            Output::AddScattered(F::Rgba8Unorm),
            Output::AddDifference(F::Rgba8Unorm),
        ] {
            let error = ScreenSpace::new(device, output, plan).unwrap_err();
            assert_names(&error, "output: format");
        }
        for output in [Output::AddScattered(HALF), Output::AddDifference(HALF)] {
            ScreenSpace::new(device, output, plan).unwrap();
        }
    }
    assert!(TextureSpace::new(device, F::Rgba8Uint, &[Profile::SKIN]).is_err());
}

/// Projections that only the exact sum takes.
#[test]
fn what_a_plan_cannot_do_is_named() {
    let gpu = gpu();
    let [exact, planned] = effects();
    let changes: [fn(&mut Mat4); 2] = [|p| p.x_axis.z = 0.1, |p| p.z_axis *= -1.0];
    for change in changes {
        let mut inputs = Inputs::new();
        change(&mut inputs.projection);
        let mut view = subsurface::View::new();
        let mut prepare = |effect| view.prepare(&gpu.device, &gpu.queue, effect, &inputs.frame());
        prepare(exact).unwrap();
        assert_names(&prepare(planned).unwrap_err(), "projection");
    }
}

#[test]
fn a_frame_that_was_refused_leaves_the_one_before() {
    let gpu = gpu();
    // Lit on the right.
    let lit = |i: u32| [f32::from(u8::from(i % SIZE[0] >= 8)); 4];
    let light: Vec<[f32; 4]> = (0..SIZE[0] * SIZE[1]).map(lit).collect();
    let mut inputs = Inputs::new();
    inputs.irradiance = gpu.upload("irradiance", SIZE, TextureFormat::Rgba32Float, &light);
    inputs.depth = gpu.upload("depth", SIZE, TextureFormat::R32Float, &[0.5f32; 128]);
    inputs.profile_id = None;
    for effect in effects() {
        let mut view = subsurface::View::new();
        let good = inputs.frame();
        view.prepare(&gpu.device, &gpu.queue, effect, &good).unwrap();
        let mut bad = good;
        bad.mm_per_unit = -1.0;
        view.prepare(&gpu.device, &gpu.queue, effect, &bad).unwrap_err();
        gpu.run(|encoder| view.render(encoder, &inputs.output)).unwrap();
        for (i, pixel) in gpu.read(&inputs.output).iter().enumerate() {
            // Light has crossed the edge.
            let beside = (6..10).contains(&(i % SIZE[0] as usize));
            assert!(!beside || pixel[0] > 0.01 && pixel[0] < 0.99, "{i}");
        }
    }
}

#[test]
fn the_atlas_is_checked_too() {
    let gpu = gpu();
    let effect = TextureSpace::new(&gpu.device, HALF, &[Profile::SKIN]).unwrap();
    let mut atlas_view = AtlasView::new();
    let irradiance = view(HALF);
    let mut prepare = |positions: &TextureView, mm_per_unit: f32| {
        let mut atlas = Atlas::new(&irradiance, positions);
        atlas.mm_per_unit = mm_per_unit;
        atlas_view.prepare(&gpu.device, &gpu.queue, &effect, &atlas)
    };
    let positions = view(TextureFormat::Rgba32Float);
    prepare(&positions, 1000.0).unwrap();
    let error = prepare(&view(TextureFormat::R8Uint), 1000.0).unwrap_err();
    assert_names(&error, "positions: format");
    assert_names(&prepare(&positions, 0.0).unwrap_err(), "mm_per_unit");
    let render = |output: &TextureView| gpu.run(|encoder| atlas_view.render(encoder, output));
    assert_names(&render(&irradiance).unwrap_err(), "output");
    render(&view(HALF)).unwrap();
}

#[test]
fn nothing_is_drawn_before_the_first_frame() {
    let gpu = gpu();
    let output = view(HALF);
    let results = gpu.run(|encoder| {
        [subsurface::View::new().render(encoder, &output), AtlasView::new().render(encoder, &output)]
    });
    assert_eq!(results, [Err(Error::NotPrepared), Err(Error::NotPrepared)]);
}

#[test]
fn sizes_may_change_from_frame_to_frame() {
    let gpu = gpu();
    for effect in effects() {
        let mut view = subsurface::View::new();
        for size in [[16, 8], [1, 1], [1, 40], [33, 7], [16, 8]] {
            let target = |format| gpu.target("input", size, format);
            let (irradiance, depth) = (target(HALF), target(TextureFormat::Depth32Float));
            let projection = View::perspective(size, 40.0).projection.as_mat4();
            let frame = Frame::new(&irradiance, &depth, projection.to_cols_array_2d());
            view.prepare(&gpu.device, &gpu.queue, effect, &frame).unwrap();
            gpu.run(|encoder| view.render(encoder, &target(HALF))).unwrap();
        }
    }
}
