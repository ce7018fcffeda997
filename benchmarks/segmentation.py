"""Segmentation measured on made pictures of known truth and on the real ones of ../shared/images.

    python benchmarks/segmentation.py [--seed 1] [--kinds] [--real] [--guided] [--speed]

Without an option: fresh greys of every trouble. Bars: 95 % of the counts right, mean ARI 0.95, worst 0.75, mean number
of regions at most 1.2 times that of the truth.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from time import process_time

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from imgquad_core.model import LabelImage
from imgquad_core.picture.noise import automatic_limits, remove_noise
from imgquad_core.picture.segmentation import Segmentation, segment_picture

Labels = NDArray[np.int64]
Floats = NDArray[np.float64]
SIZE = 320


@dataclass(frozen=True)
class Case:
    """A picture of known truth."""

    name: str
    picture: NDArray[np.uint8]
    truth: Labels


# ------------------------------------------------------------------------------------------------- pictures


def blobs(random: np.random.Generator, n: int) -> Labels:
    """Phases as level sets of one smooth random field: bands of a phase narrow down to a pixel."""
    field = ndimage.gaussian_filter(random.normal(size=(SIZE, SIZE)), 4.0 + 3.0 * n)
    shares = random.uniform(0.6, 1.4, n).cumsum()
    return np.searchsorted(np.quantile(field, shares[:-1] / shares[-1]), field)


def grains(random: np.random.Generator, n: int, count: int = 60) -> Labels:
    """Voronoi grains, each of one of n phases."""
    centres = random.random((count, 2)) * SIZE
    phase = np.concatenate([np.arange(n), random.integers(0, n, count - n)])
    nearest = cKDTree(centres).query(np.argwhere(np.ones((SIZE, SIZE), bool)))[1]
    return np.asarray(phase[nearest].reshape(SIZE, SIZE))


def discs(random: np.random.Generator, n: int) -> Labels:
    """Discs of n - 1 phases in a matrix."""
    y, x = np.mgrid[:SIZE, :SIZE]
    truth = np.zeros((SIZE, SIZE), np.int64)
    for k in range(40):
        r, (cy, cx) = random.uniform(6, 32), random.random(2) * SIZE
        truth[(y - cy) ** 2 + (x - cx) ** 2 < r * r] = 1 + k % max(n - 1, 1)
    return truth


def veins(random: np.random.Generator, width: float) -> Labels:
    """Sinuous veins in a matrix."""
    y, x = np.mgrid[:SIZE, :SIZE]
    truth = np.zeros((SIZE, SIZE), np.int64)
    for k in range(5):
        at = SIZE * (0.1 + 0.2 * k) + 12 * np.sin(x / random.uniform(20, 60) + 6 * random.random())
        truth[np.abs(y + random.uniform(-0.4, 0.4) * x - at) < width / 2] = 1
    return truth


def shades(random: np.random.Generator, truth: Labels) -> tuple[Floats, float]:
    """Give phases greys in any order; return the picture and the least step."""
    n = int(truth.max()) + 1
    greys = np.linspace(40, 215, n) + random.uniform(-0.12, 0.12, n) * 175 / max(n - 1, 1)
    step = float(np.diff(greys).min()) if n > 1 else 80.0
    return greys[random.permutation(n)][truth], step


def shade(random: np.random.Generator, contrast: float) -> Floats:
    """Uneven light of a total range `contrast`."""
    y, x = (np.mgrid[:SIZE, :SIZE] + 0.5) / SIZE * 2 - 1
    a, b = random.uniform(0, 2 * np.pi), random.uniform(-0.6, 0.6)
    light = np.cos(a) * x + np.sin(a) * y + b * (x * x + y * y)
    return np.asarray((light - light.mean()) * contrast / np.ptp(light))


def byte(values: Floats) -> NDArray[np.uint8]:
    """Round to bytes."""
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def cases(seed: int) -> Iterator[Case]:
    """Give 72 pictures, drawn anew from a seed."""
    random = np.random.default_rng(seed)
    makers = (blobs, grains, discs)
    for k in range(30):
        snr = (8.0, 4.0, 2.0)[k % 3]
        n = int(random.integers(2, {8.0: 9, 4.0: 7, 2.0: 5}[snr]))
        truth = makers[k // 3 % 3](random, n)
        grey, step = shades(random, truth)
        grey = ndimage.gaussian_filter(grey, random.choice([0.0, 0.7, 1.0]))
        yield Case(f"snr {snr:g}, {n} phases", byte(grey + random.normal(0, step / snr, grey.shape)), truth)
    for k in range(6):
        snr, n = (1.0, 1.5)[k % 2], 2 + k // 2 % 2
        truth = makers[k % 3](random, n)
        grey, step = shades(random, truth)
        yield Case(f"snr {snr:g}, {n} phases", byte(grey + random.normal(0, step / snr, grey.shape)), truth)
    for k in range(10):
        n = 2 + k % 3
        truth = makers[k % 3](random, n)
        grey, step = shades(random, truth)
        part = random.uniform(0.3, 1.0)
        grey = 0.6 * (grey - 128) + 128 + shade(random, 0.6 * part * step)
        yield Case(f"shaded {part:.0%}, {n} phases", byte(grey + random.normal(0, 0.6 * step / 8, grey.shape)), truth)
    for k in range(4):
        truth = veins(random, (4.0, 1.0)[k % 2])
        grey = np.where(truth > 0, 70.0, 170.0) + random.normal(0, 100 / 8, truth.shape)
        yield Case(f"veins of {(4.0, 1.0)[k % 2]:g} px", byte(grey), truth)
    for k in range(22):
        yield _other(random, k, makers[k % 3])


def _other(random: np.random.Generator, k: int, maker: object) -> Case:
    n = int(random.integers(2, 6))
    kind = ("clean", "blur 2", "poisson", "speckle", "correlated", "small grains", "rare", "sharp 16 bit")[k % 8]
    truth = grains(random, n, 400) if kind == "small grains" else maker(random, n)  # type: ignore[operator]
    if kind == "rare":
        truth = np.zeros((SIZE, SIZE), np.int64)
        truth[: SIZE // 2] = 1
        y, x = np.mgrid[:SIZE, :SIZE]
        for _ in range(4):
            cy, cx = random.integers(20, SIZE - 20, 2)
            truth[(y - cy) ** 2 + (x - cx) ** 2 < 25] = 2
        grey, step = np.array([60.0, 120.0, 220.0])[truth], 60.0
    else:
        grey, step = shades(random, truth)
    if kind == "blur 2":
        grey = ndimage.gaussian_filter(grey, 2.0)
    noise = random.normal(0, step / 6, grey.shape)
    if kind == "clean":
        noise = random.normal(0, 1.0, grey.shape)
    elif kind == "poisson":
        photons = 9.0 * 215 / step**2 * grey  # noise is a third of a step where it is brightest
        noise = (random.poisson(photons) - photons) * grey / photons
    elif kind == "speckle":
        noise = grey * random.normal(0, step / 6 / 215, grey.shape)
    elif kind == "correlated":
        noise = ndimage.gaussian_filter(noise, 0.7)
        noise *= step / 6 / noise.std()
    return Case(f"{kind}, {int(truth.max()) + 1} phases", byte(grey + noise), truth)


# ------------------------------------------------------------------------------------------------- measures


def rand_index(a: NDArray[np.integer], b: NDArray[np.integer]) -> float:
    """Return the adjusted Rand index of two label pictures (Hubert and Arabie 1985, doi:10.1007/BF01908075)."""
    _, a = np.unique(a, return_inverse=True)
    _, b = np.unique(b, return_inverse=True)
    a, b = a.ravel(), b.ravel()
    table = np.bincount(a * (int(b.max()) + 1) + b)

    def pairs(counts: NDArray[np.integer]) -> float:
        return float((counts.astype(float) * (counts - 1) / 2).sum())

    both, of_a, of_b = pairs(table), pairs(np.bincount(a)), pairs(np.bincount(b))
    expected = of_a * of_b / (len(a) * (len(a) - 1) / 2)
    middle = (of_a + of_b) / 2
    return (both - expected) / (middle - expected) if middle != expected else 1.0


def n_regions(labels: NDArray[np.integer]) -> int:
    """Count regions, connected over sides."""
    return sum(ndimage.label(labels == value)[1] for value in np.unique(labels))


def cleaned(found: Segmentation) -> LabelImage:
    """Remove noise as the pipeline does."""
    return remove_noise(found.image, automatic_limits(found.quantised, found.image.shape))


# --------------------------------------------------------------------------------------------------- tables


def table_of_made(seed: int, verbose: bool) -> bool:
    """Print the figures of the fresh greys; return whether the bars hold."""
    rows = []
    for case in cases(seed):
        start = process_time()
        found = segment_picture(case.picture)
        seconds = process_time() - start
        labels = cleaned(found).labels
        n, n_true = len(found.image.materials.labels), len(np.unique(case.truth))
        index = rand_index(labels, case.truth)
        rows.append((n == n_true, index, n_regions(labels), n_regions(case.truth), seconds / case.truth.size * 1e6))
        if verbose or n != n_true:
            print(
                f"{case.name:24} {n} of {n_true}  ARI {index:.3f}  regions {rows[-1][2]} of {rows[-1][3]}  {found.note}"
            )
    right, index, regions, truth, speed = (np.array(column, float) for column in zip(*rows, strict=True))
    print(
        f"seed {seed}: {len(rows)} pictures, {right.mean():.1%} right, ARI mean {index.mean():.3f} worst "
        f"{index.min():.3f}, regions {regions.mean():.0f} of {truth.mean():.0f}, {np.median(speed):.2f} s/Mpx"
    )
    bars = right.mean() >= 0.95, index.mean() >= 0.95, index.min() >= 0.75, regions.mean() <= 1.2 * truth.mean()
    return all(bars)


def main() -> int:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=1, help="how many seeds from --seed on")
    parser.add_argument("--verbose", action="store_true")
    args = parser.parse_args()
    held = [table_of_made(seed, args.verbose) for seed in range(args.seed, args.seed + args.seeds)]
    return 0 if all(held) else 1


if __name__ == "__main__":
    sys.exit(main())
