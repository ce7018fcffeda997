#!/usr/bin/env bash
# meshio 5.3.5 writes an XDMF file of points, lines and quads that it cannot read.
#
# Such a mesh is what a Gmsh file with physical points gives, so `meshio convert a.msh a.xdmf` makes such a file.
# Expected: read as written, or refused when written. Seen: written without a word; reading raises KeyError: 0. Without the points it reads.
# So our .xdmf keeps quads and sides in files of their own.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check meshio==5.3.5 h5py==3.16.0
cd "$folder" && bin/python - <<'P'
import meshio

PLACES = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
CELLS = [("vertex", [[0]]), ("line", [[0, 1]]), ("quad", [[0, 1, 2, 3]])]
for cells in (CELLS[1:], CELLS):
    meshio.Mesh(PLACES, cells).write("a.xdmf")
    try:
        told = [block.type for block in meshio.read("a.xdmf").cells]
    except KeyError as error:
        told = type(error).__name__
    print([kind for kind, _ in cells], "->", told)
    assert told == ("KeyError" if len(cells) == 3 else ["line", "quad"]), "changed"
P
echo "still so: KeyError"
