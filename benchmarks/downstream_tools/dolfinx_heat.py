"""Heat through two layers in FEniCSx (DOLFINx 0.5): `dolfinx_heat.py FILE.xdmf`, with FILE_sides.xdmf beside it."""

import sys

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.io import XDMFFile
from mpi4py import MPI

with XDMFFile(MPI.COMM_WORLD, sys.argv[1], "r") as file:
    mesh = file.read_mesh(name="Grid")
    materials = file.read_meshtags(mesh, name="Grid")
mesh.topology.create_connectivity(1, 2)
with XDMFFile(MPI.COMM_WORLD, sys.argv[1].replace(".xdmf", "_sides.xdmf"), "r") as file:
    sides = file.read_meshtags(mesh, name="Grid")
k = fem.Function(fem.FunctionSpace(mesh, ("DG", 0)))
k.x.array[materials.indices] = np.array([1.0, 10.0])[materials.values]
V = fem.FunctionSpace(mesh, ("CG", 1))
held = [fem.locate_dofs_topological(V, 1, sides.indices[sides.values == side]) for side in (1, 2)]  # left, right
bcs = [fem.dirichletbc(value, dofs, V) for value, dofs in zip((0.0, 1.0), held, strict=True)]
u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
a = k * ufl.dot(ufl.grad(u), ufl.grad(v)) * ufl.dx
L = fem.Constant(mesh, 0.0) * v * ufl.dx
T = fem.petsc.LinearProblem(a, L, bcs, petsc_options={"ksp_type": "preonly", "pc_type": "lu"}).solve()
print("materials", "by number")
print("borders", "by number")
print("heat", fem.assemble_scalar(fem.form(k * ufl.dot(ufl.grad(T), ufl.grad(T)) * ufl.dx)))
