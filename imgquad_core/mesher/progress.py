"""How much of the meshing is done: a face counts by its quads, two fifths when composed and the rest when finished."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from imgquad_core.arrays import Flags, Floats
from imgquad_core.cleanup.faces import FaceQuads

COMPOSED = 0.4  # of the time that a face takes, about


class Progress:
    """Tells the share of the quads that are made, each face once, however often it is meshed."""

    def __init__(self, quads: Floats, told: Callable[[float], None]) -> None:
        self._share, self._told = quads / quads.sum(), told
        self._composed, self._finished = (np.zeros(len(quads), bool) for _ in range(2))
        self._done = 0.0

    def composed(self, faces: Flags) -> None:
        """Faces have their first quads."""
        self._tell(COMPOSED * self._share[faces & ~self._composed].sum())
        self._composed |= faces

    def finished(self, part: FaceQuads) -> None:
        """Faces have their last quads, if these are good enough."""
        faces = np.zeros(len(self._share), bool)
        faces[part.face] = True
        self._tell((1.0 - COMPOSED) * self._share[faces & ~self._finished].sum())
        self._finished |= faces

    def _tell(self, more: float) -> None:
        if more > 0.0:
            self._done += float(more)
            self._told(min(self._done, 1.0))
