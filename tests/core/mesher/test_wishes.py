"""Edges of boundaries are halved where quads beside them are poor, and only if that helps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from imgquad_core.cleanup.areas import Area
from imgquad_core.errors import TopologyError
from imgquad_core.mesher import meshing, wishes
from imgquad_core.mesher.efforts import Tuning
from imgquad_core.mesher.meshing import mesh_boundaries
from imgquad_core.mesher.options import MeshingOptions
from imgquad_core.model import BoundaryGraph, LabelImage, PointKind, QuadMesh
from support import naive
from support.invariants import assert_valid_mesh
from support.labels import label_image
from support.meshes import boundaries

WITHOUT = Tuning(worst=0.0)
ARRAYS = ("points", "point_kind", "quads", "quad_region", "chain_offsets", "chain_points", "chain_regions")


@pytest.fixture(scope="module")
def image() -> LabelImage:
    return label_image(np.random.default_rng(5).integers(0, 3, (40, 40)))


@pytest.fixture(scope="module")
def graph(image: LabelImage) -> BoundaryGraph:
    return boundaries(image, 5.0)


def meshed(graph: BoundaryGraph, tuning: Tuning, threads: int = 1) -> QuadMesh:
    return mesh_boundaries(graph, MeshingOptions(size=5.0, effort="fast", threads=threads, tuning=tuning))


def quality(mesh: QuadMesh) -> np.ndarray:
    return naive.corner_sines(mesh.points, mesh.quads).min(axis=1)


def test_the_worst_element_gets_better_and_boundary_points_stay(image: LabelImage, graph: BoundaryGraph) -> None:
    before, after = meshed(graph, WITHOUT), meshed(graph, Tuning(worst=0.6))
    assert_valid_mesh(replace(after, materials=image.materials), image)
    assert quality(before).min() < 0.5
    assert quality(after).min() > 0.55
    n, edges, finer = len(graph.points), np.diff(graph.chain_offsets) - 1, np.diff(after.chain_offsets) - 1
    assert np.array_equal(after.points[:n], graph.points)
    assert (finer % 2 == 0).all()
    assert 0 < (finer > edges).sum() < len(edges) / 2
    on_chains = after.points[after.chain_points]
    assert len(np.unique(on_chains, axis=0)) == np.count_nonzero(after.point_kind != PointKind.INTERIOR)
    assert (after.point_kind[after.chain_points] != PointKind.INTERIOR).all()


def test_quads_far_from_poor_ones_stay_to_the_bit() -> None:
    """Wavy stripes: something is poor at few places, and each has its surroundings changed only."""
    y, x = np.mgrid[:400, :60]
    image = label_image((x + 6 * np.sin(y / 30) + 9 * np.exp(-(((y - 200) / 6) ** 2)) > 30).astype(np.int32))
    graph = boundaries(image, 3.0)
    how = MeshingOptions(size=3.0)
    before = mesh_boundaries(graph, replace(how, tuning=WITHOUT))
    limit = float(np.sort(quality(before))[0]) + 1e-6
    after = mesh_boundaries(graph, replace(how, tuning=Tuning(worst=limit)))
    assert quality(after).min() > limit
    old, new = (np.sort(mesh.points[mesh.quads].mean(axis=1).view(complex).ravel()) for mesh in (before, after))
    poor = before.points[before.quads[quality(before).argmin()]].mean(axis=0)
    changed = np.setdiff1d(old, new)
    assert len(changed) > 0
    assert np.abs(changed.imag - poor[1]).max() < 1.5 * 3.0 * (wishes.REACH + 8)


@pytest.mark.parametrize("wish", ["fails", "makes it worse"])
def test_what_does_not_help_leaves_the_mesh_as_it_is(
    wish: str, graph: BoundaryGraph, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = meshed(graph, WITHOUT)
    asked = []

    def failing(*_: object) -> QuadMesh:
        asked.append(1)
        raise TopologyError("no finer boundary")

    def worse(area: Area, _: np.ndarray, ends: np.ndarray, *__: object) -> Area:
        asked.append(1)
        middle = 0.5 * (area.points[ends[:, 0]] + area.points[ends[:, 1]])
        centre = area.points[area.quads].mean(axis=1)
        flat = area.quads[:, [0, 1, 2, 2]]  # no area at all
        return Area(np.vstack([area.points, middle, centre]), flat, area.part)

    if wish == "fails":
        monkeypatch.setattr(meshing, "fill_held", failing)
    else:
        for name in ("refilled", "refilled_however"):
            monkeypatch.setattr(wishes, name, worse)
    after = meshed(graph, Tuning(worst=0.6))
    assert asked
    for name in ARRAYS:
        assert np.array_equal(getattr(before, name), getattr(after, name)), name


def test_all_of_the_boundary_of_what_is_filled_anew_is_held(
    graph: BoundaryGraph, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Corners of its rim, too: an edge between two of them was cut, and quads folded."""
    filled, fill = [], meshing.fill_held

    def held(part: BoundaryGraph, options: MeshingOptions) -> QuadMesh:
        made = fill(part, options)
        filled.append(part)
        assert (part.point_kind == PointKind.HELD).all()
        assert np.array_equal(made.points[: len(part.points)], part.points)
        return made

    monkeypatch.setattr(meshing, "fill_held", held)
    meshed(graph, Tuning(worst=0.6))
    assert filled


def test_held_edges_are_not_halved(graph: BoundaryGraph) -> None:
    """Others mesh up to them."""
    kind = graph.point_kind.copy()
    kind[kind == PointKind.FREE] = PointKind.HELD
    held = replace(graph, point_kind=kind)
    after = meshed(held, Tuning(worst=0.6))
    of_held = np.array([(kind[graph.chain(c)] == PointKind.HELD).any() for c in range(graph.n_chains)])
    assert np.array_equal(np.diff(after.chain_offsets)[of_held], np.diff(graph.chain_offsets)[of_held])


def test_threads_change_no_byte(graph: BoundaryGraph) -> None:
    one, two = (meshed(graph, Tuning(worst=0.62), threads) for threads in (1, 2))
    for name in ARRAYS:
        assert getattr(one, name).tobytes() == getattr(two, name).tobytes(), name
