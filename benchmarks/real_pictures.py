"""How good are meshes of real pictures, ours and Gmsh's? Prints the section "pictures" of docs/benchmarks.md.

    python benchmarks/real_pictures.py [FOLDER]
    python benchmarks/real_pictures.py --judge RECORDS [--only NAME ...] [--out docs/sizes.md]

The second one meshes the pictures at four sizes and three tolerances, has each mesh judged by a program that has no
code of this project, and prints the section "judged". What stands in the file RECORDS, a line a mesh, is not done
again.
"""

from __future__ import annotations

import argparse
import json
import resource
import runpy
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from figure_tables import FIGURES, NONE, Limit, limit_table, ours, put_into, table
from imgquad_mesh.__main__ import main as command
from processes import ROOT, FailedError, mesh_picture
from pyvista_pictures import PICTURES
from quality import BEST_ROUTE, Figures, figures_table, of_gmsh
from size_field import field_integral

FOLDER = ROOT.parent / "shared" / "images"
JUDGE = ROOT.parent / "shared" / "tools" / "judge.py"
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
#: of the judged runs; the size is multiplied by the latter. Least number first: the quickest meshes
JUDGED_SIZES, TOLERANCES = (32.0, 16.0, 5.0, 2.0), (1.0, 0.5, 0.0)
LEAST_SJ_TOLERANT = 0.45
#: of a material's area may be off where it gives away less than the latter share
MOST_OFF, MOST_GIVEN = 0.025, 0.1
#: pictures that are cropped for the judged runs: all of it at size 2 would be six million quads
CROPPED = {"oof2_grains_large_5000": "0,0,2000,2000"}


def section(folder: Path, pictures: Path = FOLDER) -> str:
    """Mesh all pictures; return the tables."""
    if not pictures.is_dir():
        return f"**No real pictures: there is no folder {pictures.name}. Nothing is measured here.**\n"
    found: dict[str, Figures] = {}
    for picture in pictures_of(pictures):
        for size in LARGE.get(picture.stem, SIZES):
            found |= measured(picture, size, folder)
    note = (
        f"Gmsh meshes the same boundaries by {BEST_ROUTE}, at size {GMSH_SIZE:g} where we make at most {MOST_QUADS:,} "
        "quads: more would take it minutes.\n"
    )
    return "\n".join([note, figures_table(found), limits(found)])


def pictures_of(folder: Path) -> list[Path]:
    """Return the pictures of a folder, by name."""
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in PICTURES)


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


class Judged(NamedTuple):
    """One mesh that is judged."""

    picture: str
    size: float
    tolerance: float
    triangulator: str = "auto"


def judged_runs(pictures: Path, only: Iterable[str]) -> Iterator[tuple[Path, Judged]]:
    """Name the runs, those of the coarsest meshes first."""
    chosen = sorted(pictures_of(pictures), key=lambda path: path.stat().st_size)
    wanted = set(only)
    for share in TOLERANCES:
        for size in JUDGED_SIZES:
            for path in chosen:
                if not wanted or path.stem in wanted:
                    yield path, Judged(path.stem, size, share * size)


def judge_all(records: Path, pictures: Path, only: Iterable[str]) -> dict[Judged, dict[str, Any]]:
    """Mesh and judge what is not in the records yet; return all of them."""
    found = (
        {Judged(*row["run"]): row for row in map(json.loads, records.read_text().splitlines())}
        if records.exists()
        else {}
    )
    with tempfile.TemporaryDirectory() as folder, records.open("a", encoding="utf-8") as file:
        for path, run in judged_runs(pictures, only):
            if run not in found:
                found[run] = {"run": run, **judged(path, run, Path(folder))}
                print(json.dumps(found[run], default=float), file=file, flush=True)
    return found


def judged(picture: Path, run: Judged, folder: Path) -> dict[str, Any]:
    """Mesh a picture by the command, in this process; return what the judge and the report say."""
    mesh, labels, report = folder / "mesh.vtu", folder / "labels.npy", folder / "mesh.json"
    crop = ["--crop", CROPPED[run.picture]] if run.picture in CROPPED else []
    options = ["--size", run.size, "--tolerance", run.tolerance, "--triangulator", run.triangulator, *crop]
    options += ["--labels-out", labels, "--report", report]
    before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    if code := command(["run", *map(str, [picture, mesh, "--quiet", *options])]):
        return {"failed": f"exit code {code}"}
    seconds = resource.getrusage(resource.RUSAGE_SELF).ru_utime - before
    judge = runpy.run_path(str(JUDGE))
    points, quads, material, _ = judge["load"](mesh)
    edges, number, a, b = judge["edges_of"](quads)
    rim = edges[(number == 1) | (material[a] != material[b])]
    told = json.loads(report.read_text(encoding="utf-8"))
    absorbed = {told_of["material"]: told_of for told_of in told["absorbed"]}
    names = {row["material"]: row["name"] for row in told["materials"]}
    lost = [m for m, row in names.items() if not next(r for r in told["materials"] if r["material"] == m)["quads"]]
    said = " ".join(told["notes"])
    return {
        **judge["judge"](mesh, np.load(labels)),
        "field": field_integral(points[:, :2], quads, rim, run.size),
        "cpu": seconds,
        "regions": told["counts"]["regions"],
        "area_off": max(
            (off for row in told["materials"] if (off := _area_off(row, absorbed)) is not None), default=0.0
        ),
        "lost": [names[m] for m in lost],
        "lost_in_silence": [names[m] for m in lost if m not in absorbed or names[m] not in said],
        "moved": sum(row["lost"] for row in absorbed.values())
        / max(1, sum(row["pixels"] for row in absorbed.values())),
        "stages": told["seconds"],
    }


def _area_off(row: dict[str, Any], absorbed: dict[int, dict[str, Any]]) -> float | None:
    """Return by which share a material's area is off, where it keeps most of its pixels.

    Regions keep the area that they had, and what is absorbed goes to others: either counts as right.
    """
    lost = absorbed[row["material"]]["lost"] if absorbed else 0
    if lost >= MOST_GIVEN * row["pixels"]:
        return None
    return min(abs(row["mesh_area"] / pixels - 1.0) for pixels in (row["pixels"], row["clean_pixels"]))


def judged_section(found: dict[Judged, dict[str, Any]]) -> str:
    """Return the table of judged meshes: a line a picture and size, and the limits."""
    pairs = sorted({(run.picture, run.size) for run in found})
    rows = []
    for picture, size in pairs:
        three = [found.get(Judged(picture, size, share * size)) for share in reversed(TOLERANCES)]
        rows.append([f"{picture} {size:g}", *(cell for one in three for cell in _cells(one))])
    titles = ["picture, size"]
    for name in ("as it is", "tolerance size / 2", "tolerance size"):
        titles += [f"quads, {name}", "/ field", "min SJ"]
    return "\n".join([table(titles, rows), judged_limits(found)])


def _cells(found: dict[str, Any] | None) -> list[str]:
    if found is None or "failed" in found:
        return [NONE if found is None else found["failed"], NONE, NONE]
    mark = "" if found["valid"] else " **invalid**"
    return [f"{found['quads']:,}{mark}", f"{found['quads'] / found['field']:.2f}", f"{found['min_sj']:.3f}"]


def judged_limits(found: dict[Judged, dict[str, Any]]) -> str:
    """Return what all judged meshes must keep."""
    good = {run: row for run, row in found.items() if "failed" not in row}
    tolerant = {run: row["min_sj"] for run, row in good.items() if run.tolerance > 0.0}
    exact = {run: row["min_sj"] for run, row in good.items() if run.tolerance == 0.0}
    rows = [
        Limit("without a mesh", 0, True).row("all", len(found) - len(good), "{:.0f}"),
        Limit("invalid", 0, True).row("all", sum(not row["valid"] for row in good.values()), "{:.0f}"),
        Limit("materials lost in silence", 0, True).row(
            "all", sum(len(row["lost_in_silence"]) for row in good.values()), "{:.0f}"
        ),
    ]
    for run in sorted((run for run in good if "area_off" in good[run]), key=lambda run: -good[run]["area_off"])[:5]:
        where = f"{run.picture} {run.size:g}, tolerance {run.tolerance:g}"
        rows.append(Limit("area of a material off", MOST_OFF, True).row(where, good[run]["area_off"], "{:.2%}"))
    for what, figures in (("tolerance", tolerant), ("as it is", exact)):
        for run in sorted(figures, key=lambda run: figures[run])[:5]:
            where = f"{run.picture} {run.size:g}, {what} {run.tolerance:g}"
            rows.append(Limit("min SJ", LEAST_SJ_TOLERANT, False).row(where, figures[run], "{:.3f}"))
    return limit_table(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=FOLDER, help="of pictures")
    parser.add_argument("--judge", type=Path, metavar="RECORDS", help="mesh at several sizes and tolerances and judge")
    parser.add_argument("--only", nargs="*", default=(), metavar="NAME", help="pictures that are judged")
    parser.add_argument("--out", type=Path, metavar="PAGE", help="page that holds the marks of what was judged")
    given = parser.parse_args()
    if given.judge:
        text = judged_section(judge_all(given.judge, given.folder, given.only))
        print(text)
        if given.out:
            put_into(given.out, "judged", text)
        return
    with tempfile.TemporaryDirectory() as temporary:
        print(section(Path(temporary), given.folder))


if __name__ == "__main__":
    main()
