"""Where the pixels of an image lie in space, and where a mesh of them goes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Placement:
    """Where the pixels of an image lie in space.

    Parameters
    ----------
    origin : float64, shape (3,)
        The image's lower left corner, half a pixel from the centre of its first pixel.
    axes : float64, shape (2, 3)
        One pixel to the right, one pixel up.
    """

    origin: NDArray[np.float64]
    axes: NDArray[np.float64]

    @property
    def mirrored(self) -> bool:
        """Whether a counter-clockwise quad of the picture runs clockwise when seen from above."""
        return bool(np.cross(*self.axes)[2] < 0)

    @property
    def pixel_size(self) -> float:
        """Length of the shorter side of a pixel."""
        return float(np.linalg.norm(self.axes, axis=1).min())

    @property
    def sides(self) -> tuple[float, float]:
        """Width and height of a pixel."""
        width, height = np.linalg.norm(self.axes, axis=1).tolist()
        return width, height

    def divided(self, shape: tuple[int, int], into: tuple[int, int]) -> Placement:
        """Return where squares lie, `into` (height, width) of which cover what `shape` pixels do."""
        if shape == into:
            return self
        return replace(self, axes=self.axes * (np.array(shape[::-1]) / np.array(into[::-1]))[:, None])

    def place(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points in space, shape (n, 3), of points in pixels, shape (n, 2)."""
        return self.origin + points @ self.axes


#: pixels are unit squares from (0, 0) on
PLAIN = Placement(np.zeros(3), np.eye(2, 3))
