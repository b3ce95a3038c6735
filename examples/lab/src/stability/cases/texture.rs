//! Where texture space fails: seams, stretch, and what shares a texel.

use glam::{DVec2, DVec3, Vec2};

use super::islands::{HALF_MM, Island, Layout, SIDE_MM, Square};
use super::{GRADIENT, STEP, sheet, trial};
use crate::Error;
use crate::method;
use crate::stability::case::{ATLAS, Bound, Case, Figures, PLAN, by_nature, known};
use crate::stability::inputs::Texels;
use crate::stability::lab::Lab;
use crate::stability::scene::{Form, Scene, Surface, from_camera};
use crate::stability::trial::{Crop, Trial, Truth, apart, merge, relative_rms, worst};
use crate::stability::unwrapped::Unwrapped;
use crate::synthetic::{GBuffer, View};

const SEAM: &str = "Passes along u and v end with the island; what lies across its seam is \
    elsewhere in the atlas, and to find it by position would mean to search the atlas for every \
    texel. Lay seams where skin is not seen, or use the exact sum.";

pub fn cases(quick: bool) -> Vec<Case> {
    let mut cases = squares(quick);
    cases.push(cylinder(true, quick));
    cases.push(cylinder(false, quick));
    cases.extend(sheets());
    cases.push(many_heads());
    cases
}

const SEAMS: &str = "A flat square under a soft edge of light (σ of 0.5 mm), cut into two islands \
    that lie apart in the atlas, along the edge or at 27 degrees to it; 0.19 mm a texel \
    (0.12 in full). In all cases of the square the figure is the largest difference in its \
    middle 11x5.6 mm: in screen space, at 5 px/mm (8 in full), to the visible integral; in \
    texture space, fetched bilinearly, to the closed form.";
const STRETCH: &str = "One island, texels of 0.4 by 0.2 mm, or 0.4 by 0.05; the edge at 45 degrees \
    with a σ of 1 mm.";
const SHEAR: &str = "Texels whose sides are at 30 degrees to each other, the edge at 27 degrees.";
const BEHIND: &str = "The square lies mirrored in the atlas, next to an island of another, 100 mm \
    behind it and lit where this one is dark.";
const DRAWN_OVER: &str = "Half of that other square is drawn onto the texels of this one, which \
    `Atlas` asks a host not to do.";
const WIDE_TEXELS: &str = "The edge at 27 degrees, with texels twice as wide as it is soft.";
const STRIP: &str = "The atlas holds a strip across the edge, 2 mm wide; texture space is asked for \
    that alone.";
const ONE_POINT: &str = "A texel has room for one point. Give each surface an atlas of its own, or use \
    the exact sum.";
const COARSE: &str = "Light that is finer than the texels is not in the atlas. Take 2 texels for the \
    narrowest edge of light, or use the exact sum.";

/// What a flat square shows of an atlas; the camera sees the same of it every time.
fn squares(quick: bool) -> Vec<Case> {
    let texel_mm = if quick { 0.19 } else { 0.12 };
    let diagonal = Square::new(27.0, 0.5, quick);
    let upright = Square::new(0.0, 0.5, quick);
    let wide = Square::new(45.0, 1.0, quick);
    let even @ [u, v] = [DVec2::X, DVec2::Y].map(|axis| axis * texel_mm);
    let whole = |u: DVec2, v: DVec2| Layout::apart(1, vec![Island::whole([u, v])]);
    let halves = || {
        let half = |x: f64| {
            let least = DVec2::new(x, -HALF_MM);
            Island::new([least, least + DVec2::new(HALF_MM, SIDE_MM)], even)
        };
        Layout::apart(2, vec![half(0.0), half(-HALF_MM)])
    };
    // Neighbours on the square are not in the atlas.
    let hundred = (0..100).map(|i| (37 * i) % 100).map(|i| {
        let least = DVec2::new((i % 10).into(), (i / 10).into()) * SIDE_MM / 10.0 - HALF_MM;
        Island::new([least, least + SIDE_MM / 10.0], even)
    });
    let hundred = Layout::apart(10, hundred.collect());
    let sheared = DVec2::from_angle(30f64.to_radians()) * texel_mm;
    let mirrored = vec![Island::whole(even).behind(), Island::whole([-u, v])];
    let right_half = [DVec2::new(0.0, -HALF_MM), DVec2::splat(HALF_MM)];
    let strip = [DVec2::new(-HALF_MM, -1.0), DVec2::new(HALF_MM, 1.0)];
    let fine = [DVec2::X, DVec2::Y].map(|axis| axis / 20.0);
    let case = |name: &str, what: &str, square: &Square, layout: Layout| {
        let square = square.clone();
        Case::new(name, what, GRADIENT, move |lab| square.run(lab, &layout, worst))
    };
    let rms = |name: &str, layout: Layout| {
        let what = "The edge at 27 degrees, the square in one piece, or cut into 10x10 islands \
            of 2.8 mm that lie shuffled in the atlas. Here the figure is the root mean square of \
            the differences over that of the truth.";
        let square = diagonal.clone();
        Case::new(name, what, GRADIENT, move |lab| square.run(lab, &layout, relative_rms))
    };
    let seam = |at_most| [known(ATLAS, at_most, SEAM)];
    let strip = Layout::apart(1, vec![Island::new(strip, fine)]);
    vec![
        case("a seam along an edge of light", SEAMS, &upright, halves()).known(seam(0.26)),
        case("a seam across an edge of light", SEAMS, &diagonal, halves()).known(seam(0.22)),
        case("stretch 1:2", STRETCH, &wide, whole(0.4 * DVec2::X, 0.2 * DVec2::Y)),
        case("stretch 1:8", STRETCH, &wide, whole(0.4 * DVec2::X, 0.05 * DVec2::Y)),
        case("shear by 60 degrees", SHEAR, &diagonal, whole(u, sheared)),
        case("a mirrored island", BEHIND, &diagonal, Layout::apart(2, mirrored)).pictured(false),
        case("islands that overlap", DRAWN_OVER, &diagonal, whole(u, v).drawn_over(right_half))
            .known([by_nature(ATLAS, 1.05, ONE_POINT)]),
        case("one texel a mm", WIDE_TEXELS, &diagonal, whole(DVec2::X, DVec2::Y))
            .known([by_nature(ATLAS, 0.1, COARSE)]),
        case("twenty texels a mm", STRIP, &upright, strip).pictured(false),
        rms("one island", whole(u, v)).pictured(false),
        rms("a hundred islands", hundred).known(seam(0.06)),
    ]
}

/// A cylinder lit from the side, unrolled with its seam in view or behind.
fn cylinder(in_view: bool, quick: bool) -> Case {
    let make = move || {
        let (pixels, px_per_mm, texels) = match quick {
            true => (128, 5.0, [264, 105]),
            false => (224, 8.0, [420, 167]),
        };
        let form = Form::Cylinder {
            along: DVec3::Y,
            rho_mm: 8.0,
            length_mm: 20.0,
            turned: if in_view { std::f64::consts::PI } else { 0.0 },
        };
        let scene = Scene(vec![Surface::lit(form, from_camera(60.0, DVec3::X))]);
        let view = View::orthographic([pixels; 2], px_per_mm);
        let crop = Crop::middle(&view, [pixels * 4 / 5, pixels * 3 / 10]);
        Trial::new(scene, view, crop, Truth::Visible)
            .only_where(|hit| hit.normal.z > 0.3)
            .atlas(texels, Truth::Closed)
    };
    let what = "A cylinder of 8 mm radius lit from 60 degrees to the side, unrolled into one \
        island whose seam faces the camera or lies behind: largest difference where it is turned \
        by less than 73 degrees from the camera, in screen space to the visible integral, in \
        texture space to the closed form.";
    let seam = if in_view { "in view" } else { "behind" };
    trial(format!("a cylinder's seam {seam}"), what, GRADIENT, make)
        .known(in_view.then(|| known(ATLAS, 0.08, SEAM)))
}

/// UVs as an artist may have left them.
fn sheets() -> [Case; 2] {
    // Whole tiles away, across a tile's border, and over three tiles.
    const OUTSIDE: [sheet::Uvs; 3] = [
        |at| sheet::INSIDE(at) + Vec2::new(2.0, -3.0),
        |at| sheet::INSIDE(at) + Vec2::new(0.3, -0.4),
        |at| 3.0 * sheet::INSIDE(at),
    ];
    // Left and right halves on the same texels, as a face that is painted once.
    const MIRRORED: [sheet::Uvs; 1] = [|at| sheet::INSIDE(Vec2::new((2.0 * at.x - 1.0).abs(), at.y))];
    let why = "Each half has a page of its own, and where they meet is a seam. Give each half \
        UVs of its own, or use the exact sum.";
    [
        Case::new(
            "UVs outside of 0 to 1",
            "A sheet with bumps of 0.5 mm, read from a glTF file and drawn by the renderer, \
             which moves islands into the atlas: largest difference to the same sheet with UVs \
             from 0.05 to 0.95, over UVs that lie whole tiles away, across the border of a tile, \
             and in three tiles. Screen space does not use UVs.",
            GRADIENT,
            |lab| sheet::run(lab, &OUTSIDE),
        )
        .pictured(false),
        Case::new(
            "mirrored halves in one place",
            "The same sheet, both halves of which have the same UVs; the renderer draws each \
             into a page of its own. Largest difference to the sheet in one piece.",
            GRADIENT,
            |lab| sheet::run(lab, &MIRRORED),
        )
        .known([known(ATLAS, 0.032, why)]),
    ]
}

/// Nine balls of skin, each with an atlas of its own.
fn many_heads() -> Case {
    let same = Bound {
        passes: 0.001,
        degrades: STEP,
        why: "0.001 is two steps of half floats near white, and nothing else should differ.",
    };
    let why = "The kind of a tile follows from the range of light in it. Heads that share a tile \
        change its kind, and with it the error at their rims. Use the exact sum where heads \
        almost touch in the picture.";
    Case::new(
        "many heads",
        "Nine balls of 8 mm radius, 1.5 mm apart in the picture and 40 mm or more in depth, each \
         lit from a side of its own: largest difference of a ball among the others to the same \
         ball alone. In texture space each has an atlas, of two sizes in turn, all by one effect \
         in one submission.",
        same,
        |lab| {
            let mut figures = heads_on_screen(lab)?;
            figures.extend(heads_in_atlases(lab)?);
            Ok(figures.into())
        },
    )
    .known([known(PLAN, 0.021, why)])
}

/// Every head is lit from a side of its own; neighbours stand 40 mm or more behind each other.
fn head(head: u32) -> Surface {
    let [column, row] = [head % 3, head / 3].map(f64::from);
    let behind_mm = -40.0 * f64::from((head % 3 + 2 * (head / 3)) % 4);
    let light = DVec2::from_angle(f64::from(head) * 2.4).extend(1.0).normalize();
    let place = DVec3::new(17.5 * (column - 1.0), 17.5 * (row - 1.0), behind_mm);
    Surface::lit(Form::Sphere { rho_mm: 8.0 }, light).moved(place)
}

/// The frame with these heads.
fn look_at_heads(heads: impl IntoIterator<Item = u32>) -> GBuffer {
    let scene = Scene(heads.into_iter().map(head).collect());
    scene.shoot(&View::orthographic([158; 2], 3.0))
}

fn heads_on_screen(lab: &Lab) -> Result<Figures, Error> {
    let scatter = |g: &GBuffer| {
        let frame = Texels::of(g, 0.0).upload(&lab.gpu);
        lab.scatter(&frame.frame(), &frame.output)
    };
    let together = scatter(&look_at_heads(0..9))?;
    let mut figures = vec![];
    for head in 0..9 {
        let g = look_at_heads([head]);
        let pixels: Vec<usize> = g.pixels(|_| true).iter().map(|(i, _)| *i).collect();
        merge(&mut figures, apart(&together, &scatter(&g)?, &pixels));
    }
    Ok(figures)
}

fn heads_in_atlases(lab: &Lab) -> Result<Figures, Error> {
    let gpu = &lab.gpu;
    // Of two sizes in turn, so that scratch memory is made anew between them.
    let unwrap = |i: u32| Scene(vec![head(i)]).unwrap([64 - i % 2 * 16; 2]);
    let heads: Vec<Unwrapped> = (0..9).map(unwrap).collect();
    let mut figures = Vec::new();
    lab.by_atlas(|name, method| {
        let [alone, together] = [(); 2].map(|()| heads.iter().map(|h| h.upload(gpu)).collect::<Vec<_>>());
        for head in &alone {
            method::scatter_atlas(gpu, method, &head.atlas(), &head.output)?;
        }
        // All in one submission, as a host would.
        gpu.run(|encoder| {
            together.iter().try_for_each(|head| {
                method.prepare(&gpu.device, &gpu.queue, &head.atlas())?;
                method.render(encoder, &head.output)
            })
        })?;
        for (a, b) in alone.iter().zip(&together) {
            let [a, b] = [a, b].map(|head| vec![(name, lab.read(&head.output))]);
            let texels: Vec<usize> = (0..a[0].1.len()).collect();
            merge(&mut figures, apart(&a, &b, &texels));
        }
        Ok(())
    })?;
    Ok(figures)
}
