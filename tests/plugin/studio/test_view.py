"""What the page draws, in a real browser."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from support.page import give, go, set_slider, wait


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


def test_pictures_that_browsers_cannot_show_are_drawn_by_the_server(page: Any, tmp_path: Path) -> None:
    values = np.zeros((60, 80), np.uint16)
    values[:, 40:] = 900
    np.save(tmp_path / "scan.npy", values)
    give(page, tmp_path / "scan.npy")
    wait(page, "studio.view.size[0] === 80")
    page.select_option("#show", "picture")
    assert seen(page, 20.5, 30.5).tolist() == [0, 0, 0]
    assert seen(page, 60.5, 30.5).tolist() == [255, 255, 255]


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
