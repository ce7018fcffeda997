"""From a picture to its mesh: one line a stage."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from types import MappingProxyType
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import ahead
from .boundary.extraction import ExtractionOptions, extract_boundaries
from .boundary.periodic import match_opposite_sides, rematch
from .boundary.smoothing import SmoothingOptions, smooth_boundaries
from .errors import InputError
from .mesher.efforts import MeshingOptions
from .mesher.meshing import mesh_boundaries
from .model import BoundaryGraph, LabelImage, Materials, QuadMesh
from .options import MeshOptions
from .picture.noise import DenoiseOptions, Removal, list_removed, remove_noise
from .picture.reading import Picture, ReadOptions, read_picture
from .picture.segmentation import Segmentation, segment_picture
from .picture.selection import assert_solid, crop_image, drop_materials, material_number

T = TypeVar("T")
Source: TypeAlias = "str | Path | NDArray[Any] | LabelImage"
#: called with the name of the stage that starts, its number from 0, and the number of stages
Progress: TypeAlias = Callable[[str, int, int], None]
STAGES = ("read", "segment", "denoise", "boundary", "smooth", "mesh")
MOST_QUADS = 200_000_000  #: more are refused before memory is
MANY_TIMES, MANY_QUADS = 4.0, 1000  #: quads over area / size^2, and in all, from which thin features are told


@dataclass(frozen=True, eq=False)
class Run:
    """All that a run has made: the values between the stages, too.

    Parameters
    ----------
    options : MeshOptions
        As asked.
    segmentation : Segmentation
        The picture as segmented, and what was chosen.
    picture : LabelImage
        The part that was asked for, before noise removal.
    noise : DenoiseOptions
        The limits of noise that were used.
    removed : tuple of Removal
        Noise that was removed, by material.
    labels : LabelImage
        The materials as meshed.
    pixel_boundary, boundary : BoundaryGraph
        Before and after smoothing.
    mesh : QuadMesh
        In the unit of `options.pixel_size`.
    seconds : mapping of str to float
        Time of each of `STAGES`.
    """

    options: MeshOptions
    segmentation: Segmentation
    picture: LabelImage
    noise: DenoiseOptions
    removed: tuple[Removal, ...]
    labels: LabelImage
    pixel_boundary: BoundaryGraph
    boundary: BoundaryGraph
    mesh: QuadMesh
    seconds: Mapping[str, float]


def mesh_image(image: Source, options: MeshOptions | None = None) -> QuadMesh:
    """Turn a picture into an all-quadrilateral mesh of its materials.

    Parameters
    ----------
    image : array_like, LabelImage or path
        The picture, row 0 on top: integer labels or greys (rows, columns), colours (rows, columns, 3 or 4), a
        `LabelImage`, or a file.
    options : MeshOptions, optional
        How it is meshed.

    Returns
    -------
    QuadMesh
        Convex, counter-clockwise quads on [0, columns] x [0, rows] times `options.pixel_size`, y up.

    Raises
    ------
    InputError
        The picture or an option cannot be used.

    Examples
    --------
    >>> import numpy as np
    >>> from imgquad_core import MeshOptions, mesh_image
    >>> labels = np.zeros((40, 60), np.uint8)
    >>> labels[10:30, 20:40] = 1
    >>> mesh = mesh_image(labels, MeshOptions(size=4.0))
    >>> sorted(set(mesh.quad_material.tolist()))
    [0, 1]
    """
    return run(image, options).mesh


def run(source: Source, options: MeshOptions | None = None, progress: Progress | None = None) -> Run:
    """Do what `mesh_image` does, and keep what the stages gave.

    Parameters
    ----------
    source, options
        As for `mesh_image`.
    progress : callable, optional
        Called as each stage starts.
    """
    ahead.start()
    options = options or MeshOptions()
    timed = _Stopwatch(progress)
    raw = timed("read", read_source, source, ReadOptions(options.max_pixels, options.frame))
    found = timed("segment", segment_picture, raw, options.segmentation())
    picture = crop_image(found.image, options.crop) if options.crop else found.image
    noise = options.noise(found.quantised, found.image.shape)
    clean = timed("denoise", remove_noise, picture, noise)
    labels = drop_materials(clean, options.drop)
    smoothing, meshing = options.smoothing(picture.materials), options.meshing(picture.materials)
    _assert_feasible(labels, smoothing)
    staircase = timed("boundary", extract_boundaries, labels, ExtractionOptions(options.policy))
    boundary = timed("smooth", smooth_boundaries, staircase, smoothing)
    if options.periodic != "none":
        boundary = match_opposite_sides(boundary, options.periodic)
    boundary, mesh = timed("mesh", fill_boundaries, boundary, meshing, labels.materials, options.periodic)
    return Run(
        options=options,
        segmentation=found,
        picture=picture,
        noise=noise,
        removed=list_removed(picture, clean, options.policy),
        labels=labels,
        pixel_boundary=staircase,
        boundary=boundary,
        mesh=mesh.scaled(options.pixel_size) if options.pixel_size != 1.0 else mesh,
        seconds=MappingProxyType(timed.seconds),
    )


def read_source(source: Source, options: ReadOptions | None = None) -> Picture | NDArray[Any] | LabelImage:
    """Return the picture that a path names; arrays and `LabelImage` as they are."""
    if isinstance(source, (str, Path)):
        return read_picture(source, options)
    return source if isinstance(source, LabelImage) else np.asarray(source)


def fill_boundaries(
    boundary: BoundaryGraph, options: MeshingOptions, materials: Materials, periodic: str
) -> tuple[BoundaryGraph, QuadMesh]:
    """Mesh; where the mesher has cut edges of one side of a periodic cell only, cut the other, too, and mesh anew."""
    mesh = mesh_boundaries(boundary, options, materials)
    for _ in range(4 if periodic != "none" else 0):
        again = rematch(boundary, mesh, periodic)
        if again is None:
            break
        boundary, mesh = again, mesh_boundaries(again, options, materials)
    return boundary, mesh


def thin_features(labels: LabelImage, mesh: QuadMesh, options: MeshOptions) -> str | None:
    """Say how many more quads there are than the sizes asked for would give, with the remedies; None if few.

    Parameters
    ----------
    labels : LabelImage
        The materials as meshed.
    mesh : QuadMesh
        Its mesh.
    options : MeshOptions
        Sizes in pixels.
    """
    sizes = dict.fromkeys(labels.materials.labels.tolist(), options.size)
    sizes |= {material_number(labels.materials, name): size for name, size in options.material_sizes.items()}
    expected = sum(
        np.count_nonzero(labels.labels == number) / min(size, options.boundary_size or size) ** 2
        for number, size in sizes.items()
    )
    if mesh.n_quads <= max(MANY_TIMES * expected, MANY_QUADS):
        return None
    return (
        f"thin features force {mesh.n_quads} quads, {mesh.n_quads / expected:.1f} times area / size^2: "
        "remove noise (min-pixels, min-length), ask for a smaller size, or drop or merge materials"
    )


class _Stopwatch:
    """Runs one stage after the other and keeps their times."""

    def __init__(self, progress: Progress | None) -> None:
        self.seconds: dict[str, float] = {}
        self._progress = progress

    def __call__(self, stage: str, work: Callable[..., T], *values: Any) -> T:
        if self._progress:
            self._progress(stage, STAGES.index(stage), len(STAGES))
        start = perf_counter()
        result = work(*values)
        self.seconds[stage] = perf_counter() - start
        return result


def _assert_feasible(image: LabelImage, options: SmoothingOptions) -> None:
    assert_solid(image)
    quads = image.labels.size / options.size**2
    if quads > MOST_QUADS:
        raise InputError(
            f"size {options.size:g} would need about {quads:.2g} quads for {image.labels.size} pixels: "
            f"at most {MOST_QUADS:.0e} are made; ask for a larger size or crop the picture"
        )
