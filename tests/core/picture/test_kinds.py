"""Label pictures told from raw ones, whatever their type, number of values and noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from imgquad_core.picture.kinds import kind_of
from imgquad_core.picture.segmentation import segment_picture
from imgquad_core.reading.formats import read_picture
from imgquad_core.reading.picture import Picture, picture_of

RAW = {"bone_trabecular_uct_0000", "carbonate_uct_raw", "ebsd_ti_orientation_raw", "oof2_ellipses_noise"}
RAW |= {"rock_sandstone_xpl_2a"}


def grains(n: int, side: int = 240, seed: int = 8) -> NDArray[np.int64]:
    """Voronoi grains, numbered from 1."""
    centres = np.random.default_rng(seed).uniform(0, side, (n, 2))
    nearest = cKDTree(centres).query(np.argwhere(np.ones((side, side), bool)))[1]
    return np.asarray(nearest.reshape(side, side) + 1)


@pytest.mark.parametrize("n", [2, 12, 33, 60, 250, 600])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.int16, np.int32, np.uint64, np.float32, np.float64])
def test_labels_of_any_number_and_type_are_materials(n: int, dtype: type) -> None:
    labels = grains(n)
    if labels.max() > np.iinfo(np.uint8).max and dtype == np.uint8:
        labels %= 256
    found = segment_picture(labels.astype(dtype))
    assert not found.quantised
    assert (found.image.labels == labels).all()
    assert found.image.materials.names == tuple(f"material {k}" for k in np.unique(labels))
    assert not found.warnings


def test_labels_in_a_palette_and_in_colours_are_materials() -> None:
    labels = grains(120)
    colors = np.random.default_rng(1).integers(0, 256, (256, 3)).astype(np.uint8)
    found = segment_picture(Picture(labels.astype(np.uint8), colors))
    assert (found.image.labels == labels).all()
    assert (found.image.materials.colors[found.image.labels - labels.min()] == colors[labels]).all()
    drawn = segment_picture(colors[labels])
    assert not drawn.quantised
    assert (drawn.image.materials.colors[drawn.image.labels] == colors[labels]).all()


@pytest.mark.parametrize("share", [0.1, 0.4])
@pytest.mark.parametrize("n", [5, 10, 40])
def test_salt_and_pepper_among_labels_leaves_them_labels(n: int, share: float) -> None:
    random = np.random.default_rng(n)
    labels = grains(80) % n * 7
    noisy = np.where(random.random(labels.shape) < share, random.integers(0, n, labels.shape) * 7, labels)
    assert kind_of(picture_of(noisy.astype(np.uint8))).is_labels


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint16, np.int32, np.float32])
def test_shades_of_any_type_are_raw(dtype: type) -> None:
    random = np.random.default_rng(4)
    shades = ndimage.gaussian_filter(random.normal(size=(240, 240)), 6) * 900 + random.normal(0, 6, (240, 240)) + 120
    if dtype == np.uint8:
        shades = shades.clip(0, 255)
    elif dtype == np.uint16:
        shades = shades.clip(0) * 90
    assert not kind_of(picture_of(shades.astype(dtype))).is_labels


@pytest.mark.parametrize("n", [12, 16, 25])
def test_a_dark_scan_of_few_grey_levels_is_raw(n: int) -> None:
    random = np.random.default_rng(n)
    shades = (grains(40) % 3) * n / 3 + random.normal(0, n / 9, (240, 240))
    few = np.clip(np.rint(shades), 0, n - 1).astype(np.uint8)
    assert len(np.unique(few)) == n
    assert not kind_of(picture_of(few)).is_labels


def test_an_empty_background_does_not_vote() -> None:
    random = np.random.default_rng(2)
    scan = np.zeros((300, 300))
    scan[100:200, 100:200] = 128 + random.normal(0, 20, (100, 100))
    assert not kind_of(picture_of(scan.astype(np.uint8))).is_labels
    cells = np.zeros((300, 300), np.int32)
    cells[60:240, 60:240] = grains(90, 180)
    assert kind_of(picture_of(cells)).is_labels


def test_what_is_void_does_not_vote() -> None:
    labels = grains(150).astype(np.int32)
    labels[np.random.default_rng(3).random(labels.shape) < 0.2] = -1
    found = segment_picture(labels)
    assert not found.quantised
    assert (found.image.labels == labels).all()


def test_the_note_says_why_and_doubt_says_what_else() -> None:
    note = segment_picture(grains(60).astype(np.uint16)).note
    assert note.startswith("60 materials, exact: ")
    assert "lonely" in note
    small = segment_picture(np.arange(40, dtype=np.uint8)[None].repeat(9, axis=0))
    assert any("colors = exact" in text for text in small.warnings)


def test_a_mask_with_anti_aliased_rims_has_the_materials_that_were_drawn() -> None:
    labels = grains(70, 480) % 19
    colors = np.random.default_rng(5).integers(0, 256, (19, 3)).astype(float)
    fine = colors[labels].reshape(120, 4, 120, 4, 3).mean(axis=(1, 3))
    found = segment_picture(np.rint(fine).astype(np.uint8))
    assert len(found.image.materials.labels) == 19
    assert {tuple(c) for c in found.image.materials.colors.tolist()} == {tuple(map(int, c)) for c in colors.tolist()}
    assert "blended" in found.note


def test_veins_of_one_pixel_are_materials_though_they_are_solid_nowhere() -> None:
    labels = grains(20)
    for k in range(8):
        labels[20 + 25 * k] = 100 + k
    found = segment_picture(labels.astype(np.uint8))
    assert (found.image.labels == labels).all()


def test_real_pictures_are_of_the_kind_that_their_catalogue_says(images: Path) -> None:
    for path in sorted(images.glob("*.*g")):
        assert kind_of(read_picture(path)).is_labels == (path.stem not in RAW), path.name


def test_letters_have_the_colours_they_were_drawn_in_and_cracks_keep_their_labels() -> None:
    from PIL import Image, ImageDraw

    page = Image.new("L", (600, 500), 0)
    draw = ImageDraw.Draw(page)
    draw.rectangle((0, 0, 590, 400), fill=252)
    for k in range(3):
        draw.text((10, 440 + 14 * k), f"EHT = {k}.00 kV  WD = 3.9 mm  Mag = 50.00 K X  Signal A = InLens", fill=252)
    letters = np.asarray(page)
    if len(np.unique(letters)) > 8:  # Pillow with FreeType draws blends
        assert segment_picture(letters).image.materials.labels.tolist() == [0, 252]
    cracks = np.zeros((200, 200), np.uint16)
    for k in range(40):
        cracks[5 * k, 3 * k % 60 : 3 * k % 60 + 90] = k + 1
    assert len(segment_picture(cracks).image.materials.labels) == 41
