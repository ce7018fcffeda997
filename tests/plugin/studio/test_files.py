"""What the page hands over, in a real browser: files of solvers, pictures, texts."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from imgquad_mesh.__main__ import main
from support.ccx import needs_ccx, solve
from support.page import command, give, go, set_slider


@pytest.mark.parametrize("extension", [".inp", ".vtu", ".xdmf"])
def test_a_downloaded_mesh_is_the_commands_file(extension: str, page: Any, rock: Path, tmp_path: Path) -> None:
    if extension == ".xdmf":
        pytest.importorskip("meshio")
    give(page, rock)
    page.uncheck("[id='mesh-material 5']")
    go(page, 1)
    set_slider(page, "min_pixels", 12)
    set_slider(page, "min_length", 6)
    go(page, 4)
    page.select_option("#format", extension)
    command(page, extension)
    got = []
    page.on("download", lambda download: got.append(download))
    page.click("#get-mesh")
    n = 2 if extension == ".xdmf" else 1
    end = time.monotonic() + 300
    while len(got) < n and time.monotonic() < end:
        page.wait_for_timeout(50)
    import shlex

    words = shlex.split(page.inner_text("#text"))
    folder = tmp_path / "command"
    folder.mkdir()
    words[2], words[3] = str(rock), str(folder / words[3])
    assert main([*words[1:], "--quiet"]) == 0
    for download in got:
        name = download.suggested_filename
        assert Path(download.path()).read_bytes() == (folder / name).read_bytes(), name
    assert got[0].suggested_filename == f"rock{extension}"


@needs_ccx
def test_from_the_drop_to_a_solved_deck_with_clicks_only(page: Any, images: Path, tmp_path: Path) -> None:
    give(page, images / "steel_duplex_ebsd_phase.png")
    go(page, 1)
    go(page, 2)
    set_slider(page, "size", 12)
    go(page, 3)
    go(page, 4)
    page.select_option("#format", ".inp")
    page.select_option("#deck", "tension")
    command(page, "--deck tension")
    with page.expect_download() as deck:
        page.click("#get-mesh")
    deck.value.save_as(tmp_path / "steel.inp")
    found = solve(tmp_path / "steel.inp", "*EL PRINT, ELSET=EALL\nS")["stresses"]
    assert np.abs(found[:, 2] - 1e-3).max() < 1e-6, "all of one stiffness: 0.1 % of it everywhere"


def test_other_files_and_texts_are_handed_over(page: Any, rock: Path, tmp_path: Path) -> None:
    give(page, rock)
    go(page, 4)
    for what, name in (("report", "rock.report.json"), ("labels_png", "rock.labels.png"), ("script", "rock.mlx")):
        with page.expect_download() as got:
            page.click(f"#get-{what}")
        assert got.value.suggested_filename == name
        assert Path(got.value.path()).stat().st_size > 300
    page.click("#tab-python")
    assert page.inner_text("#text").startswith("from pathlib import Path")
    page.keyboard.press("ArrowRight")
    assert page.inner_text("#text").startswith("<!DOCTYPE FilterScript>")
