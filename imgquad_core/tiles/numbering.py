"""Numbers of nodes in the whole picture: a node is of the lowest tile that has it, and numbers follow the tiles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints

from .meshes import bits_of


class Rim(NamedTuple):
    """Nodes of a tile that others may have, too."""

    at: Ints  #: ids in the tile, ascending
    points: Floats


class Own(NamedTuple):
    """Which nodes are a tile's own."""

    is_own: Flags  #: (n_points,)
    owner: Ints  #: (n_rim,) tile that each node of the rim is of
    rank: Ints  #: (n_rim,) its number among the nodes of that tile's rim


def owned(t: int, n_points: int, rims: dict[int, Rim]) -> Own:
    """Return which nodes are of tile `t`.

    Parameters
    ----------
    t : int
        The tile.
    n_points : int
        Number of its nodes.
    rims : dict of int to Rim
        Of it and of the lower ones around it.
    """
    mine = rims[t]
    owner, rank = np.full(len(mine.at), t), np.arange(len(mine.at))
    wanted = bits_of(mine.points)
    for other in sorted((o for o in rims if o < t), reverse=True):  # the lowest has the last word
        theirs = bits_of(rims[other].points)
        if not len(theirs) or not len(wanted):
            continue
        order = np.argsort(theirs)
        at = order[np.minimum(np.searchsorted(theirs, wanted, sorter=order), len(theirs) - 1)]
        same = theirs[at] == wanted
        owner[same], rank[same] = other, at[same]
    is_own = np.ones(n_points, bool)
    is_own[mine.at[owner != t]] = False
    return Own(is_own, owner, rank)


def first_numbers(counts: Sequence[tuple[int, int]]) -> Ints:
    """Return the number of each tile's first own node, and that of all nodes; `counts` has nodes and quads of tiles."""
    return np.concatenate([[0], np.cumsum([own for own, _ in counts])]).astype(np.int64)


def numbers_of(t: int, own: Own, rims: dict[int, Rim], owns: dict[int, Own], first: Ints) -> Ints:
    """Return the number of each node of tile `t` in the whole picture; `first` is that of each tile's first own one."""
    number = np.full(len(own.is_own), -1, np.int64)
    number[own.is_own] = first[t] + np.arange(np.count_nonzero(own.is_own))
    for other in np.unique(own.owner):
        if other != t:
            theirs = first[other] + np.cumsum(owns[int(other)].is_own) - 1
            here = own.owner == other
            number[rims[t].at[here]] = theirs[rims[int(other)].at[own.rank[here]]]
    return number
