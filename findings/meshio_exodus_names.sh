#!/usr/bin/env bash
# meshio 5.3.5 gives the node sets of an Exodus file each other's names, if the NetCDF variables do not stand in the order of their ids.
#
# A NetCDF file is a set of variables that are found by name; their order has no meaning, and SciPy's writer puts the longest first.
# Expected: node set "short" has 1 node, "long" has 3, as node_ns1, node_ns2 and ns_names say (VTK's reader finds just that).
# Seen: "short" has 3 nodes, "long" has 1, without a word: meshio pairs the n-th node_ns variable of the file with the n-th name.
# So a writer must put the variables of an Exodus file in the order of their ids.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check meshio==5.3.5 netCDF4==1.7.5.1.post1 scipy==1.17.1
cd "$folder" && bin/python - <<'P'
import meshio
import numpy as np
from scipy.io import netcdf_file

with netcdf_file("a.e", "w", version=2) as file:
    file.title, file.api_version, file.version = b"two node sets", np.float32(5.22), np.float32(5.22)
    file.floating_point_word_size, file.file_size = 8, 1
    sizes = dict(len_string=33, num_dim=2, num_nodes=4, num_elem=1, num_el_blk=1, num_node_sets=2)
    sizes |= dict(num_el_in_blk1=1, num_nod_per_el1=4, num_nod_ns1=1, num_nod_ns2=3)
    for name, size in sizes.items():
        file.createDimension(name, size)
    for name, kind, dimensions, values in (
        ("coordx", "d", ("num_nodes",), [0.0, 1.0, 1.0, 0.0]),
        ("coordy", "d", ("num_nodes",), [0.0, 0.0, 1.0, 1.0]),
        ("connect1", "i", ("num_el_in_blk1", "num_nod_per_el1"), [[1, 2, 3, 4]]),
        ("node_ns1", "i", ("num_nod_ns1",), [4]),
        ("node_ns2", "i", ("num_nod_ns2",), [1, 2, 3]),
    ):
        file.createVariable(name, kind, dimensions)[:] = values
    file.variables["connect1"].elem_type = b"QUAD4"
    names = np.zeros((2, 33), "S1")
    for row, name in zip(names, ("short", "long")):
        row[: len(name)] = list(name)
    file.createVariable("ns_names", "c", ("num_node_sets", "len_string"))[:] = names
found = {name: (np.asarray(ids) + 0).tolist() for name, ids in meshio.read("a.e").point_sets.items()}
print("meshio:", found)
assert len(found["short"]) == 3 and len(found["long"]) == 1, "changed: the names are right"
P
echo "still so: the names are exchanged"
