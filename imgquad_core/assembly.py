"""A `QuadMesh` from bare arrays: regions and boundary chains are found anew.

For meshes that come back from another program, which knows points, quads and a material each, and nothing else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .errors import InputError
from .halfedge import twins_of
from .model import Materials, PointKind, QuadMesh

Floats = NDArray[np.float64]
Ids = NDArray[np.int64]

SHARP = 45.0  #: a boundary that turns by more degrees than this at a point has a corner there


def assemble_mesh(points: Floats, quads: Ids, quad_material: NDArray[np.int32], materials: Materials) -> QuadMesh:
    """Make a mesh of quads with a material each.

    Parameters
    ----------
    points : float64, shape (n_points, 2)
        Coordinates.
    quads : int64, shape (n_quads, 4)
        Ids of the corners of each quad; clockwise ones are turned round.
    quad_material : int32, shape (n_quads,)
        Material of each quad.
    materials : Materials
        Number, name and colour of the materials.

    Returns
    -------
    QuadMesh
        With the points and quads in the order given. Points on the bounding box are `PointKind.FRAME`.

    Raises
    ------
    InputError
        When an edge has more than two quads, or two on one side.
    """
    quads = _counter_clockwise(points, np.asarray(quads, np.int64))
    twins = twins_of(quads, len(points)) if len(quads) else np.empty(0, np.int64)
    if (twins == -2).any():
        at = points[quads.ravel()[np.flatnonzero(twins == -2)[0]]]
        raise InputError(f"the mesh is folded or has an edge with more than two quads, at ({at[0]:g}, {at[1]:g})")
    region, region_label = _regions(twins, np.asarray(quad_material, np.int32))
    edges, sides = _boundary_edges(quads, twins, region)
    degree = np.bincount(edges.ravel(), minlength=len(points))
    offsets, chain_points, chain_regions = _chains(edges, sides, degree)
    return QuadMesh(
        points=points,
        point_kind=_kinds(points, edges, degree),
        quads=quads,
        quad_region=region,
        region_label=region_label,
        chain_offsets=offsets,
        chain_points=chain_points,
        chain_regions=chain_regions,
        materials=materials,
    )


def _counter_clockwise(points: Floats, quads: Ids) -> Ids:
    """Return the quads with those of negative area turned round, their first corner kept."""
    x, y = points[quads, 0], points[quads, 1]
    area = (x[:, 2] - x[:, 0]) * (y[:, 3] - y[:, 1]) - (x[:, 3] - x[:, 1]) * (y[:, 2] - y[:, 0])
    return np.where((area < 0.0)[:, None], quads[:, [0, 3, 2, 1]], quads)


def _regions(twins: Ids, material: NDArray[np.int32]) -> tuple[Ids, NDArray[np.int32]]:
    """Return the region of each quad, numbered in the order of their first quads, and the material of each region."""
    n = len(material)
    h = np.flatnonzero(twins >= 0)
    h = h[material[h // 4] == material[twins[h] // 4]]
    links = coo_array((np.ones(len(h), bool), (h // 4, twins[h] // 4)), shape=(n, n))
    _, part = connected_components(links, directed=False)
    _, first, region = np.unique(part, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[region], material[np.sort(first)]


def _boundary_edges(quads: Ids, twins: Ids, region: Ids) -> tuple[Ids, Ids]:
    """Return each edge between two regions once, with the lower region (or the only one) on its left: (n, 2) each."""
    h = np.arange(4 * len(quads))
    left = region[h // 4]
    right = np.where(twins >= 0, region[twins // 4], -1)
    once = (right < 0) | (left < right)
    starts, ends = quads.ravel(), np.roll(quads, -1, axis=1).ravel()
    return np.stack([starts[once], ends[once]], axis=1), np.stack([left[once], right[once]], axis=1)


def _chains(edges: Ids, sides: Ids, degree: Ids) -> tuple[Ids, Ids, Ids]:
    """Join the edges to chains from junction to junction, then to closed ones; the same way for the same mesh."""
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    leaving = {int(edges[e, 0]): int(e) for e in order[::-1]}  # unique where the degree is 2
    used = np.zeros(len(edges), bool)
    chains: list[list[int]] = []
    regions: list[Ids] = []
    starts = [e for e in order if degree[edges[e, 0]] != 2]
    for first in [*starts, *order]:
        if used[first]:
            continue
        chain, e = [int(edges[first, 0])], int(first)
        while True:
            used[e] = True
            head = int(edges[e, 1])
            chain.append(head)
            if head == chain[0] or degree[head] != 2:
                break
            e = leaving[head]
        chains.append(chain)
        regions.append(sides[first])
    offsets = np.concatenate([[0], np.cumsum([len(c) for c in chains])]).astype(np.int64)
    flat = np.concatenate(chains).astype(np.int64) if chains else np.empty(0, np.int64)
    return offsets, flat, np.array(regions, np.int64).reshape(-1, 2)


def _kinds(points: Floats, edges: Ids, degree: Ids) -> NDArray[np.uint8]:
    kinds = np.full(len(points), PointKind.INTERIOR, np.uint8)
    kinds[degree == 2] = PointKind.FREE
    low, high = points.min(axis=0, initial=np.inf), points.max(axis=0, initial=-np.inf)
    on_frame = (degree == 2) & ((points == low) | (points == high)).any(axis=1)
    kinds[on_frame] = PointKind.FRAME
    kinds[(degree == 2) & (_turning(points, edges, degree) > SHARP)] = PointKind.CORNER
    kinds[degree > 2] = PointKind.JUNCTION
    return kinds


def _turning(points: Floats, edges: Ids, degree: Ids) -> Floats:
    """Return by how many degrees the boundary turns at each point of degree 2; 0 at others."""
    step = points[edges[:, 1]] - points[edges[:, 0]]
    step = step / np.maximum(np.hypot(step[:, 0], step[:, 1]), 1e-300)[:, None]
    into, out = np.zeros((2, len(points), 2))
    into[edges[:, 1]] = step
    out[edges[:, 0]] = step
    cosine = np.clip((into * out).sum(axis=1), -1.0, 1.0)
    return np.where(degree == 2, np.degrees(np.arccos(cosine)), 0.0)
