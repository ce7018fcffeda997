"""The progress bar of filters."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress_of(wanted: bool) -> Iterator[Callable[[str], None]]:
    """Give a function to call with the name of each stage that starts."""
    from imgquad_mesh.checks import checked

    if not checked(progress_bar=wanted)["progress_bar"]:
        yield lambda stage: None
        return
    from imgquad_core.pipeline import STAGES
    from imgquad_mesh.cli.console import progress_bar_if

    with progress_bar_if(True) as show:
        yield lambda stage: show(stage, STAGES.index(stage), len(STAGES))
