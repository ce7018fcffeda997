"""Rounds that halve the boundary's edges beside folded quads."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Flags, Ints
from imgquad_core.chains import halved, refined, with_chains_of
from imgquad_core.errors import TopologyError
from imgquad_core.grouping import linked
from imgquad_core.measures.quality import scaled_jacobian
from imgquad_core.model import BoundaryGraph

from .efforts import Tuning
from .options import MeshingOptions
from .strides import Meshed, consistent, faces_beside, judged, mesh_faces, taken

PATIENCE = 6  # rounds that reach no farther than the edges beside the quads


class State(NamedTuple):
    """All faces meshed, after some rounds."""

    graph: BoundaryGraph
    meshed: Meshed
    widest: Ints  #: stride of each face


def with_musts(state: State, options: MeshingOptions) -> State:
    """Halve edges beside folded quads until none is left.

    Raises
    ------
    TopologyError
        Quads stay folded.
    """
    for attempt in range(options.tuning.rounds):
        folded = folded_rim(state)
        if len(folded) == 0:
            break
        state = _refitted(state, _finer(state.graph, folded, attempt, options.tuning), options)
    if (folded := folded_rim(state)).size:
        where = state.graph.points[folded[0]].tolist()
        raise TopologyError(f"{len(folded)} boundary points fold quads, the first at {where}")
    return state


def _refitted(state: State, finer: BoundaryGraph, options: MeshingOptions) -> State:
    """Mesh the faces beside chains that are finer, and keep what is better, group by group of such neighbours.

    Where quads fold, the new state is kept in any case.
    """
    graph, meshed, widest = state
    finer = consistent(finer, _differ(graph, finer), options.triangulator)
    changed = _differ(graph, finer)
    todo = faces_beside(graph, changed)
    done = mesh_faces(finer, todo, options, widest)
    group = _groups_across(graph, changed)
    old, new = np.ones((2, len(todo)))
    np.minimum.at(old, group, meshed.worst)
    np.minimum.at(new, group, np.where(todo, done.worst, 1.0))
    better = todo & ((new > old) | (old <= 0.0))[group]
    kept = changed & np.append(better, False)[graph.chain_regions].any(axis=1)
    return State(with_chains_of(graph, finer, kept), taken(meshed, done, better), widest)


def _groups_across(graph: BoundaryGraph, chains: Flags) -> Ints:
    """Return the number of the group of each face; faces on both sides of a flagged chain are of one group."""
    n = len(graph.region_label)
    pairs = graph.chain_regions[chains]
    a, b = pairs[(pairs >= 0).all(axis=1)].T
    return linked(a, b, n)[0]


def _finer(graph: BoundaryGraph, folded: Ints, attempt: int, tuning: Tuning) -> BoundaryGraph:
    """Return the graph with halved edges beside points with folded quads.

    A halved edge is straight, so no point there can fold a quad. The reach grows, and in the end all edges are halved:
    that settles it whatever the picture.
    """
    if attempt == tuning.rounds - 1:
        return halved(graph, np.ones(graph.n_chains, bool))
    return refined(graph, folded, 2 ** max(attempt - PATIENCE, 0) - 1)


def folded_rim(state: State) -> Ints:
    """Return the boundary points of folded quads, and all those of a face whose folded quads have none."""
    found, meshed = [np.empty(0, np.int64)], state.meshed
    for whole in meshed.parts if (meshed.worst <= 0.0).any() else ():
        part = judged(whole, state.graph)
        looked_at = np.flatnonzero(meshed.worst[part.face] <= 0.0)
        folded = looked_at[scaled_jacobian(part.points, part.quads[looked_at]) <= 0.0]
        origin = part.origin[part.quads[folded]]
        inner = np.setdiff1d(part.face[folded], part.face[folded[(origin >= 0).any(axis=1)]])
        found += [origin.ravel(), part.origin[part.quads[np.isin(part.face, inner)]].ravel()]
    points = np.unique(np.concatenate(found))
    return np.asarray(points[points >= 0])


def _differ(graph: BoundaryGraph, finer: BoundaryGraph) -> Flags:
    """Return which chains have more points in the finer graph."""
    return np.asarray(np.diff(finer.chain_offsets) != np.diff(graph.chain_offsets))
