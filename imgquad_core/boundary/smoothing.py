"""Step 3 of the paper: smooth boundaries, cut into edges of the wanted length.

In this order: junctions and border ends move (`junctions`), local polynomials smooth the chains (`fitting`), every
point within a bound that keeps foreign boundaries apart; then edge lengths are wanted everywhere (`edge_sizes`), nodes
placed (`nodes`), tested exactly (`geometry.conflicts`), drawn back where they fail (`withdrawal`); the regions get back
their areas (`areas`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.geometry.conflicts import UNITS, snapped
from imgquad_core.model import VOID, BoundaryGraph, PointKind
from imgquad_core.threads import threads_of

from .averaging import averaged
from .curves import Curves, PixelChains, curves_of, per_point, pin_ends, pixel_chains
from .edge_sizes import edge_sizes
from .feature_size import local_feature_size
from .fitting import WINDOWS, fit_pieces
from .joins import join_short_chains
from .junctions import place_junctions
from .nodes import Nodes
from .oblong_pixels import stretch
from .options import SmoothingOptions
from .pores import pores_of
from .seams import Real, lay_seams, moved_areas, without_seams
from .sharp_corners import beside_corners, find_corners, place_corners
from .stairs import as_step, find_step, in_data_points
from .withdrawal import CrossedError, Draft, place_freely, restore_areas_freely
from .zooms import Step, larger, unrounded

_ROOM = 0.35  # of the local feature size of the pixel boundary: two foreign points that both move it cannot meet
_SHARE = 0.75  # of the largest shift that smoothing may use; the rest is for areas
_FOR_ARMS = 1.5  # of the largest shift, with a tolerance: regions get the areas of arms back that it took
_NARROW = 2.0  # px; least reach of the local feature size that bounds shifts
SEAM_ROOM = 1.5  # of the size asked for: seams keep it from boundaries, so that elements fit between
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
        The boundary that is meshed, with regions numbered as in `graph`, and the chains that are left in its order: an
        even number of edges for every piece between corners, on every chain; all points, and the points at even places
        alone, form polylines that neither cross nor touch. Coordinates are multiples of 2^-14 px.
    """
    return smooth_chains(graph, options or SmoothingOptions(), shape).graph


class Smoothed(NamedTuple):
    """A smoothed boundary, and which chains of the pixel boundary are left."""

    graph: BoundaryGraph
    which: Ints  #: (n_chains,) number of each chain among those of the pixel boundary


def smooth_chains(
    graph: BoundaryGraph,
    options: SmoothingOptions,
    shape: tuple[int, int] | None = None,
    barred: Flags | None = None,
    seams: Flags | None = None,
    as_pixels: Flags | None = None,
) -> Smoothed:
    """Do what `smooth_boundaries` does; `barred` chains are not joined, however short, `seams` move no others.

    Joined chains that are flagged `as_pixels` are not averaged, whatever the tolerance.
    """
    step = find_step(graph) if options.step == "auto" else as_step(options.step)
    pixels, pores = pixel_chains(graph), pores_of(graph)
    exact, step = unrounded(pixels, step) if seams is None else (pixels, step)  # tiles would see different sides
    true, threads = _TrueShape.of(graph.shape, shape, step), threads_of(options.threads)
    areas = np.append(graph.region_pixels, pores.pixels) * true.pixel
    if exact is not pixels:
        areas *= larger(pixels, exact, pores.sides, len(areas))
    chains, which = _joined(in_data_points(exact, step), options, true.unit, step, barred)
    width = 0.5 * options.tolerance / true.unit
    if width > 1.0:
        chains = averaged(chains, width, UNITS * np.array(step), as_pixels, threads=threads)
        true = _TrueShape.of(graph.shape, shape, (step[0] * width, step[1] * width))
    curves, ends = curves_of(*chains)
    curves, is_corner = find_corners(curves, threads=threads)
    is_seam = np.zeros(len(which), bool) if seams is None else seams[which]
    is_corner &= ~per_point(curves, is_seam)
    real = without_seams(curves, ends, is_seam)
    room = np.zeros(len(curves.raw))
    room[real.kept] = _room(real.curves, is_corner[real.kept], options.max_shift, threads)
    most, free = options.max_shift, room
    if width > 1.0:
        most, free = _FOR_ARMS * most, room.copy()
        free[real.kept] = _room(real.curves, is_corner[real.kept], most, threads)
    node = place_junctions(curves, real.ends, room, chains.graph.shape)
    smooth = _smooth(curves, node, is_corner, room, is_seam, threads)
    lay_seams(smooth, curves, is_seam, SEAM_ROOM * options.size / true.unit)
    if true.extent != chains.graph.shape:
        curves, ends, node, smooth = stretch(curves, ends, node, smooth, chains.graph.shape, true.extent)
        real = without_seams(curves, ends, is_seam)
    limit = per_point(curves, _asked_sizes(chains.graph, curves.is_frame, options) / true.unit)
    draft = Draft(
        curves, ends, smooth, node, is_corner, limit, options.edge_ratio, options.edge_multiple, true.extent,
        true.grid, is_seam, real.ends, threads,
    )  # fmt: skip
    try:
        nodes, gently = place_freely(draft, _wanted_sizes(draft, real, options.growth, threads))
    except CrossedError as crossed:  # every second point of averaged chains may cross where the chains do not
        before = np.zeros(len(which), bool) if as_pixels is None else as_pixels
        if width <= 1.0 or before[crossed.chains].all():
            raise
        return smooth_chains(graph, options, shape, barred, seams, before | crossed.chains)
    sides = pores.sides[which]
    wanted = areas / true.unit**2 + moved_areas(smooth, curves, is_seam, sides, len(areas))
    nodes = restore_areas_freely(sides, wanted, draft, nodes, free, most, gently)
    nodes = nodes._replace(points=snapped(nodes.points * true.unit))
    region_pixels = np.maximum(np.rint(areas[: len(graph.region_pixels)]), 1).astype(np.int64)
    return Smoothed(_graph(replace(chains.graph, shape=true.shape, region_pixels=region_pixels), draft, nodes), which)


class _TrueShape(NamedTuple):
    """Lengths in which curves are cut into edges."""

    shape: tuple[int, int]  # (n_rows, n_cols) of the boundary that is made
    unit: float  # its pixels a unit of length
    extent: tuple[float, float]  # height and width in these units
    pixel: float  # area of a pixel of the picture, in its pixels

    @property
    def grid(self) -> float:
        """Steps of the grid on which coordinates are exact, a unit of length."""
        return UNITS * self.unit

    @staticmethod
    def of(old: tuple[int, int], new: tuple[int, int] | None, step: Step) -> _TrueShape:
        """Make the unit one data point, as if it were square."""
        rows, cols = new or old
        unit = float(np.sqrt(step[0] * step[1])) * min(rows / old[0], cols / old[1])
        pixel = rows * cols / (old[0] * old[1])
        return _TrueShape((rows, cols), unit, (rows / unit, cols / unit), pixel)


def _joined(
    chains: PixelChains, options: SmoothingOptions, unit: float, step: Step, barred: Flags | None
) -> tuple[PixelChains, Ints]:
    """Join short chains, in data points; also return the old number of each chain."""
    usual = max(2.0 * options.max_shift, options.tolerance / unit)
    shortest = usual if options.join is None else options.join / unit
    farthest = max(0.5 * shortest, options.max_shift)
    joined = join_short_chains(chains, shortest, farthest, UNITS * np.array(step), barred)
    return joined.chains, joined.which


def _asked_sizes(graph: BoundaryGraph, is_frame: Flags, options: SmoothingOptions) -> Floats:
    """Asked length of final edges, for each chain."""
    of_region = np.empty((2, len(graph.region_label) + 1))  # inside the picture, on its border
    of_region[0], of_region[1] = options.boundary_size or options.size, options.frame_size or options.size
    of_region[:, VOID] = np.inf
    for label, size in (options.material_sizes or {}).items():
        of_region[:, :-1][:, graph.region_label == label] = size
    asked = of_region[is_frame.astype(np.int64)[:, None], graph.chain_regions].min(axis=1)
    beside = np.sort(np.append(graph.region_label, VOID)[graph.chain_regions], axis=1)
    for pair, size in (options.sizes_between or {}).items():
        asked[(beside == sorted(pair)).all(axis=1)] = size
    return np.asarray(asked)


def _wanted_sizes(draft: Draft, real: Real, growth: float, threads: int) -> Floats:
    """Return the wanted length of edges; of seams it is the asked one."""
    size, kept = draft.limit.copy(), real.kept
    size[kept] = edge_sizes(
        draft.smooth[kept], real.curves, draft.limit[kept], draft.is_corner[kept], growth, draft.edge_ratio,
        draft.shape, threads=threads,
    )  # fmt: skip
    return size


def _room(curves: Curves, is_corner: Flags, max_shift: float, threads: int) -> Floats:
    """How far smoothing may move each dense point."""
    reach = max(_NARROW, max_shift / _ROOM)
    corner = beside_corners(curves, is_corner)
    free = _ROOM * local_feature_size(curves.raw, curves, reach, _ARC_RATIO, corner, threads=threads)
    return np.asarray(np.minimum(free, np.where(is_corner, 1.0, _SHARE) * max_shift * curves.scale))


def _smooth(curves: Curves, node: Floats, is_corner: Flags, room: Floats, is_seam: Flags, threads: int) -> Floats:
    """Smooth all chains but seams between their moved ends and corners, within `room` of the pixel boundary."""
    pinned = curves.raw.copy()
    place_corners(curves, is_corner, room, pinned)
    pin_ends(pinned, curves, node)
    pieces, closed = _pieces(curves, is_corner, curves.is_frame | is_seam)
    fitted = fit_pieces(
        pinned, curves.arc, curves.weight, curves.scale, pieces, closed, np.array(WINDOWS), threads=threads
    )
    shift = fitted - curves.raw
    length = np.hypot(shift[:, 0], shift[:, 1])
    smooth: Floats = curves.raw + shift * np.minimum(1.0, room / np.maximum(length, 1e-300))[:, None]
    pin_ends(smooth, curves, node)
    return smooth


def _pieces(curves: Curves, is_corner: Flags, straight: Flags) -> tuple[Ints, Flags]:
    """Find both end points of each piece between corners, of chains that are not straight; tell which are loops."""
    is_cut = is_corner.copy()
    is_cut[curves.offsets[:-1]] = is_cut[curves.offsets[1:] - 1] = True
    cuts = np.flatnonzero(is_cut)
    chain = np.searchsorted(curves.offsets, cuts, side="right") - 1
    inner = (chain[1:] == chain[:-1]) & ~straight[chain[:-1]]
    pieces = np.stack([cuts[:-1], cuts[1:]], axis=1)[inner]
    return pieces, ((curves.ends[:, 0] < 0)[chain[:-1]] & ~is_corner[cuts[:-1]])[inner]


def _graph(graph: BoundaryGraph, draft: Draft, nodes: Nodes) -> BoundaryGraph:
    offsets, chain_points = nodes.placed.offsets, nodes.chain_points
    kind = np.full(len(nodes.points), PointKind.FREE, np.uint8)
    kind[chain_points[np.repeat(draft.curves.is_frame, np.diff(offsets))]] = PointKind.FRAME
    kind[chain_points[nodes.placed.is_corner]] = PointKind.CORNER
    kind[: len(draft.node)] = draft.ends.kind
    return replace(graph, points=nodes.points, point_kind=kind, chain_offsets=offsets, chain_points=chain_points)
