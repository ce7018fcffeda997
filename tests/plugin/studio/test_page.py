"""The page in a real browser: from the drop to the mesh, with the hands of a user."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from imgquad_mesh.__main__ import main
from support.page import command, give, go, set_slider, settled, wait
from support.studio import Studio


def test_a_dropped_picture_is_seen_and_named(page: Any, rock: Path) -> None:
    data = list(rock.read_bytes())
    page.evaluate(
        """(data) => {
            const transfer = new DataTransfer();
            transfer.items.add(new File([new Uint8Array(data)], "my rock.png", { type: "image/png" }));
            document.getElementById("screen").dispatchEvent(
                new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true }));
        }""",
        data,
    )
    settled(page, "segment")
    assert page.inner_text("#name") == "my_rock.png"
    assert page.locator("#panel tbody tr").count() == 6
    assert page.inner_text("#text") == "imgquad-mesh run my_rock.png my_rock.vtu"


def test_materials_are_merged_renamed_recoloured_dropped_and_undone(page: Any, rock: Path) -> None:
    give(page, rock)
    page.check("[id='choose-material 0']")
    page.check("[id='choose-material 2']")
    page.click("#merge")
    settled(page, "segment")
    assert page.locator("#panel tbody tr").count() == 5
    page.fill("[id='name-material 0']", "ground")
    page.keyboard.press("Tab")
    page.evaluate(
        "() => { const e = document.getElementById('color-material 1'); e.value = '#ff00aa';"
        " e.dispatchEvent(new Event('change', {bubbles: true})); }"
    )
    page.uncheck("[id='mesh-material 5']")
    command(page, "--drop")
    text = page.inner_text("#text")
    assert "--merge 'material 0,material 2=material 0'" in text
    assert "--rename 'material 0=ground'" in text
    assert "--recolor 'material 1=#ff00aa'" in text
    assert "--drop 'material 5'" in text
    settled(page, "segment")
    for _ in range(4):
        page.click("#undo")
    settled(page, "segment")
    assert page.locator("#panel tbody tr").count() == 6
    command(page, "rock.vtu")
    assert page.inner_text("#text") == "imgquad-mesh run rock.png rock.vtu"
    page.click("#redo")
    settled(page, "segment")
    assert page.locator("#panel tbody tr").count() == 5


def test_materials_grow_from_painted_strokes(page: Any, tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    grey = np.full((120, 160), 80.0)
    grey[:, 80:] = 160
    Image.fromarray(np.clip(grey + rng.normal(0, 9, grey.shape), 0, 255).astype(np.uint8)).save(tmp_path / "two.png")
    give(page, tmp_path / "two.png")
    page.select_option("#classes", "marks")
    box = page.locator("#canvas").bounding_box()
    for brush, x in ((0, 0.3), (1, 0.7)):
        page.click(f"#brush-{brush}")
        page.mouse.move(box["x"] + x * box["width"], box["y"] + 0.4 * box["height"])
        page.mouse.down()
        page.mouse.move(box["x"] + x * box["width"], box["y"] + 0.6 * box["height"], steps=8)
        page.mouse.up()
        if brush == 0:
            wait(page, "document.getElementById('message').textContent.includes('mark at least two')")
    settled(page, "segment")
    shares = page.evaluate("studio.results.segment.materials.map((row) => [row.name, row.share])")
    assert [name for name, _ in shares] == ["rgb_e6194b", "rgb_3cb44b"]
    assert all(abs(share - 0.5) < 0.05 for _, share in shares)
    command(page, "--marks marks.png")
    with page.expect_download() as marks:
        page.click("#step4")
        page.click("#get-marks")
    marks.value.save_as(tmp_path / "marks.png")
    out = tmp_path / "labels.npy"
    options = ["--marks", str(tmp_path / "marks.png"), "--labels-out", str(out), "--quiet"]
    assert main(["run", str(tmp_path / "two.png"), str(tmp_path / "two.vtu"), *options]) == 0
    settled(page, "mesh")
    with page.expect_download() as labels:
        page.click("#get-labels")
    assert Path(labels.value.path()).read_bytes() == out.read_bytes()


def test_sliders_of_noise_act_at_once_and_the_line_is_dragged(page: Any, rock: Path) -> None:
    give(page, rock)
    go(page, 1)
    assert page.evaluate("studio.results.denoise.clusters") == 0, "labels are taken at their word"
    for value in (4, 9, 16, 25):
        set_slider(page, "min_pixels", value)
    set_slider(page, "min_length", 8)
    command(page, "--min-pixels 25 --min-length 8")
    settled(page, "denoise")
    assert page.evaluate("studio.results.denoise.clusters") > 50
    assert re.search(r"\d+ clusters of \d+ pixels removed", page.inner_text("#removed"))
    before = page.locator("#canvas").screenshot()
    split = page.locator("#split").bounding_box()
    page.mouse.move(split["x"] + split["width"] / 2, split["y"] + 300)
    page.mouse.down()
    page.mouse.move(split["x"] - 250, split["y"] + 300, steps=6)
    page.mouse.up()
    assert int(page.get_attribute("#split", "aria-valuenow")) < 30
    assert page.locator("#canvas").screenshot() != before
    page.focus("#split")
    page.keyboard.press("End")
    assert page.get_attribute("#split", "aria-valuenow") == "100"
    page.click("#min_pixels-auto")
    page.click("#min_length-auto")
    settled(page, "denoise")
    assert page.evaluate("studio.results.denoise.clusters") == 0


def test_work_is_cancelled_in_the_middle_and_taken_up_again(page: Any, studio: Studio, tmp_path: Path) -> None:
    from support.labels import voronoi

    Image.fromarray(voronoi(900, 900, 60, 1).astype(np.uint8)).save(tmp_path / "large.png")
    give(page, tmp_path / "large.png")
    page.click("#step3")
    wait(page, "['meshing', 'smoothing'].includes(document.getElementById('stage').textContent)")
    page.click("#cancel")
    wait(page, "!document.body.hasAttribute('data-busy')", 5)
    assert page.evaluate("!studio.results.mesh")
    assert page.locator("#cancel").is_hidden()
    page.click("#step0")
    page.click("#step1")
    settled(page, "denoise")  # by a new worker, from the recipe
    assert page.evaluate("!studio.results.mesh")


def test_two_users_do_not_see_each_other(open_page: Callable[..., Any], rock: Path, tmp_path: Path) -> None:
    Image.fromarray(np.kron(np.eye(2, dtype=np.uint8), np.ones((30, 30), np.uint8))).save(tmp_path / "other.png")
    one, other = open_page(), open_page()
    give(one, rock)
    give(other, tmp_path / "other.png")
    assert one.locator("#panel tbody tr").count() == 6
    assert other.locator("#panel tbody tr").count() == 2
    one.fill("[id='name-material 0']", "mine")
    one.keyboard.press("Tab")
    command(one, "mine")
    go(other, 1)
    assert "mine" not in other.inner_text("#text")
    assert "other.png" in other.inner_text("#text")


def test_what_is_wrong_is_said_in_one_line(page: Any, tmp_path: Path) -> None:
    (tmp_path / "bad.png").write_bytes(b"hello")
    page.set_input_files("#file", str(tmp_path / "bad.png"))
    wait(page, "!document.getElementById('message').hidden")
    assert "bad.png is not a picture" in page.inner_text("#message")


def test_the_server_answers_while_it_meshes(page: Any, studio: Studio, tmp_path: Path) -> None:
    from support.labels import voronoi

    Image.fromarray(voronoi(900, 900, 60, 2).astype(np.uint8)).save(tmp_path / "large.png")
    give(page, tmp_path / "large.png")
    page.click("#step3")
    times = []
    for _ in range(20):
        start = time.perf_counter()
        assert studio.ask("GET", "/icon.svg")[0] == 200
        times.append(time.perf_counter() - start)
    page.click("#cancel")
    assert np.median(times) < 0.5, "the bar is 0.01 s on a machine of one's own"
