"""A slice of the campaign against faults, as `python benchmarks/faults.py --share ...` runs it."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys

import pytest

import faults

SLICE = {
    "kills": 1,
    "late-kills": 1,
    "full-disks": 1,
    "caches": 2,
    "mounts": 4,
    "meshes": 25,
    "elements": 15,
    "cells": 2,
    "threads": 1,
    "options": 4,
    "readers": 150,
}


def test_the_slice_has_every_section() -> None:
    assert set(SLICE) == set(faults.SECTIONS)


def _can_mount() -> bool:
    own = ["unshare", "--map-root-user", "--mount", "sh", "-ec", "mount -t tmpfs tmpfs /mnt"]
    return shutil.which("unshare") is not None and subprocess.run(own, capture_output=True, check=False).returncode == 0


@pytest.mark.skipif(sys.platform == "win32", reason="signals and limits of POSIX")
@pytest.mark.parametrize("section", SLICE)
def test_a_slice_of_the_campaign_has_no_failure(section: str) -> None:
    if section == "mounts" and not _can_mount():
        pytest.skip("this machine lets nobody mount in a namespace of his own (unshare)")
    found = faults.campaign(section, seed=16, times=SLICE[section])
    assert not found.failed, "\n".join(found.failed)


def test_a_trial_that_fails_is_told_with_its_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        """It breaks."""
        raise ValueError("broken")

    monkeypatch.setitem(faults.SECTIONS, "broken", faults.Section(broken, 3))
    found = faults.campaign("broken", 5, 2)
    for k, told in enumerate(found.failed):
        assert re.fullmatch(rf"broken, seed 5, trial {k}: test_faults.py:\d+: ValueError: broken", told)
    assert len(found.failed) == 2
    assert faults.table({"broken": found}).endswith("| broken | It breaks | 2 | 2 |")
