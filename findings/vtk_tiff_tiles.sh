#!/usr/bin/env bash
# VTK's TIFF reader (what pyvista.read uses) and tiles of 16 bits: other pixels than were written, and no warning.
#
# Versions: vtk 9.6.2 and tifffile 2026.3.3, Python 3.11; seen with vtk 9.4.2, 9.6.2 and 9.7.2.
# Expected: the values that tifffile wrote (and that Pillow, libtiff and tifffile read back), or an error.
# Seen:     uint8 tiles are right; of uint16 and float32 tiles nearly all pixels are wrong; error code 0, no warning.
#           Tiled files of 16 bits are what OME-TIFF, cloud-optimised GeoTIFF and whole slides are.
# Ours:     imgquad_mesh.read and the command read TIFF by tifffile; docs/pictures.md says which files pv.read garbles.
set -e
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check vtk==9.6.2 tifffile==2026.3.3 numpy==2.4.6
venv/bin/python - <<'PY'
import numpy as np
import tifffile
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImage import vtkTIFFReader

right = {}
for dtype in (np.uint8, np.uint16, np.float32):
    written = np.random.default_rng(0).integers(1, 250, (640, 960)).astype(dtype)
    tifffile.imwrite("a.tif", written, tile=(128, 128))
    assert (tifffile.imread("a.tif") == written).all()
    reader = vtkTIFFReader()
    reader.SetFileName("a.tif")
    reader.Update()
    image = reader.GetOutput()
    columns, rows, _ = image.GetDimensions()
    read = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(rows, columns)[::-1]
    right[np.dtype(dtype).name] = float((read == written).mean())
    print(f"{np.dtype(dtype).name}: {100 * right[np.dtype(dtype).name]:.1f} % of pixels right, error code {reader.GetErrorCode()}")
still = right["uint8"] == 1.0 and max(right["uint16"], right["float32"]) < 0.1
print("still so: tiles of 16 and 32 bits come wrong without an error" if still else "changed: tiles come right")
raise SystemExit(0 if still else 1)
PY
# Output seen:
# uint8: 100.0 % of pixels right, error code 0
# uint16: 0.8 % of pixels right, error code 0
# float32: 1.1 % of pixels right, error code 0
# still so: tiles of 16 and 32 bits come wrong without an error
