#!/usr/bin/env bash
# meshio 5.3.5 writes MED files that the MED library (5.0.0, in Kratos 10.4.4) does not read.
#
# Expected: a .med that meshio wrote opens in programs that read by the MED library.
# Seen: "MEDmeshEntityInfo failed with error code -219": the library looks for the attribute GEO of a group of elements, which meshio does
# not write. The same quad written by Gmsh 4.15.2 is read (see kratos_med_turned_over.sh). So our .med are written by Gmsh, not by meshio.
# (Importing the MedApplication needs libmpi.so.12, which no wheel asks for: mpich from PyPI has it.)
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check meshio==5.3.5 h5py==3.16.0 mpich==5.0.2 \
    KratosMultiphysics==10.4.4 KratosMedApplication==10.4.4
cd "$folder"
bin/python -c '
import meshio
meshio.Mesh([[0, 0], [1, 0], [1, 1], [0, 1]], [("quad", [[0, 1, 2, 3]])]).write("a.med")
print("meshio reads:", meshio.read("a.med").cells_dict["quad"].tolist())'
LD_LIBRARY_PATH=$folder/lib bin/python - 2> errors.txt <<'P'
import KratosMultiphysics as Kratos
from KratosMultiphysics.MedApplication import MedModelPartIO

try:
    MedModelPartIO("a.med").ReadModelPart(Kratos.Model().CreateModelPart("a"))
except RuntimeError as error:
    print("Kratos:", str(error).splitlines()[0])
    assert "MEDmeshEntityInfo failed" in str(error), "changed"
else:
    raise SystemExit("changed: it is read")
P
grep -m 1 GEO errors.txt
echo "still so: refused"
