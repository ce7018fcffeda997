"""The page for all: axe, a phone, the keyboard."""

from __future__ import annotations

import hashlib
import io
import tarfile
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from support.page import give, go, settled

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
