//! The truths against closed forms, and against each other.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3, Vec3};
use subsurface::Profile;
use subsurface_lab::synthetic::*;
use subsurface_lab::truth::closed_form::{
    legendre, passed_harmonics, passed_wave, scattered_cosine, scattered_cosine_around, scattered_spot,
    scattered_step, step, through_slab,
};
use subsurface_lab::truth::{Patch, Place, SurfaceIntegral, Triangles, surface_integral};

/// What a truth may be off by.
const EXACT: f64 = 0.0005;

#[derive(Default)]
struct Mesh {
    vertices_mm: Vec<Vec3>,
    indices: Vec<u32>,
}

impl Mesh {
    /// A grid of quads over the unit square, each cut in two.
    fn grid(columns: u32, rows: u32, point: impl Fn(f64, f64) -> DVec3) -> Self {
        let mut mesh = Self::default();
        for j in 0..=rows {
            for i in 0..=columns {
                let [u, v] = [i as f64 / columns as f64, j as f64 / rows as f64];
                mesh.vertices_mm.push(point(u, v).as_vec3());
                if i < columns && j < rows {
                    let a = j * (columns + 1) + i;
                    let b = a + columns + 1;
                    mesh.indices.extend([a, a + 1, b + 1, a, b + 1, b]);
                }
            }
        }
        mesh
    }

    /// A square of this side around a point, turned.
    fn square(side_mm: f64, center: DVec3, turn: DMat3) -> Self {
        Self::grid(1, 1, |u, v| center + turn * DVec3::new((u - 0.5) * side_mm, (v - 0.5) * side_mm, 0.0))
    }

    /// The part of a sphere within `half` radians of an axis, both ways: at π/4 a sixth of it.
    fn cap(rho_mm: f64, axis: DVec3, half: f64, rows: u32) -> Self {
        let (right, up) = axis.any_orthonormal_pair();
        let at = |share: f64| ((2.0 * share - 1.0) * half).tan();
        Self::grid(rows, rows, |u, v| rho_mm * (axis + at(u) * right + at(v) * up).normalize())
    }

    fn sphere(rho_mm: f64, rows: u32) -> Self {
        let axes = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
        axes.fold(Self::default(), |mesh, axis| mesh.and(Self::cap(rho_mm, axis, PI / 4.0, rows)))
    }

    /// Drops the triangles whose middle is not wanted.
    fn keep(&mut self, wanted: impl Fn(Vec3) -> bool) {
        let triangles = self
            .indices
            .chunks_exact(3)
            .filter(|t| wanted(t.iter().map(|i| self.vertices_mm[*i as usize]).sum::<Vec3>() / 3.0));
        self.indices = triangles.flatten().copied().collect();
    }

    fn shift(&mut self, by: DVec3) {
        for p in &mut self.vertices_mm {
            *p += by.as_vec3();
        }
    }

    fn and(mut self, other: Self) -> Self {
        let first = self.vertices_mm.len() as u32;
        self.vertices_mm.extend(other.vertices_mm);
        self.indices.extend(other.indices.iter().map(|i| first + i));
        self
    }

    fn point(&self, place: &Place) -> DVec3 {
        let corners = &self.indices[3 * place.triangle..][..3];
        let shares = place.barycentric.to_array();
        let terms = corners.iter().zip(shares);
        terms.map(|(&i, s)| (self.vertices_mm[i as usize] * s).as_dvec3()).sum()
    }

    /// The surface integral by the skin profile, of light that its points tell.
    fn integral(&self, asked: &[DVec3], light: impl Fn(DVec3) -> f64) -> SurfaceIntegral {
        let asked: Vec<Patch> = asked
            .iter()
            .map(|p| Patch { point_mm: p.as_vec3(), area_mm2: 0.0, irradiance: Vec3::ZERO })
            .collect();
        let mesh = Triangles { vertices_mm: &self.vertices_mm, indices: &self.indices };
        let lit = |places: &[Place]| -> Result<_, ()> {
            let e = places.iter().map(|p| Vec3::splat(light(self.point(p)) as f32));
            Ok(e.collect())
        };
        surface_integral(mesh, &asked, &Profile::SKIN, 1.0, lit, &|_| ()).unwrap()
    }
}

/// The largest difference of any channel, said and held to what is exact.
fn assert_exact(what: &str, found: &[Vec3], expected: impl IntoIterator<Item = DVec3>) {
    assert_within(EXACT, what, found, expected);
}

fn assert_within(tolerance: f64, what: &str, found: &[Vec3], expected: impl IntoIterator<Item = DVec3>) {
    let pairs = found.iter().zip(expected);
    let worst = pairs.map(|(f, e)| (f.as_dvec3() - e).abs().max_element());
    let worst = largest(worst);
    println!("{what}: max error {worst:.6}");
    assert!(worst <= tolerance, "{what}: {worst}");
}

/// Narrow Gaussians on pixels: .00052 measured, at 5 px/mm, since weights that are not negative
/// cannot pass two waves as a Gaussian does.
const ON_PIXELS: f64 = 0.0006;

/// Places across an edge, off any lattice.
fn across_edge() -> Vec<f64> {
    (-40..=40).map(|i| 0.0137 + 0.2 * f64::from(i)).collect()
}

/// A disc that scatters by one Gaussian, seen `r` from its middle: ∫₀ᴿ s/v e^(−(r²+s²)/2v) I₀(rs/v) ds.
fn disc(r: f64, radius: f64, v: f64) -> f64 {
    // Both integrals by midpoints, the inner one over a period, where they converge at once.
    const STEPS: usize = 300;
    let ds = radius / STEPS as f64;
    let ring = |s: f64| {
        let i0 = |x: f64| {
            let angle = |k: usize| PI * (k as f64 + 0.5) / 200.0;
            (0..400).map(|k| (x * (angle(k).cos() - 1.0)).exp()).sum::<f64>() / 400.0
        };
        s / v * (-(r - s).powi(2) / (2.0 * v)).exp() * i0(r * s / v)
    };
    (0..STEPS).map(|k| ring((k as f64 + 0.5) * ds) * ds).sum()
}

fn scattered_disc(r: f64, radius: f64, blur_mm2: f64) -> DVec3 {
    let gaussians = Profile::SKIN.gaussians().iter();
    let terms = gaussians.map(|g| {
        DVec3::from(g.weight.map(f64::from)) * disc(r, radius, f64::from(g.variance_mm2) + blur_mm2)
    });
    terms.sum()
}

#[test]
fn the_surface_integral_knows_edges_at_any_angle_and_tilt() {
    let xs = across_edge();
    for (angle, tilt) in [(0.0, 0.0), (27.0, 0.0), (45.0, 0.0), (90.0, 0.0), (20.0, 70.0)] {
        let turn = DMat3::from_rotation_x(f64::to_radians(tilt));
        let across = turn * direction(angle);
        let mesh = Mesh::square(60.0, DVec3::ZERO, turn);
        let asked: Vec<_> = xs.iter().map(|x| *x * across).collect();
        for blur_mm2 in [0.01, 0.04] {
            let found = mesh.integral(&asked, |p| step(p.dot(across), blur_mm2));
            let expected = || xs.iter().map(|x| scattered_step(*x, blur_mm2, &Profile::SKIN));
            let what = format!("edge at {angle}°, tilted by {tilt}°, soft by {blur_mm2} mm²");
            assert_exact(&what, &found.printed, expected());
            assert_exact(&what, &found.normalised, expected());
        }
    }
}

#[test]
fn the_surface_integral_knows_a_disc() {
    let rs: Vec<f64> = (0..40).map(|i| 0.11 * f64::from(i)).collect();
    let (radius, blur) = (1.5, 0.04);
    let asked: Vec<_> = rs.iter().map(|r| DVec3::new(0.6, 0.8, 0.0) * *r).collect();
    // The blurred disc itself, from a table: a patch asks for it millions of times.
    let table: Vec<f64> = (0..400).map(|i| disc(0.01 * f64::from(i), radius, blur)).collect();
    let light = |p: DVec3| {
        let at = (p.length() / 0.01).min(398.0);
        let i = at as usize;
        table[i] + (at - i as f64) * (table[i + 1] - table[i])
    };
    let found = Mesh::square(60.0, DVec3::ZERO, DMat3::IDENTITY).integral(&asked, light);
    let expected = || rs.iter().map(|r| scattered_disc(*r, radius, blur));
    assert_exact("disc", &found.printed, expected());
    assert_exact("disc, normalised", &found.normalised, expected());
}

#[test]
fn the_surface_integral_knows_spheres_past_the_terminator() {
    let light = DVec3::new(0.6, 0.0, 0.8);
    // Around the terminator, where a patch of the large one will do.
    let pole = DVec3::new(0.8, 0.0, -0.6);
    for (rho_mm, mesh, half) in
        [(10.0, Mesh::sphere(10.0, 100), 1.5), (100.0, Mesh::cap(100.0, pole, 0.35, 60), 0.2)]
    {
        let asked: Vec<_> = (-30..=30)
            .map(|i| DMat3::from_rotation_y(half * f64::from(i) / 30.0) * pole * rho_mm)
            .collect();
        let truth = scattered_cosine(rho_mm, &Profile::SKIN);
        let found = mesh.integral(&asked, |p| p.normalize().dot(light).max(0.0));
        let expected = || asked.iter().map(|p| truth(p.dot(light) / rho_mm));
        assert_exact(&format!("sphere of {rho_mm} mm"), &found.printed, expected());
        assert_exact(&format!("sphere of {rho_mm} mm, normalised"), &found.normalised, expected());
    }
}

#[test]
fn the_surface_integral_knows_a_cylinder() {
    let rho_mm = 8.0;
    let on = |phi: f64, z: f64| DVec3::new(rho_mm * phi.cos(), rho_mm * phi.sin(), z);
    let mesh = Mesh::grid(400, 480, |u, v| on(u * TAU, 60.0 * (v - 0.5)));
    let phis: Vec<f64> = (0..60).map(|i| 0.05 * f64::from(i)).collect();
    let asked: Vec<_> = phis.iter().map(|phi| on(*phi, 0.3)).collect();
    let found = mesh.integral(&asked, |p| (p.x / rho_mm).max(0.0));
    // ρ√(1/2πv) ∫ E(φ′) e^(q(cos Δφ − 1)) dφ′ with q = ρ²/v, and the same over its mass.
    let scattered = |phi: f64, normalised: bool| -> DVec3 {
        let terms = Profile::SKIN.gaussians().iter().map(|g| {
            let v = f64::from(g.variance_mm2);
            const STEPS: usize = 20_000;
            let (mut light, mut mass) = (0.0, 0.0);
            for k in 0..STEPS {
                let there = TAU * (k as f64 + 0.5) / STEPS as f64;
                let w = (rho_mm * rho_mm / v * ((there - phi).cos() - 1.0)).exp();
                light += there.cos().max(0.0) * w;
                mass += w;
            }
            let unit = TAU / STEPS as f64 * rho_mm / (TAU * v).sqrt();
            DVec3::from(g.weight.map(f64::from)) * if normalised { light / mass } else { light * unit }
        });
        terms.sum()
    };
    assert_exact("cylinder", &found.printed, phis.iter().map(|p| scattered(*p, false)));
    assert_exact("cylinder, normalised", &found.normalised, phis.iter().map(|p| scattered(*p, true)));
    // The series against the sum over angles.
    let series = scattered_cosine_around(rho_mm, &Profile::SKIN);
    for phi in &phis {
        let error = (series(*phi) - scattered(*phi, true)).abs().max_element();
        assert!(error < 1e-6, "{phi}: {error}");
    }
}

#[test]
fn the_surface_integral_knows_layers_and_a_slab_lit_from_behind() {
    for gap_mm in [1.0, 2.0, 5.0, 10.0] {
        // Half a plane, dark, over a whole one, lit.
        let near = Mesh::square(60.0, DVec3::new(-30.0, 0.0, gap_mm), DMat3::IDENTITY);
        let mesh = near.and(Mesh::square(80.0, DVec3::ZERO, DMat3::IDENTITY));
        let xs: Vec<f64> = across_edge().into_iter().filter(|x| *x < -0.01).collect();
        let asked: Vec<_> = xs.iter().map(|x| DVec3::new(*x, 0.1, gap_mm)).collect();
        let found = mesh.integral(&asked, |p| if p.z > 0.5 * gap_mm { 0.0 } else { 1.0 });
        let normalised = |x: f64| -> DVec3 {
            let terms = Profile::SKIN.gaussians().iter().map(|g| {
                let v = f64::from(g.variance_mm2);
                let through = (-gap_mm * gap_mm / (2.0 * v)).exp();
                DVec3::from(g.weight.map(f64::from)) * through / (step(-x, v) + through)
            });
            terms.sum()
        };
        let what = format!("layers {gap_mm} mm apart");
        let [through, _] = through_slab(gap_mm, &Profile::SKIN);
        assert_exact(&what, &found.printed, xs.iter().map(|_| through));
        let what = format!("{what}, normalised");
        assert_exact(&what, &found.normalised, xs.iter().map(|x| normalised(*x)));
    }
}

#[test]
fn a_gaussian_of_no_width_keeps_the_irradiance() {
    let asked = [Patch { point_mm: Vec3::ZERO, area_mm2: 0.0, irradiance: Vec3::new(0.1, 0.2, 0.3) }];
    let mesh = Mesh::square(9.0, DVec3::ZERO, DMat3::IDENTITY);
    let mesh = Triangles { vertices_mm: &mesh.vertices_mm, indices: &mesh.indices };
    let none = |_: &[Place]| -> Result<Vec<Vec3>, ()> { Err(()) };
    let profile = single_gaussian(0.0);
    let found = surface_integral(mesh, &asked, &profile, 1.0, none, &|_| ()).unwrap();
    assert_eq!(found.printed, [asked[0].irradiance]);
    assert_eq!(found.normalised, found.printed);
}

/// The visible integral at some pixels against what each should be.
fn assert_visible(what: &str, g: &GBuffer, pixels: &[(usize, Hit)], expected: impl Fn(&Hit) -> DVec3) {
    let places: Vec<usize> = pixels.iter().map(|(i, _)| *i).collect();
    let found = g.visible_integral(&places, &Profile::SKIN);
    let found: Vec<_> = found.iter().map(|f| f.as_vec3()).collect();
    let expected = pixels.iter().map(|(_, h)| expected(h));
    assert_within(ON_PIXELS, what, &found, expected);
}

#[test]
fn the_visible_integral_knows_soft_edges() {
    for px_per_mm in [0.5, 1.0, 2.0, 5.0, 8.0, 12.0] {
        for angle in [0.0, 20.0, 45.0] {
            let blur_mm2 = f64::powi(px_per_mm, -2);
            let across = direction(angle);
            let side = (28.0 * px_per_mm) as u32 + 16;
            let g = View::orthographic([side, side], px_per_mm)
                .shoot(plane(DVec3::Z, 300.0, |p| DVec3::splat(step(p.dot(across), blur_mm2))));
            // Errors of narrow kernels are at the edge, within a few pixels.
            let near = |h: &Hit| h.point.truncate().abs().max_element() < 5.0 / px_per_mm;
            let what = format!("{px_per_mm} px/mm, edge at {angle}°");
            assert_visible(&what, &g, &g.pixels(near), |h| {
                scattered_step(h.point.dot(across), blur_mm2, &Profile::SKIN)
            });
        }
    }
}

#[test]
fn the_visible_integral_knows_a_tilted_edge_and_a_disc() {
    // Pixels fine enough for the narrowest Gaussian along the slope, too.
    let (px_per_mm, blur_mm2) = (16.0, 0.04);
    let turn = DMat3::from_rotation_x(f64::to_radians(60.0));
    let across = turn * DVec3::new(0.9, 0.436, 0.0).normalize();
    let g = View::orthographic([448, 448], px_per_mm)
        .shoot(plane(turn * DVec3::Z, 300.0, |p| DVec3::splat(step(p.dot(across), blur_mm2))));
    let x = |h: &Hit| (h.point - DVec3::new(0.0, 0.0, -300.0)).dot(across);
    let near = |h: &Hit| x(h).abs() < 3.0 && h.point.truncate().length() < 3.0;
    let pixels: Vec<_> = g.pixels(near).into_iter().step_by(61).collect();
    assert_visible("tilted by 60°", &g, &pixels, |h| scattered_step(x(h), blur_mm2, &Profile::SKIN));

    let (radius, blur_mm2) = (1.5, 0.0625);
    let g = View::orthographic([112, 112], 4.0)
        .shoot(plane(DVec3::Z, 300.0, |p| DVec3::splat(disc(p.length(), radius, blur_mm2))));
    let r = |h: &Hit| h.point.truncate().length();
    let pixels: Vec<_> = g.pixels(|h| r(h) < 3.0).into_iter().step_by(11).collect();
    assert_visible("disc", &g, &pixels, |h| scattered_disc(r(h), radius, blur_mm2));
}

/// The visible integral against the surface integral over the part of a mesh that is seen.
fn assert_same_as_surface(
    what: &str,
    tolerance: f64,
    g: &GBuffer,
    seen: &Mesh,
    pixels: &[(usize, Hit)],
    light: impl Fn(DVec3) -> f64,
) {
    let asked: Vec<_> = pixels.iter().map(|(_, h)| h.point).collect();
    let truth = seen.integral(&asked, light).normalised;
    let places: Vec<usize> = pixels.iter().map(|(i, _)| *i).collect();
    let found = g.visible_integral(&places, &Profile::SKIN);
    let found: Vec<_> = found.iter().map(|f| f.as_vec3()).collect();
    assert_within(tolerance, what, &found, truth.iter().map(|t| t.as_dvec3()));
}

#[test]
fn the_visible_integral_is_the_surface_integral_over_what_is_seen() {
    // Rims, where a pixel shows more surface than it has samples, are left out.
    let facing = |h: &Hit| h.normal.z > 0.3;
    let light = DVec3::new(1.0, 0.3, 1.0).normalize();
    let cosine = |n: DVec3| n.normalize().dot(light).max(0.0);
    let view = View::orthographic([480, 480], 20.0);
    let middle = DVec3::new(0.0, 0.0, -20.0);

    let g = view.shoot(sphere(10.0, 20.0, |n| DVec3::splat(cosine(n))));
    let mut seen = Mesh::sphere(10.0, 100);
    seen.keep(|n| n.z >= 0.0);
    seen.shift(middle);
    let pixels: Vec<_> = g.pixels(facing).into_iter().step_by(53).collect();
    assert_same_as_surface("sphere", EXACT, &g, &seen, &pixels, |p| cosine(p - middle));

    // A cylinder along y, as long as the picture. Its rims lie along columns, where the last pixel's
    // middle stands for a slope that has no bound: .0016 measured; the sphere's rim averages this.
    let g = view.shoot(|origin, _| {
        let z = (64.0 - origin.x * origin.x).max(0.0).sqrt();
        let normal = DVec3::new(origin.x / 8.0, 0.0, z / 8.0);
        (z > 0.0).then(|| Hit {
            point: DVec3::new(origin.x, origin.y, z - 20.0),
            normal,
            irradiance: DVec3::splat(cosine(normal)),
            id: 1,
        })
    });
    let mut seen = Mesh::grid(200, 192, |u, v| {
        let (sin, cos) = ((u - 0.5) * PI).sin_cos();
        DVec3::new(8.0 * sin, 24.0 * (v - 0.5), 8.0 * cos)
    });
    seen.shift(middle);
    let pixels: Vec<_> = g.pixels(facing).into_iter().step_by(83).collect();
    assert_same_as_surface("cylinder", 0.002, &g, &seen, &pixels, |p| {
        cosine(DVec3::new(p.x, 0.0, p.z + 20.0))
    });

    for gap_mm in [2.0, 5.0, 10.0] {
        // Half a plane, dark, over one whose other half is seen, lit.
        let view = View::orthographic([576, 480], 20.0);
        let g = view.shoot(|origin, _| {
            let near = origin.x < 0.0;
            let [z, e] = if near { [gap_mm - 20.0, 0.0] } else { [-20.0, 1.0] };
            Some(Hit {
                point: origin.truncate().extend(z),
                normal: DVec3::Z,
                irradiance: DVec3::splat(e),
                id: 1,
            })
        });
        let half = |x: f64, z: f64| Mesh::grid(1, 1, |u, v| DVec3::new(x + 14.4 * u, 24.0 * (v - 0.5), z));
        let seen = half(-14.4, gap_mm - 20.0).and(half(0.0, -20.0));
        let near = |h: &Hit| h.point.truncate().length() < 6.0;
        let pixels: Vec<_> = g.pixels(near).into_iter().step_by(83).collect();
        let lit = |p: DVec3| if p.z < 0.5 * gap_mm - 20.0 { 1.0 } else { 0.0 };
        assert_same_as_surface(&format!("layers {gap_mm} mm apart"), EXACT, &g, &seen, &pixels, lit);
    }
}

#[test]
fn waves_and_spots_are_what_a_sum_over_the_plane_makes_of_them() {
    // Steps of .3 σ: an integral to 1e-10.
    let sum = |light: &dyn Fn(f64, f64) -> f64, variance_mm2: f64| {
        let h = 0.3 * variance_mm2.sqrt();
        let places = || (-24..=24).map(|i| h * f64::from(i));
        let weight = |x: f64, y: f64| (-(x * x + y * y) / (2.0 * variance_mm2)).exp();
        let (mut mass, mut sum) = (0.0, 0.0);
        for (x, y) in places().flat_map(|y| places().map(move |x| (x, y))) {
            mass += weight(x, y);
            sum += weight(x, y) * light(x, y);
        }
        sum / mass
    };
    let profile = Profile::SKIN;
    let scattered = |light: &dyn Fn(f64, f64) -> f64| -> DVec3 {
        let gaussians = profile.gaussians().iter();
        gaussians.map(|g| DVec3::from(g.weight.map(f64::from)) * sum(light, g.variance_mm2.into())).sum()
    };
    let wave = scattered(&|x, _| (0.9 * x).cos());
    assert!((wave - passed_wave(0.9, &profile)).abs().max_element() < 1e-6);
    let spot = scattered(&|x, y| (-((x + 1.5).powi(2) + y * y) / 2.0).exp());
    let closed = scattered_spot(1.5, 1.0, &profile);
    assert!((spot - closed).abs().max_element() < 1e-6, "{spot} {closed}");
}

#[test]
fn harmonics_are_what_a_sum_over_the_sphere_makes_of_them() {
    // At a pole, where only the height x above the equator counts: chord² = 2ρ²(1 − x).
    let (rho_mm, degree) = (10.0, 24);
    let profile = Profile::SKIN;
    let mean = |variance_mm2: f64| {
        let (mut mass, mut sum) = (0.0, 0.0);
        // Closer towards the pole.
        for i in 0..20_000 {
            let t = (f64::from(i) + 0.5) / 20_000.0;
            let x = 1.0 - 2.0 * t * t;
            let weight = t * (-rho_mm * rho_mm * (1.0 - x) / variance_mm2).exp();
            mass += weight;
            sum += weight * legendre(x).nth(degree).unwrap();
        }
        sum / mass
    };
    let gaussians = profile.gaussians().iter();
    let summed: DVec3 =
        gaussians.map(|g| DVec3::from(g.weight.map(f64::from)) * mean(g.variance_mm2.into())).sum();
    let closed = passed_harmonics(rho_mm, degree + 1, &profile)[degree];
    assert!((summed - closed).abs().max_element() < 1e-5, "{summed} {closed}");
}
