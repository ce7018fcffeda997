#!/usr/bin/env bash
# pythoncdt 2.0.2 and condeltri 0.1.0, two Python bindings of the same C++ library CDT, cannot live in one process.
#
# Expected: a process can import both, say to compare them.
# Seen, in either order, at the second import:
#     ImportError: generic_type: type "VertexInsertionOrder" is already registered!
# Both register the C++ types of CDT with pybind11 under the same names, for all modules of the process.
# We use pythoncdt alone; whoever compares them needs a process for each.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check pythoncdt==2.0.2 condeltri==0.1.0
for names in "pythoncdt, condeltri" "condeltri, pythoncdt"; do
    told=$("$folder/bin/python" -c "import $names" 2>&1 | tail -1 || true)
    echo "import $names: ${told:-no error}"
    [[ $told == *"already registered"* ]] || { echo "changed: both can be imported"; exit 1; }
done
echo "still so: the second import fails"
