"""What CalculiX found comes back to PyVista: the example that draws stress on a micrograph, run as it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from support import ROOT
from support.ccx import needs_ccx


@needs_ccx
def test_the_example_solves_a_rock_and_draws_its_stress(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pv = pytest.importorskip("pyvista")
    pytest.importorskip("pyvista_frd", reason="pip install pyvista-frd-reader")
    pytest.importorskip("matplotlib")
    monkeypatch.syspath_prepend(ROOT / "examples")
    import stress_on_a_micrograph

    stress_on_a_micrograph.main(tmp_path)
    assert (tmp_path / "stress.png").stat().st_size > 10_000
    result = pv.read(tmp_path / "rock.frd")
    assert set(result.celltypes) == {pv.CellType.QUAD}
    pulled = result.point_data["DISP"][:, 0]
    width = np.ptp(result.points[:, 0])
    assert pulled.max() == pytest.approx(1e-3 * width, rel=1e-5)
    assert (result.point_data["STRESS_Mises"] > 0).all()
