"""`imgquad-mesh warm` leaves hardly a kernel to compile."""

from __future__ import annotations

import re

import pytest

from imgquad_mesh.__main__ import main


def test_warm_compiles_nearly_all(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["warm"]) == 0
    share = re.match(r"(\d+)% of the kernels", capsys.readouterr().out)
    assert share is not None
    assert int(share[1]) > 80
