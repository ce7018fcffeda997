"""The value that the clean-up works on: quads of faces that share no point."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Bytes, Flags, Floats, Ints, Labels
from imgquad_core.jit import kernel
from imgquad_core.model import Chains, Materials, PointKind, QuadMesh

QUARTER = np.pi / 2
INNER_VALENCE = 4


def taken_out(mesh: FaceQuads, quads: Ints, new: Ints) -> tuple[FaceQuads, Ints]:
    """Take some quads out, with their points numbered by first use; return also the old ids of these.

    `new` holds -1 for each of these points; their new numbers are written there.
    """
    local = mesh.quads[quads]
    ids = _renumber(local, new)
    return FaceQuads(mesh.points[ids], local, mesh.face[quads], mesh.origin[ids], mesh.wanted[ids]), ids


@kernel
def _renumber(quads: Ints, new: Ints) -> Ints:
    """Number the points of `quads` by first use, in place and in `new`; return the old id of each."""
    ids = np.empty(quads.size, np.int64)
    n = 0
    for q in range(len(quads)):
        for k in range(4):
            v = quads[q, k]
            if new[v] < 0:
                new[v] = n
                ids[n] = v
                n += 1
            quads[q, k] = new[v]
    return ids[:n].copy()


def joined(parts: list[FaceQuads]) -> FaceQuads:
    """Put meshes that share no points into one."""
    shift = np.cumsum([0] + [len(part.points) for part in parts])
    return FaceQuads(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.quads + s for part, s in zip(parts, shift, strict=False)]),
        np.concatenate([part.face for part in parts]),
        np.concatenate([part.origin for part in parts]),
        np.concatenate([part.wanted for part in parts]),
    )


def faces_only(mesh: FaceQuads, faces: Flags) -> FaceQuads:
    """Keep the quads of the flagged faces."""
    keep = np.flatnonzero(faces[mesh.face])
    return mesh if len(keep) == len(mesh.face) else taken_out(mesh, keep, np.full(len(mesh.points), -1, np.int64))[0]


def wanted_quads(angle: Floats) -> Ints:
    """Return how many quads a sector of `angle` radians should hold: as near to right angles as can be, at least 1."""
    return np.asarray(np.maximum(1, np.floor(angle / QUARTER + 0.5)), np.int64)


class FaceQuads(NamedTuple):
    """Quads of faces that share no point: every constraint is rim."""

    points: Floats  #: float64 (n, 2)
    quads: Ints  #: int64 (n_quads, 4), counter-clockwise
    face: Ints  #: int64 (n_quads,), region of each quad
    origin: Ints  #: int64 (n,), id of each rim point in the boundary graph, -1 inside
    wanted: Ints  #: int64 (n,), number of quads that a point should have: 4 inside, by the angle on the rim


def stitched(
    quads: FaceQuads,
    place: Ints,
    points: Floats,
    kind: Bytes,
    chains: Chains,
    region_label: Labels,
    materials: Materials,
) -> QuadMesh:
    """Join faces at the boundary's points, which come first.

    Parameters
    ----------
    quads : FaceQuads
        Each face with points of its own; `origin` is the point of the boundary that one stands for.
    place : int64
        What the point of the boundary `origin` is called in the mesh.
    points, kind
        The boundary's points, in the mesh's order.
    chains : Chains
        Of the mesh.
    region_label, materials
        Of the mesh.
    """
    inner = quads.origin < 0
    n_inner = np.count_nonzero(inner)
    ids = place[quads.origin]
    ids[inner] = len(points) + np.arange(n_inner)
    return QuadMesh(
        np.vstack([points, quads.points[inner]]),
        np.concatenate([kind, np.full(n_inner, PointKind.INTERIOR, np.uint8)]),
        ids[quads.quads],
        quads.face,
        region_label,
        *chains,
        materials,
    )
