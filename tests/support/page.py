"""The hands of a user on the studio's page."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

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
