"""Memory of child processes: limits, and what is given back."""

from __future__ import annotations

import os
import platform
import subprocess
import sys

import pytest

KEEPING = """
import numpy as np, sys
from imgquad_mesh.memory import give_large_blocks_back

def used():
    return int(open("/proc/self/statm").read().split()[1]) * 4096

if sys.argv[1] == "back":
    give_large_blocks_back()
np.ones(3_000_000)  # 24 MB: glibc takes smaller blocks for small ones from here on
before = used()
blocks = [np.ones(1_000_000) for _ in range(10)]
last = [np.ones(10_000) for _ in range(100)]  # some stand behind them
del blocks
print(used() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="of glibc only")
def test_large_blocks_go_back_to_the_system() -> None:
    # Dask's nanny sets MALLOC_TRIM_THRESHOLD_ in the process that starts it, here the one of the tests before: with it
    # glibc takes no block for a small one.
    env = {name: value for name, value in os.environ.items() if not name.startswith(("MALLOC_", "GLIBC_TUNABLES"))}
    kept = {
        how: int(
            subprocess.run(
                [sys.executable, "-c", KEEPING, how], capture_output=True, text=True, check=True, env=env
            ).stdout
        )
        for how in ("back", "as it is")
    }
    assert kept["back"] < 20e6 < kept["as it is"]
