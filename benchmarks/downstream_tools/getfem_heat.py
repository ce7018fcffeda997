"""Heat through two layers in GetFEM: `getfem_heat.py FILE.msh`."""

import sys
from pathlib import Path

import getfem as gf

names = {}
for line in Path(sys.argv[1]).read_text().partition("$PhysicalNames\n")[2].partition("$End")[0].splitlines()[1:]:
    dimension, tag, name = line.split(maxsplit=2)
    names[name.strip('"')] = int(tag)
mesh = gf.Mesh("import", "gmsh", sys.argv[1])
fem, integral, model = gf.MeshFem(mesh, 1), gf.MeshIm(mesh, 4), gf.Model("real")
fem.set_classical_fem(1)
model.add_fem_variable("T", fem)
k = {names["material_0"]: 1.0, names["material_1"]: 10.0}
for tag, value in k.items():
    model.add_linear_term(integral, f"{value}*Grad_T.Grad_Test_T", tag)
model.add_initialized_data("hot", [1.0])
model.add_Dirichlet_condition_with_simplification("T", names["left"])
model.add_Dirichlet_condition_with_simplification("T", names["right"], "hot")
model.solve()
print("materials", "by number")
print("borders", "by number")
print("heat", sum(gf.asm_generic(integral, 0, f"{v}*Grad_T.Grad_T", tag, model) for tag, v in k.items()))
