"""The same mesh however the picture lies: each stage works on it turned and mirrored as its content says.

Choices of smoothing and meshing that are all but even fall by the order in which they are met, and a few hundred quads
hang on one of them. So a stage turns what it is given to the one of eight positions that the labels pick, the same for
all stages, works, and turns its result back. Coordinates of boundaries are multiples of 2^-14 px: turning them loses
nothing.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import product
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from .arrays import Floats, Ints
from .model import BoundaryGraph, LabelImage, QuadMesh

P = TypeVar("P", bound=np.generic)
T = TypeVar("T", BoundaryGraph, QuadMesh)
_FINE = 1024  #: parts of a pixel in which points are told apart: fewer than those in which they lie
_MIX = tuple(np.uint64(odd) for odd in (0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9))


class Turn(NamedTuple):
    """One of the eight positions of a picture: first transposed, then turned upside down, then mirrored.

    ::

        transposed  a b    a c      upside down  a b    c d      mirrored  a b    b a
                    c d    b d                   c d    a b                c d    d c
    """

    transposed: bool = False
    upside_down: bool = False
    mirrored: bool = False

    @property
    def swaps_hands(self) -> bool:
        """Whether counter-clockwise becomes clockwise."""
        return bool((self.transposed + self.upside_down + self.mirrored) % 2)

    def picture(self, pixels: NDArray[P]) -> NDArray[P]:
        """Return pixels, shape (n_rows, n_cols) or (n_rows, n_cols, n_channels), in this position."""
        seen = pixels.swapaxes(0, 1) if self.transposed else pixels
        return seen[:: -1 if self.upside_down else 1, :: -1 if self.mirrored else 1]

    def image(self, image: LabelImage) -> LabelImage:
        """Return a picture in this position."""
        return replace(image, labels=np.ascontiguousarray(self.picture(image.labels)))

    def image_back(self, image: LabelImage) -> LabelImage:
        """Return a picture of this position as it was."""
        flipped = image.labels[:: -1 if self.upside_down else 1, :: -1 if self.mirrored else 1]
        return replace(image, labels=np.ascontiguousarray(flipped.T if self.transposed else flipped))

    def shape(self, shape: tuple[int, int]) -> tuple[int, int]:
        """Return (n_rows, n_cols) of a picture in this position; and, as it is its own inverse, what they were."""
        return shape[::-1] if self.transposed else shape

    def directions(self, directions: str) -> str:
        """Return "x", "y" or "xy" of a picture as they are called in this position."""
        return {"x": "y", "y": "x"}.get(directions, directions) if self.transposed else directions

    def points(self, points: Floats, shape: tuple[int, int]) -> Floats:
        """Return x, y of a picture of `shape` in this position."""
        return self._flipped(_transposed(points, shape) if self.transposed else points, self.shape(shape))

    def points_back(self, points: Floats, shape: tuple[int, int]) -> Floats:
        """Return where x, y in this position are in the picture, which has `shape`."""
        flipped = self._flipped(points, self.shape(shape))
        return _transposed(flipped, self.shape(shape)) if self.transposed else flipped

    def _flipped(self, points: Floats, shape: tuple[int, int]) -> Floats:
        columns = [shape[1] - points[:, 0] if self.mirrored else points[:, 0]]
        columns += [shape[0] - points[:, 1] if self.upside_down else points[:, 1]]
        return np.stack(columns, axis=1)

    def graph(self, graph: BoundaryGraph) -> BoundaryGraph:
        """Return boundaries in this position, all in the order that they have."""
        placed = replace(graph, points=self.points(graph.points, graph.shape), shape=self.shape(graph.shape))
        return _with_hands(placed) if self.swaps_hands else placed

    def graph_back(self, graph: BoundaryGraph) -> BoundaryGraph:
        """Return boundaries of this position as they are in the picture."""
        shape = self.shape(graph.shape)
        placed = replace(graph, points=self.points_back(graph.points, shape), shape=shape)
        return _with_hands(placed) if self.swaps_hands else placed

    def mesh_back(self, mesh: QuadMesh, shape: tuple[int, int]) -> QuadMesh:
        """Return a mesh of this position as it is in the picture, which has `shape`."""
        placed = replace(mesh, points=self.points_back(mesh.points, shape))
        if not self.swaps_hands:
            return placed
        return _with_hands(replace(placed, quads=mesh.quads[:, [0, 3, 2, 1]]))


TURNS = tuple(Turn(*flags) for flags in product((False, True), repeat=3))
SQUARE_ON = TURNS[:4]  #: those that leave rows rows


def turn_of_image(image: LabelImage, policy: str) -> Turn:
    """Return `turn_of_picture`; the position it has where a diagonal of the picture means something."""
    return Turn() if policy == "diagonal" else turn_of_picture(image.labels)


def turn_of_picture(pixels: NDArray[P]) -> Turn:
    """Return the position in which the picture comes first, read row by row; the lying one of an oblong picture."""
    n_rows, n_cols = pixels.shape[:2]
    left = {turn: turn.picture(pixels) for turn in TURNS if turn.transposed == (n_rows > n_cols) or n_rows == n_cols}
    for row in range(min(n_rows, n_cols)):
        rows = {turn: picture[row].tobytes() for turn, picture in left.items()}
        first = min(rows.values())
        left = {turn: left[turn] for turn, text in rows.items() if text == first}
        if len(left) == 1:
            break
    return next(iter(left))


def turn_of_graph(graph: BoundaryGraph, turns: Iterable[Turn] = TURNS) -> Turn:
    """Return the position that the boundaries were extracted in, which the order of the picture's corners tells.

    Where these do not tell (void lies at them) it is the position in which the sum of a hash of all points is least.
    """
    rows, cols = graph.shape
    used = np.zeros(len(graph.points), bool)
    used[graph.chain_points] = True
    x, y = graph.points.T
    corners = graph.points[used & ((x == 0) | (x == cols)) & ((y == 0) | (y == rows))]
    falls = {turn: _falls(turn.points(corners, graph.shape)) for turn in turns}
    left = [turn for turn in falls if falls[turn] == min(falls.values())]
    if len(left) == 1:
        return left[0]
    order = np.arange(len(graph.points), dtype=np.uint64) * _MIX[2]
    return min(left, key=lambda turn: _hash(turn.points(graph.points, graph.shape), order))


def _falls(corners: Floats) -> int:
    """Return how many corners of a picture stand behind one that comes later in reading order."""
    place = 2 * (corners[:, 1] == 0) + (corners[:, 0] > 0)
    return int(np.count_nonzero(np.diff(place) < 0))


def _hash(points: Floats, order: NDArray[np.uint64]) -> int:
    x, y = np.rint(points.T * _FINE).astype(np.int64).view(np.uint64)
    mixed = x * _MIX[0] + y * _MIX[1] + order
    mixed = (mixed ^ mixed >> np.uint64(29)) * _MIX[1]
    return int((mixed ^ mixed >> np.uint64(32)).sum(dtype=np.uint64))


def _transposed(points: Floats, shape: tuple[int, int]) -> Floats:
    """Mirror points at the diagonal through the upper left corner: rows become columns."""
    return np.stack([shape[0] - points[:, 1], shape[1] - points[:, 0]], axis=1)


def _with_hands(value: T) -> T:
    """Run through all chains the other way, so that the region on the left stays there in a mirror."""
    return replace(value, chain_points=value.chain_points[_backwards(value.chain_offsets)])


def _backwards(offsets: Ints) -> Ints:
    """Return the places of chains in the opposite order of each."""
    lengths = np.diff(offsets)
    return np.asarray(np.repeat(offsets[:-1] + offsets[1:] - 1, lengths) - np.arange(offsets[-1]))
