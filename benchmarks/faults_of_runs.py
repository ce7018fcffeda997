"""Faults around a run: signals, full disks, damaged caches, odd mounts, odd options, damaged files."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]

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


def picture_file(folder: Path, rng: Generator, side: int = 60) -> Path:
    """Save a picture of blobs."""
    y, x = np.mgrid[:side, :side]
    centres = rng.uniform(0, side, (12, 2))
    labels = ((y[..., None] - centres[:, 0]) ** 2 + (x[..., None] - centres[:, 1]) ** 2).argmin(axis=2) % 4
    Image.fromarray((labels * 80).astype(np.uint8)).save(folder / "in.png")
    return folder / "in.png"


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
