#!/usr/bin/env bash
# rasterio (GDAL): a colour table written after the pixels does not make the file a palette picture for other readers.
#
# Versions: rasterio 1.4.4, tifffile 2026.3.3, pillow 12.0.0, numpy 2.4.6, Python 3.11.
# Expected: the same file whether write_colormap is called before write or after it.
# Seen:     after it, the photometric tag stays MinIsBlack (1): only GDAL uses the table; tifffile and Pillow see a grey
#           picture, and a land cover map of classes looks like a photograph. Before it, it is a palette picture (3).
# Ours:     labels are told from greys by the pixels, not by the palette flag.
set -e
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check rasterio==1.4.4 tifffile==2026.3.3 pillow==12.0.0 numpy==2.4.6
venv/bin/python -W ignore - <<'PY'
import numpy as np
import rasterio
import tifffile
from PIL import Image

classes = (np.indices((60, 80)).sum(axis=0) // 10).astype(np.uint8)
table = {k: (k * 15, 255 - k * 15, 90, 255) for k in range(14)}
found = {}
for order in ("before", "after"):
    with rasterio.open(f"{order}.tif", "w", driver="GTiff", width=80, height=60, count=1, dtype="uint8") as file:
        if order == "before":
            file.write_colormap(1, table)
        file.write(classes, 1)
        if order == "after":
            file.write_colormap(1, table)
    with rasterio.open(f"{order}.tif") as file:
        assert file.colormap(1)[3] == table[3]
    with tifffile.TiffFile(f"{order}.tif") as file:
        found[order] = (file.pages[0].photometric.name, Image.open(f"{order}.tif").mode)
    print(f"table {order} the pixels: {found[order][0]} for tifffile, mode {found[order][1]} for Pillow")
still = found == {"before": ("PALETTE", "P"), "after": ("MINISBLACK", "L")}
print("still so: the order of calls decides" if still else "changed: the order does not matter")
raise SystemExit(0 if still else 1)
PY
# Output seen:
# table before the pixels: PALETTE for tifffile, mode P for Pillow
# table after the pixels: MINISBLACK for tifffile, mode L for Pillow
# still so: the order of calls decides
