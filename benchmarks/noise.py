"""What does noise cost, and what does its removal save? Prints the section "noise" of docs/benchmarks.md.

python benchmarks/noise.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from quality import BEST_ROUTE, Rock, all_measured, figures_table
from rocks import SOURCE

NOISE = {"veins": 4, "noise": 0.05}
REMOVAL = ("--min-pixels", 16, "--min-length", 8)
ROCKS = [
    Rock("noise removed", 4.0, routes=(BEST_ROUTE,), drawing=NOISE, options=REMOVAL),
    Rock("noise kept", 4.0, routes=(BEST_ROUTE,), drawing=NOISE),
]


def section(folder: Path) -> str:
    """Mesh a noisy rock with and without removal of noise; return the table."""
    removal = " ".join(map(str, REMOVAL))
    note = f"Veins, 5 % of the pixels of a wrong colour (`--veins 4 --noise 0.05`), size 4; removed by `{removal}`."
    return f"{SOURCE} {note}\n\n{figures_table(all_measured(ROCKS, folder))}"


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        print(section(Path(temporary)))
