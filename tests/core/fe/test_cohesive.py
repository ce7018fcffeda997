"""Zero-thickness elements: nodes split on the right sides, order and normals as Abaqus wants them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from imgquad_core.errors import InputError
from imgquad_core.fe.cohesive import open_interfaces, split_interfaces
from imgquad_core.fe.femesh import FEMesh
from imgquad_core.fe.second_order import second_order
from imgquad_core.fe.sets import fe_mesh
from imgquad_core.writers import write_mesh
from support.handmade import disk, jiggle, round_inclusion, staircase

NAMES = ("air", "clay", "iron")
THREE = np.array([[0, 0, 1, 1], [0, 0, 1, 1], [2, 2, 2, 2], [2, 2, 2, 2]])


def three(order: int = 1) -> FEMesh:
    mesh = fe_mesh(staircase(THREE, NAMES, jiggle))
    return second_order(mesh) if order == 2 else mesh


@pytest.mark.parametrize("order", [1, 2])
def test_elements_have_no_thickness_and_the_order_of_coh2d4(order: int) -> None:
    mesh = split_interfaces(three(order))
    p = mesh.points[mesh.cohesive]
    assert (p[:, 0] == p[:, 3]).all()
    assert (p[:, 1] == p[:, 2]).all()
    if order == 2:
        assert (p[:, 4] == p[:, 5]).all()
    along = p[:, 1] - p[:, 0]
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1)  # left of 1 -> 2: towards 4-3 if the element had thickness
    middle = p[:, :2].mean(axis=1)
    centre = {m: _elements_with(mesh, mesh.cohesive[:, i], m) for m, i in ((0, 0), (2, 3))}
    between = (mesh.cohesive_pair == [0, 2]).all(axis=1)
    assert between.sum() == 2
    assert (np.einsum("nk,nk->n", normal, middle - centre[0])[between] > 0).all()
    assert (np.einsum("nk,nk->n", normal, middle - centre[2])[between] < 0).all()


def _elements_with(mesh: FEMesh, nodes: np.ndarray, material: int) -> np.ndarray:
    """Mean of the centres of the elements of `material` that have each node."""
    found = []
    for node in nodes:
        cells = mesh.cells[(mesh.cells == node).any(axis=1) & (mesh.cell_material == material)]
        found.append(mesh.points[cells[:, :4]].mean(axis=(0, 1)) if len(cells) else [np.nan, np.nan])
    return np.array(found)


def test_each_side_belongs_to_its_own_material_only() -> None:
    for order in (1, 2):
        mesh = split_interfaces(three(order))
        nodes = {m: set(mesh.cells[mesh.cell_material == m].ravel()) for m in (0, 1, 2)}
        assert not nodes[0] & nodes[1]
        assert not nodes[0] & nodes[2]
        assert not nodes[1] & nodes[2]
        for row, (a, b) in zip(mesh.cohesive, mesh.cohesive_pair, strict=True):
            assert a < b
            assert set(row[[0, 1]]) <= nodes[int(a)]
            assert set(row[[2, 3]]) <= nodes[int(b)]


def test_a_junction_of_three_cuts_has_three_nodes_and_one_of_two_cuts_two() -> None:
    mesh = split_interfaces(three())
    whole = three()
    junction = next(
        n for n in whole.node_sets["junctions"] if 0 < whole.points[n, 0] < 4 and 0 < whole.points[n, 1] < 4
    )
    place = whole.points[junction]
    assert (mesh.points == place).all(axis=1).sum() == 3
    two = split_interfaces(three(), [("air", "clay"), ("iron", "air")])
    assert (two.points == place).all(axis=1).sum() == 2
    one = split_interfaces(three(), [("clay", "air")])
    assert (one.points == place).all(axis=1).sum() == 1  # the cut ends here: nothing comes apart
    assert len(one.cohesive) == 2
    assert any(len(set(row)) == 3 for row in one.cohesive)  # closed at its tip


def test_nothing_but_cut_interfaces_comes_apart() -> None:
    whole = fe_mesh(round_inclusion(4, 10, 40, 3))
    mesh = split_interfaces(whole, [("disk", "matrix")])
    assert mesh.n_points == whole.n_points + 16
    assert len(mesh.cohesive) == 16
    assert (mesh.points[mesh.cells] == whole.points[whole.cells]).all()
    assert set(mesh.node_sets["interface_disk_matrix"]).isdisjoint(mesh.node_sets["interface_matrix_disk"])
    assert len(mesh.node_sets["interface_disk_matrix"]) == 16
    assert {n: len(ids) for n, ids in mesh.node_sets.items() if n in ("left", "top")} == {"left": 5, "top": 5}


def test_a_border_keeps_both_copies_of_a_node_on_it() -> None:
    mesh = split_interfaces(fe_mesh(staircase([[0, 1], [0, 1]], ("a", "b"))))
    assert len(mesh.node_sets["top"]) == 4
    assert len(mesh.node_sets["junctions"]) == 4
    assert len(mesh.node_sets["left"]) == 3


def test_what_cannot_be_split_is_said() -> None:
    apart = fe_mesh(staircase([[0, 1, 2]], NAMES))
    with pytest.raises(InputError, match="no material 'water'; there are: air, clay, iron"):
        split_interfaces(apart, [("air", "water")])
    with pytest.raises(InputError, match="'air' and 'iron' do not touch"):
        split_interfaces(apart, [("iron", "air")])
    with pytest.raises(InputError, match="must be two materials"):
        split_interfaces(apart, [("air", "air")])
    with pytest.raises(InputError, match="once"):
        split_interfaces(split_interfaces(apart))
    with pytest.raises(InputError, match="nothing to split"):
        split_interfaces(fe_mesh(staircase(np.zeros((2, 2), int))))
    with pytest.raises(InputError, match="'some'"):
        split_interfaces(apart, "some")


def test_splitting_is_the_same_each_time() -> None:
    a, b = (split_interfaces(fe_mesh(staircase(disk(12, 4), move=jiggle))) for _ in range(2))
    assert (a.cohesive == b.cohesive).all()
    assert (a.cells == b.cells).all()


def test_abaqus_gets_coh2d4_with_its_section(tmp_path: Path) -> None:
    mesh = split_interfaces(three())
    values = {"air:clay": {"normal_stiffness": 5.0, "shear_stiffness": 2.0}}
    write_mesh(mesh, tmp_path / "a.inp", properties=values)
    text = (tmp_path / "a.inp").read_text()
    block = text.split("*ELEMENT, TYPE=COH2D4, ELSET=COHESIVE_AIR_CLAY\n")[1].split("*COHESIVE SECTION")[0]
    rows = np.array([line.split(", ") for line in block.splitlines()], int)
    of = mesh.cohesive_cells()["cohesive_air_clay"]
    assert (rows == np.column_stack([mesh.n_cells + 1 + of, mesh.cohesive[of] + 1])).all()
    assert "*ELASTIC, TYPE=TRACTION\n5., 2., 2.\n" in text
    assert text.count("put *ELASTIC, TYPE=TRACTION") == 2


def test_springs_of_many_interfaces_have_numbers_of_their_own(tmp_path: Path) -> None:
    image = np.random.default_rng(1).integers(0, 5, (9, 9))
    mesh = split_interfaces(fe_mesh(staircase(image, tuple("abcde"), jiggle)))
    values = {"*:*": {"normal_stiffness": 5.0, "shear_stiffness": 2.0}}
    write_mesh(mesh, tmp_path / "a.inp", properties=values, interfaces="springs")
    lines = (tmp_path / "a.inp").read_text().splitlines()
    at = [i for i, line in enumerate(lines) if line.startswith("*ELEMENT, TYPE=SPRING2")]
    numbers = [int(lines[i + 1].split(",")[0]) for i in at]
    sets = [lines[i].split("ELSET=")[1] for i in at]
    assert min(numbers) > mesh.n_cells
    assert len(set(numbers)) == len(set(sets)) == len(numbers) > 100


def test_other_formats_take_them_as_blocks_or_say_no(tmp_path: Path) -> None:
    mesh = split_interfaces(three())
    pv = pytest.importorskip("pyvista")
    write_mesh(mesh, tmp_path / "a.e")
    blocks = pv.read(tmp_path / "a.e")["Element Blocks"]
    assert list(blocks.keys()) == [*NAMES, "cohesive_air_clay", "cohesive_air_iron", "cohesive_clay_iron"]
    assert (blocks["cohesive_air_clay"].n_cells, blocks["cohesive_air_clay"].area) == (2, 0)
    skfem = pytest.importorskip("skfem")
    write_mesh(mesh, tmp_path / "a.msh")
    assert "interface_iron_air" in skfem.Mesh.load(str(tmp_path / "a.msh")).boundaries  # both sides, now apart
    for extension in (".bdf", ".obj", ".stl", ".ply", ".off"):
        with pytest.raises(InputError, match="no cohesive elements"):
            write_mesh(mesh, tmp_path / f"a{extension}")
    with pytest.raises(InputError, match="were not split"):
        write_mesh(mesh, tmp_path / "a.svg")
    with pytest.raises(InputError, match="springs need normal_stiffness and shear_stiffness"):
        write_mesh(mesh, tmp_path / "b.inp", interfaces="springs")
    with pytest.raises(InputError, match="'springs', but no interface was split"):
        write_mesh(three(), tmp_path / "b.inp", interfaces="springs")
    assert not list(tmp_path.glob("b.*"))


@pytest.mark.parametrize("extension", [".inp", ".msh", ".e"])
def test_six_nodes_are_refused_with_a_remedy_or_left_out(tmp_path: Path, extension: str) -> None:
    six = split_interfaces(three(2))
    with pytest.raises(InputError, match=r"no six-node cohesive elements, as order 2 makes them \(6 here\); .*sides"):
        write_mesh(six, tmp_path / f"six{extension}")
    assert not list(tmp_path.iterdir())
    write_mesh(open_interfaces(six), tmp_path / f"six{extension}")
    assert (tmp_path / f"six{extension}").stat().st_size > 1000


@pytest.mark.parametrize("order", [1, 2])
def test_open_interfaces_have_two_sides_in_any_format(tmp_path: Path, order: int) -> None:
    mesh = open_interfaces(split_interfaces(three(order)))
    for one, other in (("air", "clay"), ("air", "iron"), ("clay", "iron")):
        sides = [mesh.side_nodes(mesh.side_sets[f"interface_{a}_{b}"]) for a, b in ((one, other), (other, one))]
        assert not np.intersect1d(*sides).size
        places = [set(map(tuple, mesh.points[nodes.ravel()])) for nodes in sides]
        assert places[0] == places[1]
    for extension in (".inp", ".msh", ".e", ".bdf", ".npz"):
        write_mesh(mesh, tmp_path / f"a{extension}")
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.logger.start()
        gmsh.open(str(tmp_path / "a.msh"))
        assert not [line for line in gmsh.logger.get() if "Warning" in line or "Error" in line]
        nodes = {}
        gmsh.logger.stop()
        for group in gmsh.model.getPhysicalGroups(1):
            nodes[gmsh.model.getPhysicalName(*group)] = set(gmsh.model.mesh.getNodesForPhysicalGroup(*group)[0])
    finally:
        gmsh.finalize()
    assert len(nodes["interface_air_iron"]) == len(nodes["interface_iron_air"]) == 2 * order + 1
    assert nodes["interface_air_iron"].isdisjoint(nodes["interface_iron_air"])


@pytest.mark.parametrize("order", [1, 2])
def test_a_material_twice_is_cut_between_all_its_elements(order: int) -> None:
    whole = three(order)
    mesh = split_interfaces(whole, [("iron", "iron"), ("air", "iron"), ("clay", "iron")])
    iron = np.flatnonzero(mesh.cell_material == 2)
    assert len(np.unique(mesh.cells[iron][:, :4])) == 4 * len(iron)  # no two share a node
    inside = (mesh.cohesive_pair == 2).all(axis=1)
    assert inside.sum() == 10  # of 4 x 2 quads: 4 + 6 inner sides
    assert set(mesh.cohesive_cells()) == {"cohesive_air_iron", "cohesive_clay_iron", "cohesive_iron_iron"}
    p = mesh.points[mesh.cohesive]
    assert (p[:, 0] == p[:, 3]).all()
    assert (p[:, 1] == p[:, 2]).all()
    others = np.isin(mesh.cell_material, (0, 1))
    assert (mesh.points[mesh.cells[others]] == whole.points[whole.cells[others]]).all()
