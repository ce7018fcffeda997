"""Void that is filled from around, and void that stays."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.errors import InputError
from imgquad_core.model import VOID
from imgquad_core.picture.segmentation import SegmentationOptions, segment, segment_picture


def test_small_void_goes_to_the_longest_border_and_large_void_stays() -> None:
    labels = np.full((20, 30), 4)
    labels[:, 15:] = 9
    labels[3, 14:16] = VOID  # half and half of its ends, three sides of the lower pixel each: the lower number
    labels[8, 15] = labels[9, 15] = VOID  # beside 4 over two sides, beside 9 over four
    labels[12:17, 3:9] = VOID
    filled = segment(labels, SegmentationOptions(fill_void=4)).labels
    assert filled[3, 14:16].tolist() == [4, 4]
    assert filled[8:10, 15].tolist() == [9, 9]
    assert (filled[12:17, 3:9] == VOID).all()
    assert (segment(labels, SegmentationOptions(fill_void=30)).labels != VOID).all()
    assert (segment(labels).labels == labels).all()


def test_void_of_a_map_is_told_with_its_remedy() -> None:
    labels = np.repeat(np.repeat(np.arange(12).reshape(3, 4), 40, 0), 40, 1)
    labels[np.random.default_rng(1).random(labels.shape) < 0.01] = VOID
    found = segment_picture(labels)
    assert "void pixels" in found.note
    assert any("fill_void = 16" in text for text in found.warnings)
    filled = segment_picture(labels, SegmentationOptions(fill_void=16))
    assert (filled.image.labels != VOID).all()
    assert not filled.warnings
    assert "filled from around" in filled.note


def test_a_picture_of_void_only_and_senseless_limits_are_refused() -> None:
    with pytest.raises(InputError, match="void"):
        segment(np.full((5, 5), VOID))
    with pytest.raises(InputError, match="fill_void is -1"):
        SegmentationOptions(fill_void=-1)
