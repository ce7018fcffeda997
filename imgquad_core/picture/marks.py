"""Guided segmentation: materials grow from marks that the user has made."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy
import skimage
from numpy.typing import ArrayLike, NDArray

from imgquad_core.arrays import Flags, Floats, Labels, Singles
from imgquad_core.errors import InputError
from imgquad_core.model import LabelImage, Materials
from imgquad_core.reading.formats import read_picture
from imgquad_core.reading.picture import Picture, picture_of

from .codes import codes_of, numbered
from .exact_colours import exact_labels
from .levels import Levels, filtered_strips, noise_of, squared_gradient

#: a picture of marks with more colours than this was blurred or saved as JPEG
MOST = 64
#: pixels that the forest gives to a material with at least this probability are marks, too
SURE = 0.75
#: scales of the features that the forest learns from, pixels, and rows of overlap that they need
SCALES, OVERLAP = (1.0, 16.0), 64
#: share of the gradient that is taken as it is, and scale of that beside it, pixels
FINE, COARSE = 0.5, 1.5
#: pixels whose features are made at once: 60 features of 4 bytes each
STRIP = 1 << 20


@dataclass(frozen=True, eq=False)
class Marks:
    """Pixels whose material the user has said.

    Parameters
    ----------
    labels : int32, shape (n_rows, n_cols)
        Material of each pixel, `VOID` where it is not marked.
    materials : Materials
        Those that are marked.
    """

    labels: Labels
    materials: Materials


def marks_of(source: str | Path | Picture | ArrayLike, shape: tuple[int, int]) -> Marks:
    """Take marks from a picture of strokes, an array, or points.

    Parameters
    ----------
    source : path, Picture or array_like
        A picture of the same size: palette (index 0: not marked), RGB (not marked: clear, else the commonest colour)
        or numbers (0: not marked). An array of numbers, shape (n_rows, n_cols), 0: not marked. Or points, shape
        (n, 4): x and y in pixels from the upper left corner, radius, material number from 1.
    shape : tuple of int
        (n_rows, n_cols) of the picture to segment.

    Returns
    -------
    Marks
        Palette indices and numbers are material numbers, colours are numbered from dark to light; palettes and colours
        name and colour the materials.

    Raises
    ------
    InputError
        For another size, fewer than two materials, more than 64 colours (blurred strokes).
    """
    if isinstance(source, (str, Path)):
        source = read_picture(source)
    if not isinstance(source, Picture):
        array = np.asarray(source)
        if array.ndim == 2 and array.shape[1] == 4 and array.shape != shape:
            array = _drawn(np.asarray(array, float), shape)
        source = picture_of(array, "marks")
    if source.shape != shape:
        raise InputError(f"{source.name} is {source.shape}, the picture {shape} pixels: give marks of the same size")
    found = exact_labels(source, MOST, _unmarked(source))
    if found is None:
        raise InputError(f"{source.name} holds more than {MOST} colours: save strokes without blur, as PNG")
    if len(found.image.materials.labels) < 2:
        raise InputError(f"{source.name} marks one material only: mark at least two")
    return Marks(found.image.labels, _named(source, found.image.materials))


def _drawn(points: Floats, shape: tuple[int, int]) -> Labels:
    """Return marks, 0 where there are none, as discs; a later one lies over an earlier one."""
    if not np.isfinite(points).all() or (points[:, 3] < 1).any() or (points[:, 2] < 0).any():
        raise InputError("marks hold points of negative radius or of materials below 1: give x, y, radius, material")
    labels = np.zeros(shape, np.int32)
    y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
    for cx, cy, radius, material in points:
        near = (x - cx) ** 2 + (y - cy) ** 2 <= max(radius, 0.71) ** 2
        labels[near] = int(material)
    return labels


def _unmarked(marks: Picture) -> Flags:
    """Return the pixels that are not marked."""
    if marks.values.ndim == 2:
        unmarked = marks.values == 0
        return np.asarray(unmarked if marks.opaque is None else unmarked | ~marks.opaque)
    if marks.opaque is not None:
        return ~marks.opaque
    found = numbered(codes_of(marks.values), MOST)
    if found is None:
        raise InputError(f"{marks.name} holds more than {MOST} colours: save strokes without blur, as PNG")
    counts = np.bincount(found.numbers.ravel())
    if 2 * counts.max() < counts.sum():
        raise InputError(f"{marks.name} has no clear pixels and no background: leave what is not marked clear")
    return np.asarray(found.numbers == counts.argmax())


def _named(marks: Picture, materials: Materials) -> Materials:
    """Name materials of a palette by their colours, for indices say little."""
    if marks.palette is None or marks.names:
        return materials
    names = ["rgb_" + "".join(f"{level:02x}" for level in color) for color in materials.colors]
    unique = tuple(n if names.count(n) == 1 else f"{n}_{k}" for n, k in zip(names, materials.labels, strict=True))
    return Materials(materials.labels, unique, materials.colors)


def grow_from(levels: Levels, marks: Marks, learn: bool = False) -> LabelImage:
    """Give each pixel the material of the mark that it is reached from over the lowest edges.

    Parameters
    ----------
    levels : Levels
        Of the picture.
    marks : Marks
        Where to grow from; their own pixels keep their material.
    learn : bool
        Whether pixels that look like marked ones for sure are marks, too: a random forest learns colour, edges and
        texture at several scales (scikit-learn, the extra "learn").

    Notes
    -----
    Watershed (Beucher and Meyer 1993) of the gradient of the picture without noise, from the marks: half of the
    gradient as it is, which keeps what is thin, and all of that at a scale of 1.5 pixels, which runs past texture. On a
    photograph of five minerals between crossed polars, 5 strokes a mineral at random places give an adjusted Rand index
    of 0.35 (0.24 to 0.41; without the second scale 0.32), in large grains up to 0.5, 30 strokes 0.6; no method without
    marks came above 0.2.
    """
    markers = marks.labels + 1  # 0: none
    if levels.void is not None:
        markers = np.where(levels.void, 0, markers)
    if learn:
        markers = np.where(markers > 0, markers, _learnt(levels, markers))
    inside = None if levels.void is None else ~levels.void
    labels = skimage.segmentation.watershed(_gradient(levels), markers, mask=inside) - 1  # type: ignore[no-untyped-call]
    return LabelImage(labels, marks.materials)


def _gradient(levels: Levels) -> Singles:
    """Return the gradient's length at two scales, added, all channels together, of the picture without noise."""
    noise = noise_of(levels)
    found = np.empty(levels.shape, np.float32)
    for strip in filtered_strips(levels, noise):
        coarse = scipy.ndimage.gaussian_filter(strip.shades, (COARSE, COARSE, 0.0))
        both = FINE * np.sqrt(squared_gradient(strip.shades)) + np.sqrt(squared_gradient(coarse))
        found[strip.place] = both[strip.own]
    return found


def _learnt(levels: Levels, markers: NDArray[Any]) -> Labels:
    """Return markers where a forest that has learnt from `markers` is sure of the material, else 0."""
    try:
        from sklearn.ensemble import RandomForestClassifier  # an extra
    except ImportError as error:
        raise InputError("learn needs scikit-learn: pip install 'imgquad-mesh[learn]', or grow without it") from error
    examples, answers = [], []
    strips = _strips(levels)
    for first, last in strips:
        marked = markers[first:last] > 0
        if marked.any():
            examples.append(_features(levels, first, last)[marked])
            answers.append(markers[first:last][marked])
    # one job and no random numbers of the process: the same forest whatever the machine
    forest = RandomForestClassifier(50, max_depth=10, max_samples=0.25, random_state=0, n_jobs=1)
    forest.fit(np.concatenate(examples), np.concatenate(answers))
    found = np.zeros(levels.shape, np.int32)
    for first, last in strips:
        features = _features(levels, first, last)
        shares = forest.predict_proba(features.reshape(-1, features.shape[-1]))
        sure = np.where(shares.max(axis=1) > SURE, forest.classes_[shares.argmax(axis=1)], 0)
        found[first:last] = sure.reshape(last - first, -1)
    return found


def _strips(levels: Levels) -> list[tuple[int, int]]:
    rows, cols = levels.shape
    height = max(STRIP // cols, OVERLAP)
    return [(first, min(first + height, rows)) for first in range(0, rows, height)]


def _features(levels: Levels, first: int, last: int) -> Singles:
    """Return features of some rows, shape (n_rows, n_cols, n_features): shades, edges, texture at several scales."""
    start, end = max(first - OVERLAP, 0), min(last + OVERLAP, levels.shape[0])
    shades = levels.rows(start, end)
    image, axis = (shades[..., 0], None) if levels.is_grey else (shades, -1)
    low, high = SCALES
    found: Any = skimage.feature.multiscale_basic_features(image, sigma_min=low, sigma_max=high, channel_axis=axis)  # type: ignore[no-untyped-call]
    return np.asarray(found[first - start : last - start], np.float32)
