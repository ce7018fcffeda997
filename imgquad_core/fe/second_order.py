"""Quads of 8 or 9 nodes: the middles of boundary sides lie on a smooth curve through the boundary's nodes."""

from __future__ import annotations

from dataclasses import replace
from itertools import count

import numpy as np

from imgquad_core.arrays import Floats, Ints
from imgquad_core.errors import InputError
from imgquad_core.model import PointKind, chain_segments

from .femesh import FEMesh, nodes_of_sides

LEAST_SHARE = 0.3  #: of the straight element's smallest Jacobian that its curved one must keep
HALVINGS = 4  #: of a curve that spoils an element, before it is made straight
GAUSS = (-np.sqrt(0.6), 0.0, np.sqrt(0.6))


def second_order(mesh: FEMesh, nodes: int = 8) -> FEMesh:
    """Return `mesh` with a node in the middle of each side, and in the middle of each quad if `nodes` is 9.

    Parameters
    ----------
    mesh : FEMesh
        Quads of 4 nodes, interfaces not split.
    nodes : int
        8 (Q8, CPS8, serendipity) or 9 (Q9, Lagrange).

    Returns
    -------
    FEMesh
        Nodes of `mesh` first, with their ids; then middles of sides, then centres. On a chain a middle lies on the
        cubic through the two ends and their neighbours (a parabola beside a corner or the end of a chain), so it is
        off the smooth boundary by O(h^4). A curve that would leave an element less than 0.3 of its straight one's
        smallest Jacobian, at the Gauss points or the corners, is made flatter, in the end straight: the Jacobian is
        positive wherever that of the straight element is.

    Raises
    ------
    InputError
        The mesh is not of four-node quads, was split, or `nodes` is neither 8 nor 9.
    """
    if nodes not in (8, 9):
        raise InputError(f"second order: quads have 8 or 9 nodes, not {nodes!r}")
    if mesh.kind != "quad4" or len(mesh.cohesive):
        raise InputError(f"second order starts from whole four-node quads, not from {mesh.kind}: raise the order first")
    edges, edge_of = _edges(mesh)
    bulge = _bulges(mesh, edges)
    middle = mesh.points[edges].mean(axis=1)
    share = _kept_share(mesh.points, mesh.cells, edge_of, middle, bulge)
    middle += share[:, None] * bulge
    cells, points = _with_middles(mesh.points, mesh.cells, edge_of, middle, nodes)
    kind = np.full(len(points), PointKind.INTERIOR, np.uint8)
    kind[: mesh.n_points] = mesh.point_kind
    raised = replace(mesh, points=points, kind=f"quad{nodes}", cells=cells, point_kind=kind)
    return replace(raised, node_sets=nodes_of_sides(raised))


def _edges(mesh: FEMesh) -> tuple[Ints, Ints]:
    """Each edge once (lowest node first), and the edge of each side of each quad, shape (n, 4)."""
    ends = np.stack([mesh.cells, np.roll(mesh.cells, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges, edge_of = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    return edges, edge_of.reshape(-1, 4)


def _bulges(mesh: FEMesh, edges: Ints) -> Floats:
    """From the middle of each edge to the curve: zero off the chains."""
    bulge = np.zeros((len(edges), 2))
    segments = chain_segments(mesh.chain_offsets, mesh.chain_points)
    if len(segments):
        before, after = _neighbours(mesh)
        off = _curve_middles(mesh.points, segments, before, after) - mesh.points[segments].mean(axis=1)
        key, wanted = (pairs[:, 0] * mesh.n_points + pairs[:, 1] for pairs in (edges, np.sort(segments, axis=1)))
        bulge[np.searchsorted(key, wanted)] = off
    return bulge


def _neighbours(mesh: FEMesh) -> tuple[Ints, Ints]:
    """For each segment of the chains the node before and behind it, -1 where the boundary starts, ends or turns."""
    before, after = [], []
    for c in range(len(mesh.chain_offsets) - 1):
        chain = mesh.chain_points[mesh.chain_offsets[c] : mesh.chain_offsets[c + 1]]
        if len(chain) < 2:
            continue
        closed = chain[0] == chain[-1]
        first, last = (chain[-2], chain[1]) if closed else (-1, -1)
        before.append(np.concatenate([[first], chain[:-2]]))
        after.append(np.concatenate([chain[2:], [last]]))
    segments = chain_segments(mesh.chain_offsets, mesh.chain_points)
    stops = np.isin(mesh.point_kind, (PointKind.CORNER, PointKind.JUNCTION))
    return (
        np.where(stops[segments[:, 0]], -1, np.concatenate(before)),
        np.where(stops[segments[:, 1]], -1, np.concatenate(after)),
    )


def _curve_middles(points: Floats, segments: Ints, before: Ints, after: Ints) -> Floats:
    """Where the polynomial through up to four nodes, by chord length, is half-way between the middle two.

    ``before -- a --x-- b -- after``: weights of Lagrange at x, those of missing nodes zero.
    """
    a, b = points[segments[:, 0]], points[segments[:, 1]]
    p = np.where(before[:, None] >= 0, points[before], a)
    q = np.where(after[:, None] >= 0, points[after], b)
    half = np.linalg.norm(b - a, axis=1) / 2
    t = np.stack([-half - np.linalg.norm(a - p, axis=1), -half, half, half + np.linalg.norm(q - b, axis=1)], axis=1)
    there = np.stack([before >= 0, np.ones(len(a), bool), np.ones(len(a), bool), after >= 0], axis=1)
    weights = np.zeros((len(a), 4))
    for i in range(4):
        weight = there[:, i].astype(float)
        for j in range(4):
            if j != i:
                distance = np.where(t[:, i] == t[:, j], 1.0, t[:, i] - t[:, j])
                weight = np.where(there[:, j] & there[:, i], weight * -t[:, j] / distance, weight)
        weights[:, i] = weight
    middles: Floats = np.einsum("ni,nik->nk", weights, np.stack([p, a, b, q], axis=1))
    return middles


def _kept_share(points: Floats, cells: Ints, edge_of: Ints, middle: Floats, bulge: Floats) -> Floats:
    """Share of its bulge that each edge keeps: halved, in the end zero, beside elements it would spoil."""
    share = np.ones(len(bulge))
    curved = np.flatnonzero(bulge.any(axis=1)[edge_of].any(axis=1))
    cells, edge_of = cells[curved], edge_of[curved]
    straight = _smallest_jacobian(points, cells, middle[edge_of])
    for step in count():
        now = middle + share[:, None] * bulge
        bad = _smallest_jacobian(points, cells, now[edge_of]) < LEAST_SHARE * straight
        spoilt = np.unique(edge_of[bad])
        if not share[spoilt].any():
            break
        share[spoilt] *= 0.5 if step < HALVINGS else 0.0
    return share


def _smallest_jacobian(points: Floats, cells: Ints, middles: Floats) -> Floats:
    """Smallest Jacobian determinant of 8-node quads at 3 x 3 Gauss points and at the corners.

    Q9 with its centre at the serendipity place is the same map, so this holds for it too.
    """
    nodes = np.concatenate([points[cells], middles], axis=1)
    smallest = np.full(len(cells), np.inf)
    for s, t in [(s, t) for s in GAUSS for t in GAUSS] + [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]:
        along = np.einsum("ka,nai->nki", serendipity_slopes(s, t), nodes)
        smallest = np.minimum(smallest, along[:, 0, 0] * along[:, 1, 1] - along[:, 0, 1] * along[:, 1, 0])
    return smallest


def serendipity_slopes(s: float, t: float) -> Floats:
    """Return the slopes of the 8 shape functions along s and t, shape (2, 8), on [-1, 1] x [-1, 1]."""
    si, ti = np.array([-1.0, 1.0, 1.0, -1.0]), np.array([-1.0, -1.0, 1.0, 1.0])
    slopes = np.empty((2, 8))
    slopes[0, :4] = si * (1 + t * ti) * (2 * s * si + t * ti) / 4
    slopes[1, :4] = ti * (1 + s * si) * (2 * t * ti + s * si) / 4
    slopes[0, 4:] = -s * (1 - t), (1 - t * t) / 2, -s * (1 + t), -(1 - t * t) / 2
    slopes[1, 4:] = -(1 - s * s) / 2, -t * (1 + s), (1 - s * s) / 2, -t * (1 - s)
    return slopes


def _with_middles(points: Floats, cells: Ints, edge_of: Ints, middle: Floats, nodes: int) -> tuple[Ints, Floats]:
    columns, parts = [cells, len(points) + edge_of], [points, middle]
    if nodes == 9:
        # the serendipity place of the centre: as if there were no ninth node
        centre = middle[edge_of].sum(axis=1) / 2 - points[cells].sum(axis=1) / 4
        columns.append(len(points) + len(middle) + np.arange(len(cells))[:, None])
        parts.append(centre)
    return np.concatenate(columns, axis=1), np.concatenate(parts)
