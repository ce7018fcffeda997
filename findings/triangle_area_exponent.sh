#!/usr/bin/env bash
# triangle 20250106 (the Python wrapper of Shewchuk's Triangle): an area in scientific notation is read as another one.
#
# Expected: `f"pa{area}"` with area 0.00001, which Python writes 1e-05, asks for triangles of at most that area.
# Seen, in a square of side 0.04:
#     pa0.00001nQ: 262 triangles
#     pa1e-05nQ: 2 triangles, and edges that were not asked for
# A number in the switches ends at the first character that is no digit or point: `a1`, then `e`, which asks for a list of edges.
# No error, no warning: small faces come back unrefined.
# We write the number with a fixed number of digits (`mesher/triangulation.py`).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check triangle==20250106 "numpy<3"
"$folder/bin/python" - <<'P'
import numpy as np
import triangle

square = {
    "vertices": np.array([[0.0, 0.0], [0.04, 0.0], [0.04, 0.04], [0.0, 0.04]]),
    "segments": np.array([[0, 1], [1, 2], [2, 3], [3, 0]], np.int32),
}
made = {switches: triangle.triangulate(square, switches) for switches in ("pa0.00001nQ", "pa1e-05nQ")}
for switches, mesh in made.items():
    extra = ", and edges that were not asked for" if "edges" in mesh else ""
    print(f"{switches}: {len(mesh['triangles'])} triangles{extra}")
fixed, scientific = made.values()
if not (len(fixed["triangles"]) > 160 and len(scientific["triangles"]) == 2 and "edges" in scientific):
    raise SystemExit("changed: exponents are read")
print("still so: the exponent is taken for a switch")
P
