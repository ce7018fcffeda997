#!/usr/bin/env bash
# Kratos 10.4.4 (MedApplication) turns every plane element of a MED file over.
#
# Gmsh 4.15.2 writes a quad and a triangle counter-clockwise; meshio 5.3.5 reads them counter-clockwise.
# Expected: geometries with the nodes in the order of the file.
# Seen: the quad (0,0) (1,0) (1,1) (0,1) arrives as (0,0) (0,1) (1,1) (1,0), the triangle turned over as well, without a word; elements
# made of these geometries stop at "INVERTED. DETJ0" with a negative number.
# Our MED files stay counter-clockwise, as Salome and Code_Aster read them; benchmarks/downstream_tools/kratos_force.py turns them back.
# (Importing the MedApplication needs libmpi.so.12, which no wheel asks for: mpich from PyPI has it.)
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check gmsh==4.15.2 meshio==5.3.5 h5py==3.16.0 mpich==5.0.2 \
    KratosMultiphysics==10.4.4 KratosMedApplication==10.4.4
cd "$folder"
bin/python - <<'P'
import gmsh
import meshio

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
surface = gmsh.model.addDiscreteEntity(2)
gmsh.model.mesh.addNodes(2, surface, [1, 2, 3, 4, 5], [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 0, 0])
gmsh.model.mesh.addElements(2, surface, [3, 2], [[1], [2]], [[1, 2, 3, 4], [2, 5, 3]])
gmsh.model.addPhysicalGroup(2, [surface], 1, "matter")
gmsh.write("a.med")
blocks = [block.data.tolist() for block in meshio.read("a.med").cells]
print("meshio:", blocks)
assert blocks == [[[0, 1, 2, 3]], [[1, 4, 2]]], "changed"
P
LD_LIBRARY_PATH=$folder/lib bin/python - <<'P'
import KratosMultiphysics as Kratos
from KratosMultiphysics.MedApplication import MedModelPartIO

part = Kratos.Model().CreateModelPart("a")
MedModelPartIO("a.med").ReadModelPart(part)
for geometry in part.Geometries:
    at = [(node.X, node.Y) for node in geometry]
    twice = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(at, at[1:] + at[:1]))
    print("Kratos:", at, "area", twice / 2)
    assert twice < 0, "changed"
P
echo "still so: plane elements are turned over"
