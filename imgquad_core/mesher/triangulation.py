"""Constrained Delaunay triangulation of boundary chains (the paper's "initial triangular mesh").

Wraps J. R. Shewchuk's Triangle (https://doi.org/10.1007/BFb0014497), which crashes or hangs on bad input: it never
sees any here, and what it returns is checked.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Floats, Ints
from imgquad_core.errors import TopologyError
from imgquad_core.jit import kernel


class Constraints(NamedTuple):
    """Constraint segments as directed edges, grouped by their first point (CSR)."""

    offsets: Ints  #: (n_points + 1,)
    head: Ints  #: second point of each directed edge
    region: Ints  #: region on its left, -1 for none
    middle: Ints  #: id of the point that will lie half-way, or of the first of two that will lie between its ends


class Triangles(NamedTuple):
    """A triangulation: half-edge ``3 t + k`` runs from corner k of triangle t to the next, counter-clockwise."""

    points: Floats  #: float64 (n, 2)
    triangles: Ints  #: int64 (n, 3)
    twins: Ints  #: int64 (3 n,), -1 on the rim


def constraint_table(n_points: int, tail: Ints, head: Ints, left: Ints, right: Ints, middle: Ints) -> Constraints:
    """Group segments ``tail -> head`` with the regions on both sides as directed edges by their first point.

    `middle`, of shape (n_segments, 2), is what the caller keeps of each direction.
    """
    first = np.concatenate([tail, head])
    order = np.argsort(first, kind="stable")
    offsets = np.zeros(n_points + 1, np.int64)
    np.cumsum(np.bincount(first, minlength=n_points), out=offsets[1:])
    return Constraints(
        offsets,
        np.concatenate([head, tail])[order],
        np.concatenate([left, right])[order],
        np.concatenate([middle[:, 0], middle[:, 1]])[order],
    )


def find_edges(table: Constraints, tail: Ints, head: Ints) -> Ints:
    """Return the place of each directed edge ``tail -> head`` in the table, -1 where it has none."""
    place = np.full(len(tail), -1, np.int64)
    todo = np.flatnonzero(tail < len(table.offsets) - 1)
    for step in range(int(np.diff(table.offsets).max(initial=0))):
        todo = todo[table.offsets[tail[todo]] + step < table.offsets[tail[todo] + 1]]
        at = table.offsets[tail[todo]] + step
        same = table.head[at] == head[todo]
        place[todo[same]] = at[same]
    return place


def triangulate(points: Floats, segments: Ints, max_area: float | None = None) -> Triangles:
    """Triangulate `points` with `segments` as constraints, refined inside to `max_area` if given.

    Parameters
    ----------
    points : float64, shape (n, 2)
        Distinct points.
    segments : int64, shape (m, 2)
        Ids of the ends; no two cross, touch or overlap. None of them is ever split.
    max_area : float, optional
        Adds points inside, until no triangle is larger and no angle below 20 degrees (where the constraints allow).

    Returns
    -------
    Triangles
        The points of the input come first, in their order.

    Raises
    ------
    TopologyError
        If the segments do cross (Triangle adds points) or no triangle comes back.
    """
    import triangle

    if len(points) < 3 or len(segments) == 0 or not np.isfinite(points).all():
        raise TopologyError(f"cannot triangulate {len(points)} points with {len(segments)} segments")
    # a fixed format: Triangle reads 'a1e-05' as a1 followed by switch e
    switches = "pnQ" if max_area is None else f"pYYq20a{max_area:.9f}nQ"
    writeable = np.require(points, np.float64, ["C", "W"])  # Triangle takes no read-only array
    out = triangle.triangulate({"vertices": writeable, "segments": segments.astype(np.int32)}, switches)
    if "triangles" not in out or "neighbors" not in out:
        raise TopologyError("the boundaries enclose nothing: Triangle gave no triangle")
    vertices = np.ascontiguousarray(out["vertices"], np.float64)
    if max_area is None and len(vertices) != len(points):
        raise TopologyError(f"boundaries cross: Triangle added {len(vertices) - len(points)} points")
    corners = np.ascontiguousarray(out["triangles"], np.int64)
    return Triangles(vertices, corners, _twins_of_neighbors(corners, np.ascontiguousarray(out["neighbors"], np.int64)))


@kernel
def _twins_of_neighbors(corners: Ints, neighbors: Ints) -> Ints:
    """Turn "neighbour opposite to corner k" into twins of half-edges."""
    twins = np.full(3 * len(corners), -1, np.int64)
    for t in range(len(corners)):
        for k in range(3):
            other = neighbors[t, (k + 2) % 3]  # half-edge k lies opposite to corner k + 2
            if other >= 0:
                for j in range(3):
                    if corners[other, (j + 1) % 3] == corners[t, k] and corners[other, j] == corners[t, (k + 1) % 3]:
                        twins[3 * t + k] = 3 * other + j
    return twins
