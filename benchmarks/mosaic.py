"""A land cover mosaic larger than memory, in tiles: a line a step with its seconds and the most memory so far.

    python benchmarks/mosaic.py FOLDER                     32,768 x 32,768 px: an hour, and 25 GB in the folder
    python benchmarks/mosaic.py FOLDER --side 8192

Goes on with what is in the folder. In the end all tiles are looked at together: does each edge between two of them
belong to both, and is the whole one piece without a hole? The log of such a run: benchmarks/mosaic_32768.txt.
"""

from __future__ import annotations

import argparse
import json
import resource
import runpy
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from scipy import sparse

from imgquad_core import MeshOptions
from imgquad_core.geometry.halfedge import twins_of
from imgquad_core.tiles import tasks
from imgquad_core.tiles.meshes import bits_of
from imgquad_mesh.large import TiledMesh, mesh_tiles
from processes import ROOT

DRAWING = ROOT.parent / "shared" / "tools" / "make_synthetic.py"
OCTAVES = ((40.0, 0.12), (96.0, 0.35), (240.0, 0.8), (600.0, 1.0), (1500.0, 1.0))  # px between nodes, height
CLASSES = (0.18, 0.40, 0.55, 0.72, 0.90)  # shares of the surface below the bounds of its classes
STRIP = 256  # rows that are drawn at once
GB = 1 << 30


def splines(n: int, spacing: float) -> sparse.csr_matrix:
    """Return the cubic B-splines of a coarse grid at n pixels, shape (n, nodes)."""
    u = (np.arange(n) + 0.5) / spacing
    k, t = np.floor(u).astype(int), u - np.floor(u)
    w = np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3]) / 6.0
    nodes = int(np.ceil(n / spacing)) + 4
    places = (k[:, None] + np.arange(4)).ravel()
    return sparse.csr_matrix((w.T.ravel().astype(np.float32), places, np.arange(0, 4 * n + 1, 4)), (n, nodes))


def draw(path: Path, side: int) -> None:
    """Write classes of a smooth random surface with patches of all sizes, as labels."""
    random = runpy.run_path(str(DRAWING))["rnd"]
    parts = []
    for seed, (spacing, height) in enumerate(OCTAVES):
        s = splines(side, spacing)
        grid = (height * (random(100 + seed, s.shape[1] ** 2) - 0.5)).astype(np.float32).reshape(s.shape[1], -1)
        parts.append((s, np.ascontiguousarray((s @ grid.T).T)))

    def strip(top: int) -> np.ndarray:
        rows = slice(top, min(top + STRIP, side))
        return np.asarray(sum(s[rows] @ g for s, g in parts))

    sample = np.concatenate([strip(top)[::16, ::16].ravel() for top in range(0, side, 8 * STRIP)])
    bounds = np.quantile(sample, CLASSES)
    temporary = path.with_suffix(".part")
    out = np.lib.format.open_memmap(temporary, "w+", np.uint8, (side, side))
    for top in range(0, side, STRIP):
        values = strip(top)
        out[top : top + STRIP] = np.searchsorted(bounds, values.ravel()).reshape(values.shape)
    out.flush()
    temporary.rename(path)


def fits(made: TiledMesh, side: int) -> str:
    """Return how many edges lie between two tiles, how many of these are not of both, and Euler's characteristic."""
    job, between, n_points, n_quads, n_border = made.job, [], 0, 0, 0
    for t in range(job.grid.n_tiles):
        found = tasks.final_mesh(job, t)
        points, quads = found["points"], found["quads"]
        open_edges = np.flatnonzero(twins_of(quads, len(points)) < 0)
        ends = np.stack([quads.ravel()[open_edges], np.roll(quads, -1, axis=1).ravel()[open_edges]], axis=1)
        middle = points[ends].mean(axis=1)
        on_border = ((middle == 0) | (middle == side)).any(axis=1)
        between.append(np.sort(bits_of(points[ends[~on_border]].reshape(-1, 2)).reshape(-1, 2), axis=1))
        n_border += np.count_nonzero(on_border)
        n_points += tasks.number(job, t)[0]
        n_quads += len(quads)
    _, counts = np.unique(np.concatenate(between), axis=0, return_counts=True)
    euler = n_points - (4 * n_quads + n_border) // 2 + n_quads
    return (
        f"edges between tiles {len(counts)}, not of both {np.count_nonzero(counts != 2)}, Euler characteristic {euler}"
    )


def main() -> None:
    """Draw, mesh, look."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--side", type=int, default=32768)
    parser.add_argument("--tile", type=int, default=4096)
    parser.add_argument("--memory", type=int, default=3, help="GB of data that the process may have")
    args = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_DATA, (args.memory * GB, args.memory * GB))
    args.folder.mkdir(parents=True, exist_ok=True)
    picture = args.folder / "picture.npy"
    if not picture.exists():
        draw(picture, args.side)
    begin, cpu = perf_counter(), process_time()
    done: dict[str, int] = {}

    def told(kind: str) -> None:
        done[kind] = done.get(kind, 0) + 1
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        seconds = f"cpu {process_time() - cpu:.1f} wall {perf_counter() - begin:.0f}"
        print(f"{kind} {done[kind]} {seconds} peak {peak:.0f} MB", flush=True)

    how = MeshOptions(size=4.0, threads=1)
    made = mesh_tiles(picture, args.folder / "out", how, tile=args.tile, keep_whole=256, told=told)
    kept = {name: made.report[name] for name in ("materials", "quality", "regions", "noise")}
    print(json.dumps(kept, indent=1), fits(made, args.side), sep="\n")


if __name__ == "__main__":
    main()
