"""Two elastic layers in FElupe: `felupe_force.py FILE` (.inp, or .vtu .vtk written with --plain)."""

import sys

import felupe
import meshio
import numpy as np

read = meshio.read(sys.argv[1])
quads = read.cells_dict["quad"]
if "mat_id" in read.cell_data:
    of = read.cell_data_dict["mat_id"]["quad"]
    layers = [np.flatnonzero(of == 1), np.flatnonzero(of == 2)]
    left, right = (np.flatnonzero(read.point_data[f"set_{name}"]) for name in ("left", "right"))
else:
    layers = [read.cell_sets_dict[name]["quad"] for name in ("MATERIAL_0", "MATERIAL_1")]
    left, right = read.point_sets["LEFT"], read.point_sets["RIGHT"]
mesh = felupe.Mesh(read.points[:, :2], quads, "quad")
field = felupe.FieldContainer([felupe.FieldPlaneStrain(felupe.RegionQuad(mesh), dim=2)])
parts = []
for cells, young in zip(layers, (1.0, 10.0), strict=True):
    part = felupe.Mesh(mesh.points, quads[cells], "quad")
    own = felupe.FieldContainer([felupe.FieldPlaneStrain(felupe.RegionQuad(part), dim=2)])
    parts.append(felupe.SolidBody(felupe.LinearElastic(E=young, nu=0.0), own))
x = mesh.points[:, 0]
bounds = {
    "left": felupe.Boundary(field[0], mask=np.isin(np.arange(len(x)), left), skip=(0, 1)),
    "pinned": felupe.Boundary(field[0], mask=np.isin(np.arange(len(x)), left[:1]), skip=(1, 0)),
    "right": felupe.Boundary(field[0], mask=np.isin(np.arange(len(x)), right), skip=(0, 1), value=0.06),
}
K = sum(part.assemble.matrix() for part in parts)
dof0, dof1 = felupe.dof.partition(field, bounds)
ext0 = felupe.dof.apply(field, bounds, dof0)
system = felupe.solve.partition(field, K, dof1, dof0, K @ np.zeros((K.shape[0], 1)))
field += felupe.solve.solve(*system, ext0)
force = K @ field[0].values.reshape(-1, 1)
print("materials", "by number" if "mat_id" in read.cell_data else "by name")
print("borders", "by name")
print("force", float(force.reshape(-1, 2)[right, 0].sum()))
