"""Files whole or not at all, and inputs that are never outputs."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from imgquad_core import whole_files
from imgquad_core.errors import InputError
from imgquad_core.whole_files import PREFIX, assert_apart, replacing, scratch_folder


def write(path: Path, text: str = "new") -> None:
    with replacing(path) as temporary:
        temporary.write_text(text)


def left_in(folder: Path) -> list[str]:
    return [file.name for file in folder.iterdir() if file.name.startswith(PREFIX)]


def test_a_link_is_followed_and_stays(tmp_path: Path) -> None:
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to("real.txt")
    (tmp_path / "to nothing.txt").symlink_to("made.txt")
    write(tmp_path / "link.txt")
    write(tmp_path / "to nothing.txt")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "real.txt").read_text() == (tmp_path / "made.txt").read_text() == "new"


def test_the_mode_of_a_file_stays(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("old")
    (tmp_path / "a.txt").chmod(0o600)
    write(tmp_path / "a.txt")
    assert (tmp_path / "a.txt").stat().st_mode & 0o777 == 0o600


def test_what_is_no_file_or_protected_is_refused(tmp_path: Path) -> None:
    (tmp_path / "loop.txt").symlink_to("loop.txt")
    (tmp_path / "null.txt").symlink_to("/dev/null")
    (tmp_path / "kept.txt").write_text("old")
    (tmp_path / "kept.txt").chmod(0o444)
    os.mkfifo(tmp_path / "pipe.txt")
    for name, word in (
        ("loop.txt", "leads to itself"),
        ("null.txt", "device"),
        ("pipe.txt", "device"),
        ("kept.txt", "write-protected"),
        ("", "is a folder"),
        ("x" * 300, "too long"),
        ("no/such/folder.txt", "No such file"),
    ):
        with pytest.raises(InputError, match=word):
            write(tmp_path / name)
    assert (tmp_path / "kept.txt").read_text() == "old"
    assert Path("/dev/null").is_char_device()
    assert not left_in(tmp_path)


def test_a_file_written_along_does_not_replace_a_strangers(tmp_path: Path) -> None:
    def both() -> None:
        with replacing(tmp_path / "a.main") as temporary:
            temporary.write_text("main")
            temporary.with_suffix(".more").write_text("more")

    (tmp_path / "a.more").write_text("a stranger's")
    with pytest.raises(InputError, match=r"a\.more, which is there"):
        both()
    assert not (tmp_path / "a.main").exists()
    (tmp_path / "a.more").unlink()
    both()
    both()  # both are there now: they are replaced together
    assert sorted(os.listdir(tmp_path)) == ["a.main", "a.more"]


def same_names(folder: Path) -> dict[str, tuple[str, str]]:
    """Pairs of names that are one file."""
    (folder / "in.png").write_text("input")
    (folder / "sub").mkdir()
    (folder / "linked").symlink_to("sub")
    (folder / "link.png").symlink_to("in.png")
    (folder / "hard.png").hardlink_to(folder / "in.png")
    return {
        "the same": ("in.png", "in.png"),
        "dots": ("in.png", "sub/../in.png"),
        "a link": ("in.png", "link.png"),
        "a link read": ("link.png", "in.png"),
        "a hard link": ("in.png", "hard.png"),
        "a folder's link": ("sub/new.png", "linked/new.png"),
        "absolute": ("in.png", str(folder / "in.png")),
    }


def test_one_file_under_two_names_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, (a, b) in same_names(tmp_path).items():
        with pytest.raises(InputError, match="which is read"):
            assert_apart([a], [b])
        with pytest.raises(InputError, match="two outputs are one file"):
            assert_apart([], [a, b])
        assert name
    with pytest.raises(InputError, match="two outputs are one file"):
        assert_apart([], ["Grün.png", "grün.PNG".replace("ü", "ü")])  # elsewhere these are one
    assert_apart(["in.png", "in.png"], ["out.png", "sub/in.png"])  # read twice is fine


def test_a_file_system_that_tells_no_case_is_believed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = os.stat
    (tmp_path / "in.png").write_text("input")
    monkeypatch.setattr(whole_files.os, "stat", lambda path, **k: real(str(path).lower(), **k))
    with pytest.raises(InputError, match="which is read"):
        assert_apart([tmp_path / "in.png"], [tmp_path / "IN.PNG"])


KILLED = """
import sys, time
from pathlib import Path
from imgquad_core.whole_files import replacing
with replacing(Path(sys.argv[1]) / "a.txt") as temporary:
    temporary.write_text("half")
    print("writing", flush=True)
    time.sleep(60)
"""


def writing(folder: Path) -> subprocess.Popen[str]:
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(folder)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "writing\n"
    return process


def test_what_a_killed_process_left_is_removed_by_the_next_one(tmp_path: Path) -> None:
    dead, alive = writing(tmp_path), writing(tmp_path)
    dead.kill()
    dead.wait()
    assert len(left_in(tmp_path)) == 2
    write(tmp_path / "b.txt")
    assert len(left_in(tmp_path)) == 2  # too young to tell
    for name in left_in(tmp_path):
        os.utime(tmp_path / name, (time.time() - 3600,) * 2)
    write(tmp_path / "b.txt")
    assert len(left_in(tmp_path)) == 1  # that of the one alive
    alive.send_signal(signal.SIGINT)
    alive.wait()
    assert not left_in(tmp_path)
    assert sorted(os.listdir(tmp_path)) == ["b.txt"]


def test_an_interrupt_at_any_step_leaves_nothing_at_the_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    make = Path.mkdir
    steps = {
        "made": (Path, "mkdir", lambda self, **k: (make(self, **k), interrupted())),
        "removed": (whole_files.shutil, "rmtree", interrupted),
    }
    for owner, name, broken in steps.values():
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, broken)
            with pytest.raises(KeyboardInterrupt), scratch_folder(tmp_path):
                pass
        whole_files.remove_scratch()  # as at the end of the process
        assert not left_in(tmp_path)


def test_two_that_write_the_same_files_leave_those_of_one(tmp_path: Path) -> None:
    code = """
import sys
from pathlib import Path
from imgquad_core.whole_files import replacing
for k in range(150):
    with replacing(Path(sys.argv[1]) / "a.main", lambda _: True) as temporary:
        temporary.write_text(f"{sys.argv[2]} {k}")
        temporary.with_suffix(".more").write_text(f"{sys.argv[2]} {k}")
"""
    pair = [subprocess.Popen([sys.executable, "-c", code, str(tmp_path), name]) for name in "ab"]
    assert [process.wait() for process in pair] == [0, 0]
    assert (tmp_path / "a.main").read_text() == (tmp_path / "a.more").read_text()
