"""Segmentation measured on made pictures of known truth and on the real ones of ../shared/images.

    python benchmarks/segmentation.py [made] [kinds] [real] [guided] [speed] [same] [--seed 1] [--seeds 1] [--verbose]

Each part prints its figures and its bars, and whether they hold; without a part all but `same` run.

    made    fresh greys of every trouble: 95 % of the counts right, mean ARI 0.95 and worst 0.75, regions at most 1.2
            times those of the truth, shaded ones ARI 0.95
    kinds   label pictures of any type are labels, photographs are not; 0.05 s a megapixel of labels
    real    classes and regions of the real pictures that are raw
    guided  strokes on the photograph between crossed polars: ARI 0.45 from 5 strokes a mineral
    speed   CPU seconds and bytes a pixel: labels 0.05 s, grey 0.8 s, colour 1.3 s, 60 bytes
    same    2,000 random pictures give the same labels with one thread and with several
"""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from imgquad_core.model import LabelImage
from imgquad_core.picture.kinds import kind_of
from imgquad_core.picture.noise import automatic_limits, remove_noise
from imgquad_core.picture.options import SegmentationOptions
from imgquad_core.picture.segmentation import Segmentation, segment_picture
from imgquad_core.reading.formats import read_picture
from imgquad_core.reading.picture import picture_of

Labels = NDArray[np.int64]
Floats = NDArray[np.float64]
SIZE = 320
FOLDER = Path(__file__).resolve().parents[2] / "shared" / "images"


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
    shaded = index[[case.name.startswith("shaded") for case in cases(seed)]]
    bars = (
        bar("share of right counts", right.mean(), 0.95, most=False),
        bar("mean ARI", index.mean(), 0.95, most=False),
        bar("worst ARI", index.min(), 0.75, most=False),
        bar("worst ARI of shaded ones", shaded.min(), 0.95, most=False),
        bar("regions by those of the truth", regions.mean() / truth.mean(), 1.2),
    )
    return all(bars)


# -------------------------------------------------------------------------------------------------- the parts


def bar(what: str, value: float, limit: float, most: bool = True) -> bool:
    """Print a figure beside its bar; return whether it holds."""
    holds = value <= limit if most else value >= limit
    print(
        f"  {what}: {value:.3g} (bar: {'at most' if most else 'at least'} {limit:g}) {'holds' if holds else 'MISSED'}"
    )
    return holds


def kinds(seed: int) -> bool:
    """Tell made labels of all types, and the pictures of scikit-image, by kind."""
    from skimage import data

    random, wrong, n = np.random.default_rng(seed), [], 0
    for count in (2, 9, 40, 250, 600):
        labels = grains(random, count, count)
        types = [np.uint16, np.int32, np.float32] if count > 255 else [np.uint8, np.uint16, np.int16, np.float64]
        for dtype in types:
            wrong += [] if kind_of(picture_of(labels.astype(dtype))).is_labels else [f"{count} labels {dtype.__name__}"]
            n += 1
    raw = (
        "camera",
        "brick",
        "grass",
        "gravel",
        "cell",
        "coins",
        "moon",
        "page",
        "text",
        "astronaut",
        "coffee",
        "chelsea",
    )
    for name in raw:
        wrong += [name] if kind_of(picture_of(getattr(data, name)())).is_labels else []
    print(f"kinds: {n + len(raw)} pictures, wrong: {', '.join(wrong) or 'none'}")
    return not wrong


def real() -> bool:
    """Segment the real pictures; of raw ones print what comes out."""
    for path in sorted(p for p in FOLDER.glob("*") if p.suffix in (".png", ".jpg")):
        found = segment_picture(read_picture(path))
        if found.quantised:
            print(f"  {path.stem:28} regions {n_regions(cleaned(found).labels):5}  {found.note}")
            print("".join(f"    {text}\n" for text in found.warnings), end="")
    return True


def guided(seed: int) -> bool:
    """Grow minerals from strokes at random places of their grains; the mean of five draws counts."""
    if not FOLDER.is_dir():
        return True
    photograph = np.asarray(read_picture(FOLDER / "rock_sandstone_xpl_2a.jpg").values)[::2, ::2]
    truth = np.asarray(read_picture(FOLDER / "rock_sandstone_labels_2a.png").values, np.int64)[::2, ::2]
    means = []
    for strokes in (5, 15, 30):
        indices = [
            rand_index(segment_picture(photograph, SegmentationOptions(marks=marks)).image.labels, truth)
            for marks in (stroked(np.random.default_rng(seed + k), truth, strokes) for k in range(5))
        ]
        means.append(float(np.mean(indices)))
        print(f"guided: {strokes} strokes a mineral, ARI {', '.join(f'{i:.2f}' for i in indices)}")
    return bar("mean ARI from 5 strokes", means[0], 0.45, most=False)


def stroked(random: np.random.Generator, truth: Labels, n: int) -> NDArray[np.int32]:
    """Draw straight strokes 3 pixels wide and up to 40 long, n in each material, that stay inside it."""
    marks = np.zeros(truth.shape, np.int32)
    for value in np.unique(truth):
        inside = ndimage.binary_erosion(truth == value, iterations=2)
        places = np.argwhere(inside)
        for r, c in places[random.integers(0, len(places), n)]:
            angle = random.uniform(0, np.pi)
            steps = np.arange(40)[:, None] * (np.sin(angle), np.cos(angle))
            line = np.rint(np.array([r, c]) + steps).astype(int).clip(0, np.array(truth.shape) - 1)
            left = ~np.logical_and.accumulate(inside[line[:, 0], line[:, 1]])
            line = line[: int(left.argmax()) if left.any() else len(line)]
            for dr, dc in ((0, 0), (0, 1), (1, 0), (0, -1), (-1, 0)):
                marks[line[:, 0] + dr, line[:, 1] + dc] = value + 1
    return marks


def speed(seed: int) -> bool:
    """Measure CPU seconds and traced bytes a pixel on pictures of 4 megapixels."""
    random = np.random.default_rng(seed)
    labels = np.kron(grains(random, 200, 200), np.ones((6, 6), np.int64))
    grey = byte(np.linspace(40, 210, 5)[labels % 5] + random.normal(0, 6, labels.shape))
    shades = random.uniform(30, 225, (6, 3))[labels % 6]
    colour = byte(shades + random.normal(0, 6, shades.shape))
    held = []
    for name, picture, limit in (
        ("labels", labels.astype(np.uint16), 0.05),
        ("grey", grey, 0.8),
        ("colour", colour, 1.3),
    ):
        segment_picture(picture[:400, :400])  # kernels are compiled
        start = process_time()
        segment_picture(picture)
        seconds = (process_time() - start) / labels.size * 1e6
        tracemalloc.start()
        segment_picture(picture)
        peak = tracemalloc.get_traced_memory()[1] / labels.size
        tracemalloc.stop()
        held += [bar(f"{name}, s/Mpx", seconds, limit), bar(f"{name}, bytes a pixel", peak, 60)]
    return all(held)


def same(seed: int, n: int = 2000) -> bool:
    """Segment random pictures in processes of one and of several threads; compare what comes out."""
    sums = []
    for threads in ("1", "3"):
        names = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
        code = f"import segmentation; print(segmentation.digest({seed}, {n}))"
        run = subprocess.run(
            [sys.executable, "-c", code], cwd=Path(__file__).parent, env=os.environ | dict.fromkeys(names, threads),
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        sums.append(run.stdout.strip())
    print(f"same: {n} pictures, labels {sums[0][:16]} with 1 thread, {sums[1][:16]} with 3")
    return sums[0] == sums[1]


def digest(seed: int, n: int) -> str:
    """Return a check sum of the labels of n random pictures: labels, greys, colours, floats, with void."""
    random, found = np.random.default_rng(seed), hashlib.sha256()
    for k in range(n):
        rows, cols = random.integers(8, 90, 2)
        truth = np.kron(random.integers(0, random.integers(1, 7), (rows // 8 + 1, cols // 8 + 1)), np.ones((8, 8), int))
        picture: NDArray[np.generic] = truth[:rows, :cols].astype(np.uint8)
        if k % 4:
            channels = 3 if k % 4 == 2 else 1
            means = random.uniform(0, 255, (7, channels))
            noisy = means[picture] + random.normal(0, random.uniform(0, 30), (rows, cols, channels))
            picture = byte(noisy) if k % 4 < 3 else np.where(random.random((rows, cols)) < 0.02, np.nan, noisy[..., 0])
        found.update(segment_picture(picture).image.labels.tobytes())
    return found.hexdigest()


def _every(held: Iterator[bool]) -> bool:
    """Whether all hold; none is left out because one before it does not."""
    return all(list(held))


def main() -> int:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", help="made, kinds, real, guided, speed, same")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=1, help="of made: how many seeds from --seed on")
    parser.add_argument("--verbose", action="store_true", help="of made: a line for each picture")
    args = parser.parse_args()
    parts: dict[str, Callable[[], bool]] = {
        "made": lambda: _every(table_of_made(args.seed + k, args.verbose) for k in range(args.seeds)),
        "kinds": lambda: kinds(args.seed),
        "real": real,
        "guided": lambda: guided(args.seed),
        "speed": lambda: speed(args.seed),
        "same": lambda: same(args.seed),
    }
    unknown = set(args.parts) - set(parts)
    if unknown:
        parser.error(f"no part is called {', '.join(sorted(unknown))}: give {', '.join(parts)}")
    return 0 if _every(parts[name]() for name in args.parts or list(parts)[:-1]) else 1


if __name__ == "__main__":
    sys.exit(main())
