"""Heat through two layers in NGSolve: `ngsolve_heat.py FILE.msh` (version 2.2, order 1)."""

import sys

from netgen.read_gmsh import ReadGmsh
from ngsolve import H1, BilinearForm, GridFunction, InnerProduct, Integrate, Mesh, dx, grad

mesh = Mesh(ReadGmsh(sys.argv[1]))
if mesh.ne == 0 or mesh.dim != 2:
    print("empty", f"without an error: {mesh.ne} volume elements in {mesh.dim} dimensions (our command warns)")
    raise SystemExit(1)
k = mesh.MaterialCF({"material_0": 1.0, "material_1": 10.0})
space = H1(mesh, order=1, dirichlet="left|right")
u, v = space.TnT()
form = BilinearForm(InnerProduct(k * grad(u), grad(v)) * dx).Assemble()
T = GridFunction(space)
T.Set(1.0, definedon=mesh.Boundaries("right"))
rest = T.vec.CreateVector()
rest.data = form.mat * T.vec
T.vec.data -= form.mat.Inverse(space.FreeDofs()) * rest
print("materials", "by name" if set(mesh.GetMaterials()) == {"material_0", "material_1"} else "no")
print("borders", "by name" if {"left", "right", "bottom", "top"} <= set(mesh.GetBoundaries()) else "no")
print("heat", Integrate(InnerProduct(k * grad(T), grad(T)), mesh))
