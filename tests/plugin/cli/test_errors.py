"""Bad input to the command: code 2, one line that says what is wrong, nothing that was there is touched."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from PIL import Image

from imgquad_mesh.__main__ import main

LABELS = np.ones((20, 30), np.uint8)
LABELS[5:15, 8:20] = 3


def file(name: str, content: bytes) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / name).write_bytes(content)
        return folder / name

    return write


def array(values: object) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        np.save(folder / "array.npy", values)
        return folder / "array.npy"

    return write


def cut_off(folder: Path) -> Path:
    Image.fromarray(LABELS).save(folder / "whole.png")
    return file("cut.png", (folder / "whole.png").read_bytes()[:60])(folder)


def tiff_stack(folder: Path) -> Path:
    pages = [Image.fromarray(LABELS)] * 3
    pages[0].save(folder / "stack.tif", save_all=True, append_images=pages[1:])
    return folder / "stack.tif"


def image_data(shape: tuple[int, int, int], filled: bool) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        image = pv.ImageData(dimensions=shape)
        if filled:
            image["label"] = np.arange(image.n_points)
        image.save(folder / "image.vti")
        return folder / "image.vti"

    return write


def cut_off_vti(folder: Path) -> Path:
    whole = image_data((40, 40, 1), True)(folder).read_bytes()
    return file("image.vti", whole[: len(whole) // 2])(folder)


def bomb(folder: Path) -> Path:
    Image.new("1", (30000, 30000)).save(folder / "bomb.png")
    return folder / "bomb.png"


BAD_PICTURES: dict[str, tuple[Callable[[Path], Path], str]] = {
    "missing": (lambda folder: folder / "missing.png", "cannot open"),
    "a folder": (lambda folder: folder, "cannot open"),
    "empty": (file("empty.png", b""), "empty"),
    "not a picture": (file("text.png", b"not a picture at all"), "text.png"),
    "cut off": (cut_off, "cut.png"),
    "zero pixels": (array(LABELS[:0]), "pixels"),
    "nan everywhere": (array(np.full(LABELS.shape, np.nan)), "no finite number"),
    "stack": (array(np.stack([LABELS] * 9)), "stack"),
    "strings": (array([["a", "b"]]), "array.npy"),
    "stack of pages": (tiff_stack, "stack"),
    "no vti": (file("broken.vti", b"<VTKFile"), "broken.vti"),
    "cut off vti": (cut_off_vti, "image.vti"),
    "vti without data": (image_data((4, 4, 1), False), "an array of labels"),
    "vti volume": (image_data((4, 4, 4), True), "stack"),
    "decompression bomb": (bomb, "max_pixels"),
}

BAD_OPTIONS = {
    "size 0": (["--size", "0"], "size is 0"),
    "size below 0": (["--size", "-3"], "size is -3"),
    "size nan": (["--size", "nan"], "size is nan"),
    "size no number": (["--size", "big"], "big"),
    "size absurdly small": (["--size", "1e-9"], "size is 1e-09"),
    "size infinite": (["--size", "inf"], "size is inf"),
    "boundary size": (["--boundary-size", "-1"], "boundary_size is -1"),
    "growth": (["--growth", "0.5"], "growth is 0.5"),
    "edge ratio": (["--edge-ratio", "0"], "edge_ratio is 0"),
    "max shift": (["--max-shift", "-1"], "max_shift is -1"),
    "pixel size": (["--pixel-size", "0"], "pixel_size is 0"),
    "unknown material": (["--size-of", "gold=2"], "gold"),
    "bad size of a material": (["--size-of", "3=-1"], "-1"),
    "no size of a material": (["--size-of", "3"], "MATERIAL=S"),
    "drop of an unknown material": (["--drop", "7"], "'7'"),
    "merge of one": (["--merge", "1=a"], "A,B=NAME"),
    "merge without a name": (["--merge", "1,3"], "A,B=NAME"),
    "merge of an unknown material": (["--merge", "1,7=a"], "'7'"),
    "rename without a name": (["--rename", "3="], "MATERIAL=NAME"),
    "rename to a name that is taken": (["--rename", "3=material 1"], "as material 1 is"),
    "recolor without a colour": (["--recolor", "3=red"], "#rrggbb"),
    "all dropped": (["--drop", "1", "--drop", "3"], "no pixel is left"),
    "colors": (["--colors", "many"], "many"),
    "colors 0": (["--colors", "0"], "0"),
    "crop outside": (["--crop", "0,0,100,10"], "100"),
    "crop inside out": (["--crop", "30,0,10,10"], "30"),
    "crop of three": (["--crop", "1,2,3"], "1,2,3"),
    "min pixels": (["--min-pixels", "-4"], "-4"),
    "min length": (["--min-length", "nan"], "min_length is nan"),
    "policy": (["--policy", "luck"], "luck"),
    "threads": (["--threads", "-1"], "threads"),
    "effort": (["--effort", "none"], "none"),
    "pixel limit": (["--max-pixels", "100"], "max_pixels"),
}

BAD_OUTPUTS = {
    "unknown format": ("mesh.xyz", ".vtu"),
    "no extension": ("mesh", ".vtu"),
    "no such folder": ("nowhere/mesh.vtu", "nowhere"),
    "a file as folder": ("file/mesh.vtu", "file"),
    "a folder as file": ("folder.vtu", "folder"),
    "not writable": ("/proc/mesh.vtu", "/proc"),
}


def assert_refused(code: int, message: str, word: str, kept: Path) -> None:
    """Code 2, one line that says what is wrong, the file that was there before untouched, none left behind."""
    assert code == 2
    assert message.startswith("imgquad-mesh")
    assert message.count("\n") == 1
    assert word in message, message
    assert kept.read_text() == "as before"
    assert not [path for path in kept.parent.iterdir() if path.name.startswith((".", "tmp"))]


Capture = pytest.CaptureFixture[str]


def refused(args: list[str]) -> int:
    try:
        return main(args)
    except SystemExit as stop:  # argparse's way
        return int(str(stop.code))


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    path = tmp_path / "mesh.vtu"
    path.write_text("as before")
    return path


@pytest.fixture
def picture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("picture") / "disc.png"
    Image.fromarray(LABELS).save(path)
    return path


@pytest.mark.parametrize("case", BAD_PICTURES)
def test_bad_picture(case: str, kept: Path, tmp_path_factory: pytest.TempPathFactory, capfd: Capture) -> None:
    make, word = BAD_PICTURES[case]
    picture = make(tmp_path_factory.mktemp("bad"))
    assert_refused(refused(["run", str(picture), str(kept)]), capfd.readouterr().err, word, kept)


@pytest.mark.parametrize("case", BAD_OPTIONS)
def test_bad_option(case: str, picture: Path, kept: Path, capfd: Capture) -> None:
    flags, word = BAD_OPTIONS[case]
    assert_refused(refused(["run", str(picture), str(kept), *flags]), capfd.readouterr().err, word, kept)


@pytest.mark.parametrize("case", BAD_OUTPUTS)
@pytest.mark.parametrize("flag", ["", "--report"])
def test_bad_output(case: str, flag: str, picture: Path, kept: Path, capfd: Capture) -> None:
    name, word = BAD_OUTPUTS[case]
    (kept.parent / "file").write_text("no folder")
    (kept.parent / "folder.vtu").mkdir()
    (kept.parent / "folder.json").mkdir()
    name = name.replace(".vtu", ".json") if flag else name
    word = word.replace(".vtu", ".json") if flag else word
    outputs = [str(kept), flag, str(kept.parent / name)] if flag else [str(kept.parent / name)]
    assert_refused(refused(["run", str(picture), *outputs]), capfd.readouterr().err, word, kept)


def test_two_outputs_of_one_name(picture: Path, tmp_path: Path, capfd: Capture) -> None:
    same = str(tmp_path / "same.png")
    assert refused(["run", str(picture), str(tmp_path / "m.vtu"), "--labels-out", same, "--picture", same]) == 2
    assert "two outputs are one file" in capfd.readouterr().err


@pytest.mark.parametrize("name", ["mesh.vtu", "mesh.vtk", "mesh.vtkhdf", "mesh.inp"])
def test_full_disk(name: str, picture: Path, tmp_path: Path) -> None:
    kept = tmp_path / name
    kept.write_text("as before")
    done = run_limited(["run", str(picture), str(kept), "--size", "1", "--quiet"], most_bytes=4096)
    assert_refused(done.returncode, done.stderr.splitlines()[-1] + "\n", name, kept)


@pytest.mark.parametrize("flag", ["--boundaries-out=x.vtp", "--picture=x.png"])
def test_full_disk_for_a_second_output(flag: str, picture: Path, tmp_path: Path) -> None:
    option, name = flag.split("=")
    kept = tmp_path / name
    kept.write_text("as before")
    # the mesh comes first, and fits
    args = ["run", str(picture), str(tmp_path / "m.obj"), option, str(kept), "--size", "30", "--quiet"]
    done = run_limited(args, most_bytes=3400)
    assert_refused(done.returncode, done.stderr.splitlines()[-1] + "\n", name, kept)


def run_limited(args: list[str], most_bytes: int) -> subprocess.CompletedProcess[str]:
    """Run the command in a process that cannot write files larger than `most_bytes`, as on a full disk."""
    start = "from imgquad_mesh.__main__ import main; import imgquad_core.pipeline, resource, sys; "
    kernels = "main([*sys.argv[1:3], sys.argv[3] + '.warm.vtu', '--quiet']); "  # their cache needs more
    limit = f"resource.setrlimit(resource.RLIMIT_FSIZE, ({most_bytes}, {most_bytes})); sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", start + kernels + limit, *args]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
