"""Edges of boundaries are halved beside folded quads until none is left."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from imgquad_core.errors import TopologyError
from imgquad_core.measures.quality import scaled_jacobian
from imgquad_core.mesher import refits
from imgquad_core.mesher.efforts import Tuning
from imgquad_core.mesher.options import MeshingOptions
from imgquad_core.mesher.refits import State, with_musts
from imgquad_core.mesher.strides import Meshed, mesh_faces
from support.labels import label_image
from support.meshes import boundaries

HOW = MeshingOptions(size=4.0, effort="fast")


@pytest.fixture(scope="module")
def state() -> State:
    """Wavy stripes, meshed."""
    y, x = np.mgrid[:60, :70]
    graph = boundaries(label_image(((x + 4 * np.sin(y / 5)) // 10).astype(np.int32)), 4.0)
    n = len(graph.region_label)
    widest = np.full(n, 2)
    return State(graph, mesh_faces(graph, np.ones(n, bool), HOW, widest), widest)


def folded(state: State, face: int) -> State:
    """Fold a quad of one face at its boundary: its inner node is mirrored to the other side."""
    parts = list(state.meshed.parts)
    k = next(k for k, part in enumerate(parts) if (part.face == face).any())
    part = parts[k]
    rim = part.origin[part.quads] >= 0
    quad = np.flatnonzero((part.face == face) & (rim.sum(axis=1) == 3))[0]
    corner = int(np.flatnonzero(~rim[quad])[0])
    points, ids = part.points.copy(), part.quads[quad]
    points[ids[corner]] = 2.0 * points[ids[corner - 2]] - points[ids[corner]]
    parts[k] = part._replace(points=points)
    assert scaled_jacobian(points, part.quads).min() < 0.0
    worst = state.meshed.worst.copy()
    worst[face] = -0.5
    return state._replace(meshed=state.meshed._replace(parts=parts, worst=worst))


def worst_of(state: State) -> float:
    return min(float(scaled_jacobian(part.points, part.quads).min()) for part in state.meshed.parts)


@pytest.mark.parametrize("rounds", [1, Tuning().rounds])
def test_no_quad_stays_folded(state: State, rounds: int) -> None:
    """In the last round all edges are halved."""
    face = int(state.graph.region_label.argmin())
    how = replace(HOW, tuning=Tuning(rounds=rounds))
    made = with_musts(folded(state, face), how)
    assert worst_of(made) > 0.0
    edges, finer = (np.diff(found.graph.chain_offsets) - 1 for found in (state, made))
    beside = (state.graph.chain_regions == face).any(axis=1)
    assert (finer > edges)[beside].any()
    assert (finer % 2 == 0).all()
    if rounds == 1:
        assert np.array_equal(finer, 2 * edges)
    else:
        graph = state.graph
        of_face = np.concatenate([graph.chain(c) for c in np.flatnonzero(beside)])
        far = [c for c in range(graph.n_chains) if not np.isin(graph.chain(c), of_face).any()]
        assert len(far) > graph.n_chains / 2
        assert np.array_equal(finer[far], edges[far])


def test_what_is_not_folded_stays_as_it_is(state: State) -> None:
    assert with_musts(state, HOW) is state


def test_quads_that_stay_folded_are_an_error(state: State, monkeypatch: pytest.MonkeyPatch) -> None:
    face = int(state.graph.region_label.argmin())

    def still_folded(graph: Any, todo: Any, options: MeshingOptions, widest: Any) -> Meshed:
        return folded(State(graph, mesh_faces(graph, todo, options, widest), widest), face).meshed

    monkeypatch.setattr(refits, "mesh_faces", still_folded)
    with pytest.raises(TopologyError, match=r"boundary points fold quads, the first at"):
        with_musts(folded(state, face), replace(HOW, tuning=Tuning(rounds=3)))
