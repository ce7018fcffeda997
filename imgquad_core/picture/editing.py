"""Materials merged, renamed and given other colours: what the user knows of them, and the pixels do not tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from imgquad_core.arrays import Floats
from imgquad_core.errors import InputError
from imgquad_core.model import LabelImage, Materials

from .options import EditOptions
from .selection import material_number

Name = str | int
RGB = Sequence[int]


def edit_materials(image: LabelImage, options: EditOptions) -> LabelImage:
    """Merge, then rename, then recolour materials.

    Parameters
    ----------
    image : LabelImage
        Labels, `VOID` where there is no material.
    options : EditOptions
        What becomes of which; a later edit calls materials as the earlier ones have left them.

    Raises
    ------
    InputError
        There is no such material, or two would have one name.
    """
    return recolor_materials(rename_materials(merge_materials(image, options.merge), options.rename), options.recolor)


def merge_materials(image: LabelImage, merged: Mapping[tuple[Name, ...], str]) -> LabelImage:
    """Make one material of several.

    Parameters
    ----------
    image : LabelImage
        Labels, `VOID` where there is no material.
    merged : mapping of (str or int, ...) to str
        Names or numbers of two or more materials, and the name of what they become. It takes number and colour of the
        one of them that has this name already, else of the first. One after the other: a later merge may name what an
        earlier one made.

    Returns
    -------
    LabelImage
        Phase and orientation of crystals stay where all merged ones have the same.
    """
    for names, name in merged.items():
        image = _merge(image, names, name)
    return image


def _merge(image: LabelImage, names: tuple[Name, ...], name: str) -> LabelImage:
    materials = image.materials
    numbers = list(dict.fromkeys(material_number(materials, each) for each in names))
    if len(numbers) < 2:
        raise InputError(f"merge of {', '.join(map(str, names))}: this is one material; name two or more")
    into = next((number for number in numbers if materials.name_of(number) == name), numbers[0])
    labels = np.where(np.isin(image.labels, numbers), np.int32(into), image.labels)
    return LabelImage(labels, _renamed(_without(materials, numbers, into), {into: name}, "merge"))


def _without(materials: Materials, merged: Sequence[int], into: int) -> Materials:
    """Return the materials without those that were merged into one of them."""
    own = np.isin(materials.labels, merged)
    stay = ~own | (materials.labels == into)
    at = int(np.flatnonzero(materials.labels == into)[0])
    phases, euler = materials.phases, materials.orientations
    if phases is not None and len({phases[k] for k in np.flatnonzero(own)}) > 1:
        phases = (*phases[:at], "", *phases[at + 1 :])
    if euler is not None and not _all_alike(euler[own]):
        euler = euler.copy()
        euler[at] = np.nan
    return Materials(
        materials.labels[stay],
        tuple(np.array(materials.names, object)[stay]),
        materials.colors[stay],
        None if phases is None else tuple(np.array(phases, object)[stay]),
        None if euler is None else euler[stay],
    )


def _all_alike(euler: Floats) -> bool:
    return bool((euler == euler[0]).all())


def rename_materials(image: LabelImage, names: Mapping[Name, str]) -> LabelImage:
    """Give materials other names.

    Parameters
    ----------
    image : LabelImage
        Labels.
    names : mapping of (str or int) to str
        New name of each material, by its name or number; all at once, so that two may change places.
    """
    if not names:
        return image
    given = {material_number(image.materials, each): name for each, name in names.items()}
    return LabelImage(image.labels, _renamed(image.materials, given, "rename"))


def _renamed(materials: Materials, given: Mapping[int, str], what: str) -> Materials:
    numbers = materials.labels.tolist()
    names = tuple(given.get(number, own) for number, own in zip(numbers, materials.names, strict=True))
    for number, name in given.items():
        if names.count(name) > 1:
            others = [n for n, own in zip(numbers, names, strict=True) if own == name and n != number]
            raise InputError(
                f"{what}: material {number} cannot be called '{name}', as material {others[0]} is: "
                "give another name, or merge the two"
            )
    return replace(materials, names=names)


def recolor_materials(image: LabelImage, colors: Mapping[Name, RGB]) -> LabelImage:
    """Give materials other colours.

    Parameters
    ----------
    image : LabelImage
        Labels.
    colors : mapping of (str or int) to RGB
        New colour of each material, 0 to 255, by its name or number.
    """
    if not colors:
        return image
    made = image.materials.colors.copy()
    for each, color in colors.items():
        made[np.searchsorted(image.materials.labels, material_number(image.materials, each))] = color
    return LabelImage(image.labels, replace(image.materials, colors=made))


def area_shares(image: LabelImage) -> dict[int, float]:
    """Return the share of the picture that each material fills, 0 to 1, by number."""
    counts = image.pixels
    return {number: counts.get(number, 0) / image.labels.size for number in image.materials.labels.tolist()}
