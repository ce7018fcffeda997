"""A worker without a page: what it keeps, what it refuses, how much it may use."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from imgquad_core import pipeline
from imgquad_core.errors import InputError
from imgquad_core.measures import quality_report, scaled_jacobian
from imgquad_mesh.studio.packing import Frame, pack_quads, packed
from imgquad_mesh.studio.worker import TASKS, Desk

GREY = np.kron(np.array([[0, 1], [1, 0]]), np.ones((40, 60), int)) * 90 + 60
GREY = np.clip(GREY + np.random.default_rng(1).normal(0, 6, GREY.shape), 0, 255).astype(np.uint8)
TASK = {"file": "upload1.npy", "name": "grey.npy", "marks": None, "recipe": {"picture": "grey.npy", "options": {}}}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    np.save(tmp_path / "upload1.npy", GREY)
    return tmp_path


def do(desk: Desk, what: str, **options: Any) -> dict[str, Any]:
    task = {**TASK, "recipe": {"picture": "grey.npy", "options": options}}
    return TASKS[what](desk, task, lambda line: None)[0]


def test_a_new_worker_goes_on_with_the_segmentation_of_a_killed_one(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = do(Desk(folder, 10**6), "denoise", colors=2)

    def never(*_: Any) -> Any:
        raise AssertionError("segmented again")

    monkeypatch.setattr(pipeline, "segment_source", never)
    assert do(Desk(folder, 10**6), "denoise", colors=2) == first
    assert do(Desk(folder, 10**6), "denoise", colors=2, min_pixels=9, min_length=4)["rows"] == 80
    with pytest.raises(AssertionError, match="again"):
        do(Desk(folder, 10**6), "denoise", colors=3)


def test_only_what_has_changed_is_made_anew(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(folder, 10**6)
    do(desk, "mesh")
    monkeypatch.setattr(pipeline, "remove_noise", None)
    monkeypatch.setattr(pipeline, "segment_source", None)
    assert do(desk, "mesh", size=6.0)["quality"]["n_quads"] < do(desk, "mesh", size=5.0)["quality"]["n_quads"]
    with pytest.raises(TypeError):
        do(desk, "mesh", min_pixels=50, min_length=9)


def test_the_page_is_told_what_a_report_says(folder: Path) -> None:
    desk = Desk(folder, 10**6)
    told = do(desk, "mesh", colors=2)["quality"]
    report = asdict(quality_report(desk.memory["mesh"][1]))
    assert told == {name: report[name] for name in told}
    assert told["n_quads"] > 100


def test_a_long_stage_tells_how_far_it_is_now_and_then(folder: Path) -> None:
    def told(rest: float) -> list[dict[str, Any]]:
        lines: list[dict[str, Any]] = []
        task = {**TASK, "recipe": {"picture": "grey.npy", "options": {"size": 2.0}}}
        TASKS["mesh"](Desk(folder, 10**6, rest), task, lines.append)
        return lines

    often = [line["number"] for line in told(0.0) if line["stage"] == "mesh"]
    assert often == sorted(often)
    assert len(often) > 2
    assert [line["stage"] for line in told(600.0)] == list(pipeline.STAGES), "each stage as it starts"


def test_quads_are_packed_as_the_picture_lies(folder: Path) -> None:
    done = pipeline.run(GREY)
    jacobians = scaled_jacobian(done.pixel_mesh.points, done.pixel_mesh.quads)
    arrays = pack_quads(done.pixel_mesh, jacobians, Frame(done.labels.shape, done.boundary.shape, None))
    corners = arrays["corners"].reshape(-1, 4, 2)
    assert corners.min() == 0
    assert corners.max(axis=(0, 1)).tolist() == [120, 80]
    assert sorted(arrays["quads"].tolist()) == list(range(done.mesh.n_quads))
    assert arrays["jacobians"].tolist() == jacobians.astype(np.float32)[arrays["quads"]].tolist()
    assert (done.mesh.materials.labels[arrays["places"]] == done.mesh.quad_material[arrays["quads"]]).all()
    x, y = corners.mean(axis=1).astype(int).T
    assert (done.labels.labels[y, x] == done.mesh.quad_material[arrays["quads"]]).mean() > 0.95, "row 0 is on top"
    listed, data = packed(arrays)
    assert len(data) == sum(-(-each["bytes"] // 4) * 4 for each in listed)


def test_marks_that_are_missing_are_asked_for(folder: Path) -> None:
    task = {**TASK, "recipe": {"picture": "grey.npy", "options": {}, "marks": True}}
    with pytest.raises(InputError, match="paint"):
        TASKS["segment"](Desk(folder, 10**6), task, lambda line: None)


@pytest.mark.skipif(sys.platform == "win32", reason="no limit of memory on Windows")
def test_memory_beyond_the_limit_is_a_memory_error_of_the_worker() -> None:
    code = (
        "from imgquad_mesh.memory import limit_memory\nimport numpy as np\nlimit_memory(10**9, 'RLIMIT_DATA')\n"
        "try: np.ones(300_000_000)\nexcept MemoryError: print('refused')"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert run.stdout.strip() == "refused"
