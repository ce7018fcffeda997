"""What all tests share: compiled kernels kept per state of the sources, and the real pictures where they are."""

from __future__ import annotations

import hashlib
import os
import signal
import tempfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SAMPLES = Path(os.environ.get("IMGQUAD_SAMPLES", ROOT.parent / "shared" / "samples"))
# where a shell starts the tests in the background, they and the commands that they start would ignore Ctrl-C
signal.signal(signal.SIGINT, signal.default_int_handler)

IMAGES = Path(os.environ.get("IMGQUAD_IMAGES", ROOT.parent / "shared" / "images"))


def _sources_key() -> str:
    """Hash of all sources of the core: Numba's cache does not see an edit in a helper of another file."""
    import imgquad_core

    digest = hashlib.sha256()
    for file in sorted(Path(imgquad_core.__file__).parent.rglob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def pytest_configure(config: pytest.Config) -> None:
    if "NUMBA_CACHE_DIR" not in os.environ:
        folder = Path(tempfile.gettempdir()) / f"imgquad-kernels-{os.getuid()}-{_sources_key()}"
        os.environ["NUMBA_CACHE_DIR"] = str(folder)


@pytest.fixture(scope="session")
def images() -> Path:
    """Folder of the real pictures; the test is skipped, visibly, where there is none."""
    if not IMAGES.is_dir():
        pytest.skip(f"real pictures not found: no folder {IMAGES} (set IMGQUAD_IMAGES)")
    return IMAGES


@pytest.fixture(scope="session")
def samples() -> Path:
    """Folder of real files of instruments and programs; the test is skipped, visibly, where there is none."""
    if not SAMPLES.is_dir():
        pytest.skip(f"real files not found: no folder {SAMPLES} (set IMGQUAD_SAMPLES)")
    return SAMPLES
