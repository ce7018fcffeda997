"""Segmentation: material numbers and names, quantising, rims, noise, and the choice of `auto`."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage
from scipy.spatial import cKDTree

from imgquad_core.errors import InputError
from imgquad_core.model import VOID
from imgquad_core.picture.blends import find_rims
from imgquad_core.picture.classes import classes_of
from imgquad_core.picture.noise import automatic_limits, remove_noise
from imgquad_core.picture.quantisation import Histogram, errors_of, kmeans_centres, otsu_centres
from imgquad_core.picture.segmentation import SegmentationOptions, segment, segment_picture
from imgquad_core.reading.formats import read_picture
from imgquad_core.reading.picture import Picture, picture_of

COLORS = np.array(
    [[230, 25, 75], [60, 180, 75], [255, 225, 25], [0, 130, 200], [145, 30, 180], [128, 128, 128]], np.uint8
)


def grains(rows: int, cols: int, n: int = 6, seed: int = 3) -> NDArray[np.int64]:
    """Voronoi grains of about 100 pixels with labels 0 .. n - 1."""
    count = max(rows * cols // 10_000, 12)
    centres = np.random.default_rng(seed).random((count, 2)) * (rows, cols)
    nearest = cKDTree(centres).query(np.argwhere(np.ones((rows, cols), bool)))[1]
    return np.arange(count)[nearest.reshape(rows, cols)] % n


def anti_aliased(labels: NDArray[np.int64], colors: NDArray[np.uint8], times: int = 4) -> NDArray[np.uint8]:
    """Draw labels, `times` finer than the pixels, as area averages of their colours."""
    rows, cols = labels.shape[0] // times, labels.shape[1] // times
    fine = colors[labels].astype(float).reshape(rows, times, cols, times, -1)
    return np.rint(fine.mean(axis=(1, 3))).astype(np.uint8)


def majority(labels: NDArray[np.int64], times: int = 4) -> NDArray[np.int64]:
    rows, cols = labels.shape[0] // times, labels.shape[1] // times
    blocks = labels.reshape(rows, times, cols, times)
    shares = [(blocks == k).sum(axis=(1, 3)) for k in range(int(labels.max()) + 1)]
    return np.stack(shares).argmax(axis=0)


def matched(labels: NDArray[np.int32], truth: NDArray[np.int64]) -> NDArray[np.int64]:
    """Rename labels to what they mostly are in truth."""
    names = [np.bincount(truth[labels == k], minlength=1).argmax() for k in range(int(labels.max()) + 1)]
    return np.array(names)[labels]


def beside(labels: NDArray[np.int64], truth: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether each pixel has a label that truth has in its 3 x 3 neighbourhood."""
    found = np.zeros(truth.shape, bool)
    for k in np.unique(truth):
        found |= (labels == k) & ndimage.maximum_filter(truth == k, 3)
    return found


# ---------------------------------------------------------------------------------------------------- exact


def test_palette_indices_are_material_numbers() -> None:
    palette = np.array([[9, 9, 9], [1, 2, 3], [200, 100, 0], [0, 0, 0]], np.uint8)
    image = segment(Picture(np.array([[3, 0], [2, 3]], np.uint8), palette))
    assert image.labels.tolist() == [[3, 0], [2, 3]]
    assert image.materials.labels.tolist() == [0, 2, 3]
    assert image.materials.names == ("material 0", "material 2", "material 3")
    assert image.materials.colors.tolist() == [[9, 9, 9], [200, 100, 0], [0, 0, 0]]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.int32, np.float64])
def test_few_grey_values_are_material_numbers(dtype: type) -> None:
    values = np.array([[0, 100, 200], [7, 7, 100]], dtype)
    found = segment_picture(values)
    assert (found.image.labels == values).all()
    assert found.image.labels.dtype == np.int32
    assert found.image.materials.name_of(7) == "material 7"
    assert not found.quantised


def test_greys_that_can_be_told_apart_keep_their_look_others_get_colours() -> None:
    assert segment(np.array([[0, 100, 200]], np.uint8)).materials.colors[1].tolist() == [100, 100, 100]
    for values in (np.array([[0, 1, 2, 3, 4]], np.uint8), np.array([[0, 100, 200]], np.int32)):
        colors = segment(values).materials.colors.astype(int)
        apart = np.abs(colors[:, None] - colors[None, :]).sum(axis=2)[~np.eye(len(colors), dtype=bool)]
        assert apart.min() > 60
    # the colour of a label does not hang on the others
    assert (segment(np.array([[2, 9]])).materials.colors[0] == segment(np.array([[2, 3, 5]])).materials.colors[0]).all()


def test_colours_are_numbered_from_dark_to_light_however_the_picture_lies() -> None:
    rgb = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 0], [255, 128, 0]], [[0, 0, 255], [0, 0, 0]]], np.uint8)
    image = segment(rgb)
    assert image.labels.tolist() == [[2, 3], [0, 4], [1, 0]]
    assert image.materials.names == ("rgb_000000", "rgb_0000ff", "rgb_ff0000", "rgb_00ff00", "rgb_ff8000")
    assert (image.materials.colors[image.labels] == rgb).all()
    assert (segment(np.rot90(rgb)).labels == np.rot90(image.labels)).all()


def test_16_bit_colours_are_told_apart_by_all_their_bits() -> None:
    deep = np.array([[[1, 2, 3], [1, 2, 4], [60000, 0, 0]]], np.uint16)
    image = segment(deep)
    assert image.labels.tolist() == [[0, 1, 2]]
    assert image.materials.names == ("rgb_000100020003", "rgb_000100020004", "rgb_ea6000000000")
    assert image.materials.colors[2].tolist() == [234, 0, 0]


def test_exact_takes_every_value_and_a_number_those_that_are_there() -> None:
    ramp = np.arange(33, dtype=np.uint8)[None, :].repeat(5, axis=0)
    assert not segment_picture(ramp[:, :32]).quantised
    assert segment_picture(ramp).quantised
    assert segment_picture(ramp).warnings  # too few pixels to tell
    assert not segment_picture(ramp, SegmentationOptions("exact")).quantised
    assert (segment(ramp.astype(np.int32)).labels == ramp).all()
    many = np.arange(90_000).reshape(300, 300)
    assert (segment(many, SegmentationOptions("exact")).labels == many).all()
    rgb = np.stack([many % 256, many // 256 % 256, many % 7], axis=2).astype(np.uint8)
    exact = segment(rgb, SegmentationOptions("exact"))
    assert (exact.materials.colors[exact.labels] == rgb).all()
    found = segment_picture(ramp[:, :9], SegmentationOptions(9))
    assert not found.quantised
    assert "9 materials, exact" in found.note


def test_minus_one_is_void_and_does_not_count() -> None:
    labels = np.array([[VOID, 5], [0, VOID]])
    image = segment(labels)
    assert (image.labels == labels).all()
    assert image.materials.labels.tolist() == [0, 5]


def test_transparent_pixels_become_void_when_asked_for() -> None:
    rgba = np.zeros((8, 40, 4), np.uint8)
    rgba[..., 0] = np.arange(40) * 6
    rgba[:, 8:, 3] = 255
    rgba[:, 8:, 0] //= 16
    kept = segment(rgba)
    assert (kept.labels != VOID).all()
    dropped = segment(rgba, SegmentationOptions(drop_transparent=True))
    assert ((dropped.labels == VOID) == (rgba[..., 3] == 0)).all()
    assert len(dropped.materials.labels) == len(np.unique(rgba[:, 8:, 0]))
    by_number = segment(rgba, SegmentationOptions(3, drop_transparent=True))
    assert ((by_number.labels == VOID) == (rgba[..., 3] == 0)).all()
    rgba[..., 3] = 0
    with pytest.raises(InputError, match="wholly transparent"):
        segment(rgba, SegmentationOptions(drop_transparent=True))


def test_values_that_cannot_be_material_numbers_are_refused() -> None:
    with pytest.raises(InputError, match="from -2 to 3"):
        segment(np.array([[-2, 3]]))
    with pytest.raises(InputError, match="4294967295"):
        segment(np.array([[0, 2**32 - 1]], np.uint32))
    with pytest.raises(InputError, match="holds labels"):
        segment(Picture(np.array([[0, 1]]), labels=True), SegmentationOptions(3))


def test_values_that_are_not_whole_are_numbered_from_the_smallest() -> None:
    image = segment(np.array([[1.5, -0.5], [0.25, 1.5]]))
    assert image.labels.tolist() == [[2, 0], [1, 2]]
    assert image.materials.names == ("value -0.5", "value 0.25", "value 1.5")


@pytest.mark.parametrize("bad", ["many", 0, -3, 257, True, [[1, 2]], [[0, 0, 300]], []])
def test_options_that_make_no_sense_are_refused(bad: object) -> None:
    with pytest.raises(InputError, match="colors is"):
        SegmentationOptions(bad)  # type: ignore[arg-type]


# ----------------------------------------------------------------------------------------------- quantised


def test_a_rim_between_dark_and_light_is_never_the_mid_grey_that_is_there_too() -> None:
    rows, cols = np.mgrid[0:400, 0:480]
    truth = np.where((rows - 200) ** 2 + (cols - 150) ** 2 < 110**2, 2, 0)  # light disc on dark
    truth[:, 320:] = 1  # the mid grey, beside the dark
    greys = np.array([[20], [128], [236]], np.uint8)
    for times in (4, 2):
        picture = anti_aliased(truth, greys, times)
        fine = majority(truth, times)
        for image in (picture, np.repeat(picture, 3, axis=2)):
            labels = segment(image, SegmentationOptions(3)).labels
            assert beside(labels.astype(int), fine).all()
            assert (labels == fine).mean() > 0.995
    blurred = np.rint(ndimage.gaussian_filter(picture[..., 0].astype(float), 1.2)).astype(np.uint8)
    labels = segment(blurred, SegmentationOptions(3)).labels
    assert (labels[:, :150] != 1).all()


def test_thin_anti_aliased_lines_stay_whole() -> None:
    rows, cols = np.mgrid[0:400, 0:400]
    truth = np.where(cols < 200, 0, 1)
    truth[np.abs(rows - 0.37 * cols - 100) < 4] = 2  # two pixels wide, slanted
    colors = np.array([[30, 90, 160], [200, 60, 40], [250, 250, 240]], np.uint8)
    labels = segment(anti_aliased(truth, colors), SegmentationOptions(3)).labels
    line = matched(labels, majority(truth)) == 2
    _, n = ndimage.label(line, np.ones((3, 3)))
    assert n == 1
    assert line.any(axis=0).all()
    assert abs(line.mean() / (truth == 2).mean() - 1) < 0.1


def test_rims_are_blends_and_nothing_else() -> None:
    flat = np.zeros((20, 20, 1), np.uint8)
    flat[:, 10:] = 200
    assert not find_rims(flat, 16.0).any()
    flat[:, 10] = 100
    assert np.argwhere(find_rims(flat, 16.0).all(axis=0)).tolist() == [[10]]
    flat[:, 10] = 250  # brighter than both: a line
    assert not find_rims(flat, 16.0)[:, 10].any()
    flat[:, 10:12] = 100  # two pixels of a grey of their own: a layer
    assert not find_rims(flat, 16.0)[:, 10:12].any()


def test_grains_are_found_again_from_anti_aliased_noisy_and_jpeg_pictures() -> None:
    labels = grains(800, 1200)
    truth = majority(labels)
    smooth = anti_aliased(labels, COLORS)
    noise = np.random.default_rng(5).normal(0.0, 12.0, smooth.shape)
    noisy = np.clip(np.rint(smooth + noise), 0, 255).astype(np.uint8)
    file = io.BytesIO()
    Image.fromarray(smooth).save(file, "JPEG", quality=85)
    jpeg = np.asarray(Image.open(file))
    for picture, least in ((smooth, 0.995), (noisy, 0.99), (jpeg, 0.985)):
        found = segment_picture(picture)
        assert len(found.image.materials.labels) == 6
        assert found.quantised
        clean = remove_noise(found.image, automatic_limits(True, truth.shape))
        assert (matched(clean.labels, truth) == truth).mean() > least
    assert segment_picture(noisy).smoothed
    assert abs(segment_picture(noisy).noise - 12.0) < 2.0
    assert not segment_picture(smooth).smoothed


def test_grey_pictures_of_every_depth_give_the_same_classes() -> None:
    truth = grains(200, 300, 3)
    grey = np.clip(np.array([40, 110, 220])[truth] + np.random.default_rng(2).normal(0, 8, truth.shape), 1, 254)
    expected = segment_picture(np.rint(grey).astype(np.uint8))
    assert len(expected.image.materials.labels) == 3
    assert expected.method == "multi-Otsu"
    assert (expected.image.labels == truth).mean() > 0.99
    for deep in ((grey * 257).astype(np.uint16), grey / 1000.0, np.rint(np.dstack([grey] * 3)).astype(np.uint8)):
        found = segment_picture(deep)
        assert found.method == "multi-Otsu"
        assert (found.image.labels == expected.image.labels).mean() > 0.999
    names = segment_picture(grey / 1000.0).image.materials.names
    assert float(names[2].removeprefix("grey_")) == pytest.approx(0.22, abs=0.005)
    assert int(expected.image.materials.names[0].removeprefix("grey_")) == pytest.approx(40, abs=2)


def test_a_palette_keeps_its_order_and_takes_the_nearest() -> None:
    truth = grains(200, 300)
    noise = np.random.default_rng(1).normal(0.0, 6.0, (*truth.shape, 3))
    picture = np.clip(COLORS[truth] + noise, 0, 255).astype(np.uint8)
    options = SegmentationOptions([[int(level) for level in color] for color in COLORS])
    found = segment_picture(picture, options)
    assert (found.image.labels == truth).mean() > 0.99
    assert (found.image.materials.colors == COLORS).all()
    assert found.image.materials.names[0] == "rgb_e6194b"
    grey = segment(np.arange(256, dtype=np.uint8)[None].repeat(4, 0), SegmentationOptions([[0, 0, 0], [255, 255, 255]]))
    assert grey.labels[0, 0] == 0
    assert grey.labels[0, -1] == 1
    assert (np.diff(grey.labels[0]) >= 0).all()


def test_the_number_asked_for_is_the_number_given() -> None:
    random = np.random.default_rng(0).integers(0, 255, (60, 70, 3)).astype(np.uint8)
    for n in (1, 2, 5, 20):
        labels = segment(random, SegmentationOptions(n)).labels
        assert sorted(np.unique(labels)) == list(range(n))
    assert sorted(np.unique(segment(random[..., 0], SegmentationOptions(7)).labels)) == list(range(7))


@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (2, 40), (3, 3), (40, 2)])
def test_tiny_and_one_row_pictures_are_segmented(shape: tuple[int, int]) -> None:
    random = np.random.default_rng(0).integers(0, 255, (*shape, 3)).astype(np.uint8)
    for picture in (random, random[..., 0]):
        for colors in ("auto", "exact", 2, 1):
            assert segment(picture, SegmentationOptions(colors)).shape == shape


def test_the_same_picture_gives_the_same_bytes() -> None:
    random = np.random.default_rng(0).integers(0, 255, (80, 90, 3)).astype(np.uint8)
    smooth = ndimage.gaussian_filter(random.astype(float), (2, 2, 0)).astype(np.uint8)
    first, second = segment(smooth), segment(smooth.copy())
    assert first.labels.tobytes() == second.labels.tobytes()
    assert first.materials.names == second.materials.names


def test_labels_pass_through() -> None:
    image = segment(np.array([[0, 1]]))
    assert segment(image) is image
    assert not segment_picture(image).quantised


# -------------------------------------------------------------------------------------------------- choices


def test_multi_otsu_agrees_with_scikit_image() -> None:
    from skimage.filters import threshold_multiotsu

    random = np.random.default_rng(7)
    values = np.concatenate([random.normal(m, 12, 4000) for m in (50, 120, 200)]).clip(0, 255).astype(np.uint8)
    weights = np.bincount(values, minlength=256).astype(float)
    centres = otsu_centres(weights, 3)[2][:, 0]
    first, second = (int(t) for t in threshold_multiotsu(values, 3))
    classes = (values <= first, (values > first) & (values <= second), values > second)
    assert [values[c].mean() for c in classes] == pytest.approx(centres, abs=1e-9)


def test_kmeans_is_as_good_as_the_best_of_many_random_starts() -> None:
    from scipy.cluster.vq import kmeans

    random = np.random.default_rng(8)
    points = np.concatenate([random.normal(random.random(3) * 100, 6.0, (200, 3)) for _ in range(7)])
    weights = np.ones(len(points))
    for n in (2, 4, 7):
        ours = errors_of(points, weights, [kmeans_centres(points, weights, n)[-1]])[0]
        best = errors_of(points, weights, [kmeans(points, n, iter=30, rng=1)[0]])[0]
        assert ours < 1.02 * best


@pytest.mark.parametrize("n", [2, 3, 5, 8])
@pytest.mark.parametrize("dimension", [1, 3])
def test_classes_are_as_many_as_there_are_clusters(n: int, dimension: int) -> None:
    random = np.random.default_rng(n)
    middles = np.linspace(20, 230, n)[:, None] if dimension == 1 else 50 + random.permutation(n)[:, None] * (20, 0, 0)
    points = np.concatenate([random.normal(m, 2.5, (600, dimension)) for m in middles]).clip(0, 255)
    levels, weights = np.unique(np.rint(points), axis=0, return_counts=True)
    if dimension == 1:  # a bin a level
        weights, levels = np.bincount(points.round().astype(int).ravel(), minlength=256), np.arange(256.0)[:, None]
    empty = np.zeros((1, 1), np.int32)
    found = classes_of(Histogram(empty, empty.ravel(), levels, weights.astype(float)))
    assert len(found.means) == n
    assert found.separation > 4


@pytest.mark.parametrize(
    ("name", "n", "method"),
    [
        ("oof2_ellipses_noise.png", 5, "k-means in CIELAB"),
        ("bone_trabecular_uct_0000.png", 2, "multi-Otsu"),
        ("carbonate_uct_raw.png", 3, "multi-Otsu"),
    ],
)
def test_auto_sees_in_raw_pictures_what_people_see(images: Path, name: str, n: int, method: str) -> None:
    found = segment_picture(read_picture(images / name))
    assert len(found.image.materials.labels) == n
    assert (found.quantised, found.method, found.smoothed) == (True, method, True)


def test_raw_photographs_give_labels_without_salt_and_pepper(images: Path) -> None:
    for name in ("rock_sandstone_xpl_2a.jpg", "ebsd_ti_orientation_raw.png", "carbonate_uct_raw.png"):
        values = read_picture(images / name).values[:400, :400]
        found = segment_picture(picture_of(values))
        assert 2 <= len(found.image.materials.labels) <= 12
        clean = remove_noise(found.image, automatic_limits(True, found.image.shape)).labels
        alone = np.ones((398, 398), bool)
        for i, j in ((0, 1), (2, 1), (1, 0), (1, 2)):
            alone &= clean[1:-1, 1:-1] != clean[i : i + 398, j : j + 398]
        assert alone.mean() < 1e-3


def test_rims_of_the_oof2_polycrystal_make_no_third_material(images: Path) -> None:
    values = read_picture(images / "oof2_grains_large_5000.png").values
    found = segment_picture(picture_of(values[::2, ::2]))  # coarser, the rims are as sharp as they come
    assert len(found.image.materials.labels) == 8
    white = int(found.image.materials.labels[-1])
    labels = found.image.labels
    for a, b in ((labels[:, 1:], labels[:, :-1]), (labels[1:], labels[:-1])):
        # every grain is surrounded by the white phase: no two others touch
        assert ((a == b) | (a == white) | (b == white)).all()
