#!/usr/bin/env bash
# meshio 5.3.5 ends the process at a .vtu file whose FieldData holds a text array.
#
# VTK has text arrays (vtkStringArray) and writes them so; PyVista puts a str into field_data that way.
# Expected: the grid, without or with the array; or an error that `except Exception` catches.
# Seen: prints "Illegal data type 'String'." and raises SystemExit(1). Without the one array the file is read.
# We write texts as bytes there, and turn them back in a reader of our own for PyVista (imgquad_mesh/readers.py).
# There is no other place for the array: VTK looks for FieldData among the children of UnstructuredGrid only.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check meshio==5.3.5
cd "$folder" && bin/python - <<'P'
import meshio

TEXT = '<Array type="String" Name="names" NumberOfTuples="1" format="ascii">113 0</Array>'
GRID = """<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>
<FieldData>%s<DataArray type="Int32" Name="numbers" NumberOfTuples="1" format="ascii">7</DataArray></FieldData>
<Piece NumberOfPoints="4" NumberOfCells="1">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 1 1 0 0 1 0</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">4</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">9</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"""
for text in ("", TEXT):
    open("a.vtu", "w").write(GRID % text)
    try:
        told = meshio.read("a.vtu").cells_dict["quad"].tolist()
    except BaseException as error:
        told = repr(error)
    print("with a text array:" if text else "without:", told)
    assert told == ("SystemExit(1)" if text else [[0, 1, 2, 3]]), "changed"
P
echo "still so: SystemExit"
