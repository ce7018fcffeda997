"""Pictures with known truth."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from imgquad_core.model import LabelImage, Materials

Labels = NDArray[np.int32]


def label_image(labels: ArrayLike) -> LabelImage:
    """Make a label image of an array, with made-up names."""
    array = np.asarray(labels, np.int32)
    used = np.unique(array[array >= 0])
    return LabelImage(array, Materials(used, tuple(f"m{k}" for k in used), np.zeros((len(used), 3), np.uint8)))


def pixel_centres(n_rows: int, n_cols: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """x and y (up) of all pixel centres."""
    y, x = np.mgrid[:n_rows, :n_cols]
    return x + 0.5, n_rows - y - 0.5


def disc(radius: float, centre: tuple[float, float], n: int) -> Labels:
    """Disc of material 1 in n x n pixels of material 0."""
    x, y = pixel_centres(n, n)
    return ((x - centre[0]) ** 2 + (y - centre[1]) ** 2 < radius**2).astype(np.int32)


def half_plane(degrees: float, through: tuple[float, float], n: int) -> Labels:
    """Material 1 on the left of a straight edge at an angle."""
    x, y = pixel_centres(n, n)
    t = np.radians(degrees)
    return ((y - through[1]) * np.cos(t) - (x - through[0]) * np.sin(t) > 0).astype(np.int32)


def square(side: float, degrees: float, centre: tuple[float, float], n: int) -> tuple[Labels, NDArray[np.float64]]:
    """Turned square of material 1, and its four corners."""
    x, y = pixel_centres(n, n)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    u, v = (x - centre[0]) * c + (y - centre[1]) * s, (y - centre[1]) * c - (x - centre[0]) * s
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * side / 2 @ np.array([[c, s], [-s, c]]) + centre
    return ((abs(u) < side / 2) & (abs(v) < side / 2)).astype(np.int32), corners


def wedge(degrees: float, turn: float, tip: ArrayLike, radius: float, n: int) -> Labels:
    """Sector of a disc around `tip`, from direction `turn` to ``turn + degrees``, of material 1."""
    x, y = pixel_centres(n, n)
    dx, dy = x - np.asarray(tip)[0], y - np.asarray(tip)[1]
    direction = (np.degrees(np.arctan2(dy, dx)) - turn) % 360.0
    return ((direction < degrees) & (np.hypot(dx, dy) < radius)).astype(np.int32)


def spiral(n: int) -> Labels:
    """One pixel wide spiral of material 1, its windings one pixel apart."""
    labels = np.zeros((n, n), np.int32)
    x, y, dx, dy, steps = 0, 0, 1, 0, 1
    labels[0, 0] = 1
    while steps:
        steps = 0
        while _is_free(labels, x + dx, y + dy) and not labels[y + dy, x + dx] and _stays_apart(labels, x, y, dx, dy):
            x, y, steps = x + dx, y + dy, steps + 1
            labels[y, x] = 1
        dx, dy = -dy, dx
    return labels


def _is_free(labels: Labels, x: int, y: int) -> bool:
    return 0 <= x < labels.shape[1] and 0 <= y < labels.shape[0]


def _stays_apart(labels: Labels, x: int, y: int, dx: int, dy: int) -> bool:
    return not _is_free(labels, x + 2 * dx, y + 2 * dy) or labels[y + 2 * dy, x + 2 * dx] == 0


def voronoi(n_rows: int, n_cols: int, n_cells: int, seed: int) -> Labels:
    """Nearest of `n_cells` random points, each a material."""
    x, y = pixel_centres(n_rows, n_cols)
    points = np.random.default_rng(seed).random((n_cells, 2)) * [n_cols, n_rows]
    return np.argmin((x[..., None] - points[:, 0]) ** 2 + (y[..., None] - points[:, 1]) ** 2, axis=-1).astype(np.int32)


def any_labels(seed: int) -> Labels:
    """Some picture of 1 to 30 px a side with 1 to 8 colours: noise, stripes, checkerboards, spirals, cells, void."""
    rng = np.random.default_rng(seed)
    (n_rows, n_cols), k = rng.integers(1, 31, 2), int(rng.integers(1, 9))
    x, y = pixel_centres(n_rows, n_cols)
    kind = rng.integers(0, 8)
    if kind == 1:
        return ((x + y) % 2 > 0.5).astype(np.int32)
    if kind == 2:
        return (x // rng.integers(1, 4) % k).astype(np.int32)
    if kind == 3:
        return (np.arange(n_rows * n_cols).reshape(n_rows, n_cols) == rng.integers(n_rows * n_cols)).astype(np.int32)
    if kind == 4:
        return spiral(max(n_rows, 3))
    if kind == 5:
        return rng.integers(0, k, [(1, n_cols), (n_rows, 1)][rng.integers(2)]).astype(np.int32)
    if kind == 6:
        return voronoi(n_rows, n_cols, k, seed)
    labels = rng.integers(-1 if kind == 7 else 0, k, (n_rows, n_cols)).astype(np.int32)
    labels.flat[0] = max(labels.flat[0], 0)
    return labels


KINDS = ("noise", "checkerboard", "stripes", "dots", "arms", "spiral", "line", "cells", "speckled", "void")


def labels_of_kind(kind: str, n_rows: int, n_cols: int, n_colors: int, seed: int) -> Labels:
    """Picture of one of `KINDS`; what is not told by the other arguments follows from the seed."""
    rng = np.random.default_rng([KINDS.index(kind), n_rows, n_cols, n_colors, seed])
    row, col = np.mgrid[:n_rows, :n_cols]
    if kind == "checkerboard":
        cell = rng.integers(1, 6)
        labels = (row // cell + col // cell) % n_colors
    elif kind == "stripes":
        labels = (row * rng.integers(0, 3) + col * rng.integers(0, 3)) // rng.integers(1, 5) % n_colors
    elif kind == "dots":
        labels = np.zeros((n_rows, n_cols))
        n = rng.integers(1, 12)
        labels[rng.integers(0, n_rows, n), rng.integers(0, n_cols, n)] = rng.integers(0, n_colors, n)
    elif kind == "arms":
        x, y = col - n_cols / 2, row - n_rows / 2
        labels = (np.arctan2(y, x) / np.pi + np.hypot(x, y) / rng.uniform(1.5, 6)) % 2 > 1
    elif kind == "spiral":
        labels = spiral(max(n_rows, n_cols, 3))[:n_rows, :n_cols]
    elif kind == "line":
        labels = rng.integers(0, n_colors, (n_rows, n_cols))[:1]
        labels = labels.T if rng.random() < 0.5 else labels
    elif kind in ("cells", "speckled"):
        labels = voronoi(n_rows, n_cols, int(rng.integers(1, 12)), seed) % n_colors
        hit = rng.random((n_rows, n_cols)) < (0.05 if kind == "speckled" else 0)
        labels = np.where(hit, rng.integers(0, n_colors, hit.shape), labels)
    else:
        labels = rng.integers(-1 if kind == "void" else 0, n_colors, (n_rows, n_cols))
        labels.flat[0] = max(labels.flat[0], 0)  # one pixel at least
    return np.ascontiguousarray(labels, np.int32)
