"""The rocks that are meshed: Voronoi grains of 48 px in 7 colours, B1 without veins, B2 with veins of 1 and 2.5 px.

    python benchmarks/rocks.py b1.png                 1024 x 1024 pixels
    python benchmarks/rocks.py b2.png --veins 4

Random numbers are a hash (splitmix64) of seed and index, so that the pictures hang on no library's generator.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial import cKDTree

Floats = NDArray[np.float64]
Labels = NDArray[np.uint8]

GRAIN = 48
MINERALS = 7  #: colours of grains, of uneven shares; the next colour is that of veins
MARGIN = 2  #: cells of grain centres around the picture
SOURCE = "Rocks: `python benchmarks/rocks.py b1.png` draws B1; `--veins 4` makes it B2."


def draw_rock(path: Path, side: int, *, veins: int = 0, noise: float = 0.0, seed: int = 11) -> Path:
    """Write a square picture of a rock; return `path`."""
    picture = Image.fromarray(rock(side, GRAIN, veins, noise, seed))
    picture.putpalette([value for k in range(16) for value in (37 * k % 256, 91 * k % 256, 151 * k % 256)])
    picture.save(path)
    return path


def rock(side: int, grain: int, veins: int, noise: float, seed: int) -> Labels:
    """Return the colours of a square rock: grains, some veins across, salt and pepper."""
    labels = _grains(side, grain, seed)
    for v in range(veins):
        labels[_vein(side, v, seed)] = MINERALS
    return _speckled(labels, noise, seed)


def uniform(seed: int, n: int) -> Floats:
    """Return n numbers in [0, 1): the upper 53 bits of splitmix64."""
    with np.errstate(over="ignore"):
        start = np.uint64((seed * 0xD1342543DE82EF95 + 0x632BE59BD9B4E019) % 2**64)
        z = start + np.uint64(0x9E3779B97F4A7C15) * np.arange(1, n + 1, dtype=np.uint64)
        for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
            z = (z ^ (z >> np.uint64(shift))) * np.uint64(factor)
        z ^= z >> np.uint64(31)
    return np.asarray((z >> np.uint64(11)) * 2.0**-53)


def _grains(side: int, grain: int, seed: int) -> Labels:
    """Colour each pixel like the nearest of jittered grid points."""
    n = -(-side // grain) + 2 * MARGIN + 1
    row, column = np.divmod(np.arange(n * n), n)
    centres = (
        np.stack([column, row], axis=1) - MARGIN + np.stack([uniform(seed + k, n * n) for k in (0, 1)], axis=1)
    ) * grain
    share = np.cumsum(np.arange(1, MINERALS + 1) ** -0.7)
    mineral = np.minimum(np.searchsorted(share / share[-1], uniform(seed + 2, n * n)), MINERALS - 1)
    y, x = np.mgrid[:side, :side] + 0.5
    return mineral[cKDTree(centres).query(np.stack([x, y], axis=-1))[1]].astype(np.uint8)


def _vein(side: int, v: int, seed: int) -> NDArray[np.bool_]:
    """Return the pixels of a winding band from side to side; every third one is one pixel wide, the others 2.5."""
    p = uniform(seed + 1000 + v, 5)
    t = np.arange(side) + 0.5
    wave = 0.04 * side * p[2] * np.sin(2 * np.pi * (1 + 3 * p[3]) * t / side + 6.28 * p[4])
    middle = side * (0.15 + 0.7 * p[0]) + (p[1] - 0.5) * 0.5 * (t - side / 2) + wave
    band = np.abs(t[:, None] - middle) <= (2.5 if v % 3 else 1.0) / 2
    return band if v % 2 == 0 else band.T


def _speckled(labels: Labels, noise: float, seed: int) -> Labels:
    """Give a share of pixels another colour."""
    hit = uniform(seed + 101, labels.size) < noise
    step = 1 + (uniform(seed + 102, labels.size) * MINERALS).astype(np.int64)
    wrong = (labels.ravel() + step) % (MINERALS + 1)
    return np.where(hit, wrong, labels.ravel()).astype(np.uint8).reshape(labels.shape)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("path", type=Path)
    parser.add_argument("--side", type=int, default=1024)
    parser.add_argument("--veins", type=int, default=0)
    parser.add_argument("--noise", type=float, default=0.0)
    parser.add_argument("--seed", type=int, default=11)
    asked = vars(parser.parse_args())
    draw_rock(asked.pop("path"), asked.pop("side"), **asked)
