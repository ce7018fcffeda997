"""Filters of images that give images: what each pixel is made of, without noise, with some materials edited."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import pyvista as pv
from numpy.typing import NDArray

import imgquad_core as core
from imgquad_mesh import datasets

from .parameter_types import Auto, Colors, Flatten, Marks, Policy
from .parameters import checked, progress_of


def segment(
    image: pv.ImageData,
    scalars: str | None = None,
    *,
    colors: Colors = "auto",
    flatten: Flatten = "auto",
    marks: Marks = None,
    learn: bool = False,
    no_data: float | None = None,
    fill_void: int = 0,
    drop_transparent: bool = False,
    progress_bar: bool = False,
) -> pv.ImageData:
    """Give each pixel of a flat image a material, by its colour or by marks.

    Parameters
    ----------
    image : pyvista.ImageData
        One pixel thick, of points or cells, in any plane.
    scalars : str, optional
        Name of scalars to process: labels, greys, RGB or RGBA. Defaults to currently active scalars.
    colors : "auto" | "exact" | "regions" | int | sequence, default: "auto"
        ``"exact"``: one material per distinct value. ``"regions"``: one per connected region of one colour (grain
        maps). A number: divided in that many classes. A sequence of RGB (0 to 255): the nearest of them. ``"auto"``:
        one per value in label images, which are told by their pixels, else as many classes as are far apart.
    flatten : "auto" | "off", default: "auto"
        Take uneven light out of grey images, where that separates the classes better.
    marks : str | path | array_like, optional
        Pixels whose material is known, from which materials grow: the name of an array of the image (0: not marked), a
        picture of strokes (palette index 0 and clear pixels are not marked), an array, shape (rows, columns), the top
        row first, or points, shape (n, 4): x and y in pixels from the upper left corner, radius, material.
    learn : bool, default: False
        Let a random forest learn from the marks what else is marked for sure (scikit-learn).
    no_data : float, optional
        Number of pixels that hold nothing (-9999, 255): they are void.
    fill_void : int, default: 0
        Void clusters (NaN, -1) of at most so many pixels go to the material with the longest common border.
    drop_transparent : bool, default: False
        Pixels of alpha 0 get the material -1, which is not meshed.
    progress_bar : bool, default: False
        Display a progress bar.

    Returns
    -------
    pyvista.ImageData
        A copy with the array ``material`` (int32, active) and the field arrays ``material_numbers``,
        ``material_names`` and ``material_colors``.

    See Also
    --------
    imgquad_mesh.filters.remove_noise, imgquad_mesh.filters.mesh

    Examples
    --------
    >>> import pyvista as pv
    >>> image = pv.ImageData(dimensions=(60, 40, 1))
    >>> image["grey"] = (image.points[:, 0] > 30) * 200
    >>> image.imgquad.segment().field_data["material_numbers"]
    pyvista_ndarray([  0, 200], dtype=int32)
    """
    values = checked(colors=colors, flatten=flatten, learn=learn, no_data=no_data, fill_void=fill_void)
    values |= checked(drop_transparent=drop_transparent)
    values |= marked(image, scalars, marks)
    with progress_of(progress_bar) as begin:
        begin("segment")
        found = datasets.segmented(image, scalars, core.picture.SegmentationOptions(**values))
    warn(found.warnings)
    return datasets.with_materials(image, found, scalars)


def remove_noise(
    image: pv.ImageData,
    scalars: str | None = None,
    *,
    min_pixels: int | Auto = "auto",
    min_length: float | Auto = "auto",
    policy: Policy = "minority",
    progress_bar: bool = False,
) -> pv.ImageData:
    """Give clusters of pixels that are both small and short to the neighbour with the longest common border.

    Parameters
    ----------
    image : pyvista.ImageData
        One pixel thick; segmented first where it is not yet.
    scalars : str, optional
        Name of scalars to process. Defaults to currently active scalars.
    min_pixels : int | "auto", default: "auto"
        Clusters of this many pixels or more stay. ``"auto"``: exact label images are taken at their word, in quantised
        ones the square of `min_length`.
    min_length : float | "auto", default: "auto"
        Clusters of this characteristic length or more stay, in pixels, also bent ones. ``"auto"``: a hundredth of the
        image's shorter side, from 4 to 16.
    policy : str, default: "minority"
        What is connected at an ambiguous corner of four pixels, see `boundaries`.
    progress_bar : bool, default: False
        Display a progress bar.

    Returns
    -------
    pyvista.ImageData
        A copy with a new array ``material``.
    """
    with progress_of(progress_bar) as begin:
        begin("denoise")
        found = _without_noise(datasets.segmented(image, scalars), min_pixels, min_length, policy)
        return datasets.with_materials(image, found, scalars)


def drop_materials(
    image: pv.ImageData, materials: str | int | Sequence[str | int], *, scalars: str | None = None
) -> pv.ImageData:
    """Leave materials out: their pixels get the material -1, their boundary becomes a free border.

    Parameters
    ----------
    image : pyvista.ImageData
        One pixel thick; segmented first where it is not yet.
    materials : str | int | sequence
        Names or numbers.
    scalars : str, optional
        Name of scalars to process. Defaults to currently active scalars.

    Returns
    -------
    pyvista.ImageData
        A copy with a new array ``material``.
    """
    names = [materials] if isinstance(materials, (str, int)) else materials
    found = datasets.segmented(image, scalars)
    chosen = checked(materials=names)["materials"]
    return datasets.with_materials(
        image, replace(found, image=core.picture.drop_materials(found.image, chosen)), scalars
    )


def merge_materials(
    image: pv.ImageData, merge: Mapping[tuple[str | int, ...], str], *, scalars: str | None = None
) -> pv.ImageData:
    """Make one material of several: boundaries between them vanish.

    Parameters
    ----------
    image : pyvista.ImageData
        One pixel thick; segmented first where it is not yet.
    merge : mapping
        Name of the new material by names or numbers of those that become it: ``{("quartz", "mica"): "hard"}``. It takes
        number and colour of the one that has its name already, else of the first.
    scalars : str, optional
        Name of scalars to process. Defaults to currently active scalars.

    Returns
    -------
    pyvista.ImageData
        A copy with a new array ``material``.
    """
    return _edited(image, scalars, checked(merge=merge))


def rename_materials(
    image: pv.ImageData, rename: Mapping[str | int, str], *, scalars: str | None = None
) -> pv.ImageData:
    """Give materials other names: sets, files and later filters call them by these.

    Parameters
    ----------
    image : pyvista.ImageData
        One pixel thick; segmented first where it is not yet.
    rename : mapping
        New name by name or number: ``{"grey_87": "quartz"}``.
    scalars : str, optional
        Name of scalars to process. Defaults to currently active scalars.

    Returns
    -------
    pyvista.ImageData
        A copy with a new field array ``material_names``.
    """
    return _edited(image, scalars, checked(rename=rename))


def recolor_materials(
    image: pv.ImageData, recolor: Mapping[str | int, pv.ColorLike], *, scalars: str | None = None
) -> pv.ImageData:
    """Give materials other colours, which they are drawn in.

    Parameters
    ----------
    image : pyvista.ImageData
        One pixel thick; segmented first where it is not yet.
    recolor : mapping
        New colour by name or number: ``{"quartz": "orange"}``.
    scalars : str, optional
        Name of scalars to process. Defaults to currently active scalars.

    Returns
    -------
    pyvista.ImageData
        A copy with a new field array ``material_colors``.
    """
    return _edited(image, scalars, checked(recolor=recolor))


def _edited(image: pv.ImageData, scalars: str | None, edits: Mapping[str, Any]) -> pv.ImageData:
    found = datasets.segmented(image, scalars)
    edited = core.picture.edit_materials(found.image, core.picture.EditOptions(**edits))
    return datasets.with_materials(image, replace(found, image=edited), scalars)


def _without_noise(
    found: core.picture.Segmentation, min_pixels: int | Auto, min_length: float | Auto, policy: str
) -> core.picture.Segmentation:
    """Return a segmentation without noise, with the limits of `MeshOptions`."""
    options = core.MeshOptions(**checked(min_pixels=min_pixels, min_length=min_length, policy=policy))
    noise = options.noise(found.quantised, found.image.shape)
    return replace(found, image=core.picture.remove_noise(found.image, noise), quantised=False)


def marked(image: pv.ImageData, scalars: str | None, marks: Marks) -> dict[str, Any]:
    """Return the marks: an array of the image where they name one."""
    given = checked(marks=marks)
    if isinstance(marks, str) and marks in image.array_names:
        given["marks"] = columns_of(image, [marks], scalars)[marks]
    return given


def columns_of(image: pv.ImageData, names: Sequence[str], scalars: str | None) -> dict[str, NDArray[Any]]:
    """Return the arrays that are to be sampled, the top row first."""
    _, association = datasets.scalars_of(image, scalars)
    for name in names:
        if datasets.scalars_of(image, name)[1] != association:
            raise KeyError(f"Data array ({name}) is not one of {association}s, as the scalars are: convert the image.")
    return {name: datasets.image_array(image, name) for name in names}


def warn(said: Iterable[str]) -> None:
    """Warn in the name of who called the accessor's method."""
    for text in said:
        warnings.warn(text, stacklevel=4)
