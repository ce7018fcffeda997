"""What the command shows: the report as a short table."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rich.console import Console
from rich.table import Table

import imgquad_core as core


def announce_compiling() -> None:
    """Say so if this is the first run, which takes longer."""
    if core.pipeline.share_compiled() < 0.5:
        Console(stderr=True).print("first run on this machine: compiling the kernels takes up to a minute, once")


def print_report(report: dict[str, Any]) -> None:
    """Print the report's figures as a short table."""
    console = Console(highlight=False)
    table = Table("material", "pixels", "as meshed", "mesh area", "error", "quads", box=None, pad_edge=False)
    for column in table.columns[1:]:
        column.justify = "right"
    rows = sorted(report["materials"], key=lambda row: -row["pixels"])
    for row in rows[:12]:
        meshed = (f"{row['mesh_area']:.1f}", f"{row['error']:+.3%}") if row["clean_pixels"] else ("-", "-")
        name = row["name"] if row["name"] == str(row["material"]) else f"{row['material']} {row['name']}"
        table.add_row(name, str(row["pixels"]), str(row["clean_pixels"]), *meshed, str(row["quads"]))
    console.print(table)
    if len(rows) > 12:
        console.print(f"... and {len(rows) - 12} more materials, see --report")
    for line in _lines(report):
        console.print(line, markup=False, soft_wrap=True)
    for text in report["warnings"]:
        Console(stderr=True, highlight=False).print(f"warning: {text}", markup=False, soft_wrap=True)


def _lines(report: dict[str, Any]) -> Iterator[str]:
    quality, counts, seconds = report["quality"], report["counts"], report["seconds"]
    yield from report["notes"]
    yield (
        f"{quality['n_quads']} quads, {quality['n_points']} nodes, {counts['regions']['meshed']} regions, "
        f"{counts['junctions']['meshed']} junctions"
    )
    yield (
        f"scaled Jacobian: min {quality['min_sj']:.3f}, 0.1 % {quality['sj_0_1_percent']:.3f}, "
        f"1 % {quality['sj_1_percent']:.3f}, mean {quality['mean_sj']:.3f}; "
        f"angles {quality['min_angle']:.0f} to {quality['max_angle']:.0f} degrees, "
        f"{quality['good_angles']:.2%} of quads within 45 to 135"
    )
    yield f"irregular inner nodes {quality['irregular']:.2%}, longest by shortest edge {quality['max_aspect']:.2f}"
    yield "seconds: " + ", ".join(f"{stage} {value:.2f}" for stage, value in seconds.items())
    yield f"wrote {report['output']}"
