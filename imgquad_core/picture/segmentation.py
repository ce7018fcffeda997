"""Any picture becomes labels: values that are materials are kept, shades are divided in classes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Flags, Floats
from imgquad_core.errors import InputError
from imgquad_core.model import VOID, LabelImage, Materials
from imgquad_core.orientation import turn_of_picture
from imgquad_core.reading.picture import Picture, either, picture_of, where_equal

from .classes import APART
from .exact_colours import ANY_NUMBER, exact_labels, with_minus_one
from .grain_maps import LEFT_OVER, SHARE, cores_of, regions_of
from .kinds import Kind, kind_of
from .levels import NOISY, levels_of
from .marks import Marks, grow_from, marks_of
from .options import SegmentationOptions
from .raw import Found, find_classes, find_nearest
from .voids import fill_void, void_clusters

#: void clusters of at most so many pixels are told, for they may be faults of the measurement
SPECKS = 16


@dataclass(frozen=True, eq=False)
class Segmentation:
    """Labels, and how they were found.

    Parameters
    ----------
    image : LabelImage
        The labels.
    quantised : bool
        Whether shades were divided in classes; the default of noise removal hangs on it.
    method : str
        In words: "exact", "multi-Otsu", "k-means in CIELAB" or "nearest of the palette".
    noise : float
        Standard deviation of the noise that was found, in levels of 256 (0 where exact).
    rims : int
        Blended pixels that were kept out of a third material's hands.
    details : str
        Why and how, in words.
    warnings : tuple of str
        Where the choice is weak: what else may be meant, and the option for it.
    """

    image: LabelImage
    quantised: bool
    method: str = "exact"
    noise: float = 0.0
    rims: int = 0
    details: str = ""
    warnings: tuple[str, ...] = ()

    @property
    def smoothed(self) -> bool:
        """Whether the picture was filtered for its noise."""
        return self.noise >= NOISY

    @property
    def note(self) -> str:
        """What was chosen, in one line."""
        how = f"by {self.method}" if self.quantised else self.method
        return f"{len(self.image.materials.labels)} materials, {how}{self.details}"


def segment(picture: Picture | NDArray[Any] | LabelImage, options: SegmentationOptions | None = None) -> LabelImage:
    """Give each pixel of a picture a material.

    Parameters
    ----------
    picture : Picture, array_like or LabelImage
        What `read_picture` gave, or an array as for `picture_of`. A `LabelImage` is returned as it is.
    options : SegmentationOptions, optional
        How many colours, and what becomes of transparent and void pixels.

    Returns
    -------
    LabelImage
        Labels, int32, shape (n_rows, n_cols), and the names and colours of the materials.

    Raises
    ------
    InputError
        For labels that cannot be material numbers (below -1 or above 2**31 - 1; -1 is `VOID`), a number of colours
        for what its format calls labels, a picture that is wholly transparent.

    Notes
    -----
    *Labels or not*: see `imgquad_core.picture.kinds.kind_of`. Numbers: palette indices and labels are kept (named
    "material 3"); values that are not whole are numbered from the smallest. Colours, exact or not, are numbered 0, 1,
    2, ... from dark to light (299 R + 587 G + 114 B, then R, G, B) and named "rgb_ff8000", or by their grey "grey_87".
    Colours of a given palette keep their place in it. Colours of a label picture that occur at rims
    only, lonely and more than the others, go to one of their two sides.

    *Raw pictures*: noise (its standard deviation is found from second differences) is taken away by total variation.
    Constant values that fill a part of the picture are classes of their own. Classes are judged by the pixels that
    are neither rims (blends of their two sides, see `imgquad_core.picture.blends`) nor on slopes: grey is divided by
    multi-Otsu, colours by k-means in CIELAB, in the largest number of classes that are four pooled standard
    deviations apart; in two if they are 2.7 apart, else there is one. What lies far outside the darkest and brightest
    class, connected, is a class too. Uneven light is a cubic surface, which is taken out where that separates the
    classes by a quarter more. Then each pixel takes the nearest class, rims one of their sides, and in noisy pictures
    the commonest of 3 x 3 pixels. Nothing is random: the same picture gives the same labels.
    """
    return segment_picture(picture, options).image


def segment_picture(
    picture: Picture | NDArray[Any] | LabelImage, options: SegmentationOptions | None = None
) -> Segmentation:
    """Do what `segment` does, and tell what was chosen."""
    options = options or SegmentationOptions()
    if isinstance(picture, LabelImage):
        return Segmentation(picture, quantised=False)
    picture = picture if isinstance(picture, Picture) else picture_of(picture)
    void = void_of(picture, options)
    marks = None if options.marks is None else marks_of(options.marks, picture.shape)
    turn = turn_of_picture(picture.values)  # filters are not alike in all directions
    picture = replace(picture, values=np.ascontiguousarray(turn.picture(picture.values)), opaque=None, void=None)
    void = None if void is None else np.ascontiguousarray(turn.picture(void))
    marks = None if marks is None else replace(marks, labels=np.ascontiguousarray(turn.picture(marks.labels)))
    found = void_told(_found(picture, options, void, marks), options)
    return replace(found, image=turn.image_back(found.image))


def _found(picture: Picture, options: SegmentationOptions, void: Flags | None, marks: Marks | None) -> Segmentation:
    """Find the materials by the way that the options or the picture ask for."""
    colors = options.colors
    if marks is not None:
        return _grown(picture, options, void, marks)
    if picture.labels and colors not in ("auto", "exact"):
        raise InputError(f"colors is {colors}, but {picture.name} holds labels: give auto or exact")
    if colors == "auto":
        kind = kind_of(picture, with_minus_one(picture.values, void))
        return _kept(picture, kind, void) if kind.is_labels else _divided(picture, options, void, kind)
    if colors == "regions":
        image = regions_of(levels_of(picture, void))
        return Segmentation(image, False, "regions of one colour")
    if isinstance(colors, (str, int, np.integer)):
        found = exact_labels(picture, ANY_NUMBER if isinstance(colors, str) else int(colors), void)
        return Segmentation(found.image, False) if found else _divided(picture, options, void)
    return _nearest(picture, np.rint(np.array(colors, float)), void)


def void_of(picture: Picture, options: SegmentationOptions) -> Flags | None:
    """Return the pixels that hold nothing or are transparent, None where there are none."""
    void = picture.void
    if options.no_data is not None:
        void = either(void, where_equal(picture.values, float(options.no_data)))
    if not options.drop_transparent or picture.opaque is None:
        return void
    void = either(void, ~picture.opaque)
    if void is not None and void.all():
        raise InputError(f"{picture.name} is wholly transparent: keep transparent pixels (drop_transparent=False)")
    return void


def _grown(picture: Picture, options: SegmentationOptions, void: Flags | None, marks: Marks) -> Segmentation:
    """Let materials grow from marks."""
    share = np.mean(marks.labels != VOID)
    details = f", from {share:.2%} of the pixels" + (", and from what looks like them" if options.learn else "")
    return Segmentation(
        grow_from(levels_of(picture, void), marks, options.learn), False, "grown from marks", details=details
    )


def _kept(picture: Picture, kind: Kind, void: Flags | None) -> Segmentation:
    """Take each value for a material, but for the blends at rims."""
    found = exact_labels(picture, ANY_NUMBER, void, with_blends=picture.labels)
    assert found is not None
    details = f": {kind.reason}"
    if found.blends:
        details += f"; {found.blends} blended colours of rims went to their sides"
    return Segmentation(found.image, found.blends > 0, details=details, warnings=doubts_of(kind))


def doubts_of(kind: Kind) -> tuple[str, ...]:
    """Say what else a picture may be."""
    if kind.doubt is None:
        return ()
    taken, other, option = (
        ("labels, each value a material", "shades", "give their number (colors = N)")
        if kind.is_labels
        else ("shades", "labels", "give colors = exact")
    )
    return (f"taken for {taken} ({kind.doubt}): if it holds {other}, {option}",)


def _divided(
    picture: Picture, options: SegmentationOptions, void: Flags | None, kind: Kind | None = None
) -> Segmentation:
    """Divide a raw picture in classes: so many as are far apart, or the number asked for (`kind` is None)."""
    number = None if kind is not None else int(options.colors)  # type: ignore[arg-type]
    found = find_classes(levels_of(picture, void), number, options.flatten == "auto")
    warnings = () if kind is None else doubts_of(kind) + _far(found) + overlap_of(found) + _grains(found)
    return _told(found, void, warnings)


def _nearest(picture: Picture, palette: Floats, void: Flags | None) -> Segmentation:
    """Give each pixel the nearest colour of a palette."""
    return _told(find_nearest(levels_of(picture, void), palette), void, ())


def _told(found: Found, void: Flags | None, warnings: tuple[str, ...]) -> Segmentation:
    labels = found.labels
    if void is not None:
        labels[void] = VOID
    image = LabelImage(labels, materials_of_classes(found))
    return Segmentation(image, True, found.method, found.noise, found.rims, details_of(found), warnings)


def _far(found: Found) -> tuple[str, ...]:
    """Say so where many pixels hold one number that is far from all others."""
    ends = [f"{end:.8g}" for end in found.levels.ends if end is not None]
    return tuple(
        f"many pixels hold {end}, far from all others: if that stands for no data, give no_data = {end}" for end in ends
    )


def _grains(found: Found) -> tuple[str, ...]:
    """Suggest a material a region, where each region has one colour, but there are more colours than classes."""
    if found.levels.is_grey or found.left_over <= LEFT_OVER:
        return ()
    cores = cores_of(found.smooth.plane, found.noise, found.levels.void)
    if cores.even < SHARE:
        return ()
    return (f"it may be a map of {len(cores.means)} grains: colors = regions makes each a material",)


def overlap_of(found: Found) -> tuple[str, ...]:
    """Say if classes are not far apart."""
    n = len(found.means) - found.constants - found.tails
    if found.separation >= APART or (n == 1 and found.tails):
        return ()
    what = "the classes overlap" if n > 1 else "no classes stand out"
    return (f"{what} ({found.separation:.1f} of {APART:.0f}): give their number (colors = N) or marks",)


def details_of(found: Found) -> str:
    """Say how classes were found."""
    parts = []
    if np.isfinite(found.separation):
        parts.append(f"{found.separation:.1f} standard deviations apart")
    if found.constants:
        parts.append(f"{found.constants} of them constant")
    if found.tails:
        parts.append(f"{found.tails} of them rare")
    if found.noise >= NOISY:
        parts.append(f"noise {found.noise:.1f} of 255 filtered")
    if found.shaded:
        parts.append("uneven light taken out")
    return "".join(f", {part}" for part in parts) + f", {found.rims} blended pixels"


def void_told(found: Segmentation, options: SegmentationOptions) -> Segmentation:
    """Fill small void clusters, and say what is void."""
    n_void = int(np.count_nonzero(found.image.labels == VOID))
    if n_void == 0:
        return found
    image = fill_void(found.image, int(options.fill_void))
    left = int(np.count_nonzero(image.labels == VOID))
    details = f"; {n_void} void pixels" + (f", {n_void - left} of them filled from around" if left < n_void else "")
    _, sizes = void_clusters(image.labels)
    specks = int(np.count_nonzero((sizes > 0) & (sizes <= SPECKS)))
    warnings: tuple[str, ...] = ()
    if specks and options.fill_void < SPECKS:
        warnings = (f"{specks} void specks of at most {SPECKS} pixels are holes: fill them by fill_void = {SPECKS}",)
    return replace(found, image=image, details=found.details + details, warnings=found.warnings + warnings)


def materials_of_classes(found: Found) -> Materials:
    """Name materials 0, 1, ... by their colour; a name that has been given gets the number behind it."""
    means, levels = found.means, found.levels
    colors = np.clip(np.rint(means if means.shape[1] == 3 else np.repeat(means, 3, axis=1)), 0, 255).astype(np.uint8)
    if means.shape[1] == 3:
        names = ["rgb_" + "".join(f"{level:02x}" for level in color) for color in colors]
    else:
        digits = ".0f" if levels.step >= 1.0 else ".6g"
        names = [f"grey_{levels.value_of(level):{digits}}" for level in means[:, 0]]
    unique = tuple(name if name not in names[:k] else f"{name}_{k}" for k, name in enumerate(names))
    return Materials(np.arange(len(names)), unique, colors)
