"""A drawn picture: grains of four minerals, cut by a vein, with pores and noise."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy
from numpy.typing import NDArray
from PIL import Image

PALETTE = ((222, 203, 164), (178, 116, 88), (120, 140, 150), (84, 92, 70), (245, 245, 240), (35, 45, 70))
VEIN, PORE = 4, 5


def rock_labels(columns: int = 420, rows: int = 280, grain: int = 52, noise: float = 0.01) -> NDArray[np.uint8]:
    """Return the materials of a rock, shape (rows, columns): minerals 0 to 3, a vein 4, pores 5.

    Parameters
    ----------
    columns, rows : int
        Size of the picture.
    grain : int
        Mean diameter of a grain, in pixels.
    noise : float
        Share of pixels of a wrong material.
    """
    rng = np.random.default_rng(1)
    x, y = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
    labels = _grains(rng, x, y, grain)
    bend = rows * (0.36 + 0.22 * x / columns) + 14 * np.sin(x / 47)
    labels[np.abs(y - bend) < 2.5 + 2.5 * np.sin(np.pi * x / columns)] = VEIN
    for cx, cy, radius in ((0.2, 0.75, 17), (0.57, 0.25, 22), (0.83, 0.68, 13), (0.64, 0.85, 8)):
        labels[np.hypot(x - cx * columns, y - cy * rows) < radius] = PORE
    wrong = rng.random(labels.shape) < noise
    labels[wrong] = rng.integers(0, len(PALETTE), np.count_nonzero(wrong))
    return labels


def draw_rock() -> Image.Image:
    """Return the picture of a rock, with its palette."""
    picture = Image.fromarray(rock_labels())
    picture.putpalette([value for color in PALETTE for value in color])  # the indices are the materials
    return picture


def small_pictures(columns: int, rows: int) -> Iterator[NDArray[np.uint8]]:
    """Give small pictures of a rock: labels, a photograph in grey, and colours."""
    labels = rock_labels(columns, rows, grain=24)
    yield labels
    noise = np.random.default_rng(0).normal(0, 6, labels.shape)
    yield (40 * labels + noise).clip(0, 255).astype(np.uint8)
    yield np.asarray(draw_rock().convert("RGB").crop((0, 0, columns, rows)))


def _grains(rng: np.random.Generator, x: NDArray[np.float64], y: NDArray[np.float64], grain: int) -> NDArray[np.uint8]:
    """Return minerals 0 to 3 of grains around jittered grid points, with wavy borders."""
    rows, cols = x.shape
    centres = np.stack(np.meshgrid(np.arange(-1, cols // grain + 2), np.arange(-1, rows // grain + 2)), axis=-1)
    seeds = (centres.reshape(-1, 2) + rng.uniform(0.1, 0.9, (centres.shape[0] * centres.shape[1], 2))) * grain
    wavy = np.stack([x + 4 * np.sin(y / 13), y + 4 * np.sin(x / 17)], axis=-1)
    nearest = scipy.spatial.cKDTree(seeds).query(wavy.reshape(-1, 2))[1].reshape(x.shape)
    return np.asarray(rng.integers(0, 4, len(seeds))[nearest], np.uint8)
