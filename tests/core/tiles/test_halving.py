"""Edges that two tiles share, halved in meshes that are there."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.boundary import SmoothingOptions
from imgquad_core.errors import TopologyError
from imgquad_core.geometry.halfedge import twins_of
from imgquad_core.measures.quality import quad_areas, scaled_jacobian
from imgquad_core.mesher import MeshingOptions
from imgquad_core.tiles.halving import Edges, all_edges, edges_of, wished_edges, with_edges_halved
from imgquad_core.tiles.meshes import TileMesh, bits_of, joined_meshes, mesh_outlines
from imgquad_core.tiles.outlines import EdgesOf, Outlines, settled
from support.tiles import LINE, SHAPE, outlines

HOW = MeshingOptions(size=1.5)
Y, X = np.indices(SHAPE) + 0.5
DISC = np.hypot(X - LINE + 4, Y - 60) < 15  # of the left tile, also where it is beyond the line


@pytest.fixture(scope="module")
def both() -> list[Outlines]:
    tile = (X > LINE) & ~DISC
    how = SmoothingOptions(size=HOW.size, step=(1.0, 1.0))
    found = [outlines(DISC.astype(np.int64), t, tile, how) for t in (0, 1)]
    return [settled(t, found[t], lambda other: found[other]) for t in (0, 1)]


@pytest.fixture(scope="module")
def meshes(both: list[Outlines]) -> list[TileMesh]:
    return [meshed(found) for found in both]


def meshed(found: Outlines) -> TileMesh:
    n = len(found.region)
    made = mesh_outlines(found, SHAPE[0], HOW, np.full(n, 4), np.zeros(n, bool))
    assert made is not None
    return made.mesh


def chain_of_disc(found: Outlines) -> int:
    """The part of its boundary that is shared: one chain from seam to seam."""
    (c,) = np.flatnonzero(found.shared & ~found.seam)
    return int(c)


def some_edges(found: Outlines) -> EdgesOf:
    """The first two and the last four edges of the disc's chain."""
    c = chain_of_disc(found)
    n = int(np.diff(found.offsets)[c]) - 1
    return {tuple(found.key[c].tolist()): {0, 1, n - 4, n - 3, n - 2, n - 1}}


def with_some_halved(mesh: TileMesh, found: Outlines) -> TileMesh:
    made = with_edges_halved(mesh, edges_of(found, some_edges(found)), found, HOW)
    assert made is not None
    return made


def test_both_sides_get_the_same_nodes_and_fit(both: list[Outlines], meshes: list[TileMesh]) -> None:
    made = [with_some_halved(mesh, found) for mesh, found in zip(meshes, both, strict=True)]
    whole, _ = joined_meshes(made)
    open_edges = np.count_nonzero(twins_of(whole.quads, len(whole.points)) < 0)
    before, _ = joined_meshes(meshes)
    assert open_edges == np.count_nonzero(twins_of(before.quads, len(before.points)) < 0)  # the picture's border
    n_edges = (4 * len(whole.quads) + open_edges) // 2
    assert len(whole.points) - n_edges + len(whole.quads) == 1
    assert quad_areas(whole.points, whole.quads).sum() == pytest.approx(SHAPE[0] * SHAPE[1])
    assert scaled_jacobian(whole.points, whole.quads).min() > 0.4
    added = np.setdiff1d(bits_of(made[0].points), bits_of(meshes[0].points))
    edges = edges_of(both[0], some_edges(both[0]))
    assert np.isin(bits_of(0.5 * (edges.tails + edges.heads)), added).all()


def test_what_is_far_away_stays_to_the_bit(both: list[Outlines], meshes: list[TileMesh]) -> None:
    edges = edges_of(both[1], some_edges(both[1]))
    made = with_some_halved(meshes[1], both[1])
    old, new = (corners_of(mesh) for mesh in (meshes[1], made))
    changed = np.concatenate([np.setdiff1d(old, new), np.setdiff1d(new, old)]).view(np.float64).reshape(-1, 2)
    gap = np.linalg.norm(changed[:, None] - edges.tails[None], axis=-1).min(axis=1)
    assert len(changed) > 0
    assert gap.max() < 70.0  # 12 quads and 22 more around them, of 1.5 px, counted over corners
    assert np.isin(old, new).mean() > 0.3
    seams = [np.sort(bits_of(mesh.points[mesh.seam])) for mesh in (meshes[1], made)]
    assert np.array_equal(*seams)


def corners_of(mesh: TileMesh) -> np.ndarray:
    """The centre of each quad as one value."""
    return bits_of(mesh.points[mesh.quads].mean(axis=1))


def test_nothing_to_halve_changes_nothing(both: list[Outlines], meshes: list[TileMesh]) -> None:
    assert with_edges_halved(meshes[0], Edges(np.empty((0, 2)), np.empty((0, 2))), both[0], HOW) is meshes[0]


def test_an_odd_number_of_edges_cannot_be_filled(both: list[Outlines], meshes: list[TileMesh]) -> None:
    c = chain_of_disc(both[0])
    one = edges_of(both[0], {tuple(both[0].key[c].tolist()): {3}})
    assert with_edges_halved(meshes[0], one, both[0], HOW) is None


def test_an_edge_that_the_mesh_lacks_is_an_error(both: list[Outlines], meshes: list[TileMesh]) -> None:
    """Else the tiles would not fit, without a word."""
    edges = edges_of(both[0], some_edges(both[0]))
    edges.heads[1] += 0.25
    with pytest.raises(TopologyError, match="lacks an end of a shared edge"):
        with_edges_halved(meshes[0], edges, both[0], HOW)


def test_segments_are_wished_that_poor_quads_touch(both: list[Outlines], meshes: list[TileMesh]) -> None:
    """A node inside is moved to an edge of the chain."""
    c = chain_of_disc(both[1])
    ids = both[1].ids[both[1].offsets[c] : both[1].offsets[c + 1]]
    chain = both[1].points[ids]
    at = len(chain) // 2 // 4 * 4 + 2  # within a segment of stride 4
    assert len(wished_edges(meshes[1], both[1], 0.2, 0)) == 0
    points = meshes[1].points.copy()
    node = int(np.flatnonzero(bits_of(points) == bits_of(chain[at : at + 1]))[0])
    beside = meshes[1].quads[(meshes[1].quads == node).any(axis=1)]
    inner = int(np.setdiff1d(beside, np.flatnonzero(np.isin(bits_of(points), bits_of(chain))))[0])
    points[inner] = points[node] + 0.9 * (chain[at + 1] - points[node])
    poor = meshes[1]._replace(points=points)
    edges = wished_edges(poor, both[1], 0.2, 0)
    assert (edges[:, :4] == both[1].key[c]).all()
    wished = set(edges[:, 4].tolist())
    assert {at - 2, at - 1, at, at + 1} <= wished
    assert len(wished) % 4 == 0
    assert len(wished) <= 12
    assert wished < set(wished_edges(poor, both[1], 0.2, 1)[:, 4].tolist())
    assert len(all_edges(both[1])) == (np.diff(both[1].offsets)[both[1].shared] - 1).sum()
