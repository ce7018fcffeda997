"""What a file says of its labels, names and crystals, handed on to the materials."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from imgquad_core.arrays import Floats
from imgquad_core.model import LabelImage, Materials
from imgquad_core.reading.picture import Crystal, Picture


def as_told(image: LabelImage, picture: Picture) -> LabelImage:
    """Return a segmented picture with the names and crystals that its file gives its labels.

    Parameters
    ----------
    image : LabelImage
        `picture`, segmented.
    picture : Picture
        As it was read.
    """
    return LabelImage(image.labels, named(image.materials, picture.names or {}, picture.crystals or {}))


def named(materials: Materials, names: Mapping[int, str], crystals: Mapping[int, Crystal]) -> Materials:
    """Return materials with the names, phases and orientations that are known of them; names are made unique."""
    numbers = materials.labels.tolist()
    if not names and not crystals:
        return materials
    given = unique_names(names.get(n, own) for n, own in zip(numbers, materials.names, strict=True))
    if not crystals:
        return Materials(materials.labels, given, materials.colors)
    unknown = Crystal("", (np.nan, np.nan, np.nan))
    found = [crystals.get(n, unknown) for n in numbers]
    phases, euler = tuple(crystal.phase for crystal in found), _rows(crystal.euler for crystal in found)
    return Materials(materials.labels, given, materials.colors, phases, euler)


def _rows(euler: Iterable[tuple[float, float, float]]) -> Floats:
    return np.array(list(euler), float).reshape(-1, 3)


def unique_names(names: Iterable[str]) -> tuple[str, ...]:
    """Return the names; one that has been given before gets the place behind it."""
    found: dict[str, None] = {}
    for place, name in enumerate(names):
        found[name if name not in found else f"{name}_{place}"] = None
    return tuple(found)
