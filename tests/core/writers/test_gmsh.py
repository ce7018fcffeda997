"""Gmsh files, read by Gmsh itself, by scikit-fem and by getdp."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from imgquad_core.errors import InputError
from imgquad_core.fe.cohesive import split_interfaces
from imgquad_core.fe.extrusion import extrude
from imgquad_core.fe.second_order import second_order
from imgquad_core.fe.sets import fe_mesh
from imgquad_core.writers import write_mesh
from support.handmade import disk, jiggle_beside, staircase

LAYERS = staircase(np.repeat([0, 1], 4)[None, :].repeat(6, axis=0), ("quartz", "feldspar"), jiggle_beside(0, 4))
SETS = {"left", "right", "bottom", "top", "interface_quartz_feldspar"}


@pytest.fixture
def gmsh() -> Iterator[Any]:
    module = pytest.importorskip("gmsh")
    module.initialize(interruptible=False)
    module.option.setNumber("General.Terminal", 0)
    module.logger.start()
    yield module
    module.logger.stop()
    module.finalize()


@pytest.mark.parametrize("version", ["4.1", "2.2"])
def test_gmsh_reads_all_groups_with_names_and_without_a_warning(tmp_path: Path, gmsh: Any, version: str) -> None:
    write_mesh(LAYERS, tmp_path / "a.msh", version=version)
    gmsh.open(str(tmp_path / "a.msh"))
    groups = {gmsh.model.getPhysicalName(*g): g for g in gmsh.model.getPhysicalGroups()}
    assert {n for n, g in groups.items() if g[0] == 2} == {"quartz", "feldspar"}
    assert {n for n, g in groups.items() if g[0] == 1} == SETS
    assert {n for n, g in groups.items() if g[0] == 0} == {
        f"corner_{v}_{h}" for v in ("bottom", "top") for h in ("left", "right")
    }
    for dimension, tag in groups.values():  # GetFEM and getdp need this
        assert list(gmsh.model.getEntitiesForPhysicalGroup(dimension, tag)) == [tag]
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    assert np.abs(coordinates.reshape(-1, 3)[np.argsort(tags), :2] - LAYERS.points).max() < 1e-14
    _, _, nodes = gmsh.model.mesh.getElements(2, groups["feldspar"][1])
    assert (nodes[0].reshape(-1, 4) - 1 == LAYERS.quads[LAYERS.quad_material == 1]).all()
    assert not [line for line in gmsh.logger.get() if line.startswith(("Warning", "Error"))]


def test_scikit_fem_finds_names_and_solves_heat_to_rounding(tmp_path: Path) -> None:
    skfem = pytest.importorskip("skfem")
    from skfem.models.poisson import laplace

    write_mesh(LAYERS.scaled(0.25), tmp_path / "a.msh")
    mesh = skfem.Mesh.load(str(tmp_path / "a.msh"))
    assert set(mesh.boundaries) == SETS
    assert set(mesh.subdomains) == {"quartz", "feldspar"}
    stiffness = sum(
        k * laplace.assemble(skfem.Basis(mesh, skfem.ElementQuad1(), elements=mesh.subdomains[name]))
        for name, k in (("quartz", 1.0), ("feldspar", 3.0))
    )
    basis = skfem.Basis(mesh, skfem.ElementQuad1())
    x = basis.doflocs[0]
    exact = np.where(x < 1, 0.75 * x, 0.75 + 0.25 * (x - 1))
    ends = basis.get_dofs({"left", "right"}).all()
    assert np.abs(skfem.solve(*skfem.condense(stiffness, x=exact, D=ends)) - exact).max() < 1e-10


HEAT = """\
Group {{ Quartz = Region[{{{quartz}}}]; Feldspar = Region[{{{feldspar}}}];
  Left = Region[{{{left}}}]; Right = Region[{{{right}}}];
  Body = Region[{{Quartz, Feldspar}}]; }}
Function {{ k[Quartz] = 1; k[Feldspar] = 3; }}
Constraint {{ {{ Name T; Case {{ {{ Region Left; Value 0; }} {{ Region Right; Value 1; }} }} }} }}
FunctionSpace {{ {{ Name H; Type Form0; BasisFunction {{ {{ Name n; NameOfCoef t; Function BF_Node;
  Support Region[{{Body, Left, Right}}];
  Entity NodesOf[Body]; }} }} Constraint {{ {{ NameOfCoef t; EntityType NodesOf; NameOfConstraint T; }} }} }} }}
Jacobian {{ {{ Name J; Case {{ {{ Region Body; Jacobian Vol; }} }} }} }}
Integration {{ {{ Name I; Case {{ {{ Type Gauss; Case {{ {{ GeoElement Quadrangle; NumberOfPoints 4; }} }} }} }} }} }}
Formulation {{ {{ Name F; Type FemEquation; Quantity {{ {{ Name t; Type Local; NameOfSpace H; }} }}
  Equation {{ Galerkin {{ [k[] * Dof{{d t}}, {{d t}}]; In Body; Jacobian J; Integration I; }} }} }} }}
Resolution {{ {{ Name R; System {{ {{ Name A; NameOfFormulation F; }} }}
  Operation {{ Generate[A]; Solve[A]; SaveSolution[A]; }} }} }}
PostProcessing {{ {{ Name P; NameOfFormulation F;
  Quantity {{ {{ Name t; Value {{ Term {{ [{{t}}]; In Body; Jacobian J; }} }} }} }} }} }}
PostOperation {{ {{ Name O; NameOfPostProcessing P;
  Operation {{ Print[t, OnElementsOf Body, Format NodeTable, File "t.txt"]; }} }} }}
"""


@pytest.mark.skipif(shutil.which("getdp") is None, reason="getdp is not installed: no command getdp")
def test_getdp_reads_2_2_and_solves_heat_to_rounding(tmp_path: Path) -> None:
    write_mesh(LAYERS.scaled(0.25), tmp_path / "a.msh", version="2.2")
    text = (tmp_path / "a.msh").read_text().split("$PhysicalNames\n")[1].split("$End")[0].splitlines()[1:]
    tags = {line.split(maxsplit=2)[2].strip('"'): line.split()[1] for line in text}
    (tmp_path / "heat.pro").write_text(HEAT.format(**tags))
    command = ["getdp", "heat.pro", "-msh", "a.msh", "-solve", "R", "-pos", "O"]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stdout + run.stderr
    assert "Error" not in run.stdout + run.stderr
    table = np.loadtxt(tmp_path / "t.txt", skiprows=1)
    x = LAYERS.points[table[:, 0].astype(int) - 1, 0] * 0.25
    exact = np.where(x < 1, 0.75 * x, 0.75 + 0.25 * (x - 1))
    assert len(table) == LAYERS.n_points
    assert np.abs(table[:, -1] - exact).max() < 1e-10


def test_another_version_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"'3\.0' is not written"):
        write_mesh(LAYERS, tmp_path / "a.msh", version="3.0")
    with pytest.raises(InputError, match="takes 127"):
        write_mesh(staircase(disk(4, 1), ("x" * 128, "y")), tmp_path / "a.msh")
    assert not list(tmp_path.iterdir())
    assert fe_mesh(LAYERS).kind == "quad4"


@pytest.mark.parametrize("version", ["4.1", "2.2"])
@pytest.mark.parametrize("kind", ["quad8", "quad9", "hex8", "cohesive", "cohesive hexes"])
def test_gmsh_opens_all_kinds_of_elements_without_a_warning(tmp_path: Path, gmsh: Any, kind: str, version: str) -> None:
    mesh = fe_mesh(LAYERS)
    if kind in ("quad8", "quad9"):
        mesh = second_order(mesh, int(kind[-1]))
    if kind.startswith("cohesive"):
        mesh = split_interfaces(mesh)
    if kind.endswith(("hex8", "hexes")):
        mesh = extrude(mesh, 2.0, 2)
    write_mesh(mesh, tmp_path / "a.msh", version=version)
    gmsh.open(str(tmp_path / "a.msh"))
    names = {gmsh.model.getPhysicalName(*g) for g in gmsh.model.getPhysicalGroups()}
    expected = {"quartz", "feldspar", *mesh.side_sets, *mesh.cohesive_cells()}
    if kind.startswith("cohesive"):
        assert expected <= names
    else:
        assert expected - {"interface_feldspar_quartz"} <= names
    assert len(gmsh.model.mesh.getNodes()[0]) == mesh.n_points
    assert not [line for line in gmsh.logger.get() if line.startswith(("Warning", "Error"))]
