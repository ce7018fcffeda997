"""Raw pictures of known truth: how many classes, where they are, and what must not disturb them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from imgquad_core.picture.levels import levels_of, noise_of
from imgquad_core.picture.noise import automatic_limits, remove_noise
from imgquad_core.picture.raw import find_classes, find_known, known_classes
from imgquad_core.picture.segmentation import SegmentationOptions, segment_picture
from imgquad_core.picture.total_variation import total_variation
from imgquad_core.reading.picture import picture_of

SIDE = 220
Y, X = np.mgrid[:SIDE, :SIDE] + 0.5


def blobs(n: int, seed: int) -> NDArray[np.int64]:
    """Phases of equal shares, bands of a smooth random field."""
    field = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=(SIDE, SIDE)), 14)
    return np.searchsorted(np.quantile(field, np.arange(1, n) / n), field)


def noisy(truth: NDArray[np.int64], snr: float, seed: int = 1, low: float = 50.0, high: float = 200.0) -> NDArray:
    """Greys from low to high with a noise of the step over `snr`."""
    n = int(truth.max()) + 1
    greys = np.linspace(low, high, n)
    noise = np.random.default_rng(seed).normal(0, (greys[1] - greys[0]) / snr, truth.shape)
    return np.asarray(greys[truth] + noise)


def byte(values: NDArray) -> NDArray[np.uint8]:
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


@pytest.mark.parametrize(("n", "snr"), [(2, 1.0), (3, 1.5), (4, 2.0), (5, 4.0), (8, 8.0)])
def test_there_are_as_many_classes_as_phases(n: int, snr: float) -> None:
    for seed in (11, 12):
        truth = blobs(n, seed)
        found = segment_picture(byte(noisy(truth, snr, seed)))
        assert len(found.image.materials.labels) == n
        clean = remove_noise(found.image, automatic_limits(True, truth.shape)).labels
        assert (clean == truth).mean() > 0.93


@pytest.mark.parametrize("dtype", [np.int16, np.int32, np.uint32, np.float32])
def test_grey_of_any_type_is_divided_as_bytes_are(dtype: type) -> None:
    truth = blobs(3, 5)
    grey = noisy(truth, 5.0)
    values = grey * 12 - (900 if dtype != np.uint32 else 0)  # Hounsfield
    expected, found = segment_picture(byte(grey)), segment_picture(values.astype(dtype))
    assert found.quantised
    assert len(found.image.materials.labels) == 3
    assert (found.image.labels == expected.image.labels).mean() > 0.99
    name = found.image.materials.names[2]
    assert float(name.removeprefix("grey_")) == pytest.approx(200 * 12 - (900 if dtype != np.uint32 else 0), abs=20)


def test_hot_pixels_and_void_take_no_range() -> None:
    truth = blobs(6, 7)
    grey = noisy(truth, 6.0) / 1000
    hot = grey.copy()
    hot[np.arange(5, 215, 10), np.arange(3, 213, 10)] = 60_000.0
    assert len(segment_picture(hot).image.materials.labels) == 6
    holes = grey.copy()
    holes[(X - 60) ** 2 + (Y - 80) ** 2 < 900] = np.nan
    found = segment_picture(holes)
    assert len(found.image.materials.labels) == 6
    assert ((found.image.labels == -1) == np.isnan(holes)).all()
    assert "void" in found.note
    masked = np.ma.MaskedArray(np.where(np.isnan(holes), -9999.0, holes), np.isnan(holes))
    assert (segment_picture(masked).image.labels == found.image.labels).all()


@pytest.mark.parametrize("n", [2, 3, 4])
@pytest.mark.parametrize("part", [0.4, 0.9])
def test_uneven_light_is_taken_out(n: int, part: float) -> None:
    truth = blobs(n, n)
    flat = noisy(truth, 8.0, low=80, high=170)
    step = 90 / (n - 1)
    light = (X / SIDE - 0.5 + 0.5 * (Y / SIDE - 0.5) ** 2) * part * step
    shaded = byte(flat + light)
    found = segment_picture(shaded)
    assert len(found.image.materials.labels) == n
    assert (found.image.labels == truth).mean() > 0.97
    assert ("uneven light" in found.note) == found.details.__contains__("uneven")
    off = segment_picture(shaded, SegmentationOptions(flatten="off"))
    assert "uneven light" not in off.note
    if part > 0.5:
        assert "uneven light" in found.note


def test_even_light_is_left_alone() -> None:
    for n, seed in ((2, 1), (3, 2), (5, 3), (4, 4)):
        assert "uneven" not in segment_picture(byte(noisy(blobs(n, seed), 5.0, seed))).note


def test_the_outside_of_a_cylinder_is_a_class_that_hides_no_other() -> None:
    truth = blobs(2, 9)
    grey = noisy(truth, 3.0, low=120, high=150)
    outside = (X - 110) ** 2 + (Y - 110) ** 2 > 100**2
    found = segment_picture(byte(np.where(outside, 0, grey)))
    assert len(found.image.materials.labels) == 3
    assert (found.image.labels[outside] == 0).all()
    assert (found.image.labels[~outside] == truth[~outside] + 1).mean() > 0.93
    assert "constant" in found.note


@pytest.mark.parametrize("seed", [0, 2, 3, 5])
def test_a_blurred_drawing_in_flat_greys_has_these(seed: int) -> None:
    truth = blobs(3, seed)
    drawn = ndimage.gaussian_filter(np.array([40.0, 220.0, 130.0])[truth], 2.0)
    assert len(segment_picture(byte(drawn)).image.materials.labels) == 3


# a phase of .2 % of the support is a class of the histogram; only a rarer one is found as its tail
@pytest.mark.parametrize(("radius2", "rare"), [(10, True), (13, True), (16, False), (30, False)])
def test_a_rare_bright_phase_is_found_and_none_invented(radius2: int, rare: bool) -> None:
    truth = blobs(2, 6)
    for x, y in ((50, 50), (150, 60), (90, 170)):
        truth[(X - x) ** 2 + (Y - y) ** 2 < radius2] = 2
    greys = np.array([60.0, 110.0, 220.0])[truth]
    found = segment_picture(byte(greys + np.random.default_rng(0).normal(0, 9, greys.shape)))
    assert len(found.image.materials.labels) == 3
    assert ((found.image.labels == 2) == (truth == 2)).mean() > 0.998
    assert ("rare" in found.note) == rare


def test_one_phase_is_one_material_with_a_warning() -> None:
    found = segment_picture(byte(np.random.default_rng(5).normal(120, 20, (SIDE, SIDE))))
    assert len(found.image.materials.labels) == 1
    assert any("colors = N" in text for text in found.warnings)


# the usual filter leaves a third of a vein's contrast, in which it would break up at SNR 8; the light one leaves more
@pytest.mark.parametrize("seed", [2, 3, 4, 5])
@pytest.mark.parametrize(("snr", "kept", "invented"), [(8.0, 0.92, 0.02), (16.0, 0.98, 0.02)])
def test_a_vein_of_one_pixel_stays(snr: float, kept: float, invented: float, seed: int) -> None:
    truth = np.abs(Y - 110 - 30 * np.sin(X / 25)) < 0.5
    grey = np.where(truth, 60.0, 170.0) + np.random.default_rng(seed).normal(0, 110 / snr, truth.shape)
    found = segment_picture(byte(grey))
    assert len(found.image.materials.labels) == 2
    dark = found.image.labels == 0
    assert (dark & truth).sum() > kept * truth.sum()
    assert (dark & ~truth).sum() < invented * truth.sum()
    assert not found.warnings


def test_veins_keep_their_filter_in_other_pictures_of_the_same_thing() -> None:
    truth = np.abs(Y - 110 - 30 * np.sin(X / 25)) < 0.5
    grey = [np.where(truth, 60.0, 170.0) + np.random.default_rng(k).normal(0, 110 / 8, truth.shape) for k in (2, 3)]
    known = known_classes(find_classes(levels_of(picture_of(byte(grey[0])), None)))
    dark = find_known(levels_of(picture_of(byte(grey[1])), None), known) == 0
    assert (dark & truth).sum() > 0.92 * truth.sum()
    assert (dark & ~truth).sum() < 0.02 * truth.sum()


@pytest.mark.parametrize(("seed", "n", "part"), [(1, 2, 0.6), (3, 3, 0.9)])
def test_uneven_light_that_looks_like_a_class_more_is_taken_out(seed: int, n: int, part: float) -> None:
    truth = blobs(n, seed)
    flat = noisy(truth, 8.0, seed, low=80, high=170)
    light = (X / SIDE - 0.5 + 0.6 * (Y / SIDE - 0.5) ** 2) * part * 90 / (n - 1)
    found = segment_picture(byte(flat + light))
    assert len(found.image.materials.labels) == n
    assert (found.image.labels == truth).mean() > 0.97


def test_noise_is_measured_white_and_correlated() -> None:
    truth = blobs(3, 2)
    white = np.random.default_rng(1).normal(0, 9.0, truth.shape)
    for shades in (110 + white, 40 + 70 * truth + white):
        assert noise_of(levels_of(picture_of(byte(shades)), None)) == pytest.approx(9.0, rel=0.1)
    # as of resampling: between neighbours it is under-read by 30 to 80 %
    for blur, least in ((0.5, 0.6), (0.6, 0.6), (0.8, 0.5)):
        smooth = ndimage.gaussian_filter(np.random.default_rng(1).normal(0, 20.0, truth.shape), blur)
        levels = levels_of(picture_of(byte(40 + 70 * truth + smooth)), None)
        assert least * smooth.std() < noise_of(levels) < 1.3 * smooth.std()
    assert noise_of(levels_of(picture_of(byte(40 + 70 * truth)), None)) == 0.0


def test_the_filter_is_that_of_scikit_image() -> None:
    from skimage.restoration import denoise_tv_chambolle

    for shape in ((90, 120), (1, 40), (40, 1), (1, 1)):
        image = np.random.default_rng(3).normal(120, 30, shape).astype(np.float32)
        expected = denoise_tv_chambolle(image / 255, weight=40 / 255, eps=1e-3, max_num_iter=60) * 255
        assert np.abs(total_variation(image, 40.0) - expected).max() < 1e-2


def test_strips_of_a_large_picture_do_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = byte(noisy(blobs(3, 8), 4.0))
    whole = segment_picture(picture).image.labels
    monkeypatch.setattr("imgquad_core.picture.levels.STRIP", SIDE * 80)
    assert (segment_picture(picture).image.labels == whole).mean() > 0.999


def test_noisy_colours_have_the_number_that_was_drawn() -> None:
    colors = np.array([[200, 40, 40], [60, 160, 70], [50, 70, 190], [230, 220, 120]], float)
    truth = blobs(4, 4)
    found = segment_picture(byte(colors[truth] + np.random.default_rng(3).normal(0, 14, (*truth.shape, 3))))
    assert len(found.image.materials.labels) == 4
    assert found.method == "k-means in CIELAB"


@pytest.mark.parametrize("n", [2, 4, 6])
def test_a_number_and_a_palette_keep_filter_and_rims(n: int) -> None:
    truth = blobs(n, 1)
    grey = ndimage.gaussian_filter(noisy(truth, 100.0), 1.0) + np.random.default_rng(1).normal(0, 8, truth.shape)
    number = segment_picture(byte(grey), SegmentationOptions(n))
    greys = np.linspace(50, 200, n).round().astype(int)
    palette = segment_picture(byte(grey), SegmentationOptions([[g, g, g] for g in greys.tolist()]))
    for found in (number, palette):
        assert found.smoothed
        assert (remove_noise(found.image, automatic_limits(True, truth.shape)).labels == truth).mean() > 0.9


@pytest.mark.parametrize("shade", [0.1, 0.2, 0.3])
def test_light_that_multiplies_is_taken_out_of_thin_and_thick_tissues(shade: float) -> None:
    y, x = np.mgrid[:256, :256] + 0.5
    r, t = np.hypot(x - 128, (y - 128) / 1.15), np.arctan2(y - 128, x - 128)
    wavy = 86 + 2 * np.cos(9 * t), 66 + 8 * np.cos(7 * t)
    tissue = np.select([r > 105, r > 98, r > 90, r > wavy[0], r > wavy[1]], [0, 1, 2, 3, 4], 5)
    grey = np.array([10, 150, 60, 35, 110, 185.0])[tissue] * (1 + shade * (x - 128) / 128)
    grey = ndimage.gaussian_filter(grey, 0.7) + np.random.default_rng(0).normal(0, 6, grey.shape)
    found = segment_picture(grey.clip(0, 255).astype(np.uint8))
    assert "uneven light taken out" in found.note
    assert np.mean(found.image.labels == np.array([0, 4, 2, 1, 3, 5])[tissue]) > 0.98


def test_few_bright_particles_in_a_noisy_matrix_are_a_phase() -> None:
    random = np.random.default_rng(3)
    y, x = np.mgrid[:300, :300]
    away = np.min([np.hypot(y - r, x - c) for r, c in random.integers(20, 280, (5, 2))], axis=0)
    matrix = 120 + 40 * np.sin(x / 40.0) + random.normal(0, 20, x.shape)
    particles = np.where(away < 7, 245 + random.normal(0, 6, x.shape), matrix)
    found = segment_picture(particles.clip(0, 255).astype(np.uint8))
    assert np.mean((found.image.labels == found.image.labels.max()) == (away < 7)) > 0.999
    assert "1 of them rare" in found.note


def test_a_halo_that_fades_out_is_no_phase() -> None:
    from skimage.data import cell

    assert len(segment_picture(cell()).image.materials.labels) == 2
