"""Very large faces in strips, which threads can share, without a scar where they meet.

A face is cut across its longer side, its nodes on the seams are held, and the strips are worked on like faces. What
the seams have held up is done after that in the strips of a second cut, whose seams lie half-way between the first:

    +-----+-----+-----+        +--+-----+-----+--+
    |     |     |     |        |  |     |     |  |
    |  0  |  1  |  2  |        |0 |  1  |  2  | 3|
    |     |     |     |        |  |     |     |  |
    +-----+-----+-----+        +--+-----+-----+--+
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .batches import BATCH, in_threads, taken_out
from .splitting import FaceQuads

Ids = NDArray[np.int64]
Points = NDArray[np.float64]
Flags = NDArray[np.bool_]

LARGEST = 3 * BATCH  # quads of a face that stays whole
WIDTH = 64  # quads across a strip, about: many times a cavity
REACH = 3  # quads on both sides of a seam that are smoothed again


def strips_of(points: Points, quads: Ids, shifted: bool = False) -> Ids:
    """Return the number of the strip of each quad; the shifted cut has its seams half-way between the others."""
    corner = points[quads[:, 0]]
    extent = np.ptp(corner, axis=0)
    along = int(extent[1] > extent[0])
    place = (corner[:, along] - corner[:, along].min()) / extent[along]
    count = max(2, round(np.sqrt(len(quads) * extent[along] / extent[1 - along]) / WIDTH))
    return np.asarray(np.minimum(count * place, count - 1e-9) + 0.5 * shifted, np.int64)


def in_strips(
    mesh: FaceQuads, strip: Ids, work: Callable[[FaceQuads, Ids], FaceQuads], threads: int
) -> tuple[FaceQuads, Flags]:
    """Call `work` for each strip and sew the results together; return the mesh and which of its nodes are on seams.

    Parameters
    ----------
    mesh : FaceQuads
        One face.
    strip : int64, shape (n_quads,)
        Number of the strip of each quad.
    work : callable
        Gets a strip, with rim nodes on seams as well (`origin` is of no use to it but for its sign), and the ids of
        its nodes in `mesh`. Returns the strip with other quads and inner nodes.
    threads : int
        The result does not depend on it.
    """
    seam = seams_between(strip, mesh.quads, len(mesh.points))
    held = np.where(seam | (mesh.origin >= 0), np.arange(len(mesh.points)), -1)
    order = np.argsort(strip, kind="stable")
    quads = np.split(order, np.flatnonzero(np.diff(strip[order])) + 1)
    new = np.full(len(mesh.points), -1, np.int64)
    pieces = []
    for chosen in quads:
        part, ids = taken_out(mesh, chosen, new)
        new[ids] = -1
        here = np.bincount(part.quads.ravel(), minlength=len(ids))
        pieces.append((part._replace(origin=held[ids], wanted=np.where(seam[ids], here, part.wanted)), ids))
    return _sewn(mesh, seam, in_threads(pieces, lambda piece: work(*piece), threads))


def seams_between(piece: Ids, quads: Ids, n_points: int) -> Flags:
    """Return which nodes have quads of several pieces; `piece` holds the number of each quad's."""
    one, seam = np.empty(n_points, np.int64), np.zeros(n_points, bool)
    one[quads] = piece[:, None]
    seam[quads[one[quads] != piece[:, None]]] = True
    return seam


def _sewn(mesh: FaceQuads, seam: Flags, parts: list[FaceQuads]) -> tuple[FaceQuads, Flags]:
    """Join strips at the nodes that have the same origin, an id in `mesh`."""
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


def around_seams(mesh: FaceQuads, seams: Flags, work: Callable[[FaceQuads], FaceQuads]) -> FaceQuads:
    """Call `work` for the quads around the flagged nodes."""
    if not seams.any():
        return mesh
    near = nodes_around(mesh.quads, seams, REACH)[mesh.quads].any(axis=1)
    return in_strips(mesh, near.astype(np.int64), lambda part, nodes: work(part) if seams[nodes].any() else part, 1)[0]


def nodes_around(quads: Ids, nodes: Flags, rings: int) -> Flags:
    """Return the nodes that are at most `rings` quads away from the flagged ones."""
    near = nodes.copy()
    for _ in range(rings):
        near[quads[near[quads].any(axis=1)]] = True
    return near
