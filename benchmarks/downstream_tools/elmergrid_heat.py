"""Heat through two layers on what ElmerGrid makes of a file: `elmergrid_heat.py FILE.msh`, solved by SciPy.

ElmerSolver is not in Debian; its grid (mesh.nodes, mesh.elements, mesh.boundary, mesh.names) is what it would read.
"""

import subprocess
import sys
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve

grid = Path(sys.argv[2] if len(sys.argv) > 2 else "ElmerGrid").expanduser()
subprocess.run([grid, "14", "2", sys.argv[1], "-autoclean", "-out", "elmer"], check=True, capture_output=True)


def rows(name: str) -> list[list[float]]:
    """Return the numbers of each line."""
    return [[float(word) for word in line.split()] for line in Path("elmer", name).read_text().splitlines()]


numbers = {}
for line in Path("elmer/mesh.names").read_text().splitlines():
    if line.startswith("$"):
        name, _, number = line[1:].partition("=")
        numbers[name.strip()] = int(number)
points = np.array([row[2:4] for row in rows("mesh.nodes")])
elements = np.array(rows("mesh.elements")).astype(int)  # number, body, type, nodes
sides = np.array(rows("mesh.boundary")).astype(int)  # number, boundary, parents, type, nodes
k = np.zeros(len(elements))
for name, value in (("material_0", 1.0), ("material_1", 10.0)):
    k[elements[:, 1] == numbers[name]] = value
temperature = np.full(len(points), np.nan)
for name, value in (("left", 0.0), ("right", 1.0)):
    temperature[sides[sides[:, 1] == numbers[name], 5:].ravel() - 1] = value
n_nodes = elements[0, 2] % 100
powers = np.array([(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (2, 1), (1, 2), (2, 2)][:n_nodes])
at = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0), (0, 0)][:n_nodes])
shapes = np.linalg.inv(np.prod(at[:, None] ** powers, axis=2))  # Elmer's 404, 408 and 409: coefficients a column
blocks = np.zeros((len(elements), n_nodes, n_nodes))
line = list(zip(*np.polynomial.legendre.leggauss(3), strict=True))
for x, y, weight in [(a, b, u * v) for a, u in line for b, v in line]:
    slopes = np.stack(
        [
            np.array([p * x ** max(p - 1, 0) * y**q for p, q in powers]) @ shapes,
            np.array([q * x**p * y ** max(q - 1, 0) for p, q in powers]) @ shapes,
        ]
    )
    jacobian = slopes @ points[elements[:, 3:] - 1]
    gradient = np.linalg.solve(jacobian, np.broadcast_to(slopes, (len(elements), *slopes.shape)))
    scale = weight * np.linalg.det(jacobian) * k
    blocks += scale[:, None, None] * np.swapaxes(gradient, 1, 2) @ gradient
where = elements[:, 3:] - 1
ij = np.repeat(where, n_nodes, axis=1).ravel(), np.tile(where, n_nodes).ravel()
matrix = coo_array((blocks.ravel(), ij), shape=(len(points),) * 2).tocsr()
free, held = np.isnan(temperature), np.flatnonzero(~np.isnan(temperature))
temperature[free] = spsolve(matrix[free][:, free], -matrix[free][:, held] @ temperature[held])
print("materials", "by name")
print("borders", "by name")
print("heat", temperature @ matrix @ temperature)
