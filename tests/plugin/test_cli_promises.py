"""What the command promises of files: inputs are never outputs, the mesh comes first, signals leave nothing behind."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
import weakref
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from imgquad_core.errors import InputError
from imgquad_mesh import outputs, run_script
from imgquad_mesh.__main__ import main
from imgquad_mesh.cli.interruption import handling_signals, promptly
from imgquad_mesh.outputs import files

LABELS = np.zeros((20, 30), np.uint8)
LABELS[5:15, 8:20] = 200
MLX = """<!DOCTYPE FilterScript>
<FilterScript>
 <filter name="generate_quad_mesh_from_image"/>
 <filter name="{0}">
  <Param type="RichString" name="fileName" value="{1}"/>
 </filter>
</FilterScript>
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Image.fromarray(LABELS).save(tmp_path / "rock.png")
    np.save(tmp_path / "rock.npy", LABELS)
    (tmp_path / "steel.toml").write_text("[steel]\nyoung = 1.0\n")
    (tmp_path / "linked").symlink_to(".")
    (tmp_path / "link.png").symlink_to("rock.png")
    (tmp_path / "hard.png").hardlink_to(tmp_path / "rock.png")
    (tmp_path / "labels.mlx").write_text(MLX.format("export_label_image_to_file", "rock.npy"))
    (tmp_path / "mesh.mlx").write_text(MLX.format("export_quad_mesh_to_file", "out.vtu"))
    return tmp_path


SAME = [
    "run rock.png rock.vtu --picture rock.png",
    "run rock.png rock.vtu --labels-out rock.png",
    "run rock.npy m.vtu --labels-out rock.npy",
    "run rock.png rock.vtu --picture ./rock.png",
    "run rock.png rock.vtu --picture linked/rock.png",
    "run rock.png rock.vtu --picture link.png",
    "run rock.png rock.vtu --picture hard.png",
    "run link.png rock.vtu --picture rock.png",
    "run rock.png m.vtu --picture p.png --labels-out p.png",
    "run rock.png m.vtu --picture p.png --labels-out linked/p.png",
    "run rock.png m.vtu --picture p.png --labels-out P.png",
    "run rock.png m.vtu --marks link.png --labels-out hard.png",
    "script mesh.mlx --input rock.png --output linked/out.vtu",
    "script labels.mlx --input rock.npy",
]


@pytest.mark.parametrize("command", SAME)
def test_no_output_is_an_input_or_another_output(
    folder: Path, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {file.name: file.read_bytes() for file in folder.iterdir() if file.is_file()}
    assert main(command.split()) == 2
    said = capsys.readouterr().err
    assert "which is read" in said or "two outputs are one file" in said
    assert {file.name: file.read_bytes() for file in folder.iterdir() if file.is_file()} == before


def test_scripts_in_python_never_write_what_they_read(folder: Path) -> None:
    for output, image in (("rock.ply", "rock.png"), ("mesh.ply", "rock.png")):
        (folder / output).unlink(missing_ok=True)
        (folder / "in.ply").symlink_to(output) if not (folder / "in.ply").exists() else None
        with pytest.raises(InputError, match="which is read"):
            run_script(folder / "mesh.mlx", image=folder / image, mesh=folder / "in.ply", output=folder / output)
        (folder / "in.ply").unlink()


def test_an_xdmf_does_not_replace_the_data_beside_it(folder: Path) -> None:
    h5py = pytest.importorskip("h5py")
    pytest.importorskip("meshio")
    with h5py.File(folder / "data.h5", "w") as file:
        file["EBSD/Euler"] = np.zeros(5)
    (folder / "data.xdmf").write_text('<Xdmf><DataItem Format="HDF">data.h5:/EBSD/Euler</DataItem></Xdmf>')
    before = (folder / "data.h5").read_bytes()
    assert main(["run", "rock.png", "data.xdmf", "--quiet"]) == 2
    assert (folder / "data.h5").read_bytes() == before
    for _ in range(2):  # what we wrote ourselves is replaced
        assert main(["run", "rock.png", "mesh.xdmf", "--quiet"]) == 0


def test_the_mesh_and_the_report_are_there_when_the_picture_fails(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object) -> None:
        raise InputError("cannot write p.png: No space left on device")

    for place in (outputs, files):  # the package keeps what it was once asked for
        monkeypatch.setattr(place, "write_picture", full)
    others = ["--report", "m.json", "--picture", "p.png", "--labels-out", "l.npy"]
    assert main(["run", "rock.png", "m.vtu", *others, "--quiet"]) == 2
    assert "(the mesh is in m.vtu)" in capsys.readouterr().err
    assert (folder / "m.vtu").stat().st_size > 1000
    assert json.loads((folder / "m.json").read_text())["output"] == "m.vtu"


FULL = """
import resource, signal, sys
from pathlib import Path
from imgquad_core import mesh_image
from imgquad_core.errors import InputError
from imgquad_mesh.outputs.files import write_picture
mesh = mesh_image([[0, 1], [1, 0]])
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
try:
    write_picture(mesh, Path(sys.argv[1]))
except InputError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="a limit of POSIX")
@pytest.mark.parametrize("extension", ["pdf", "png", "svg"])
def test_a_picture_on_a_full_disk_is_one_line_and_the_old_one_stays(folder: Path, extension: str) -> None:
    target = folder / f"p.{extension}"
    target.write_bytes(b"old")
    done = subprocess.run([sys.executable, "-c", FULL, str(target)], capture_output=True, text=True, check=True)
    assert done.stdout.startswith(f"cannot write {target}")
    assert target.read_bytes() == b"old"


def test_names_that_cannot_be_shown_are_written_all_the_same(folder: Path) -> None:
    name = os.fsdecode(b"rock\xff.png")
    (folder / "rock.png").rename(folder / name)
    env = os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0", "LC_ALL": "C"}
    arguments = [name, "Straße.vtu", "--report", "m.json"]
    done = subprocess.run(
        [sys.executable, "-m", "imgquad_mesh", "run", *arguments], capture_output=True, env=env, check=False
    )
    assert (done.returncode, b"Traceback" in done.stderr) == (0, False), done.stderr
    assert json.loads((folder / "m.json").read_text(encoding="utf-8"))["input"] == name


WRITING = """
import sys, time
from imgquad_mesh.__main__ import main
from imgquad_mesh import outputs

def write_half(dataset, path):
    path.write_text("half")
    print("writing", flush=True)
    time.sleep(60)

outputs.save_dataset = write_half
sys.exit(main(["run", "rock.png", "rock.vtu", "--quiet"]))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_the_command_in_order(folder: Path, number: int) -> None:
    (folder / "rock.vtu").write_text("old")
    process = subprocess.Popen(
        [sys.executable, "-c", WRITING], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "writing\n"
    assert [file for file in folder.iterdir() if file.name.startswith(".imgquad")]
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert (process.returncode, said) == (128 + number, "imgquad-mesh: error: interrupted\n")
    assert (folder / "rock.vtu").read_text() == "old"
    assert not [file for file in folder.iterdir() if file.name.startswith(".imgquad")]


BUSY = """
import sys, threading, time
import numpy as np
from imgquad_core.jit import kernel
from imgquad_mesh import cli
from imgquad_mesh.__main__ import main

@kernel
def count(n, out):
    for k in range(n):
        out[k % 8] += np.sin(k)

count(10, np.zeros(8))

def work(*_):
    print("working", flush=True)
    count(10**11, np.zeros(8))

cli.run.core.run = work
sys.exit(main(["run", "rock.png", "rock.vtu", "--quiet"]))
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows sends no such signals")
def test_a_signal_ends_the_command_at_once_whatever_kernel_runs(folder: Path) -> None:
    (folder / "busy.py").write_text(BUSY)
    process = subprocess.Popen([sys.executable, "busy.py"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "working\n"
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=20)  # the kernel takes many minutes
    assert (process.returncode, said) == (128 + signal.SIGINT, "imgquad-mesh: error: interrupted\n")
    assert not [file for file in folder.iterdir() if file.name.startswith(".imgquad")]


def test_errors_and_results_come_through_the_thread() -> None:
    assert promptly(lambda: 7) == 7
    with pytest.raises(InputError, match="such"):
        promptly(lambda: (_ for _ in ()).throw(InputError("such")))


def test_a_signal_during_an_import_waits_for_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "slow_to_load.py").write_text("import time\ntime.sleep(0.4)\nDONE = True\n")
    monkeypatch.syspath_prepend(tmp_path)
    loaded = None
    with pytest.raises(KeyboardInterrupt), handling_signals() as interruption:  # noqa: PT012
        threading.Timer(0.1, signal.raise_signal, [signal.SIGTERM]).start()
        import slow_to_load  # type: ignore[import-not-found]

        loaded = slow_to_load
        time.sleep(5)
    assert loaded is not None
    assert loaded.DONE
    assert interruption.signal == signal.SIGTERM


def test_whatever_an_interrupt_makes_libraries_raise_is_an_interrupt(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object) -> None:
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt:
            raise ImportError("Failed to load vtkCommonMath") from None

    monkeypatch.setattr("imgquad_mesh.cli.run._run", broken)
    assert main(["run", "rock.png", "m.vtu"]) == 128 + signal.SIGTERM
    assert capsys.readouterr().err.strip() == "imgquad-mesh: error: interrupted"


def test_an_interrupt_that_python_drops_comes_again(capfd: pytest.CaptureFixture[str]) -> None:
    class Thing:
        pass

    thing = Thing()
    noted = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
    with pytest.raises(KeyboardInterrupt), handling_signals():  # noqa: PT012
        del thing  # an exception of the callback is printed, and gone
        time.sleep(5)
    assert noted() is None
    assert "Traceback" not in capfd.readouterr().err


def test_nohup_is_respected() -> None:
    former = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with handling_signals():
            signal.raise_signal(signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, former)


@pytest.mark.parametrize(
    "options",
    [
        "--size 1e308",
        "--pixel-size 1e308",
        "--size nan",
        "--boundary-size 0",
        "--min-quality nan",
        "--layers 3",
        "--nodes 9",
        "--frame 3",
        "--threads -1",
        "--size-of 0=nan",
    ],
)
def test_odd_options_are_one_line(folder: Path, options: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "rock.png", "m.vtu", *options.split()]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1
    assert not (folder / "m.vtu").exists()


def test_endless_deadlines_are_taken_and_wrong_ones_refused(folder: Path) -> None:
    for deadline in ("inf", "1e30"):
        assert main(["script", "mesh.mlx", "--input", "rock.png", "--deadline", deadline, "--quiet"]) == 0
    for deadline in ("nan", "0", "-1"):
        assert main(["script", "mesh.mlx", "--input", "rock.png", "--deadline", deadline, "--quiet"]) == 2
