"""Heat through two layers in scikit-fem: `skfem_heat.py FILE.msh`."""

import sys

import meshio
import numpy as np
import skfem
from skfem.models.poisson import laplace

mesh = skfem.Mesh.load(sys.argv[1])
borders = mesh.boundaries or {}
if (
    "right" not in borders
):  # nine nodes: scikit-fem finds materials, but no borders: take them from the lines in the file
    read = meshio.read(sys.argv[1])
    facets = {tuple(sorted(f)): i for i, f in enumerate(mesh.facets.T.tolist())}
    number = {tuple(p): i for i, p in enumerate(mesh.p.T[: mesh.nvertices].tolist())}
    for name, cells in read.cell_sets_dict.items():
        if "line3" in cells:
            ends = read.cells_dict["line3"][cells["line3"], :2]
            at = [[number[tuple(read.points[n, :2].tolist())] for n in line] for line in ends]
            borders[name] = np.array([facets[tuple(sorted(pair))] for pair in at])
    mesh = mesh.with_boundaries(borders)
    print("borders", "by hand")
else:
    print("borders", "by name")
print("materials", "by name" if set(mesh.subdomains or {}) >= {"material_0", "material_1"} else "no")
element = skfem.ElementQuad2() if isinstance(mesh, skfem.MeshQuad2) else skfem.ElementQuad1()
k = {"material_0": 1.0, "material_1": 10.0}
A = sum(k[name] * laplace.assemble(skfem.Basis(mesh, element, elements=name)) for name in k)
basis = skfem.Basis(mesh, element)
T = basis.zeros()
T[basis.get_dofs("right").all()] = 1.0
T = skfem.solve(*skfem.condense(A, x=T, D=basis.get_dofs({"left", "right"})))
print("heat", T @ A @ T)
