"""The studio as it is started by the command, and a browser in front of it."""

from __future__ import annotations

import http.client
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any
from urllib.parse import urlsplit

import pytest

TAB = "0123456789abcdef" * 2
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


@dataclass(frozen=True)
class Studio:
    """A running studio: its address with the token, its process, the folder of its temporary files."""

    address: str
    process: subprocess.Popen[str]
    folder: Path

    @property
    def port(self) -> int:
        return int(urlsplit(self.address).port or 0)

    @property
    def token(self) -> str:
        return self.address.partition("token=")[2]

    def ask(
        self, method: str, path: str, body: Any = None, headers: dict[str, str] | None = None, *, bare: bool = False
    ) -> tuple[int, bytes]:
        """Send a request as the page would, but for what `headers` say; `bare`: with these headers only."""
        usual = {"Cookie": f"studio-{self.port}={self.token}", "X-Tab": TAB}
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        try:
            given = (headers or {}) if bare else usual | (headers or {})
            connection.request(method, path, body, given, encode_chunked="Transfer-Encoding" in given)
            answer = connection.getresponse()
            return answer.status, answer.read()
        finally:
            connection.close()

    def do(self, task: dict[str, Any], tab: str = TAB) -> list[dict[str, Any]]:
        """Give a task; return the lines of the answer."""
        code, body = self.ask("POST", "/do", json.dumps(task), {"X-Tab": tab})
        lines = []
        for line in body.split(b"\n"):
            lines.append(json.loads(line))
            if "stage" not in lines[-1]:
                break
        assert code == 200 or "error" in lines[-1]
        return lines


@contextmanager
def running_studio(folder: Path, *options: str, errors: IO[str] | None = None) -> Iterator[Studio]:
    """Start the studio by its command; its temporary files lie in `folder`, what it complains of goes to `errors`."""
    command = [sys.executable, "-m", "imgquad_mesh", "studio", "--no-browser", *options]
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=errors,
        text=True,
        env={**os.environ, "TMPDIR": str(folder), "PYTHONUNBUFFERED": "1"},
    )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        while "http" not in line:
            assert line, "the studio ended"
            line = process.stdout.readline()
        yield Studio(re.search(r"http\S+", line)[0], process, folder)  # type: ignore[index]
    finally:
        process.terminate()
        process.wait(20)


def needs_chromium() -> str:
    """Return the path of a Chromium; skip the test, visibly, where there is none, and fail in CI."""
    if CHROMIUM is None:
        if os.environ.get("IMGQUAD_CI"):
            pytest.fail("no Chromium: apt-get install chromium")
        pytest.skip("no Chromium: apt-get install chromium")
    pytest.importorskip("playwright")
    return CHROMIUM
