"""Edges of shared chains halved in a mesh that is there: what lies near them is filled anew, all else stays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Floats, Ints
from imgquad_core.cleanup.areas import Area
from imgquad_core.cleanup.strips import nodes_around
from imgquad_core.errors import TopologyError
from imgquad_core.mesher import MeshingOptions, fill_held
from imgquad_core.mesher.refilling import refilled_however
from imgquad_core.mesher.wishes import poor_quads

from .meshes import TileMesh, bits_of, part_of
from .outlines import EdgesOf, Outlines

BESIDE = 1  #: quads between a poor one and a boundary that may be the cause


class Edges(NamedTuple):
    """Edges of a boundary by the places of their ends, px."""

    tails: Floats  #: (n, 2)
    heads: Floats  #: (n, 2)


def wished_edges(mesh: TileMesh, outlines: Outlines, worst: float, reach: int) -> Ints:
    """Return the edges of shared chains that a tile would halve for poor quads: rows of a chain's key and an edge.

    Those are the four of each segment of stride 4 (else two) that such a quad, or one beside it, touches, and `reach`
    segments before and after; seams count for nothing, as they will be gone.
    """
    poor, _ = poor_quads(*mesh, worst)
    is_poor = np.zeros(len(mesh.points), bool)
    is_poor[mesh.quads[poor]] = True
    touched = np.unique(bits_of(mesh.points[nodes_around(mesh.quads, is_poor, BESIDE)]))
    found = [no_edges()]
    for c in np.flatnonzero(outlines.shared & ~outlines.seam) if len(touched) else ():
        points = outlines.points[outlines.ids[outlines.offsets[c] : outlines.offsets[c + 1]]]
        inner = points if outlines.closed[c] else points[1:-1]
        at = np.flatnonzero(np.isin(bits_of(inner), touched)) + (0 if outlines.closed[c] else 1)
        edges = _edges_beside(at, len(points) - 1, reach)
        found.append(np.column_stack([np.tile(outlines.key[c], (len(edges), 1)), edges]))
    return np.concatenate(found)


def no_edges() -> Ints:
    """Return no edge at all, as `wished_edges` does."""
    return np.empty((0, 5), np.int64)


def all_edges(outlines: Outlines) -> Ints:
    """Return all edges of shared chains, as `wished_edges` does: of a tile that cannot be meshed without."""
    counts = np.diff(outlines.offsets)[outlines.shared] - 1
    places = np.concatenate([np.empty(0, np.int64), *map(np.arange, counts)])
    return np.column_stack([np.repeat(outlines.key[outlines.shared], counts, axis=0), places])


def _edges_beside(at: Ints, n_edges: int, reach: int) -> Ints:
    """Return the edges of the segments around some places of a chain."""
    stride = 4 if n_edges % 4 == 0 else 2
    is_wished = np.zeros(n_edges // stride, bool)
    for place in at.tolist():
        first, last = (place - 1) // stride - reach, place // stride + reach  # between two segments: both
        is_wished[max(first, 0) : last + 1] = True
    return np.flatnonzero(np.repeat(is_wished, stride))


def edges_of(outlines: Outlines, which: EdgesOf) -> Edges:
    """Return some edges of shared chains, given by the chains' keys."""
    tails, heads = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for c in np.flatnonzero(outlines.shared):
        edges = sorted(which.get(tuple(outlines.key[c].tolist()), ()))
        ids = outlines.ids[outlines.offsets[c] : outlines.offsets[c + 1]]
        tails.append(ids[edges])
        heads.append(ids[1:][edges])
    return Edges(outlines.points[np.concatenate(tails)], outlines.points[np.concatenate(heads)])


def with_edges_halved(mesh: TileMesh, edges: Edges, outlines: Outlines, options: MeshingOptions) -> TileMesh | None:
    """Return the mesh with edges of its boundary halved.

    Parameters
    ----------
    mesh : TileMesh
        Of a tile.
    edges : Edges
        On its boundary.
    outlines : Outlines
        Of the tile: what its faces are made of.
    options : MeshingOptions
        How faces are filled.

    Returns
    -------
    TileMesh or None
        None where that does not do: the tile must be meshed as a whole.
    """
    if not len(edges.tails):
        return mesh
    regions, part = np.unique(mesh.region, return_inverse=True)
    label = dict(zip(outlines.region.tolist(), outlines.label.tolist(), strict=True))
    labels = np.array([label[region] for region in regions.tolist()], np.int32)
    ends = _nodes_at(mesh, np.concatenate([edges.tails, edges.heads])).reshape(2, -1).T
    area, nowhere = Area(mesh.points, mesh.quads, part.ravel()), np.zeros(len(mesh.quads), bool)
    new = refilled_however(area, nowhere, ends, labels, lambda graph: fill_held(graph, options), options.n_threads)
    if new is None:
        return None
    seam = np.append(mesh.seam, np.zeros(len(new.points) - len(mesh.points), bool))
    return part_of(TileMesh(new.points, new.quads, regions[new.part], seam), np.ones(len(new.quads), bool))


def _nodes_at(mesh: TileMesh, places: Floats) -> Ints:
    """Return the node at each place.

    Raises
    ------
    TopologyError
        There is none: two tiles would not fit.
    """
    nodes = np.flatnonzero(np.isin(mesh.points[:, 0], places[:, 0]))
    bits, first = np.unique(bits_of(mesh.points[nodes]), return_index=True)
    wanted = bits_of(places)
    if (lost := np.flatnonzero(~np.isin(wanted, bits))).size:
        raise TopologyError(f"the mesh of a tile lacks an end of a shared edge, {places[lost[0]].tolist()}")
    found: Ints = nodes[first[np.searchsorted(bits, wanted)]]
    return found
