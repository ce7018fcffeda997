#!/usr/bin/env bash
# Gmsh 4.15.2: after one file that it cannot read, every later gmsh.open of the process reads nothing and raises nothing.
#
# Expected: the next good file is read, or an exception.
# Seen: a good .msh gives 3 nodes; an Abaqus .inp raises "syntax error (*)" (it is taken for a script); the same good .msh then gives 0
# nodes and no exception, gmsh.clear() does not help, gmsh.finalize() and gmsh.initialize() do.
# Who converts many files in one process loses all that come after a bad one: we start Gmsh anew for each file (writers/converted.py).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check gmsh==4.15.2
cd "$folder" && bin/python - <<'P'
import gmsh

MSH = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", "3", "1 0 0 0", "2 1 0 0", "3 0 1 0", "$EndNodes"]
MSH += ["$Elements", "1", "1 2 2 1 1 1 2 3", "$EndElements", ""]
INP = ["*HEADING", "a", "*NODE", "1, 0., 0.", "2, 1., 0.", "3, 0., 1.", "*ELEMENT, TYPE=CPS3", "1, 1, 2, 3", ""]
open("good.msh", "w").write("\n".join(MSH))
open("other.inp", "w").write("\n".join(INP))


def start():
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)


def nodes():
    gmsh.open("good.msh")
    return len(gmsh.model.mesh.getNodes()[0])


start()
found = [nodes()]
try:
    gmsh.open("other.inp")
except Exception as error:
    print("other.inp:", error)
found.append(nodes())
gmsh.clear()
found.append(nodes())
gmsh.finalize()
start()
found.append(nodes())
print("nodes of good.msh: first, after the error, after clear, after a new start:", found)
assert found == [3, 0, 0, 3], "changed"
P
echo "still so: nothing is read after an error"
