"""How good is a mesh in tiles beside that of the picture as a whole, and what does it cost? Prints a table.

    python benchmarks/large.py                       disks, geology, land cover, grains of 1,024 x 1,024 px
    python benchmarks/large.py --only map.png        a picture of flat colours
    python benchmarks/large.py --side 4096 --tile 2048 --workers 2
    python benchmarks/large.py --side 16384 --tile 4096 --workers 1 2 --threads 1 --no-whole --only disks

Irregular nodes and scaled Jacobians are those within 40 px of where tiles meet ("band"), against all others, and
against the same places of the picture meshed as a whole. Seconds are CPU seconds of all processes.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from imgquad_core import MeshOptions, QuadMesh, mesh_image
from imgquad_core.measures.quality import scaled_jacobian
from imgquad_core.model import PointKind
from imgquad_mesh.large import TiledMesh, mesh_tiles

NEAR = 40.0  # px
SIZE = 4.0


def disks(side: int) -> np.ndarray:
    """One matrix with discs of 6 to 34 px radius, drawn in cells so that none of them touch."""
    labels = np.zeros((side, side), np.uint8)
    cell = 80
    rng = np.random.default_rng(1)
    for top in range(0, side, cell):
        for left in range(0, side, cell):
            radius = rng.uniform(6, 34)
            row, column = top + rng.uniform(radius, cell - radius), left + rng.uniform(radius, cell - radius)
            part = labels[top : top + cell, left : left + cell]
            y, x = np.indices(part.shape)
            part[np.hypot(x + left + 0.5 - column, y + top + 0.5 - row) < radius] = 1
    return labels


def geology(side: int) -> np.ndarray:
    """Folded layers cut by a fault: map units that cross the whole picture."""
    y, x = np.mgrid[:side, :side].astype(np.float32)
    bent = y + 0.06 * side * np.sin(x / (0.11 * side)) + 0.02 * side * np.sin(x / (0.037 * side) + 1.0)
    bent = bent + 0.07 * side * (x > 0.55 * side + 0.15 * y)
    edges = np.cumsum(np.random.default_rng(2).uniform(0.03, 0.16, 12)) * side
    return (np.searchsorted(edges, bent.ravel()).reshape(bent.shape) % 7).astype(np.uint8)


def land_cover(side: int) -> np.ndarray:
    """Patches of all sizes: classes of a smooth random surface."""
    from scipy.ndimage import gaussian_filter

    rng = np.random.default_rng(3)
    surface = np.zeros((side, side), np.float32)
    for width in (8.0, 24.0, 72.0):
        surface += width * gaussian_filter(rng.standard_normal((side, side), dtype=np.float32), width)
    bounds = np.quantile(surface, (0.2, 0.45, 0.6, 0.85))
    return np.searchsorted(bounds, surface.ravel()).reshape(side, side).astype(np.uint8)


def grains(side: int) -> np.ndarray:
    """Cells of points at random, some 80 px wide, of seven materials."""
    from scipy.spatial import cKDTree

    rng = np.random.default_rng(4)
    points = rng.uniform(0, side, (max(side * side // 6100, 2), 2))
    material = rng.integers(0, 7, len(points)).astype(np.uint8)
    pixels = np.indices((side, side)).reshape(2, -1).T + 0.5
    return material[cKDTree(points).query(pixels)[1]].reshape(side, side)


def drawn(path: Path) -> np.ndarray:
    """A picture of flat colours as labels."""
    from imgquad_core.reading import ReadOptions, read_picture

    values = np.asarray(read_picture(path, ReadOptions()).values)
    flat = values.reshape(values.shape[0] * values.shape[1], -1)
    return np.unique(flat, axis=0, return_inverse=True)[1].reshape(values.shape[:2]).astype(np.uint8)


KINDS = {"disks": disks, "geology": geology, "land cover": land_cover, "grains": grains}


@contextmanager
def seconds() -> Iterator[dict[str, float]]:
    """Measure CPU seconds of this process and those it has waited for, and wall clock."""
    found: dict[str, float] = {}
    before, start = os.times(), perf_counter()
    yield found
    after = os.times()
    found["cpu"] = sum(after[:4]) - sum(before[:4])
    found["wall"] = perf_counter() - start


def near_seams(points: np.ndarray, shape: tuple[int, int], tile: int) -> np.ndarray:
    """Tell the places near a line where tiles meet."""
    found = np.zeros(len(points), bool)
    for values, last in ((points[:, 0], shape[1]), (shape[0] - points[:, 1], shape[0])):
        line = np.rint(values / tile) * tile
        found |= (np.abs(values - line) <= NEAR) & (line > 0) & (line < last)
    return found


def figures(mesh: QuadMesh, shape: tuple[int, int], tile: int) -> dict[str, float]:
    """Return irregular nodes, mean and least scaled Jacobian in the band and elsewhere."""
    points = np.asarray(mesh.points)
    near, inner = near_seams(points, shape, tile), mesh.point_kind == PointKind.INTERIOR
    irregular = mesh.valence != 4
    sj = scaled_jacobian(points, mesh.quads)
    in_band = near_seams(points[mesh.quads].mean(axis=1), shape, tile)
    return {
        "quads": mesh.n_quads,
        "irr_band": float(irregular[inner & near].mean()),
        "irr_else": float(irregular[inner & ~near].mean()),
        "mean_band": float(sj[in_band].mean()),
        "min_band": float(sj[in_band].min()),
        "min_else": float(sj[~in_band].min()),
    }


def cracks(mesh: QuadMesh, shape: tuple[int, int]) -> tuple[float, int, int, int]:
    """Return area error, Euler characteristic, edges of more than two quads, single edges off the frame."""
    quads, points = mesh.quads, np.asarray(mesh.points)
    edges = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    _, first, count = np.unique(edges[:, 0] * mesh.n_points + edges[:, 1], return_index=True, return_counts=True)
    middle = points[edges[first[count == 1]]].mean(axis=1)
    frame = ((middle == 0) | (middle == shape[::-1])).any(axis=1)
    p = points[quads]
    x, y = p[..., 0], p[..., 1]
    area = 0.5 * ((x[:, 2] - x[:, 0]) * (y[:, 3] - y[:, 1]) - (x[:, 3] - x[:, 1]) * (y[:, 2] - y[:, 0])).sum()
    euler = mesh.n_points - len(count) + mesh.n_quads
    return area - shape[0] * shape[1], euler, int((count > 2).sum()), int((~frame).sum())


def measure(kind: str, args: argparse.Namespace, workers: int) -> dict[str, Any]:
    """Mesh a picture in tiles and as a whole."""
    how = MeshOptions(size=SIZE, threads=args.threads)
    labels = drawn(Path(kind)) if kind.endswith(".png") else KINDS[kind](args.side)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.npy"
        np.save(path, labels)
        with seconds() as tiled_time:
            made: TiledMesh = mesh_tiles(
                path, Path(folder) / "out", how, tile=args.tile, keep_whole=args.keep_whole, workers=workers
            )
        report = made.report
        row: dict[str, Any] = {
            "picture": kind,
            "workers": workers,
            "report": report["quality"],
            "regions": report["regions"],
            "tiled": tiled_time,
        }
        if not args.no_whole:
            mesh = made.mesh()
            row |= {"conforming": cracks(mesh, labels.shape), "in_tiles": figures(mesh, labels.shape, args.tile)}
            with seconds() as whole_time:
                whole = mesh_image(labels, how)
            row |= {"as_whole": figures(whole, labels.shape, args.tile), "whole": whole_time}
    return row


def line(row: dict[str, Any]) -> str:
    """Return a line of the table."""
    if "in_tiles" not in row:
        cpu, wall = row["tiled"]["cpu"], row["tiled"]["wall"]
        told = f"{row['report']['n_quads']} quads, min SJ {row['report']['min_sj']:.3f}"
        return f"| {row['picture']}, {row['workers']} workers | {told} | {cpu:.0f} CPU s, {wall:.0f} s by the clock |"
    a, b = row["in_tiles"], row["as_whole"]
    error, euler, shared, off = row["conforming"]
    cells = (
        row["picture"],
        f"{error:.1e}, {euler}, {shared}, {off}",
        f"{b['quads']} → {a['quads']} ({a['quads'] / b['quads'] - 1:+.1%})",
        f"{a['irr_band']:.2%} / {a['irr_else']:.2%} (whole {b['irr_band']:.2%})",
        f"{a['mean_band']:.4f} ({b['mean_band']:.4f})",
        f"{a['min_band']:.3f} / {a['min_else']:.3f} ({b['min_band']:.3f})",
        f"{row['tiled']['cpu']:.1f} / {row['whole']['cpu']:.1f}",
    )
    return f"| {' | '.join(cells)} |"


HEAD = (
    "| picture | area error, Euler, > 2, off frame | quads whole → tiles | irregular band / else | mean SJ band "
    "| min SJ band / else | CPU s |\n|---|---|---|---|---|---|---|"
)


def main() -> None:
    """Print the table; append the figures as JSON lines where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--side", type=int, default=1024)
    parser.add_argument("--tile", type=int, default=512)
    parser.add_argument("--keep-whole", type=int, default=128)
    parser.add_argument("--workers", type=int, nargs="+", default=[1], help="several numbers: one after the other")
    parser.add_argument("--threads", type=int, default=0, help="of each worker; 0: as many as there are cores")
    parser.add_argument("--only", help=f"{', '.join(KINDS)}, or a PNG file of flat colours")
    parser.add_argument("--no-whole", action="store_true")
    parser.add_argument("--log", type=Path)
    args = parser.parse_args()
    print(HEAD)
    for kind, workers in product([args.only] if args.only else KINDS, args.workers):
        row = measure(kind, args, workers)
        print(line(row))
        sys.stdout.flush()
        if args.log:
            with args.log.open("a") as file:
                file.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()
