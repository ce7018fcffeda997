"""What values mean which materials, decided once for many pictures of one thing: slices of a stack, tiles of a map.

A picture by itself would be divided in its own classes, and materials would change their numbers from slice to slice.
So a sample of all of them says whether they hold labels or shades, and which classes these fall into; of labels, the
colours of all pictures are counted, none is left out. Then each picture is labelled by the same `Legend`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Flags, Floats, Labels, Value
from imgquad_core.errors import InputError
from imgquad_core.model import VOID, LabelImage, Materials
from imgquad_core.reading.picture import Picture

from .codes import codes_of, numbered
from .exact_colours import materials_of_codes, with_minus_one
from .flat_colours import Tally, added_up, flat_among, in_flat_colours, tally_of
from .kinds import kind_of
from .levels import levels_of
from .naming import as_told
from .options import SegmentationOptions
from .raw import Known, find_classes, find_known, find_nearest, known_classes
from .segmentation import Segmentation, details_of, doubts_of, materials_of_classes, overlap_of, void_of, void_told

MOST_LABELS = 1 << 20  #: distinct values of label pictures


@dataclass(frozen=True, eq=False)
class Legend(Value):
    """What values mean which materials.

    Parameters
    ----------
    materials : Materials
        Of all pictures, also where one has none of them.
    form : str
        Type of the values that it is for.
    palette : uint8, shape (n, 3), optional
        Of the pictures that it is for.
    codes : int32 or int64, shape (n,)
        Of label pictures: the distinct values, ascending, see `codes_of`; empty for shades.
    numbers : int32, shape (n,)
        Material of each of them.
    means : float64, shape (m, 1 or 3)
        Of shades: the classes, in levels, from dark to light; empty for labels.
    constant : bool, shape (m,)
        Which of them are constant values.
    low, step, noise, weight : float
        Value of level 0, difference of a level to the next, standard deviation of the noise in levels, and weight of
        the filter in these.
    quantised : bool
        Whether shades were divided in classes or blends given away: the default of noise removal hangs on it.
    note : str
        What was chosen, in one line.
    warnings : tuple of str
        Where the choice is weak.
    """

    materials: Materials
    form: str
    palette: NDArray[np.uint8] | None
    codes: NDArray[Any]
    numbers: Labels
    means: Floats
    constant: Flags
    low: float
    step: float
    noise: float
    weight: float
    quantised: bool
    note: str
    warnings: tuple[str, ...]


def sample_of(parts: Sequence[Picture]) -> Picture:
    """Put parts of pictures below each other, cut to the narrowest.

    Raises
    ------
    InputError
        They are of different types, or have different palettes.
    """
    first, width = parts[0], min(part.shape[1] for part in parts)
    for part in parts:
        _assert_alike(part, form_of(first), first.palette, first.name)

    def stacked(name: str) -> Any:
        found = [getattr(part, name) for part in parts]
        if all(each is None for each in found):
            return None
        none = {"opaque": True, "void": False}
        full = [np.full(p.shape, none[name]) if f is None else f for p, f in zip(parts, found, strict=True)]
        return np.concatenate([each[:, :width] for each in full])

    names = {number: name for part in parts for number, name in (part.names or {}).items()}
    values = np.concatenate([part.values[:, :width] for part in parts])
    return replace(first, values=values, opaque=stacked("opaque"), void=stacked("void"), names=names or None)


def form_of(picture: Picture) -> str:
    """Return in words what kind of values a picture holds: those of one kind have the same codes."""
    values = picture.values
    colour = "RGB" if values.ndim == 3 else "palette indices" if picture.palette is not None else "values"
    kind = str(values.dtype) if values.ndim == 3 or values.dtype.kind == "f" else "whole numbers"
    return f"{colour} of {kind}"


def counts_labels(sample: Picture, options: SegmentationOptions) -> int:
    """Return how many distinct values all pictures may have to be labels; 0 if they are shades in any case.

    Raises
    ------
    InputError
        The option asks for what only a single picture has: marks, a material a region.
    """
    colors = options.colors
    if options.marks is not None or colors == "regions":
        what = "marks are" if options.marks is not None else "colors = regions is"
        raise InputError(f"{what} for one picture: give the number of materials, their colours, or exact")
    if colors == "exact":
        return MOST_LABELS
    if colors == "auto":
        void = void_of(sample, options)
        is_labels = kind_of(sample, with_minus_one(sample.values, void)).is_labels
        return MOST_LABELS if is_labels else 0
    return int(colors) if isinstance(colors, (int, np.integer)) else 0


def tally_labels(picture: Picture, most: int, options: SegmentationOptions) -> Tally | None:
    """Count the distinct values of a picture and how they lie; None where there are more than `most`."""
    void = with_minus_one(picture.values, void_of(picture, options))
    found = numbered(codes_of(picture.values), most)
    if found is None:
        return None
    if void is None:
        return tally_of(picture, found)
    solid = np.bincount(found.numbers[~void], minlength=len(found.codes)) > 0
    return Tally(*(column[solid] for column in tally_of(picture, found)))


def legend_of(sample: Picture, tallies: Sequence[Tally | None], options: SegmentationOptions) -> Legend:
    """Decide what values mean which materials.

    Parameters
    ----------
    sample : Picture
        Parts of the pictures, from `sample_of`.
    tallies : sequence of Tally or None
        Of every picture, from `tally_labels`; empty if `counts_labels` is 0.
    options : SegmentationOptions
        As for one picture; uneven light is not taken out.
    """
    most = counts_labels(sample, options)
    known = [tally for tally in tallies if tally is not None]
    if most and len(known) == len(tallies) and known:
        tally = added_up(known)
        if len(tally.codes) <= most:
            return _of_labels(sample, tally, options)
    if most == MOST_LABELS:
        raise InputError(f"{sample.name} and the others hold more than {most} values: give the number of materials")
    return _of_shades(sample, options)


def label_by(picture: Picture, legend: Legend, options: SegmentationOptions, may_be_void: bool = False) -> Segmentation:
    """Give each pixel of a picture its material by a legend.

    Parameters
    ----------
    picture : Picture
        What `read_picture` gave.
    legend : Legend
        Of this picture and others.
    options : SegmentationOptions
        What becomes of void and transparent pixels.
    may_be_void : bool
        Whether a picture without any material is a picture, too.

    Raises
    ------
    InputError
        The picture is of another type than those that the legend is of.
    """
    _assert_alike(picture, legend.form, legend.palette, "the others")
    void = with_minus_one(picture.values, void_of(picture, options)) if len(legend.codes) else void_of(picture, options)
    if void is not None and void.all():
        if may_be_void:
            return Segmentation(LabelImage(np.full(picture.shape, VOID), legend.materials), legend.quantised)
        raise InputError(f"{picture.name} holds no pixel with a material: all are void")
    labels = legend.numbers[in_flat_colours(picture, legend.codes)] if len(legend.codes) else _shaded(picture, legend)
    if void is not None:
        labels[void] = VOID
    found = Segmentation(LabelImage(labels, legend.materials), legend.quantised)
    return void_told(found, options)


def _assert_alike(picture: Picture, form: str, palette: Any, name: str) -> None:
    if form_of(picture) != form:
        raise InputError(f"{picture.name} holds {form_of(picture)}, {name} {form}: save all in one type")
    if palette is not None and not np.array_equal(np.asarray(picture.palette), palette):
        raise InputError(f"{picture.name} has another palette than {name}: save all with one, or as RGB")


def _of_labels(sample: Picture, tally: Tally, options: SegmentationOptions) -> Legend:
    """Take each value for a material, but for the blends at rims where the kind was told by the pixels."""
    flat = np.ones(len(tally.codes), bool)
    if options.colors == "auto" and not sample.labels:
        flat = flat_among(tally, sample)
    numbers, materials = materials_of_codes(sample, tally.codes[flat])
    image = as_told(LabelImage(np.zeros((1, 1), np.int32), materials), sample)
    blends = int(np.count_nonzero(~flat))
    told = f"; {blends} blended colours of rims went to their sides" if blends else ""
    warnings = doubts_of(kind_of(sample, with_minus_one(sample.values, void_of(sample, options))))
    return Legend(
        materials=image.materials,
        form=form_of(sample),
        palette=sample.palette,
        codes=tally.codes[flat],
        numbers=numbers,
        means=np.zeros((0, 1)),
        constant=np.zeros(0, bool),
        low=0.0,
        step=1.0,
        noise=0.0,
        weight=0.0,
        quantised=blends > 0,
        note=f"{len(materials.labels)} materials in all, exact{told}",
        warnings=warnings if options.colors == "auto" else (),
    )


def _of_shades(sample: Picture, options: SegmentationOptions) -> Legend:
    """Divide the shades of the sample in classes, or take those of a palette."""
    levels, colors = levels_of(sample, void_of(sample, options)), options.colors
    if isinstance(colors, (str, int, np.integer)):
        found = find_classes(levels, None if isinstance(colors, str) else int(colors), flatten=False)
    else:
        found = find_nearest(levels, np.rint(np.array(colors, float)))
    known = known_classes(found)
    materials = materials_of_classes(found)
    return Legend(
        materials=materials,
        form=form_of(sample),
        palette=sample.palette,
        codes=np.zeros(0, np.int64),
        numbers=np.zeros(0, np.int32),
        means=known.means,
        constant=known.constant,
        low=levels.low,
        step=levels.step,
        noise=known.noise,
        weight=known.weight,
        quantised=True,
        note=f"{len(materials.labels)} materials in all, by {found.method} of a sample{details_of(found)}",
        warnings=overlap_of(found) if colors == "auto" else (),
    )


def _shaded(picture: Picture, legend: Legend) -> Labels:
    levels = levels_of(picture, picture.void)
    known = Known(legend.means, legend.constant, legend.noise, legend.weight)
    try:
        return find_known(replace(levels, low=legend.low, step=legend.step), known)
    except ValueError as error:
        raise InputError(f"{picture.name} has colours, the others are grey: save all in one way") from error
