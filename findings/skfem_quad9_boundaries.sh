#!/usr/bin/env bash
# scikit-fem 12.0.2 loads nine-node quads from a Gmsh file with their subdomains, but without their boundaries.
#
# Expected: mesh.boundaries["left"], as for four-node quads of the same file, or an error.
# Seen: mesh.boundaries is None; a line of the log ("Failure to parse tags from meshio.") is all that is said.
# What is needed can be made of meshio's cell sets and `with_boundaries`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check scikit-fem==12.0.2 meshio==5.3.5
cd "$folder" && bin/python - <<'P'
import skfem

POINTS = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)]
HEAD = '$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n1 2 "left"\n2 1 "body"\n$EndPhysicalNames\n'
ENTITIES = "$Entities\n0 1 1 0\n2 0 0 0 0 2 0 1 2 0\n1 0 0 0 2 2 0 1 1 1 2\n$EndEntities\n"
for count, quad, line, edge in ((4, 3, 1, "4 1"), (9, 10, 8, "4 1 8")):
    ids = "\n".join(map(str, range(1, count + 1)))
    lines = "\n".join(f"{x} {y} 0" for x, y in POINTS[:count])
    nodes = f"$Nodes\n1 {count} 1 {count}\n2 1 0 {count}\n{ids}\n{lines}\n$EndNodes\n"
    corners = " ".join(map(str, range(1, count + 1)))
    elements = f"$Elements\n2 2 1 2\n1 2 {line} 1\n1 {edge}\n2 1 {quad} 1\n2 {corners}\n$EndElements\n"
    open("a.msh", "w").write(HEAD + ENTITIES + nodes + elements)
    mesh = skfem.Mesh.load("a.msh")
    found = sorted(mesh.boundaries or {})
    print(count, "nodes:", type(mesh).__name__, "boundaries", found, "subdomains", sorted(mesh.subdomains or {}))
    assert ("left" in found) == (count == 4), "changed"
P
echo "still so: the boundaries are lost"
