#!/usr/bin/env bash
# mrcfile 1.5.4 gives the unsigned bytes of IMOD's files as signed ones, without a warning.
#
# A byte section (mode 0) of an MRC file written by IMOD is signed or unsigned by bit 0 of the flags at byte 156, where byte 152 has
# IMOD's stamp (https://bio3d.colorado.edu/imod/doc/mrc_format.txt); before IMOD 4.2.23 all were unsigned. The largest value of the
# header (byte 80) says the same.
# Expected: grey 200 is 200, or a warning.
# Seen:
#     values -56, header says up to 200; warnings: 0
# So the brightest half of a tomogram lies below the darkest: classes by grey values are other materials.
# We read such bytes as unsigned (`reading/volumes.py`).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check mrcfile==1.5.4 "numpy<3"
"$folder/bin/python" - "$folder/imod.mrc" <<'P'
import struct
import sys
import warnings

import mrcfile
import numpy as np

path = sys.argv[1]
with mrcfile.new(path) as file:
    file.set_data(np.full((20, 30), 200, np.uint8).view(np.int8))
content = bytearray(open(path, "rb").read())
struct.pack_into("<3f", content, 76, 200.0, 200.0, 200.0)  # least, largest, mean
struct.pack_into("<2i", content, 152, 1146047817, 0)  # IMOD, its bytes are unsigned
open(path, "wb").write(content)
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    with mrcfile.open(path) as file:
        value, largest = int(file.data[0, 0]), float(file.header.dmax)
print(f"values {value}, header says up to {largest:g}; warnings: {len(told)}")
if value != -56 or told:
    raise SystemExit("changed: the flag is heeded, or told of")
print("still so: unsigned bytes come as signed")
P
