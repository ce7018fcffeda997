#!/usr/bin/env bash
# meshio 5.3.5 reads six nodes of an eight-node Nastran element whose continuation line starts with blanks.
#
# In bulk data a line whose first field is blank continues the one before (as "+" does); the line before need not be padded to 80 columns.
# Expected: CQUAD8 with 8 nodes, as pyNastran and Gmsh read it.
# Seen: a block of type quad8 with 6 columns, and no error. With "+" in the first column, or the first line padded to 80 columns: 8 nodes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check meshio==5.3.5
cd "$folder" && bin/python - <<'P'
import meshio

POINTS = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
GRIDS = "".join(f"GRID    {i:8d}        {x:8.1f}{y:8.1f}     0.0\n" for i, (x, y) in enumerate(POINTS, 1))
FIRST = "CQUAD8  " + "".join(f"{i:8d}" for i in (1, 1, 1, 2, 3, 4, 5, 6))
REST = "".join(f"{i:8d}" for i in (7, 8))
for name, card, seen in (
    ("blanks", f"{FIRST}\n        {REST}\n", 6),
    ("plus", f"{FIRST}\n+       {REST}\n", 8),
    ("padded", f"{FIRST:80s}\n        {REST}\n", 8),
):
    open("a.bdf", "w").write(f"BEGIN BULK\n{GRIDS}{card}ENDDATA\n")
    (block,) = meshio.read("a.bdf").cells
    print(name, block.type, block.data.shape)
    assert block.data.shape == (1, seen), "changed"
P
echo "still so: two nodes are lost without a word"
