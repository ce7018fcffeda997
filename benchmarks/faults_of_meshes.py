"""Faults of meshes: of any label picture, periodic cells, elements; the same bytes whatever the threads."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from faults_of_runs import Generator, path

if TYPE_CHECKING:
    from imgquad_core import MeshOptions
    from imgquad_core.orientation import Turn
    from imgquad_core.pipeline import Run


def draw_labels(rng: Generator) -> np.ndarray:
    """Return an odd label picture: noise, checkerboards, stripes, dots, arms, spirals, lines, cells, void."""
    from support.labels import KINDS, labels_of_kind

    rows, cols, colors = (int(n) for n in (rng.integers(1, 49), rng.integers(1, 49), rng.integers(1, 8)))
    return labels_of_kind(str(rng.choice(KINDS)), rows, cols, colors, int(rng.integers(1 << 30)))


def draw_options(rng: Generator, **more: object) -> dict[str, object]:
    """Return options of a mesh within their limits."""
    return {
        "size": float(rng.choice([1.0, 2.5, 6.0])),
        "effort": str(rng.choice(["fast", "normal", "best"])),
        "policy": str(rng.choice(["minority", "majority", "lower", "diagonal", "junction"])),
        **more,
    }


#: values of options that few trials have
SOMETIMES: dict[str, tuple[object, ...]] = {
    "max_shift": (0.0, 0.5),
    "join": (0.0, 1.0, 4.0, 12.0),
    "growth": (1.05, 1.2, 2.0),
    "edge_ratio": (1.05, 1.5, 3.0),
    "frame_size": (0.8, 3.0, 12.0),
    "boundary_size": (0.8, 3.0, 12.0),
    "triangulator": ("cdt",),
    "min_pixels": (3, 10),
    "min_length": (2.0, 5.0),
}


def draw_case(rng: Generator) -> tuple[np.ndarray, dict[str, object]]:
    """Return a picture and options: most as usual, each now and then another."""
    labels = draw_labels(rng)
    materials = np.unique(labels[labels >= 0])
    more: dict[str, object] = {}
    if rng.random() < 0.3:
        more["periodic"] = str(rng.choice(["x", "y", "xy"]))
    if rng.random() < 0.15:
        more["tolerance"] = float(rng.choice([1.0, 2.5, 6.0]))
    if rng.random() < 0.15 and len(materials) > 1:
        more["drop"] = (int(rng.choice(materials)),)
    if rng.random() < 0.15:
        more["material_sizes"] = {int(rng.choice(materials)): float(rng.choice([0.7, 2.0, 9.0]))}
    if rng.random() < 0.15:
        more["pixel_size"] = tuple(rng.choice([0.4, 1.0, 1.7, 3.0], 2).tolist())
    if "tolerance" in more and rng.random() < 0.3 and len(materials):
        more["keep"] = (int(rng.choice(materials)),)
    if rng.random() < 0.15 and len(materials) > 1:
        first, second = rng.choice(materials, 2, replace=False).tolist()
        more["sizes_between"] = {(first, second): float(rng.choice([0.7, 2.0, 9.0]))}
    for name, values in SOMETIMES.items():
        if rng.random() < 0.15:
            more[name] = values[int(rng.integers(len(values)))]
    return labels, draw_options(rng, **more)


def turned_options(options: dict[str, object], turn: Turn) -> dict[str, object]:
    """Return the options that mean the same for a turned picture."""
    changes: dict[str, object] = {}
    if "periodic" in options:
        changes["periodic"] = turn.directions(str(options["periodic"]))
    if isinstance(sides := options.get("pixel_size"), tuple):
        changes["pixel_size"] = turn.shape(sides)
    return options | changes


def hangs_on_position(labels: np.ndarray, options: MeshOptions) -> bool:
    """Whether options mean a direction, and a picture does not tell it, as a diagonal mirrors it."""
    from imgquad_core.orientation import TURNS

    alike = any(turn.transposed and np.array_equal(turn.picture(labels), labels) for turn in TURNS)
    directed = options.periodic in ("x", "y") or len(set(options.pixel_sides)) > 1
    return options.policy == "diagonal" or (directed and alike)


def meshes(rng: Generator, folder: Path) -> None:
    """A mesh of any label picture, or of a periodic cell: valid, its areas those of its boundary, no side too short,
    the same bytes again with any number of threads, and the same mesh of the picture turned."""  # fmt: skip
    from imgquad_core import MeshOptions
    from imgquad_core.errors import InputError

    labels, drawn = draw_case(rng)
    options = MeshOptions(**drawn, threads=1)  # type: ignore[arg-type]
    try:
        meshed_however(labels, drawn, rng)
    except InputError:
        can_be = bool(options.drop) and bool(options.tolerance or options.min_pixels or options.min_length)
        assert can_be, "nothing can be left only where both take something"


def meshed_however(labels: np.ndarray, drawn: dict[str, object], rng: Generator) -> None:
    """Mesh a picture, again with other threads, and turned."""
    from imgquad_core import MeshOptions, run
    from imgquad_core.orientation import TURNS
    from support.labels import label_image

    options = MeshOptions(**drawn, threads=1)  # type: ignore[arg-type]
    made = judged(labels, options)
    again = run(label_image(labels), replace(options, threads=int(rng.choice([2, 16]))))
    assert made.mesh.points.tobytes() == again.mesh.points.tobytes(), "other points at the second time"
    assert made.mesh.quads.tobytes() == again.mesh.quads.tobytes(), "other quads at the second time"
    assert np.array_equal(pickle.loads(pickle.dumps(made)).mesh.points, made.mesh.points)
    turn = TURNS[int(rng.integers(1, len(TURNS)))]
    turned = judged(turn.picture(labels), MeshOptions(**turned_options(drawn, turn), threads=1))  # type: ignore[arg-type]
    if not any(hangs_on_position(values, options) for values in (labels, made.labels.labels)):
        assert turned.mesh.n_quads == made.mesh.n_quads, f"{made.mesh.n_quads} quads, turned {turned.mesh.n_quads}"


def judged(labels: np.ndarray, options: MeshOptions) -> Run:
    """Return what a run makes of labels, after judging it."""
    from imgquad_core import run
    from support import invariants
    from support.labels import label_image

    made = run(label_image(labels), options)
    moves_far = options.tolerance > 0.0 or (options.join or 0.0) > 2.0 * options.max_shift  # others are as usual
    judge = invariants.assert_simplified_mesh if moves_far else invariants.assert_valid_mesh
    judge(made.mesh, made.labels, pixel_size=options.pixel_sides)
    invariants.assert_accounted(made)
    invariants.assert_areas_of_boundary(made)
    if not moves_far and options.max_shift and options.periodic == "none" and len(set(options.pixel_sides)) == 1:
        invariants.assert_areas_of_pixels(made)
    if options.periodic != "none":
        invariants.assert_opposite_sides_match(made.pixel_mesh, options.periodic, made.boundary.shape)
        assert_tied_where_whole(made, options.periodic)
    else:
        invariants.assert_sides_long(made.pixel_mesh)
    return made


def assert_tied_where_whole(made: Run, directions: str) -> None:
    """Fail unless each node of a side is tied, where no part of the picture is void; there as many as can be."""
    from imgquad_core.errors import InputError
    from imgquad_core.fe import ElementOptions, make_elements

    whole = (made.labels.labels >= 0).all()
    try:
        pairs = make_elements(made.mesh, ElementOptions(periodic=directions)).periodic
    except InputError:
        assert not whole
        return
    assert set(pairs) == set(directions)
    for direction, ids in pairs.items():
        on = made.mesh.points[:, "xy".index(direction)]
        assert not whole or len(ids) == np.count_nonzero(on == on.min()), "nodes of a side without a partner"


def cells(rng: Generator, folder: Path) -> None:
    """Periodic cells of tileable pictures with cohesive interfaces, of both orders: all nodes tied, none unused."""
    from imgquad_core import MeshOptions, mesh_image
    from imgquad_core.fe import ElementOptions, make_elements
    from support.cells import assert_tied, assert_whole, tileable

    shape = tuple(rng.integers(30, 80, 2).tolist())
    labels = tileable(int(rng.integers(1 << 30)), shape)
    mesh = mesh_image(labels, MeshOptions(size=float(rng.choice([1.5, 3.0, 5.0])), periodic="xy"))
    for order in (1, 2):
        made = make_elements(mesh, ElementOptions(order=order, cohesive="all", periodic="xy"))
        plain = make_elements(mesh, ElementOptions(order=order, periodic="xy"))
        assert_tied(made)
        assert_whole(made)
        assert all(len(made.periodic[d]) >= len(plain.periodic[d]) for d in "xy"), "ties lost by splitting"


def elements(rng: Generator, folder: Path) -> None:
    """Periodic, of second order, cohesive, extruded, materials dropped: an `InputError`, or a mesh without a fault."""
    from imgquad_core import MeshOptions, mesh_image
    from imgquad_core.errors import InputError
    from imgquad_core.fe import ElementOptions, make_elements
    from support.labels import label_image

    labels = draw_labels(rng)
    periodic = str(rng.choice(["none", "x", "y", "xy"]))
    dropped = rng.choice(np.unique(labels), 1).tolist() if rng.random() < 0.3 else []
    with suppress(InputError):
        mesh = mesh_image(label_image(labels), MeshOptions(size=4.0, effort="fast", periodic=periodic, drop=dropped))
        order = int(rng.integers(1, 3))
        made = make_elements(
            mesh,
            ElementOptions(
                order=order,
                cohesive="all" if rng.random() < 0.5 else None,
                extrude=2.0 if order == 1 and rng.random() < 0.5 else None,
                periodic=None if periodic == "none" else periodic,
            ),
        )
        used = np.unique(np.concatenate([made.cells.ravel(), made.cohesive.ravel()]))
        assert np.array_equal(used, np.arange(made.n_points)), "unused nodes"
        period = np.ptp(made.points, axis=0)
        for direction, pairs in made.periodic.items():
            axis = "xyz".index(direction)
            step = made.points[pairs[:, 1]] - made.points[pairs[:, 0]]
            assert len(pairs), "no pair"
            assert np.abs(step - np.eye(step.shape[1])[axis] * period[axis]).max() < 1e-6, "pairs that do not match"


HASHED = """
import hashlib, sys
import numpy as np
from imgquad_core import MeshOptions, mesh_image
labels = np.load(sys.argv[1])
mesh = mesh_image(labels, MeshOptions(size=4.0, effort="fast", colors="exact", threads=int(sys.argv[2])))
print(hashlib.sha256(mesh.points.tobytes() + mesh.quads.tobytes()).hexdigest())
"""


def threads(rng: Generator, folder: Path) -> None:
    """More than 10,000 regions: the same bytes for 1, 2, 4 threads of BLAS and 1, 2, 16 of ours."""
    np.save(folder / "l.npy", rng.integers(0, 16, (120, 125), dtype=np.int32))
    found = set()
    for blas, ours in ((1, 1), (2, 1), (4, 2), (1, 16)):
        env = os.environ | {"PYTHONPATH": path(), "OPENBLAS_NUM_THREADS": str(blas), "OMP_NUM_THREADS": str(blas)}
        command = [sys.executable, "-c", HASHED, str(folder / "l.npy"), str(ours)]
        found.add(subprocess.run(command, capture_output=True, text=True, env=env, check=True).stdout)
    assert len(found) == 1
