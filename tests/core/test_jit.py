"""The two ways to compile, and the second process at the first start."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path
from threading import Timer

import numpy as np
import pytest

from imgquad_core import ahead
from imgquad_core.arrays import Floats
from imgquad_core.jit import kernel, verb


@verb
def _double(x: float) -> float:
    return 2.0 * x


@verb
def _plus(x: float, y: int) -> float:
    return x + y


@kernel
def _use_both(x: float) -> float:
    return _plus(_double(x), 1) + _plus(x, 2)


def test_kernels_use_verbs() -> None:
    assert _use_both(1.5) == 7.5


def test_a_verb_refuses_calls_from_python() -> None:
    _use_both(1.0)  # compiled or not: the answer is the same
    with pytest.raises(TypeError, match="_double is a verb"):
        _double(1.0)


def test_written_numbers_do_not_compile_a_kernel_again() -> None:
    @kernel
    def add(a: int, b: int) -> int:
        return a + b

    @kernel
    def sums(x: int) -> int:
        return add(x, 1) + add(x, 2) + add(3, x)

    assert sums(1) == 9
    assert len(add.signatures) == 1


@verb
def _row(a: Floats, i: int) -> Floats:
    return a[i]


@kernel
def _total(a: Floats) -> float:
    total = 0.0
    for i in range(len(a)):
        total += _row(a, i)[0]
    return total


@kernel
def _made(n: int) -> Floats:
    return np.ones(n)


@kernel
def _length_of_made(n: int) -> int:
    made = _made(n)  # gone at the end, though nothing here makes an array
    return len(made)


@kernel
def _given(a: Floats) -> tuple[Floats, float]:
    return a, a[0, 0]


def test_arrays_live_as_long_as_they_are_used() -> None:
    from numba.core.runtime import _nrt_python, rtsys

    _nrt_python.memsys_enable_stats()
    a = np.ones((3, 2))
    before, blocks = sys.getrefcount(a), rtsys.get_allocation_stats()
    for _ in range(50):
        assert _total(a) == 3.0
        assert _length_of_made(7) == 7
        assert _given(a)[0] is a
        assert _made(4).sum() == 4.0
    after = rtsys.get_allocation_stats()
    _nrt_python.memsys_disable_stats()
    assert sys.getrefcount(a) == before
    assert after.mi_alloc - blocks.mi_alloc == after.mi_free - blocks.mi_free > 0


SHARE = "import imgquad_core.pipeline; from imgquad_core.jit import share_on_disk; print(share_on_disk())"


def test_nothing_is_on_disk_at_the_first_start(tmp_path: Path) -> None:
    fresh = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", SHARE], capture_output=True, text=True, check=True, env=fresh)
    assert float(done.stdout) == 0.0


AHEAD = """
from imgquad_core import ahead, mesh_image, MeshOptions
from imgquad_core.cleanup import irregular_nodes, relaxation, sliding, worst_quads
from imgquad_core.mesher import composing, crossfield, cutting, frontal, splitting, warm_up
import numpy as np
warm_up.compile_first_quads()
warm_up.compile_last_stages()
modules = (relaxation, worst_quads, sliding, splitting, irregular_nodes, composing, crossfield, cutting, frontal)
kernels = [k for m in modules for k in vars(m).values() if hasattr(k, "signatures")]
before = {id(k): len(k.signatures) for k in kernels}
labels = np.zeros((40, 60), np.int32)
labels[10:30, 15:40] = 1
mesh_image(labels, MeshOptions(size=2.0))
print(sorted(k.__name__ for k in kernels if before[id(k)] and len(k.signatures) > before[id(k)]))
names = ("_advance", "_clean_pass", "_repair_pass", "newton", "slide")
print(sorted(k.__name__ for k in kernels if before[id(k)] and k.__name__ in names))
from imgquad_core.jit import share_on_disk
print(share_on_disk() > ahead.FIRST_START)
"""


def test_the_second_process_compiles_what_the_first_one_calls() -> None:
    done = subprocess.run([sys.executable, "-c", AHEAD], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["[]", "['_advance', '_clean_pass', '_repair_pass', 'newton', 'slide']", "True"]


def test_the_second_process_is_of_this_package_in_any_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clone = tmp_path / "imgquad_core"  # as in a clone of the repository, while another copy is installed
    clone.mkdir()
    (clone / "__init__.py").touch()
    (clone / "ahead.py").write_text("raise SystemExit(3)", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(ahead, "share_on_disk", lambda: 0.0)
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    process = ahead.start.__wrapped__()
    ahead.end_turn()
    assert process is not None
    assert process.wait(ahead.LONGEST) == 0


def test_first_starts_side_by_side_wait_for_each_other(tmp_path: Path) -> None:
    fcntl = pytest.importorskip("fcntl")
    kernels = tmp_path / "kernels"
    kernels.mkdir()
    other = os.open(kernels, os.O_RDONLY)
    fcntl.flock(other, fcntl.LOCK_EX)
    ahead.take_turn(kernels, 0.2)
    assert not ahead._HELD  # patience is over: it compiles, too
    Timer(0.2, os.close, [other]).start()
    ahead.take_turn(kernels, 60.0)
    assert len(ahead._HELD) == 1
    again = os.open(kernels, os.O_RDONLY)
    with pytest.raises(BlockingIOError):
        fcntl.flock(again, fcntl.LOCK_EX | fcntl.LOCK_NB)
    ahead.end_turn()
    fcntl.flock(again, fcntl.LOCK_EX | fcntl.LOCK_NB)
    os.close(again)


def test_arrays_that_may_be_read_only_compile_no_kernel_again() -> None:
    from imgquad_core.cleanup.relaxation import rings_of

    quads = np.array([[0, 1, 2, 3]])
    quads.flags.writeable = False
    assert rings_of(quads, 4).quads.flags.writeable


def test_with_a_numba_that_lowering_does_not_know_kernels_compile_as_they_are(tmp_path: Path) -> None:
    code = """
import numba
numba.__version__ = "99.1.0"
import sys
import numpy as np
from imgquad_core.geometry.quad_shape import nodes_of_poor
points, quads = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), np.arange(4)[None, :]
print(nodes_of_poor(points, quads, 0.5).tolist(), "imgquad_core.lowering" in sys.modules)
"""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    assert done.stdout == "[False, False, False, False] False\n", done.stderr


KERNELS = """
from typing import NamedTuple
import numpy as np
from imgquad_core.jit import kernel, verb

class Pair(NamedTuple):
    counts: np.ndarray
    total: float

@verb
def _half(x):
    return 0.5 * x

@kernel
def inner(n):
    counts = np.arange(n)
    return Pair(counts, _half(counts.sum()))

@kernel
def outer(n):
    return inner(n).total + inner(n + 1).counts[-1]
"""
CALLS = {
    "compiled": "print(inner(4))",
    "loaded": "print(inner(4), outer(4))",
    "all loaded": "print(outer(4), inner(4))",
}


def test_a_kernel_from_disk_is_called_and_becomes_part_of_others(tmp_path: Path) -> None:
    (tmp_path / "some_kernels.py").write_text(KERNELS, encoding="utf-8")
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(tmp_path)}
    hits = "print(sum(inner.stats.cache_hits.values()), sum(outer.stats.cache_hits.values()))"
    told = []
    for calls in CALLS.values():
        command = [sys.executable, "-c", f"from some_kernels import *\n{calls}\n{hits}"]
        told.append(subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout)
    pair = "Pair(counts=array([0, 1, 2, 3]), total=3.0)"
    assert told == [f"{pair}\n0 0\n", f"{pair} 7.0\n1 0\n", f"7.0 {pair}\n1 1\n"]


def test_a_kernel_is_given_to_numba_when_it_is_called() -> None:
    code = "from imgquad_core import jit, pipeline; print(len(jit._KERNELS) > 50, any(k._made for k in jit._KERNELS))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "True False\n"


def test_kernels_are_pickled_by_name() -> None:
    assert pickle.loads(pickle.dumps(_use_both)) is _use_both
