"""From a picture to its mesh: one line a stage."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from time import perf_counter
from types import MappingProxyType
from typing import Any, Literal, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import aside
from .boundary import ExtractionOptions, extract_boundaries
from .denoise import DenoiseOptions, Removal, automatic_limits, list_removed, remove_noise
from .errors import InputError
from .meshing import EFFORTS, MeshingOptions, mesh_boundaries
from .model import BoundaryGraph, LabelImage, Materials, QuadMesh
from .periodic import DIRECTIONS, match_opposite_sides, rematch
from .reading import Picture, ReadOptions, read_picture
from .segmentation import Segmentation, SegmentationOptions, segment_picture
from .selection import Box, assert_solid, crop_image, drop_materials, material_number
from .smoothing import SmoothingOptions, smooth_boundaries

T = TypeVar("T")
Source: TypeAlias = "str | Path | NDArray[Any] | LabelImage"
#: called with the name of the stage that starts, its number from 0, and the number of stages
Progress: TypeAlias = Callable[[str, int, int], None]

STAGES = ("read", "segment", "denoise", "boundary", "smooth", "mesh")
MOST_QUADS = 200_000_000  #: more are refused before memory is
MANY_TIMES, MANY_QUADS = 4.0, 1000  #: quads over area / size^2, and in all, from which thin features are told


@dataclass(frozen=True)
class MeshOptions:
    """How a picture is meshed. Lengths are in pixels.

    Parameters
    ----------
    size : float
        Length of the final edges.
    boundary_size : float, optional
        The same on boundaries; `size` by default.
    material_sizes : mapping of (str or int) to float
        The same in single materials, by name or number.
    growth : float
        Largest ratio of the sizes of neighbouring elements.
    colors : "auto", "exact", int or sequence of RGB
        How colours become materials; see `SegmentationOptions`.
    min_pixels : "auto" or int
        Clusters of fewer pixels are noise if they are also shorter than `min_length`.
    min_length : "auto" or float
        Characteristic length of the shortest cluster that stays. `auto` leaves exact label pictures as they are.
    policy : str
        Which pair is joined at an ambiguous corner of four pixels; see `ExtractionOptions`.
    edge_ratio : float
        Largest ratio of the lengths of neighbouring edges on a boundary.
    max_shift : float
        How far smoothing moves a boundary at most.
    pixel_size : float
        Length of a pixel in the unit of the mesh.
    drop : sequence of str or int
        Materials that are left out: their boundary becomes a free border.
    drop_transparent : bool
        Whether pixels of alpha 0 are left out too.
    crop : tuple of int, optional
        Left, upper, right, lower bound of the part that is meshed, from the picture's upper left corner.
    frame : int, optional
        Which picture of a stack, counted from 0.
    periodic : "none", "x", "y" or "xy"
        Opposite sides get nodes at the same places, for a periodic cell; see `match_opposite_sides`.
    max_pixels : int
        Larger pictures are refused.
    effort : "fast", "normal" or "best"
        How far the mesh is optimised.
    threads : int
        Number of threads of the meshing stage; the mesh does not depend on it.
    """

    size: float = 4.0
    boundary_size: float | None = None
    material_sizes: Mapping[str | int, float] = field(default_factory=lambda: MappingProxyType({}))
    growth: float = 1.3
    colors: Any = "auto"
    min_pixels: int | Literal["auto"] = "auto"
    min_length: float | Literal["auto"] = "auto"
    policy: str = "minority"
    edge_ratio: float = 1.2
    max_shift: float = 1.0
    pixel_size: float = 1.0
    drop: tuple[str | int, ...] = ()
    drop_transparent: bool = False
    crop: Box | None = None
    periodic: str = "none"
    frame: int | None = None
    max_pixels: int = ReadOptions.max_pixels
    effort: str = "normal"
    threads: int = 1

    def __post_init__(self) -> None:
        if not (isfinite(self.pixel_size) and self.pixel_size > 0):
            raise InputError(f"pixel_size is {self.pixel_size}: give a length above 0")
        if self.periodic not in ("none", *DIRECTIONS):
            raise InputError(f"periodic is '{self.periodic}': give none, x, y or xy")
        # each stage checks its own options: now, not after minutes of work
        self.meshing(None)
        self.smoothing(None)
        self.segmentation()
        self.noise(True, (1, 1))
        ReadOptions(self.max_pixels, self.frame)
        ExtractionOptions(self.policy)

    def segmentation(self) -> SegmentationOptions:
        """Return the options of segmentation."""
        return SegmentationOptions(colors=self.colors, drop_transparent=self.drop_transparent)

    def noise(self, quantised: bool, shape: tuple[int, int]) -> DenoiseOptions:
        """Return the limits of noise in a picture of `shape`."""
        auto = automatic_limits(quantised, shape)
        asked = (self.min_pixels, self.min_length)
        if asked != ("auto", "auto") and "auto" in asked and not auto.removes:
            auto = automatic_limits(True, shape)  # one limit asked for switches noise removal on
        return DenoiseOptions(
            min_pixels=auto.min_pixels if self.min_pixels == "auto" else self.min_pixels,
            min_length=auto.min_length if self.min_length == "auto" else self.min_length,
        )

    def smoothing(self, materials: Materials | None) -> SmoothingOptions:
        """Return the options of smoothing."""
        return SmoothingOptions(
            size=self.size,
            boundary_size=self.boundary_size,
            growth=self.growth,
            edge_ratio=self.edge_ratio,
            max_shift=self.max_shift,
            material_sizes=self._sizes(materials),
            in_twelves=EFFORTS[self.effort].in_nine,
        )

    def meshing(self, materials: Materials | None) -> MeshingOptions:
        """Return the options of meshing."""
        return MeshingOptions(
            size=self.size,
            growth=self.growth,
            material_sizes=self._sizes(materials),
            effort=self.effort,
            threads=self.threads,
        )

    def _sizes(self, materials: Materials | None) -> dict[int, float]:
        if materials is None:  # only the values are checked
            return dict(enumerate(self.material_sizes.values()))
        return {material_number(materials, name): size for name, size in self.material_sizes.items()}


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
    aside.start()
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
        removed=list_removed(picture, clean),
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
