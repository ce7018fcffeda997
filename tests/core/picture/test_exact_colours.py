"""One material per value: numbers beside `np.unique`, limits, void, and the order of colours."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.errors import InputError
from imgquad_core.model import VOID
from imgquad_core.picture.codes import codes_of, numbered
from imgquad_core.picture.exact_colours import dark_to_light, exact_labels
from imgquad_core.reading.picture import picture_of


@pytest.mark.parametrize("n", [1, 5, 255, 256, 257, 400])
def test_labels_are_the_values(n: int) -> None:
    values = np.random.default_rng(n).integers(0, n, (40, 41)).astype(np.int32) * 3
    found = exact_labels(picture_of(values), 1000, None)
    assert found is not None
    assert np.array_equal(found.image.labels, values)
    assert np.array_equal(found.image.materials.labels, np.unique(values))
    assert found.blends == 0


@pytest.mark.parametrize(("n", "most", "is_none"), [(5, 5, False), (5, 4, True), (300, 300, False), (300, 299, True)])
def test_more_values_than_allowed_give_none(n: int, most: int, is_none: bool) -> None:
    values = np.arange(n, dtype=np.int32).reshape(1, -1)
    assert (exact_labels(picture_of(values), most, None) is None) == is_none
    with_void = np.concatenate([values, [[VOID]]], axis=1)
    assert (exact_labels(picture_of(with_void), most, None) is None) == is_none


def test_masked_pixels_are_void_and_no_material() -> None:
    values = np.array([[4, 4, 9], [9, 7, 7]], np.int32)
    found = exact_labels(picture_of(values), 9, values == 7)
    assert found is not None
    assert found.image.labels.tolist() == [[4, 4, 9], [9, VOID, VOID]]
    assert found.image.materials.labels.tolist() == [4, 9]


@pytest.mark.parametrize("n", [1, 40, 511, 512, 513, 5000])
@pytest.mark.parametrize("dtype", [np.int32, np.int64])
def test_codes_are_numbered_as_np_unique_does(n: int, dtype: type) -> None:
    codes = np.random.default_rng(n).integers(-n, n, (80, 90)).astype(dtype) * 1001
    values, numbers = np.unique(codes, return_inverse=True)
    found = numbered(codes, len(values))
    assert found is not None
    assert np.array_equal(found.codes, values)
    assert np.array_equal(found.numbers, numbers.reshape(codes.shape))
    assert len(values) == 1 or numbered(codes, len(values) - 1) is None


def test_colours_have_codes_of_their_own_at_8_and_16_bits() -> None:
    for dtype in (np.uint8, np.uint16):
        values = np.random.default_rng(3).integers(0, np.iinfo(dtype).max, (30, 30, 3), endpoint=True).astype(dtype)
        assert len(np.unique(codes_of(values))) == len(np.unique(values.reshape(-1, 3), axis=0))


def test_reals_have_codes_of_their_own_and_both_zeros_one() -> None:
    values = np.array([[0.0, -0.0, 0.5, 0.25]])
    for dtype in (np.float32, np.float64):
        a, b, c, d = codes_of(values.astype(dtype))[0]
        assert a == b
        assert len({a, c, d}) == 3


def test_labels_that_are_no_material_numbers_are_refused() -> None:
    with pytest.raises(InputError, match="from 0 to 2147483647"):
        exact_labels(picture_of(np.array([[2**31, 0]])), 9, None)


def test_dark_comes_before_light_by_the_lightness_of_the_eye() -> None:
    colors = np.array([[0, 0, 255], [255, 0, 0], [0, 255, 0], [0, 0, 0], [255, 255, 255]])
    assert dark_to_light(colors).tolist() == [3, 0, 1, 2, 4]
