"""How good are meshes of real pictures, ours and Gmsh's? Prints the section "pictures" of docs/benchmarks.md.

python benchmarks/real_pictures.py [FOLDER]
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from figure_tables import FIGURES, Limit, limit_table, ours
from processes import ROOT, FailedError, mesh_picture
from pyvista_pictures import PICTURES
from quality import BEST_ROUTE, Figures, figures_table, of_gmsh

FOLDER = ROOT.parent / "shared" / "images"
SIZES = (2.0, 5.0)
#: Gmsh takes minutes at the smaller size, and of more quads
GMSH_SIZE, MOST_QUADS = 5.0, 500_000
LARGE = {"oof2_grains_large_5000": (4.0,)}
#: pictures with clean boundaries
CLEAN = (
    "rock_sandstone_labels_2a",
    "composite_weave_labels_z75",
    "im2mesh_7phases",
    "geology_hamersley_west",
    "steel_duplex_ebsd_phase",
    "concrete_crack_segmented",
    "brain_labels_s01_axial",
)
LEAST_SJ, LEAST_SJ_CLEAN, GOOD_ANGLES_CLEAN = 0.3, 0.4, 0.99


def section(folder: Path, pictures: Path = FOLDER) -> str:
    """Mesh all pictures; return the tables."""
    if not pictures.is_dir():
        return f"**No real pictures: there is no folder {pictures.name}. Nothing is measured here.**\n"
    found: dict[str, Figures] = {}
    for picture in sorted(p for p in pictures.iterdir() if p.suffix.lower() in PICTURES):
        for size in LARGE.get(picture.stem, SIZES):
            found |= measured(picture, size, folder)
    note = (
        f"Gmsh meshes the same boundaries by {BEST_ROUTE}, at size {GMSH_SIZE:g} where we make at most {MOST_QUADS:,} "
        "quads: more would take it minutes.\n"
    )
    return "\n".join([note, figures_table(found), limits(found)])


def measured(picture: Path, size: float, folder: Path) -> dict[str, Figures]:
    """Mesh a picture, then its boundaries by Gmsh."""
    name = f"{picture.stem} {size:g}"
    try:
        mine: Figures = ours(mesh_picture(picture, folder / "mesh.vtu", "--size", size))
    except FailedError as error:
        return {name: error}
    if size != GMSH_SIZE or mine["quads"] > MOST_QUADS:
        return {name: mine}
    return {name: mine, f"{name} Gmsh": of_gmsh(folder / "mesh.vtu", BEST_ROUTE, size)}


def limits(found: dict[str, Figures]) -> str:
    """Return the pictures that miss a limit, worst first, or the worst one that meets it."""
    good = {name: f for name, f in found.items() if not name.endswith("Gmsh") and not isinstance(f, FailedError)}
    clean = {name: f for name, f in good.items() if name.startswith(CLEAN)}
    rows = []
    for names, figure, least in (
        (good, "min SJ", LEAST_SJ),
        (clean, "min SJ", LEAST_SJ_CLEAN),
        (clean, "in [45,135]", GOOD_ANGLES_CLEAN),
    ):
        worst = sorted(names, key=lambda name: names[name][figure])
        missing = [name for name in worst if names[name][figure] < least]
        for name in missing or worst[:1]:
            where = f"{name}, of {'the clean' if names is clean else 'all'}"
            rows.append(Limit(figure, least, False).row(where, names[name][figure], FIGURES[figure]))
    failed = sum(isinstance(f, FailedError) for name, f in found.items() if not name.endswith("Gmsh"))
    return limit_table([*rows, Limit("pictures without a mesh", 0, True).row("all", failed, "{:.0f}")])


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        print(section(Path(temporary), *map(Path, sys.argv[1:2])))
