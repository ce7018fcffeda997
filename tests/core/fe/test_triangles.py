"""Quads cut into triangles: the same nodes, areas, borders and sets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from imgquad_core.errors import InputError
from imgquad_core.fe import ElementOptions, FEMesh, fe_mesh, make_elements, split_quads
from imgquad_core.fe.cohesive import split_interfaces
from imgquad_core.fe.second_order import second_order
from imgquad_core.writers import write_mesh
from support.handmade import disk, jiggle, staircase

PICTURE = staircase(disk(12, 4), ("matrix", "disk"), lambda p: 1.8 * jiggle(p))
FLAT = fe_mesh(PICTURE)


def areas(mesh: FEMesh) -> np.ndarray:
    a, b, c = (mesh.points[mesh.cells[:, k]] for k in range(3))
    return ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


def smallest_angles(points: np.ndarray) -> np.ndarray:
    """Of triangles, shape (n, 3, 2)."""
    found = []
    for k in range(3):
        u, v = points[:, (k + 1) % 3] - points[:, k], points[:, (k + 2) % 3] - points[:, k]
        cosine = (u * v).sum(axis=1) / np.linalg.norm(u, axis=1) / np.linalg.norm(v, axis=1)
        found.append(np.arccos(np.clip(cosine, -1, 1)))
    return np.min(found, axis=0)


def test_two_triangles_for_each_quad_by_the_better_diagonal() -> None:
    mesh = split_quads(FLAT)
    assert (areas(mesh) > 0).all()
    assert areas(mesh).sum() == pytest.approx(144)
    assert (np.sort(np.unique(mesh.cells[:2])) == np.sort(FLAT.cells[0])).all()
    ours = smallest_angles(mesh.points[mesh.cells]).reshape(-1, 2).min(axis=1)
    q = FLAT.points[FLAT.cells]
    both = [
        np.minimum(smallest_angles(q[:, a]), smallest_angles(q[:, b]))
        for a, b in (([0, 1, 2], [0, 2, 3]), ([0, 1, 3], [1, 2, 3]))
    ]
    assert (ours >= np.max(both, axis=0) - 1e-12).all()
    assert (both[0] > both[1]).any()
    assert (both[1] > both[0]).any()


def test_sets_are_where_they_were() -> None:
    mesh = split_quads(FLAT)
    for name, sides in FLAT.side_sets.items():
        assert (mesh.side_nodes(mesh.side_sets[name]) == FLAT.side_nodes(sides)).all(), name
        assert (mesh.side_sets[name][:, 0] // 2 == sides[:, 0]).all(), name
    for name, ids in FLAT.element_sets.items():
        assert (np.unique(mesh.element_sets[name] // 2) == ids).all()
        assert len(mesh.element_sets[name]) == 2 * len(ids)
    assert mesh.node_sets.keys() == FLAT.node_sets.keys()


def test_cohesive_elements_stay_between_triangles() -> None:
    split = split_interfaces(FLAT)
    mesh = split_quads(split)
    assert (mesh.cohesive == split.cohesive).all()
    corners = {tuple(sorted(side)) for side in mesh.side_nodes(mesh.side_sets["interface_matrix_disk"]).tolist()}
    assert corners == {tuple(sorted(row[:2])) for row in split.cohesive.tolist()}


@pytest.mark.parametrize(
    ("extension", "text"),
    [(".inp", "TYPE=CPS3"), (".bdf", "CTRIA3"), (".msh", "$Elements"), (".obj", "f "), (".cdb", "EBLOCK")],
)
def test_formats_take_triangles(tmp_path: Path, extension: str, text: str) -> None:
    write_mesh(split_quads(FLAT), tmp_path / f"a{extension}")
    assert text in (tmp_path / f"a{extension}").read_text()


def test_only_plane_quads_of_four_nodes_are_cut() -> None:
    with pytest.raises(InputError, match="not quad8"):
        split_quads(second_order(FLAT))
    with pytest.raises(InputError, match="exclude each other"):
        ElementOptions(order=2, split_quads=True)
    assert make_elements(PICTURE, ElementOptions(split_quads=True)).kind == "tri3"
