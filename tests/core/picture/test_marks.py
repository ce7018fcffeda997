"""Materials that grow from marks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage

from imgquad_core.errors import InputError
from imgquad_core.model import VOID
from imgquad_core.picture.marks import marks_of
from imgquad_core.picture.segmentation import SegmentationOptions, segment, segment_picture

ROWS, COLS = 90, 120
Y, X = np.mgrid[:ROWS, :COLS] + 0.5
TRUTH = np.where((X - 40) ** 2 + (Y - 45) ** 2 < 900, 1, np.where(X > 85, 2, 0))


def picture() -> NDArray[np.uint8]:
    grey = np.array([100.0, 150.0, 160.0])[TRUTH] + np.random.default_rng(1).normal(0, 6, TRUTH.shape)
    return grey.round().astype(np.uint8)


def strokes() -> NDArray[np.int32]:
    marks = np.zeros((ROWS, COLS), np.int32)
    marks[5:8, 5:40], marks[44:46, 30:50], marks[20:70, 100:102] = 3, 5, 7
    return marks


def test_materials_grow_to_the_edges_and_marks_keep_their_own() -> None:
    found = segment_picture(picture(), SegmentationOptions(marks=strokes()))
    expected = np.array([3, 5, 7])[TRUTH]
    assert (found.image.labels == expected).mean() > 0.98
    assert (found.image.labels[strokes() > 0] == strokes()[strokes() > 0]).all()
    assert found.image.materials.names == ("material 3", "material 5", "material 7")
    assert "grown from marks" in found.note
    assert not found.quantised


def test_points_are_marks_too() -> None:
    points = [[20, 6, 2, 1], [40, 45, 3, 2], [101, 45, 3, 3]]
    labels = segment(picture(), SegmentationOptions(marks=points)).labels
    assert (labels == TRUTH + 1).mean() > 0.98


def test_strokes_in_a_palette_or_clear_picture_name_and_colour_the_materials(tmp_path: Path) -> None:
    colors = np.zeros((8, 3), np.uint8)
    colors[[3, 5, 7]] = [[255, 0, 0], [0, 255, 0], [0, 0, 255]]
    image = Image.frombytes("P", (COLS, ROWS), strokes().astype(np.uint8).tobytes())
    image.putpalette(colors.tobytes())
    image.save(tmp_path / "palette.png")
    rgba = np.dstack([colors[strokes()], np.where(strokes() > 0, 255, 0)]).astype(np.uint8)
    Image.fromarray(rgba).save(tmp_path / "clear.png")
    Image.fromarray(colors[strokes()]).save(tmp_path / "background.png")
    for name in ("palette", "clear", "background"):
        image_ = segment(picture(), SegmentationOptions(marks=tmp_path / f"{name}.png"))
        assert set(image_.materials.names) == {"rgb_ff0000", "rgb_00ff00", "rgb_0000ff"}
        assert (
            image_.materials.colors[np.searchsorted(image_.materials.labels, image_.labels[45, 40])] == [0, 255, 0]
        ).all()


def test_void_is_not_grown_over() -> None:
    grey = picture().astype(float)
    grey[60:80, 60:70] = np.nan
    labels = segment(grey, SegmentationOptions(marks=strokes())).labels
    assert ((labels == VOID) == np.isnan(grey)).all()


def test_a_forest_finds_what_looks_like_the_marks() -> None:
    pytest.importorskip("sklearn")
    random = np.random.default_rng(4)
    grey = random.normal(128, 6, (ROWS, COLS))
    rough = ndimage.gaussian_filter(random.normal(0, 60, (ROWS, COLS)), 1.0)
    grey = np.where(TRUTH == 1, 128 + rough, grey).clip(0, 255).round().astype(np.uint8)  # texture, same mean
    marks = np.where(strokes() == 7, 3, strokes())
    marks[25:65, 38:42] = marks[44:48, 20:60] = 5
    marks[75:80, 10:80] = 3
    learnt = segment_picture(grey, SegmentationOptions(marks=marks, learn=True))
    grown = segment(grey, SegmentationOptions(marks=marks)).labels
    truth = np.where(TRUTH == 1, 5, 3)
    assert (learnt.image.labels == truth).mean() > max(0.95, (grown == truth).mean() + 0.05)
    again = segment(grey, SegmentationOptions(marks=marks, learn=True)).labels
    assert (again == learnt.image.labels).all()


def test_marks_that_cannot_be_used_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="same size"):
        marks_of(np.ones((3, 3), int), (ROWS, COLS))
    with pytest.raises(InputError, match="at least two"):
        marks_of((strokes() == 3).astype(int), (ROWS, COLS))
    with pytest.raises(InputError, match="radius"):
        marks_of([[1, 1, -1, 2.0]], (ROWS, COLS))
    blurred = ndimage.gaussian_filter(strokes().astype(float) * 30, 3)
    Image.fromarray(np.dstack([blurred, blurred * 0.7, blurred[::-1]]).astype(np.uint8)).save(tmp_path / "blurred.png")
    with pytest.raises(InputError, match="without blur"):
        marks_of(tmp_path / "blurred.png", (ROWS, COLS))
    with pytest.raises(InputError, match="one of them"):
        SegmentationOptions(3, marks=strokes())
    with pytest.raises(InputError, match="no marks"):
        SegmentationOptions(learn=True)
