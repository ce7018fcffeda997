"""Draws the picture of the studio: `python docs/draw_studio.py` (needs Chromium and playwright)."""

from __future__ import annotations

import io
import shutil
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.studio import running_studio

SLIDE = "([id, v]) => { const e = document.getElementById(id); e.value = v; e.dispatchEvent(new Event('input')); }"


def settled(page: Page, stage: str) -> None:
    while not page.evaluate(f"studio.fresh('{stage}') && !document.body.hasAttribute('data-busy')"):
        time.sleep(0.1)


def draw(page: Page) -> None:
    """Go from the rock of the demo to its mesh, by scaled Jacobian."""
    page.click("#rock")
    settled(page, "segment")
    page.click("#step1")
    page.evaluate(SLIDE, ["min_pixels", 12])
    page.evaluate(SLIDE, ["min_length", 6])
    settled(page, "denoise")
    page.click("#step3")
    settled(page, "mesh")
    page.evaluate("studio.view.look({ x: 150, y: 120, scale: 5 })")
    page.select_option("#shade", "jacobian")
    time.sleep(1)
    picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    picture.quantize(128).save(Path(__file__).with_name("images") / "studio.png", optimize=True)


def main() -> None:
    with (
        tempfile.TemporaryDirectory() as folder,
        running_studio(Path(folder)) as studio,
        sync_playwright() as playwright,
    ):
        arguments = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=arguments)
        page = browser.new_page(viewport={"width": 1180, "height": 760})
        page.goto(studio.address)
        page.wait_for_selector("body[data-ready]")
        draw(page)
        browser.close()


if __name__ == "__main__":
    main()
