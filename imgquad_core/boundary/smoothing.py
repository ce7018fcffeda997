"""Step 3 of the paper: smooth boundaries, cut into edges of the wanted length.

In this order: junctions and border ends move (`junctions`), local polynomials smooth the chains (`fitting`), every
point within a bound that keeps foreign boundaries apart; then edge lengths are wanted everywhere (`edge_sizes`), nodes
placed (`nodes`), tested exactly (`geometry.conflicts`), drawn back where they fail (`withdrawal`); the regions get back
their areas (`areas`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.model import VOID, BoundaryGraph, PointKind

from .curves import Curves, curves_of, per_point, pin_ends
from .edge_sizes import edge_sizes
from .feature_size import local_feature_size
from .fitting import WINDOWS, fit_pieces
from .junctions import place_junctions
from .nodes import Nodes
from .options import SmoothingOptions
from .sharp_corners import beside_corners, find_corners, place_corners
from .true_shape import stretch
from .withdrawal import Draft, place_freely, restore_areas_freely

_ROOM = 0.35  # of the local feature size of the pixel boundary: two foreign points that both move it cannot meet
_SHARE = 0.75  # of the largest shift that smoothing may use; the rest is for areas
_NARROW = 2.0  # px; least reach of the local feature size that bounds shifts
_ARC_RATIO = 2.0  # arc over distance of a foreign point of the pixel boundary


def smooth_boundaries(
    graph: BoundaryGraph, options: SmoothingOptions | None = None, shape: tuple[int, int] | None = None
) -> BoundaryGraph:
    """Smooth a pixel boundary and cut it into edges of the wanted length.

    Parameters
    ----------
    graph : BoundaryGraph
        What `extract_boundaries` gave.
    options : SmoothingOptions, optional
        Sizes and limits.
    shape : tuple of int, optional
        (height, width) of the picture in true shape where pixels are not square: the boundary is smoothed in pixels,
        stretched to [0, width] x [0, height], and cut into edges there.

    Returns
    -------
    BoundaryGraph
        The boundary that is meshed, with chains and regions numbered as in `graph`: an even number of edges for
        every piece between corners, on every chain; all points, and the points at even places alone, form polylines
        that neither cross nor touch. Coordinates are multiples of 2^-14 px.
    """
    options = options or SmoothingOptions()
    curves, ends = curves_of(graph)
    curves, is_corner = find_corners(curves)
    limit = per_point(curves, _asked_sizes(graph, options))
    room = _room(curves, is_corner, options.max_shift)
    node = place_junctions(curves, ends, room, graph.shape)
    smooth = _smooth(curves, node, is_corner, room)
    if shape is not None:
        graph, curves, ends, node, smooth = stretch(graph, curves, ends, node, smooth, shape)
    draft = Draft(curves, ends, smooth, node, is_corner, limit, options.edge_ratio, options.edge_multiple, graph.shape)
    size = edge_sizes(smooth, curves, limit, is_corner, options.growth, options.edge_ratio, graph.shape)
    nodes, gently = place_freely(draft, size)
    nodes = restore_areas_freely(graph, draft, nodes, room, options.max_shift, gently)
    return _graph(graph, draft, nodes)


def _asked_sizes(graph: BoundaryGraph, options: SmoothingOptions) -> Floats:
    """Asked length of final edges, for each chain."""
    of_region = np.full(len(graph.region_label) + 1, float(options.boundary_size or options.size))
    of_region[VOID] = np.inf
    for label, size in (options.material_sizes or {}).items():
        of_region[:-1][graph.region_label == label] = size
    return np.asarray(of_region[graph.chain_regions].min(axis=1))


def _room(curves: Curves, is_corner: Flags, max_shift: float) -> Floats:
    """How far smoothing may move each dense point."""
    reach = max(_NARROW, max_shift / _ROOM)
    corner = beside_corners(curves, is_corner)
    free = _ROOM * local_feature_size(curves.raw, curves, reach, _ARC_RATIO, corner)
    return np.asarray(np.minimum(free, np.where(is_corner, 1.0, _SHARE) * max_shift))


def _smooth(curves: Curves, node: Floats, is_corner: Flags, room: Floats) -> Floats:
    """Smooth all chains between their moved ends and corners, within `room` of the pixel boundary."""
    pinned = curves.raw.copy()
    place_corners(curves, is_corner, room, pinned)
    pin_ends(pinned, curves, node)
    pieces, closed = _pieces(curves, is_corner)
    fitted = fit_pieces(pinned, curves.arc, curves.weight, pieces, closed, np.array(WINDOWS))
    shift = fitted - curves.raw
    length = np.hypot(shift[:, 0], shift[:, 1])
    smooth: Floats = curves.raw + shift * np.minimum(1.0, room / np.maximum(length, 1e-300))[:, None]
    pin_ends(smooth, curves, node)
    return smooth


def _pieces(curves: Curves, is_corner: Flags) -> tuple[Ints, Flags]:
    """Find the first and last dense point of each piece between corners, off the border; tell which are whole loops."""
    is_cut = is_corner.copy()
    is_cut[curves.offsets[:-1]] = is_cut[curves.offsets[1:] - 1] = True
    cuts = np.flatnonzero(is_cut)
    chain = np.searchsorted(curves.offsets, cuts, side="right") - 1
    inner = (chain[1:] == chain[:-1]) & ~curves.is_frame[chain[:-1]]
    pieces = np.stack([cuts[:-1], cuts[1:]], axis=1)[inner]
    return pieces, ((curves.ends[:, 0] < 0)[chain[:-1]] & ~is_corner[cuts[:-1]])[inner]


def _graph(graph: BoundaryGraph, draft: Draft, nodes: Nodes) -> BoundaryGraph:
    offsets, chain_points = nodes.placed.offsets, nodes.chain_points
    kind = np.full(len(nodes.points), PointKind.FREE, np.uint8)
    kind[chain_points[np.repeat(draft.curves.is_frame, np.diff(offsets))]] = PointKind.FRAME
    kind[chain_points[nodes.placed.is_corner]] = PointKind.CORNER
    kind[: len(draft.node)] = draft.ends.kind
    return replace(graph, points=nodes.points, point_kind=kind, chain_offsets=offsets, chain_points=chain_points)
