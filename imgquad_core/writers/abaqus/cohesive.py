"""Cohesive elements in an Abaqus input file: as COH2D4 and COH3D8, or as springs for CalculiX, which has neither."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import count

import numpy as np

from imgquad_core.arrays import Floats, Ints
from imgquad_core.errors import InputError
from imgquad_core.fe.femesh import FEMesh
from imgquad_core.fe.properties import Properties, interface_values
from imgquad_core.writers.common import real, refuse_six_nodes, rows

ELEMENTS = {4: "COH2D4", 8: "COH3D8"}
INTERFACES = ("elements", "springs")
STIFFNESS = ("normal_stiffness", "shear_stiffness")
#: pairs of nodes (below, above) of each cohesive element and their shares of its length or area: Lobatto points
PAIRS = {4: ((0, 3), (1, 2)), 6: ((0, 3), (1, 2), (4, 5)), 8: ((0, 4), (1, 5), (2, 6), (3, 7))}
SHARES = {4: (1 / 2, 1 / 2), 6: (1 / 6, 1 / 6, 2 / 3), 8: (1 / 4, 1 / 4, 1 / 4, 1 / 4)}


def interface_text(
    mesh: FEMesh, labels: Mapping[str, str], values: Properties, thickness: float, interfaces: str
) -> Iterator[str]:
    """Text of the cohesive elements of `mesh`.

    Parameters
    ----------
    mesh : FEMesh
        With cohesive elements.
    labels : mapping
        Name in the file of each set of cohesive elements.
    values : Properties
        Of interfaces: `normal_stiffness`, `shear_stiffness`, force per area and opening.
    thickness : float
        Out of the plane.
    interfaces : str
        ``elements`` or ``springs``.

    Raises
    ------
    InputError
        Six-node elements as ``elements``, or springs without stiffness.
    """
    if interfaces not in INTERFACES:
        raise InputError(f"interfaces = '{interfaces}' is unknown; choose one of: {', '.join(INTERFACES)}")
    names = mesh.material_names()
    numbers = count(mesh.n_cells + len(mesh.cohesive) + 1)  # of springs
    for name, ids in mesh.cohesive_cells().items():
        a, b = (names[int(m)] for m in mesh.cohesive_pair[ids[0]])
        stiffness = interface_values(values, a, b)
        if interfaces == "elements":
            refuse_six_nodes(mesh, "Abaqus", "write springs (interfaces: springs) ")
            yield from _elements(mesh, ids, labels[name], stiffness, thickness)
        else:
            missing = [key for key in STIFFNESS if key not in stiffness]
            if missing:
                raise InputError(
                    f'springs need {" and ".join(missing)} of the interface; give them below ["{a}:{b}"] or ["*:*"] '
                    "in the TOML file of properties"
                )
            yield from _springs(mesh, ids, labels[name], stiffness, thickness, numbers)


def _elements(mesh: FEMesh, ids: Ints, label: str, stiffness: Mapping[str, float], thickness: float) -> Iterator[str]:
    n_nodes = mesh.cohesive.shape[1]
    yield f"*ELEMENT, TYPE={ELEMENTS[n_nodes]}, ELSET={label}\n"
    yield from rows("%d" + ", %d" * n_nodes + "\n", mesh.n_cells + 1 + ids, mesh.cohesive[ids] + 1)
    yield f"*COHESIVE SECTION, ELSET={label}, MATERIAL={label}, RESPONSE=TRACTION SEPARATION, THICKNESS=SPECIFIED\n"
    yield f"1., {real(thickness)}\n" if n_nodes == 4 else "1.\n"
    yield f"*MATERIAL, NAME={label}\n"
    if all(key in stiffness for key in STIFFNESS):
        normal, shear = (stiffness[key] for key in STIFFNESS)
        yield f"*ELASTIC, TYPE=TRACTION\n{real(normal)}, {real(shear)}, {real(shear)}\n"
    else:
        yield "** no values were given: put *ELASTIC, TYPE=TRACTION and *DAMAGE here\n"


def _springs(
    mesh: FEMesh, ids: Ints, label: str, stiffness: Mapping[str, float], thickness: float, numbers: Iterator[int]
) -> Iterator[str]:
    """SPRING2 elements between the two nodes at each place, with the stiffness of its share of the interface.

    Where the normal and the shear stiffness differ, each place has axes of its own along its normal.
    """
    pairs, normals = node_pairs(mesh, ids)
    share = np.linalg.norm(normals, axis=1) * (thickness if mesh.dimension == 2 else 1.0)
    same = stiffness["normal_stiffness"] == stiffness["shear_stiffness"]
    for at, (pair, size, normal) in enumerate(zip(pairs + 1, share.tolist(), normals, strict=True)):
        axes = "" if same else f", ORIENTATION=O_{label}_{at + 1}"
        if not same:
            yield f"*ORIENTATION, NAME=O_{label}_{at + 1}, SYSTEM=RECTANGULAR\n{_axes(normal)}\n"
        for direction in range(1, mesh.dimension + 1):
            value = stiffness["normal_stiffness" if direction == 1 else "shear_stiffness"] * size
            yield f"*ELEMENT, TYPE=SPRING2, ELSET={label}_{at + 1}_{direction}\n{next(numbers)}, {pair[0]}, {pair[1]}\n"
            yield f"*SPRING, ELSET={label}_{at + 1}_{direction}{axes}\n{direction}, {direction}\n{real(value)}\n"


def _axes(normal: Floats) -> str:
    """First axis along `normal`, second in the plane across it."""
    x, y = (normal[:2] / np.linalg.norm(normal)).tolist()
    return f"{real(x)}, {real(y)}, 0., {real(-y)}, {real(x)}, 0."


def node_pairs(mesh: FEMesh, ids: Ints) -> tuple[Ints, Floats]:
    """Nodes (below, above) that rows `ids` of the cohesive elements join, each once, and their share of the interface.

    Returns
    -------
    pairs : int64, shape (n, 2)
    normals : float64, shape (n, 2)
        In the plane; as long as the share of the length (of the area, if extruded).
    """
    rows_ = mesh.cohesive[ids]
    n_nodes = rows_.shape[1]
    pairs = np.concatenate([rows_[:, list(pair)] for pair in PAIRS[n_nodes]])
    shares = np.concatenate([share * _normals(mesh, rows_) for share in SHARES[n_nodes]])
    open_ = pairs[:, 0] != pairs[:, 1]
    unique, of = np.unique(pairs[open_], axis=0, return_inverse=True)
    normals = np.zeros((len(unique), 2))
    np.add.at(normals, of.ravel(), shares[open_])
    return unique, normals


def _normals(mesh: FEMesh, cohesive: Ints) -> Floats:
    """From below to above, as long as the side (its area)."""
    p = mesh.points[cohesive]
    if mesh.dimension == 3:
        area: Floats = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])[:, :2] / 2
        return area
    along = p[:, 1] - p[:, 0]
    return np.stack([-along[:, 1], along[:, 0]], axis=1)
