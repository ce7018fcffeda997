"""Progress bars. The command's help loads this: it needs no NumPy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

DOING = {
    "read": "reading",
    "segment": "finding materials",
    "denoise": "removing noise",
    "absorb": "absorbing what is too narrow",
    "boundary": "extracting boundaries",
    "smooth": "smoothing boundaries",
    "mesh": "meshing",
    "write": "writing",
}


@contextmanager
def progress_bar_if(wanted: bool) -> Iterator[Callable[[str, float, int], None]]:
    """Give a function to call as each stage starts; it draws a bar if one is wanted and there is a terminal."""
    console = _terminal() if wanted else None
    if console is None:
        yield lambda stage, number, total: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description:22}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("starting", total=None)

        def show(stage: str, number: float, total: int) -> None:
            progress.update(task, description=DOING[stage], completed=number, total=total)

        yield show


@contextmanager
def counting_if(wanted: bool, expected: Mapping[str, int | None]) -> Iterator[Callable[[str], None]]:
    """Give a function to call with the kind of each step that ends; it draws a bar a kind of those expected."""
    console = _terminal() if wanted else None
    if console is None:
        yield lambda kind: None
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:12}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        bars = {kind: progress.add_task(kind, total=n) for kind, n in expected.items()}
        yield lambda kind: progress.advance(bars[kind]) if kind in bars else None


def _terminal() -> Console | None:
    """Return the terminal behind stderr; None if there is none."""
    from rich.console import Console  # not above: rich takes longer than the whole accessor

    console = Console(stderr=True)
    return console if console.is_terminal else None
