"""Two elastic layers in FElupe: `felupe_force.py FILE` (.inp, .vtu, or --plain .vtk), 4, 8 or 9 nodes."""

import sys

import felupe
import meshio
import numpy as np

read = meshio.read(sys.argv[1])
(block,) = read.cells
regions = {"quad": felupe.RegionQuad, "quad8": felupe.RegionQuadraticQuad, "quad9": felupe.RegionBiQuadraticQuad}
kind = regions[block.type]
x, y = read.points[:, 0], read.points[:, 1]
left, right = np.isclose(x, x.min()), np.isclose(x, x.max())  # where the file has no sets of nodes
borders = "by hand"
if "LEFT" in read.point_sets:
    left, right = (np.isin(np.arange(len(x)), read.point_sets[name]) for name in ("LEFT", "RIGHT"))
    borders = "by name"
for sign in "_ ":
    if f"set{sign}left" in read.point_data:
        left, right = (read.point_data[f"set{sign}{name}"].ravel() == 1 for name in ("left", "right"))
        borders = "by name"
if "mat_id" in read.cell_data:
    layers, materials = [np.flatnonzero(read.cell_data["mat_id"][0] == number) for number in (1, 2)], "by number"
elif "material_names" in read.field_data:
    names = [bytes(column).rstrip(b"\0").decode() for column in read.field_data["material_names"].T]
    numbers = dict(zip(names, read.field_data["material_numbers"], strict=True))
    of, materials = read.cell_data["material"][0], "by name"
    layers = [np.flatnonzero(of == numbers[name]) for name in ("material 0", "material 1")]
else:
    layers, materials = [read.cell_sets[name][0] for name in ("MATERIAL_0", "MATERIAL_1")], "by name"
mesh = felupe.Mesh(read.points[:, :2], block.data, block.type)
field = felupe.FieldContainer([felupe.FieldPlaneStrain(kind(mesh), dim=2)])
parts = []
for cells, young in zip(layers, (1.0, 10.0), strict=True):
    part = felupe.Mesh(mesh.points, block.data[cells], block.type)
    own = felupe.FieldContainer([felupe.FieldPlaneStrain(kind(part), dim=2)])
    parts.append(felupe.SolidBody(felupe.LinearElastic(E=young, nu=0.0), own))
bounds = {
    "left": felupe.Boundary(field[0], mask=left, skip=(0, 1)),
    "pinned": felupe.Boundary(field[0], mask=left & (y == y.min()), skip=(1, 0)),
    "right": felupe.Boundary(field[0], mask=right, skip=(0, 1), value=0.06),
}
K = sum(part.assemble.matrix() for part in parts)
dof0, dof1 = felupe.dof.partition(field, bounds)
ext0 = felupe.dof.apply(field, bounds, dof0)
system = felupe.solve.partition(field, K, dof1, dof0, K @ np.zeros((K.shape[0], 1)))
field += felupe.solve.solve(*system, ext0)
force = K @ field[0].values.reshape(-1, 1)
print("materials", materials)
print("borders", borders)
print("force", float(force.reshape(-1, 2)[right, 0].sum()))
