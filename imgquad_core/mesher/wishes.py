"""What lies near a poor quad is filled anew; where it is at a boundary, that with edges halved, if nothing else helps.

Places are looked at from the worst one on, as many in a round as do not feel each other; each is kept or given up by
its own worst quad.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.chains import edges_of_chains, near_segments, with_mid_points
from imgquad_core.cleanup.areas import Area
from imgquad_core.geometry.quad_shape import lower_to_worst
from imgquad_core.grouping import grouped, linked
from imgquad_core.measures.quality import scaled_jacobian
from imgquad_core.model import BoundaryGraph, PointKind, QuadMesh

from .options import MeshingOptions
from .refilling import REACH, Fill, refilled, refilled_however, within
from .strides import near_seams

SMALL = 48  #: edges around a face all of which are halved where those that poor quads touch do not do
FARTHEST = 3  #: segments before and after those that poor quads touch; beyond that a place is given up
WIDTH = 1.5  #: of quads, in mean ones: few within `REACH` quads are farther away; such are left as they are


class Spot(NamedTuple):
    """Poor quads, and all that may change for them."""

    places: Ints  #: entries of `chain_points` behind which an edge is to be halved
    poor: Ints
    quads: Ints


def with_wishes(mesh: QuadMesh, shape: tuple[int, int], fill: Fill, options: MeshingOptions) -> QuadMesh:
    """Fill anew what lies near poor quads, then also with edges beside them halved; what gets better by that is kept.

    Parameters
    ----------
    mesh : QuadMesh
        Its boundary points come first.
    shape : tuple of int
        Of the picture.
    fill : callable
        Fills a boundary, all points of which stay.
    options : MeshingOptions
        Sizes, and what is poor.
    """
    in_vain = np.empty(0, complex)  # where poor quads are, once for each time that filling anew did not help
    for _ in range(options.tuning.wishes):
        graph = _graph_of(mesh, shape)
        spots = _apart(_spots(mesh, graph, in_vain, options.tuning.worst), mesh.n_quads)
        if not spots:
            break
        tried = _tried(mesh, graph, spots, fill, options.n_threads)
        better = {
            spot.poor[0]
            for found in tried
            for spot, is_better in zip(found.spots, found.better, strict=True)
            if is_better
        }
        poor = [spot.poor for spot in spots if spot.poor[0] not in better]
        in_vain = np.concatenate([in_vain, *(_places_of(mesh, quads) for quads in poor)])
        if better:
            mesh = _with_better(mesh, graph, tried)
    return mesh


def _places_of(mesh: QuadMesh, quads: Ints) -> NDArray[np.complex128]:
    """Return where quads are, each as one value."""
    places: NDArray[np.complex128] = mesh.points[mesh.quads[quads]].sum(axis=1).view(complex).ravel()
    return places


def _graph_of(mesh: QuadMesh, shape: tuple[int, int]) -> BoundaryGraph:
    """Return the boundary of a mesh."""
    n = int(mesh.chain_points.max()) + 1
    pixels = np.bincount(mesh.quad_region, minlength=len(mesh.region_label))  # nobody asks for areas
    return BoundaryGraph(mesh.points[:n], mesh.point_kind[:n], *mesh.chains, mesh.region_label, pixels, shape)


def _spots(mesh: QuadMesh, graph: BoundaryGraph, in_vain: NDArray[np.complex128], limit: float) -> Iterator[Spot]:
    """Find the places with poor quads, the worst one first.

    At first no edges are halved there, then those that poor quads touch, then more, with each time that was in vain.
    """
    is_seam = mesh.point_kind == PointKind.SEAM
    poor, worst = poor_quads(mesh.points, mesh.quads, mesh.quad_region, is_seam, limit)
    reach = _times(_places_of(mesh, poor), in_vain) - 1
    left = reach <= FARTHEST
    poor, worst, reach = poor[left], worst[left], reach[left]
    if not len(poor):
        return
    quad, node = _touched(mesh, graph, poor, reach)
    places = np.flatnonzero(_may_be_halved(graph) & _near(graph, node, reach[quad]))
    run = np.cumsum(np.diff(places, prepend=-2) > 1) - 1  # an entry without an edge lies between two chains
    ends = np.append(graph.chain_points[places], graph.chain_points[places + 1])
    n_runs = int(run.max(initial=-1)) + 1
    group = _groups(np.append(np.tile(run, 2), n_runs + quad), np.append(ends, node), n_runs + len(poor))
    least = np.ones(len(group))
    np.minimum.at(least, group[n_runs:], worst)
    edge = np.sqrt(graph.shape[0] * graph.shape[1] / mesh.n_quads)
    cells = _Cells.of(mesh, graph.shape, REACH * WIDTH * float(edge), np.append(ends, node))
    at, of = (_rows(each, len(group)) for each in (group[run], group[n_runs:]))
    for g in np.argsort(least, kind="stable"):
        if least[g] == 1.0:  # there is no such group, or no poor quad in it
            break
        yield _spot(mesh, graph, places[at[g]], poor[of[g]], cells)


def _times(values: NDArray[np.complex128], among: NDArray[np.complex128]) -> Ints:
    """Return how often each value is among others."""
    ordered = np.sort(among)
    return np.asarray(np.searchsorted(ordered, values, "right") - np.searchsorted(ordered, values))


def _near(graph: BoundaryGraph, node: Ints, reach: Ints) -> Flags:
    """Tell the entries of `chain_points` behind which is an edge within reach of nodes, each with its own."""
    near, on_chains = np.zeros(len(graph.chain_points), bool), node < len(graph.points)
    for r in np.unique(reach[reach >= 0]).tolist():
        near |= near_segments(graph, node[on_chains & (reach == r)], r)
    return near


def _rows(group: Ints, n: int) -> list[Ints]:
    """Return the places of each group."""
    return np.split(np.argsort(group, kind="stable"), np.cumsum(np.bincount(group, minlength=n))[:-1])


def _groups(thing: Ints, node: Ints, n: int) -> Ints:
    """Return the group of each of n things; those that have a node in common are of one."""
    nodes, name = np.unique(node, return_inverse=True)
    return linked(thing, n + name.ravel(), n + len(nodes))[0][:n]


def poor_quads(points: Floats, quads: Ints, region: Ints, is_seam: Flags, limit: float) -> tuple[Ints, Floats]:
    """Return the quads not above a scaled Jacobian, and theirs; those near seams of their region do not count."""
    sj = scaled_jacobian(points, quads)
    poor = np.flatnonzero(sj <= limit)
    if len(poor) and is_seam.any():
        cut = np.unique(region[is_seam[quads].sum(axis=1) >= 2])  # others have at most the end of a seam
        poor = poor[~(near_seams(quads, is_seam)[poor] & np.isin(region[poor], cut))]
    return poor, sj[poor]


def _touched(mesh: QuadMesh, graph: BoundaryGraph, poor: Ints, reach: Ints) -> tuple[Ints, Ints]:
    """Return pairs of a poor quad, by its place among them, and a node: its own, and one of the boundary at least.

    Where more than what it touches is to be halved, all of a small face's boundary is.
    """
    corners, region = mesh.quads[poor], mesh.quad_region[poor]
    is_small = (_edges_around(graph)[region] <= SMALL) & (reach > 0)
    is_alone = (corners >= len(graph.points)).all(axis=1)
    quads, nodes = [np.repeat(np.arange(len(poor)), 4)], [corners.ravel()]
    begin, sides = grouped(graph.chain_regions + 1, len(graph.region_label) + 1)  # VOID is the first one
    for k in np.flatnonzero(is_small | is_alone):
        beside = sides[begin[region[k] + 1] : begin[region[k] + 2]] // 2
        rim = np.unique(np.concatenate([graph.chain(c) for c in beside]))
        more = rim if is_small[k] else _nearest(graph, rim, mesh.points[corners[k]].mean(axis=0))
        quads.append(np.full(len(more), k))
        nodes.append(more)
    return np.concatenate(quads), np.concatenate(nodes)


def _edges_around(graph: BoundaryGraph) -> Ints:
    """Return the number of edges around each face."""
    counts = np.zeros(len(graph.region_label) + 1, np.int64)  # VOID is the last entry
    np.add.at(counts, graph.chain_regions, edges_of_chains(graph)[:, None])
    return counts[:-1]


def _nearest(graph: BoundaryGraph, nodes: Ints, place: Floats) -> Ints:
    """Return the one of some nodes that is nearest to a place, one that nobody holds if there is any."""
    gaps = np.hypot(*(graph.points[nodes] - place).T)
    nearest: Ints = nodes[np.lexsort((gaps, graph.point_kind[nodes] >= PointKind.HELD))[:1]]
    return nearest


def _may_be_halved(graph: BoundaryGraph) -> Flags:
    """Tell the entries of `chain_points` behind which is an edge that nobody holds."""
    is_held = graph.point_kind[graph.chain_points] >= PointKind.HELD
    free = ~is_held & ~np.roll(is_held, -1)
    free[graph.chain_offsets[1:] - 1] = False
    return np.asarray(free)


class _Cells(NamedTuple):
    """Which quads begin in each square of a grid near some places."""

    side: float  #: px
    across: int  #: number of squares in a row
    begin: Ints  #: of each square in `quads`
    quads: Ints

    @staticmethod
    def of(mesh: QuadMesh, shape: tuple[int, int], side: float, nodes: Ints) -> _Cells:
        """Sort the quads of a mesh that are near some nodes."""
        down, across = (int(n // side) + 1 for n in shape)
        column, row = (mesh.points // side).astype(np.int64).T
        cell = row * across + column
        is_near = np.zeros((down + 2, across + 2), bool)
        for up, right in product((0, 1, 2), repeat=2):
            is_near[row[nodes] + up, column[nodes] + right] = True
        near = is_near[1:-1, 1:-1].ravel()
        first = cell[mesh.quads[:, 0]]
        quads = np.flatnonzero(near[first])
        counts = np.bincount(first[quads], minlength=down * across)
        order = np.argsort(first[quads], kind="stable")
        return _Cells(side, across, np.append(0, np.cumsum(counts)), quads[order])

    def near(self, points: Floats) -> Ints:
        """Return the quads in squares that points are in, and in those around and between."""
        low, high = ((bound // self.side).astype(int) for bound in (points.min(axis=0), points.max(axis=0)))
        rows = range(max(low[1] - 1, 0), min(high[1] + 2, (len(self.begin) - 1) // self.across))
        first, last = max(low[0] - 1, 0), min(high[0] + 2, self.across)
        found = [self.quads[self.begin[r * self.across + first] : self.begin[r * self.across + last]] for r in rows]
        return np.concatenate(found)


def _spot(mesh: QuadMesh, graph: BoundaryGraph, places: Ints, poor: Ints, cells: _Cells) -> Spot:
    """Return a place with all that filling it anew can change: the quads within `REACH`, none across a boundary."""
    chains = np.searchsorted(graph.chain_offsets, places, "right") - 1
    regions = np.unique(np.append(graph.chain_regions[chains].ravel(), mesh.quad_region[poor]))
    ends = np.append(graph.chain_points[places], graph.chain_points[places + 1])
    here = cells.near(mesh.points[np.append(ends, mesh.quads[poor].ravel())])
    here = np.sort(here[np.isin(mesh.quad_region[here], regions)])
    begin = np.isin(mesh.quads[here], ends).any(axis=1) | np.isin(here, poor)
    part = np.searchsorted(regions, mesh.quad_region[here])
    return Spot(places, poor, here[within(mesh.quads[here], part, begin, REACH)])


def _apart(spots: Iterator[Spot], n_quads: int) -> list[Spot]:
    """Return those that share no quad with one before."""
    taken, found = np.zeros(n_quads, bool), []
    for spot in spots:
        if not taken[spot.quads].any():
            taken[spot.quads] = True
            found.append(spot)
    return found


class _Tried(NamedTuple):
    """What is near some places, filled anew."""

    spots: list[Spot]
    used: Ints  #: nodes of the mesh that the area's points begin with; mid-points follow
    area: Area  #: a part for each region at each spot
    of_part: Ints  #: place of its spot
    region: Ints  #: its region
    better: Flags  #: whether the worst quad of each spot is


def _tried(mesh: QuadMesh, graph: BoundaryGraph, spots: list[Spot], fill: Fill, threads: int) -> list[_Tried]:
    """Fill anew what is near spots: all at once, or in halves where that fails."""
    quads = np.concatenate([spot.quads for spot in spots])
    which = np.repeat(np.arange(len(spots)), [len(spot.quads) for spot in spots])
    names, part = np.unique(which * len(mesh.region_label) + mesh.quad_region[quads], return_inverse=True)
    of_part, region = np.divmod(names, len(mesh.region_label))
    used, corners = np.unique(mesh.quads[quads], return_inverse=True)
    old = Area(mesh.points[used], corners.reshape(-1, 4), part.ravel())
    places = np.sort(np.concatenate([spot.places for spot in spots]))
    ends = np.stack([graph.chain_points[places], graph.chain_points[places + 1]], axis=1)
    begin = np.isin(quads, np.concatenate([spot.poor for spot in spots]))
    how = refilled if len(spots) > 1 else refilled_however
    new = how(old, begin, np.searchsorted(used, ends), mesh.region_label[region], fill, threads)
    if new is None:
        half = len(spots) // 2
        return [
            found for some in (spots[:half], spots[half:]) if half for found in _tried(mesh, graph, some, fill, threads)
        ]
    before, after = np.ones((2, len(spots)))
    lower_to_worst(old.points, old.quads, of_part[old.part], before)
    lower_to_worst(new.points, new.quads, of_part[new.part], after)
    return [_Tried(spots, used, new, of_part, region, after > before)]


def _with_better(mesh: QuadMesh, graph: BoundaryGraph, tried: list[_Tried]) -> QuadMesh:
    """Return the mesh with what is better at some spots."""
    split, gone = np.zeros(len(graph.chain_points), bool), np.zeros(mesh.n_quads, bool)
    for found in tried:
        for spot in (found.spots[s] for s in np.flatnonzero(found.better)):
            split[spot.places] = gone[spot.quads] = True
    finer = with_mid_points(graph, split)
    n, more = len(graph.points), len(finer.points) - len(graph.points)
    shifted = np.arange(mesh.n_points) + more * (np.arange(mesh.n_points) >= n)
    points, quads, region = [finer.points, mesh.points[n:]], [shifted[mesh.quads[~gone]]], [mesh.quad_region[~gone]]
    middle = n - 1 + np.cumsum(split)  # of each entry behind which an edge was halved
    count = mesh.n_points + more
    for found in tried:
        places = np.sort(np.concatenate([spot.places for spot in found.spots]))
        n_inner = len(found.area.points) - len(found.used) - len(places)
        ids = np.concatenate([shifted[found.used], middle[places], count + np.arange(n_inner)])
        kept = found.better[found.of_part][found.area.part]
        quads.append(ids[found.area.quads[kept]])
        region.append(found.region[found.area.part[kept]])
        points.append(found.area.points[len(ids) - n_inner :])
        count += n_inner
    return _compact(mesh, finer, np.concatenate(points), np.concatenate(quads), np.concatenate(region))


def _compact(mesh: QuadMesh, graph: BoundaryGraph, points: Floats, quads: Ints, region: Ints) -> QuadMesh:
    """Return the mesh of quads without points that none of them has."""
    used = np.zeros(len(points), bool)
    used[quads] = used[: len(graph.points)] = True
    kind = np.full(np.count_nonzero(used), PointKind.INTERIOR, np.uint8)
    kind[: len(graph.points)] = graph.point_kind
    return replace(
        mesh, points=points[used], point_kind=kind, quads=(np.cumsum(used) - 1)[quads], quad_region=region,
        chain_offsets=graph.chain_offsets, chain_points=graph.chain_points,
    )  # fmt: skip
