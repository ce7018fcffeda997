"""Heat through two layers in MFEM: `mfem_heat.py FILE.msh`."""

import sys
from pathlib import Path

import mfem.ser as mfem
import numpy as np

mesh = mfem.Mesh(sys.argv[1], 1, 1)
names = {}  # MFEM keeps them as attribute sets; the numbers stand in the file
for line in Path(sys.argv[1]).read_text().partition("$PhysicalNames\n")[2].partition("$End")[0].splitlines()[1:]:
    dimension, tag, name = line.split(maxsplit=2)
    names[name.strip('"')] = int(tag)
conductivity = mfem.Vector([1.0] * mesh.attributes.Max())
if names:
    conductivity[names["material_1"] - 1] = 10.0
    ends = [names["left"], names["right"]]
else:
    conductivity[1] = 10.0
    ends = []
space = mfem.FiniteElementSpace(mesh, mfem.H1_FECollection(1 if mesh.GetNodes() is None else 2, mesh.Dimension()))
form = mfem.BilinearForm(space)
form.AddDomainIntegrator(mfem.DiffusionIntegrator(mfem.PWConstCoefficient(conductivity)))
form.Assemble()
form.Finalize()
stiffness = mfem.SparseMatrix(form.SpMat())
solution = mfem.GridFunction(space)
solution.Assign(0.0)
if ends:
    marker = mfem.intArray([0] * mesh.bdr_attributes.Max())
    marker[ends[1] - 1] = 1
    solution.ProjectBdrCoefficient(mfem.ConstantCoefficient(1.0), marker)
    marker[ends[0] - 1] = 1
    held = mfem.intArray()
    space.GetEssentialTrueDofs(marker, held)
else:  # a plain grid names no borders: nodes by their places
    at = np.array([list(mesh.GetVertexArray(i)) for i in range(mesh.GetNV())])
    hot = np.flatnonzero(at[:, 0] == at[:, 0].max())
    for node in hot:
        solution[int(node)] = 1.0
    held = mfem.intArray([int(i) for i in np.concatenate([hot, np.flatnonzero(at[:, 0] == at[:, 0].min())])])
matrix, right, unknown = mfem.OperatorHandle(), mfem.Vector(), mfem.Vector()
load = mfem.LinearForm(space)
load.Assemble()
form.FormLinearSystem(held, solution, load, matrix, unknown, right)
mfem.PCG(matrix.Ptr(), mfem.GSSmoother(mfem.OperatorHandle2SparseMatrix(matrix)), right, unknown, 0, 2000, 1e-28, 0.0)
form.RecoverFEMSolution(unknown, load, solution)
flow = mfem.Vector(solution.Size())
stiffness.Mult(solution, flow)
print("materials", "by name" if names else "by number")
print("borders", "by name" if names else "by hand")
print("heat", mfem.InnerProduct(solution, flow))
boundary = mfem.intArray([1] * mesh.bdr_attributes.Max()) if ends else None
if boundary is not None:
    on_all = mfem.intArray()
    space.GetEssentialTrueDofs(boundary, on_all)
    print("whole boundary", on_all.Size(), "nodes")
