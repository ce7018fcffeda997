"""Nastran, Exodus, mesh apps, drawings, archives: each read by a library that others wrote."""

from __future__ import annotations

import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from imgquad_core.errors import InputError
from imgquad_core.fe.sets import fe_mesh
from imgquad_core.writers import WRITERS, write_mesh, writer_for
from support.handmade import disk, jiggle, staircase

PICTURE = disk(10, 3.5)
PICTURE[0, :] = 2
MESH = staircase(PICTURE, ("matrix", "disk", "coating"), jiggle)
FE = fe_mesh(MESH)
AREA = {"matrix": 56.0, "disk": 32.0, "coating": 10.0}  # about: nodes are jiggled


@pytest.mark.parametrize(("analysis", "element"), [("plane stress", "CQUAD4"), ("plane strain", "CPLSTN4")])
def test_pynastran_reads_the_bulk_data(tmp_path: Path, analysis: str, element: str) -> None:
    read_bdf = pytest.importorskip("pyNastran.bdf.bdf").read_bdf
    values = {"*": {"young": 70e9, "poisson": 0.3, "density": 2.7e3, "expansion": 23e-6, "conductivity": 200.0}}
    write_mesh(MESH.scaled(1e-6), tmp_path / "a.bdf", analysis=analysis, properties=values)
    model = read_bdf(str(tmp_path / "a.bdf"), debug=False)
    assert {e.type for e in model.elements.values()} == {element}
    pids = np.array([model.elements[i + 1].pid for i in range(FE.n_cells)])
    assert (pids - 1 == FE.cell_material).all()
    nodes = np.array([model.elements[i + 1].node_ids for i in range(FE.n_cells)])
    assert (nodes - 1 == FE.cells).all()
    points = np.array([model.nodes[i + 1].xyz for i in range(FE.n_points)])
    assert np.abs(points[:, :2] - FE.points * 1e-6).max() < 1e-15
    material = model.materials[1]
    assert (material.e, material.nu, material.rho, material.a) == (70e9, 0.3, 2.7e3, 23e-6)
    for number, (name, ids) in enumerate(FE.node_sets.items(), 1):
        values_read = model.case_control_deck.subcases[0].params[f"SET {number}"][0]
        assert sorted(_expanded(values_read)) == list(ids + 1), name


def _expanded(items: list[int | str]) -> list[int]:
    ids: list[int] = []
    for item in items:
        low, *high = map(int, str(item).split(" THRU "))
        ids += range(low, (high or [low])[0] + 1)
    return ids


def test_pyvista_reads_exodus_blocks_and_sets_with_their_names(tmp_path: Path) -> None:
    pv = pytest.importorskip("pyvista")
    write_mesh(MESH, tmp_path / "a.e")
    read = pv.read(tmp_path / "a.e")
    blocks, sides = read["Element Blocks"], read["Side Sets"]
    assert {
        name: blocks[name].n_cells
        for name in blocks.keys()  # noqa: SIM118 - a MultiBlock iterates over blocks
    } == {"matrix": 52 + 6, "disk": 32, "coating": 10}
    assert sum(block.area for block in blocks) == pytest.approx(100)
    for name in FE.side_sets:
        mine = np.unique(FE.points[FE.side_nodes(FE.side_sets[name])].reshape(-1, 2).round(9), axis=0)
        theirs = np.unique(sides[name].points[:, :2].astype(float).round(9), axis=0)
        assert np.abs(mine - theirs).max() < 1e-6, name
    assert read["Node Sets"].keys() == list(FE.node_sets)


def test_mesh_apps_read_all_quads(tmp_path: Path) -> None:
    pv = pytest.importorskip("pyvista")
    for extension, cells in ((".obj", 100), (".ply", 100), (".stl", 200)):
        write_mesh(MESH, tmp_path / f"a{extension}")
        read = pv.read(tmp_path / f"a{extension}")
        assert (read.n_cells, read.n_points) == (cells, FE.n_points)
        assert read.area == pytest.approx(100)
        assert (read.compute_normals()["Normals"][:, 2] > 0.99).all()


def test_meshlab_reads_off_and_obj_quads(tmp_path: Path) -> None:
    pymeshlab = pytest.importorskip("pymeshlab")
    for extension in (".off", ".obj"):
        write_mesh(MESH, tmp_path / f"a{extension}")
        meshes = pymeshlab.MeshSet()
        meshes.load_new_mesh(str(tmp_path / f"a{extension}"))
        assert [len(f) for f in meshes.current_mesh().polygonal_face_list()] == [4] * FE.n_cells


def test_meshio_reads_xdmf_and_med_with_materials(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    pytest.importorskip("h5py")
    pytest.importorskip("gmsh")
    write_mesh(MESH, tmp_path / "a.xdmf")
    read = meshio.read(tmp_path / "a.xdmf")
    assert (read.cells_dict["quad"] == FE.cells).all()
    assert (read.cell_data["material"][0] == FE.cell_material).all()
    sides = meshio.read(tmp_path / "a_sides.xdmf")
    assert (sides.cell_data["side_set"][0] == 1).sum() == len(FE.side_sets["left"])
    write_mesh(MESH, tmp_path / "a.med")
    read = meshio.read(tmp_path / "a.med")
    tags = read.cell_tags
    quads = read.cell_data["cell_tags"][[block.type for block in read.cells].index("quad")]
    counts = {tags[t][0].strip(): int((quads == t).sum()) for t in np.unique(quads)}
    assert counts == {"matrix": 58, "disk": 32, "coating": 10}


def test_drawings_have_each_boundary_once_in_its_layer(tmp_path: Path) -> None:
    write_mesh(MESH, tmp_path / "a.svg")
    root = ElementTree.parse(tmp_path / "a.svg").getroot()
    space = "{http://www.w3.org/2000/svg}"
    segments = {}
    for group in root.iter(f"{space}g"):
        paths = [path.get("d", "") for path in group.iter(f"{space}path")]
        segments[group.get("id")] = sum(d.count("L") + d.count("Z") for d in paths)
    expected = {name: len(s) for name, s in FE.side_sets.items()}
    assert segments == {n: expected[n] for n in segments}
    assert sum(segments.values()) == len(MESH.constraints)
    ezdxf = pytest.importorskip("ezdxf")
    write_mesh(MESH, tmp_path / "a.dxf")
    drawing = ezdxf.readfile(tmp_path / "a.dxf")
    lines: dict[str, int] = {}
    for line in drawing.modelspace().query("POLYLINE"):
        lines[line.dxf.layer] = lines.get(line.dxf.layer, 0) + len(line.vertices) - (0 if line.is_closed else 1)
    assert lines == segments
    assert not drawing.audit().errors


def test_the_archive_holds_everything(tmp_path: Path) -> None:
    write_mesh(MESH, tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as read:
        assert (read["points"] == FE.points).all()
        assert (read["cells"] == FE.cells).all()
        assert (read["side_sets/interface_matrix_disk"] == FE.side_sets["interface_matrix_disk"]).all()
        assert (read["element_sets/disk"] == FE.material_cells()["disk"]).all()
    write_mesh(MESH, tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


@pytest.mark.parametrize("extension", sorted(WRITERS))
def test_a_disk_that_fills_up_leaves_the_old_file_and_no_half_one(tmp_path: Path, extension: str) -> None:
    for package in {".med": ["gmsh"], ".unv": ["gmsh"], ".xdmf": ["meshio", "h5py"]}.get(extension, []):
        pytest.importorskip(package)
    target = tmp_path / "full" / f"a{extension}"
    target.parent.mkdir()
    target.write_text("old")
    program = (
        "import resource, signal, sys\n"
        "from support.handmade import disk, staircase\n"
        "from imgquad_core.errors import InputError\n"
        "from imgquad_core.writers import write_mesh\n"
        "mesh = staircase(disk(30, 9))\n"
        "write_mesh(mesh, sys.argv[2])\n"  # kernels that are compiled now find room
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        "try:\n    write_mesh(mesh, sys.argv[1])\n"
        "except InputError as error:\n    print(error)\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", program, str(target), str(tmp_path / f"whole{extension}")],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": ":".join(sys.path), "PYTHONDONTWRITEBYTECODE": "1"},  # no truncated .pyc
    )
    assert f"cannot write {target}: " in run.stdout, run.stderr
    assert (run.returncode, run.stderr) == (0, "")
    assert "nothing was changed" in run.stdout
    assert [p.name for p in target.parent.iterdir()] == [target.name]
    assert target.read_text() == "old"


@pytest.mark.parametrize(
    ("extension", "limit"), [(".inp", 80), (".bdf", 60), (".msh", 127), (".med", 80), (".e", 255), (".obj", 255)]
)
def test_names_as_long_as_the_format_takes_are_whole_and_longer_ones_are_refused(
    tmp_path: Path, extension: str, limit: int
) -> None:
    if extension == ".med":
        pytest.importorskip("gmsh")
    longest_name = {".inp": "S_INTERFACE_{}_B", ".obj": "{}"}.get(extension, "interface_{}_b")
    longest = limit - len(longest_name.format(""))
    for letters in (longest, longest + 1):
        mesh = staircase([[0, 1], [0, 1]], ("a" * letters, "b"))
        path = tmp_path / f"{letters}{extension}"
        if letters == longest:
            write_mesh(mesh, path)
            assert longest_name.format("a" * letters).lower().encode() in path.read_bytes().lower()
        else:
            with pytest.raises(InputError, match=f"has {limit + 1} signs, this format takes {limit}"):
                write_mesh(mesh, path)
            assert not path.exists()


def test_unknown_formats_and_places_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no writer for '.foo'.*\.inp"):
        writer_for("a.foo")
    with pytest.raises(InputError, match=r"cannot write .*No such file or directory"):
        write_mesh(MESH, tmp_path / "nowhere" / "a.inp")


def test_universal_files_have_nodes_elements_and_groups(tmp_path: Path) -> None:
    pytest.importorskip("gmsh")
    write_mesh(MESH, tmp_path / "a.unv")
    parts = (tmp_path / "a.unv").read_text().split("    -1\n")
    data = {part.split("\n", 1)[0].strip(): part.split("\n")[1:-1] for part in parts if part.strip()}
    points = np.array([line.replace("D", "E").split() for line in data["2411"][1::2]], float)
    numbers = np.array([line.split()[0] for line in data["2411"][::2]], int)
    assert np.abs(points[:, :2] - FE.points[numbers - 1]).max() < 1e-12
    groups = {}
    lines = iter(data["2477"])
    for head in lines:
        count, name = int(head.split()[7]), next(lines).strip()
        entries = [int(v) for _ in range((count + 1) // 2) for v in next(lines).split()]
        groups[name] = entries[1::4]
    counts = {name: len(ids) for name, ids in groups.items()}
    assert counts.items() >= {name: len(ids) for name, ids in FE.material_cells().items()}.items()
    assert counts["left"] == len(FE.side_sets["left"])
    assert counts["interface_matrix_disk"] == len(FE.side_sets["interface_matrix_disk"])
