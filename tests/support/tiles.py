"""Two tiles beside each other."""

from __future__ import annotations

import numpy as np

from imgquad_core.boundary import ExtractionOptions, SmoothingOptions, extract_boundaries
from imgquad_core.tiles.outlines import Outlines, outlines_of
from imgquad_core.tiles.regions import Keys, Regions

from .labels import label_image

SHAPE, LINE = (120, 160), 80
SMOOTHING = SmoothingOptions(size=4.0, step=(1.0, 1.0))


def outlines(labels: np.ndarray, t: int, tile: np.ndarray | None = None, how: SmoothingOptions = SMOOTHING) -> Outlines:
    """Outlines of one of two tiles, by default those beside a line from top to bottom; all regions count as cut."""
    image = label_image(labels.astype(np.int32))
    whole = extract_boundaries(image, ExtractionOptions())
    assert len(np.unique(labels)) == len(whole.region_label)  # a region a label: they number each other
    beyond = np.indices(SHAPE)[1] >= LINE if tile is None else tile
    codes, pixels = np.unique(2 * labels + beyond, return_inverse=True)
    keys = Keys(pixels.reshape(SHAPE).astype(np.int32), codes // 2, codes % 2)
    none = np.empty(0, np.int64)
    known = Regions(np.arange(labels.max() + 1, dtype=np.int32), none, none, np.ones(9, bool), none, none, none)
    return outlines_of(t, keys, (0, 0, *SHAPE[::-1]), SHAPE[0], known, ExtractionOptions(), how)
