"""What is thinner than a tolerance goes to its neighbours, what is wider stays where it was."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter

from imgquad_core.errors import InputError
from imgquad_core.geometry.corner_rule import corner_rule
from imgquad_core.measures.quality import region_areas
from imgquad_core.options import MeshOptions
from imgquad_core.picture import AbsorbOptions, absorb_thin, areas_of_origin
from imgquad_core.picture.cores import PX, distances, flood, near_core
from imgquad_core.pipeline import run
from imgquad_core.remedies import lost_materials
from support.invariants import assert_accounted, assert_simplified_mesh
from support.labels import any_labels, label_image, voronoi

Labels = NDArray[np.int32]


@pytest.mark.parametrize("seed", range(20))
def test_distances_are_those_to_other_labels_and_the_frame(seed: int) -> None:
    labels = np.ascontiguousarray(any_labels(seed))
    padded = np.pad(labels, 1, constant_values=-9)
    slow = np.zeros(padded.shape)
    for label in np.unique(labels):
        mine = padded == label
        slow[mine] = distance_transform_edt(mine)[mine]
    assert np.allclose(distances(labels), slow[1:-1, 1:-1])


def stripe(width: int) -> Labels:
    labels = np.zeros((60, 60), np.int32)
    labels[:, 30 : 30 + width] = 1
    return labels


@pytest.mark.parametrize("width", [3, 5, 7])
def test_a_thin_stripe_goes_and_a_wide_one_stays(width: int) -> None:
    thin = absorb_thin(label_image(stripe(width)), AbsorbOptions(width + 2.0)).image.labels
    assert (thin == 0).all()
    wide = absorb_thin(label_image(stripe(width + 3)), AbsorbOptions(width + 1.0)).image.labels
    assert np.array_equal(wide, stripe(width + 3))


def test_a_kept_material_loses_nothing() -> None:
    labels = stripe(3)
    made = absorb_thin(label_image(labels), AbsorbOptions(8.0, (1,)))
    assert (made.image.labels[labels == 1] == 1).all()
    assert [row.lost for row in made.materials if row.material == 1] == [0]


def test_a_bridge_is_cut_and_both_sides_share_it_alike() -> None:
    labels = np.zeros((60, 90), np.int32)
    labels[10:50, 10:35] = labels[10:50, 55:80] = labels[28:31, 35:55] = 1
    made = absorb_thin(label_image(labels), AbsorbOptions(10.0))
    after = made.image.labels
    assert (after[20:40, 44:46] == 0).all()
    assert (after[15:45, 15:30] == 1).all()
    assert [(row.regions, row.absorbed) for row in made.materials] == [(1, 0), (1, 0)]


def test_small_regions_are_gone_and_said_to_be() -> None:
    labels = np.zeros((60, 60), np.int32)
    labels[20:24, 20:24] = 1
    labels[40:55, 40:55] = 2
    made = absorb_thin(label_image(labels), AbsorbOptions(8.0))
    assert set(np.unique(made.image.labels)) == {0, 2}
    gone = next(row for row in made.materials if row.material == 1)
    assert (gone.regions, gone.absorbed, gone.pixels, gone.lost) == (1, 1, 16, 16)


def test_void_stays_void() -> None:
    labels = stripe(3)
    labels[:, 10:12] = -1
    after = absorb_thin(label_image(labels), AbsorbOptions(8.0)).image.labels
    assert np.array_equal(after == -1, labels == -1)


def test_what_is_thin_between_void_pixels_stays_as_it_is() -> None:
    labels = np.array([[3, 3, 0, 1, 6, 6, 5, 1, 1, -1, 2, 2, 4, -1, -1, 2, 1, 7, 1, 1, 3, 5, -1, 6]], np.int32)
    done = run(label_image(labels), MeshOptions(size=1.0, step=2.0, tolerance=4.0, keep=(7,)))
    assert_accounted(done)
    assert_simplified_mesh(done.mesh, done.labels)
    assert np.array_equal(done.labels.labels[0, :15], labels[0, :15])
    assert (done.labels.labels[0, 15:22] == 7).all()


def test_a_picture_that_is_thin_all_over_keeps_a_material() -> None:
    labels = np.random.default_rng(1).integers(0, 3, (40, 40)).astype(np.int32)
    after = absorb_thin(label_image(labels), AbsorbOptions(8.0)).image.labels
    assert len(np.unique(after)) >= 1
    tiny = absorb_thin(label_image(labels[:3, :3]), AbsorbOptions(8.0)).image.labels
    assert tiny.shape == (3, 3)


def test_a_tolerance_wider_than_all_parts_is_told_with_the_remedy() -> None:
    labels = stripe(3)[:20]  # 20 px high: nothing is wider
    done = run(label_image(labels), MeshOptions(size=8.0, tolerance=32.0))
    assert np.array_equal(done.labels.labels, labels)
    (told,) = lost_materials(done)
    assert "no part of the picture is that wide (the widest: 20 px)" in told
    assert "as without a tolerance; lower it" in told


@pytest.mark.parametrize("tolerance", [4.0, 40.0])
def test_a_tolerance_wider_than_all_parts_gives_the_mesh_without_one(tolerance: float) -> None:
    labels = np.random.default_rng(1).integers(0, 3, (30, 30)).astype(np.int32)
    labels[:12, :12] = voronoi(12, 12, 4, 1)
    labels = labels if tolerance == 40.0 else (np.indices((30, 30)).sum(axis=0) // 2 % 2).astype(np.int32)
    done, plain = (run(label_image(labels), MeshOptions(size=6.0, tolerance=t)) for t in (tolerance, 0.0))
    assert_accounted(done)
    assert np.array_equal(done.mesh.quads, plain.mesh.quads)
    assert np.array_equal(done.mesh.points, plain.mesh.points)
    assert len(lost_materials(done)) == 1


def test_a_tolerance_whose_square_no_region_has_is_told() -> None:
    labels = np.zeros((20, 20), np.int32)
    labels[0, 0] = 1
    done = run(label_image(labels), MeshOptions(size=4.0, tolerance=19.99))
    assert np.array_equal(done.labels.labels, labels)
    assert "no region of the picture has its square, 400 pixels" in lost_materials(done)[0]


def test_what_is_kept_is_as_wide_as_any_tolerance() -> None:
    done = run(label_image(stripe(9)[:20]), MeshOptions(size=8.0, tolerance=32.0, keep=(0, 1)))
    assert not done.too_wide
    assert lost_materials(done) == ()


def test_rests_have_the_area_of_what_they_are_the_rest_of() -> None:
    before, after = stripe(3), np.zeros((60, 60), np.int32)
    after[20:, 30:33] = 1
    areas = areas_of_origin(before, after, corner_rule("minority"))
    assert areas.sum() == pytest.approx(3600)
    assert sorted(areas) == pytest.approx([180, 3420], rel=0.03)


def test_a_region_gets_back_the_area_of_its_arms() -> None:
    labels = np.zeros((120, 120), np.int32)
    labels[40:80, 40:80] = 1
    for row in (46, 70):
        labels[row : row + 5, 10:110] = 1
    done = run(label_image(labels), MeshOptions(size=16.0, tolerance=8.0))
    assert np.count_nonzero(done.labels.labels == 1) < 1750
    area = region_areas(done.mesh)[done.mesh.region_label == 1].sum()
    assert area == pytest.approx(np.count_nonzero(labels == 1), rel=0.02)


@pytest.mark.parametrize("tolerance", [2.0, 5.0, 9.0])
def test_grains_keep_their_areas_as_wanted(tolerance: float) -> None:
    labels = voronoi(80, 80, 12, 2)
    made = absorb_thin(label_image(labels), AbsorbOptions(tolerance))
    large = np.repeat(np.repeat(labels, made.times, axis=0), made.times, axis=1)
    areas = areas_of_origin(large, made.enlarged.labels, corner_rule("minority"))
    assert areas.sum() == pytest.approx(large.size, rel=0.02)


@pytest.mark.parametrize("seed", range(4))
def test_specks_all_over_leave_each_large_material_its_share(seed: int) -> None:
    fields = gaussian_filter(np.random.default_rng(seed).normal(size=(3, 200, 200)), (0, 2, 2))
    f, g, h = fields / fields.std(axis=(1, 2), keepdims=True)
    labels = np.where(h > 2.7, 3, np.where(g > 2.0, 2, f > 0.5)).astype(np.int32)
    made = absorb_thin(label_image(labels), AbsorbOptions(16.0))
    assert made.is_noisy
    before, after = (np.bincount(x.ravel(), minlength=4) for x in (labels, made.image.labels))
    assert (abs(after - before)[:2] <= 0.15 * before[:2]).all()
    assert (after[2:] <= before[2:]).all()  # the rare ones are lost, perhaps, but never take the place of others


def test_a_flood_takes_the_nearest() -> None:
    labels = np.array([[1, 0, 0, 0, 2]], np.int32)
    kept = labels > 0
    after, gone = flood(labels, kept)
    assert after[0, [1, 3]].tolist() == [1, 2]
    assert (gone[0] / PX).tolist() == [0, 1, 2, 1, 0]


def test_ways_stay_in_their_region() -> None:
    labels = np.zeros((20, 40), np.int32)
    labels[:, 20] = 1
    distance = np.zeros((20, 40), np.float32)
    distance[10, 5] = 5.0
    kept = near_core(labels, distance, 4.0, 12.0)
    assert kept[10, 17]
    assert not kept[10, 18]
    assert not kept[:, 20:].any()


@pytest.mark.parametrize("tolerance", [-1.0, 0.5, float("nan")])
def test_bad_tolerances_are_refused(tolerance: float) -> None:
    with pytest.raises(InputError, match="tolerance is"):
        AbsorbOptions(tolerance)


@pytest.mark.parametrize("tolerance", [2.0, 7.0])
def test_what_is_absorbed_at_one_place_hangs_on_no_other(tolerance: float) -> None:
    labels = np.full((140, 500), 99, np.int32)
    places = [slice(left, left + 140) for left in (0, 183, 357)]
    for place in places:
        labels[40:100, place.start + 40 : place.start + 100] = voronoi(60, 60, 30, seed=3)
    after = absorb_thin(label_image(labels), AbsorbOptions(tolerance)).image.labels
    assert (after != labels).any()
    for place in places[1:]:
        assert np.array_equal(after[:, place], after[:, places[0]])
