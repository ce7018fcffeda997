"""From a micrograph to its stresses: mesh the picture, solve with CalculiX, show von Mises stress on the picture.

Needs CalculiX (Debian: calculix-ccx) and ``pip install pyvista-frd-reader``:

    python examples/stress_on_a_micrograph.py [FOLDER]

writes rock.png, rock.inp, rock.frd and stress.png into FOLDER (stress-on-rock).
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyvista as pv

from imgquad_core import MeshOptions, mesh_image
from imgquad_core.writers import write_mesh
from imgquad_mesh.outputs import draw_rock


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    draw_rock().save(folder / "rock.png")
    mesh = mesh_image(folder / "rock.png", MeshOptions(size=4.0, min_pixels=12, min_length=6, pixel_size=1e-5))
    moduli = np.geomspace(20e9, 200e9, len(mesh.materials.names))
    values = {name: {"young": e, "poisson": 0.2} for name, e in zip(mesh.materials.names, moduli, strict=True)}
    write_mesh(mesh, folder / "rock.inp", deck="tension", analysis="plane strain", properties=values)
    subprocess.run(["ccx", "-i", "rock"], cwd=folder, check=True, env={**os.environ, "OMP_NUM_THREADS": "1"})
    result = pv.read(folder / "rock.frd")
    result = result[-1] if isinstance(result, pv.MultiBlock) else result
    print(result.n_cells, "elements,", ", ".join(result.point_data))
    draw(result, folder / "rock.png", folder / "stress.png")


def draw(result: pv.UnstructuredGrid, picture: Path, path: Path) -> None:
    """Draw the stress over the picture, half transparent."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    stress = result.point_data["STRESS_Mises"] / 1e6
    faces = result.extract_surface(algorithm="dataset_surface")
    quads = faces.regular_faces
    points = faces.points[:, :2] * 1e3
    of_point = stress[faces.point_data["vtkOriginalPointIds"]]
    figure, axis = plt.subplots(figsize=(9, 6), layout="constrained")
    width, height = points.max(axis=0)
    axis.imshow(plt.imread(picture), extent=(0, width, 0, height))
    shown = PolyCollection(
        points[quads], array=of_point[quads].mean(axis=1), cmap="inferno", alpha=0.75, antialiased=False
    )
    axis.add_collection(shown)
    axis.set(xlabel="mm", ylabel="mm", aspect="equal")
    figure.colorbar(shown, label="von Mises stress, MPa", shrink=0.8)
    figure.savefig(path, dpi=100)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "stress-on-rock"))
