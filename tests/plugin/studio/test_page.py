"""The page in a real browser: from the drop to the file, with the hands of a user."""

from __future__ import annotations

import hashlib
import io
import re
import tarfile
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from imgquad_mesh.__main__ import main
from support.ccx import needs_ccx, solve
from support.studio import Studio

STEPS = ("segment", "denoise", "smooth", "mesh", "mesh")


def wait(page: Any, expression: str, seconds: float = 300) -> Any:
    """Wait until an expression holds (`wait_for_function` would need a weaker policy of the page)."""
    end = time.monotonic() + seconds
    while not (found := page.evaluate(expression)):
        said = page.evaluate("document.getElementById('message').textContent")
        assert time.monotonic() < end, f"{expression} within {seconds} s; the page says: {said}"
        time.sleep(0.05)
    return found


def give(page: Any, picture: Path) -> None:
    """Choose a picture and wait for its materials."""
    page.set_input_files("#file", str(picture))
    wait(page, "studio.results.segment && !document.body.hasAttribute('data-busy')")


def go(page: Any, step: int) -> None:
    """Go to a step and wait for what it shows."""
    page.click(f"#step{step}")
    settled(page, STEPS[step])


def settled(page: Any, stage: str) -> None:
    wait(page, f"studio.fresh('{stage}') && !document.body.hasAttribute('data-busy')")


def set_slider(page: Any, slider: str, value: float) -> None:
    page.evaluate(
        "([id, value]) => { const e = document.getElementById(id); e.value = value;"
        " for (const kind of ['input', 'change']) e.dispatchEvent(new Event(kind, {bubbles: true})); }",
        [slider, value],
    )


def command(page: Any, flag: str) -> None:
    """Wait until the command line in view holds a text."""
    wait(page, f"document.getElementById('text').textContent.includes({flag!r})")


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


def seen(page: Any, x: float, y: float) -> np.ndarray:
    """The colour that is seen around a point of the picture: the median of 9 x 9 pixels, as there may be an edge."""
    found = page.evaluate(
        """([x, y]) => {
            studio.view.draw();
            const { gl, canvas, ratio } = studio.view, found = new Uint8Array(4 * 81);
            const [left, top] = studio.view.toScreen(x, y).map((each) => Math.round(each * ratio));
            gl.readPixels(left - 4, canvas.height - top - 4, 9, 9, gl.RGBA, gl.UNSIGNED_BYTE, found);
            return [...found];
        }""",
        [x, y],
    )
    return np.median(np.reshape(found, (81, 4)), axis=0)[:3]


def test_the_view_shows_row_0_on_top_in_every_step(page: Any, tmp_path: Path) -> None:
    labels = np.zeros((60, 100), np.uint8)
    labels[:20, :30] = 1  # the upper left corner
    picture = Image.fromarray(labels)
    picture.putpalette([10, 200, 30, 240, 20, 220])
    picture.save(tmp_path / "corner.png")
    give(page, tmp_path / "corner.png")
    for step in range(4):
        go(page, step)
        page.evaluate("document.getElementById('opacity').value = 1; document.getElementById('opacity').oninput()")
        page.evaluate("studio.view.fit()")
        assert np.abs(seen(page, 10.5, 10.5) - [240, 20, 220]).max() < 60, step
        assert np.abs(seen(page, 70.5, 45.5) - [10, 200, 30]).max() < 60, step


def test_mesh_histogram_and_worst_quad(page: Any, rock: Path) -> None:
    give(page, rock)
    go(page, 1)
    set_slider(page, "min_pixels", 12)
    set_slider(page, "min_length", 6)
    go(page, 3)
    n = page.evaluate("studio.results.mesh.quality.n_quads")
    assert f"{n:,}" in page.inner_text("dl.figures")
    page.select_option("#shade", "jacobian")
    page.locator("#histogram button:not([disabled])").first.click()
    assert page.locator("#histogram [aria-pressed=true]").count() == 1
    worst = page.locator("#worst button")
    assert worst.count() == 12
    least = page.evaluate("studio.results.mesh.quality.min_sj")
    scale = page.evaluate("studio.view.camera.scale")
    worst.first.click()
    assert f"{least:.3f}" in worst.first.inner_text()
    assert f"{least:.3f}" in page.inner_text("#hover")
    assert page.evaluate("studio.view.camera.scale") > 2 * scale
    at = page.evaluate("studio.view.quadAt(studio.view.camera.x, studio.view.camera.y)")
    assert page.evaluate(f"studio.results.mesh.arrays.jacobians[{at}]") == pytest.approx(least, abs=1e-5)
    box = page.locator("#canvas").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2 + 2, box["y"] + box["height"] / 2 + 2)
    assert "scaled Jacobian" in page.inner_text("#hover")


def test_a_picture_is_left_out_where_the_mesh_hides_all_of_it(page: Any, rock: Path) -> None:
    give(page, rock)
    go(page, 3)
    found = page.evaluate(
        """() => {
            const { view, results } = studio, { corners, jacobians, places } = results.mesh.arrays;
            const draw = view._drawPicture.bind(view), seen = () => (view.draw(), view.canvas.toDataURL());
            let drawn = 0;
            view._drawPicture = () => (drawn++, draw());
            const hidden = seen(), without = drawn;
            view.quads.filled = null;
            const same = seen() === hidden, beneath = drawn;
            const rest = { corners: corners.subarray(8), jacobians: jacobians.subarray(1), places: places.subarray(1) };
            view.setQuads(rest);
            seen();
            return [without, same, beneath, drawn];
        }"""
    )
    assert found == [0, True, 1, 2]  # one quad less is a hole


def test_moves_draw_frames(page: Any, rock: Path) -> None:
    give(page, rock)
    box = page.locator("#canvas").bounding_box()
    frames = page.evaluate("studio.view.frames")
    page.mouse.move(box["x"] + 300, box["y"] + 200)
    page.mouse.down()
    for k in range(20):
        page.mouse.move(box["x"] + 300 + 4 * k, box["y"] + 200 + 3 * k)
        page.wait_for_timeout(20)
    page.mouse.up()
    assert page.evaluate("studio.view.frames") > frames + 5
    scale = page.evaluate("studio.view.camera.scale")
    page.mouse.wheel(0, -400)
    wait(page, f"studio.view.camera.scale > {scale}")
    page.focus("#canvas")
    page.keyboard.press("0")
    assert page.evaluate("studio.view.camera.scale") == pytest.approx(scale, rel=0.01)


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


def test_pictures_that_browsers_cannot_show_are_drawn_by_the_server(page: Any, tmp_path: Path) -> None:
    values = np.zeros((60, 80), np.uint16)
    values[:, 40:] = 900
    np.save(tmp_path / "scan.npy", values)
    give(page, tmp_path / "scan.npy")
    wait(page, "studio.view.size[0] === 80")
    page.select_option("#show", "picture")
    assert seen(page, 20.5, 30.5).tolist() == [0, 0, 0]
    assert seen(page, 60.5, 30.5).tolist() == [255, 255, 255]


def test_what_is_wrong_is_said_in_one_line(page: Any, tmp_path: Path) -> None:
    (tmp_path / "bad.png").write_bytes(b"hello")
    page.set_input_files("#file", str(tmp_path / "bad.png"))
    wait(page, "!document.getElementById('message').hidden")
    assert "bad.png is not a picture" in page.inner_text("#message")


AXE = "https://registry.npmjs.org/axe-core/-/axe-core-4.10.3.tgz"
AXE_SHA256 = "0f2b4d7dcdf7d1219df8d1959ad68e565f51d14c3f0d88bb71cd59abeb956292"


@pytest.fixture(scope="session")
def axe() -> str:
    """The source of axe-core, from npm's registry."""
    try:
        with urllib.request.urlopen(AXE, timeout=60) as answer:
            data = answer.read()
    except OSError as error:
        pytest.skip(f"axe-core cannot be fetched from npm: {error}")
    assert hashlib.sha256(data).hexdigest() == AXE_SHA256
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        file = archive.extractfile("package/axe.min.js")
        assert file is not None
        return file.read().decode()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_in_any_state(scheme: str, open_page: Callable[..., Any], axe: str, rock: Path) -> None:
    page = open_page(color_scheme=scheme)

    def findings() -> list[str]:
        found = page.evaluate(f"async () => {{ {axe}; return (await axe.run()).violations; }}")
        return [f"{each['id']}: {each['nodes'][0]['html'][:150]}" for each in found]

    assert findings() == []
    give(page, rock)
    page.click("#panel details summary")
    for step in range(5):
        if step:
            go(page, step)
        assert findings() == [], step
    page.select_option("#format", ".inp")
    page.select_option("#deck", "tension")
    assert findings() == []


def test_a_phone_scrolls_down_only(open_page: Callable[..., Any], rock: Path) -> None:
    page = open_page(390, 780, has_touch=True, is_mobile=True)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    give(page, rock)
    for step in range(5):
        if step:
            go(page, step)
        assert page.evaluate("document.documentElement.scrollWidth") <= 390, step
        assert page.locator("#canvas").bounding_box()["height"] > 300


def test_the_keyboard_reaches_all(page: Any, rock: Path) -> None:
    give(page, rock)
    page.focus("#step0")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.id") == "step1"
    page.keyboard.press("Enter")
    settled(page, "denoise")
    assert page.evaluate("document.activeElement.id") == "step1"
    reached = set()
    for _ in range(40):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.id"))
    wanted = {"canvas", "split", "show", "opacity", "fit", "min_pixels", "min_length-auto", "tab-command", "copy"}
    assert wanted <= reached


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
