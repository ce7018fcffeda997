#!/usr/bin/env bash
# A Zarr store of tifffile 2026.3.3 cannot be pickled, so an array of Dask on a tiled TIFF runs on threads, not on processes.
#
# `tifffile.imread(path, aszarr=True)` is the documented way to read a large TIFF lazily by `dask.array.from_zarr`.
# Expected: a graph that any scheduler of Dask runs: arrays of zarr's own stores are pickled by their path.
# Seen: the store holds the open file: TypeError: cannot pickle '_io.BufferedReader' object. Threads give the sum,
# processes raise.
# We send the path of the picture to workers and open it in the task (imgquad_core/tiles/sources.py).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check tifffile==2026.3.3 zarr==3.1.5 "dask[array]==2026.8.0"
cd "$folder" && cat > show.py <<'P'
import pickle

import dask.array as da
import numpy as np
import tifffile
import zarr

if __name__ == "__main__":
    picture = np.arange(64 * 64, dtype=np.uint16).reshape(64, 64)
    tifffile.imwrite("a.tif", picture, tile=(16, 16))
    zarr.create_array("a.zarr", shape=(64, 64), chunks=(16, 16), dtype="uint16")[:] = picture
    pickle.dumps(zarr.open("a.zarr", mode="r"))
    print("zarr's own store: pickles")
    array = da.from_zarr(zarr.open(tifffile.imread("a.tif", aszarr=True), mode="r"))
    assert int(array.sum().compute(scheduler="threads")) == int(picture.sum())
    print("tifffile's store: threads give the sum")
    try:
        array.sum().compute(scheduler="processes")
        told = "a sum"
    except Exception as error:
        told = str(error)
    print("tifffile's store, processes:", told.splitlines()[0])
    assert "cannot pickle '_io.BufferedReader' object" in told, "changed"
P
bin/python show.py || { echo "changed: see above"; exit 1; }
echo "still so: cannot pickle '_io.BufferedReader' object"
