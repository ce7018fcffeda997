"""Batches of whole faces: nothing lost, and the same bytes for any number of threads."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from imgquad_core.cleanup.batches import in_batches
from imgquad_core.cleanup.faces import FaceQuads, faces_only, joined
from imgquad_core.cleanup.irregular_nodes import CleanUp, clean_up
from imgquad_core.cleanup.options import Portions
from support import naive
from support.faces import assert_valid_faces, quads_of, voronoi_graph

SMALL = Portions(batch=150)


@pytest.fixture
def grains() -> FaceQuads:
    """Sixteen grains, in several small batches."""
    return quads_of(voronoi_graph(64, 4, 2.0, 0), 2.0)


def corners(mesh: FaceQuads) -> set[tuple[int, tuple[tuple[float, float], ...]]]:
    """Face and corners of each quad, whatever the numbers of points and quads."""
    places = mesh.points[mesh.quads].tolist()
    return {(f, tuple(sorted(map(tuple, p)))) for f, p in zip(mesh.face.tolist(), places, strict=True)}


def test_batches_hold_whole_faces_and_together_all(grains: FaceQuads) -> None:
    parts = in_batches(grains, lambda part: part, 1, SMALL)
    assert len(parts) > 3
    faces = [set(part.face.tolist()) for part in parts]
    assert sum(map(len, faces)) == len(set().union(*faces)) == 16
    for part in parts:
        assert_valid_faces(part)
    whole = joined(parts)
    assert len(whole.points) == len(grains.points)
    assert corners(whole) == corners(grains)
    assert_valid_faces(whole)


@pytest.mark.parametrize("threads", [2, 5])
def test_threads_do_not_change_a_byte(grains: FaceQuads, threads: int) -> None:
    def work(part: FaceQuads) -> FaceQuads:
        return clean_up(part, CleanUp((16, 40), 0.2, 0.6))

    alone, together = joined(in_batches(grains, work, 1, SMALL)), joined(in_batches(grains, work, threads, SMALL))
    assert all(a.tobytes() == b.tobytes() for a, b in zip(alone, together, strict=True))
    assert len(alone.quads) != len(grains.quads)


def test_two_batches_are_worked_on_at_once(grains: FaceQuads) -> None:
    meet = threading.Barrier(2, timeout=20)
    first_two: list[int] = []

    def work(part: FaceQuads) -> int:
        first_two.append(len(part.quads))
        if len(first_two) <= 2:
            meet.wait()  # breaks unless another thread comes here too
        return len(part.quads)

    assert sum(in_batches(grains, work, 2, SMALL)) == len(grains.quads)


def test_errors_in_threads_come_through(grains: FaceQuads) -> None:
    def work(part: FaceQuads) -> int:
        raise ValueError(f"{len(part.quads)} quads")

    with pytest.raises(ValueError, match="quads"):
        in_batches(grains, work, 2, SMALL)


def test_one_batch_where_all_fits() -> None:
    mesh = quads_of(voronoi_graph(64, 3, 2.0, 0), 2.0)
    assert len(in_batches(mesh, len, 2)) == 1


def test_some_faces_only(grains: FaceQuads) -> None:
    chosen = np.zeros(16, bool)
    chosen[[1, 7, 8]] = True
    some = faces_only(grains, chosen)
    assert_valid_faces(some)
    assert set(some.face.tolist()) == {1, 7, 8}
    kept = chosen[grains.face]
    assert naive.areas(some.points, some.quads).sum() == pytest.approx(
        naive.areas(grains.points, grains.quads[kept]).sum()
    )
    assert faces_only(grains, np.ones(16, bool)) is grains
    assert len(faces_only(grains, np.zeros(16, bool)).quads) == 0


def test_joining_shifts_ids() -> None:
    mesh = quads_of(voronoi_graph(64, 3, 2.0, 1), 2.0)
    both = joined([mesh, faces_only(mesh, np.zeros(16, bool)), mesh])
    n = len(mesh.points)
    assert np.array_equal(both.quads, np.vstack([mesh.quads, mesh.quads + n]))
    assert np.array_equal(both.points[n:], mesh.points)
    assert np.array_equal(both.origin[n:], mesh.origin)
