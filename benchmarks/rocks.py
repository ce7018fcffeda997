"""The rocks that are meshed: Voronoi grains of 48 px in 7 colours, B1 without veins, B2 with veins of 1 and 2.5 px."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
from PIL import Image

from imgquad_mesh.cli.rock_picture import rock_labels
from processes import ROOT

#: the generator of B1 and B2; it is not part of this repository
GENERATOR = ROOT.parent / "shared" / "tools" / "make_synthetic.py"
GRAIN = 48
HAS_GENERATOR = GENERATOR.is_file()
SOURCE = (
    "Rocks: `make_synthetic.py --rock 1024x1024 --grain 48 --veins 0 --seed 11` is B1; `--veins 4` makes it B2."
    if HAS_GENERATOR
    else f"**No `{GENERATOR.name}` beside this repository: the rocks below are those of `imgquad-mesh demo`, "
    "with one vein and pores. B1, B2 and other seeds are left out; no figure here can be held against their limits.**"
)


def draw_rock(path: Path, side: int, *, veins: int = 0, noise: float = 0.0, seed: int = 11) -> Path:
    """Write a square picture of a rock; return `path`."""
    if HAS_GENERATOR:
        draw = runpy.run_path(str(GENERATOR))["rock"]
        labels = draw(side, side, grain=float(GRAIN), veins=veins, noise=noise, seed=seed)[0]
    else:
        labels = rock_labels(side, side, GRAIN, noise)
    picture = Image.fromarray(np.asarray(labels, np.uint8))
    picture.putpalette([value for k in range(16) for value in (37 * k % 256, 91 * k % 256, 151 * k % 256)])
    picture.save(path)
    return path
