"""How good are meshes of rocks, ours and Gmsh's? Prints the section "quality" of docs/benchmarks.md.

python benchmarks/quality.py
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from figure_tables import FIGURES, Limit, limit_table, ours, row, table, theirs
from gmsh_routes import ROUTES
from imgquad_core.mesher.efforts import EFFORTS
from processes import FailedError, answer, mesh_picture
from rocks import SOURCE, draw_rock

SIDE, SIZE = 1024, 2.0
OTHER_SEEDS = (12, 13, 14, 15, 16)
PATIENCE = 120.0  #: seconds that Gmsh may take for a mesh, its start included
BEST_ROUTE = "subdivide-8"  #: of Gmsh's: the best that inverts nothing on B1
#: limits of B1 and B2 at an effort
LIMITS = {
    "B1 normal": (0.35, 0.80, 0.977, 0.9985, 0.011),
    "B1 best": (0.40, 0.82, 0.980, 0.9993, 0.008),
    "B2 normal": (0.30, 0.72, 0.96, 0.995, 0.03),
}
LIMITED = ("min SJ", "1 %", "mean SJ", "in [45,135]", "irregular")
Figures = dict[str, float] | FailedError


class Rock(NamedTuple):
    """A rock that is meshed."""

    name: str
    size: float = SIZE
    efforts: tuple[str, ...] = ("normal",)
    routes: tuple[str, ...] = ()
    drawing: Mapping[str, Any] = MappingProxyType({})
    options: tuple[Any, ...] = ()


B1 = Rock("B1", efforts=tuple(EFFORTS), routes=tuple(ROUTES))
B2 = B1._replace(name="B2", drawing={"veins": 4})
OTHERS = [Rock(f"seed {seed}", drawing={"seed": seed}) for seed in OTHER_SEEDS]
ROCKS = [B1, B2, *OTHERS]


def section(folder: Path) -> str:
    """Mesh all rocks; return the tables."""
    found = all_measured(ROCKS, folder)
    return "\n\n".join([SOURCE, figures_table(found), limits(found), spread(found)])


def all_measured(rocks: Iterable[Rock], folder: Path) -> dict[str, Figures]:
    """Mesh rocks one after the other."""
    return {name: figures for rock in rocks for name, figures in measured(rock, folder).items()}


def figures_table(found: Mapping[str, Figures]) -> str:
    """Return the table of all figures."""
    return table(("mesh", *FIGURES), (row(*item) for item in found.items()))


def measured(rock: Rock, folder: Path) -> dict[str, Figures]:
    """Mesh a rock at its efforts, then the boundaries of the mesh at normal effort by Gmsh's routes."""
    picture = draw_rock(folder / "rock.png", SIDE, **rock.drawing)
    found: dict[str, Figures] = {}
    for effort in rock.efforts:
        options = ("--size", rock.size, "--effort", effort, *rock.options)
        found[f"{rock.name} {effort}"] = ours(mesh_picture(picture, folder / f"{effort}.vtu", *options))
    for route in rock.routes:
        found[f"{rock.name} Gmsh {route}"] = of_gmsh(folder / "normal.vtu", route, rock.size)
    return found


def of_gmsh(mesh: Path, route: str, size: float) -> Figures:
    """Return the figures of Gmsh's mesh of the same boundaries, or why there is none."""
    try:
        return theirs(answer("gmsh_routes.py", mesh, route, timeout=PATIENCE), size)
    except FailedError as error:
        return error


def limits(found: dict[str, Figures]) -> str:
    """Return the figures of B1 and B2 beside their limits."""
    rows = []
    for where, values in LIMITS.items():
        figures = found[where]
        assert not isinstance(figures, FailedError)
        for figure, value in zip(LIMITED, values, strict=True):
            rows.append(Limit(figure, value, figure == "irregular").row(where, figures[figure], FIGURES[figure]))
        if where.startswith("B1"):
            rows.append(Limit("off area/size²", 0.08, True).row(where, abs(figures["× area/size²"] - 1), "{:.1%}"))
    return limit_table(rows)


def spread(found: dict[str, Figures]) -> str:
    """Return the worst of the other seeds beside B1: at most 10 % worse, and within the limits of B1."""
    rows = []
    for figure, value in zip(LIMITED, LIMITS["B1 normal"], strict=True):
        fewer = figure == "irregular"
        first: float = found["B1 normal"][figure]  # type: ignore[index]
        worst: float = (max if fewer else min)(found[f"seed {seed} normal"][figure] for seed in OTHER_SEEDS)  # type: ignore[index]
        worse = worst / first - 1 if fewer else 1 - worst / first
        met = worse <= 0.1 and Limit(figure, value, fewer).met(worst)
        form = FIGURES[figure].format
        rows.append([figure, form(first), form(worst), f"{worse:+.1%}", form(value), "yes" if met else "**no**"])
    worst_seed = f"worst of seeds {OTHER_SEEDS[0]} to {OTHER_SEEDS[-1]}"
    return table(("figure", "B1", worst_seed, "worse by (≤ 10 %)", "limit of B1", "met"), rows)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        print(section(Path(temporary)))
