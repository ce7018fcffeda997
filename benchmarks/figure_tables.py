"""Tables in Markdown, and the figures that they show of a mesh."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from processes import FailedError

#: figures of a mesh: title, and how its value is printed
FIGURES = {
    "quads": "{:,.0f}",
    "× area/size²": "{:.2f}",
    "min SJ": "{:.3f}",
    "0.1 %": "{:.3f}",
    "1 %": "{:.3f}",
    "mean SJ": "{:.4f}",
    "inverted": "{:.0f}",
    "in [45,135]": "{:.3%}",
    "irregular": "{:.2%}",
    "area error": "{:.3%}",
    "kquad/s": "{:.0f}",
    "s in all": "{:.1f}",
    "MB": "{:.0f}",
}
NONE = "–"


class Limit(NamedTuple):
    """What a figure has to reach."""

    figure: str
    value: float
    at_most: bool  #: else at least

    def met(self, found: float) -> bool:
        return found <= self.value if self.at_most else found >= self.value

    def row(self, where: str, found: float, form: str) -> list[str]:
        sign = "≤" if self.at_most else "≥"
        limit, value = form.format(self.value), form.format(found)
        return [where, self.figure, f"{sign} {limit}", value, "yes" if self.met(found) else "**no**"]


def table(titles: Sequence[str], rows: Iterable[Sequence[str]], words: int = 1) -> str:
    """Return a table whose first columns, of `words`, are on the left, the others on the right."""
    marks = ["---"] * words + ["---:"] * (len(titles) - words)
    return "\n".join("| " + " | ".join(line) + " |" for line in (titles, marks, *rows)) + "\n"


def limit_table(rows: Iterable[Sequence[str]]) -> str:
    """Return the table of rows of `Limit`s."""
    return table(("where", "figure", "limit", "found", "met"), rows, words=2)


def put_into(path: Path, part: str, text: str) -> None:
    """Put `text` between the two marks of a part of a page."""
    path.write_text(replaced(path.read_text(encoding="utf-8"), part, text), encoding="utf-8")


def replaced(page: str, part: str, text: str) -> str:
    """Return the page with `text` between the two marks of a part."""
    begin, end = (f"<!-- {word}: {part} -->\n" for word in ("begin", "end"))
    if page.count(begin) != 1 or page.count(end) != 1:
        raise SystemExit(f"the page needs the lines {begin.strip()} and {end.strip()} once each: put them in")
    before, rest = page.split(begin)
    return f"{before}{begin}\n{text}\n{end}{rest.split(end)[1]}"


def ours(report: dict[str, Any]) -> dict[str, float]:
    """Return the `FIGURES` of a report of `imgquad-mesh run`."""
    wanted = sum(row["clean_pixels"] for row in report["materials"]) / report["options"]["size"] ** 2
    seconds = report["seconds"]
    return {
        **_shape(report["quality"], wanted),
        "area error": max(abs(row["error"]) for row in report["materials"]),
        "kquad/s": report["quality"]["n_quads"] / seconds["mesh"] / 1e3,
        "s in all": seconds["total"],
        "MB": report["peak_memory_mb"],
    }


def theirs(found: dict[str, Any], size: float) -> dict[str, float]:
    """Return the `FIGURES` of an answer of gmsh_routes.py; it has no pictures and no materials."""
    speed = found["quality"]["n_quads"] / found["seconds"] / 1e3
    return {**_shape(found["quality"], found["area"] / size**2), "kquad/s": speed, "MB": found["peak_memory_mb"]}


def row(name: str, figures: dict[str, float] | FailedError) -> list[str]:
    """Return the row of one mesh, or of none with the reason."""
    if isinstance(figures, FailedError):
        return [f"{name}: {figures}", *[NONE] * len(FIGURES)]
    return [name, *(form.format(figures[f]) if f in figures else NONE for f, form in FIGURES.items())]


def _shape(quality: dict[str, Any], wanted: float) -> dict[str, float]:
    return {
        "quads": quality["n_quads"],
        "× area/size²": quality["n_quads"] / wanted,
        "min SJ": quality["min_sj"],
        "0.1 %": quality["sj_0_1_percent"],
        "1 %": quality["sj_1_percent"],
        "mean SJ": quality["mean_sj"],
        "inverted": quality["inverted"],
        "in [45,135]": quality["good_angles"],
        "irregular": quality["irregular"],
    }
