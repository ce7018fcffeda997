"""Stacks: one rule for all slices, what is done stays, what is broken is named."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista as pv
from PIL import Image

from imgquad_core import MeshOptions
from imgquad_core.errors import InputError
from imgquad_mesh.__main__ import main
from imgquad_mesh.large import mesh_stack
from imgquad_mesh.large.graph import ClusterError, run_on

OPTIONS = MeshOptions(size=4.0)
COLORS = np.array([[200, 30, 30], [30, 200, 30], [30, 30, 200]], np.uint8)


def slice_labels(k: int) -> np.ndarray:
    """A disc that moves; material 2 is in slice 2 only."""
    y, x = np.mgrid[:40, :50]
    labels = (np.hypot(x - 15 - 5 * k, y - 20) < 9).astype(np.uint8)
    labels[30:38, 2:12] = 2 if k == 2 else 0
    return labels


@pytest.fixture
def files(tmp_path: Path) -> Path:
    folder = tmp_path / "slices"
    folder.mkdir()
    for k in range(4):
        Image.fromarray(COLORS[slice_labels(k)]).save(folder / f"s{k + 8}.png")  # s8, s9, s10, s11
    return folder


def stamps(folder: Path) -> dict[str, int]:
    return {path.name: path.stat().st_mtime_ns for path in folder.glob("slice_*.vtu")}


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.glob("slice_*.vtu"))}


def test_command_meshes_what_can_be_read_and_names_the_rest(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = files / "s9.png"
    broken.write_bytes(broken.read_bytes()[:90])
    out = tmp_path / "out.pvd"
    assert main(["stack", str(files / "*.png"), str(out), "--size", "4", "--spacing", "2.5"]) == 3
    assert "s9.png was not meshed" in capsys.readouterr().err

    reader = pv.get_reader(out)
    assert reader.time_values == [0.0, 5.0, 7.5]  # slices in the order of their numbers, the broken one left out
    names = []
    for k, time in zip((0, 2, 3), reader.time_values, strict=True):
        reader.set_active_time_value(time)
        grid = reader.read()[0]
        assert grid.bounds == pytest.approx((0, 50, 0, 40, time, time))
        names.append(list(grid.field_data["material_names"]))
        blue = names[0].index("rgb_1e1ec8")
        number = grid.field_data["material_numbers"][blue]
        area = grid.extract_cells(grid.cell_data["material"] == number).area
        assert area == pytest.approx(80 if k == 2 else 0, abs=1.0)
    assert names[0] == names[1] == names[2]  # also where a slice has none of it
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert [("error" in row) for row in report["slices"]] == [False, True, False, False]
    assert sum(row["pixels"] for row in report["materials"]) == 3 * 40 * 50


def test_what_is_done_stays_and_what_changed_is_meshed_anew(files: Path, tmp_path: Path) -> None:
    out, pattern = tmp_path / "out.pvd", files / "*.png"
    mesh_stack(pattern, out, OPTIONS)
    before = stamps(tmp_path / "out")
    mesh_stack(pattern, out, OPTIONS)
    assert stamps(tmp_path / "out") == before
    (tmp_path / "out" / "slice_0003.vtu").write_bytes(b"cut off")
    Image.fromarray(COLORS[slice_labels(1)[::-1]]).save(files / "s9.png")
    mesh_stack(pattern, out, OPTIONS)
    changed = {name for name, stamp in stamps(tmp_path / "out").items() if stamp != before[name]}
    assert changed == {"slice_0001.vtu", "slice_0003.vtu"}


def test_another_plan_is_refused(files: Path, tmp_path: Path) -> None:
    out, pattern = tmp_path / "out.pvd", files / "*.png"
    mesh_stack(pattern, out, OPTIONS)
    with pytest.raises(InputError, match=r"begun with size = \"4.0\", not \"5.0\".*--restart"):
        mesh_stack(pattern, out, MeshOptions(size=5.0))
    assert len(mesh_stack(pattern, out, MeshOptions(size=5.0), restart=True)) == 4
    foreign = tmp_path / "mine"
    foreign.mkdir()
    (foreign / "thesis.txt").write_text("mine")
    with pytest.raises(InputError, match="holds files that are not of such a run"):
        mesh_stack(pattern, tmp_path / "mine.pvd", OPTIONS)


def test_shades_are_divided_alike_in_all_slices(tmp_path: Path) -> None:
    """Slice 0 has two of the three phases only: by itself it would be divided in two classes, 0 and 1."""
    rng = np.random.default_rng(1)
    slices = []
    for k in range(3):
        labels = np.where(slice_labels(k) > 0, 2, 0)
        labels[2:14, 30:48] = 1 if k else 0
        slices.append(np.clip(np.array([40, 120, 210])[labels] + rng.normal(0, 6, labels.shape), 0, 255))
    made = mesh_stack(np.array(slices, np.uint8), tmp_path / "out.pvd", MeshOptions(size=4.0, min_pixels=9))
    assert [sorted(set(grid.cell_data["material"])) for grid in made] == [[0, 2], [0, 1, 2], [0, 1, 2]]
    assert [row["counts"]["regions"]["meshed"] for row in made.report["slices"]] == [2, 3, 4]


def test_same_bytes_on_a_cluster_from_dask_zarr_and_numpy(client: Any, tmp_path: Path) -> None:
    da, zarr = pytest.importorskip("dask.array"), pytest.importorskip("zarr")
    volume = np.array([slice_labels(k) for k in range(3)])
    stored = zarr.create_array(str(tmp_path / "volume.zarr"), shape=volume.shape, chunks=(1, 16, 16), dtype="u1")
    stored[:] = volume
    mesh_stack(volume, tmp_path / "here.pvd", OPTIONS, client=client)
    tasks = mesh_stack(da.from_array(volume, chunks=(2, 20, 20)), tmp_path / "lazy.pvd", OPTIONS, compute=False)
    assert not (tmp_path / "lazy.pvd").exists()
    assert len(tasks.compute(scheduler=client)) == 3
    mesh_stack(tmp_path / "volume.zarr", tmp_path / "zarr.pvd", OPTIONS)  # the current client
    found = [bytes_of(tmp_path / name) for name in ("here", "lazy", "zarr")]
    assert len(found[0]) == 3
    assert found[0] == found[1] == found[2]


def _kill_once(flag: str) -> int:
    if not Path(flag).exists():
        Path(flag).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return 7


def _kill_always() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_killed_worker_does_its_work_again(client: Any, tmp_path: Path) -> None:
    from imgquad_mesh.large.graph import Failed, Result, Step

    steps = [Step("a", _kill_once, (str(tmp_path / "flag"),)), Step("c-1", max, (Result("a"), 3))]
    told: list[str] = []
    assert run_on(client, steps, told.append) == {"a": 7, "c-1": 7}
    assert sorted(told) == ["a", "c"]
    failed = run_on(client, [Step("b-1", _kill_always, ())], told.append)["b-1"]
    assert isinstance(failed, Failed)
    assert "out of memory most likely" in failed.reason


def _close_scheduler(address: str) -> None:
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        client.shutdown()


def test_a_lost_scheduler_is_told_and_the_next_one_goes_on(files: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    from imgquad_mesh.large.graph import Step

    cluster = distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=50)
    client = distributed.Client(cluster, set_as_default=False)
    mesh_stack(files / "s8.png", tmp_path / "out.pvd", OPTIONS, client=client)
    before = stamps(tmp_path / "out")
    with pytest.raises(ClusterError, match="is gone: start it and then the same command again"):
        run_on(client, [Step("a", _close_scheduler, (cluster.scheduler_address,))], lambda kind: None)
    client.close()
    cluster.close()
    mesh_stack(files / "s8.png", tmp_path / "out.pvd", OPTIONS)
    assert stamps(tmp_path / "out") == before


def test_a_full_disk_is_told_and_nothing_half_is_left(
    files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from imgquad_mesh import outputs

    save = outputs.save_dataset

    def full(dataset: Any, path: Path) -> None:
        if "0002" in path.name:
            path.write_bytes(b"half")
            raise OSError(28, "No space left on device")
        save(dataset, path)

    monkeypatch.setattr(outputs, "save_dataset", full)
    made = mesh_stack(files / "*.png", tmp_path / "out.pvd", OPTIONS)
    assert [name for name, _ in made.failed] == ["s10.png"]
    assert "No space left" in made.failed[0][1]
    assert not (tmp_path / "out" / "slice_0002.vtu").exists()
    monkeypatch.undo()
    assert not mesh_stack(files / "*.png", tmp_path / "out.pvd", OPTIONS).failed


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere/*.png", "out.pvd"], "no file is called nowhere/*.png"),
        (["{files}/*.png", "out.vtu"], "cannot write '.vtu'"),
        (["{files}/*.png", "out.pvd", "--frame", "1"], "frame is 1"),
        (["{files}/*.png", "out.pvd", "--spacing", "0"], "spacing is 0"),
        (["{files}/*.png", "out.pvd", "--colors", "regions"], "colors = regions is for one picture"),
        (["{files}/*.png", "out.pvd", "--scheduler", "tcp://127.0.0.1:1"], "no scheduler answers at tcp://127.0.0.1:1"),
    ],
)
def test_bad_requests_name_what_and_the_remedy(
    arguments: list[str],
    message: str,
    files: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("imgquad_mesh.large.cluster.REACHED", 1)
    assert main(["stack", *(text.format(files=files) for text in arguments)]) == 2
    assert message in capsys.readouterr().err
