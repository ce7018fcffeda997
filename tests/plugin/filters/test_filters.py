"""The filters of images and boundaries: one a stage; chained they give the mesh of `mesh`, to the bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from pyvista.core.errors import AmbiguousDataError, MissingDataError

from imgquad_core import MeshOptions, mesh_image
from imgquad_core.errors import InputError
from imgquad_mesh import filters
from support.images import COLS, ROWS, areas, assert_same, labels, photo, point_image


def chain(image: pv.ImageData, size: float = 3.0) -> pv.UnstructuredGrid:
    cleaned = image.imgquad.segment().imgquad.remove_noise()
    return cleaned.imgquad.boundaries().imgquad.smooth(size).imgquad.quads()


@pytest.mark.parametrize("picture", [labels(), photo()], ids=["labels", "photo"])
@pytest.mark.parametrize("as_cells", [False, True])
def test_chain_gives_the_mesh_to_the_bit(picture: np.ndarray, as_cells: bool) -> None:
    image = point_image(picture, origin=(3, -2, 1), spacing=(0.3, 0.3, 1))
    image = image.points_to_cells("label") if as_cells else image
    assert_same(chain(image), image.imgquad.mesh(size=3.0))


def test_chain_with_every_option_gives_the_mesh_to_the_bit() -> None:
    image = point_image(labels(), spacing=(0.5, 0.5, 1))
    whole = image.imgquad.mesh(
        size=2.0, boundary_size=1.5, material_sizes={"material 2": 1}, growth=1.2, min_pixels=9, min_length=4,
        policy="junction", edge_ratio=1.3, max_shift=0.5, drop=[1], effort="fast", unit="world",
    )  # fmt: skip
    labelled = filters.drop_materials(filters.remove_noise(image, min_pixels=9, min_length=4), 1)
    lines = filters.boundaries(labelled, policy="junction")
    sizes = {"boundary_size": 1.5, "material_sizes": {2: 1}, "unit": "world"}
    smoothed = filters.smooth(lines, 2.0, growth=1.2, edge_ratio=1.3, max_shift=0.5, **sizes)
    assert_same(filters.quads(smoothed, effort="fast"), whole)
    assert set(whole["material"]) == {0, 2}


@pytest.mark.parametrize("picture", [labels(), photo()], ids=["labels", "photo"])
def test_mesh_is_that_of_the_pipeline(picture: np.ndarray) -> None:
    made = mesh_image(picture, MeshOptions(size=3, material_sizes={1: 2}, periodic="x", drop=(2,)))
    grid = point_image(picture).imgquad.mesh(size=3, material_sizes={1: 2}, periodic="x", drop=[2])
    assert np.array_equal(grid.cells_dict[pv.CellType.QUAD], made.quads)
    assert np.array_equal(np.asarray(grid.points)[:, :2], made.points - 0.5)
    assert np.array_equal(grid["material"], made.quad_material)


def test_files_between_the_filters_change_nothing(tmp_path: Path) -> None:
    image = point_image(photo())
    whole = image.imgquad.mesh()
    image.imgquad.segment().save(tmp_path / "a.vti")
    pv.read(tmp_path / "a.vti").imgquad.remove_noise().imgquad.boundaries().save(tmp_path / "a.vtp")
    pv.read(tmp_path / "a.vtp").imgquad.smooth().save(tmp_path / "b.vtp")
    assert_same(pv.read(tmp_path / "b.vtp").imgquad.quads(), whole)


def test_segmented_and_cleaned_images_give_the_same_mesh_as_they_are_meshed() -> None:
    image = point_image(photo())
    whole = image.imgquad.mesh()
    assert_same(image.imgquad.segment().imgquad.mesh(), whole)
    assert_same(image.imgquad.segment().imgquad.remove_noise().imgquad.mesh(), whole)
    assert_same(image.imgquad.remove_noise().imgquad.mesh(), whole)


def test_segment_adds_materials_where_the_scalars_are() -> None:
    image = point_image(photo())
    found = image.imgquad.segment(colors=3)
    assert found.active_scalars_name == "material"
    assert found.point_data["material"].dtype == np.int32
    assert found.bounds == image.bounds
    again = found.point_data["material"].reshape(ROWS, COLS)[::-1]
    assert np.mean(again == np.array([0, 2, 1])[labels()]) > 0.99  # from dark to light: the red is darker than the sand
    assert len(found.field_data["material_names"]) == 3
    assert found.field_data["material_colors"].shape == (3, 3)


def test_noise_goes_to_its_neighbour() -> None:
    picture = labels()
    picture[40:42, 5:7] = 2
    image = point_image(picture)
    assert (image.imgquad.remove_noise()["material"] == image["label"]).all()  # labels are taken at their word
    cleaned = image.imgquad.remove_noise(min_pixels=5, min_length=4)
    assert (cleaned["material"].reshape(ROWS, COLS)[::-1] == labels()).all()


def test_boundaries_tell_left_and_right_and_chains() -> None:
    image = point_image(spacing=(2, 2, 1))
    lines = image.imgquad.boundaries()
    assert lines.n_cells == lines.n_lines
    assert lines.active_scalars_name == "boundary_labels"
    assert {tuple(sorted(pair)) for pair in lines["boundary_labels"].tolist()} == {(-1, 0), (0, 1), (0, 2), (1, 2)}
    assert np.array_equal(lines["chain"], np.arange(lines.n_cells))
    assert np.count_nonzero(lines["point_kind"] == 1) == 2  # junctions: where the disk meets the square
    assert lines.bounds == pytest.approx(image.points_to_cells("label").bounds)
    # beside a straight stretch of each chain, the image has what the chain says
    cells = image.points_to_cells("label")
    for k in range(lines.n_cells):
        points = np.asarray(lines.get_cell(k).points)
        along = np.diff(points, axis=0)
        straight = np.flatnonzero((along[:-1] == along[1:]).all(axis=1) & ((along[1:] == 0).sum(axis=1) == 2))
        at, way = points[straight[0] + 1], along[straight[0]] / np.abs(along[straight[0]]).max()
        left = np.array([-way[1], way[0], 0])
        found = [cells.find_containing_cell(at + 1.2 * side + 0.1 * way) for side in (left, -left)]
        values = [cells["label"][c] if c >= 0 else -1 for c in found]
        assert values == lines["boundary_labels"][k].tolist()


def test_smoothed_boundaries_keep_areas_and_have_even_chains() -> None:
    lines = point_image().imgquad.boundaries().imgquad.smooth(4)
    counts = np.diff(pv.convert_array(lines.GetLines().GetOffsetsArray())) - 1
    assert (counts % 2 == 0).all()
    grid = lines.imgquad.quads()
    for material in (0, 1, 2):
        area = areas(grid)[grid["material"] == material].sum()
        assert area == pytest.approx((labels() == material).sum(), rel=0.01)


def test_quads_take_a_size_of_their_own() -> None:
    lines = point_image(np.kron(labels(), np.ones((3, 3), int))).imgquad.boundaries().imgquad.smooth(2)
    assert lines.imgquad.quads(6).n_cells < 0.9 * lines.imgquad.quads().n_cells


def test_dropped_material_leaves_a_hole() -> None:
    grid = point_image().imgquad.drop_materials("material 1").imgquad.mesh()
    assert set(grid["material"]) == {0, 2}
    assert areas(grid).sum() == pytest.approx((labels() != 1).sum(), rel=0.01)


def test_materials_are_merged_renamed_and_recoloured_in_a_chain_as_at_once() -> None:
    chain = (
        point_image()
        .imgquad.merge_materials({("material 0", 2): "rest"})
        .imgquad.rename_materials({1: "disc"})
        .imgquad.recolor_materials({"disc": "orange"})
    )
    assert list(chain.field_data["material_names"]) == ["rest", "disc"]
    assert chain.field_data["material_colors"][1].tolist() == [255, 165, 0]
    whole = point_image().imgquad.mesh(merge={(0, 2): "rest"}, rename={1: "disc"}, recolor={"disc": (255, 165, 0)})
    assert_same(chain.imgquad.mesh(), whole)
    assert set(whole["material"]) == {0, 1}


def test_transparent_pixels_are_left_out_on_demand() -> None:
    rgba = np.dstack([photo(), np.where(labels() == 1, 0, 255).astype(np.uint8)])
    grid = point_image(rgba).imgquad.mesh(colors=3, drop_transparent=True)
    assert areas(grid).sum() == pytest.approx((labels() != 1).sum(), rel=0.02)
    assert areas(point_image(rgba).imgquad.mesh(colors=3)).sum() == pytest.approx(ROWS * COLS)


def test_periodic_sides_match_in_the_chain_too() -> None:
    image = point_image()
    whole = image.imgquad.mesh(periodic="xy")
    assert_same(image.imgquad.boundaries().imgquad.smooth(periodic="xy").imgquad.quads(), whole)
    x, y = np.asarray(whole.points)[:, :2].T
    for axis, along in ((x, y), (y, x)):
        assert np.allclose(np.sort(along[axis == axis.min()]), np.sort(along[axis == axis.max()]), atol=1e-9)


def test_materials_can_be_sampled_by_area() -> None:
    image = point_image(spacing=(2, 1, 1))
    image["x"] = np.asarray(image.points)[:, 0]
    image["rgb"] = photo()[::-1].reshape(-1, 3)
    grid = image.imgquad.mesh("label", sample=["x", "rgb", "label"])
    assert grid.active_scalars_name == "material"
    centre = grid.cell_centers().points
    assert np.abs(grid["x"] - centre[:, 0]).max() < 0.6  # of pixels 2 wide: a slope in steps
    assert grid["rgb"].shape == (grid.n_cells, 3)
    total = (areas(grid)[:, None] * grid["rgb"]).sum(axis=0) / 2  # the integral is that of the picture
    assert total == pytest.approx(photo().reshape(-1, 3).sum(axis=0))
    assert (np.abs(grid["label"] - grid["material"]) < 1e-9).mean() > 0.7  # all but the quads at boundaries


def test_inputs_are_untouched() -> None:
    image = point_image(photo(), "rgb")
    image["other"] = np.arange(image.n_points)
    image.set_active_scalars("rgb")
    for call in (filters.segment, filters.remove_noise, filters.boundaries, filters.mesh):
        before = image.copy()
        call(image)
        assert image == before
        assert image.active_scalars_name == "rgb"
    segmented = image.imgquad.segment(colors=3)
    lines = segmented.imgquad.boundaries()
    smoothed = lines.imgquad.smooth()
    grid = smoothed.imgquad.quads().rotate_vector((1, 2, 3), 40)
    calls = (
        (segmented, lambda d: filters.drop_materials(d, 1)), (lines, filters.smooth), (smoothed, filters.quads),
        (grid, filters.optimize), (grid, filters.quality), (grid, filters.report), (grid, filters.boundaries_of_mesh),
        (grid, filters.quadratic),
    )  # fmt: skip
    for dataset, call in calls:
        before, active = dataset.copy(), dataset.active_scalars_name
        assert call(dataset) is not dataset
        assert dataset == before
        assert dataset.active_scalars_name == active


def test_the_only_array_is_taken_and_none_is_made_active() -> None:
    image = point_image()
    image.point_data.active_scalars_name = None
    assert image.imgquad.mesh().n_cells > 0
    assert image.active_scalars_name is None
    image["second"] = np.zeros(image.n_points)
    image.point_data.active_scalars_name = None
    with pytest.raises(AmbiguousDataError):
        image.imgquad.mesh()


def test_errors_are_pyvistas_and_say_the_way_out() -> None:
    image, lines = point_image(), point_image().imgquad.boundaries()
    with pytest.raises(MissingDataError):
        pv.ImageData(dimensions=(3, 3, 1)).imgquad.segment()
    with pytest.raises(KeyError, match="nope"):
        image.imgquad.mesh("nope")
    with pytest.raises(KeyError, match="nope"):
        image.imgquad.mesh(sample="nope")
    with pytest.raises(MissingDataError, match=r"image\.imgquad\.boundaries"):
        pv.Line().imgquad.smooth()
    with pytest.raises(InputError, match=r"imgquad\.smooth\(size=\.\.\.\)"):
        lines.imgquad.quads()
    with pytest.raises(InputError, match=r"moved, by up to 5: .* move the image before, or the mesh afterwards"):
        lines.translate((5, 0, 0)).imgquad.smooth()
    with pytest.raises(InputError, match="there is no such material; there are 0"):
        image.imgquad.drop_materials("gold")
    with pytest.raises(InputError, match="no pixel is left"):
        image.imgquad.drop_materials([0, 1, 2]).imgquad.boundaries()
    stack = pv.ImageData(dimensions=(4, 4, 4))
    stack["label"] = np.zeros(64, int)
    with pytest.raises(InputError, match="extract_subset"):
        stack.imgquad.mesh()
    changed = image.imgquad.segment()
    changed["material"][0] = 77
    with pytest.raises(InputError, match="holds 77"):
        changed.imgquad.mesh()


def test_progress_bar_changes_nothing() -> None:
    assert_same(point_image().imgquad.mesh(progress_bar=True), point_image().imgquad.mesh())


def test_same_input_same_bits() -> None:
    assert_same(point_image(photo()).imgquad.mesh(), point_image(photo()).imgquad.mesh(threads=2))


@pytest.mark.parametrize("name", ["im2mesh_7phases.png", "composite_weave_labels_z75.png"])
def test_real_pictures_as_pyvista_reads_them(images: Path, name: str) -> None:
    image = pv.read(images / name)
    assert image.active_scalars_name == "PNGImage"
    whole = image.imgquad.mesh(size=4)
    assert_same(chain(image, 4.0), whole)
    assert np.allclose(whole.bounds, image.points_to_cells("PNGImage").bounds)
    assert areas(whole).min() > 0
    assert areas(whole).sum() == pytest.approx(image.n_points)
    ours, theirs = whole.imgquad.quality(), whole.cell_quality(["scaled_jacobian", "min_angle", "max_angle"])
    for measure in ("scaled_jacobian", "min_angle", "max_angle"):
        assert np.abs(ours[measure] - theirs[measure]).max() < 1e-9
    assert whole.validate_mesh().is_valid
