"""Do sizes, growth, stairs, joins and tolerances give what they promise? Prints the tables of docs/sizes.md.

    python benchmarks/sizes.py [--out docs/sizes.md] [--only WORD ...]

Each figure has a bar that it must not exceed, or not fall below. Times are CPU seconds, the least of some runs.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import Voronoi, cKDTree

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "docs"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from make_images import coast

from figure_tables import Limit, limit_table, put_into, table
from imgquad_core import MeshOptions
from imgquad_core import run as run_all
from imgquad_core.arrays import Floats, Labels
from imgquad_core.boundary import extract_boundaries, find_step
from imgquad_core.boundary.curves import pixel_chains
from imgquad_core.boundary.joins import join_short_chains
from imgquad_core.measures import quality_report
from imgquad_core.picture import AbsorbOptions, absorb_thin
from imgquad_core.pipeline import segment_source
from imgquad_core.reading import read_picture
from imgquad_mesh.outputs.rock_picture import rock_labels
from real_pictures import FOLDER, pictures_of
from rocks import rock
from size_field import field_integral
from support.labels import disc, label_image

REPEATS = 5  #: of what is timed
PERCENT = "{:.2%}"
STEEL, BRAIN, GEOLOGY, SANDSTONE, LAND_COVER = (
    "steel_duplex_ebsd_phase",
    "brain_labels_s01_axial",
    "geology_hamersley_west",
    "rock_sandstone_labels_2a",
    "landcover_nlcd_zion",
)
DISC = disc(20.0, (100.0, 100.0), 200)


class Found(NamedTuple):
    """What a mesh is judged by."""

    quads: int
    ratio: float  #: quads x size^2 / area
    per_field: float
    length: float  #: of the boundaries inside
    shortest: float
    min_sj: float
    mean_sj: float
    irregular: float


def row(where: str, figure: str, bar: float, found: float, form: str = "{:.2f}", at_most: bool = True) -> list[str]:
    """Return one line of the table."""
    return Limit(figure, bar, at_most).row(where, found, form)


def meshed(labels: Labels, **options: Any) -> Found:
    """Mesh a picture; return the figures."""
    asked = MeshOptions(**options)
    mesh = run_all(label_image(labels), asked).mesh
    ends = mesh.points[mesh.constraints]
    on_frame = (ends[:, 0] == ends[:, 1]) & ((ends[:, 0] == 0.0) | (ends[:, 0] == labels.shape[::-1]))
    inside = ~on_frame.any(axis=1)
    sides = np.hypot(*(mesh.points[np.roll(mesh.quads, -1, axis=1)] - mesh.points[mesh.quads]).transpose(2, 0, 1))
    shape = quality_report(mesh)
    sizes = asked.material_sizes or {}
    field = sum(
        field_integral(mesh.points, quads, mesh.constraints, sizes.get(int(m), asked.size), asked.growth)
        for m in np.unique(mesh.quad_material)
        for quads in [mesh.quads[mesh.quad_material == m]]
    )
    return Found(
        mesh.n_quads,
        mesh.n_quads * asked.size**2 / labels.size,
        mesh.n_quads / field,
        float(np.hypot(*(ends[inside, 1] - ends[inside, 0]).T).sum()),
        float(sides.min()),
        shape.min_sj,
        shape.mean_sj,
        shape.irregular,
    )


@cache
def values_of(picture: str) -> Labels:
    """Return a label picture, its values numbered from 0."""
    values = np.asarray(read_picture(FOLDER / f"{picture}.png").values)
    return np.unique(values, return_inverse=True)[1].reshape(values.shape).astype(np.int32)


def middle(picture: str, side: int) -> Labels:
    """Return the square in the middle of a picture, or all of a smaller one."""
    labels = values_of(picture)
    top, left = (max(n - side, 0) // 2 for n in labels.shape)
    return np.ascontiguousarray(labels[top : top + side, left : left + side])


def enlarged(labels: Labels, times: float) -> Labels:
    """Return the nearest data point of each pixel of a zoomed picture."""
    at = [np.floor((np.arange(int(n * times)) + 0.5) / times).astype(int) for n in labels.shape]
    return labels[np.ix_(*at)]


def grains(n_rows: int = 208, n_cols: int = 240, n: int = 18, seed: int = 11) -> Labels:
    """Return a map of grains: the nearest of random points."""
    seeds = np.random.default_rng(seed).uniform([0, 0], [n_cols, n_rows], (n, 2))
    y, x = np.mgrid[:n_rows, :n_cols] + 0.5
    return cKDTree(seeds).query(np.stack([x, y], axis=-1))[1].astype(np.int32)


def four_grains(n: int = 80) -> Labels:
    """Return four grains that meet in an X."""
    y, x = np.mgrid[:n, :n] + 0.5
    return np.where(x > y, np.where(x + y > n, 0, 1), np.where(x + y > n, 2, 3)).astype(np.int32)


def stairs() -> Iterator[list[str]]:
    """Maps whose data points are several pixels wide against the maps themselves."""
    maps = [middle(STEEL, 80), *(grains(80, 80, 20, seed) for seed in range(10))]
    for times in (2.0, 3.0, 4.0, 6.0, 2.5, 3.3):
        for what, some in (("steel", maps[:1]), ("ten maps of 20 grains", maps[1:])):
            ones = [meshed(labels, size=4.0) for labels in some]
            wide = [meshed(enlarged(labels, times), size=4.0 * times) for labels in some]
            quads = sum(w.quads for w in wide) / sum(o.quads for o in ones) - 1.0
            length = sum(w.length for w in wide) / times / sum(o.length for o in ones) - 1.0
            yield row(f"{what}, enlarged {times:g} times", "quads off", 0.05, abs(quads), PERCENT)
            yield row(f"{what}, enlarged {times:g} times", "length off", 0.01, abs(length), PERCENT)


def hexagons() -> Iterator[list[str]]:
    """Hexagonal data points: the length of the boundaries against the grains'."""
    for width in (4, 5, 6, 8):
        labels, truth = hexagonal(width)
        found = meshed(labels, size=4.0 * width).length / width
        yield row(f"hexagons of {width} px a step", "length off", 0.01, abs(found / truth - 1.0), PERCENT)


def hexagonal(width: int, n: int = 60) -> tuple[Labels, float]:
    """Return 25 grains drawn with hexagons of a width, and the true length of their boundaries in hexagons."""
    seeds = np.random.default_rng(0).uniform(0, n, (25, 2))
    row, column = np.mgrid[-1 : n + 2, -1 : n + 2]
    centres = np.stack([column + 0.5 * (row % 2) + 0.5, row + 0.5], axis=-1).reshape(-1, 2)
    flat = np.array([1.0, 0.866])  # rows are closer than columns
    y, x = np.mgrid[: int(n * width * flat[1]), : n * width] + 0.5
    nearest = cKDTree(centres * flat).query(np.stack([x.ravel(), y.ravel()], axis=1) / width)[1]
    labels = cKDTree(seeds).query(centres)[1][nearest].reshape(x.shape)
    return labels.astype(np.int32), voronoi_length(seeds, n, flat)


def voronoi_length(seeds: Floats, n: int, scale: Floats) -> float:
    """Return the length of the edges between the cells of points inside [0, n]^2, in a scale, by fine sampling."""
    far = 10.0 * n
    around = np.array([[-far, -far], [-far, far], [far, -far], [far, far]])
    voronoi = Voronoi(np.concatenate([seeds, around]))
    share = (np.arange(20_000) + 0.5) / 20_000
    length = 0.0
    for a, b in (pair for pair in voronoi.ridge_vertices if pair[0] >= 0):
        ends = voronoi.vertices[[a, b]]
        along = ends[0] + share[:, None] * (ends[1] - ends[0])
        inside = ((along > 0.0) & (along < n)).all(axis=1).mean()
        length += inside * float(np.hypot(*((ends[1] - ends[0]) * scale)))
    return length


def growth() -> Iterator[list[str]]:
    """How many more quads than the boundaries ask for."""
    cases: list[tuple[str, float, Labels, dict[str, Any]]] = [
        ("grains at 4", 1.25, grains(), {"size": 4.0}),
        ("grains at 16", 1.25, grains(), {"size": 16.0}),
        ("geology 400² at 4", 1.25, middle(GEOLOGY, 400), {"size": 4.0}),
        ("sandstone 400² at 8", 1.25, middle(SANDSTONE, 400), {"size": 8.0}),
        ("disc, 2 in it, 16 around it", 1.25, DISC, {"size": 16.0, "material_sizes": {1: 2.0}}),
        ("the same, growth 1.6", 1.3, DISC, {"size": 16.0, "material_sizes": {1: 2.0}, "growth": 1.6}),
        ("steel at 4", 1.35, middle(STEEL, 999), {"size": 4.0}),
        ("brain at 4", 1.35, middle(BRAIN, 999), {"size": 4.0}),
        ("grains at 16, growth 1.6", 1.3, grains(), {"size": 16.0, "growth": 1.6}),
        ("grains at 16, growth 2", 1.3, grains(), {"size": 16.0, "growth": 2.0}),
    ]
    for what, bar, labels, options in cases:
        yield row(what, "quads / field", bar, meshed(labels, **options).per_field)
    yield row("disc, 2 in it, 16 around it", "quads", 900, meshed(DISC, **cases[4][3]).quads, "{:.0f}")
    yield row(
        "disc, 2 on it, 16 on the frame", "quads", 700, meshed(DISC, size=16.0, boundary_size=2.0).quads, "{:.0f}"
    )


def joins() -> Iterator[list[str]]:
    """Four grains that meet in a point."""
    found = meshed(four_grains(), size=4.0)
    yield row("X of four grains at 4", "quads", 600, found.quads, "{:.0f}")
    yield row("X of four grains at 4", "shortest side, px", 1.0, found.shortest, at_most=False)


def tolerances() -> Iterator[list[str]]:
    """Meshes of pictures made simpler."""
    quads: list[tuple[str, float, float, float, Labels]] = [
        ("grains", 16.0, 8.0, 420, grains()),
        ("grains", 16.0, 16.0, 320, grains()),
        ("grains", 32.0, 16.0, 200, grains()),
        ("coast", 16.0, 8.0, 900, coast()),
        ("sandstone 800²", 16.0, 8.0, 3300, middle(SANDSTONE, 800)),
    ]
    ratios: list[tuple[str, float, float, Labels]] = [
        (what, size, bar, middle(name, side))
        for what, name, side, size, bar in (
            ("geology 800²", GEOLOGY, 800, 8.0, 1.3),
            ("geology 800²", GEOLOGY, 800, 16.0, 1.3),
            ("sandstone 800²", SANDSTONE, 800, 8.0, 1.3),
            ("sandstone 800²", SANDSTONE, 800, 16.0, 1.3),
            ("land cover 500²", LAND_COVER, 500, 16.0, 2.2),
        )
    ]
    worst = []
    for what, size, tolerance, most, labels in quads:
        found = meshed(labels, size=size, tolerance=tolerance)
        worst.append((found.min_sj, f"{what} at {size:g}, tolerance {tolerance:g}"))
        yield row(worst[-1][1], "quads", most, found.quads, "{:.0f}")
    for what, size, bar, labels in ratios:
        found = meshed(labels, size=size, tolerance=size)
        worst.append((found.min_sj, f"{what} at {size:g}, tolerance {size:g}"))
        yield row(worst[-1][1], "quads × size² / area", bar, found.ratio)
    yield row(f"worst of these: {min(worst)[1]}", "min SJ", 0.45, min(worst)[0], "{:.3f}", at_most=False)


def truth() -> Iterator[list[str]]:
    """Small circles around points anywhere in a pixel."""
    off, own = [], []
    for seed in range(20):
        cx, cy = 16.0 + np.random.default_rng(seed).random(2) - 0.5
        labels = disc(9.0, (cx, cy), 32)
        length = meshed(labels, size=1.5).length
        off.append(abs(length / (2.0 * np.pi * 9.0) - 1.0))
        own.append(abs(length / (2.0 * np.sqrt(np.pi * np.count_nonzero(labels))) - 1.0))
    yield row("20 circles of radius 9 at 1.5, mean", "length off", 0.005, float(np.mean(off)), PERCENT)
    yield row("20 circles of radius 9 at 1.5, worst", "length off", 0.005, max(off), PERCENT)
    yield row("the same, circles with the pixels' area, worst", "length off", 0.005, max(own), PERCENT)


def rocks() -> Iterator[list[str]]:
    """Grains of 48 px in 1024², without and with veins, and the demo's picture."""
    clean = meshed(rock(1024, 48, 0, 0.0, 11).astype(np.int32), size=2.0)
    yield row("B1 at 2", "quads × size² / area", 1.02, clean.ratio, "{:.3f}")
    yield row("B1 at 2", "irregular", 0.008, clean.irregular, "{:.2%}")
    yield row("B1 at 2", "mean SJ", 0.98, clean.mean_sj, "{:.4f}", at_most=False)
    yield row("B1 at 2", "min SJ", 0.5, clean.min_sj, "{:.3f}", at_most=False)
    veined = meshed(rock(1024, 48, 4, 0.0, 11).astype(np.int32), size=2.0)
    yield row("B2 at 2", "irregular", 0.012, veined.irregular, "{:.2%}")
    demo = meshed(rock_labels().astype(np.int32), size=5.0, min_pixels=12, min_length=6)
    yield row("picture of `imgquad-mesh demo`", "quads", 8300, demo.quads, "{:.0f}")
    yield row("picture of `imgquad-mesh demo`", "min SJ", 0.55, demo.min_sj, "{:.3f}", at_most=False)


def times() -> Iterator[list[str]]:
    """What absorbing and joining cost."""
    for what, labels in (("B1", rock(1024, 48, 0, 0.0, 11).astype(np.int32)), ("sandstone", middle(SANDSTONE, 1024))):
        for tolerance in (8.0, 16.0):
            image = label_image(labels)
            spent = cpu_seconds(lambda image=image, t=tolerance: absorb_thin(image, AbsorbOptions(t)))
            yield row(f"{what}, {labels.size / 1e6:.2f} Mpx, tolerance {tolerance:g}", "CPU s of absorbing", 1.5, spent)
    chains = pixel_chains(extract_boundaries(label_image(grains(1024, 1024, 1700, 3))))
    spent = cpu_seconds(lambda: join_short_chains(chains, 2.0, 1.0))
    n = chains.graph.n_chains
    yield row(f"{n:,} chains, below 2 px", "CPU s of joining, per 5,000 chains", 0.3, spent * 5000 / n)


def cpu_seconds(make: Callable[[], object]) -> float:
    """Return the least CPU time of some runs, after one that compiles."""
    make()
    spent = []
    for _ in range(REPEATS):
        start = time.process_time()
        make()
        spent.append(time.process_time() - start)
    return min(spent)


def no_stairs() -> Iterator[list[str]]:
    """Pictures in which no data points of several pixels may be seen."""
    y, x = np.mgrid[:80, :80]
    made = [label_image((y // 4 + x // 4) % 2), label_image((x + y // 5 % 2 * 5) // 10 + y // 5 * 3)]
    real = [segment_source(read_picture(path)).image for path in pictures_of(FOLDER)]
    false = sum(find_step(extract_boundaries(image)) != (1.0, 1.0) for image in [*real, *made])
    yield row(f"{len(real)} real pictures, a chessboard, bricks", "false alarms of stairs", 0, false, "{:.0f}")


PARTS: dict[str, Callable[[], Iterable[list[str]]]] = {
    "stairs": stairs,
    "no stairs": no_stairs,
    "hexagons": hexagons,
    "growth": growth,
    "joins": joins,
    "tolerances": tolerances,
    "truth": truth,
    "rocks": rocks,
    "times": times,
}


def coasts() -> str:
    """Return the table of a coast at several tolerances."""
    tolerances = (0.0, 8.0, 16.0)
    quads = [f"{meshed(coast(), size=16.0, tolerance=t).quads:,}" for t in tolerances]
    titles = ["picture, size 16", "quads as it is", *(f"tolerance {t:g}" for t in tolerances[1:])]
    return table(titles, [["coast, 300 x 300", *quads]])


def kept() -> str:
    """Return the table of pictures of which everything is kept."""
    rows = []
    for what, name, size, tolerance in (
        ("brain", BRAIN, 8.0, 4.0),
        ("bone", "bone_trabecular_uct_0000", 16.0, 8.0),
        ("concrete with a crack", "concrete_crack_segmented", 16.0, 8.0),
        ("duplex steel", STEEL, 8.0, 4.0),
        ("battery electrode", "battery_nmc_cbd_labels", 8.0, 4.0),
    ):
        labels = segment_source(read_picture(FOLDER / f"{name}.png")).image.labels
        plain = meshed(labels, size=size)
        found = meshed(labels, size=size, tolerance=tolerance, keep=np.unique(labels).tolist())
        where = f"{what}, size {size:g}, tolerance {tolerance:g}"
        rows.append([where, f"{plain.quads:,}", f"{found.quads:,}", f"{found.min_sj:.2f}"])
    return table(["picture, everything kept", "quads as it is", "with tolerance", "min SJ"], rows)


def section(only: Iterable[str] = ()) -> str:
    """Return the table of bars."""
    wanted = set(only) or set(PARTS)
    return limit_table(line for name, part in PARTS.items() if name in wanted for line in part())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, metavar="PAGE", help="page that holds the marks")
    parser.add_argument("--only", nargs="*", default=(), choices=list(PARTS), metavar="PART", help="some parts")
    given = parser.parse_args()
    tables = {"bars": section(given.only)} | ({} if given.only else {"coast": coasts(), "kept": kept()})
    for name, text in tables.items():
        print(text)
        if given.out:
            put_into(given.out, name, text)


if __name__ == "__main__":
    main()
