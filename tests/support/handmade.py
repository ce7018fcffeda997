"""QuadMesh values made without the mesher: one quad a pixel ("staircase mesh"), nodes moved if wanted."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from imgquad_core.model import VOID, Materials, PointKind, QuadMesh

Floats = NDArray[np.float64]


def staircase(
    labels: ArrayLike, names: tuple[str, ...] | None = None, move: Callable[[Floats], Floats] | None = None
) -> QuadMesh:
    """One quad a pixel, in the order of the pixels; `move` displaces the nodes that are not on the border."""
    image = np.asarray(labels, np.int32)
    rows, cols = image.shape
    grid = np.arange((rows + 1) * (cols + 1)).reshape(rows + 1, cols + 1)
    y, x = np.divmod(np.arange(grid.size), cols + 1)
    points = np.stack([x, rows - y], axis=1).astype(float)
    corners = np.stack([grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:], grid[:-1, :-1]], axis=-1).reshape(-1, 4)
    regions, region_label = _regions(image)
    kept = image.ravel() != VOID
    kind, chains, sides = _chains(image, regions, grid)
    if move is not None:
        inner = (x > 0) & (x < cols) & (y > 0) & (y < rows)
        points[inner] += move(points[inner])
    used, new = np.unique(corners[kept], return_inverse=True)
    number = np.full(grid.size, -1)
    number[used] = np.arange(len(used))
    material = np.unique(image[image != VOID])
    return QuadMesh(
        points=points[used],
        point_kind=kind[used],
        quads=new.reshape(-1, 4),
        quad_region=regions.ravel()[kept],
        region_label=region_label,
        chain_offsets=np.cumsum([0] + [len(c) for c in chains]),
        chain_points=number[np.concatenate(chains)],
        chain_regions=np.array(sides),
        materials=Materials(material, names or tuple(f"m{m}" for m in material), np.zeros((len(material), 3))),
    )


def jiggle(points: Floats) -> Floats:
    """Move each node by up to 0.2, always in the same way."""
    x, y = points.T
    return 0.2 * np.stack([np.sin(12.9 * x + 78.2 * y), np.cos(39.3 * x + 11.1 * y)], axis=1)


def jiggle_beside(axis: int, *places: float) -> Callable[[Floats], Floats]:
    """`jiggle`, but what lies at `places` along `axis` stays there: flat interfaces."""

    def move(points: Floats) -> Floats:
        shift = jiggle(points)
        shift[np.isin(points[:, axis], places), axis] = 0
        return shift

    return move


def disk(n: int, radius: float, off: tuple[float, float] = (0.0, 0.0)) -> NDArray[np.int32]:
    """An n x n picture: 1 inside the circle about its centre (moved by `off`, y up), 0 outside."""
    at = np.arange(n) + 0.5 - n / 2
    return ((at[None, :] - off[0]) ** 2 + (at[::-1, None] - off[1]) ** 2 < radius**2).astype(np.int32)


def round_inclusion(n: int, radius: float, side: float, layers: int) -> QuadMesh:
    """A disk of `radius` (4 n nodes on its circle) in the middle of a square: a block inside, rings around it.

    ::

        o-------o    block of n x n quads inside the disk, `layers` rings from it to the circle,
        | (   ) |    2 x `layers` rings from the circle to the square
        o-------o
    """
    steps = np.linspace(-1, 1, n + 1)
    square = np.concatenate(
        [
            np.c_[steps[:-1], -np.ones(n)],
            np.c_[np.ones(n), steps[:-1]],
            np.c_[-steps[:-1], np.ones(n)],
            np.c_[-np.ones(n), -steps[:-1]],
        ]
    )
    angle = np.arctan2(-1, -1) + np.arange(4 * n) * np.pi / (2 * n)
    circle = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rings = [square * radius * 0.45 + (circle - square * radius * 0.45) * k / layers for k in range(1, layers + 1)]
    rings += [circle + (square * side / 2 - circle) * k / (2 * layers) for k in range(1, 2 * layers + 1)]
    block = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) * radius * 0.45
    grid = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    loops = [np.concatenate([grid[0, :-1], grid[:-1, -1], grid[-1, :0:-1], grid[:0:-1, 0]])]
    loops += [len(block) + np.arange(4 * n) + 4 * n * k for k in range(len(rings))]
    quads = [np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=-1).reshape(-1, 4)]
    quads += [np.stack([np.roll(o, -1), np.roll(i, -1), i, o], axis=1)[:, [3, 0, 1, 2]] for i, o in pairwise(loops)]
    region = np.repeat([1, 0], [n * n + layers * 4 * n, 2 * layers * 4 * n])
    kind = np.full(len(block) + 4 * n * len(rings), PointKind.INTERIOR, np.uint8)
    kind[loops[layers]], kind[loops[-1]], kind[loops[-1][::n]] = PointKind.FREE, PointKind.FRAME, PointKind.CORNER
    closed = [np.append(loop, loop[0]) for loop in (loops[-1], loops[layers])]
    return QuadMesh(
        points=np.concatenate([block, *rings]) + side / 2,
        point_kind=kind,
        quads=np.concatenate(quads),
        quad_region=region,
        region_label=[0, 1],
        chain_offsets=[0, 4 * n + 1, 8 * n + 2],
        chain_points=np.concatenate(closed),
        chain_regions=[[0, VOID], [1, 0]],
        materials=Materials([0, 1], ("matrix", "disk"), np.zeros((2, 3))),
    )


def _regions(image: NDArray[np.int32]) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Number of the 4-connected region of each pixel (VOID outside) and the label of each region."""
    regions = np.full(image.shape, VOID, np.int64)
    labels: list[int] = []
    for start in zip(*np.nonzero(image != VOID), strict=True):
        if regions[start] != VOID:
            continue
        stack = [start]
        regions[start] = len(labels)
        while stack:
            r, c = stack.pop()
            for p in ((r + 1, c), (r - 1, c), (r, c + 1), (r, c - 1)):
                inside = 0 <= p[0] < image.shape[0] and 0 <= p[1] < image.shape[1]
                if inside and image[p] == image[start] and regions[p] == VOID:
                    regions[p] = len(labels)
                    stack.append(p)
        labels.append(int(image[start]))
    return regions, np.array(labels, np.int32)


def _chains(
    image: NDArray[np.int32], regions: NDArray[np.int64], grid: NDArray[np.int64]
) -> tuple[NDArray[np.uint8], list[list[int]], list[tuple[int, int]]]:
    """Kind of each node, chains from junction to junction, region on their left and right."""
    padded = np.pad(regions, 1, constant_values=VOID)
    left_of: dict[tuple[int, int], int] = {}  # directed lattice edge -> region on its left
    around: dict[int, list[int]] = {}
    rows, cols = image.shape
    for r in range(rows + 1):
        for c in range(cols + 1):
            here = int(grid[r, c])
            if c < cols and padded[r, c + 1] != padded[r + 1, c + 1]:  # edge to the right: above | below
                there = int(grid[r, c + 1])
                left_of[here, there], left_of[there, here] = int(padded[r, c + 1]), int(padded[r + 1, c + 1])
                around.setdefault(here, []).append(there)
                around.setdefault(there, []).append(here)
            if r < rows and padded[r + 1, c] != padded[r + 1, c + 1]:  # edge downwards: right side | left side
                there = int(grid[r + 1, c])
                left_of[here, there], left_of[there, here] = int(padded[r + 1, c + 1]), int(padded[r + 1, c])
                around.setdefault(here, []).append(there)
                around.setdefault(there, []).append(here)
    frame = np.ones(grid.shape, bool)
    frame[1:-1, 1:-1] = False
    kind = np.full(grid.size, PointKind.INTERIOR, np.uint8)
    for node in around:
        kind[node] = PointKind.FRAME if frame.ravel()[node] else PointKind.FREE
        if len(around[node]) > 2:
            kind[node] = PointKind.JUNCTION
    for node in grid[[0, 0, -1, -1], [0, -1, 0, -1]]:
        if node in around:
            kind[node] = PointKind.CORNER
    return (kind, *_walk(around, left_of, kind))


def _walk(
    around: dict[int, list[int]], left_of: dict[tuple[int, int], int], kind: NDArray[np.uint8]
) -> tuple[list[list[int]], list[tuple[int, int]]]:
    chains, sides, seen = [], [], set[tuple[int, int]]()
    starts = [n for n in around if kind[n] == PointKind.JUNCTION] + list(around)
    for start in starts:
        for step in around[start]:
            if (start, step) in seen:
                continue
            chain = [start]
            here = step
            while True:
                seen |= {(chain[-1], here), (here, chain[-1])}
                chain.append(here)
                if here == start or kind[here] == PointKind.JUNCTION:
                    break
                ways = [n for n in around[here] if n != chain[-2]]
                here = ways[0]
            chains.append(chain)
            sides.append((left_of[chain[0], chain[1]], left_of[chain[1], chain[0]]))
    return chains, sides
