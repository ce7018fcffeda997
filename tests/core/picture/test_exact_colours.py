"""One material per value: numbers beside `np.unique`, limits, void, and the order of colours."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.errors import InputError
from imgquad_core.model import VOID
from imgquad_core.picture.exact_colours import FEW, codes_of, dark_to_light, exact_labels, number_codes
from imgquad_core.picture.picture import Picture, picture_of


@pytest.mark.parametrize("n", [1, 5, 255, 256, 257, 400])
def test_labels_are_the_places_of_the_sorted_values(n: int) -> None:
    values = np.random.default_rng(n).integers(0, n, (40, 41)).astype(np.int32) * 3
    image = exact_labels(picture_of(values), 1000, True, None)
    assert image is not None
    assert np.array_equal(image.labels, values)
    assert np.array_equal(image.materials.labels, np.unique(values))


@pytest.mark.parametrize(("n", "most", "is_none"), [(5, 5, False), (5, 4, True), (300, 300, False), (300, 299, True)])
def test_more_values_than_allowed_give_none(n: int, most: int, is_none: bool) -> None:
    values = np.arange(n, dtype=np.int32).reshape(1, -1)
    assert (exact_labels(picture_of(values), most, True, None) is None) == is_none
    with_void = np.concatenate([values, [[VOID]]], axis=1)
    assert (exact_labels(picture_of(with_void), most, True, None) is None) == is_none


def test_masked_pixels_are_void_and_no_material() -> None:
    values = np.array([[4, 4, 9], [9, 7, 7]], np.int32)
    image = exact_labels(picture_of(values), 9, True, values == 7)
    assert image is not None
    assert image.labels.tolist() == [[4, 4, 9], [9, VOID, VOID]]
    assert image.materials.labels.tolist() == [4, 9]


@pytest.mark.parametrize("room", [3, 4, 9])
def test_codes_are_numbered_as_they_come_until_the_room_is_full(room: int) -> None:
    codes = np.array([[7, 7, 2], [2, 5, 7], [9, 5, 2]], np.int64)
    found, numbers = np.empty(room, np.int64), np.empty(codes.shape, np.int32)
    n = number_codes(codes, found, numbers)
    if room < 4:
        assert n == room + 1
    else:
        assert n == 4
        assert found[:4].tolist() == [7, 2, 5, 9]
        assert np.array_equal(found[numbers], codes)


def test_colours_have_codes_of_their_own_at_8_and_16_bits() -> None:
    for dtype in (np.uint8, np.uint16):
        values = np.random.default_rng(3).integers(0, np.iinfo(dtype).max, (30, 30, 3), endpoint=True).astype(dtype)
        codes = codes_of(picture_of(values), True)
        assert codes is not None
        assert len(np.unique(codes)) == len(np.unique(values.reshape(-1, 3), axis=0))


def test_greys_that_are_not_whole_are_none_or_refused() -> None:
    picture = picture_of(np.array([[0.5, 1.0]]))
    assert codes_of(picture, False) is None
    with pytest.raises(InputError, match="not whole numbers"):
        codes_of(picture, True)
    large = picture_of(np.array([[2**31, 0]]))
    assert isinstance(large, Picture)
    with pytest.raises(InputError, match="0 to 2147483647"):
        codes_of(large, True)


def test_dark_comes_before_light_by_the_lightness_of_the_eye() -> None:
    colors = np.array([[0, 0, 255], [255, 0, 0], [0, 255, 0], [0, 0, 0], [255, 255, 255]])
    assert dark_to_light(colors).tolist() == [3, 0, 1, 2, 4]
    assert FEW == 256
