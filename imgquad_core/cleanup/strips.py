"""Pieces of large faces, which threads can share, without a scar where they meet.

A large face is cut into strips across its longer side. The nodes on the seams are held, and each strip is worked on
like a face. What the seams have held up is done in other pieces after that, around the seams:

    +-----+-----+-----+        +---+-+---+-+---+
    |     |     |     |        |   | |   | |   |
    |  0  |  1  |  2  |        |   |1|   |2|   |
    |     |     |     |        |   | |   | |   |
    +-----+-----+-----+        +---+-+---+-+---+
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.jit import kernel
from imgquad_core.threads import in_threads

from .faces import FaceQuads, taken_out
from .options import PORTIONS, Portions

LEFT_ALONE = -1  # number of the piece that is not worked on


def strips_of(points: Floats, quads: Ints, portions: Portions = PORTIONS, *, shifted: bool = False) -> Ints:
    """Return the number of the strip of each quad; the shifted cut has its seams half-way between the others."""
    extent = np.ptp(points, axis=0)
    along = int(extent[1] > extent[0])
    place = (points[quads[:, 0], along] - points[:, along].min()) / extent[along]
    count = 2 * max(1, round(np.sqrt(len(quads) * extent[along] / extent[1 - along]) / portions.strip / 2))
    return np.asarray(np.minimum(count * place, count - 1e-9) + 0.5 * shifted, np.int64)


def in_pieces(
    mesh: FaceQuads, piece: Ints, work: Callable[[FaceQuads, Ints], FaceQuads], threads: int
) -> tuple[FaceQuads, Flags]:
    """Call `work` for each piece and sew the results together; return the mesh and which of its nodes are on seams.

    Parameters
    ----------
    mesh : FaceQuads
        One face or several.
    piece : int64, shape (n_quads,)
        Number of the piece of each quad, `LEFT_ALONE` for those that stay as they are.
    work : callable
        Gets a piece, with rim nodes on seams as well (`origin` is of no use to it but for its sign), and the ids of
        its nodes in `mesh`. Returns the piece with other quads and inner nodes.
    threads : int
        The result does not depend on it.
    """
    _, seam = pieces_at(piece, mesh.quads, len(mesh.points))
    held = np.where(seam | (mesh.origin >= 0), np.arange(len(mesh.points)), -1)
    order = np.argsort(piece, kind="stable")
    new = np.full(len(mesh.points), -1, np.int64)
    parts = []
    for quads in np.split(order, np.flatnonzero(np.diff(piece[order])) + 1):
        part, ids = taken_out(mesh, quads, new)
        new[ids] = -1
        here = np.bincount(part.quads.ravel(), minlength=len(ids))
        parts.append((part._replace(origin=held[ids], wanted=np.where(seam[ids], here, part.wanted)), ids))
    idle = [part for part, _ in parts[: int(piece[order[0]] == LEFT_ALONE)]]
    return _sewn(mesh, seam, idle + in_threads(parts[len(idle) :], lambda part: work(*part), threads))


def independent_nodes(piece: Ints, quads: Ints, n_points: int, n_groups: int) -> tuple[list[Flags], Flags]:
    """Return the nodes in groups of whole pieces, which feel each other only across the seams, and those on seams."""
    one, seam = pieces_at(piece, quads, n_points)
    share = np.bincount(piece) / len(quads)
    group = np.floor((np.cumsum(share) - 0.5 * share) * n_groups)[one]
    return [~seam & (group == g) for g in range(n_groups)], seam


@kernel
def pieces_at(piece: Ints, quads: Ints, n_points: int) -> tuple[Ints, Flags]:
    """Return for each node the piece of one of its quads, and whether others of its quads are of another piece."""
    one, seam = np.full(n_points, -2, np.int64), np.zeros(n_points, np.bool_)
    for q in range(len(quads)):
        for k in range(4):
            v = quads[q, k]
            seam[v] |= one[v] != -2 and one[v] != piece[q]
            one[v] = piece[q]
    return one, seam


def _sewn(mesh: FaceQuads, seam: Flags, parts: list[FaceQuads]) -> tuple[FaceQuads, Flags]:
    """Join pieces at the nodes that have the same origin, an id in `mesh`."""
    origin = np.concatenate([part.origin for part in parts])
    held = np.flatnonzero(origin >= 0)
    _, first, which = np.unique(origin[held], return_index=True, return_inverse=True)
    node = np.arange(len(origin))
    node[held] = held[first[which]]
    kept = node == np.arange(len(origin))
    node = (np.cumsum(kept) - 1)[node]
    shift = np.cumsum([0] + [len(part.points) for part in parts])
    old = origin[kept]
    sewn = FaceQuads(
        np.concatenate([part.points for part in parts])[kept],
        node[np.concatenate([part.quads + s for part, s in zip(parts, shift, strict=False)])],
        np.concatenate([part.face for part in parts]),
        np.where(old >= 0, mesh.origin[old], -1),
        np.where(old >= 0, mesh.wanted[old], np.concatenate([part.wanted for part in parts])[kept]),
    )
    return sewn, (old >= 0) & seam[old]


@kernel
def nodes_around(quads: Ints, nodes: Flags, rings: int) -> Flags:
    """Return the nodes that are at most `rings` quads away from the flagged ones."""
    near = nodes.copy()
    for _ in range(rings):
        inside = near.copy()
        for q in range(len(quads)):
            if inside[quads[q, 0]] or inside[quads[q, 1]] or inside[quads[q, 2]] or inside[quads[q, 3]]:
                for k in range(4):
                    near[quads[q, k]] = True
    return near
