"""Clean-up of a part of a mesh that others hold on to: its rim and all boundaries stay to the bit.

    |-- held --|-- may change --|-- near: seeds --| what is gone: a seam, a rim |-- seeds --|-- ... --|-- held --|

Quads that were filled apart are put together, the nodes between them are free like others, and cavities around
irregular nodes near them are filled anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.geometry.halfedge import twins_of
from imgquad_core.geometry.quad_shape import lower_to_worst
from imgquad_core.model import Materials
from imgquad_core.tracing import trace_mesh

from .batches import in_batches
from .faces import FaceQuads, faces_only, joined
from .irregular_nodes import clean_up
from .optimization import GOOD_ENOUGH, LAPLACE_SWEEPS, NEWTON_SWEEPS, cut_at_chains, stitched_onto
from .options import CleanUp
from .relaxation import BAD, GOOD, laplace, newton, rings_of, untangle
from .worst_quads import repair

POOR = 0.7  #: scaled Jacobian below which single quads are replaced, as in faces
WIDE = 1 << 32  #: more cells than a row of them has


class Area(NamedTuple):
    """Quads of a mesh or of a part of it."""

    points: Floats  #: (n, 2)
    quads: Ints  #: (m, 4) counter-clockwise
    part: Ints  #: (m,) what each is of: there is a boundary between two parts


def cleaned(area: Area, quads: Ints, near: Flags, passes: Sequence[CleanUp], threads: int = 1) -> Area:
    """Clean up quads of an area from some nodes on.

    Parameters
    ----------
    area : Area
        What they are part of.
    quads : int64
        Those that may change.
    near : bool, shape (n,)
        Nodes from which irregular nodes are looked at, within some edges.
    passes : sequence of CleanUp
        One after the other.
    threads : int
        The quads do not depend on it.

    Returns
    -------
    Area
        What takes the place of `quads`. The points of `area` come first, new ones follow.
    """
    used, corners = np.unique(area.quads[quads], return_inverse=True)
    parts, number = np.unique(area.part[quads], return_inverse=True)
    mesh = trace_mesh(area.points[used], corners.reshape(-1, 4), number.ravel(), nameless(len(parts)))
    old = _held(cut_at_chains(mesh), rim_of(area, quads)[used])
    seeds = mesh.points[near[used]]

    def clean(part: FaceQuads) -> FaceQuads:
        for how in passes:
            part = _repaired(_relaxed(clean_up(_drafted(part), how, _near(part, seeds))))
        return part

    new = joined(in_batches(old, clean, threads))
    better = _is_better(old, new, len(mesh.region_label))
    made = stitched_onto(mesh, joined([faces_only(old, ~better), faces_only(new, better)]))
    rim = used[np.unique(mesh.chain_points)]  # they come first
    ids = np.append(rim, len(area.points) + np.arange(made.n_points - len(rim)))
    points = np.concatenate([area.points, made.points[len(rim) :]])
    return Area(points, ids[made.quads], parts[made.quad_material])


def nameless(n: int) -> Materials:
    """Return n materials without names of their own."""
    return Materials(np.arange(n, dtype=np.int32), tuple(map(str, range(n))), np.zeros((n, 3), np.uint8))


def rim_of(area: Area, quads: Ints) -> Flags:
    """Tell the nodes between some quads and others of the same part: they are held, with as many quads as they have."""
    inside = np.zeros(len(area.quads), bool)
    inside[quads] = True
    twins = twins_of(area.quads, len(area.points))
    h = np.flatnonzero((twins >= 0) & np.repeat(inside, 4))
    h = h[~inside[twins[h] // 4] & (area.part[h // 4] == area.part[twins[h] // 4])]
    rim = np.zeros(len(area.points), bool)
    rim[area.quads.ravel()[h]] = rim[np.roll(area.quads, -1, axis=1).ravel()[h]] = True
    return rim


def _held(faces: FaceQuads, on_rim: Flags) -> FaceQuads:
    """Let nodes on the rim want the quads that they have."""
    here = np.bincount(faces.quads.ravel(), minlength=len(faces.points))
    held = (faces.origin >= 0) & on_rim[np.maximum(faces.origin, 0)]
    return faces._replace(wanted=np.where(held, here, faces.wanted))


def _near(faces: FaceQuads, places: Floats) -> Flags:
    """Tell the nodes near some places, in cells two edges wide: old ones may be gone."""
    corners = faces.points[faces.quads]
    side = 2.0 * float(np.median(np.hypot(*(corners[:, 1] - corners[:, 0]).T)))
    cells, there = (np.floor(xy / side).astype(np.int64) for xy in (faces.points, places))
    return np.isin(cells[:, 0] * WIDE + cells[:, 1], there[:, 0] * WIDE + there[:, 1])


def _drafted(part: FaceQuads) -> FaceQuads:
    """Smooth a little: clean-up asks for no more."""
    points, free = part.points.copy(), part.origin < 0
    rings = rings_of(part.quads, len(points))
    laplace(points, rings, free, 3)
    untangle(points, rings, free, 2, BAD)
    return part._replace(points=points)


def _relaxed(part: FaceQuads) -> FaceQuads:
    points, free = part.points.copy(), part.origin < 0
    rings = rings_of(part.quads, len(points))
    laplace(points, rings, free, LAPLACE_SWEEPS)
    untangle(points, rings, free, 2, BAD)
    newton(points, rings, free, NEWTON_SWEEPS, GOOD)
    untangle(points, rings, free, 4, 0.86)
    return part._replace(points=points)


def _repaired(part: FaceQuads) -> FaceQuads:
    """Replace the worst quads."""
    better, beside = repair(part, POOR)
    return _relaxed(better) if beside.any() else part


def _is_better(old: FaceQuads, new: FaceQuads, n_faces: int) -> Flags:
    """Tell the faces whose worst quad does not fall, or stays good."""
    before, after = np.ones((2, n_faces))
    lower_to_worst(old.points, old.quads, old.face, before)
    lower_to_worst(new.points, new.quads, new.face, after)
    return np.asarray((after >= np.minimum(before, GOOD_ENOUGH)) & (after > 0.0))
