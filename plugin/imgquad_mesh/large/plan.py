"""The folder that results are collected in: what it is for stands in its plan.json; nobody else's files are touched."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from imgquad_core.errors import InputError
from imgquad_core.options import MeshOptions
from imgquad_core.reading import Picture
from imgquad_mesh import outputs

PLAN = "plan.json"
WRITTEN, FOLDERS = (".vtu", ".json", ".pvtu", ".vtkhdf"), ("work", "mesh")  #: what runs leave in their folder


def start_plan(folder: Path, plan: Mapping[str, Any], restart: bool) -> None:
    """Make the folder of a plan, or go on with one that has the same; with `restart`, another plan is given up.

    Raises
    ------
    InputError
        The folder has another plan, or files that are nobody's, or cannot be made.
    """
    asked = json.loads(json.dumps(plan))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        found = _plan_in(folder)
        if found is None and any(not each.name.startswith(".") for each in folder.iterdir()):
            raise InputError(f"{folder} holds files that are not of such a run: give another name")
    except OSError as error:
        raise InputError(f"cannot use the folder {folder} ({error.strerror}): give another name") from error
    if found is not None and found != asked and not restart:
        raise InputError(f"{folder} was begun {_difference(found, asked)}: give another name, or --restart")
    if found is not None and restart:
        _clear(folder)
    if found != asked or restart:
        outputs.write_json(asked, folder / PLAN)


def _plan_in(folder: Path) -> dict[str, Any] | None:
    """Return the plan of a folder, None if it has none."""
    try:
        found = json.loads((folder / PLAN).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except ValueError as error:
        raise InputError(f"{folder / PLAN} is damaged: remove it, or give another name") from error
    return found if isinstance(found, dict) else None


def _difference(found: Mapping[str, Any], asked: Mapping[str, Any]) -> str:
    """Say by what two plans differ."""
    for name, value in asked.items():
        old = found.get(name)
        if old != value and isinstance(value, dict) and isinstance(old, dict):
            return _difference(old, value)
        if old != value:
            return f"with {name} = {_short(old)}, not {_short(value)}"
    return "for something else"


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _clear(folder: Path) -> None:
    """Remove what runs write: the plan last."""
    for name in FOLDERS:
        shutil.rmtree(folder / name, ignore_errors=True)
    for path in sorted(folder.glob("*.*")):
        if path.is_file() and path.suffix in WRITTEN and path.name != PLAN:
            path.unlink()


def options_as_json(options: MeshOptions) -> dict[str, Any]:
    """Return options as values that JSON holds."""
    return {field.name: repr(getattr(options, field.name)) for field in fields(options)}


def digest_of(picture: Picture) -> str:
    """Return a fingerprint of what a picture holds: its pixels, what is void, palette, names and place."""
    found = hashlib.blake2b(digest_size=16)
    for array in (picture.values, picture.palette, picture.opaque, picture.void):
        if array is None:
            found.update(b"none")
            continue
        found.update(f"{array.dtype.str}{array.shape}".encode())
        found.update(np.ascontiguousarray(array).data)
    found.update(repr((picture.labels, sorted((picture.names or {}).items()), picture.calibration)).encode())
    return found.hexdigest()


def digest_of_text(*texts: str) -> str:
    """Return a fingerprint of texts."""
    return hashlib.blake2b("\0".join(texts).encode("utf-8", "backslashreplace"), digest_size=16).hexdigest()
