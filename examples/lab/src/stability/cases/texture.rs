//! Where texture space fails: seams, stretch, and what shares a texel.

mod cylinder;
mod flat;
mod heads;
mod sheet;

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::{FOUND, Results, SEEN, STEP, unpictured, worst};
use crate::stability::case::{Case, Group, Known, Run};
use flat::{HALF_MM, Island, Layout, SIDE_MM, Square};

/// Of the largest difference.
const LARGEST: Bounds = Bounds {
    passes: FOUND,
    degrades: SEEN,
    why: ".01 is what an eye may find in a gradient; .03 is eight steps of eight bits, an edge that anyone sees.",
};

/// Of the root mean square.
const MEAN: Bounds = Bounds {
    passes: FOUND,
    degrades: SEEN,
    why: "two renderers may differ by 1 % over a surface; 3 % is half of what scattering does to this edge.",
};

/// Of what must be the same.
const SAME: Bounds = Bounds {
    passes: 0.001,
    degrades: STEP,
    why: ".001 is two steps of a half float near white, and nothing else should differ; 1/255 is a step of eight \
          bits.",
};

struct Bounds {
    passes: f64,
    degrades: f64,
    why: &'static str,
}

pub fn cases(quick: bool) -> Vec<Case> {
    [flat_squares(quick), others(quick)]
        .into_iter()
        .flatten()
        .collect()
}

/// What a flat square shows of an atlas; the camera sees the same of it every time.
fn flat_squares(quick: bool) -> Vec<Case> {
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
    let hundred = || {
        // Neighbours on the square are not in the atlas.
        let places = (0..100).map(|i| (37 * i) % 100);
        let islands = places.map(|i| {
            let least = DVec2::new((i % 10).into(), (i / 10).into()) * SIDE_MM / 10.0 - HALF_MM;
            Island::new([least, least + SIDE_MM / 10.0], even)
        });
        Layout::apart(10, islands.collect())
    };
    let sheared = DVec2::from_angle(30f64.to_radians()) * texel_mm;
    let mirrored = vec![Island::whole(even).behind(), Island::whole([-u, v])];
    let right_half = [DVec2::new(0.0, -HALF_MM), DVec2::splat(HALF_MM)];
    let strip = [DVec2::new(-HALF_MM, -1.0), DVec2::new(HALF_MM, 1.0)];
    let fine = [DVec2::X, DVec2::Y].map(|axis| axis / 20.0);
    vec![
        case(
            "a seam along a light's edge",
            "A flat square under an edge of light with a σ of .5 mm, cut along that edge into two islands that lie apart in \
             the atlas, .19 mm a texel (.12 in full). Here and in all cases of the square the figure is the largest \
             difference over its middle 11 mm: in screen space, at 5 px/mm (8 in full), to the visible integral; in texture \
             space, fetched bilinearly at the same places, to the closed form.",
            &LARGEST,
            known(SEAM, 0.26),
            flat::run(&upright, halves(), worst),
        ),
        case(
            "a seam across a light's edge",
            "The same islands, the edge at 27 degrees to the seam.",
            &LARGEST,
            known(SEAM, 0.22),
            flat::run(&diagonal, halves(), worst),
        ),
        case(
            "stretch 1:2",
            "One island, texels of .4 by .2 mm, the edge at 45 degrees and with a σ of 1 mm.",
            &LARGEST,
            vec![],
            flat::run(&wide, whole(0.4 * DVec2::X, 0.2 * DVec2::Y), worst),
        ),
        case(
            "stretch 1:8",
            "The same with texels of .4 by .05 mm.",
            &LARGEST,
            vec![],
            flat::run(&wide, whole(0.4 * DVec2::X, 0.05 * DVec2::Y), worst),
        ),
        case(
            "shear by 60 degrees",
            "Texels of .19 by .19 mm (.12 in full) whose sides are at 30 degrees to each other, the edge at 27 \
             degrees.",
            &LARGEST,
            vec![],
            flat::run(&diagonal, whole(u, sheared), worst),
        ),
        unpictured(case(
            "a mirrored island",
            "The square lies mirrored in the atlas, next to an island of another square, which is 100 mm behind it and lit \
             where this one is dark; the edge at 27 degrees.",
            &LARGEST,
            vec![],
            flat::run(&diagonal, Layout::apart(2, mirrored), worst),
        )),
        case(
            "islands that overlap",
            "Half of another square, 100 mm behind and lit where this one is dark, is drawn onto the texels of this one, \
             which `Atlas` asks a host not to do; the edge at 27 degrees.",
            &LARGEST,
            known(OVERLAP, 1.05),
            flat::run(&diagonal, whole(u, v).drawn_over(right_half), worst),
        ),
        case(
            "one texel a mm",
            "The edge at 27 degrees, with texels twice as wide as it is soft.",
            &LARGEST,
            known(COARSE, 0.1),
            flat::run(&diagonal, whole(DVec2::X, DVec2::Y), worst),
        ),
        case(
            "twenty texels a mm",
            "The atlas holds a strip across the edge, 2 mm wide; texture space is asked for that alone.",
            &LARGEST,
            vec![],
            flat::run(
                &upright,
                Layout::apart(1, vec![Island::new(strip, fine)]),
                worst,
            ),
        ),
        unpictured(case(
            "one island",
            "The edge at 27 degrees, the square in one piece. Here the figure is not the largest difference, but their root \
             mean square over that of the truth.",
            &MEAN,
            vec![],
            flat::run(&diagonal, whole(u, v), relative_rms),
        )),
        case(
            "a hundred islands",
            "The same, the square cut into ten by ten islands of 2.8 mm, shuffled and apart in the atlas.",
            &MEAN,
            known(SEAM, 0.06),
            flat::run(&diagonal, hundred(), relative_rms),
        ),
    ]
}

fn others(quick: bool) -> Vec<Case> {
    let nearer = Known {
        method: "screen_planned",
        at_most: 0.002,
        by_nature: false,
        why: "A coarse pixel that covers two heads keeps the nearer one, so that the other lacks light; by half of the \
              error that the plan is made for. Take `ScreenSpace` where heads almost touch in the picture."
            .into(),
    };
    vec![
        case(
            "a cylinder's seam in view",
            "A cylinder of 8 mm radius lit from 60 degrees to the side, unrolled into one island whose seam faces the \
             camera: the largest difference where it is turned by less than 73 degrees from the camera, in screen space to \
             the visible integral, in texture space to the closed form.",
            &LARGEST,
            known(SEAM, 0.08),
            cylinder::run(0.0, quick),
        ),
        case(
            "a cylinder's seam behind",
            "The same, the seam on the far side.",
            &LARGEST,
            vec![],
            cylinder::run(180.0, quick),
        ),
        unpictured(case(
            "UVs outside of 0 to 1",
            "A sheet with bumps of .5 mm, read from a glTF file and drawn by the renderer, which moves islands into the \
             atlas. The figure is the largest difference to the same sheet with UVs from .05 to .95, over UVs that lie \
             whole tiles away, across the border of a tile, and in three tiles. Screen space does not use UVs. A moved \
             island may touch the atlas's border, past which a fetch repeats the last texel.",
            &LARGEST,
            vec![],
            sheet::run(&OUTSIDE),
        )),
        case(
            "mirrored halves on one place",
            "The same sheet, both halves of which have the same UVs, as of a face that is painted once; the renderer draws \
             each into a page of its own. The figure is the largest difference to the sheet in one piece.",
            &LARGEST,
            known(MIRROR, 0.032),
            sheet::run(&MIRRORED),
        ),
        case(
            "many heads",
            "Nine balls of 8 mm radius, 1.5 mm apart in the picture and 40 mm or more in depth, each lit from a side of its \
             own: the largest difference of a ball among the others to the same ball alone. In texture space each has an \
             atlas, of two sizes in turn, all by one effect in one submission.",
            &SAME,
            vec![nearer],
            heads::run(),
        ),
    ]
}

const SEAM: (&str, bool) = (
    "Passes along u and v end with the island; what lies across its seam is elsewhere in the atlas, and finding it by \
     position would mean to search the atlas for every texel. Lay seams where skin is not seen, or take `ScreenSpace`.",
    false,
);

const MIRROR: (&str, bool) = (
    "Each half has a page of its own, and where they meet is a seam. Give each half UVs of its own, or take \
     `ScreenSpace`.",
    false,
);

const OVERLAP: (&str, bool) = (
    "A texel has room for one point. Give each surface an atlas, as `renderer::Scene` does by its pages, or take \
     `ScreenSpace`.",
    true,
);

const COARSE: (&str, bool) = (
    "Light that is finer than the texels is not in the atlas, and comes out in steps. Take two texels for the narrowest \
     edge of light, or `ScreenSpace`.",
    true,
);

/// What texture space does not pass by, and the figure that it must keep.
fn known((why, by_nature): (&str, bool), at_most: f64) -> Vec<Known> {
    vec![Known {
        method: "texture_separable",
        at_most,
        by_nature,
        why: why.into(),
    }]
}

/// Whole tiles away, across a tile's border, and over three tiles.
const OUTSIDE: [sheet::Uvs; 3] = [
    |at| sheet::INSIDE(at) + Vec2::new(2.0, -3.0),
    |at| sheet::INSIDE(at) + Vec2::new(0.3, -0.4),
    |at| 3.0 * sheet::INSIDE(at),
];

/// Left and right halves on the same texels, as a face that is painted once.
const MIRRORED: [sheet::Uvs; 1] = [|at| sheet::INSIDE(Vec2::new((2.0 * at.x - 1.0).abs(), at.y))];

fn case(name: &str, what: &str, bounds: &Bounds, known: Vec<Known>, run: Run) -> Case {
    Case {
        group: Group::Texture,
        name: name.into(),
        what: what.into(),
        passes: bounds.passes,
        degrades: bounds.degrades,
        why: bounds.why.into(),
        known,
        run,
    }
}

/// Each method's root mean square of differences over that of the truth, all channels together.
fn relative_rms(results: &Results, truth: &[(usize, DVec3)]) -> Vec<(&'static str, f64)> {
    let whole: f64 = truth.iter().map(|(_, t)| t.length_squared()).sum();
    let of = |(name, values): &(&'static str, Vec<Vec3>)| {
        let differences = truth
            .iter()
            .map(|(i, t)| t.distance_squared(values[*i].as_dvec3()));
        (*name, (differences.sum::<f64>() / whole).sqrt())
    };
    results.iter().map(of).collect()
}
