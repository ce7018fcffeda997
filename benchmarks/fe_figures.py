"""How good are solutions on our meshes? Prints the figures of docs/fe/figures.md; needs CalculiX and scikit-fem.

python benchmarks/fe_figures.py patch ../shared/images     patch tests on the clean label pictures
python benchmarks/fe_figures.py bounds                     effective modulus: bounds and order of convergence
python benchmarks/fe_figures.py laminates                  against the exact answer
python benchmarks/fe_figures.py inclusion [FIGURE.png]     Eshelby's circular inclusion, against the staircase mesh
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from imgquad_core.fe.femesh import FEMesh
from imgquad_core.fe.second_order import second_order
from imgquad_core.fe.sets import fe_mesh
from imgquad_core.model import QuadMesh
from imgquad_core.options import MeshOptions
from imgquad_core.pipeline import mesh_image
from imgquad_core.writers import write_mesh
from support.ccx import solve
from support.handmade import disk, staircase

Floats = NDArray[np.float64]
#: clean label pictures, and the size that keeps CalculiX within a minute each
CLEAN = {
    "composite_weave_labels_z75.png": 4.0,
    "steel_duplex_ebsd_phase.png": 4.0,
    "im2mesh_7phases.png": 5.0,
    "rock_sandstone_labels_2a.png": 12.0,
    "geology_hamersley_west.png": 16.0,
}
SAME = {"*": {"young": 210e3, "poisson": 0.3, "conductivity": 2.0}}


def calculix(mesh: FEMesh, also: str = "", **options: object) -> dict[str, Floats]:
    with tempfile.TemporaryDirectory() as folder:
        write_mesh(mesh, Path(folder) / "a.inp", **options)
        return solve(Path(folder) / "a.inp", also)


def patch(folder: str) -> None:
    print(f"{'picture':34s} {'size':>4s} {'quads':>7s} {'CPS4':>8s} {'CPE4':>8s} {'CPS8':>8s} {'heat':>8s} {'s':>5s}")
    for name, size in CLEAN.items():
        start = perf_counter()
        mesh = fe_mesh(mesh_image(Path(folder) / name, MeshOptions(size=size)))
        errors = [
            stress_error(mesh, "plane stress", 210.0, 0.0),
            stress_error(mesh, "plane strain", 210 / 0.91, 0.3 * 210 / 0.91),
            stress_error(second_order(mesh), "plane stress", 210.0, 0.0),
            heat_error(mesh),
        ]
        row = " ".join(f"{e:8.1e}" for e in errors)
        print(f"{name:34s} {size:4.0f} {mesh.n_cells:7d} {row} {perf_counter() - start:5.0f}", flush=True)


def stress_error(mesh: FEMesh, analysis: str, along: float, across: float) -> float:
    """Largest deviation from the constant stress, over the stress."""
    found = calculix(mesh, "*EL PRINT, ELSET=EALL\nS", analysis=analysis, properties=SAME, deck="tension")["stresses"]
    return float(np.abs(found[:, 2:] - [along, 0, across, 0, 0, 0]).max() / along)


def heat_error(mesh: FEMesh) -> float:
    """Largest deviation from the linear temperature, which runs from 0 to 1."""
    found = calculix(mesh, "*NODE PRINT, NSET=NALL\nNT", properties=SAME, deck="thermal")["temperatures"]
    x = mesh.points[found[:, 0].astype(int) - 1, 0]
    return float(np.abs(found[:, 1] - x / x.max()).max())


def bounds() -> None:
    labels = disk(160, 48)
    soft, hard = 1.0, 10.0
    share = labels.mean()
    reuss, voigt = 1 / ((1 - share) / soft + share / hard), (1 - share) * soft + share * hard
    print(f"disk of {share:.4f} in a plate, moduli {soft} and {hard}: Reuss {reuss:.5f}, Voigt {voigt:.5f}")
    for order in (1, 2):
        found = [effective_modulus(labels, size, order, soft, hard) for size in (16.0, 8.0, 4.0, 2.0, 1.0)]
        steps = np.diff(found)
        rates = [np.log2(a / b) for a, b in pairwise(steps)]
        print(f"order {order}: sizes 16 8 4 2 1:", " ".join(f"{e:.6f}" for e in found), "rates", np.round(rates, 2))
        assert all(reuss < e < voigt for e in found)


def effective_modulus(labels: NDArray[np.int32], size: float, order: int, soft: float, hard: float) -> float:
    """In plane strain, times 1 - nu^2: CalculiX's plane stress ties the strain across the plane at nodes."""
    mesh = fe_mesh(mesh_image(labels, MeshOptions(size=size)))
    mesh = second_order(mesh) if order == 2 else mesh
    names = mesh.material_names()
    values = {names[0]: {"young": soft, "poisson": 0.3}, names[1]: {"young": hard, "poisson": 0.3}}
    force = calculix(mesh, analysis="plane strain", properties=values, deck="tension")["total force"][0, 0]
    return float(force / (1e-3 * labels.shape[0]) * (1 - 0.3**2))


def laminates() -> None:
    rows = np.repeat([0, 1, 2, 0, 1], [11, 23, 17, 29, 16])
    conductivity = np.array([1.0, 7.0, 40.0])
    for across in (False, True):
        labels = np.repeat(rows[:, None], 96, axis=1)
        labels = labels.T if across else labels
        k = conductivity[rows]
        exact = 1 / (1 / k).mean() if across else k.mean()
        for size in (3.0, 8.0):
            mesh = fe_mesh(mesh_image(labels, MeshOptions(size=size)))
            values = {name: {"conductivity": conductivity[m]} for m, name in mesh.material_names().items()}
            found = abs(calculix(mesh, properties=values, deck="thermal")["total heat generation"][0, 0])
            print(f"layers {'across' if across else 'along'} x, size {size:g}: {found:.6f}, exact {exact:.6f}, "
                  f"error {found / exact - 1:.1e}", flush=True)  # fmt: skip


class FluxError(NamedTuple):
    """Error of the flux inside, over the exact one."""

    mean: float
    rms: float
    element: float  #: largest of the means over elements
    point: float  #: largest of a quadrature point
    of_element: Floats


def inclusion(figure: str | None = None) -> None:
    """A conducting disk in an infinite plate: inside, the flux is constant (Eshelby).

    The plate is cut at a square border where the exact temperature is prescribed.
    """
    radius, n = 40.0, 321
    print("error of the flux inside, over the exact flux; largest: of an element's mean, of a quadrature point")
    print(f"{'k':>5s} {'mesh':>9s} {'size':>4s} {'element':>7s} {'number':>6s}    mean     rms element   point")
    shown = {}
    for k in (10.0, 0.1):
        for size in (6, 3):
            ours = mesh_image(disk(n, radius), MeshOptions(size=float(size)))
            coarse = staircase(disk(n // size, radius / size)).scaled(size)
            for element in ("Q4", "Q8", "Q9"):
                for name, mesh, width in (("staircase", coarse, n // size * size), ("ours", ours, n)):
                    found = flux_error(mesh, width / 2, radius, k, element)
                    print(f"{k:5g} {name:>9s} {size:4d} {element:>7s} {mesh.n_quads:6d} {_row(found)}", flush=True)
                    if (size, k, element) == (3, 10.0, "Q4"):
                        shown[name] = (mesh, found)
    print("size 3, k = 10, other centres of the circle in its pixel:")
    for centre in [(x, y) for x in (0.0, 0.2, 0.35, 0.5) for y in (0.0, 0.1, 0.5) if y <= x]:
        mesh = mesh_image(disk(161, radius, centre), MeshOptions(size=3.0))
        errors = [flux_error(mesh, np.add(80.5, centre), radius, 10.0, element) for element in ("Q4", "Q8")]
        print(f"{centre[0]:5g} {centre[1]:4g}   Q4 {_row(errors[0])}   Q8 {_row(errors[1])}", flush=True)
    if figure:
        draw(shown, figure)


def _row(error: FluxError) -> str:
    return " ".join(f"{value:7.5f}" for value in error[:4])


def flux_error(mesh: QuadMesh, middle: ArrayLike, radius: float, k: float, element: str = "Q4") -> FluxError:
    """Error inside a disk of conductivity k, in a plate of conductivity 1 under a gradient along x.

    Parameters
    ----------
    mesh : QuadMesh
        Material 1 is the disk. Where it is a staircase its sides of higher order are straight.
    middle : float or two floats
        Centre of the disk.
    radius : float
        Of the disk.
    k : float
        Its conductivity.
    element : str
        Q4, Q8 or Q9: Q8 and Q9 stand on the same curved quads.
    """
    import skfem
    from skfem.models.poisson import laplace

    elements = fe_mesh(mesh)
    if element == "Q4":
        kind, shape = skfem.MeshQuad, skfem.ElementQuad1()
    else:
        elements = second_order(_straight(elements), 9)
        kind, shape = skfem.MeshQuad2, skfem.ElementQuad2() if element == "Q9" else skfem.ElementQuadS2()
    grid = kind(elements.points.T.copy(), elements.cells.T.copy())
    inside, outside = (np.flatnonzero(elements.cell_material == m) for m in (1, 0))
    basis, basis_in, basis_out = (skfem.Basis(grid, shape, elements=of, intorder=5) for of in (None, inside, outside))
    matrix = laplace.assemble(basis_out) + k * laplace.assemble(basis_in)
    x, y = basis.doflocs - np.broadcast_to(middle, 2)[:, None]
    r2 = np.maximum(x * x + y * y, radius**2)
    exact = np.where(x * x + y * y < radius**2, 2 / (1 + k) * x, x * (1 + (1 - k) / (1 + k) * radius**2 / r2))
    temperature = skfem.solve(*skfem.condense(matrix, x=exact, D=basis.get_dofs().all()))
    flux = k * np.array(basis_in.interpolate(temperature).grad)
    true = np.array([2 * k / (1 + k), 0.0])
    area = basis_in.dx
    mean = (flux * area).sum(axis=(1, 2)) / area.sum() - true
    of_point = np.linalg.norm(flux - true[:, None, None], axis=0) / true[0]
    of_element = np.linalg.norm((flux * area).sum(axis=2) / area.sum(axis=1) - true[:, None], axis=0) / true[0]
    return FluxError(
        mean=float(np.linalg.norm(mean) / true[0]),
        rms=float(np.sqrt((of_point**2 * area).sum() / area.sum())),
        element=float(of_element.max()),
        point=float(of_point.max()),
        of_element=of_element,
    )


def _straight(mesh: FEMesh) -> FEMesh:
    """Take a staircase's chains away, so that second order leaves its sides straight."""
    sides = mesh.points[np.stack([mesh.cells, np.roll(mesh.cells, -1, axis=1)])]
    is_staircase = (sides[0] == sides[1]).any(axis=-1).all()
    return replace(mesh, chain_offsets=[0], chain_points=[]) if is_staircase else mesh


def draw(shown: dict[str, tuple[QuadMesh, FluxError]], figure: str) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    fig, axes = plt.subplots(1, 2, figsize=(9, 4.2), layout="constrained")
    for axis, name in zip(axes, ("staircase", "ours"), strict=True):
        mesh, error = shown[name]
        quads = mesh.points[mesh.quads[mesh.quad_material == 1]]
        drawn = PolyCollection(quads, array=100 * error.of_element, cmap="magma_r", clim=(0, 20), lw=0.2)
        drawn.set_edgecolor("grey")
        axis.add_collection(drawn)
        axis.set_title(f"{name}: largest error of an element {100 * error.element:.1f} %")
        axis.set_aspect("equal")
        axis.autoscale_view()
        axis.set_axis_off()
    fig.colorbar(drawn, ax=axes, label="error of the heat flux inside the disk, %")
    fig.savefig(figure, dpi=110)


if __name__ == "__main__":
    commands: dict[str, Callable[..., None]] = {
        "patch": patch, "bounds": bounds, "laminates": laminates, "inclusion": inclusion
    }  # fmt: skip
    if len(sys.argv) < 2 or sys.argv[1] not in commands:
        sys.exit(__doc__)
    commands[sys.argv[1]](*sys.argv[2:])
