"""Local feature size beside all pairs of points, with the way along the curves told node by node."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.arrays import Floats, Ints
from imgquad_core.boundary.curves import Curves, curves_of
from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.feature_size import local_feature_size
from support import naive
from support.labels import Labels, disc, label_image, spiral, voronoi


def curves(labels: Labels) -> Curves:
    return curves_of(extract_boundaries(label_image(labels)))[0]


def all_pairs(c: Curves, reach: float, bend: float, corner: Ints | None = None, wiggle: float = 0.0) -> Floats:
    n = len(c.raw)
    lfs = np.full(n, np.inf)
    chain = np.repeat(np.arange(len(c.ends)), np.diff(c.offsets))
    for i in range(n):
        apart = np.hypot(*(c.raw - c.raw[i]).T)
        for j in np.flatnonzero(apart < reach):
            same = corner is not None and corner[i] >= 0 and corner[i] == corner[j]
            arc = naive.arc_between(c, i, j)
            same |= chain[i] == chain[j] and arc <= wiggle
            if not same and arc > bend * apart[j]:
                lfs[i] = min(lfs[i], apart[j])
    return lfs


@pytest.mark.parametrize("bend", [2.0, 4.0])
@pytest.mark.parametrize(
    "labels",
    [voronoi(14, 16, 7, 3), disc(5.0, (8.2, 7.9), 16), spiral(13), np.random.default_rng(2).integers(0, 3, (9, 9))],
    ids=["grains", "disc", "spiral", "noise"],
)
def test_it_is_the_distance_to_the_nearest_foreign_point(labels: Labels, bend: float) -> None:
    c = curves(labels)
    found, true = local_feature_size(c.raw, c, 4.0, bend), all_pairs(c, 4.0, bend)
    assert np.array_equal(np.isinf(found), np.isinf(true))
    assert np.allclose(found[np.isfinite(true)], true[np.isfinite(true)], rtol=1e-12)
    if labels.max() > 1:
        assert np.isfinite(true).any()


def test_both_sides_of_one_corner_are_not_foreign() -> None:
    c = curves(voronoi(14, 16, 7, 3))
    corner = np.where(c.raw[:, 0] < 8, 5, -1)
    found, true = local_feature_size(c.raw, c, 4.0, 2.0, corner), all_pairs(c, 4.0, 2.0, corner)
    assert np.array_equal(np.isinf(found), np.isinf(true))
    assert (found >= local_feature_size(c.raw, c, 4.0, 2.0)).all()
    assert (found != local_feature_size(c.raw, c, 4.0, 2.0)).any()


def test_a_chain_is_not_foreign_to_what_it_has_just_left() -> None:
    c = curves(spiral(13))
    found, true = local_feature_size(c.raw, c, 4.0, 2.0, wiggle=12.0), all_pairs(c, 4.0, 2.0, wiggle=12.0)
    assert np.array_equal(np.isinf(found), np.isinf(true))
    assert np.allclose(found[np.isfinite(true)], true[np.isfinite(true)], rtol=1e-12)
    assert (true != all_pairs(c, 4.0, 2.0)).any()


@pytest.mark.parametrize("width", [3, 11, 25])
def test_a_stripe_has_its_width_at_any_scale(width: int) -> None:
    labels = np.zeros((90, 90), np.int32)
    labels[30 : 30 + width] = 1
    c = curves(labels)
    on_stripe = (c.raw[:, 1] > 5) & (c.raw[:, 1] < 85) & (np.abs(c.raw[:, 0] - 45) < 10)
    found = local_feature_size(c.raw, c, 40.0, 4.0)[on_stripe]
    assert found.min() >= width - 1e-9
    assert found.max() <= width * 1.1 + 0.5
