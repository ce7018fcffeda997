"""Work shared by threads: all of it once, in order, whatever their number."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.boundary import (
    SmoothingOptions,
    extract_boundaries,
    feature_size,
    fitting,
    sharp_corners,
    smooth_boundaries,
)
from imgquad_core.threads import even_parts, in_threads, threads_of
from support.labels import label_image, labels_of_kind, voronoi


@pytest.mark.parametrize("threads", [1, 2, 7])
@pytest.mark.parametrize("n", [0, 1, 5, 400])
def test_even_parts_hold_each_item_once(n: int, threads: int) -> None:
    points = np.random.default_rng(n).integers(1, 900, n)
    parts = even_parts(points, threads, least=1000)
    assert [i for part in parts for i in range(n)[part]] == list(range(n))
    assert 1 <= len(parts) <= threads
    if n == 400:
        assert len(parts) == threads
        assert max(points[part].sum() for part in parts) < points.sum() / threads + 900


def test_results_come_in_the_order_of_the_parts() -> None:
    assert in_threads(list(range(50)), lambda part: part**2, 3) == [part**2 for part in range(50)]


def test_threads_that_are_asked_for_are_used() -> None:
    assert threads_of(3) == 3
    assert threads_of(0) >= 1


@pytest.mark.parametrize("kind", ["voronoi", "noise", "spiral", "arms"])
def test_boundaries_are_the_same_for_any_number_of_threads(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for stage in (feature_size, fitting, sharp_corners):  # small parts, so that a small picture has many
        monkeypatch.setattr(stage, "even_parts", lambda points, threads: even_parts(points, threads, least=50))
    labels = voronoi(120, 150, 25, 4) if kind == "voronoi" else labels_of_kind(kind, 40, 50, 4, 7)
    graph = extract_boundaries(label_image(labels))
    one, *others = (smooth_boundaries(graph, SmoothingOptions(size=3.0, threads=n)) for n in (1, 2, 5, 16))
    for other in others:
        assert other.points.tobytes() == one.points.tobytes()
        assert other.chain_points.tobytes() == one.chain_points.tobytes()
