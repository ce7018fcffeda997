#!/usr/bin/env bash
# netgen.read_gmsh of netgen-mesher 6.2.2608 reads a plane mesh of eight-node quads as one in space without volume elements.
#
# Expected: a two-dimensional mesh with one second-order quad, or an error as for nine-node quads ("element type 10 not implemented").
# Seen: dim = 3, no volume element, one surface element; no error. So every integral over the material is 0 in NGSolve.
# With four nodes (type 3) the mesh is two-dimensional and has its quad.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check netgen-mesher==6.2.2608 numpy
cd "$folder" && bin/python - <<'P'
from netgen.read_gmsh import ReadGmsh

POINTS = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
HEAD = '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 1 "body"\n$EndPhysicalNames\n'
NODES = "$Nodes\n%d\n%s$EndNodes\n"
for kind, count, seen in ((3, 4, (2, 0, 1)), (16, 8, (3, 0, 1))):
    lines = "".join(f"{i} {x} {y} 0\n" for i, (x, y) in enumerate(POINTS[:count], 1))
    ids = " ".join(map(str, range(1, count + 1)))
    open("a.msh", "w").write(HEAD + NODES % (count, lines) + f"$Elements\n1\n1 {kind} 2 1 1 {ids}\n$EndElements\n")
    mesh = ReadGmsh("a.msh")
    found = (mesh.dim, len(mesh.Elements3D()), len(mesh.Elements2D()))
    print(count, "nodes: dimension, volume elements, surface elements:", found)
    assert found == seen, "changed"
P
echo "still so: the plane mesh is read as a surface in space"
