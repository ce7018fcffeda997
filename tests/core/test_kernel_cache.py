"""Machine code on disk: a run goes on wherever it cannot be kept, and heals what was damaged."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

KERNELS = """
from imgquad_core.jit import kernel, verb

@verb
def one_more(x):
    return x + 1.0

@kernel
def double(x):
    return 2.0 * x

@kernel
def twice_and_one(x):
    return one_more(double(x))
"""
USE = "import kernels_here as k; print(k.twice_and_one(3.0), sum(k.twice_and_one.stats.cache_hits.values()))"
LIMIT = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (64, 64)); "


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a module of two kernels, whose machine code can be kept in `cache` beside it."""
    (tmp_path / "kernels_here.py").write_text(KERNELS, encoding="utf-8")
    (tmp_path / "temporary").mkdir()
    return tmp_path


def use(folder: Path, first: str = "", **environment: str) -> tuple[str, int, str]:
    """Call the kernel in a new process; return its result, how often its code came from disk, and what was said."""
    own = {
        "PYTHONDONTWRITEBYTECODE": "1",
        "NUMBA_CACHE_DIR": str(folder / "cache"),
        "TMPDIR": str(folder / "temporary"),
    }
    env = os.environ | own | environment | {"PYTHONPATH": os.pathsep.join([str(folder), *sys.path])}
    done = subprocess.run([sys.executable, "-c", first + USE], capture_output=True, text=True, env=env, check=False)
    assert done.returncode == 0, done.stderr
    result, hits = done.stdout.split()
    return result, int(hits), done.stderr


def nowhere(folder: Path) -> dict[str, str]:
    """Make `__pycache__` a file and let there be no home, as where packages and home are read-only."""
    (folder / "__pycache__").touch()
    return {"NUMBA_CACHE_DIR": "", "HOME": "/dev/null/none", "XDG_CACHE_HOME": "/dev/null/none"}


def test_code_is_kept_and_loaded_again(folder: Path) -> None:
    assert use(folder) == ("7.0", 0, "")
    assert use(folder) == ("7.0", 1, "")


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda data: b"",
    "cut": lambda data: data[: len(data) // 2],
    "zeros": lambda data: bytes(len(data)),
    "garbage": lambda data: bytes(range(256)) * (len(data) // 256 + 1),
    "one bit": lambda data: data[: len(data) // 2] + bytes([data[len(data) // 2] ^ 4]) + data[len(data) // 2 + 1 :],
    "of another": lambda data: b"\x80\x05]\x94.",
}


def test_damaged_code_is_compiled_again_and_heals(folder: Path) -> None:
    use(folder)
    for damage in DAMAGES.values():
        for kind in ("nbi", "nbc"):
            files = list((folder / "cache").rglob(f"*.{kind}"))
            assert files
            for file in files:
                file.write_bytes(damage(file.read_bytes()))
            assert use(folder) == ("7.0", 0, "")
    assert use(folder) == ("7.0", 1, "")


def test_code_of_another_signature_is_not_taken_for_this_ones(folder: Path) -> None:
    use(folder)
    one = next((folder / "cache").rglob("kernels_here.twice_and_one*.nbc"))
    other = next((folder / "cache").rglob("kernels_here.double*.nbc"))
    one.write_bytes(other.read_bytes())  # whole, but not the one that the index names
    assert use(folder) == ("7.0", 0, "")


def test_where_nothing_can_be_written_code_goes_to_temporary_files(folder: Path) -> None:
    here = nowhere(folder)
    result, hits, said = use(folder, **here)
    assert (result, hits) == ("7.0", 0)
    assert len(said.splitlines()) == 1
    assert str(folder / "temporary") in said
    assert use(folder, **here) == ("7.0", 1, "")


def test_where_no_folder_at_all_can_be_written_code_is_not_kept(folder: Path) -> None:
    here = nowhere(folder)
    (folder / "temporary" / f"imgquad-mesh-kernels-{os.getuid()}").touch()
    for _ in range(2):
        result, hits, said = use(folder, **here)
        assert (result, hits) == ("7.0", 0)
        assert len(said.splitlines()) == 1
        assert "NUMBA_CACHE_DIR" in said


def test_code_is_not_loaded_from_a_folder_that_others_can_write(folder: Path) -> None:
    here = nowhere(folder)
    use(folder, **here)
    (folder / "temporary" / f"imgquad-mesh-kernels-{os.getuid()}").chmod(0o777)
    result, hits, _ = use(folder, **here)
    assert (result, hits) == ("7.0", 0)


def test_a_full_disk_under_the_cache_stops_nothing(folder: Path) -> None:
    result, hits, said = use(folder, LIMIT)
    assert (result, hits) == ("7.0", 0)
    assert len(said.splitlines()) == 1
    assert "not kept" in said
    assert not list((folder / "cache").rglob("*.tmp.*"))
