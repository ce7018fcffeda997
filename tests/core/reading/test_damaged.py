"""A damaged file of any format is read, or refused in one line that names it; memory is not taken on its word."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from imgquad_core.errors import InputError
from imgquad_core.reading.formats import read_picture
from imgquad_mesh.datasets.pictures import read_any
from support.files import WRITERS, assert_read_or_refused, damage, options_for, write_dream3d

CUTS = (1, 4, 20, 100, 200, 348, 400, -40, -1)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A whole file of each format."""
    return {name: writer(tmp_path_factory.mktemp("whole") / name) for name, writer in WRITERS.items()}


@pytest.mark.parametrize("name", WRITERS)
def test_a_whole_file_is_read(written: dict[str, Path], name: str) -> None:
    assert assert_read_or_refused(written[name])


@pytest.mark.parametrize("name", [name for name in WRITERS if not name.endswith(".zarr")])
def test_a_file_that_is_cut_off(written: dict[str, Path], tmp_path: Path, name: str) -> None:
    """What is read is the picture to the last pixel, or a note says what is missing."""
    whole = written[name].read_bytes()
    truth = read_any(written[name], options_for(written[name])).values
    for end in (*CUTS, len(whole) // 2):
        (tmp_path / name).write_bytes(whole[:end])
        if assert_read_or_refused(tmp_path / name):
            found = read_any(tmp_path / name, options_for(written[name]))
            assert np.array_equal(found.values, truth) or "may be cut off" in " ".join(found.notes)


@given(name=st.sampled_from(sorted(WRITERS)), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_file_of_changed_bytes(written: dict[str, Path], tmp_path: Path, name: str, seed: int) -> None:
    target = tmp_path / name
    shutil.rmtree(target, ignore_errors=True)
    (shutil.copytree if written[name].is_dir() else shutil.copyfile)(written[name], target)
    damage(target, np.random.default_rng(seed))
    assert_read_or_refused(target)


def test_texts_of_hdf5_whose_heap_is_damaged_are_refused(tmp_path: Path) -> None:
    """The length of the last text made larger: the walk would end at zeros, which HDF5 2.0 walks for ever."""
    path = write_dream3d(tmp_path / "a.dream3d")
    content = bytearray(path.read_bytes())
    heap = content.index(b"GCOL")
    last = content.index(b"Nickel", heap) - 8
    content[last : last + 8] = (184).to_bytes(8, "little")
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"a\.dream3d is damaged where the texts of .*PhaseName lie"):
        read_picture(path)
