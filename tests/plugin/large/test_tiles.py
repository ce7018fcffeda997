"""Tiles: one conforming mesh, whoever does the work and however often it is stopped."""

from __future__ import annotations

import hashlib
import json
import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista as pv
import tifffile

import imgquad_core as core
from imgquad_core import MeshOptions
from imgquad_core.errors import InputError
from imgquad_core.fe import FEMesh, fe_mesh
from imgquad_core.fe.sets import BORDERS
from imgquad_core.measures.quality import scaled_jacobian
from imgquad_core.model import PointKind
from imgquad_core.tiles import attempts, tasks
from imgquad_core.tiles.files import load_arrays
from imgquad_core.writers import safe_names, write_mesh
from imgquad_mesh.__main__ import main
from imgquad_mesh.datasets.field_texts import texts_of
from imgquad_mesh.large import TiledMesh, mesh_tiles
from support.ccx import needs_ccx, solve
from support.invariants import assert_valid_mesh
from support.labels import label_image

OPTIONS = MeshOptions(size=4.0)
TILE, KEEP = 448, 100
SHAPE = (500, 910)  # 2 x 3 tiles, the last ones of 52 rows and 14 columns


def drawn_labels() -> np.ndarray:
    """A matrix with discs that stay whole, some across tile lines, a vein that is cut, and one pixel at a corner."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]] + 0.5
    labels = np.zeros(SHAPE, np.uint8)
    rng = np.random.default_rng(3)
    for _ in range(30):
        cx, cy, radius = rng.uniform(0, SHAPE[1]), rng.uniform(0, SHAPE[0]), rng.uniform(8, 40)
        labels[np.hypot(x - cx, y - cy) < radius] = 1
    labels[np.abs(y - 300 - 60 * np.sin(x / 90)) < 7] = 2
    labels[np.hypot(x - 448, y - 448) < 20] = 3
    labels[0, 0] = 4
    return labels


@pytest.fixture(scope="module")
def picture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("tiles") / "big.npy"
    np.save(path, drawn_labels())
    return path


@pytest.fixture(scope="module")
def made(picture: Path) -> TiledMesh:
    return meshed(picture, picture.parent / "out")


def meshed(source: Any, folder: Path, **options: Any) -> Any:
    return mesh_tiles(source, folder, options.pop("how", OPTIONS), tile=TILE, keep_whole=KEEP, **options)


def other_way_round(name: str) -> str:
    """interface_B_A of interface_A_B, for names of materials with a blank."""
    _, first, second = name.split("_")
    return f"interface_{second}_{first}"


def length(mesh: FEMesh, name: str) -> float:
    ends = mesh.points[mesh.side_nodes(mesh.side_sets[name])]
    return float(np.hypot(*(ends[:, 1] - ends[:, 0]).T).sum())


def digests(folder: Path) -> dict[str, str]:
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.glob("mesh/*.vtu"))}


def test_the_whole_is_one_conforming_mesh_of_all_materials(made: TiledMesh) -> None:
    grid = pv.read(made.path)
    whole = grid.clean(tolerance=0)
    nodes = np.unique(grid.point_data["node"])
    assert np.array_equal(nodes, np.arange(whole.n_points))  # numbers and places tell the same nodes
    quads = whole.cells.reshape(-1, 5)[:, 1:]
    points = np.asarray(whole.points)[:, :2]
    assert len(quads) == made.report["quality"]["n_quads"]
    assert scaled_jacobian(points, quads).min() == pytest.approx(made.report["quality"]["min_sj"])
    assert made.report["quality"]["min_sj"] > 0.3
    edges = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    assert count.max() == 2
    assert len(points) - len(edges) + len(quads) == 1  # Euler: no hole, no crack
    x, y = points[edges[count == 1]].mean(axis=1).T
    assert (((x == 0) | (x == SHAPE[1])) | ((y == 0) | (y == SHAPE[0]))).all()
    labels = drawn_labels()
    assert np.array_equal(np.unique(whole.cell_data["material"]), np.unique(labels))
    assert whole.area == pytest.approx(labels.size, rel=1e-12)
    for row in made.report["materials"]:
        pixels = np.count_nonzero(labels == row["material"])
        assert row["pixels"] == row["clean_pixels"] == pixels
        assert row["mesh_area"] == pytest.approx(pixels, abs=max(1.0, 1e-4 * pixels))


def test_the_whole_passes_as_a_mesh_of_the_picture(made: TiledMesh) -> None:
    assert_valid_mesh(made.mesh(), label_image(drawn_labels().astype(np.int32)))


def test_seams_are_cleaned_up(made: TiledMesh) -> None:
    """Near former seams there are hardly more irregular nodes than elsewhere, and no straight row of nodes is left."""
    mesh = made.mesh()
    inner = (mesh.point_kind == 4) & (mesh.quad_material[0] >= 0)
    x, y = mesh.points.T
    near = (np.abs(x - TILE) < 40) | (np.abs(y - (SHAPE[0] - TILE)) < 40)
    irregular = mesh.valence != 4
    assert irregular[inner & near].mean() <= 1.6 * irregular[inner & ~near].mean()
    on_line = inner & (np.abs(x - TILE) < 1e-6)
    assert on_line.sum() < 0.2 * SHAPE[0] / 4


def test_layers_that_run_along_seams_are_as_good_as_without(tmp_path: Path) -> None:
    """No more quads than the picture as a whole has, and near seams little worse ones."""
    y, x = np.indices(SHAPE)
    labels = (np.searchsorted([90, 180, 260, 330, 410], y + 25 * np.sin(x / 60)) % 4).astype(np.uint8)
    mesh, whole = meshed(labels, tmp_path / "out").mesh(), core.mesh_image(labels, OPTIONS)
    assert mesh.n_quads < 1.01 * whole.n_quads
    shares, means, worst = zip(*(band_figures(each) for each in (mesh, whole)), strict=True)
    assert shares[0] < shares[1] + 0.008
    assert means[0] > means[1] - 0.004
    assert worst[0] > 0.6


def test_all_pieces_of_a_region_have_the_stride_of_the_worst(tmp_path: Path) -> None:
    """A matrix with discs in one tile only: its piece in the other one is good enough on a wider stride."""
    rng, (y, x) = np.random.default_rng(6), np.mgrid[:TILE, : 2 * TILE] + 0.5
    labels = np.zeros(x.shape, np.uint8)
    for row, column in np.ndindex(7, 7):
        cx, cy = 62 * column + rng.uniform(22, 40), 62 * row + rng.uniform(22, 40)
        labels[np.hypot(x - cx, y - cy) < rng.uniform(6, 22)] = 1
    job = meshed(labels, tmp_path / "out").job
    first = [load_arrays(job.path("wish", t, 0)) for t in (0, 1)]
    last = [load_arrays(job.path("wish", t, attempts.ATTEMPTS - 1)) for t in (0, 1)]
    assert [int(row["stride"][row["region"] == 0].item()) for row in first] == [2, 4]
    assert [int(row["stride"][row["region"] == 0].item()) for row in last] == [2, 2]
    assert [int(row["made"]) for row in last] == [0, 1]  # one is as it was


def band_figures(mesh: core.QuadMesh) -> tuple[float, float, float]:
    """Share of irregular nodes, mean and least scaled Jacobian within 40 px of a seam."""

    def is_near(points: np.ndarray) -> np.ndarray:
        return (np.abs(points - [TILE, SHAPE[0] - TILE]) < 40).any(axis=1) | (np.abs(points[:, 0] - 2 * TILE) < 40)

    points = np.asarray(mesh.points)
    inner = (mesh.point_kind == PointKind.INTERIOR) & is_near(points)
    sj = scaled_jacobian(points, mesh.quads)[is_near(points[mesh.quads].mean(axis=1))]
    return float((mesh.valence != 4)[inner].mean()), float(sj.mean()), float(sj.min())


def test_regions_keep_their_areas_and_small_ones_stay_whole(made: TiledMesh) -> None:
    regions = made.report["regions"]
    assert regions["worst_error"] < 5e-4
    assert regions["worst_error_of_very_large"] < 1e-4
    grid = pv.read(made.path)
    tile, region = grid.cell_data["tile"], grid.cell_data["region"]
    of = np.unique(np.stack([region, tile]), axis=1)[0]
    assert 0 < regions["cut"] < 8
    assert np.count_nonzero(np.bincount(of) > 1) <= regions["cut"]  # only these are in several tiles


def test_same_bytes_on_two_workers_from_zarr_and_from_dask(
    client: Any, picture: Path, made: TiledMesh, tmp_path: Path
) -> None:
    da = pytest.importorskip("dask.array")
    array = da.from_array(np.load(picture), chunks=(300, 300))
    tasks_of = meshed(array, tmp_path / "dask", compute=False)
    assert not (tmp_path / "dask" / "mesh.pvtu").exists()
    lazy = tasks_of.compute(scheduler=client)
    assert digests(tmp_path / "dask") == digests(made.path.parent)
    assert lazy.report["quality"] == made.report["quality"]


def _kill_once(flag: str) -> None:
    if not Path(flag).exists():
        Path(flag).touch()
        os.kill(os.getpid(), signal.SIGKILL)


def test_same_bytes_after_a_kill_a_full_disk_and_lost_files(
    cluster: Any, picture: Path, made: TiledMesh, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed")
    save = attempts.save_arrays

    def full(path: Path, **arrays: Any) -> None:
        if path.name == "mesh-1-0.npz":
            raise InputError("cannot write mesh-1-0.npz: No space left on device")
        save(path, **arrays)

    monkeypatch.setattr(attempts, "save_arrays", full)
    with pytest.raises(InputError, match="No space left on device"):
        meshed(picture, tmp_path / "out")
    monkeypatch.undo()
    work = tmp_path / "out" / "work"
    kept = {path.name: path.stat().st_mtime_ns for path in work.glob("outlines-*.npz")}
    assert len(kept) == 6
    assert not (work / "mesh-1-0.npz").exists()
    for path in (work / "outlines-3.npz", work / "ids-0.npy"):
        path.unlink()
    with distributed.Client(cluster, set_as_default=False) as client:  # a worker dies in the middle of the second run
        client.submit(_kill_once, str(tmp_path / "flag"), key=f"kill-{tmp_path}")
        meshed(picture, tmp_path / "out", client=client)
    assert digests(tmp_path / "out") == digests(made.path.parent)
    later = {path.name: path.stat().st_mtime_ns for path in work.glob("outlines-*.npz")}
    assert {name for name in kept if later[name] != kept[name]} == {"outlines-3.npz"}


def test_another_plan_and_a_changed_picture_are_refused(picture: Path, made: TiledMesh, tmp_path: Path) -> None:
    folder = made.path.parent
    before = digests(folder)
    with pytest.raises(InputError, match=r"size.*--restart"):
        meshed(picture, folder, how=MeshOptions(size=3.0))
    with pytest.raises(InputError, match="tile = 448, not 500"):
        mesh_tiles(picture, folder, OPTIONS, tile=500, keep_whole=KEEP)
    copy = tmp_path / "copy.npy"
    copy.write_bytes(picture.read_bytes())
    with pytest.raises(InputError, match="begun with source"):
        meshed(copy, folder)
    assert digests(folder) == before


def test_tiles_and_boxes_are_read_when_they_are_asked_for(made: TiledMesh) -> None:
    tile = made[0, 1]
    assert tile.n_quads == made.report["tiles"][1]["quads"]
    part = made.box(400, 200, 700, 480)
    centre = part.points[part.quads].mean(axis=1)
    assert centre[:, 0].min() >= 400
    assert centre[:, 0].max() < 700
    assert centre[:, 1].min() > SHAPE[0] - 480
    assert set(part.materials.names) == {f"material {k}" for k in range(5)}
    with pytest.raises(InputError, match="there is no tile 2, 0: rows are 0 to 1, columns 0 to 2"):
        made[2, 0]


def test_command_writes_partitions_and_a_deck(
    picture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    meshio = pytest.importorskip("meshio")
    pytest.importorskip("h5py")
    folder, deck = tmp_path / "out", tmp_path / "deck.inp"
    flags = ["--tile", "448", "--keep-whole", "100", "--size", "6", "--tile", "700", "--format", "vtkhdf"]
    assert main(["tiles", str(picture), str(folder), *flags, "--deck", str(deck), "--pixel-size", "0.5"]) == 0
    assert "1 x 2 tiles of 700 px" in capsys.readouterr().out
    whole = pv.read(folder / "mesh.vtkhdf")
    assert isinstance(whole, pv.PartitionedDataSet)
    assert whole.n_partitions == 2
    report = json.loads((folder / "report.json").read_text())
    names = pv.convert_array(whole.GetFieldData().GetArray("material_names"))
    assert texts_of(names)[2] == "material 2"
    assert sum(part.n_cells for part in whole) == report["quality"]["n_quads"]
    assert sum(part.area for part in whole) == pytest.approx(SHAPE[0] * SHAPE[1] / 4)
    read = meshio.read(deck)
    assert len(read.cells_dict["quad"]) == report["quality"]["n_quads"]
    assert {"left", "right", "top", "bottom"} <= {name.lower() for name in read.point_sets}


@pytest.mark.parametrize("name", ["whole.inp", "whole.msh", "whole.e"])
def test_a_deck_from_the_tiles_is_that_of_the_whole(name: str, picture: Path, made: TiledMesh, tmp_path: Path) -> None:
    """With all sets, to the byte, though no process had more than one tile and its rim; nothing is meshed anew."""
    work = made.path.parent / "work"
    before = {path.name: path.stat().st_mtime_ns for path in work.glob("final-*.npz")}
    meshed(picture, made.path.parent, deck=tmp_path / name)
    assert {path.name: path.stat().st_mtime_ns for path in work.glob("final-*.npz")} == before
    write_mesh(made.mesh(), tmp_path / f"memory-{name}")
    assert (tmp_path / name).read_bytes() == (tmp_path / f"memory-{name}").read_bytes()
    assert not list(work.glob(".imgquad-*"))  # what was mapped is gone


def test_sets_of_parts_that_were_dropped(tmp_path: Path) -> None:
    """Tiles without quads, and a side of the mesh that is on no border of the picture."""
    labels = drawn_labels()
    labels[:, 400:] = 9
    how = MeshOptions(size=4.0, drop=(9,), pixel_size=0.25, origin=(3.0, -2.0))
    made = meshed(labels, tmp_path / "out", how=how, deck=tmp_path / "whole.inp")
    counts = [tasks.number(made.job, t) for t in range(made.job.grid.n_tiles)]
    assert counts[2] == (0, 0)
    found, alone = tasks.elements(made.job, counts, tmp_path), fe_mesh(core.run(labels, how).mesh)
    assert set(found.side_sets) == set(alone.side_sets)
    assert set(found.node_sets) == set(alone.node_sets)
    assert set(found.element_sets) == set(alone.element_sets)
    assert "right" not in found.side_sets
    for name in ("left", "top", "bottom"):
        assert length(found, name) == pytest.approx(length(alone, name))
    assert length(found, "free_material 0") == pytest.approx(length(alone, "free_material 0"), rel=0.01)


@needs_ccx
def test_calculix_solves_the_deck_of_a_picture_in_tiles(picture: Path, made: TiledMesh, tmp_path: Path) -> None:
    """One stiffness everywhere: the pull on the right side is that of a plate."""
    values = {"*": {"young": 1000.0, "poisson": 0.0}}
    deck = tmp_path / "pull.inp"
    meshed(picture, made.path.parent, deck=deck, deck_options={"properties": values, "deck": "tension"})
    force = solve(deck)["total force"][0, 0]
    assert force == pytest.approx(1000.0 * 1e-3 * SHAPE[0], rel=1e-6)


def test_gmsh_reads_all_names_of_a_picture_in_tiles(picture: Path, made: TiledMesh, tmp_path: Path) -> None:
    gmsh = pytest.importorskip("gmsh")
    meshed(picture, made.path.parent, deck=tmp_path / "whole.msh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "whole.msh"))
        names = {gmsh.model.getPhysicalName(*group) for group in gmsh.model.getPhysicalGroups()}
        n_quads = sum(len(gmsh.model.mesh.getElementsByType(3, tag)[0]) for _, tag in gmsh.model.getEntities(2))
    finally:
        gmsh.finalize()
    whole = fe_mesh(made.mesh())
    corners = {name for name in whole.node_sets if name.startswith("corner_")}
    sides = {name for name in whole.side_sets if name in BORDERS or name <= other_way_round(name)}
    assert names == set(safe_names({*whole.material_cells(), *sides, *corners}, 127).values())
    assert n_quads == made.report["quality"]["n_quads"]


def test_a_crop_of_a_map_lies_where_it_does_on_the_map(tmp_path: Path) -> None:
    """To the bit the mesh of the part, read from a file that is never read as a whole."""
    part, corner = (60, 20, 700, 480), (500_000.0, 4_000_000.0)
    tags = [
        (33550, "d", 3, (2.5, 2.5, 0.0), False),
        (33922, "d", 6, (0.0, 0.0, 0.0, corner[0], corner[1] + 2.5 * SHAPE[0], 0.0), False),
        (34735, "H", 12, (1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 32633), False),
    ]
    tifffile.imwrite(tmp_path / "map.tif", drawn_labels(), tile=(64, 64), extratags=tags)
    made = meshed(tmp_path / "map.tif", tmp_path / "out", how=MeshOptions(size=4.0, crop=part))
    left, upper, right, lower = part
    alone = meshed(drawn_labels()[upper:lower, left:right], tmp_path / "alone").mesh()
    place = np.array(corner) + 2.5 * np.array([left, SHAPE[0] - lower])
    assert np.array_equal(made.mesh().points, alone.points * 2.5 + place)
    run = core.run(tmp_path / "map.tif", MeshOptions(size=4.0, crop=part))
    assert np.array_equal(run.mesh.points.min(axis=0), made.mesh().points.min(axis=0))


def test_options_of_decks_are_checked_before_any_work(picture: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.msh has no option 'thickness'"):
        meshed(picture, tmp_path / "out", deck=tmp_path / "a.msh", deck_options={"thickness": 2.0})
    for name, value in (("thickness", -2.0), ("analysis", "plain stress"), ("deck", "torsion"), ("deck", "tension")):
        with pytest.raises(InputError, match=name):
            meshed(picture, tmp_path / "out", deck=tmp_path / "a.inp", deck_options={name: value})
    with pytest.raises(InputError, match="none is asked for"):
        meshed(picture, tmp_path / "out", deck_options={"thickness": 2.0})
    assert not (tmp_path / "out").exists()


def test_memory_that_does_not_do_is_told_with_the_tile_and_what_fits(
    picture: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def hungry(job: Any, t: int, *_: Any) -> None:
        if t == 1:
            raise MemoryError

    monkeypatch.setattr(tasks, "outlines", hungry)
    with pytest.raises(InputError, match=r"tile 0, 1 of 600 px: give --tile 441 \(about 54% of it\), or fewer workers"):
        mesh_tiles(picture, tmp_path / "out", OPTIONS, tile=600, keep_whole=KEEP)


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"crop": (0, 0, 911, 500)}, "crop 0,0,911,500 is not a box in a picture of 910 x 500 pixels"),
        ({"tolerance": 2.0}, "tolerance is 2.0"),
        ({"periodic": "x"}, "periodic is x"),
        ({"pixel_size": (1.0, 2.0)}, "need square pixels"),
        ({"colors": "regions"}, "colors = regions is for one picture"),
    ],
)
def test_what_tiles_do_not_have_is_refused(how: dict[str, Any], message: str, picture: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        meshed(picture, tmp_path / "out", how=MeshOptions(**how))
