"""A `QuadMesh` from bare quads with materials: regions, chains and kinds of points are found anew."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Bytes, Flags, Floats, Ints, Labels
from .errors import InputError
from .geometry.halfedge import twins_of
from .grouping import linked
from .model import VOID, Materials, PointKind, QuadMesh

SHARP = np.cos(np.radians(50.0))  #: a boundary that turns more at a node has a corner there


def trace_mesh(
    points: ArrayLike, quads: ArrayLike, material: ArrayLike, materials: Materials, *, folded: bool = False
) -> QuadMesh:
    """Return the mesh of `quads` with its boundaries.

    Parameters
    ----------
    points : array_like of float, shape (n, 2)
        Nodes.
    quads : array_like of int, shape (m, 4)
        Corners of each quad, all quads counter-clockwise or all clockwise.
    material : array_like of int, shape (m,)
        Material of each quad.
    materials : Materials
        Their names.
    folded : bool
        Whether quads may lie folded over, their neighbours' edges run the other way all the same.

    Returns
    -------
    QuadMesh
        Quads counter-clockwise, in the same order. What lies on the bounding box is taken for the picture's border.

    Raises
    ------
    InputError
        A quad that turns the wrong way or has no area, or an edge of more than two quads.
    """
    xy = np.asarray(points, np.float64)
    corners = _counter_clockwise(xy, np.asarray(quads, np.int64), folded)
    label = np.asarray(material, np.int32)
    twin = twins_of(corners, len(xy))
    _assert_manifold(corners, len(xy))
    region, region_label = _regions(twin, label)
    beside = np.where(twin >= 0, region[twin // 4], VOID)
    once, edges = boundary_edges(corners, twin, region)
    own = np.repeat(region, 4)
    kind = point_kinds(xy, edges, np.stack([xy.min(axis=0), xy.max(axis=0)]))
    chains, first = _walk(edges, kind, len(xy))
    left, right = own[once], beside[once]
    sides = [(left[e], right[e]) if forward else (right[e], left[e]) for e, forward in first]
    return QuadMesh(
        points=xy,
        point_kind=kind,
        quads=corners,
        quad_region=region,
        region_label=region_label,
        chain_offsets=np.cumsum([0] + [len(c) for c in chains]),
        chain_points=np.concatenate(chains),
        chain_regions=np.array(sides),
        materials=materials,
    )


def _counter_clockwise(points: Floats, quads: Ints, folded: bool) -> Ints:
    x, y = points[quads, 0], points[quads, 1]
    area = (x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1)
    if (area < 0).all() or (folded and area.sum() < 0):
        return np.ascontiguousarray(quads[:, ::-1])
    if (area <= 0).any() and not folded:
        bad = int(np.argmax(area <= 0))
        raise InputError(
            f"quad {bad} turns clockwise or has no area while others turn counter-clockwise: mend the mesh"
        )
    return quads


def _assert_manifold(quads: Ints, n_points: int) -> None:
    key = quads.ravel() * n_points + np.roll(quads, -1, axis=1).ravel()
    unique, count = np.unique(key, return_counts=True)
    if (count > 1).any():
        a, b = divmod(int(unique[np.argmax(count > 1)]), n_points)
        raise InputError(f"the edge between points {a} and {b} belongs to more than two quads, or quads overlap there")


def _regions(twin: Ints, label: Labels) -> tuple[Ints, Labels]:
    """Find connected parts of one material, numbered by their first quads."""
    half = np.flatnonzero(twin >= 0)
    half = half[label[half // 4] == label[twin[half] // 4]]
    region, n_regions = linked(half // 4, twin[half] // 4, len(label))
    of_region = np.empty(n_regions, label.dtype)
    of_region[region] = label
    return region, of_region


def boundary_edges(quads: Ints, twin: Ints, region: Ints) -> tuple[Ints, Ints]:
    """Return the half-edges between regions and on the rim, one of two, and their ends, shape (n, 2)."""
    bound = np.flatnonzero(np.where(twin >= 0, region[twin // 4], VOID) != np.repeat(region, 4))
    once = bound[(twin[bound] < 0) | (bound < twin[bound])]
    return once, np.stack([quads.ravel()[once], np.roll(quads, -1, axis=1).ravel()[once]], axis=1)


def point_kinds(points: Floats, edges: Ints, box: Floats) -> Bytes:
    """Return the kind of each point from the edges of boundaries; `box` has the least and largest x and y."""
    degree = np.bincount(edges.ravel(), minlength=len(points))
    kind = np.full(len(points), PointKind.INTERIOR, np.uint8)
    kind[degree == 2] = PointKind.FREE
    low, high = box
    near = 1e-9 * float((high - low).max())
    on_box = (points - low <= near) | (high - points <= near)
    kind[on_box.any(axis=1) & (degree > 0)] = PointKind.FRAME
    kind[(on_box.all(axis=1) & (degree > 0)) | _is_sharp(points, edges, degree)] = PointKind.CORNER
    kind[degree > 2] = PointKind.JUNCTION
    return kind


def _is_sharp(points: Floats, edges: Ints, degree: Ints) -> Flags:
    """Points between two edges at less than 130 degrees."""
    along = points[edges[:, 1]] - points[edges[:, 0]]
    along = along / np.linalg.norm(along, axis=1)[:, None]
    # the unit vectors to both neighbours add up to zero where the boundary runs straight on
    to_both = np.zeros((len(points), 2))
    np.add.at(to_both, edges[:, 0], along)
    np.add.at(to_both, edges[:, 1], -along)
    cosine = 1 - (to_both**2).sum(axis=1) / 2  # of the turn
    sharp: Flags = (degree == 2) & (cosine < SHARP)
    return sharp


def _walk(edges: Ints, kind: Bytes, n_points: int) -> tuple[list[Ints], list[tuple[int, bool]]]:
    """Chains from junction to junction, then closed ones; of each its first edge and whether it runs along that."""
    ends = edges.ravel()
    order = np.argsort(ends, kind="stable")
    start = np.searchsorted(ends[order], np.arange(n_points + 1)).tolist()
    at = order.tolist()  # half-places 2 e + side, grouped by point
    edge_list, used = edges.tolist(), [False] * len(edges)
    is_stop = (kind == PointKind.JUNCTION).tolist()
    chains, first = [], []
    junctions = np.flatnonzero(kind == PointKind.JUNCTION).tolist()
    for point in junctions + np.unique(ends).tolist():
        for place in at[start[point] : start[point + 1]]:
            if used[place // 2]:
                continue
            first.append((place // 2, place % 2 == 0))
            chain, here = [point], place
            while True:
                used[here // 2] = True
                there = edge_list[here // 2][1 - here % 2]
                chain.append(there)
                if is_stop[there] or there == point:
                    break
                here = next(p for p in at[start[there] : start[there + 1]] if not used[p // 2])
            chains.append(np.array(chain, np.int64))
    return chains, first
