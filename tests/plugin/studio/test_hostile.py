"""Hostile uploads and requests: each is refused in one line, the studio lives, and nothing is written elsewhere."""

from __future__ import annotations

import io
import json
import pickle
import signal
import socket
import struct
import time
import zipfile
import zlib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from support.studio import TAB, Studio, running_studio

RECIPE = {"picture": "x.png", "options": {}}
LIMITS = ("--megabytes", "1", "--megapixels", "1", "--sessions", "2", "--memory", "1")


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Studio]:
    with running_studio(tmp_path_factory.mktemp("guarded"), *LIMITS) as started:
        yield started


def png(width: int = 8, height: int = 8, text: bytes = b"") -> bytes:
    """A grey picture, perhaps with a chunk of compressed text."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
    rows = zlib.compress(b"".join(b"\0" + bytes(min(width, 64)) for _ in range(min(height, 64))))
    texts = chunk(b"zTXt", b"Comment\0\0" + zlib.compress(text)) if text else b""
    return b"\x89PNG\r\n\x1a\n" + head + texts + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


class Evil:
    """Runs a command when it is unpickled."""

    def __reduce__(self) -> Any:
        return print, ("unpickled",)


def objects() -> bytes:
    out = io.BytesIO()
    np.save(out, np.array([Evil()], object), allow_pickle=True)
    return out.getvalue()


def huge_npy() -> bytes:
    head = b"{'descr': '|u1', 'fortran_order': False, 'shape': (60000, 60000), }"
    head += b" " * (64 - (10 + len(head) + 1) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head


def zip_bomb() -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.npy", huge_npy() + bytes(50_000_000))
    return out.getvalue()


def gif() -> bytes:
    out = io.BytesIO()
    Image.fromarray(np.zeros((8, 8), np.uint8)).save(out, "GIF")
    return out.getvalue()


NRRD = b"NRRD0004\ntype: uchar\ndimension: 2\nsizes: 4 4\nencoding: raw\ndata file: /etc/passwd\n\n"
MHA = b"NDims = 2\nDimSize = 4 4\nElementType = MET_UCHAR\nElementDataFile = /etc/passwd\n"
#: name, content, what is said of it
UPLOADS: dict[str, tuple[str, bytes, str]] = {
    "nothing": ("a.png", b"", "empty"),
    "text": ("a.png", b"hello", "not a picture"),
    "html": ("a.png", b"<html><script>alert(1)</script></html>", "not a picture"),
    "svg": ("a.svg", b"<svg xmlns='http://www.w3.org/2000/svg'/>", "a.svg"),
    "cut off": ("a.png", png(64, 64)[:60], "cut off or damaged"),
    "header of 60,000 x 60,000": ("a.png", png(60000, 60000), "more than max_pixels"),
    "more pixels than allowed": ("a.png", png(1001, 1000), "more than max_pixels"),
    "bomb in a text chunk": ("a.png", png(text=bytes(60_000_000)), "a.png"),
    "pickle": ("a.npy", pickle.dumps(Evil()), "never loaded"),
    "array of objects": ("a.npy", objects(), "never loaded"),
    "array of 60,000 x 60,000": ("a.npy", huge_npy(), "a.npy"),
    "zip bomb": ("a.npz", zip_bomb(), "a.npz"),
    "gif called npy": ("a.npy", gif(), "a.npy"),
    "npy called png": ("a.png", huge_npy(), "not a picture"),
    "broken tiff": ("a.tif", b"II*\0" + bytes(range(200)), "a.tif"),
    "tiff that points at itself": ("a.tif", b"II*\0\x08\0\0\0" + b"\0\0\x08\0\0\0", "a.tif"),
    "broken nrrd": ("a.nrrd", b"NRRD0004\nsizes: 99999 99999\n\n", "a.nrrd"),
    "outside file of nrrd": ("a.nrrd", NRRD, "names another file"),
    "outside file of mha": ("a.mha", MHA, "names another file"),
    "name that climbs": ("../../../tmp/evil.png", b"hello", "evil.png is not a picture"),
    "name of markup": ("<b>x</b>.png", b"hello", "b_.png is not a picture"),
}  # fmt: skip


@pytest.mark.parametrize("name", UPLOADS)
def test_hostile_uploads_are_refused_in_one_line(name: str, guarded: Studio) -> None:
    called, content, said = UPLOADS[name]
    code, _ = guarded.ask("POST", f"/picture?name={called.replace(' ', '%20').replace('<', '%3C')}", content)
    assert code == 200, "it is judged when it is read"
    last = guarded.do({"do": "segment", "recipe": RECIPE})[-1]
    assert said in last["error"]
    assert "\n" not in last["error"]
    assert "upload" not in last["error"], "a name of ours, which says nothing to the user"
    assert str(guarded.folder) not in last["error"]


#: method, path, body, headers, code
REQUESTS: dict[str, tuple[str, str, Any, dict[str, str], int]] = {
    "foreign host": ("GET", "/", None, {"Host": "evil.example"}, 403),
    "foreign host with our port": ("POST", "/do", b"{}", {"Host": "evil.example:80"}, 403),
    "no host's port": ("GET", "/", None, {"Host": "127.0.0.1"}, 403),
    "foreign origin": ("POST", "/do", b"{}", {"Origin": "http://evil.example"}, 403),
    "null origin": ("POST", "/do", b"{}", {"Origin": "null"}, 403),
    "no token": ("POST", "/do", b"{}", {"Cookie": ""}, 403),
    "wrong token": ("POST", "/do", b"{}", {"Cookie": "studio-PORT=AAAA"}, 403),
    "token in the address": ("POST", "/do?token=TOKEN", b"{}", {"Cookie": ""}, 403),
    "no tab": ("POST", "/do", b"{}", {"X-Tab": ""}, 400),
    "tab that climbs": ("POST", "/do", b"{}", {"X-Tab": "../../../../etc/passwd"}, 400),
    "traversal": ("GET", "/../server.py", None, {}, 404),
    "coded traversal": ("GET", "/%2e%2e%2fserver.py", None, {}, 404),
    "traversal of backslashes": ("GET", "/..%5cserver.py", None, {}, 404),
    "absolute path": ("GET", "//etc/passwd", None, {}, 404),
    "get of a post": ("GET", "/do", None, {}, 404),
    "put": ("PUT", "/picture", b"x", {}, 405),
    "no json": ("POST", "/do", b"hello", {}, 400),
    "json of another kind": ("POST", "/do", b"[1]", {}, 400),
    "deep json": ("POST", "/do", b"[" * 100_000, {}, 400),
    "long json": ("POST", "/do", b" " * 2_000_000, {}, 413),
    "unknown task": ("POST", "/do", b'{"do": "__import__"}', {}, 400),
    "unknown option": ("POST", "/texts", b'{"recipe": {"options": {"marks": "/etc/passwd"}}}', {}, 400),
    "65 MB, said before": ("POST", "/picture?name=a.png", None, {"Content-Length": "65000000"}, 413),
    "negative length": ("POST", "/picture?name=a.png", None, {"Content-Length": "-5"}, 400),
    "picture that was not given": ("POST", "/given", b"", {}, 404),
}


@pytest.mark.parametrize("name", REQUESTS)
def test_hostile_requests_are_refused_in_one_line(name: str, guarded: Studio) -> None:
    method, path, body, headers, wanted = REQUESTS[name]
    own = {key: value.replace("PORT", str(guarded.port)) for key, value in headers.items()}
    code, said = guarded.ask(method, path.replace("TOKEN", guarded.token), body, own)
    assert code == wanted, said
    assert said.count(b"\n") == 0
    assert b"Traceback" not in said


def test_a_long_body_without_a_length_is_cut(guarded: Studio) -> None:
    parts = (bytes(100_000) for _ in range(30))
    code, said = guarded.ask("POST", "/picture?name=a.png", parts, {"Transfer-Encoding": "chunked"})
    assert (code, b"more than 1 MB" in said) == (413, True)


def test_a_slow_body_is_given_up(guarded: Studio) -> None:
    head = f"POST /picture?name=a.png HTTP/1.1\r\nHost: 127.0.0.1:{guarded.port}\r\nContent-Length: 1000\r\n"
    head += f"Cookie: studio-{guarded.port}={guarded.token}\r\nX-Tab: {TAB}\r\n\r\nabc"
    start = time.monotonic()
    with socket.create_connection(("127.0.0.1", guarded.port), timeout=60) as connection:
        connection.sendall(head.encode())
        answer = connection.recv(4000)
    assert b" 408 " in answer
    assert 5 < time.monotonic() - start < 40


def test_another_pages_id_gives_nothing_without_the_token(guarded: Studio) -> None:
    guarded.ask("POST", "/picture?name=mine.png", png())
    code, _ = guarded.ask("POST", "/do", json.dumps({"do": "look", "recipe": RECIPE}), {"X-Tab": TAB}, bare=True)
    assert code == 403
    other = guarded.ask("POST", "/do", json.dumps({"do": "look", "recipe": RECIPE}), {"X-Tab": "f" * 32})
    assert (other[0], b"there is no picture" in other[1]) == (400, True)


def test_too_many_pages_are_refused(guarded: Studio) -> None:
    codes = [guarded.ask("POST", "/picture?name=a.png", png(), {"X-Tab": f"{k}" * 32})[0] for k in range(3, 7)]
    assert 503 in codes
    for k in range(3, 7):
        guarded.ask("POST", "/close", b"", {"X-Tab": f"{k}" * 32})


def test_after_all_that_the_studio_works_and_has_written_in_its_folder_only(guarded: Studio) -> None:
    assert guarded.process.poll() is None
    out = io.BytesIO()
    Image.fromarray(np.kron(np.array([[0, 200], [200, 0]], np.uint8), np.ones((20, 20), np.uint8))).save(out, "PNG")
    guarded.ask("POST", "/picture?name=good.png", out.getvalue())
    assert len(guarded.do({"do": "segment", "recipe": RECIPE})[-1]["done"]["materials"]) == 2
    made = {path.relative_to(guarded.folder).parts[0] for path in guarded.folder.rglob("*")}
    assert all(name.startswith(("imgquad-studio-", "pymp-")) for name in made), made
    assert not Path("/tmp/evil.png").exists()


def test_headers_keep_others_out(guarded: Studio) -> None:
    import urllib.request

    with urllib.request.urlopen(guarded.address) as answer:
        assert "default-src 'self'" in answer.headers["Content-Security-Policy"]
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert answer.headers["Cache-Control"] == "no-store"
        assert "HttpOnly" in answer.headers["Set-Cookie"]
        assert "samesite=strict" in answer.headers["Set-Cookie"].lower()


def test_nothing_stays_when_the_studio_ends(tmp_path: Path) -> None:
    with running_studio(tmp_path) as started:
        started.ask("POST", "/picture?name=a.png", png())
        assert list(tmp_path.glob("imgquad-studio-*/*/upload*"))
    assert list(tmp_path.glob("imgquad-studio-*")) == []


def test_an_interruption_ends_the_work_and_says_one_line(tmp_path: Path) -> None:
    out = io.BytesIO()
    Image.fromarray(np.random.default_rng(1).integers(0, 4, (700, 700), np.uint8)).save(out, "PNG")
    task = {"do": "mesh", "recipe": {"picture": "a.png", "options": {"min_pixels": 0}}}
    with (tmp_path / "errors").open("w+") as errors, running_studio(tmp_path, errors=errors) as started:
        started.ask("POST", "/picture?name=a.png", out.getvalue())
        started.do({**task, "do": "segment"})  # the worker has begun
        with ThreadPoolExecutor() as beside:
            answer = beside.submit(started.do, task)
            time.sleep(1.0)
            started.process.send_signal(signal.SIGINT)
            started.process.wait(20)
            assert "error" in answer.result()[-1], "the page hears of it"
        errors.seek(0)
        assert errors.read() == "imgquad-mesh: error: interrupted\n"


def test_the_server_loads_no_pictures_and_no_viewer() -> None:
    import subprocess
    import sys

    code = (
        "import sys, imgquad_mesh.studio.server; print([m for m in ('pyvista', 'numba', 'scipy') if m in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"


def test_what_the_fork_server_loads_can_be_imported() -> None:
    from importlib import import_module

    from imgquad_mesh.studio.sessions import PRELOAD

    for name in PRELOAD:
        import_module(name)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--host", "0.0.0.0"], "give the address by which others reach"),
        (["--host", "no.such.host.example"], "cannot listen on"),
        (["--port", "99999999"], "cannot listen on"),
        (["no_such_picture.png"], "there is no picture"),
    ],
)
def test_a_studio_that_cannot_be_served_says_why(
    options: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    from imgquad_mesh.__main__ import main

    assert main(["studio", "--no-browser", *options]) == 2
    assert said in capsys.readouterr().err
