"""The accessor `.imgquad`: found by PyVista itself, on the datasets that need it, as cheap as it must be."""

from __future__ import annotations

import inspect
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

from imgquad_core.pipeline import STAGES
from imgquad_mesh import filters
from imgquad_mesh.progress import DOING
from support.images import point_image


def test_methods_are_the_functions_with_their_help() -> None:
    image = point_image()
    assert image.imgquad.mesh.__doc__ == filters.mesh.__doc__
    names = list(inspect.signature(filters.mesh).parameters)
    assert list(inspect.signature(image.imgquad.mesh).parameters) == names[1:]


def test_every_filter_is_a_method_of_some_dataset() -> None:
    kinds = (pv.ImageData, pv.PolyData, pv.UnstructuredGrid)
    methods = {name for kind in kinds for name in dir(kind().imgquad) if not name.startswith("_")}
    assert set(filters.__all__) - methods == {"boundaries_of_mesh"}  # that is `boundaries` of a grid
    with pytest.raises(AttributeError):
        pv.RectilinearGrid().imgquad  # noqa: B018


@pytest.mark.parametrize("function", [getattr(filters, name) for name in filters.__all__])
def test_conventions_of_pyvista(function: object) -> None:
    """At most one argument after the dataset is positional; an image filter has `scalars=None`."""
    parameters = list(inspect.signature(function).parameters.values())  # type: ignore[arg-type]
    positional = [p for p in parameters[1:] if p.kind is p.POSITIONAL_OR_KEYWORD]
    assert len(positional) <= 1
    named = {p.name: p.default for p in parameters}
    if parameters[0].name == "image":
        assert named["scalars"] is None
    if "progress_bar" in named:
        assert named["progress_bar"] is False
        assert parameters[-1].name == "progress_bar"
    assert function.__doc__ is not None
    for name in list(named)[1:]:
        assert name in function.__doc__, f"{name} is not described"


def test_nothing_heavy_is_loaded_before_the_first_filter() -> None:
    """PyVista finds the accessor by itself; importing it costs under 50 ms of work and leaves Numba alone."""
    script = """
import sys, time
import pyvista as pv
start = time.process_time()
import imgquad_mesh.accessor
took = time.process_time() - start
image = pv.ImageData(dimensions=(4, 4, 1))
image.imgquad.mesh
from imgquad_mesh.__main__ import build_parser
build_parser().format_help()
print(took, "numba" in sys.modules)
"""
    runs = [
        subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True) for _ in range(3)
    ]
    seconds, loaded = zip(*(run.stdout.split() for run in runs), strict=True)
    assert set(loaded) == {"False"}
    assert min(map(float, seconds)) < 0.05  # the machine may be busy with something else


def test_help_is_there_without_numpy() -> None:
    code = "import sys; from imgquad_mesh.__main__ import build_parser; build_parser().format_help();"
    code += "print([m for m in ('numpy', 'rich', 'pyvista') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_progress_knows_every_stage() -> None:
    assert set(STAGES) <= set(DOING)


def test_only_pyvista_is_imported_by_the_user(tmp_path: Path) -> None:
    script = """
import pyvista as pv
image = pv.ImageData(dimensions=(20, 20, 1))
image["label"] = (image.points[:, 0] > 9).astype(int)
mesh = image.imgquad.segment().imgquad.remove_noise().imgquad.boundaries().imgquad.smooth(3).imgquad.quads()
print(mesh.n_cells, mesh.imgquad.quality()["scaled_jacobian"].min() > 0.5)
"""
    command = [sys.executable, "-W", "error", "-c", script]
    out = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout.split()
    assert int(out[0]) > 30
    assert out[1] == "True"


def test_an_older_pyvista_is_told_what_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(pv, "register_dataset_accessor")
    monkeypatch.delitem(sys.modules, "imgquad_mesh.accessor")
    with pytest.raises(ImportError, match=r"needs PyVista 0\.49 or newer.*pip install -U pyvista"):
        import imgquad_mesh.accessor  # noqa: F401


def test_accessor_follows_its_dataset() -> None:
    image = point_image()
    other = image.copy()
    other["label"] = np.zeros(image.n_points, int)
    assert len(np.unique(image.imgquad.mesh()["material"])) == 3
    assert len(np.unique(other.imgquad.mesh()["material"])) == 1


def test_thin_features_are_a_warning_of_the_caller() -> None:
    image = pv.ImageData(dimensions=(60, 60, 1))
    image["label"] = (np.random.default_rng(1).random(3600) < 0.08).astype(int)
    with pytest.warns(UserWarning, match="thin features force [0-9]+ quads") as caught:
        image.imgquad.mesh("label", size=6.0, min_pixels=0, min_length=0)
    assert caught[0].filename == __file__
