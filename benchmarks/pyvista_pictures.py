"""Mesh every real picture the way a user of PyVista does: ``pv.read(path).imgquad.mesh(size=4)``.

    python benchmarks/pyvista_pictures.py [FOLDER] [--size 4] [--only NAME]

Prints one line a picture and fails where a mesh is not valid: quads of positive area only, the bounds of
`points_to_cells`, and PyVista's own `validate_mesh` and `cell_quality` content with it.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import pyvista as pv

PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).parents[2] / "shared" / "images")
    parser.add_argument("--size", type=float, default=4.0)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    pictures = sorted(p for p in options.folder.iterdir() if p.suffix.lower() in PICTURES and options.only in p.name)
    print("picture | array | pixels | seconds | quads | materials | least scaled Jacobian | largest difference to VTK")
    for path in pictures:
        print(path.name, *measure(path, options.size), sep=" | ", flush=True)


def measure(path: Path, size: float) -> tuple[object, ...]:
    image = pv.read(path)
    start = time.perf_counter()
    mesh = image.imgquad.mesh(size=size)
    seconds = time.perf_counter() - start
    check(image, mesh)
    ours, theirs = mesh.imgquad.quality(), mesh.cell_quality(["scaled_jacobian", "min_angle", "max_angle"])
    apart = max(np.abs(ours[name] - theirs[name]).max() for name in ("scaled_jacobian", "min_angle", "max_angle"))
    assert apart < 1e-9, apart
    pixels = f"{image.dimensions[0]} x {image.dimensions[1]} at {image.spacing[0]:g}"
    worst = f"{ours['scaled_jacobian'].min():.3f}"
    materials = len(np.unique(mesh["material"]))
    return image.active_scalars_name, pixels, f"{seconds:.1f}", mesh.n_cells, materials, worst, f"{apart:.0e}"


def check(image: pv.ImageData, mesh: pv.UnstructuredGrid) -> None:
    corners = mesh.points[mesh.cells_dict[pv.CellType.QUAD]][..., :2]
    diagonals = corners[:, 2:] - corners[:, :2]
    areas = 0.5 * (diagonals[:, 0, 0] * diagonals[:, 1, 1] - diagonals[:, 0, 1] * diagonals[:, 1, 0])
    assert areas.min() > 0, "a quad turns clockwise"
    assert np.allclose(mesh.bounds, image.points_to_cells(image.active_scalars_name).bounds)
    # "non_convex" and the like are told cell by cell
    report = mesh.validate_mesh()
    assert report.is_valid, report


if __name__ == "__main__":
    main()
