"""What CalculiX found comes back to PyVista: the example that draws stress on a micrograph, run as it is."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from ccx import needs_ccx

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples"))


@needs_ccx
def test_the_example_solves_a_rock_and_draws_its_stress(tmp_path: Path) -> None:
    pv = pytest.importorskip("pyvista")
    pytest.importorskip("pyvista_frd", reason="pip install pyvista-frd-reader")
    pytest.importorskip("matplotlib")
    import stress_on_a_micrograph

    stress_on_a_micrograph.main(tmp_path)
    assert (tmp_path / "stress.png").stat().st_size > 10_000
    result = pv.read(tmp_path / "rock.frd")
    assert set(result.celltypes) == {pv.CellType.QUAD}
    pulled = result.point_data["DISP"][:, 0]
    width = np.ptp(result.points[:, 0])
    assert pulled.max() == pytest.approx(1e-3 * width, rel=1e-5)
    assert (result.point_data["STRESS_Mises"] > 0).all()
