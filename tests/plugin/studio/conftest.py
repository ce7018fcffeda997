"""One studio and one browser for all tests of the page."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from support.studio import Studio, needs_chromium, running_studio

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")


@pytest.fixture(scope="session")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Studio]:
    with running_studio(tmp_path_factory.mktemp("studio"), "--sessions", "8") as started:
        yield started


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    chromium = needs_chromium()
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        arguments = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage"]
        started = playwright.chromium.launch(executable_path=chromium, args=arguments)
        yield started
        started.close()


@pytest.fixture
def open_page(studio: Studio, browser: Any) -> Iterator[Callable[..., Any]]:
    """Open the studio in a browser of one's own; whatever it complains of in its console fails the test."""
    complaints: list[str] = []
    contexts = []

    def opened(width: int = 1280, height: int = 800, **more: Any) -> Any:
        context = browser.new_context(viewport={"width": width, "height": height}, accept_downloads=True, **more)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(180_000)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda message: message.type in ("error", "warning") and complaints.append(message.text))
        page.goto(studio.address)
        page.wait_for_selector("body[data-ready]")
        return page

    yield opened
    for context in contexts:
        context.close()
    # the GL driver warns of reads that wait, which is what they are for
    assert [text for text in complaints if "GPU stall" not in text] == []


@pytest.fixture
def page(open_page: Callable[..., Any]) -> Any:
    return open_page()


@pytest.fixture
def rock(tmp_path: Path) -> Path:
    """The rock of the demo, as a picture of 200 x 140 pixels."""
    from imgquad_mesh.outputs import draw_rock

    path = tmp_path / "rock.png"
    draw_rock().crop((0, 0, 200, 140)).save(path)
    return path
