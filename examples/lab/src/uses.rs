//! How often each shader runs on the built-in head: `examples/lab/uses.txt`, from which tools that know what a
//! shader costs on a GPU make the time of a frame. Tiles are counted on the lists by which the device draws.
//! Says, too, how far the plans are from the exact sum.

use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;

use glam::{DVec2, DVec3};
use subsurface::{Plan, Profile};
use wgpu::TextureFormat;

use crate::Error;
use crate::method::{Ours, scatter};
use crate::metrics::{self, Layer};
use crate::output;
use crate::renderer::{BackRenderer, Camera, Gpu, Lighting, Renderer, Scene, View};

/// The view that is there for the layer behind; of other methods it has the one that plans are held to.
const FROM_BEHIND: &str = "ear, lit from behind";
const SIZE: [u32; 2] = [512, 512];
const MM_PER_UNIT: f32 = 1000.0;
/// Side of a tile, in pixels.
const TILE: u32 = 8;
/// Words of an indirect draw, and draws of a level.
const DRAW_WORDS: usize = 4;
const KINDS: usize = 2;
/// What a pixel that is left at once costs of `pack`, which is counted by the compiler's own estimate.
const LEAVES_AT_ONCE: u32 = 5;
/// Pixels of a thread of `pack` and `pack back`, in a loop; and how many the compiler's estimate takes that for.
const TOGETHER: u32 = 4;
const GUESSED_ROUNDS: u32 = 8;

pub fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Error> {
    let gpu = Gpu::headless()?;
    let scene = Scene::from_glb(crate::HEAD)?;
    let renderer = Renderer::new(&gpu, &scene, SIZE)?;
    let mut text = String::from(
        "# View; method; pass; threads on skin and elsewhere; flags; trips of its loops. Before them, of each\n\
         # view: its name, its skin pixels. The built-in head at 512x512. Written by\n\
         # cargo run --release --example uses\n",
    );
    let back = BackRenderer::new(&gpu, &renderer);
    for (name, view, lighting) in [
        ("front", View::Front, Lighting::default()),
        ("close-up", View::CloseUp, Lighting::default()),
        (FROM_BEHIND, View::Ear, Lighting::behind()),
    ] {
        let camera = Camera::framing(&scene, view, SIZE);
        renderer.render(&gpu, &camera, &lighting, MM_PER_UNIT)?;
        back.render(&gpu, &renderer);
        let seen = Seen::new(&gpu, &renderer, &camera, &back)?;
        text += &seen.uses(&gpu, name)?;
    }
    let folder = Path::new("examples/lab");
    output::write(folder, &[("uses.txt".into(), text.into_bytes())])
        .map_err(|error| Error::new("examples/lab", error, "a checkout of the project to run in"))
}

/// A frame, and what is counted of it.
struct Seen<'a> {
    renderer: &'a Renderer,
    frame: subsurface::Frame<'a>,
    back: &'a BackRenderer,
    /// Columns of pixels: whether each is skin.
    is_skin: Vec<bool>,
    /// Points in mm, in view space.
    points: Vec<DVec3>,
    exact: Layer,
    /// Pixels of tiles of level 1 that are not all skin.
    copied: u32,
    /// Between two rays, a mm before the camera.
    ray_step: f64,
}

impl<'a> Seen<'a> {
    fn new(
        gpu: &Gpu,
        renderer: &'a Renderer,
        camera: &Camera,
        back: &'a BackRenderer,
    ) -> Result<Self, Error> {
        let projection = camera.projection(SIZE);
        let frame = renderer.gbuffer.frame(projection, MM_PER_UNIT);
        let ids: Vec<u8> = gpu.read_bytes(renderer.gbuffer.profile_id.texture());
        let inverse = projection.as_dmat4().inverse();
        let depth = gpu.read_bytes(renderer.gbuffer.depth.texture());
        let depth = depth.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let size = DVec2::new(SIZE[0].into(), SIZE[1].into());
        let point = |(i, d): (usize, f32)| {
            let at = DVec2::new((i as u32 % SIZE[0]).into(), (i as u32 / SIZE[0]).into()) + 0.5;
            let ndc = (2.0 * at / size - 1.0) * DVec2::new(1.0, -1.0);
            inverse.project_point3(ndc.extend(f64::from(d))) * f64::from(MM_PER_UNIT)
        };
        let exact = scattered(gpu, renderer, &frame, &Plan::exact(&[Profile::SKIN])?)?.1;
        let is_skin: Vec<bool> = ids.iter().map(|id| *id == 1).collect();
        let is_copied = |tile: &[u32; 2]| pixels_of(*tile, 2 * TILE).any(|pixel| !is_skin[pixel]);
        let copied = tiles(2 * TILE).filter(is_copied).count() as u32 * 4 * TILE * TILE;
        Ok(Self {
            renderer,
            frame,
            back,
            copied,
            points: (0..).zip(depth).map(point).collect(),
            is_skin,
            exact,
            ray_step: 2.0 * f64::from(camera.fov_y / 2.0).tan() / size.y,
        })
    }

    fn uses(&self, gpu: &Gpu, view: &str) -> Result<String, Error> {
        let skin = self.is_skin.iter().filter(|is| **is).count();
        let has_skin = |tile: &[u32; 2]| pixels_of(*tile, TILE).any(|pixel| self.is_skin[pixel]);
        let on = tiles(TILE).filter(has_skin).count() as u32 * TILE * TILE;
        let off = SIZE[0] * SIZE[1] - on;
        let mut uses = Uses { text: format!("view {view}; {skin}\n"), view };
        for (error, plan) in [("1/100", Plan::skin_fast()), ("1/255", Plan::skin())] {
            let (ours, layer) = scattered(gpu, self.renderer, &self.frame, &plan)?;
            self.say_error(view, error, &layer);
            let counted = Counted::new(gpu, &ours)?;
            self.plan(&mut uses, &format!("plan {error}"), error, &plan, &counted, [on, off]);
            if view != FROM_BEHIND {
                self.plan(&mut uses, &format!("plan {error}, in place"), error, &plan, &counted, [on, off]);
            }
            let mut frame = self.frame;
            frame.back = Some(self.back.layer());
            let counted = Counted::new(gpu, &scattered(gpu, self.renderer, &frame, &plan)?.0)?;
            self.plan(&mut uses, &format!("plan {error}, two layers"), error, &plan, &counted, [on, off]);
        }
        if view == FROM_BEHIND {
            uses.separable("separable 17", 17, on, off);
        } else {
            uses.exact(on, off, self.px_per_mm());
            uses.rivals(on, off);
        }
        Ok(uses.text)
    }

    /// The passes of a plan.
    fn plan(
        &self,
        uses: &mut Uses,
        method: &str,
        error: &str,
        plan: &Plan,
        counted: &Counted,
        [on, off]: [u32; 2],
    ) {
        if !method.ends_with("in place") {
            uses.add(method, "copy tiles", self.copied, 0, "", "");
        }
        let [rounds_on, rounds_off] = [on, off / LEAVES_AT_ONCE].map(|threads| threads / GUESSED_ROUNDS);
        uses.add(method, "pack", rounds_on, rounds_off, "guess", "");
        let threads = |l: usize| counted.levels[l][0] * counted.levels[l][1] * TILE * TILE;
        for (l, tiles) in counted.back.iter().enumerate() {
            let on_back = tiles.iter().filter(|holds| **holds != 0).count() as u32 * TILE * TILE;
            // Tiles without skin are left at once.
            if l == 0 {
                let [on_back, rest] = [on_back, on - on_back].map(|threads| threads / TOGETHER);
                uses.add(method, "pack back", on_back, rest, "", &TOGETHER.to_string());
            } else {
                uses.add(method, "halve back", on_back, threads(l) - on_back, "", "");
            }
        }
        let tiles: u32 = counted.levels.iter().map(|[x, y]| x * y).sum();
        let listed: u32 = counted.tiles.iter().flatten().sum();
        uses.add(method, "list", listed, tiles - listed, "guess", "");
        let pixels = |level: usize, kind: usize| counted.tiles[level][kind] * TILE * TILE;
        let planar = pixels(0, 0);
        // Tiles do not say whether the square is summed in them: a share of the planar pixels, as the rows say.
        let square = (f64::from(planar) * self.share_with_square(plan)) as u32;
        let trips = |level: usize, tiles: &[[u32; 2]], has_back: bool| {
            self.trips(plan, level, tiles, has_back).map(|t| format!("{t:.2}")).to_vec()
        };
        let (thin, direct): (Vec<_>, Vec<_>) =
            counted.direct[0].iter().partition(|tile| counted.has_back_near(**tile));
        for (kind, on, tiles) in [
            ("planar", planar - square, &[][..]),
            ("planar square", square, &[]),
            ("direct", direct.len() as u32 * TILE * TILE, &direct),
            ("direct, two layers", thin.len() as u32 * TILE * TILE, &thin),
        ] {
            if on > 0 {
                let trips = if tiles.is_empty() {
                    String::new()
                } else {
                    trips(0, tiles, kind.ends_with("layers")).join(" ")
                };
                uses.add(method, &format!("frame {kind} {error}"), on, 0, "tiles", &trips);
            }
        }
        for level in 1..counted.levels.len() {
            for (kind, on) in [("planar", pixels(level, 0)), ("direct", pixels(level, 1))] {
                if on > 0 {
                    // A level sums its own Gaussians alone.
                    let trips = match kind {
                        "direct" => trips(level, &counted.direct[level], false)[1..].join(" "),
                        _ => String::new(),
                    };
                    uses.add(method, &format!("down {kind}"), on, 0, "tiles", "");
                    uses.add(method, &format!("level {kind} {error}"), on, 0, "tiles", &trips);
                }
            }
        }
    }

    fn say_error(&self, view: &str, error: &str, layer: &Layer) {
        let rmse = metrics::relative_rmse(layer, &self.exact, &self.is_skin).unwrap_or(f64::NAN);
        let mut off: Vec<f64> = (layer.pixels.iter().zip(&self.exact.pixels).zip(&self.is_skin))
            .filter(|(_, is_skin)| **is_skin)
            .map(|((a, b), _)| (0..3).map(|c| f64::from((a[c] - b[c]).abs())).fold(0.0, f64::max))
            .collect();
        off.sort_by(f64::total_cmp);
        let at = |share: f64| off[((off.len() - 1) as f64 * share) as usize];
        println!(
            "{view}, {error} beside the exact sum: {:.3} % rel. RMSE, 99.9 % within {:.4}, all within {:.3}",
            100.0 * rmse,
            at(0.999),
            at(1.0)
        );
    }

    /// The rows of weights that a pixel lies between, and M there, in mm²: M₀₀, M₀₁, M₁₁.
    fn scale(&self, plan: &Plan, pixel: usize) -> Scale {
        let difference = |step: usize| {
            let (first, last) = (pixel.saturating_sub(step), (pixel + step).min(self.points.len() - 1));
            (self.points[last] - self.points[first]) / 2.0
        };
        let (dx, dy) = (difference(1), difference(SIZE[0] as usize));
        let (m00, m01, m11) = (dx.dot(dx), dx.dot(dy), dy.dot(dy));
        // As `scale_of` in shaders/pyramid/blur.wgsl.
        let off = (0.5 * (m00 - m11)).hypot(m01);
        let (large, small) = (0.5 * (m00 + m11) + off, (0.5 * (m00 + m11) - off).max(1e-4 * m00));
        let mm2 = large / (large / small).sqrt().min(NARROWEST);
        let rows = plan.rows(0);
        let next = rows.partition_point(|row| f64::from(row.px_per_mm) < mm2.sqrt().recip());
        Scale { mm2, m: [m00, m01, m11], rows: [next.saturating_sub(1), next.min(rows.len() - 1)] }
    }

    /// Of a surface that faces the camera where the skin is nearest.
    fn px_per_mm(&self) -> f64 {
        let z = self.points.iter().zip(&self.is_skin).filter(|(_, is)| **is).map(|(p, _)| -p.z);
        (z.fold(f64::MAX, f64::min) * self.ray_step).recip()
    }

    /// How often the loops of direct.wgsl go round in direct tiles of a level: for each pixel the Gaussians that
    /// are summed, of each its rows, of each its pairs of taps.
    fn trips(&self, plan: &Plan, level: usize, tiles: &[[u32; 2]], has_back: bool) -> [f64; 3] {
        let skin = tiles
            .iter()
            .flat_map(|tile| pixels_of(*tile, TILE << level))
            .filter(|pixel| self.is_skin[*pixel]);
        let sums: Vec<Vec<[f64; 2]>> = skin.map(|pixel| self.sums(plan, level, pixel, has_back)).collect();
        let total = |i: usize| sums.iter().flatten().map(|sum| sum[i]).sum::<f64>();
        let count: usize = sums.iter().map(Vec::len).sum();
        // Of nothing that is summed there are no rows.
        let mean = |sum: f64, count: f64| if count > 0.0 { sum / count } else { 0.0 };
        [mean(count as f64, sums.len() as f64), mean(total(0), count as f64), mean(total(1), total(0))]
    }

    /// Rows and pairs of taps of the Gaussians that are summed directly at a pixel, as `gathered` in direct.wgsl has
    /// it; on a level as `fs_level` does, with the frame's pixels for those of the level.
    fn sums(&self, plan: &Plan, on_level: usize, pixel: usize, has_back: bool) -> Vec<[f64; 2]> {
        let Scale { mm2, m, rows: [row, next] } = self.scale(plan, pixel);
        let (row, next) = (&plan.rows(0)[row], &plan.rows(0)[next]);
        let at = DVec2::new((pixel as u32 % SIZE[0]).into(), (pixel as u32 / SIZE[0]).into()) + 0.5;
        let facing_mm = -self.points[pixel].z * self.ray_step;
        let weights: Vec<[f64; 3]> = (row.weights.iter().zip(&next.weights))
            .map(|(a, b)| [0, 1, 2].map(|c| 0.5 * f64::from(a[c] + b[c])))
            .collect();
        let blurs: Vec<_> = plan.blurs().into_iter().zip(weights).skip(1).collect();
        let together = |a: &((usize, f64), _), b: &((usize, f64), _)| {
            let ((la, va), (lb, vb)) = (a.0, b.0);
            la == lb && (la > 0 || (va < WIDE_PX2) == (vb < WIDE_PX2))
        };
        let mut sums = Vec::new();
        for step in blurs.chunk_by(together) {
            let level = step[0].0.0;
            let channel = |c: usize| {
                let weight: f64 = step.iter().map(|(_, w)| w[c]).sum();
                let moment: f64 = step.iter().map(|((_, v), w)| v * w[c]).sum();
                (weight, moment / weight.max(1e-6))
            };
            let channels = [0, 1, 2].map(channel);
            if on_level > 0 && level != on_level {
                continue;
            }
            if level > next.level || channels.iter().all(|(weight, _)| *weight <= LEAST_WEIGHT) {
                continue;
            }
            let variance = channels.iter().map(|(_, mean)| *mean).fold(0.0, f64::max);
            let side = f64::powi(2.0, level as i32);
            // A level's light goes down, and up again.
            let ways = if on_level > 0 { 0.5 } else { 0.25 };
            let own = ways * (1.0 - 1.0 / (side * side));
            let mm = facing_mm * side;
            let variance_px2 = variance * mm2 * side * side / (mm * mm) - own;
            let slow = SLOW[usize::from(level > 0)];
            let apart = if !has_back && fall(variance * mm2, m, own) < slow { 2 } else { 1 };
            let part = if apart > 1 { SPARSE_TAPS } else { TAPS };
            let reach = (part * (CUT * variance_px2.max(0.15)).sqrt()).min(REACH);
            let center = at / side - 0.5;
            let last = (DVec2::new(SIZE[0].into(), SIZE[1].into()) / side).floor() - 1.0;
            let (first, end) =
                ((center - reach).ceil().max(DVec2::ZERO), (center + reach).floor().min(last));
            let parity = center.x.round() as i32 + center.y.round() as i32;
            let (mut rows, mut pairs) = (0.0, 0.0);
            for y in first.y as i32..=end.y as i32 {
                let half = (reach * reach - (f64::from(y) - center.y).powi(2)).max(0.0).sqrt();
                rows += 1.0;
                let first = (center.x - half).ceil().max(0.0) as i32;
                let first = first + ((first + y + parity) & (apart - 1));
                let row = (center.x + half).floor().min(last.x) - f64::from(first) + 1.0;
                pairs += (0.5 * row.max(0.0) / f64::from(apart)).ceil();
            }
            sums.push([rows, pairs]);
        }
        sums
    }

    /// Which share of the skin sums the square of the frame.
    fn share_with_square(&self, plan: &Plan) -> f64 {
        let blurs = plan.blurs();
        let is_square = |(level, variance): &(usize, f64)| *level == 0 && *variance >= WIDE_PX2;
        let Some(square) = blurs.iter().position(is_square) else { return 0.0 };
        let rows = plan.rows(0);
        let sums = |pixel: &usize| {
            self.scale(plan, *pixel).rows.iter().any(|row| rows[*row].weights[square] != [0.0; 3])
        };
        let skin: Vec<usize> = (0..self.points.len()).filter(|pixel| self.is_skin[*pixel]).collect();
        skin.iter().copied().filter(|pixel| sums(pixel)).count() as f64 / skin.len() as f64
    }
}

/// k₀₀ + k₁₁ of `on_plane` in direct.wgsl.
fn fall(variance_mm2: f64, [m00, m01, m11]: [f64; 3], own: f64) -> f64 {
    let by = variance_mm2 / (m00 * m11 - m01 * m01).max(1e-30);
    let c = [by * m11 - own, by * m00 - own].map(|c| c.max(0.02));
    // Of the frame, which nothing blurred before.
    let widened = if own == 0.0 { c.map(|c| c.max(0.13 + 0.37 * c)) } else { c };
    let product = widened[0] * widened[1];
    let most = 0.98 * product.sqrt();
    let off = (-by * m01 * (product / (c[0] * c[1])).sqrt()).clamp(-most, most);
    (widened[0] + widened[1]) / (CUT * (product - off * off))
}

struct Scale {
    /// That a variance of one square pixel stands for.
    mm2: f64,
    /// M₀₀, M₀₁, M₁₁ in mm².
    m: [f64; 3],
    rows: [usize; 2],
}

/// As in shaders/exact/gaussian_sum.wgsl: how far taps reach, and up to which variance a Gaussian is one small
/// kernel. And the share of rows that are not summed again, as was measured on heads.
const REACH_SIGMAS: f64 = 3.5;
const SMALL_PX2: f64 = 0.4;
const ROWS_ONCE: f64 = 2.0 / 3.0;

/// As in shaders/pyramid/direct.wgsl, and `WIDE_PX2` in src/pyramid/scratch.rs.
const REACH: f64 = 6.0;
const CUT: f64 = 8.0;
const TAPS: f64 = 0.8;
const SPARSE_TAPS: f64 = 0.9;
/// On the frame and on levels.
const SLOW: [f64; 2] = [0.25, 0.35];

const LEAST_WEIGHT: f64 = 0.004;
const WIDE_PX2: f64 = 1.0;

/// As in shaders/pyramid/blur.wgsl.
const NARROWEST: f64 = 1.3;

/// The tiles of the frame, `side` pixels wide and high.
fn tiles(side: u32) -> impl Iterator<Item = [u32; 2]> {
    let [columns, rows] = SIZE.map(|s| s / side);
    (0..rows).flat_map(move |y| (0..columns).map(move |x| [x, y]))
}

/// The pixels of one.
fn pixels_of([x, y]: [u32; 2], side: u32) -> impl Iterator<Item = usize> {
    let pixels = (0..side * side).map(move |i| [x * side + i % side, y * side + i / side]);
    pixels.filter(|[x, y]| *x < SIZE[0] && *y < SIZE[1]).map(|[x, y]| index(x, y))
}

fn index(x: u32, y: u32) -> usize {
    (y * SIZE[0] + x) as usize
}

fn scattered(
    gpu: &Gpu,
    renderer: &Renderer,
    frame: &subsurface::Frame,
    plan: &Plan,
) -> Result<(Ours, Layer), Error> {
    let output = renderer.scattered_target(gpu);
    let mut ours = Ours::new(&gpu.device, TextureFormat::Rgba16Float, plan)?;
    scatter(gpu, &mut ours, frame, &output)?;
    let pixels = gpu.read(&output).iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
    Ok((ours, Layer { width: SIZE[0], height: SIZE[1], pixels }))
}

/// Tiles, as the device listed them.
struct Counted {
    /// Of each level the planar ones, and those that are summed directly.
    tiles: Vec<[u32; KINDS]>,
    /// Columns and rows of tiles of each level.
    levels: Vec<[u32; 2]>,
    /// The latter, of each level.
    direct: Vec<Vec<[u32; 2]>>,
    /// What the tiles of each level hold of a back layer; empty without one.
    back: Vec<Vec<u32>>,
}

impl Counted {
    fn new(gpu: &Gpu, ours: &Ours) -> Result<Self, Error> {
        let tiles = ours.view.tiles().ok_or(subsurface::Error::NoPyramid)?;
        let words =
            |buffer: &wgpu::Buffer| -> Vec<u32> { bytemuck::pod_collect_to_vec(&gpu.read_buffer(buffer)) };
        let draws = words(tiles.draws);
        let draws: Vec<u32> = draws.chunks_exact(DRAW_WORDS).map(|draw| draw[1]).collect();
        let counts: Vec<[u32; KINDS]> = draws.chunks_exact(KINDS).map(|d| [d[0], d[1]]).collect();
        let list = words(tiles.list);
        let mut rest = &list[..];
        let mut direct = Vec::new();
        for ([columns, rows], count) in tiles.levels.iter().zip(&counts) {
            let (level, others) = rest.split_at((columns * rows) as usize);
            let last = level.iter().rev().take(count[1] as usize);
            direct.push(last.map(|word| [word & 0xffff, word >> 16]).collect());
            rest = others;
        }
        Ok(Self {
            direct,
            back: tiles.back.map_or(vec![], |back| {
                let mut words = words(back).into_iter();
                let of_level = |[x, y]: &[u32; 2]| words.by_ref().take((x * y) as usize).collect();
                tiles.levels.iter().map(of_level).collect()
            }),
            tiles: counts,
            levels: tiles.levels,
        })
    }
}

impl Counted {
    /// Whether a tile of the frame is summed over two layers: `BACK_NEAR` of pack_back.wgsl.
    fn has_back_near(&self, [x, y]: [u32; 2]) -> bool {
        self.back.first().is_some_and(|tiles| tiles[(y * self.levels[0][0] + x) as usize] & 1 != 0)
    }
}

/// The lines of a view.
struct Uses<'a> {
    text: String,
    view: &'a str,
}

impl Uses<'_> {
    fn add(&mut self, method: &str, pass: &str, on: u32, off: u32, flags: &str, trips: &str) {
        let view = self.view;
        writeln!(self.text, "{view}; {method}; {pass}; {on}; {off}; {flags}; {trips}")
            .expect("strings grow");
    }

    /// The exact sum, whose passes cover the frame.
    fn exact(&mut self, on: u32, off: u32, px_per_mm: f64) {
        self.add("exact", "exact positions", on, off, "", "");
        self.add("exact", "exact source", on, off, "", "");
        for gaussian in Profile::SKIN.gaussians() {
            let variance_px2 = f64::from(gaussian.variance_mm2) * px_per_mm * px_per_mm;
            let taps = 2.0 * (REACH_SIGMAS * variance_px2.sqrt()).ceil() + 1.0;
            self.add("exact", "exact rows", on, off, "", &format!("{taps}"));
            // A small one is nine taps; of the others about two thirds of the rows stay in the plane.
            let trips = match variance_px2 <= SMALL_PX2 {
                true => "2 9 0 0 0".into(),
                false => format!("2 0 {:.6} 0 0", taps * ROWS_ONCE),
            };
            self.add("exact", "exact sum", on, off, "", &trips);
        }
        self.add("exact", "exact resolve", on, off, "", "0 0 0");
    }

    /// Methods of others: over the frame, which they leave early where there is no skin, and over tiles.
    fn rivals(&mut self, on: u32, off: u32) {
        for taps in [11, 17, 25] {
            let method = format!("separable {taps}");
            self.separable(&method, taps, on, off);
        }
        self.add("jimenez_2009", "packed, copying", on, off, "", "");
        for _ in 0..3 {
            self.add("jimenez_2009", "jimenez_2009 rows", on, off, "", "");
            self.add("jimenez_2009", "jimenez_2009 columns", on, off, "", "");
        }
        for samples in [20, 40, 80] {
            let method = format!("burley_disk {samples}");
            self.add(&method, "packed", on, off, "", "");
            self.add(&method, &method, on, off, "", "0");
        }
        for taps in [11, 17] {
            self.separable(&format!("separable {taps}, tiles, in place"), taps, on, 0);
            let method = format!("separable {taps}, tiles");
            self.add(&method, "copy", on, off, "", "");
            self.separable(&method, taps, on, 0);
        }
    }

    fn separable(&mut self, method: &str, taps: u32, on: u32, off: u32) {
        self.add(method, "packed", on, off, "", "");
        self.add(method, &format!("separable {taps} rows"), on, off, "", "");
        self.add(method, &format!("separable {taps} columns"), on, off, "", "");
    }
}
