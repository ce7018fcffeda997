"""The whole chain on label pictures of every kind: what comes out is always a valid mesh of the picture."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import imgquad_core
from imgquad_core.errors import InputError, QualityError
from imgquad_core.ledger import material_ledger, region_errors
from imgquad_core.measures.quality import quality_report, require_quality
from imgquad_core.model import VOID, LabelImage, Materials
from imgquad_core.options import MeshOptions
from imgquad_core.picture.selection import crop_image, drop_materials, material_number
from imgquad_core.pipeline import STAGES, mesh_image, run
from imgquad_core.remedies import thin_features
from support.invariants import assert_accounted, assert_simplified_mesh, assert_valid_mesh
from support.labels import KINDS, Labels, label_image, labels_of_kind, voronoi, wedge

pictures = st.builds(
    labels_of_kind,
    st.sampled_from(KINDS),
    st.integers(1, 30),
    st.integers(1, 30),
    st.integers(1, 8),
    st.integers(0, 10_000),
)
quickly = settings(max_examples=40, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


@quickly
@given(pictures, st.sampled_from([1.0, 2.5, 6.0]))
def test_any_label_picture_gives_a_valid_mesh(labels: Labels, size: float) -> None:
    image = label_image(labels)
    assert_valid_mesh(mesh_image(image, MeshOptions(size=size)), image)


@quickly
@given(pictures, st.integers(0, 3), st.booleans(), st.permutations(range(8)))
def test_turned_mirrored_and_renumbered_pictures_are_meshed_as_well(
    labels: Labels, turns: int, mirror: bool, order: list[int]
) -> None:
    changed = np.rot90(np.asarray(order, np.int32)[labels], turns)
    image = label_image(changed[:, ::-1] if mirror else changed)
    assert_valid_mesh(mesh_image(image, MeshOptions(size=2.5)), image)


@quickly
@given(pictures, st.integers(0, 7))
def test_void_is_left_out(labels: Labels, void: int) -> None:
    image = label_image(np.where(labels == void, VOID, labels))
    if (image.labels == VOID).all():
        with pytest.raises(InputError, match="no pixel is left"):
            mesh_image(image)
        return
    assert_valid_mesh(mesh_image(image, MeshOptions(size=2.5)), image)


def test_averaged_chains_that_cross_at_every_second_point_keep_their_pixels() -> None:
    image = label_image(labels_of_kind("void", 20, 29, 7, 840808759))
    done = run(image, MeshOptions(size=6.0, effort="fast", policy="majority", tolerance=6.0, keep=(4,)))
    assert_simplified_mesh(done.mesh, done.labels)
    assert_accounted(done)


@pytest.mark.parametrize("effort", ["fast", "normal", "best"])
def test_every_effort_is_valid_and_the_same_with_two_threads(effort: str) -> None:
    image = label_image(voronoi(60, 80, 15, 5) % 4)
    one = mesh_image(image, MeshOptions(size=2, effort=effort))
    two = mesh_image(image, MeshOptions(size=2, effort=effort, threads=2))
    assert_valid_mesh(one, image)
    assert one.points.tobytes() == two.points.tobytes()
    assert one.quads.tobytes() == two.quads.tobytes()


def disc(radius: float = 20.0, side: int = 60) -> LabelImage:
    y, x = np.mgrid[:side, :side] + 0.5 - side / 2
    return label_image(np.hypot(x, y) < radius)


def test_area_of_every_material_is_that_of_its_pixels() -> None:
    made = run(disc(), MeshOptions(size=3))
    for row in material_ledger(made.picture, made.labels, made.boundary, made.mesh):
        assert row.mesh_area == pytest.approx(row.clean_pixels, rel=1e-3)
        assert row.boundary_area == pytest.approx(row.mesh_area, rel=1e-9)
    errors = region_errors(made.boundary)
    assert (errors.regions, errors.small_regions) == (2, 0)
    assert errors.worst_error < 1e-3


def test_elements_have_the_size_asked_for() -> None:
    for size in (2.0, 4.0):
        mesh = mesh_image(label_image(np.zeros((80, 120))), MeshOptions(size=size))
        assert mesh.n_quads == pytest.approx(80 * 120 / size**2, rel=0.15)


@pytest.mark.parametrize("sides", [(0.5, 0.25), (0.3, 0.39)])
def test_pixels_that_are_not_square_are_meshed_in_true_shape(sides: tuple[float, float]) -> None:
    rows, cols = round(40 * 0.25 / sides[1] * 2), round(30 * 0.5 / sides[0] * 2)
    y, x = (np.mgrid[:rows, :cols] + 0.5) * np.array(sides[::-1])[:, None, None]
    round_one = label_image(np.hypot(x - 15, y - 10) < 5)
    done = run(round_one, MeshOptions(size=3.0, pixel_size=sides))
    assert done.mesh.points.max(axis=0) == pytest.approx([cols * sides[0], rows * sides[1]], rel=1e-14)
    edges = np.roll(done.mesh.points[done.mesh.quads], 1, axis=1) - done.mesh.points[done.mesh.quads]
    assert np.hypot(*edges.T).mean() == pytest.approx(3.0 * min(sides), rel=0.2)
    assert quality_report(done.mesh).min_sj > 0.5
    (_, disc_account) = material_ledger(done.picture, done.labels, done.boundary, done.mesh, done.options.pixel_sides)
    assert disc_account.mesh_area * sides[0] * sides[1] == pytest.approx(25 * np.pi, rel=0.02)
    assert disc_account.boundary_area == pytest.approx(disc_account.mesh_area, rel=1e-6)
    assert abs(disc_account.error) < 0.01


def test_absurdly_stretched_pixels_are_refused() -> None:
    with pytest.raises(InputError, match=r"would need about .* for 30 x 10000000000 pixels: .* mend its spacing"):
        run(label_image(np.eye(30)[:20]), MeshOptions(pixel_size=(1.0, 5e8)))


def test_mesh_is_in_the_unit_of_the_pixel_size() -> None:
    plain, scaled = (run(disc(), MeshOptions(pixel_size=s)).mesh for s in (1.0, 0.25))
    assert np.allclose(scaled.points, plain.points / 4)
    assert_valid_mesh(scaled, disc(), pixel_size=0.25)


def test_run_keeps_all_values_and_times_and_tells_of_progress() -> None:
    told = []
    made = run(disc(), progress=lambda stage, number, total: told.append((stage, number, total)))
    begun = [(stage, i, len(STAGES)) for i, stage in enumerate(STAGES)]
    assert told[: len(STAGES)] == begun
    within = [number for _, number, _ in told[len(STAGES) :]]
    assert {stage for stage, *_ in told[len(STAGES) :]} == {"mesh"}
    assert within == sorted(within)
    assert within[-1] == pytest.approx(len(STAGES))
    assert tuple(made.seconds) == STAGES
    assert len(made.boundary.region_label) == len(made.pixel_boundary.region_label) == 2


def test_noise_goes_when_it_is_asked_to() -> None:
    labels = disc().labels.copy()
    labels[5, 5] = 2
    image = label_image(labels)
    assert set(np.unique(mesh_image(image).quad_material)) == {0, 1, 2}  # labels are taken at their word
    made = run(image, MeshOptions(min_pixels=4))  # the other limit follows
    assert set(np.unique(made.mesh.quad_material)) == {0, 1}
    assert [(r.material, r.clusters, r.pixels) for r in made.removed] == [(2, 1, 1)]
    assert_valid_mesh(made.mesh, made.labels)


def test_array_and_label_image_give_the_same_mesh() -> None:
    of_array, of_image = mesh_image(disc().labels), mesh_image(disc())
    assert np.array_equal(of_array.points, of_image.points)
    assert np.array_equal(of_array.quads, of_image.quads)


def test_asked_limit_that_is_not_met_names_the_places_and_keeps_the_mesh() -> None:
    mesh = mesh_image(label_image(wedge(45, 20, (10, 10), 40, 60)))
    require_quality(mesh, quality_report(mesh).min_sj - 1e-9)
    with pytest.raises(QualityError, match=r"scaled Jacobian below 1.*: 0\.7\d+ at \(.*m[01] \| m[01]") as caught:
        require_quality(mesh, 1.0)
    assert caught.value.mesh is mesh
    assert len(caught.value.worst) == 5


def test_too_many_quads_are_refused_before_the_work() -> None:
    with pytest.raises(InputError, match="larger size"):
        mesh_image(label_image(np.zeros((2000, 2000))), MeshOptions(size=0.05))


@pytest.mark.parametrize(
    "bad", [{"pixel_size": 0}, {"size": -1}, {"policy": "luck"}, {"effort": "x"}, {"min_pixels": -1}]
)
def test_bad_options_are_refused_at_once(bad: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=f"{next(iter(bad))}"):
        MeshOptions(**bad)


def test_materials_are_found_by_name_and_number() -> None:
    materials = Materials(np.array([3, 7, 9]), ("quartz", "9", "mica"), np.zeros((3, 3)))
    assert [material_number(materials, m) for m in ("quartz", "3", 3, "9", 7)] == [3, 3, 3, 7, 7]
    with pytest.raises(InputError, match=r"gold.*3 \(quartz\), 7 \(9\), 9 \(mica\)"):
        material_number(materials, "gold")


def test_crop_and_drop() -> None:
    image = label_image(np.arange(12).reshape(3, 4))
    assert crop_image(image, (1, 0, 3, 2)).labels.tolist() == [[1, 2], [5, 6]]
    with pytest.raises(InputError, match="4 x 3 pixels"):
        crop_image(image, (0, 0, 5, 1))
    assert drop_materials(image, [1, "m3"]).labels[0].tolist() == [0, VOID, 2, VOID]
    assert drop_materials(image, []) is image


def test_lazy_names_of_the_package() -> None:
    assert imgquad_core.MeshOptions is MeshOptions
    with pytest.raises(AttributeError, match="nothing"):
        _ = imgquad_core.nothing


def test_thin_features_are_told_with_their_count_and_the_remedies() -> None:
    image = label_image(np.random.default_rng(1).random((60, 60)) < 0.08)
    options = MeshOptions(size=6.0, min_pixels=0, min_length=0)
    done = run(image, options)
    told = thin_features(done.labels, done.mesh, options)
    assert told is not None
    assert f"{done.mesh.n_quads} quads" in told
    assert f"{done.mesh.n_quads / (3600 / 36):.1f} times" in told
    assert "min-pixels" in told
    assert "smaller size" in told
    asked = MeshOptions(size=6.0, material_sizes={"m0": 1.0})
    assert thin_features(done.labels, done.mesh, asked) is None, "so many were asked for"
    assert thin_features(done.labels, mesh_image(label_image(np.zeros((60, 60))), options), options) is None
