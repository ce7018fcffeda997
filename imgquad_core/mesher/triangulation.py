"""Constrained Delaunay triangulation of boundary chains (the paper's "initial triangular mesh").

Done by one of two libraries: J. R. Shewchuk's Triangle (https://doi.org/10.1007/BFb0014497), free for non-commercial
use only, or A. Amirkhanov's CDT (https://github.com/artem-ogre/CDT), free for all. Both crash or hang on bad input:
they never see any here, and what they return is checked.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from imgquad_core.arrays import Floats, Ints
from imgquad_core.errors import TopologyError
from imgquad_core.jit import kernel

from .triangulators import triangulator_used

# of the background of CDT; study: 14 pictures, four values of each give the same quality within 3 %
LONGEST = 1.2  # length wanted far from constraints, over the root of the largest area; an edge of it has 1.52
GRADING = 0.35  # growth of the length wanted, per unit of length
LEAST_ROOM = 0.7  # distance of a new point to the corners of its triangle, over the length wanted there
REFINEMENTS = 12  # rounds at most; two or three are usual
FEW = 0.03  # new points, over those there are, for which no other round is made: a half of all rounds


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


def triangulate(points: Floats, segments: Ints, max_area: float | None = None, triangulator: str = "auto") -> Triangles:
    """Triangulate `points` with `segments` as constraints, refined inside to `max_area` if given.

    Parameters
    ----------
    points : float64, shape (n, 2)
        Distinct points.
    segments : int64, shape (m, 2)
        Ids of the ends; no two cross, touch or overlap. None of them is ever split.
    max_area : float, optional
        Adds points inside, until triangles far from the constraints are hardly larger; towards short constraints they
        get smaller step by step.
    triangulator : {"auto", "triangle", "cdt"}
        Who does it; see `triangulator_used`.

    Returns
    -------
    Triangles
        The points of the input come first, in their order.

    Raises
    ------
    TopologyError
        If the segments do cross or no triangle comes back.
    """
    if len(points) < 3 or len(segments) == 0 or not np.isfinite(points).all():
        raise TopologyError(f"cannot triangulate {len(points)} points with {len(segments)} segments")
    if triangulator_used(triangulator) == "triangle":
        return _by_triangle(points, segments, max_area)
    return _by_cdt(points, segments) if max_area is None else _refined_by_cdt(points, segments, max_area)


def _by_triangle(points: Floats, segments: Ints, max_area: float | None) -> Triangles:
    """Triangulate by Triangle; with `max_area` no angle is below 20 degrees where the constraints allow."""
    import triangle

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


def _by_cdt(points: Floats, segments: Ints) -> Triangles:
    """Triangulate by CDT."""
    import pythoncdt as cdt

    mesh = cdt.Triangulation(cdt.VertexInsertionOrder.AUTO, cdt.IntersectingConstraintEdges.NOT_ALLOWED, 0.0)
    vertices: Any = np.ascontiguousarray(points, np.float64)  # a buffer, which NumPy 1's stubs do not say
    edges: Any = np.ascontiguousarray(segments, np.uintc)
    try:
        mesh.insert_vertices(vertices)
        mesh.insert_edges(edges)
    except RuntimeError as error:
        raise TopologyError(f"boundaries cross or touch: CDT says '{str(error).splitlines()[0]}'") from error
    mesh.erase_outer_triangles()
    found = mesh.triangles_array(copy=False)
    if len(found) == 0:
        raise TopologyError("the boundaries enclose nothing: CDT gave no triangle")
    corners, beside = found["vertices"].astype(np.int64), found["neighbors"].astype(np.int64)
    beside[beside == cdt.NO_NEIGHBOR] = -1
    # CDT's neighbour k lies across the edge from corner k to the next
    opposite = np.ascontiguousarray(np.roll(beside, -1, axis=1))
    return Triangles(np.array(points, np.float64), corners, _twins_of_neighbors(corners, opposite))


def _refined_by_cdt(points: Floats, segments: Ints, max_area: float) -> Triangles:
    """Triangulate by CDT, with points at the centroids of triangles that are too large for the lengths wanted there.

    Wanted is the length of the constraints at their ends, growing from there up to that of `max_area`. CDT's own
    refinement would split constraints.

    References
    ----------
    N. P. Weatherill, O. Hassan, Efficient three-dimensional Delaunay triangulation with automatic point creation and
    imposed boundary constraints, IJNME 37 (1994), https://doi.org/10.1002/nme.1620371203
    """
    longest = LONGEST * float(np.sqrt(max_area))
    wanted = np.minimum(_mean_lengths(points, segments), longest)
    mesh = _by_cdt(points, segments)
    for _ in range(REFINEMENTS):
        new, wanted_there = _points_missing(mesh, wanted, longest)
        if len(new) <= FEW * len(mesh.points):
            break
        wanted = np.append(wanted, wanted_there)
        mesh = _by_cdt(np.vstack([mesh.points, new]), segments)
    return mesh


def _mean_lengths(points: Floats, segments: Ints) -> Floats:
    """Return the mean length of the segments at each point, infinite where there are none."""
    x, y = (points[segments[:, 1]] - points[segments[:, 0]]).T
    total = np.bincount(segments.ravel(), np.repeat(np.hypot(x, y), 2), len(points))
    count = np.bincount(segments.ravel(), minlength=len(points))
    return np.where(count > 0, total / np.maximum(count, 1), np.inf)


def _points_missing(mesh: Triangles, wanted: Floats, longest: float) -> tuple[Floats, Floats]:
    """Return the centroids of triangles that are too large, and the length wanted at each of them.

    Of those that would crowd each other (in one cell of a grid as wide as that length), only the one with most room
    is returned.
    """
    corners = mesh.points[mesh.triangles]
    centroid = corners.mean(axis=1)
    distance = np.hypot(*np.moveaxis(corners - centroid[:, None], -1, 0))
    length = np.minimum((wanted[mesh.triangles] + GRADING * distance).min(axis=1), longest)
    room = distance.min(axis=1) / length
    large = np.flatnonzero(room > LEAST_ROOM)
    large = large[np.argsort(-room[large], kind="stable")]
    level = np.floor(np.log2(length[large]))
    cell = np.floor(centroid[large] / np.exp2(level)[:, None])
    chosen = large[np.sort(_firsts(level, *cell.T))]
    return centroid[chosen], length[chosen]


def _firsts(*columns: Floats) -> Ints:
    """Return the first of all rows that are equal; np.unique takes ten times as long for rows."""
    order = np.lexsort(columns)  # equal rows stay in their order
    differs = np.ones(len(order), bool)
    differs[1:] = np.any([column[order[1:]] != column[order[:-1]] for column in columns], axis=0)
    return np.asarray(order[differs])


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
