"""A campaign against the promises of docs/promises.md: kills, full disks, damaged caches, odd input. Prints a table.

python benchmarks/faults.py                            every section, as often as stands in SECTIONS
python benchmarks/faults.py kills meshes --seed 7      some of them, with another seed
python benchmarks/faults.py --share 0.02               a slice: 2 % of the trials of each (one at least)

A trial fails by an `AssertionError` or any other exception; the first failures are printed with what repeats them.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from PIL import Image

if TYPE_CHECKING:
    from imgquad_core import MeshOptions
    from imgquad_core.orientation import Turn
    from imgquad_core.pipeline import Run

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests")]

Generator = np.random.Generator
MESH_FORMATS = (".vtu", ".vtk", ".vtkhdf", ".inp", ".msh", ".bdf", ".e", ".npz", ".svg", ".obj", ".ply", ".dxf")
COMMAND = [sys.executable, "-m", "imgquad_mesh"]
MOST_SECONDS = 300


def path() -> str:
    """PYTHONPATH of the processes that are started: this checkout."""
    return os.pathsep.join([str(ROOT), str(ROOT / "plugin"), os.environ.get("PYTHONPATH", "")])


def command(folder: Path, *arguments: object, **environment: str) -> subprocess.Popen[str]:
    """Start the command in `folder`."""
    env = os.environ | {"PYTHONPATH": path(), "PYTHONDONTWRITEBYTECODE": "1"} | environment
    pipe = subprocess.PIPE
    return subprocess.Popen([*COMMAND, *map(str, arguments)], cwd=folder, env=env, stdout=pipe, stderr=pipe, text=True)


def leftovers(folder: Path) -> list[str]:
    """Names of what an ended process left of unfinished files."""
    return [file.name for file in folder.rglob(".imgquad-*")]


def draw_labels(rng: Generator) -> np.ndarray:
    """Return an odd label picture: noise, checkerboards, stripes, dots, arms, spirals, lines, cells, void."""
    from support.labels import KINDS, labels_of_kind

    rows, cols, colors = (int(n) for n in (rng.integers(1, 49), rng.integers(1, 49), rng.integers(1, 8)))
    return labels_of_kind(str(rng.choice(KINDS)), rows, cols, colors, int(rng.integers(1 << 30)))


def draw_options(rng: Generator, **more: object) -> dict[str, object]:
    """Return options of a mesh within their limits."""
    return {
        "size": float(rng.choice([1.0, 2.5, 6.0])),
        "effort": str(rng.choice(["fast", "normal", "best"])),
        "policy": str(rng.choice(["minority", "majority", "lower", "diagonal", "junction"])),
        **more,
    }


def picture_file(folder: Path, rng: Generator, side: int = 60) -> Path:
    """Save a picture of blobs."""
    y, x = np.mgrid[:side, :side]
    centres = rng.uniform(0, side, (12, 2))
    labels = ((y[..., None] - centres[:, 0]) ** 2 + (x[..., None] - centres[:, 1]) ** 2).argmin(axis=2) % 4
    Image.fromarray((labels * 80).astype(np.uint8)).save(folder / "in.png")
    return folder / "in.png"


# --------------------------------------------------------------------------------------------------- sections


def kills(rng: Generator, folder: Path) -> None:
    """Five signals at random moments: each output is the old one or the whole new one, only SIGKILL leaves anything."""
    picture_file(folder, rng)
    outputs = {
        "mesh": folder / f"m{rng.choice(MESH_FORMATS)}",
        "report": folder / "m.json",
        "picture": folder / "p.png",
    }
    arguments = ["run", "in.png", outputs["mesh"], "--report", "m.json", "--picture", "p.png", "--quiet"]
    start = time.perf_counter()
    process = command(folder, *arguments)
    said = process.communicate(timeout=MOST_SECONDS)[1]
    assert process.returncode == 0, said
    lasts = time.perf_counter() - start
    whole = {name: file.read_bytes() for name, file in outputs.items()}
    for _ in range(5):
        for file in outputs.values():
            file.write_bytes(b"old")
        kill(rng, folder, command(folder, *arguments), lasts)
        for name, file in outputs.items():
            now = file.read_bytes()
            is_new = bool(json.loads(now)) if name == "report" and now != b"old" else now == whole[name]  # it has times
            assert now == b"old" or is_new, f"{name} is neither old nor whole"
        for left in folder.glob(".imgquad-*"):  # of SIGKILL
            shutil.rmtree(left)


def kill(rng: Generator, folder: Path, process: subprocess.Popen[str], lasts: float) -> None:
    """Send a signal to a command that would last so many seconds, and judge how it ends."""
    number = int(rng.choice([signal.SIGKILL, signal.SIGTERM, signal.SIGHUP, signal.SIGINT]))
    time.sleep(float(rng.uniform(0.3, 1.0)) * lasts)
    process.send_signal(number)
    said = process.communicate(timeout=MOST_SECONDS)[1]
    assert process.returncode in (0, -number, 128 + number), (process.returncode, said)
    assert number == signal.SIGKILL or not leftovers(folder), leftovers(folder)
    assert "Traceback" not in said, said


LATE = """
import json, os, signal, sys, time
from pathlib import Path
import numpy as np
from imgquad_mesh.__main__ import main

rng, arguments, outputs = np.random.default_rng(int(sys.argv[1])), sys.argv[2:], [Path(n) for n in sys.argv[4:9:2]]
assert main(arguments) == 0
whole = [file.read_bytes() for file in outputs]
begin = time.perf_counter()
assert main(arguments) == 0  # all is loaded now
lasts = time.perf_counter() - begin
said = os.open("said", os.O_RDWR | os.O_CREAT)
for _ in range(20):
    for file in outputs:
        file.write_bytes(b"old")
    os.ftruncate(said, 0)
    child = os.fork()
    if not child:
        os.dup2(said, 2)
        os._exit(main(arguments))
    number = int(rng.choice([signal.SIGKILL, signal.SIGTERM, signal.SIGHUP, signal.SIGINT]))
    time.sleep(0.05 + rng.uniform(0.0, 1.2) * lasts)  # it handles signals by then
    os.kill(child, number)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert code in (0, -number, 128 + number), (number, code, Path("said").read_text())
    assert "Traceback" not in Path("said").read_text(), Path("said").read_text()
    for file, new in zip(outputs, whole):
        now = file.read_bytes()
        assert now in (b"old", new) or (file.suffix == ".json" and json.loads(now)), f"{file} is neither old nor whole"
    left = list(Path().glob(".imgquad-*"))
    assert number == signal.SIGKILL or not left, (number, left)
    for folder in left:
        os.system(f"rm -r {folder}")
"""


def late_kills(rng: Generator, folder: Path) -> None:
    """Twenty signals to processes that have all loaded, so that they meet meshing and writing: the same holds."""
    picture_file(folder, rng)
    names = (f"m{rng.choice(MESH_FORMATS)}", "--report", "m.json", "--picture", f"p.{rng.choice(['png', 'svg'])}")
    asked = [sys.executable, "-c", LATE, str(rng.integers(1 << 30)), "run", "in.png", *names, "--quiet"]
    env = os.environ | {"PYTHONPATH": path(), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(asked, cwd=folder, env=env, capture_output=True, text=True, timeout=MOST_SECONDS, check=False)
    assert done.returncode == 0, done.stderr[-500:]


FULL = """
import resource, signal, sys
from pathlib import Path
import numpy as np
from imgquad_core import mesh_image
from imgquad_core.errors import InputError
from imgquad_mesh.outputs.files import write_mesh_file, write_picture
labels = np.zeros((40, 60), np.int32); labels[10:30, 20:40] = 1
mesh = mesh_image(labels)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
free = resource.getrlimit(resource.RLIMIT_FSIZE)
for name, share in zip(sys.argv[1::2], sys.argv[2::2]):
    path = Path(name)
    write = write_picture if path.stem == "picture" else write_mesh_file
    write(mesh, path)
    whole = path.read_bytes()
    path.write_bytes(b"old")
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(float(share) * len(whole)), free[1]))
    try:
        write(mesh, path)
        assert path.read_bytes() == whole, "a damaged file"
    except InputError as error:
        assert path.read_bytes() == b"old" and "cannot write" in str(error), error
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, free)
    assert not list(path.parent.glob(".imgquad-*")), "leftovers"
"""


def full_disks(rng: Generator, folder: Path) -> None:
    """Five limits on the size of files, from 2 to 120 % of what is needed: one line, the old file whole."""
    names = [f"m{extension}" for extension in MESH_FORMATS] + ["picture.png", "picture.pdf", "picture.svg"]
    asked = [text for _ in range(5) for text in (str(folder / rng.choice(names)), str(rng.uniform(0.02, 1.2)))]
    env = os.environ | {"PYTHONPATH": path(), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run([sys.executable, "-c", FULL, *asked], capture_output=True, text=True, env=env, check=False)
    assert done.returncode == 0, (asked, done.stderr[-500:])


CACHED = """
import sys
sys.path.insert(0, sys.argv[1])
import cached_kernel
assert cached_kernel.double(3.0) == 6.0
"""


def caches(rng: Generator, folder: Path) -> None:
    """Bytes of the kernel cache cut, zeroed or changed at random: compiled again, and healed."""
    (folder / "cached_kernel.py").write_text(
        "from imgquad_core.jit import kernel\n@kernel\ndef double(x):\n    return 2.0 * x\n"
    )
    env = os.environ | {"PYTHONPATH": path(), "NUMBA_CACHE_DIR": str(folder / "cache")}
    use = [sys.executable, "-c", CACHED, str(folder)]
    subprocess.run(use, env=env, check=True)
    for file in folder.rglob("*.nb[ic]"):
        data = bytearray(file.read_bytes())
        first, last = np.sort(rng.integers(0, len(data), 2))
        how = rng.integers(3)
        if how == 0:
            del data[first:]
        elif how == 1:
            data[first:last] = bytes(int(last - first))
        else:
            data[first:last] = rng.bytes(int(last - first))
        file.write_bytes(data)
    for _ in range(2):
        done = subprocess.run(use, env=env, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, ""), done.stderr[-500:]


TIGHT = """
import sys
from pathlib import Path
import numpy as np
from imgquad_core import mesh_image
from imgquad_core.errors import InputError
from imgquad_mesh.outputs.files import write_mesh_file
labels = (np.add.outer(np.arange(80), 7.0 * np.sin(np.arange(120) / 3)) // 10 % 4).astype(np.int32)
path = Path(sys.argv[1])
path.write_bytes(b"old")
try:
    write_mesh_file(mesh_image(labels), path)
    assert False, "it should not fit"
except InputError as error:
    assert path.read_bytes() == b"old" and "cannot write" in str(error), error
assert not list(path.parent.glob(".imgquad-*")), "leftovers"
"""


def mounted(folder: Path, mounts: str, *arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run Python in a mount namespace of its own (Linux, util-linux), after commands of a shell that mount."""
    command = ["unshare", "--map-root-user", "--mount", "sh", "-ec", mounts + '; exec "$@"', "sh", sys.executable]
    env = os.environ | {"PYTHONPATH": path(), "PYTHONDONTWRITEBYTECODE": "1"} | environment
    return subprocess.run(
        [*command, *map(str, arguments)], cwd=folder, env=env, capture_output=True, text=True, check=False
    )


def mounts(rng: Generator, folder: Path) -> None:
    """Packages, home and temporary files mounted read-only, or a full disk: a run goes on, or is refused."""
    for name in ("packages", "home", "temporary", "disk"):
        (folder / name).mkdir()
    kernels = "from imgquad_core.jit import kernel\n@kernel\ndef double(x):\n    return 2.0 * x\n"
    (folder / "packages" / "cached_kernel.py").write_text(kernels)
    own = {"HOME": str(folder / "home"), "TMPDIR": str(folder / "temporary"), "NUMBA_CACHE_DIR": ""}
    read_only = "for f in packages home{}; do mount --bind $f $f; mount -o remount,bind,ro $f; done"
    small = "mount -t tmpfs -o size={}k tmpfs disk"
    kind = str(rng.choice(["temporary left", "nothing left", "full cache", "full disk"]))
    if kind == "full disk":
        target = f"disk/m{rng.choice(MESH_FORMATS)}"
        done = mounted(folder, small.format(4 * int(rng.integers(1, 3))), "-c", TIGHT, target)
        assert done.returncode == 0, (target, done.stderr[-500:])
        return
    if kind == "full cache":
        own["NUMBA_CACHE_DIR"] = str(folder / "disk")
        done = mounted(folder, small.format(4), "-c", CACHED, "packages", **own)
    else:
        shut = f" temporary {folder} /tmp /var/tmp" if kind == "nothing left" else ""  # where Python looks, in turn
        done = mounted(folder, read_only.format(shut), "-c", CACHED, "packages", **own)
    assert done.returncode == 0, (kind, done.stderr[-500:])
    assert len(done.stderr.strip().splitlines()) == 1, (kind, done.stderr)
    assert ("are kept in" if kind == "temporary left" else "are not kept") in done.stderr, (kind, done.stderr)


def draw_case(rng: Generator) -> tuple[np.ndarray, dict[str, object]]:
    """Return a picture and options; now and then a periodic cell, a tolerance, materials that are dropped or finer."""
    labels = draw_labels(rng)
    materials = np.unique(labels[labels >= 0])
    more: dict[str, object] = {}
    if rng.random() < 0.3:
        more["periodic"] = str(rng.choice(["x", "y", "xy"]))
    if rng.random() < 0.15:
        more["tolerance"] = float(rng.choice([1.0, 2.5, 6.0]))
    if rng.random() < 0.15 and len(materials) > 1:
        more["drop"] = (int(rng.choice(materials)),)
    if rng.random() < 0.15:
        more["material_sizes"] = {int(rng.choice(materials)): float(rng.choice([0.7, 2.0, 9.0]))}
    if rng.random() < 0.15:
        more["pixel_size"] = tuple(rng.choice([0.4, 1.0, 1.7, 3.0], 2).tolist())
    return labels, draw_options(rng, **more)


def turned_options(options: dict[str, object], turn: Turn) -> dict[str, object]:
    """Return the options that mean the same for a turned picture."""
    changes: dict[str, object] = {}
    if "periodic" in options:
        changes["periodic"] = turn.directions(str(options["periodic"]))
    if isinstance(sides := options.get("pixel_size"), tuple):
        changes["pixel_size"] = turn.shape(sides)
    return options | changes


def hangs_on_position(labels: np.ndarray, options: MeshOptions) -> bool:
    """Whether options mean a direction, and the picture does not tell it, as a diagonal mirrors it."""
    from imgquad_core.orientation import TURNS

    alike = any(turn.transposed and np.array_equal(turn.picture(labels), labels) for turn in TURNS)
    directed = options.periodic in ("x", "y") or len(set(options.pixel_sides)) > 1
    return options.policy == "diagonal" or (directed and alike)


def meshes(rng: Generator, folder: Path) -> None:
    """A mesh of any label picture, or of a periodic cell: valid, its areas those of its boundary, no side too short,
    the same bytes again with any number of threads, and the same mesh of the picture turned."""  # fmt: skip
    from imgquad_core import MeshOptions, run
    from imgquad_core.errors import InputError
    from imgquad_core.orientation import TURNS
    from support.labels import label_image

    labels, drawn = draw_case(rng)
    options = MeshOptions(**drawn, threads=1)  # type: ignore[arg-type]
    try:
        made = judged(labels, options)
    except InputError:
        assert len(options.drop) * options.tolerance > 0, "nothing can be left only where both take something"
        return
    again = run(label_image(labels), replace(options, threads=int(rng.choice([2, 16]))))
    assert made.mesh.points.tobytes() == again.mesh.points.tobytes(), "other points at the second time"
    assert made.mesh.quads.tobytes() == again.mesh.quads.tobytes(), "other quads at the second time"
    assert np.array_equal(pickle.loads(pickle.dumps(made)).mesh.points, made.mesh.points)
    turn = TURNS[int(rng.integers(1, len(TURNS)))]
    turned = judged(turn.picture(labels), MeshOptions(**turned_options(drawn, turn), threads=1))  # type: ignore[arg-type]
    same = np.array_equal(turned.labels.labels, turn.picture(made.labels.labels))  # noise removal had no tie
    if same and not hangs_on_position(labels, options):
        assert turned.mesh.n_quads == made.mesh.n_quads, f"{made.mesh.n_quads} quads, turned {turned.mesh.n_quads}"


def judged(labels: np.ndarray, options: MeshOptions) -> Run:
    """Return what a run makes of labels, after judging it."""
    from imgquad_core import run
    from support import invariants
    from support.labels import label_image

    made = run(label_image(labels), options)
    judge = invariants.assert_simplified_mesh if options.tolerance else invariants.assert_valid_mesh
    judge(made.mesh, made.labels, pixel_size=options.pixel_sides)
    invariants.assert_accounted(made)
    invariants.assert_areas_of_boundary(made)
    if not options.tolerance and options.periodic == "none" and len(set(options.pixel_sides)) == 1:
        invariants.assert_areas_of_pixels(made)
    if options.periodic != "none":
        invariants.assert_opposite_sides_match(made.pixel_mesh, options.periodic, made.boundary.shape)
        assert_tied_where_whole(made, options.periodic)
    else:
        invariants.assert_sides_long(made.pixel_mesh)
    return made


def assert_tied_where_whole(made: Run, directions: str) -> None:
    """Fail unless each node of a side is tied, where no part of the picture is void; there as many as can be."""
    from imgquad_core.errors import InputError
    from imgquad_core.fe import ElementOptions, make_elements

    whole = (made.labels.labels >= 0).all()
    try:
        pairs = make_elements(made.mesh, ElementOptions(periodic=directions)).periodic
    except InputError:
        assert not whole
        return
    assert set(pairs) == set(directions)
    for direction, ids in pairs.items():
        on = made.mesh.points[:, "xy".index(direction)]
        assert not whole or len(ids) == np.count_nonzero(on == on.min()), "nodes of a side without a partner"


def cells(rng: Generator, folder: Path) -> None:
    """Periodic cells of tileable pictures with cohesive interfaces, of both orders: all nodes tied, none unused."""
    from imgquad_core import MeshOptions, mesh_image
    from imgquad_core.fe import ElementOptions, make_elements
    from support.cells import assert_tied, assert_whole, tileable

    shape = tuple(rng.integers(30, 80, 2).tolist())
    labels = tileable(int(rng.integers(1 << 30)), shape)
    mesh = mesh_image(labels, MeshOptions(size=float(rng.choice([1.5, 3.0, 5.0])), periodic="xy"))
    for order in (1, 2):
        made = make_elements(mesh, ElementOptions(order=order, cohesive="all", periodic="xy"))
        plain = make_elements(mesh, ElementOptions(order=order, periodic="xy"))
        assert_tied(made)
        assert_whole(made)
        assert all(len(made.periodic[d]) >= len(plain.periodic[d]) for d in "xy"), "ties lost by splitting"


def elements(rng: Generator, folder: Path) -> None:
    """Periodic, of second order, cohesive, extruded, materials dropped: an `InputError`, or a mesh without a fault."""
    from imgquad_core import MeshOptions, mesh_image
    from imgquad_core.errors import InputError
    from imgquad_core.fe import ElementOptions, make_elements
    from support.labels import label_image

    labels = draw_labels(rng)
    periodic = str(rng.choice(["none", "x", "y", "xy"]))
    dropped = rng.choice(np.unique(labels), 1).tolist() if rng.random() < 0.3 else []
    with suppress(InputError):
        mesh = mesh_image(label_image(labels), MeshOptions(size=4.0, effort="fast", periodic=periodic, drop=dropped))
        order = int(rng.integers(1, 3))
        made = make_elements(
            mesh,
            ElementOptions(
                order=order,
                cohesive="all" if rng.random() < 0.5 else None,
                extrude=2.0 if order == 1 and rng.random() < 0.5 else None,
                periodic=None if periodic == "none" else periodic,
            ),
        )
        used = np.unique(np.concatenate([made.cells.ravel(), made.cohesive.ravel()]))
        assert np.array_equal(used, np.arange(made.n_points)), "unused nodes"
        period = np.ptp(made.points, axis=0)
        for direction, pairs in made.periodic.items():
            axis = "xyz".index(direction)
            step = made.points[pairs[:, 1]] - made.points[pairs[:, 0]]
            assert len(pairs), "no pair"
            assert np.abs(step - np.eye(step.shape[1])[axis] * period[axis]).max() < 1e-6, "pairs that do not match"


HASHED = """
import hashlib, sys
import numpy as np
from imgquad_core import MeshOptions, mesh_image
labels = np.load(sys.argv[1])
mesh = mesh_image(labels, MeshOptions(size=4.0, effort="fast", colors="exact", threads=int(sys.argv[2])))
print(hashlib.sha256(mesh.points.tobytes() + mesh.quads.tobytes()).hexdigest())
"""


def threads(rng: Generator, folder: Path) -> None:
    """More than 10,000 regions: the same bytes for 1, 2, 4 threads of BLAS and 1, 2, 16 of ours."""
    np.save(folder / "l.npy", rng.integers(0, 16, (120, 125), dtype=np.int32))
    found = set()
    for blas, ours in ((1, 1), (2, 1), (4, 2), (1, 16)):
        env = os.environ | {"PYTHONPATH": path(), "OPENBLAS_NUM_THREADS": str(blas), "OMP_NUM_THREADS": str(blas)}
        command = [sys.executable, "-c", HASHED, str(folder / "l.npy"), str(ours)]
        found.add(subprocess.run(command, capture_output=True, text=True, env=env, check=True).stdout)
    assert len(found) == 1


ODD = ("nan", "inf", "-1", "0", "1e308", "x", "", "1,2", "0x10", "٣", "1e-320", "9" * 40)
NUMBERS = ("size", "boundary-size", "growth", "edge-ratio", "max-shift", "pixel-size", "min-pixels", "min-length")
OTHERS = ("threads", "frame", "max-pixels", "crop", "colors", "size-of", "drop", "extrude", "layers", "min-quality")


def options(rng: Generator, folder: Path) -> None:
    """An odd value of an option of the command: a mesh, or one line and the code 2."""
    picture_file(folder, rng, 30)
    name, value = rng.choice(NUMBERS + OTHERS), rng.choice(ODD)
    process = command(folder, "run", "in.png", "m.vtu", f"--{name}={value}", "--quiet")
    said = process.communicate(timeout=MOST_SECONDS)[1]
    assert process.returncode in (0, 2, 3), (name, value, process.returncode, said)
    assert len(said.strip().splitlines()) <= 1, (name, value, said)


def readers(rng: Generator, folder: Path) -> None:
    """A file of each format that is read, damaged at random: it is read, or one `InputError`."""
    from support.files import WRITERS, assert_read_or_refused, damage

    name = str(rng.choice([*WRITERS, "a.mlx"]))
    if name == "a.mlx":
        damaged_script(rng, folder / name)
        return
    file = WRITERS[name](folder / name)
    damage(file, rng)
    assert_read_or_refused(file)


def damaged_script(rng: Generator, file: Path) -> None:
    """Read a filter script, damaged at random."""
    from imgquad_core import MeshOptions
    from imgquad_core.errors import InputError
    from imgquad_mesh.meshlab.mlx import read_script
    from imgquad_mesh.meshlab.templates import run_as_script
    from support.files import damage

    file.write_text(run_as_script(MeshOptions()), encoding="utf-8")
    damage(file, rng)
    with suppress(InputError):
        read_script(file)


class Section(NamedTuple):
    """One kind of trial, and how often the whole campaign tries it."""

    trial: Callable[[Generator, Path], None]
    times: int


SECTIONS = {
    f.__name__.replace("_", "-"): Section(f, times)
    for f, times in (
        (kills, 20),
        (late_kills, 20),
        (full_disks, 50),
        (caches, 60),
        (mounts, 40),
        (meshes, 4000),  # two pictures each: as it is and turned
        (elements, 1500),
        (cells, 40),
        (threads, 10),
        (options, 400),
        (readers, 3000),
    )
}


class Outcome(NamedTuple):
    """What one section gave."""

    tried: int
    failed: list[str]
    seconds: float


def campaign(name: str, seed: int, times: int) -> Outcome:
    """Try `times` trials of a section; each has its own seed, so that one can be repeated alone."""
    failed, start = [], time.perf_counter()
    for k in range(times):
        digest = hashlib.sha256(f"{name} {seed} {k}".encode()).digest()
        rng = np.random.default_rng(list(digest))
        with tempfile.TemporaryDirectory(prefix="imgquad-faults-") as folder:
            try:
                SECTIONS[name].trial(rng, Path(folder))
            except Exception as error:  # whatever it is, it is a fault
                line = traceback.extract_tb(error.__traceback__)[-1]
                place = f"{Path(line.filename).name}:{line.lineno}"
                failed.append(f"{name}, seed {seed}, trial {k}: {place}: {type(error).__name__}: {str(error)[:300]}")
    return Outcome(times, failed, time.perf_counter() - start)


def table(outcomes: dict[str, Outcome]) -> str:
    """Return the table of the docs."""
    lines = ["| section | what | tried | failed |", "|---|---|---:|---:|"]
    for name, found in outcomes.items():
        what = " ".join((SECTIONS[name].trial.__doc__ or "").split()).rstrip(".")
        lines.append(f"| {name} | {what} | {found.tried} | {len(found.failed)} |")
    return "\n".join(lines)


def main() -> int:
    """Run what is asked for; return 1 if a trial failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sections", nargs="*", choices=[*SECTIONS, []], help="default: all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--share", type=float, default=1.0, help="of the trials of each section (default: 1)")
    args = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # started in the background, `kills` would ignore it
    outcomes = {}
    for name in args.sections or SECTIONS:
        outcomes[name] = campaign(name, args.seed, max(1, round(args.share * SECTIONS[name].times)))
        print(f"{name}: {outcomes[name].seconds:.0f} s", *outcomes[name].failed[:5], sep="\n", file=sys.stderr)
    print(table(outcomes))
    return int(any(found.failed for found in outcomes.values()))


if __name__ == "__main__":
    sys.exit(main())
