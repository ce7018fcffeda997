"""Nodes without conflicts: placed, tested exactly, and drawn back towards the pixel boundary where they fail.

Where polylines cross, come too close or meet at less than 35 degrees, the wanted edges get shorter and the curve is
blended by thirds with the pixel boundary, which has gaps of 0.7 px everywhere. Chains that still fail in the end get
exactly their pixels' points: these never cross, so the loop ends whatever the picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Bytes, Flags, Floats, Ints
from imgquad_core.chains import any_of_chain, places_of
from imgquad_core.errors import TopologyError
from imgquad_core.geometry.conflicts import CROSSING, FREE, SHARP, UNITS, find_conflicts, snapped
from imgquad_core.jit import kernel
from imgquad_core.model import Chains
from imgquad_core.threads import LEAST, even_parts, in_threads

from .areas import mitres, restore_areas
from .curves import Curves, Ends, per_point, pin
from .edge_sizes import grade_along, grade_chains
from .nodes import (
    Nodes,
    Placement,
    Strided,
    even_out,
    joined,
    mark_conflicts,
    mark_sectors,
    number_nodes,
    on_stride,
    place_nodes,
    points_at,
)

_CLOSER, _LESS_CLOSE = 0.6, 0.8  # factors on the wanted length, at crossings and at sharp sectors
_CLOSEST = 0.25  # px, least wanted length of an edge: half the 0.5 px of thin places, as pixels leave 0.7 px
_AREA_ROOM = 0.7  # of how far smoothing could move a point: the shift for areas leaves the rest as a gap to others
_AREA_ROUNDS = (
    10  # of shifting and testing; a bound in conflict is halved once, then 0: after these nodes stay as placed
)
_KINK = 0.3  # px of shift for areas that may come or go in a px of arc: a turn of at most 17 degrees


class CrossedError(TopologyError):
    """Chains cross or touch, even where they are."""

    def __init__(self, chains: Flags) -> None:
        super().__init__("chains of the pixel boundary itself cross or touch")
        self.chains = chains  #: (n_chains,)


class Patience(NamedTuple):
    """After how many rounds what is given up: handed down, so that a test can ask for less."""

    closer: int = 2  #: rounds that only place nodes closer together, unless a sector is too sharp
    gentle: int = 8  #: rounds that mind sectors and room; later ones mind crossings only
    curved: int = 14  #: rounds after which chains with crossings get their pixels back
    most: int = 20  #: rounds after which all chains do


PATIENCE = Patience()


class Draft(NamedTuple):
    """Smoothed curves that nodes go on."""

    curves: Curves
    ends: Ends
    smooth: Floats  #: (n, 2) dense points
    node: Floats  #: (n_nodes, 2) place of the ends
    is_corner: Flags  #: (n,) dense points that become nodes
    limit: Floats  #: (n,) asked length of final edges
    edge_ratio: float
    edge_multiple: int  #: very long pieces get a multiple of this many final edges
    shape: tuple[float, float]
    units: float = UNITS  #: steps of the grid on which coordinates are exact, a unit of length
    is_seam: Flags | None = None  #: (n_chains,) chains that others must not cross, and no more; None: there are none
    real_ends: Ends | None = None  #: the ends without these
    threads: int = 1  #: how many share the strides

    def marks_of(self, points: Floats, strides: Sequence[Strided], is_new: Flags, gently: bool) -> list[Bytes]:
        """Mark the segments at each stride that are in conflict."""
        threads = self.threads if len(points) > LEAST else 1
        return in_threads(list(strides), lambda strided: self.marks(points, strided, is_new, gently), threads)

    def marks(self, points: Floats, strided: Strided, is_new: Flags, gently: bool) -> Bytes:
        """Mark the segments at a stride that are in conflict."""
        if self.is_seam is None or self.real_ends is None or not self.is_seam.any():
            return mark_conflicts(points, strided, self.ends, is_new, gently, self.shape, self.units)
        marks = mark_conflicts(points, strided, self.ends, is_new, False, self.shape, self.units)
        if gently:
            real = ~self.is_seam[strided.chain]
            part = strided._replace(segments=strided.segments[real], chain=strided.chain[real])
            found = find_conflicts(points, part.segments, part.chain, is_new, self.shape, self.units)
            marks[real] = np.maximum(marks[real], found)
            mark_sectors(points, strided, self.real_ends, marks)
        return marks


def place_freely(draft: Draft, size: Floats, patience: Patience = PATIENCE) -> tuple[Nodes, bool]:
    """Place nodes without conflicts.

    Parameters
    ----------
    draft : Draft
        The curves.
    size : float64, shape (n,)
        Wanted length of final edges at each dense point.
    patience : Patience, optional
        Rounds.

    Returns
    -------
    Nodes
        Nodes whose fine and coarse polylines neither cross nor touch.
    bool
        They also keep room, and sectors of 35 degrees.

    Raises
    ------
    CrossedError
        If chains cross or touch where they were before smoothing: those of pixels do not.
    """
    curves = draft.curves
    at_least = _least_segments(curves.ends)
    withdrawn, closest = np.zeros(len(size)), np.minimum(_CLOSEST * curves.scale, draft.limit)
    exact, is_new = np.zeros(len(curves.ends), bool), np.ones(len(curves.ends), bool)
    drawn = _Drawn(np.empty_like(draft.smooth), np.zeros(len(size)), np.zeros(len(size)))
    for attempt in range(patience.most + 2):
        gently = attempt < patience.gentle
        _draw(curves, draft.smooth, withdrawn, _withdraw_ends(draft, withdrawn), is_new, drawn)
        nodes = _place(draft, drawn, size, at_least, exact)
        factor, pull = np.ones(len(size)), np.zeros(len(size))
        strides = on_stride(nodes, 2), on_stride(nodes, 1)
        for strided, marks in zip(strides, draft.marks_of(nodes.points, strides, is_new, gently), strict=True):
            _mark_dense(marks, strided, curves.offsets, attempt >= patience.closer, factor, pull)
        if factor.min() == 1.0:
            return nodes, gently
        failed = any_of_chain(factor < 1.0, curves.offsets)
        if attempt >= patience.curved:
            exact |= failed | (attempt >= patience.most)
        shorter = np.maximum(size * factor, closest)
        is_graded = np.zeros(len(failed), bool) if attempt == 0 else ~any_of_chain(shorter != size, curves.offsets)
        shorter = grade_chains(shorter, curves, len(draft.node), draft.edge_ratio, is_graded)
        failed |= any_of_chain(shorter < size, curves.offsets)
        size, withdrawn = shorter, np.minimum(withdrawn + pull, 1.0)
        withdrawn[per_point(curves, exact)] = 1.0
        is_new = _with_neighbours(curves.ends, failed | exact, len(draft.node))
    raise CrossedError(failed)


def _least_segments(ends: Ints) -> Ints:
    """Least number of coarse segments of each chain, so that every face has at least three."""
    ends = np.sort(ends, axis=1)
    _, pair, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    least = np.where(count[pair.ravel()] > 1, 2, 1)
    least[ends[:, 0] == ends[:, 1]] = 3
    least[ends[:, 0] < 0] = 4
    return least.astype(np.int64)


class _Drawn(NamedTuple):
    """Curves between the smoothed ones and the pixel boundary."""

    points: Floats  #: (n, 2)
    steps: Floats  #: (n,) length from the point before, 0 where a chain begins
    arc: Floats  #: (n,) sum of these, over all chains


@kernel
def _draw(curves: Curves, smooth: Floats, withdrawn: Floats, node: Floats, is_new: Flags, drawn: _Drawn) -> None:
    """Draw new chains between their ends, those on the border straight; stairs are up to 8 % longer, no step is."""
    points, steps, raw = drawn.points, drawn.steps, curves.raw
    for c in range(len(is_new)):
        if not is_new[c]:
            continue
        first, last = curves.offsets[c], curves.offsets[c + 1] - 1
        for i in range(first, last + 1):
            for k in range(2):
                points[i, k] = smooth[i, k] + withdrawn[i] * (raw[i, k] - smooth[i, k])
        pin(curves, node, c, points)
        gone = 0.0
        for i in range(first + 1, last + 1):
            before = gone
            gone += np.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
            steps[i] = min(gone - before, curves.arc[i] - curves.arc[i - 1])
    for i in range(1, len(steps)):
        drawn.arc[i] = drawn.arc[i - 1] + steps[i]


def _place(draft: Draft, drawn: _Drawn, size: Floats, at_least: Ints, exact: Flags) -> Nodes:
    curves = draft.curves._replace(arc=drawn.arc)

    def place(part: slice) -> tuple[Placement, Floats]:
        some, is_exact = curves._replace(offsets=curves.offsets[part.start : part.stop + 1]), exact[part]
        placed = place_nodes(some, size, draft.limit, draft.is_corner, at_least[part], is_exact, draft.edge_multiple)
        even_out(drawn.points, placed, is_exact, draft.edge_ratio)
        return placed, snapped(points_at(drawn.points, placed.at), draft.units)

    placed, xy = zip(*in_threads(even_parts(np.diff(curves.offsets), draft.threads), place, draft.threads), strict=True)
    return number_nodes(curves, len(draft.node), np.concatenate(xy), joined(placed))


def _withdraw_ends(draft: Draft, withdrawn: Floats) -> Floats:
    """Draw ends back as far as the chain that goes back farthest."""
    curves = draft.curves
    share = np.zeros(len(draft.node))
    for side, place in ((0, curves.offsets[:-1]), (1, curves.offsets[1:] - 1)):
        is_open = curves.ends[:, side] >= 0
        np.maximum.at(share, curves.ends[is_open, side], withdrawn[place[is_open]])
    return draft.node + share[:, None] * (draft.ends.place - draft.node)


def _mark_dense(marks: Bytes, strided: Strided, offsets: Ints, withdraw: bool, factor: Floats, pull: Floats) -> None:
    """For the dense points under marked segments: how much closer nodes go, and how much nearer to the pixels."""
    k = np.flatnonzero(marks)
    c = strided.chain[k]
    low = np.maximum(strided.at[k + c].astype(np.int64) - 1, offsets[c])
    high = np.minimum(strided.at[k + c + 1].astype(np.int64) + 2, offsets[c + 1] - 1)
    number = high - low + 1
    under = np.arange(number.sum()) + np.repeat(low - np.cumsum(number) + number, number)
    sharp = np.repeat(marks[k] == SHARP, number)
    np.minimum.at(factor, under, np.where(sharp, _LESS_CLOSE, _CLOSER))
    pull[under[sharp | withdraw]] = 1.0 / 3.0


def _with_neighbours(ends: Ints, chains: Flags, n_nodes: int) -> Flags:
    """Add the chains that meet these: their nodes move too."""
    node = np.zeros(n_nodes + 1, bool)  # the last one for closed chains
    node[ends[chains].ravel()] = True
    node[-1] = False
    return np.asarray(chains | node[ends].any(axis=1))


def restore_areas_freely(
    sides: Ints, areas: Floats, draft: Draft, nodes: Nodes, room: Floats, max_shift: float, gently: bool
) -> Nodes:
    """Give regions their areas; less where that makes conflicts.

    Parameters
    ----------
    sides : int64, shape (n_chains, 2)
        Region on the left and on the right of each chain.
    areas : float64, shape (n_regions,)
        Wanted areas.
    draft, nodes
        The curves, and their nodes without conflicts.
    room : float64, shape (n,)
        How far smoothing could move each dense point.
    max_shift : float
        Largest distance from the pixel boundary.
    gently : bool
        All nodes keep room and sectors; else those that do go on to.
    """
    placed = nodes.placed
    chains = Chains(placed.offsets, nodes.chain_points, sides)
    bound = _area_bounds(draft.curves, nodes, room, max_shift)
    shift, tested = np.zeros(len(sides)), nodes.points
    had_conflicts = np.zeros(len(sides), bool)
    strides = on_stride(nodes, 2), on_stride(nodes, 1)
    excused = _excused(draft, nodes, strides, gently)
    for attempt in range(_AREA_ROUNDS):
        points, shift = restore_areas(nodes.points, chains, areas, bound, shift)
        points = snapped(points, draft.units)
        has_moved = any_of_chain((points != tested).any(axis=1)[nodes.chain_points], placed.offsets)
        has_moved |= had_conflicts
        is_bad = np.zeros(len(points), bool)
        marked = draft.marks_of(points, strides, has_moved, True)
        for strided, marks, is_excused in zip(strides, marked, excused, strict=True):
            is_bad[strided.segments[marks > np.where(is_excused, CROSSING - 1, FREE)]] = True
        if not is_bad.any():
            return nodes._replace(points=points)
        bound[_widened(is_bad[nodes.chain_points])] *= 0.5 if attempt == 0 else 0.0
        tested, had_conflicts = points, any_of_chain(is_bad[nodes.chain_points], placed.offsets)
    return nodes


def _excused(draft: Draft, nodes: Nodes, strides: Sequence[Strided], gently: bool) -> list[Flags]:
    """Tell which segments are too close to others or at too sharp sectors before areas are restored."""
    if gently:
        return [np.zeros(len(strided.segments), bool) for strided in strides]
    all_chains = np.ones(len(draft.curves.ends), bool)
    return [np.asarray(marks > 0) for marks in draft.marks_of(nodes.points, strides, all_chains, True)]


def _widened(flags: Flags) -> Flags:
    wide = flags.copy()
    wide[1:] |= flags[:-1]
    wide[:-1] |= flags[1:]
    return wide


def _area_bounds(curves: Curves, nodes: Nodes, room: Floats, max_shift: float) -> Floats:
    """How far the segments at each node may be shifted: little beside nodes that stay, so that no kink arises."""
    offsets, at = nodes.placed.offsets, nodes.placed.at
    gone = np.hypot(*(nodes.points[nodes.chain_points] - points_at(curves.raw, at)).T)
    place = at.astype(np.int64)
    bound = np.minimum(max_shift * curves.scale[place] - gone, _AREA_ROOM * room[place])
    places = places_of(nodes.chain_points, offsets)
    bound[places.at] /= np.maximum(np.hypot(*mitres(nodes.points, places).T), 1.0)
    stays = np.repeat(curves.is_frame, np.diff(offsets))
    is_open = curves.ends[:, 0] >= 0
    stays[offsets[:-1][is_open]] = stays[offsets[1:][is_open] - 1] = True
    bound[stays] = 0.0
    arc = np.interp(at, np.arange(len(curves.arc)), curves.arc)
    return grade_along(np.maximum(bound, 0.0), arc, offsets, curves.ends, _KINK)
