"""Work on many faces in batches: small enough for the cache, independent, so that threads can share them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from imgquad_core.arrays import Ints
from imgquad_core.threads import in_threads

from .faces import FaceQuads, taken_out
from .options import PORTIONS, Portions

Result = TypeVar("Result")
TILE = 8  # edge lengths; quads of a batch are numbered tile by tile


def in_batches(
    mesh: FaceQuads, work: Callable[[FaceQuads], Result], threads: int, portions: Portions = PORTIONS
) -> list[Result]:
    """Call `work` for groups of whole faces; the results come in the order of the batches, whatever the threads."""
    return in_threads(batches_of(mesh, portions), work, threads)


def batches_of(mesh: FaceQuads, portions: Portions = PORTIONS) -> list[FaceQuads]:
    """Cut the mesh into groups of neighbouring faces (by number) of about a batch, and faces that are large."""
    if len(mesh.quads) == 0:
        return []
    per_face = np.bincount(mesh.face)
    nth, alone = (np.cumsum(per_face) - per_face) // portions.batch, per_face > portions.largest
    begins = (np.diff(nth, prepend=0) > 0) | alone
    begins[1:] |= alone[:-1]
    batch = np.cumsum(begins)[mesh.face]
    order = np.lexsort((_tile(mesh), mesh.face, batch))
    ends = np.flatnonzero(np.diff(batch[order])) + 1
    new = np.full(len(mesh.points), -1, np.int64)  # one for all parts: they share no point
    return [taken_out(mesh, chosen, new)[0] for chosen in np.split(order, ends)]


def is_large(batch: FaceQuads, portions: Portions) -> bool:
    """Whether a batch is one large face."""
    return len(batch.quads) > portions.largest and bool((batch.face == batch.face[0]).all())


def _tile(mesh: FaceQuads) -> Ints:
    """Number of the tile that holds the first corner of each quad."""
    corner = mesh.points[mesh.quads[:, 0]]
    area = np.ptp(mesh.points, axis=0).prod() / max(1, len(mesh.quads))
    cell = np.floor(corner / (TILE * np.sqrt(area) + 1e-300)).astype(np.int64)
    return np.asarray(cell[:, 1] * (cell[:, 0].max() + 1) + cell[:, 0])
