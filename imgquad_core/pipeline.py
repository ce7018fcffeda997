"""From a picture to its mesh: one line a stage."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import ahead
from .boundary import (
    ExtractionOptions,
    SmoothingOptions,
    Step,
    TrueShape,
    as_step,
    extract_boundaries,
    find_step,
    match_opposite_sides,
    rematch,
    smooth_boundaries,
    true_shape,
)
from .errors import InputError, TopologyError
from .frozen import FrozenMapping
from .geometry.corner_rule import corner_rule
from .jit import share_on_disk
from .mesher import MeshingOptions, mesh_boundaries
from .model import BoundaryGraph, LabelImage, Materials, QuadMesh
from .options import MeshOptions
from .orientation import SQUARE_ON, TURNS, turn_of_graph, turn_of_image
from .picture import (
    Absorbed,
    Absorption,
    Box,
    DenoiseOptions,
    Removal,
    Segmentation,
    SegmentationOptions,
    absorb_thin,
    areas_of_origin,
    as_told,
    assert_solid,
    crop_image,
    drop_materials,
    edit_materials,
    enlarged_labels,
    list_removed,
    remove_noise,
    segment_picture,
)
from .reading import Calibration, Picture, ReadOptions, picture_of, read_picture, size_note

Source: TypeAlias = "str | Path | NDArray[Any] | LabelImage | Picture"
T = TypeVar("T")
#: called with the name of the stage that starts, its number from 0, and the number of stages; later with fractions
#: of numbers, as parts of a long stage are done
Progress: TypeAlias = Callable[[str, float, int], None]
STAGES = ("read", "segment", "denoise", "absorb", "boundary", "smooth", "mesh")
MOST_QUADS = 200_000_000  #: more are refused before memory is
_OF_FILES = ("frame", "channel", "level", "scalars", "info_bar", "grain_angle")  # of `ReadOptions`
_MATCHES = 8  # rounds in which opposite sides of a periodic cell are cut alike


@dataclass(frozen=True, eq=False)
class Run:
    """All that a run has made: the values between the stages, too.

    Parameters
    ----------
    options : MeshOptions
        As asked; pixel size and origin are numbers.
    segmentation : Segmentation
        The picture as segmented, and what was chosen.
    picture : LabelImage
        The part that was asked for, with the materials that were asked for, before noise removal.
    step : tuple of float
        Width and height of data points, in pixels.
    noise : DenoiseOptions
        The limits of noise that were used.
    removed : tuple of Removal
        Noise that was removed, by material.
    clean : LabelImage
        The picture without noise.
    absorbed : tuple of Absorption
        What went to neighbours for the sake of the tolerance, by material.
    labels : LabelImage
        The materials as meshed.
    pixel_boundary, boundary : BoundaryGraph
        Before and after smoothing.
    square : tuple of float
        Width and height, in the unit of the mesh, of what `boundary` and `pixel_mesh` have as unit of length: a pixel,
        or a square of its shorter side.
    pixel_mesh : QuadMesh
        The mesh on `boundary`.
    mesh : QuadMesh
        The same in the unit of `options.pixel_size`.
    seconds : mapping of str to float
        Time of each of `STAGES` that was needed.
    calibration : Calibration
        What the file says of pixel size and place.
    notes : tuple of str
        What the reader chose or found, in words.
    too_wide : bool
        No part of the picture is as wide as the tolerance, which was left out.
    """

    options: MeshOptions
    segmentation: Segmentation
    picture: LabelImage
    step: Step
    noise: DenoiseOptions
    removed: tuple[Removal, ...]
    clean: LabelImage
    absorbed: tuple[Absorption, ...]
    labels: LabelImage
    pixel_boundary: BoundaryGraph
    boundary: BoundaryGraph
    square: tuple[float, float]
    pixel_mesh: QuadMesh
    mesh: QuadMesh
    seconds: Mapping[str, float]
    calibration: Calibration = field(default_factory=Calibration)
    notes: tuple[str, ...] = ()
    too_wide: bool = False


class Memory:
    """What the stages of former runs gave: given again, not made, where a stage is asked for the same.

    ``memory["clean"]`` is the value that the stage `clean` gave last; names are those of the fields of `Run`.
    """

    def __init__(self) -> None:
        self._made: dict[str, tuple[tuple[Any, ...], Any]] = {}

    def __getitem__(self, name: str) -> Any:
        return self._made[name][1]

    def __call__(self, name: str, make: Callable[..., T], *of: Any) -> T:
        """Return ``make(*of)``: from memory where the last one was made of equal options and the very same values."""
        if name not in self._made or self._made[name][0] != of:
            self._made[name] = of, make(*of)
        return self[name]  # type: ignore[no-any-return]


def mesh_image(image: Source, options: MeshOptions | None = None) -> QuadMesh:
    """Turn a picture into an all-quadrilateral mesh of its materials.

    Parameters
    ----------
    image : array_like, LabelImage, Picture or path
        The picture, row 0 on top: integer labels or greys (rows, columns), colours (rows, columns, 3 or 4), a
        `LabelImage`, what `read_picture` gave, or a file.
    options : MeshOptions, optional
        How it is meshed.

    Returns
    -------
    QuadMesh
        Convex, counter-clockwise quads on [0, columns] x [0, rows] times `options.pixel_size`, y up, from
        `options.origin` on.

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


@ahead.compiling
def run(
    source: Source | Segmentation,
    options: MeshOptions | None = None,
    progress: Progress | None = None,
    memory: Memory | None = None,
) -> Run:
    """Do what `mesh_image` does, and keep what the stages gave.

    Parameters
    ----------
    source : array_like, LabelImage, Picture, path or Segmentation
        As for `mesh_image`; a picture that is segmented already is taken as it is.
    options : MeshOptions, optional
        As for `mesh_image`.
    progress : callable, optional
        Called as each stage starts, and as parts of the mesh are there.
    memory : Memory, optional
        Of former runs, whose values are taken where they are the same.
    """
    made = Memory() if memory is None else memory
    timed = _Stopwatch(progress)
    found, picture, options, calibration, notes = _begun(source, options, timed, made)
    with timed("denoise"):
        step = made("step", step_of, picture, options.step, options.policy)
        noise = options.noise(found.quantised, found.image.shape).scaled(step)
        clean = made("clean", remove_noise, picture, noise)
        removed = made("removed", list_removed, picture, clean, noise.policy, noise.step)
    with timed("absorb"):
        absorbed = made("absorbed", absorb_thin, clean, options.absorbing(picture.materials, noise.step))
    labels = made("labels", drop_materials, absorbed.image, options.drop)
    asked = replace(options, tolerance=0.0) if absorbed.too_wide else options
    smoothing = asked.smoothing(picture.materials, (step[0] * absorbed.times, step[1] * absorbed.times))
    meshing = options.meshing(picture.materials)
    true = true_shape(labels.shape, options.pixel_sides)
    with timed("boundary"):
        extraction = ExtractionOptions(options.policy, noise.step * absorbed.times)
        staircase = made("pixel_boundary", extract_simplified, clean, absorbed, options.drop, extraction)
    with timed("smooth"):
        boundary = made("boundary", smooth, staircase, smoothing, true, options.periodic)
    with timed("mesh"):
        fill = partial(fill_boundaries, told=timed.within("mesh"))
        boundary, mesh = made("mesh", fill, boundary, meshing, labels.materials, options.periodic)
    return Run(
        options=options,
        segmentation=found,
        picture=picture,
        step=step,
        noise=noise,
        removed=removed,
        clean=clean,
        absorbed=absorbed.materials,
        labels=labels,
        pixel_boundary=staircase,
        boundary=boundary,
        square=true.square,
        pixel_mesh=mesh,
        mesh=_placed(mesh, true.square, options.corner),
        seconds=FrozenMapping(timed.seconds),
        calibration=calibration,
        notes=notes,
        too_wide=absorbed.too_wide,
    )


def read_source(source: Source, options: ReadOptions | None = None) -> Picture | LabelImage:
    """Return the picture that a path names or an array holds; a `Picture` or `LabelImage` as it is."""
    if isinstance(source, (str, Path)):
        return read_picture(source, options)
    if isinstance(source, (LabelImage, Picture)):
        return source
    for name in _OF_FILES if options else ():
        if (asked := getattr(options, name)) != getattr(ReadOptions(), name):
            raise InputError(f"{name} is {asked!r}, which is of files; give the array that it means")
    try:
        return picture_of(np.asanyarray(source))
    except InputError:
        raise
    except ValueError as error:  # rows of different lengths
        raise InputError(f"the picture is no array ({error}); give rows of one length") from error


def segment_source(raw: Picture | LabelImage, options: SegmentationOptions | None = None) -> Segmentation:
    """Segment what `read_source` gave; names and crystals of its file stay."""
    found = segment_picture(raw, options)
    return replace(found, image=as_told(found.image, raw)) if isinstance(raw, Picture) else found


def extract(labels: LabelImage, options: ExtractionOptions | None = None) -> BoundaryGraph:
    """Return the pixel boundary of a picture that has pixels to mesh; the order of all in it hangs on the content."""
    assert_solid(labels)
    options = options or ExtractionOptions()
    turn = turn_of_image(labels, options.policy)
    return turn.graph_back(extract_boundaries(turn.image(labels), options))


def step_of(picture: LabelImage, step: Any, policy: str) -> Step:
    """Return width and height of the picture's data points: as asked for, or as seen."""
    return as_step(step) if step != "auto" else find_step(extract(picture, ExtractionOptions(policy)))


def extract_simplified(
    clean: LabelImage, absorbed: Absorbed, drop: Sequence[str | int], options: ExtractionOptions
) -> BoundaryGraph:
    """Return the pixel boundary of a picture whose thin parts were absorbed.

    Parameters
    ----------
    clean : LabelImage
        Before they were.
    absorbed : Absorbed
        After.
    drop : sequence of str or int
        Materials that are left out.
    options : ExtractionOptions
        What to do with ambiguous places.

    Returns
    -------
    BoundaryGraph
        Of `absorbed.enlarged`; the pixels of a region are those of what it is the rest of, which smoothing restores;
        in noisy pictures its own.
    """
    enlarged = drop_materials(absorbed.enlarged, drop)
    graph = extract(enlarged, options)
    if not absorbed.materials or absorbed.is_noisy:
        return graph
    turn = turn_of_image(enlarged, options.policy)  # regions are numbered as they come there
    before = np.ascontiguousarray(turn.picture(enlarged_labels(clean.labels, absorbed.times)))
    areas = areas_of_origin(before, turn.image(enlarged).labels, corner_rule(options.policy, options.step))
    return replace(graph, region_pixels=np.rint(areas).astype(np.int64))


def smooth(
    graph: BoundaryGraph, options: SmoothingOptions, true: TrueShape | None = None, periodic: str = "none"
) -> BoundaryGraph:
    """Return smooth boundaries cut into edges, in true shape, with opposite sides alike where they are periodic."""
    shape = graph.shape if true is None else true.shape
    _assert_feasible(shape, options.size)
    oblong = options.step != "auto" and len(set(as_step(options.step))) > 1  # width and height stay what they are
    turn = turn_of_graph(graph, SQUARE_ON if oblong else TURNS)
    smoothed = smooth_boundaries(turn.graph(graph), options, turn.shape(shape))
    if periodic != "none":
        smoothed = match_opposite_sides(smoothed, turn.directions(periodic))
    return turn.graph_back(smoothed)


def fill_boundaries(
    boundary: BoundaryGraph,
    options: MeshingOptions,
    materials: Materials,
    periodic: str = "none",
    told: Callable[[float], None] | None = None,
) -> tuple[BoundaryGraph, QuadMesh]:
    """Mesh; where the mesher has cut edges of one side of a periodic cell only, cut the other, too, and mesh anew."""
    turn = turn_of_graph(boundary)
    graph = turn.graph(boundary)
    mesh = mesh_boundaries(graph, options, materials, told)
    rounds = 0
    while periodic != "none" and (again := rematch(graph, mesh, turn.directions(periodic))) is not None:
        if rounds == _MATCHES:
            raise TopologyError(f"opposite sides of the cell differ after {rounds} rounds in which they were cut alike")
        if rounds >= _MATCHES // 2:  # only what must be cut is: wishes of both sides may go on and on
            options = replace(options, tuning=options.tuning._replace(wishes=0))
        graph, mesh = again, mesh_boundaries(again, options, materials)
        boundary = turn.graph_back(graph)
        rounds += 1
    return boundary, turn.mesh_back(mesh, boundary.shape)


class _Stopwatch:
    """Tells which stage starts, and keeps their times."""

    def __init__(self, progress: Progress | None) -> None:
        self.seconds: dict[str, float] = {}
        self._progress = progress

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        if self._progress:
            self._progress(stage, STAGES.index(stage), len(STAGES))
        start = perf_counter()
        yield
        self.seconds[stage] = perf_counter() - start

    def within(self, stage: str) -> Callable[[float], None] | None:
        """Return what tells the share of a stage that is done."""
        if self._progress is None:
            return None
        progress, number = self._progress, STAGES.index(stage)
        return lambda share: progress(stage, number + share, len(STAGES))


class _Begun(NamedTuple):
    """The part of a picture that is meshed, and what its file says."""

    segmentation: Segmentation
    picture: LabelImage
    options: MeshOptions
    calibration: Calibration
    notes: tuple[str, ...]


def _begun(source: Source | Segmentation, options: MeshOptions | None, timed: _Stopwatch, made: Memory) -> _Begun:
    """Read and segment a picture, edit its materials, crop it; pixel size and place are numbers in the options."""
    options = MeshOptions() if options is None else options
    if not isinstance(options, MeshOptions):
        raise InputError(f"options is {options!r}: give a MeshOptions")
    raw = source if isinstance(source, Segmentation) else _read(source, options, timed)
    found = raw if isinstance(raw, Segmentation) else _segmented(raw, options, timed, made)
    crop = None if isinstance(raw, Picture) and raw.window else options.crop  # what was read may be the part already
    edited = made("edited", edit_materials, found.image, options.editing())
    picture = made("picture", crop_image, edited, crop) if crop else edited
    calibration, notes = _what_the_file_says(raw, crop, options)
    placed = options.placed(calibration, raw.name if isinstance(raw, Picture) else "the picture")
    return _Begun(found, picture, placed, calibration, notes)


def _read(source: Source, options: MeshOptions, timed: _Stopwatch) -> Picture | LabelImage:
    with timed("read"):
        return read_source(source, options.reading())


def _segmented(raw: Picture | LabelImage, options: MeshOptions, timed: _Stopwatch, made: Memory) -> Segmentation:
    with timed("segment"):
        return made("segmentation", segment_source, raw, options.segmentation())


def _what_the_file_says(
    raw: Picture | LabelImage | Segmentation, crop: Box | None, options: MeshOptions
) -> tuple[Calibration, tuple[str, ...]]:
    """Return pixel size and place of the part that is meshed, and what the reader tells."""
    if not isinstance(raw, Picture):
        return Calibration(), ()
    calibration = raw.calibration.cropped(crop, raw.shape[0]) if crop else raw.calibration
    told = size_note(calibration, options.pixel_size)
    return calibration, (*raw.notes, told) if told else raw.notes


def _placed(mesh: QuadMesh, square: tuple[float, float], corner: tuple[float, float]) -> QuadMesh:
    mesh = mesh.scaled(square) if square != (1.0, 1.0) else mesh
    return mesh.moved(corner) if corner != (0.0, 0.0) else mesh


def _assert_feasible(shape: tuple[int, int], size: float) -> None:
    rows, cols = shape
    quads = rows * cols / size**2
    if quads > MOST_QUADS:
        raise InputError(
            f"size {size:g} would need about {quads:.2g} quads for {cols} x {rows} pixels: at most {MOST_QUADS:.0e} "
            "are made; ask for a larger size, crop the picture, or mend its spacing"
        )


def share_compiled() -> float:
    """Return which share of all kernels an earlier run has left on disk, from 0 to 1: this module imports them all."""
    return share_on_disk()
