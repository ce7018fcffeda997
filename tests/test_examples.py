"""Every example of the gallery runs; each asserts a figure of its own at its end."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest
import pyvista as pv

from support import ROOT
from support.images import need_renderer

EXAMPLES = sorted((ROOT / "examples").glob("plot_*.py"))


@pytest.mark.parametrize("path", EXAMPLES, ids=[path.stem for path in EXAMPLES])
def test_example_runs_and_draws(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    need_renderer()
    shown = []
    show = pv.Plotter.show
    monkeypatch.setattr(pv, "OFF_SCREEN", True)
    monkeypatch.setattr(pv.Plotter, "show", lambda self, *args, **kwargs: shown.append(show(self, *args, **kwargs)))
    runpy.run_path(str(path))
    assert shown, "it draws nothing"
    assert "\nassert " in path.read_text(encoding="utf-8"), "it asserts nothing"
    pv.close_all()


def test_there_is_an_example_of_each_kind() -> None:
    assert len(EXAMPLES) >= 6
