"""Nodes that several tiles have: held while they are meshed, numbered once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from imgquad_core.boundary import SmoothingOptions, extract_boundaries, smooth_boundaries
from imgquad_core.chains import halved
from imgquad_core.mesher import MeshingOptions, mesh_boundaries
from imgquad_core.model import VOID, PointKind
from imgquad_core.tiles.meshes import TileMesh, joined_meshes, open_nodes, patched, same_places
from imgquad_core.tiles.numbering import Rim, numbers_of, owned
from support.labels import label_image


def test_held_points_stay_and_their_edges_are_not_cut() -> None:
    y, x = np.mgrid[:60, :80]
    labels = (np.hypot(x - 40, y - 30) < 18).astype(np.int32)
    graph = smooth_boundaries(extract_boundaries(label_image(labels)), SmoothingOptions(size=4.0))
    circle = np.flatnonzero((graph.chain_regions != VOID).all(axis=1))
    points = np.unique(np.concatenate([graph.chain(int(c)) for c in circle]))
    kind = graph.point_kind.copy()
    kind[points] = PointKind.HELD
    held = replace(graph, point_kind=kind)
    cut = halved(held, np.ones(held.n_chains, bool))
    counts, before = np.diff(cut.chain_offsets), np.diff(graph.chain_offsets)
    assert np.array_equal(counts[circle], before[circle])
    assert (np.delete(counts, circle) > np.delete(before, circle)).all()
    mesh = mesh_boundaries(held, MeshingOptions(size=4.0))
    there = mesh.points[mesh.point_kind == PointKind.HELD]
    assert np.array_equal(np.sort(there, axis=0), np.sort(graph.points[points], axis=0))


def strip(start: int, n: int) -> TileMesh:
    """A row of unit quads."""
    x = np.arange(start, start + n + 1, dtype=float)
    points = np.concatenate([np.stack([x, np.zeros(n + 1)], axis=1), np.stack([x, np.ones(n + 1)], axis=1)])
    a = np.arange(n)
    quads = np.stack([a, a + 1, a + n + 2, a + n + 1], axis=1)
    return TileMesh(points, quads, np.zeros(n, np.int64), np.zeros(2 * n + 2, bool))


def test_a_node_is_of_the_lowest_tile_and_numbers_follow_the_tiles() -> None:
    meshes = [strip(0, 2), strip(2, 3), strip(5, 1)]
    rims = {t: Rim(open_nodes(mesh), mesh.points[open_nodes(mesh)]) for t, mesh in enumerate(meshes)}
    owns = {t: owned(t, len(mesh.points), {o: rims[o] for o in rims if o <= t}) for t, mesh in enumerate(meshes)}
    assert [int(own.is_own.sum()) for own in owns.values()] == [6, 6, 2]
    first = np.array([0, 6, 12, 14])
    place = np.full((14, 2), np.nan)
    for t, mesh in enumerate(meshes):
        number = numbers_of(t, owns[t], rims, owns, first)
        known = ~np.isnan(place[number, 0])
        assert np.array_equal(place[number[known]], mesh.points[known])
        place[number] = mesh.points
    assert not np.isnan(place).any()
    assert len(same_places(place)[0]) == 14


def test_patches_take_the_place_of_quads_and_nodes_at_one_place_are_one() -> None:
    from imgquad_core.tiles.meshes import Patch

    mesh, other = strip(0, 3), strip(1, 1)
    patch = Patch(np.array([1]), other.points, other.quads, np.array([7]))
    made = patched(mesh, [patch])
    assert sorted(made.region.tolist()) == [0, 0, 7]
    assert len(made.points) == 8
    whole, tile = joined_meshes([mesh, strip(3, 2)])
    assert len(whole.points) == 12
    assert tile.tolist() == [0, 0, 0, 1, 1]
