"""Maps of more grains than there are classes of colours: a material a region."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from imgquad_core.picture.segmentation import SegmentationOptions, segment_picture


def test_each_grain_of_one_colour_is_a_material() -> None:
    random = np.random.default_rng(3)
    side, n = 260, 90
    spots = np.array(np.meshgrid(np.arange(10), np.arange(9))).reshape(2, -1).T
    centres = (spots + 0.5 + random.uniform(-0.3, 0.3, (n, 2))) * (side / 10, side / 9)
    truth = cKDTree(centres).query(np.argwhere(np.ones((side, side), bool)))[1].reshape(side, side)
    colors = random.integers(20, 236, (n, 3))
    picture = (colors[truth] + random.normal(0, 2.0, (side, side, 3))).clip(0, 255).round().astype(np.uint8)
    found = segment_picture(picture, SegmentationOptions("regions"))
    assert abs(len(found.image.materials.labels) - n) <= 2
    own = np.array([np.bincount(found.image.labels[truth == k]).max() for k in range(n)])
    assert own.sum() > 0.97 * truth.size
    assert np.abs(found.image.materials.colors[found.image.labels].astype(int) - colors[truth]).mean() < 4
    auto = segment_picture(picture)
    assert any("colors = regions" in text for text in auto.warnings)
